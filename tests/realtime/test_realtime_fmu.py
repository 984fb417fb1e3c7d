"""Steps of the FMU for real time allocate nothing and take little stack."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import fmpy
import pytest

from fmu_tools import SPRING
from native_tools import write_file, write_native
from realtime_tools import FLAGS, HERE, MOST_STACK, SPRINGS, cc
from strandspring import SpringParameters
from strandspring.compiled.sources import fmi_headers
from strandspring.fmu.native.native_fmu import native_contents
from strandspring.model.modelfile import ModelFile

OUTPUTS = ("force", "stiffness", "absorbed_energy", "omega")
# By version of FMI: the unit of the sources, and the file and function of a step.
UNITS = {2: "fmi2_all.c", 3: "fmi3_all.c"}
STEPS = {2: ("fmi2/fmi2_life.c", "fmi2Status fmi2DoStep("), 3: ("fmi3/fmi3_life.c", "fmi3Status fmi3DoStep(")}


def write_sources(folder: Path, parameters: SpringParameters = SPRING, fmi: int = 2, no_energy: bool = False) -> Path:
    """The sources of an FMU for real time, with its model description and the headers of FMI."""
    model = ModelFile("spring", parameters)
    write_native(folder, native_contents(model, (), zero=0.0, fmi=fmi, real_time=True, no_energy=no_energy))
    for path, content in fmi_headers(fmi).items():
        write_file(folder / path.removeprefix("core/c/"), content)
    return folder


def measured(sources: Path, parameters: SpringParameters) -> tuple[int, dict[str, int]]:
    """How often steps allocate or free, and the stack of each call [B]."""
    description = fmpy.read_model_description(str(sources), validate=False)
    fmi = int(description.fmiVersion[0])
    references = {v.name: str(v.valueReference) for v in description.modelVariables}
    inputs = (HERE / "fmu_steps.c", sources / UNITS[fmi])
    # Functions of the C library are not looked for at their first call, which takes kilobytes.
    flags = (*FLAGS, f"-DFMI_VERSION={fmi}", f"-I{sources}/fmi{fmi}")
    program = cc(sources / "fmu_steps", "-O2", *flags, "-Wl,-z,now", *inputs, "-lm")
    limits = (repr(parameters.displacement_min), repr(parameters.displacement_max))
    outputs = [references[name] for name in OUTPUTS if name in references]
    token = description.guid if fmi == 2 else description.instantiationToken
    arguments = (str(token), *limits, references["displacement"], *outputs)
    done = subprocess.run([program, *arguments], capture_output=True, text=True, check=True)
    allocations, *stack = map(int, done.stdout.split())
    return allocations, dict(zip(("set", "step", "get"), stack, strict=True))


def planted(sources: Path, folder: Path, fault: str, fmi: int) -> Path:
    """The sources with a statement at the beginning of the step."""
    name, function = STEPS[fmi]
    copy = Path(shutil.copytree(sources, folder / "planted"))
    text = (copy / name).read_text()
    assert text.count(function) == 1, f"the fault cannot be planted: {name} has changed"
    begin = text.index("{", text.index(function)) + 1
    (copy / name).write_text(f"#include <stdlib.h>\n#include <string.h>\n{text[:begin]}\n    {fault}\n{text[begin:]}")
    return copy


@pytest.mark.parametrize(
    ("spring", "fmi", "no_energy"),
    [
        *(pytest.param(spring, 2, False, marks=pytest.mark.slow) for spring in SPRINGS if spring != "wild"),
        *(("wild", fmi, no_energy) for fmi in UNITS for no_energy in (False, True)),
    ],
)
def test_steps_allocate_nothing_and_take_little_stack(spring: str, fmi: int, no_energy: bool, tmp_path: Path) -> None:
    sources = write_sources(tmp_path / "sources", SPRINGS[spring], fmi, no_energy)
    allocations, stack = measured(sources, SPRINGS[spring])
    print(f"{spring}, FMI {fmi}: {stack} B of stack")
    assert allocations == 0
    assert 0 < max(stack.values()) < MOST_STACK, stack


@pytest.mark.parametrize(
    ("fault", "fmi"),
    [("void *volatile memory = malloc(8); free(memory);", 2), ('char *volatile text = strdup("a"); free(text);', 3)],
)
def test_a_planted_allocation_is_found(fault: str, fmi: int, tmp_path: Path) -> None:
    faulty = planted(write_sources(tmp_path / "sources", fmi=fmi), tmp_path, fault, fmi)
    unit = faulty / UNITS[fmi]
    unit.write_text(f"#define _POSIX_C_SOURCE 200809L\n{unit.read_text()}")
    allocations, _ = measured(faulty, SPRING)
    assert allocations == 2 * 6000


@pytest.mark.parametrize("fmi", UNITS)
def test_a_planted_array_on_the_stack_is_found(fmi: int, tmp_path: Path) -> None:
    fault = "volatile char room[600]; memset((char *)room, 1, sizeof room);"
    _, stack = measured(planted(write_sources(tmp_path / "sources", fmi=fmi), tmp_path, fault, fmi), SPRING)
    assert stack["step"] > MOST_STACK
