"""Random calls of FMI 2.0 and FMI 3.0 against the C sources of an FMU, compiled with them (fmi/fuzz.c)."""

from __future__ import annotations

import json
import os
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy

import strandspring
from branched_springs import BRANCHES, SECOND
from springs import MOUNT, TABLE
from strandspring.compiled.images import SPRING_FILES, SYSTEM_FILES
from strandspring.compiled.sources import c_sources, fmi_headers
from strandspring.core.parameters import SpringParameters
from strandspring.fmu.native.block import values_source
from strandspring.fmu.native.native_fmu import native_contents
from strandspring.fmu.system.system_native import system_contents
from strandspring.fmu.system.system_variables import ForceInput, SystemFmuOptions
from strandspring.model.modelfile import ModelFile
from strandspring.vibration.description.system_file import load_system_file

FUZZER = Path(__file__).parent / "fmi" / "fuzz.c"
BOX = Path(strandspring.__file__).parent / "examples/systems/electronics_box.toml"
# Variables that are not initialized get a value of their own, so that whoever uses them is noticed.
ADDRESSES = ("-O1", "-g", "-ftrivial-auto-var-init=pattern", "-fsanitize=address", "-fno-omit-frame-pointer")
SANITIZED = (*ADDRESSES, "-fsanitize=undefined", "-fsanitize=float-cast-overflow", "-fno-sanitize-recover=all")
# What the FMU takes from the C library is counted like what it takes from its host.
COUNTED = ("-Dcalloc=library_calloc", "-Dmalloc=library_malloc", "-Dfree=library_free", "-Wno-sign-conversion")
STRICT = ("-std=c11", "-ffp-contract=off", "-D_POSIX_C_SOURCE=200809L", "-Wall", "-Wextra", "-Werror", "-Wconversion")
# Freed memory is kept to find who uses it: 32 MB instead of 256, which is still that of a hundred instances.
OPTIONS = {"ASAN_OPTIONS": "detect_leaks=1:quarantine_size_mb=32", "UBSAN_OPTIONS": "print_stacktrace=1"}
RUN = 50  # sequences that share a seed (fuzz.c)

BRANCHED = {"second": SECOND, "branches": BRANCHES[:1]}
SYSTEM_OPTIONS = SystemFmuOptions(1e-4, 1e-3, forces=(ForceInput("recoil", 0, (0.0, 0.1, 0.0), (1.0, 0.0, 0.0)),))
# FMUs by name: the spring, and whether it is the form with states.
FORMS: dict[str, tuple[SpringParameters, bool] | None] = {
    "spring": (MOUNT, False),
    "table": (TABLE, False),
    "states": (MOUNT, True),
    "branches": (replace(MOUNT, **BRANCHED), False),
    "branches-states": (replace(TABLE, **BRANCHED), True),
    "system": None,
}


def _write_sources(form: str, folder: Path) -> None:
    """The C sources of the FMUs of a form, of FMI 2.0 and FMI 3.0 with one GUID, and what the fuzzer knows of them."""
    made = FORMS[form]
    parameters, with_states = made or (MOUNT, False)
    model = ModelFile("spring", parameters)
    if made:
        contents = native_contents(model, (), zero=0.0, with_states=with_states)
    else:
        contents = system_contents(load_system_file(BOX).candidates[0][1], SYSTEM_OPTIONS, ())
    files = c_sources((SPRING_FILES if made else SYSTEM_FILES)[3]) | fmi_headers(3)
    files = {name.removeprefix("core/c/" if made else ""): content for name, content in files.items()}
    kept = ("modelDescription.xml", "sources/")
    files |= {name.removeprefix("sources/"): content for name, content in contents.items() if name.startswith(kept)}
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    description = fmpy.read_model_description(str(folder), validate=False)
    if made:
        (folder / "fmu/spring_values.h").write_text(values_source(model, str(description.guid), with_states))
    variables = sorted(description.modelVariables, key=lambda variable: int(variable.valueReference))
    states = {v.derivative.name for v in variables if v.derivative is not None}
    names = [v.name for v in variables]

    def entry(v: Any) -> str:
        causality = v.causality[0] if v.name not in states else "O" if v.causality == "output" else "s"
        causality = causality if v.derivative is None else "r"
        start = float(v.start or 0.0) if v.type == "Real" else 0.0
        return f"{{{json.dumps(v.name)}, '{v.type[0]}', '{causality}', {int(v.variability == 'tunable')}, {start!r}}}"

    arrays = {"ELASTIC": "kE_", "AMPLIFIER": "kA_", "KNOTS": "FE_knots_", "BRANCHES": "branch_"}
    known: dict[str, Any] = {name: sum(v.startswith(array) for v in names) for name, array in arrays.items()}
    known |= {"VARIABLES": len(variables), "STATES": len(states)}
    known |= {name.upper(): names.index(name) if name in names else 0 for name in ("input_resolution", "step")}
    known |= {"GUID": json.dumps(str(description.guid)), "LARGEST_STEP": SYSTEM_OPTIONS.largest_step}
    known |= {"LOW": parameters.displacement_min, "HIGH": parameters.displacement_max}
    known["TABLE"] = ", ".join(map(entry, variables))
    (folder / "fuzz_model.h").write_text("".join(f"#define MODEL_{name} {value}\n" for name, value in known.items()))


def program_of(form: str, folder: Path, flags: tuple[str, ...] = SANITIZED) -> Path:
    """The fuzzer of a form, with its sources and objects in the folder; what is there already is not made again."""
    sources, objects = folder / "sources", folder / "objects"
    if not sources.exists():
        _write_sources(form, sources)
    objects.mkdir(exist_ok=True)
    is_system = FORMS[form] is None
    at, headers = (sources / "fmu/system/c", sources / "core/c") if is_system else (sources, sources)
    units = [at / name for name in (("system_all.c", "system_all3.c") if is_system else ("fmi2_all.c", "fmi3_all.c"))]
    options = [*STRICT, *flags, *(f"-I{path}" for path in (sources, at, headers / "fmi2", headers / "fmi3"))]

    def compile_unit(unit: Path) -> Path:
        made = objects / f"{unit.stem}.o"
        if not made.exists():
            subprocess.run(["cc", *options, *(COUNTED if unit in units else ()), "-c", unit, "-o", made], check=True)
        return made

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        made = list(pool.map(compile_unit, [*units, FUZZER]))
    subprocess.run(["cc", *flags, *made, "-lm", "-o", folder / "fuzz"], check=True)
    return folder / "fuzz"


def run(program: Path, seed: int, sequences: int) -> tuple[str, dict[str, Any]]:
    """Do so many sequences from a seed on: what is found, with its seed, and how often each call was made otherwise."""
    command = [str(program), str(seed), str(sequences)]
    done = subprocess.run(
        command, capture_output=True, text=True, errors="replace", env=os.environ | OPTIONS, check=False
    )
    if done.returncode == 0:
        return "", json.loads(done.stdout)
    *_, last = (line for line in done.stderr.splitlines() if line.startswith("seed "))
    lines = [line for line in done.stderr.splitlines() if not line.startswith("seed ")]
    return "\n".join([f"It happens with the {last} (exit status {done.returncode}).", *lines]), {}
