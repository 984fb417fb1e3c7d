"""Random sequences of FMI calls against the C sources of FMUs, under sanitizers (tests/fuzz/fmi/fuzz.h).

    python tests/helpers/fuzzing.py [SEQUENCES] [--form FORM] [--plain] [--seed SEED] [--jobs N] [--trace]

A sequence is the life of one instance. The test does a share of the million that this does by default; a seed that
fails is repeated by `--seed SEED 1`, and `--trace` prints its calls. FORM is native, table (FE by forces at knots),
states (omega and absorbed_energy are continuous states), one of FORMS3 (FMI 3.0 beside FMI 2.0, by fmi3/ there), system
(bodies on mounts, by system/ there) or system-fmi3 (as FORMS3). `--plain` does without the sanitizers, which take four
fifths of the time.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy

from branched_springs import BRANCHED
from fmu_tools import OTHER, SPRING
from kernel_tools import compiled
from native_tools import library, write_file, write_native
from springs import TABLE
from strandspring import SpringParameters
from strandspring.compiled.images import SPRING_FILES, SYSTEM_FILES
from strandspring.compiled.sources import c_sources, fmi_headers
from strandspring.fmu.native.block import USUAL, NativeForm, values_source
from strandspring.fmu.native.native_fmu import native_contents
from strandspring.fmu.system.system_native import system_contents
from strandspring.fmu.system.system_variables import SystemFmuOptions
from strandspring.model.modelfile import ModelFile
from strandspring.vibration.bodies.mounted import MountedSystem
from system_fmu_tools import BOX, BOX_OPTIONS

FUZZER = Path(__file__).parents[1] / "fuzz/fmi"
# Variables that are not initialized get a value of their own, so that whoever uses them is noticed.
SANITIZED = (
    "-O1", "-g", "-fno-omit-frame-pointer", "-ftrivial-auto-var-init=pattern",
    "-fsanitize=address,undefined", "-fsanitize=float-cast-overflow", "-fno-sanitize-recover=all",
)  # fmt: skip
PLAIN = ("-O2", "-g", "-ftrivial-auto-var-init=pattern")
# What the FMU takes from the C library is counted like what it takes from its host.
COUNTED = ("-Dcalloc=library_calloc", "-Dfree=library_free")
# What the fuzzers of systems and of FMI 3.0 have in common with that of FMI 2.0.
SHARED = tuple(FUZZER / f"{name}.c" for name in ("random", "host", "oracle", "bytes", "watch"))
# Freed memory is kept to find who uses it: 32 MB instead of 256, which is still that of a hundred instances.
OPTIONS = {"ASAN_OPTIONS": "detect_leaks=1:quarantine_size_mb=32", "UBSAN_OPTIONS": "print_stacktrace=1"}
# Sequences that share a seed (RUN in watch.c).
RUN = 50

# FMUs by name: the spring, and whether omega and absorbed_energy are continuous states.
FORMS = {"native": (SPRING, False), "table": (TABLE, False), "states": (SPRING, True)}

# The same of FMI 3.0, with the form of the FMU: with arrays, whose references are the less simple ones.
FORMS3 = {
    "fmi3": (SPRING, NativeForm(arrays=True)),
    "fmi3-table": (TABLE, NativeForm(arrays=True)),
    "fmi3-states": (SPRING, NativeForm(arrays=True, with_states=True)),
    "fmi3-real-time": (SPRING, NativeForm(arrays=True, real_time=True)),
    "fmi3-no-energy": (SPRING, NativeForm(arrays=True, real_time=True, no_energy=True)),
    "fmi3-branches": (BRANCHED["both"], NativeForm(arrays=True)),
    "fmi3-branches-states": (BRANCHED["table"], NativeForm(arrays=True, with_states=True)),
}

# How often each call was done, discarded and refused, and other counts.
Statistics = dict[str, Any]


def write_sources(folder: Path, parameters: SpringParameters = SPRING, with_states: bool = False) -> Path:
    """The C sources of the native FMU of a spring, and what its model description says of it for the fuzzer."""
    write_native(folder, native_contents(ModelFile("spring", parameters), (), zero=0.0, with_states=with_states))
    (folder / "fuzz_model.h").write_text(_description(folder))
    return folder


def write_system_sources(folder: Path, system: MountedSystem = BOX, options: SystemFmuOptions = BOX_OPTIONS) -> Path:
    """The same for the FMU of a system, whose sources keep their folders."""
    for name, content in system_contents(system, options, ()).items():
        if name == "modelDescription.xml" or name.startswith("sources/"):
            write_file(folder / name.removeprefix("sources/"), content)
    text = _description(folder) + f"#define MODEL_LARGEST_STEP {options.largest_step!r}\n"
    (folder / "fuzz_model.h").write_text(text)
    return folder


def write_system_pair_sources(folder: Path) -> Path:
    """The same for the FMUs of FMI 2.0 and FMI 3.0 of one system, which have one GUID here."""
    write_system_sources(folder)
    for path, content in {**c_sources(SYSTEM_FILES[3]), **fmi_headers(3)}.items():
        if not path.endswith("system_values.h"):
            write_file(folder / path, content)
    with (folder / "fuzz_model.h").open("a") as file:
        file.write("enum { MODEL_REAL_TIME, MODEL_NO_ENERGY = 0 };\n")
    return folder


def write_pair_sources(folder: Path, parameters: SpringParameters = SPRING, form: NativeForm = USUAL) -> Path:
    """The same for the FMUs of FMI 2.0 and FMI 3.0 of one spring, which have one GUID here."""
    write_sources(folder, parameters, form.with_states)
    for path, content in {**c_sources(SPRING_FILES[3]), **fmi_headers(3)}.items():
        write_file(folder / path.removeprefix("core/c/"), content)
    guid = fmpy.read_model_description(str(folder), validate=False).guid
    (folder / "fmu/spring_values.h").write_text(values_source(ModelFile("spring", parameters), str(guid), form))
    flags = f"enum {{ MODEL_REAL_TIME = {int(form.real_time)}, MODEL_NO_ENERGY = {int(form.no_energy)} }};\n"
    with (folder / "fuzz_model.h").open("a") as file:
        file.write(flags)
    return folder


def _description(folder: Path) -> str:
    description = fmpy.read_model_description(str(folder), validate=False)
    variables = sorted(description.modelVariables, key=lambda variable: int(variable.valueReference))
    starts = [float(v.start or 0.0) if v.type == "Real" else 0.0 for v in variables]
    states = {v.derivative.name for v in variables if v.derivative is not None}

    def causality(v: fmpy.model_description.ScalarVariable) -> str:
        if v.name in states:
            return "O" if v.causality == "output" else "s"
        return "r" if v.derivative is not None else str(v.causality)[0]

    entries = [
        f"V({json.dumps(v.name)}, '{v.type[0]}', '{causality(v)}', {int(v.variability == 'tunable')}, {start!r})"
        for v, start in zip(variables, starts, strict=True)
    ]
    counts = {
        "VARIABLES": len(variables),
        **{
            name: sum(v.name.startswith(array) for v in variables)
            for name, array in (
                ("ELASTIC", "kE_"),
                ("AMPLIFIER", "kA_"),
                ("KNOTS", "FE_knots_"),
                ("BRANCHES", "branch_"),
            )
        },
        "INPUTS": sum(v.causality == "input" for v in variables),
        "STATES": len(states),
    }
    return "\n".join(
        [
            f"#define MODEL_GUID {json.dumps(str(description.guid))}",
            f"enum {{ {', '.join(f'MODEL_{name} = {count}' for name, count in counts.items())} }};",
            "#define MODEL_TABLE(V) \\\n    " + " \\\n    ".join(entries),
            "",
        ]
    )


def build(sources: Path, folder: Path, flags: tuple[str, ...] = SANITIZED) -> Path:
    """The fuzzer with the FMU that the sources make."""
    return _build([sources / "fmi2_all.c"], [*FUZZER.glob("*.c")], folder, flags)


def build_pairs(sources: Path, folder: Path, flags: tuple[str, ...] = SANITIZED) -> Path:
    """The fuzzer of pairs of FMUs, of FMI 2.0 and FMI 3.0, that the sources make."""
    return _build([sources / "fmi2_all.c", sources / "fmi3_all.c"], [*SHARED, *FUZZER.glob("fmi3/*.c")], folder, flags)


def build_system_pairs(sources: Path, folder: Path, flags: tuple[str, ...] = SANITIZED) -> Path:
    """The same of FMUs of systems."""
    of_fmus = [sources / "fmu" / "system" / "c" / name for name in ("system_all.c", "system_all3.c")]
    own = [*SHARED, *FUZZER.glob("fmi3/*.c"), FUZZER / "system" / "exchange2.c"]
    more = ("-Wno-sign-conversion", f"-I{sources}", *(f"-I{sources}/core/c/fmi{fmi}" for fmi in (2, 3)))
    return _build(of_fmus, own, folder, (*flags, *more))


def _build(of_fmus: list[Path], own: list[Path], folder: Path, flags: tuple[str, ...]) -> Path:
    """A fuzzer of its own units and those of FMUs, whose sources lie in one folder."""
    folder.mkdir()
    at = of_fmus[0].parent
    options = ("-D_POSIX_C_SOURCE=200809L", f"-I{at}", *(f"-I{at}/fmi{fmi}" for fmi in (2, 3)))

    def compile_unit(unit: Path) -> Path:
        counted = COUNTED if unit in of_fmus else ()
        return compiled(folder / f"{unit.stem}.o", *flags, *counted, *options, "-c", unit)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return link(list(pool.map(compile_unit, [*of_fmus, *own])), folder / "fuzz", flags)


def build_system(sources: Path, folder: Path, flags: tuple[str, ...] = SANITIZED) -> Path:
    """The fuzzer of systems with the FMU that the sources make."""
    folder.mkdir()
    includes = (f"-I{sources}", f"-I{sources}/core/c/fmi2", "-D_POSIX_C_SOURCE=200809L")
    objects = [
        compiled(folder / f"{unit.stem}.o", *flags, *includes, "-c", unit)
        for unit in (*SHARED, FUZZER / "system" / "systems.c")
    ]
    of_fmu = sources / "fmu" / "system" / "c" / "system_all.c"
    objects.append(compiled(folder / "fmu.o", *flags, *COUNTED, "-Wno-sign-conversion", "-c", of_fmu))
    return link(objects, folder / "fuzz", flags)


def link(objects: list[Path], program: Path, flags: tuple[str, ...] = SANITIZED) -> Path:
    return compiled(program, *flags, *objects, "-lm", "-ldl")


@dataclass(frozen=True)
class Outcome:
    """What a run of the fuzzer gave: what it found, if anything, and statistics otherwise."""

    found: str
    statistics: Statistics


def run(program: Path, seed: int, sequences: int, *more: str) -> Outcome:
    """Do so many sequences from a seed on, beside another FMU."""
    other = library(OTHER)
    return run_alone(program, seed, sequences, str(other.path), other.guid, *more)


def run_alone(program: Path, seed: int, sequences: int, *more: str) -> Outcome:
    """The same of a fuzzer of systems or of pairs, which takes no other FMU."""
    command = [str(program), str(seed), str(sequences), *more]
    done = subprocess.run(
        command, capture_output=True, text=True, errors="replace", env={**os.environ, **OPTIONS}, check=False
    )
    if done.returncode == 0:
        return Outcome(done.stderr, json.loads(done.stdout))
    return Outcome(f"exit status {done.returncode}\n{done.stderr}", {})


def add_up(outcomes: Sequence[Outcome]) -> Statistics:
    """The statistics of several runs in one."""
    parts = [outcome.statistics for outcome in outcomes]
    return {
        name: sum(part[name] for part in parts)
        if isinstance(value, int)
        else {call: sum(part[name][call] for part in parts) for call in value}
        for name, value in parts[0].items()
    }


def program_of(form: str, folder: Path, flags: tuple[str, ...]) -> Path:
    """The fuzzer of a form, with its sources and objects in the folder."""
    sources, objects = folder / "sources", folder / "objects"
    if form == "system":
        return build_system(write_system_sources(sources), objects, flags)
    if form == "system-fmi3":
        return build_system_pairs(write_system_pair_sources(sources), objects, flags)
    if form in FORMS3:
        return build_pairs(write_pair_sources(sources, *FORMS3[form]), objects, flags)
    return build(write_sources(sources, *FORMS[form]), objects, flags)


def main() -> int:
    parser = argparse.ArgumentParser(description="Random sequences of FMI calls against FMUs.")
    parser.add_argument("sequences", nargs="?", type=int, default=1_000_000)
    parser.add_argument("--form", choices=(*FORMS, *FORMS3, "system", "system-fmi3"), default="native")
    parser.add_argument("--plain", action="store_true")
    parser.add_argument("--seed", type=int, default=1_000_000)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--trace", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="strandspring-fuzz-") as temporary:
        program = program_of(given.form, Path(temporary), PLAIN if given.plain else SANITIZED)
        run_one = run_alone if given.form.startswith("system") or given.form in FORMS3 else run
        if given.trace:
            print(run_one(program, given.seed, given.sequences, "trace").found)
            return 0
        shares = [range(given.sequences)[k :: given.jobs] for k in range(given.jobs)]
        seeds = [given.seed + k * (given.sequences // RUN + 1) for k in range(given.jobs)]
        begin = time.perf_counter()
        with ThreadPoolExecutor(given.jobs) as pool:
            outcomes = list(
                pool.map(lambda job: run_one(program, job[0], len(job[1])), zip(seeds, shares, strict=True))
            )
    print(f"{time.perf_counter() - begin:.0f} s, {given.jobs} jobs, first seeds {seeds}")
    for outcome in outcomes:
        if outcome.found:
            print(outcome.found, file=sys.stderr)
    if any(outcome.found for outcome in outcomes):
        return 1
    print(json.dumps(add_up(outcomes), indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
