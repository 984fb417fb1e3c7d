"""Random calls of FMI 2.0 and FMI 3.0 against the C sources of FMUs, under sanitizers (tests/fuzz/fmi/fuzz.h).

    python tests/helpers/fuzzing.py [SEQUENCES] [--form FORM] [--plain] [--seed SEED] [--jobs N] [--trace]

A sequence is the life of one pair of instances. A seed that fails is repeated by `--seed SEED 50`, and `--trace` prints
its calls. `--plain` does without the sanitizers, which take four fifths of the time.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy

from branched_springs import BRANCHED
from fmu_tools import SPRING
from kernel_tools import compiled
from native_tools import write_file, write_native
from springs import TABLE
from strandspring.compiled.images import SPRING_FILES, SYSTEM_FILES
from strandspring.compiled.sources import c_sources, fmi_headers
from strandspring.fmu.native.block import NativeForm, values_source
from strandspring.fmu.native.native_fmu import native_contents
from strandspring.fmu.system.system_native import system_contents
from strandspring.model.modelfile import ModelFile
from system_fmu_tools import BOX, BOX_OPTIONS

FUZZER = Path(__file__).parents[1] / "fuzz/fmi"
# Variables that are not initialized get a value of their own, so that whoever uses them is noticed.
SANITIZED = (
    "-O1", "-g", "-fno-omit-frame-pointer", "-ftrivial-auto-var-init=pattern",
    "-fsanitize=address,undefined", "-fsanitize=float-cast-overflow", "-fno-sanitize-recover=all",
)  # fmt: skip
PLAIN = ("-O2", "-g", "-ftrivial-auto-var-init=pattern")
# What the FMU takes from the C library is counted like what it takes from its host.
COUNTED = ("-Dcalloc=library_calloc", "-Dfree=library_free", "-Wno-sign-conversion")
# Freed memory is kept to find who uses it: 32 MB instead of 256, which is still that of a hundred instances.
OPTIONS = {"ASAN_OPTIONS": "detect_leaks=1:quarantine_size_mb=32", "UBSAN_OPTIONS": "print_stacktrace=1"}
RUN = 50  # sequences that share a seed (host.c)

# FMUs by name: the spring and the form of its FMU; None for a system of bodies on mounts. FMI 3.0 has arrays, whose
# references are the less simple ones.
FORMS = {
    "spring": (SPRING, NativeForm(arrays=True)),
    "table": (TABLE, NativeForm(arrays=True)),
    "states": (SPRING, NativeForm(arrays=True, with_states=True)),
    "real-time": (SPRING, NativeForm(arrays=True, real_time=True)),
    "no-energy": (SPRING, NativeForm(arrays=True, real_time=True, no_energy=True)),
    "branches": (BRANCHED["both"], NativeForm(arrays=True)),
    "branches-states": (BRANCHED["table"], NativeForm(arrays=True, with_states=True)),
    "system": None,
}

# How often each call was done, discarded and refused, and other counts.
Statistics = dict[str, Any]


def write_sources(form: str, folder: Path) -> Path:
    """The C sources of the FMUs of a form, of FMI 2.0 and FMI 3.0 with one GUID, and what the fuzzer knows of them."""
    made = FORMS[form]
    if made is None:
        for name, content in system_contents(BOX, BOX_OPTIONS, ()).items():
            if name == "modelDescription.xml" or name.startswith("sources/"):
                write_file(folder / name.removeprefix("sources/"), content)
        known = {"REAL_TIME": 0, "NO_ENERGY": 0}
    else:
        parameters, of_fmu = made
        model = ModelFile("spring", parameters)
        write_native(folder, native_contents(model, (), zero=0.0, with_states=of_fmu.with_states))
        known = {"REAL_TIME": int(of_fmu.real_time), "NO_ENERGY": int(of_fmu.no_energy)}
    for name, content in {**c_sources((SPRING_FILES if made else SYSTEM_FILES)[3]), **fmi_headers(3)}.items():
        if not name.endswith("system_values.h"):
            write_file(folder / (name.removeprefix("core/c/") if made else name), content)
    description = fmpy.read_model_description(str(folder), validate=False)
    if made is not None:
        (folder / "fmu/spring_values.h").write_text(values_source(model, str(description.guid), of_fmu))
    (folder / "fuzz_model.h").write_text(_description(description, known))
    return folder


def _description(description: fmpy.model_description.ModelDescription, known: dict[str, int]) -> str:
    variables = sorted(description.modelVariables, key=lambda variable: int(variable.valueReference))
    states = {v.derivative.name for v in variables if v.derivative is not None}

    def causality(v: fmpy.model_description.ScalarVariable) -> str:
        if v.name in states:
            return "O" if v.causality == "output" else "s"
        return "r" if v.derivative is not None else str(v.causality)[0]

    entries = [
        f"V({json.dumps(v.name)}, '{v.type[0]}', '{causality(v)}', {int(v.variability == 'tunable')}, "
        f"{float(v.start or 0.0) if v.type == 'Real' else 0.0!r})"
        for v in variables
    ]
    arrays = {"ELASTIC": "kE_", "AMPLIFIER": "kA_", "KNOTS": "FE_knots_", "BRANCHES": "branch_"}
    known |= {name: sum(v.name.startswith(array) for v in variables) for name, array in arrays.items()}
    known |= {"VARIABLES": len(variables), "STATES": len(states)}
    table = " \\\n    ".join(entries)
    return (
        f"#define MODEL_GUID {json.dumps(str(description.guid))}\n"
        f"#define MODEL_LARGEST_STEP {BOX_OPTIONS.largest_step!r} /* of systems [s] */\n"
        f"enum {{ {', '.join(f'MODEL_{name} = {count}' for name, count in known.items())} }};\n"
        f"#define MODEL_TABLE(V) \\\n    {table}\n"
    )


def program_of(form: str, folder: Path, flags: tuple[str, ...] = SANITIZED) -> Path:
    """The fuzzer of a form, with its sources and objects in the folder; what is there already is not made again."""
    sources, objects = folder / "sources", folder / "objects"
    if not sources.exists():
        write_sources(form, sources)
    objects.mkdir(exist_ok=True)
    system = FORMS[form] is None
    inner, names = ("fmu/system/c", "system_all{}.c") if system else ("", "fmi{}_all.c")
    at, headers = sources / inner, sources / ("core/c" if system else "")
    of_fmus = [at / names.format(version) for version in (("", 3) if system else (2, 3))]
    options = ("-D_POSIX_C_SOURCE=200809L", f"-I{sources}", f"-I{at}", *(f"-I{headers}/fmi{fmi}" for fmi in (2, 3)))

    def compile_unit(unit: Path) -> Path:
        made = objects / f"{unit.stem}.o"
        counted = COUNTED if unit in of_fmus else ()
        return made if made.exists() else compiled(made, *flags, *counted, *options, "-c", unit)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        units = list(pool.map(compile_unit, [*of_fmus, *FUZZER.glob("*.c")]))
    return compiled(folder / "fuzz", *flags, *units, "-lm")


@dataclass(frozen=True)
class Outcome:
    """What a run of the fuzzer gave: what it found, if anything, and statistics otherwise."""

    found: str
    statistics: Statistics


def run(program: Path, seed: int, sequences: int, *more: str) -> Outcome:
    """Do so many sequences from a seed on."""
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


def main() -> int:
    parser = argparse.ArgumentParser(description="Random calls of FMI against FMUs.")
    parser.add_argument("sequences", nargs="?", type=int, default=1_000_000)
    parser.add_argument("--form", choices=FORMS, default="spring")
    parser.add_argument("--plain", action="store_true")
    parser.add_argument("--seed", type=int, default=1_000_000)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--trace", action="store_true")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="strandspring-fuzz-") as temporary:
        program = program_of(given.form, Path(temporary), PLAIN if given.plain else SANITIZED)
        if given.trace:
            print(run(program, given.seed, given.sequences, "trace").found)
            return 0
        shares = [len(range(given.sequences)[k :: given.jobs]) for k in range(given.jobs)]
        seeds = [given.seed + k * (given.sequences // RUN + 1) for k in range(given.jobs)]
        with ThreadPoolExecutor(given.jobs) as pool:
            outcomes = list(pool.map(lambda seed, share: run(program, seed, share), seeds, shares))
    print(f"{given.jobs} jobs, first seeds {seeds}")
    if found := "".join(outcome.found for outcome in outcomes):
        print(found, file=sys.stderr)
        return 1
    print(json.dumps(add_up(outcomes), indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
