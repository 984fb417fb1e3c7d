"""The kernel without an operating system: what its objects need, the same bits as on the host, and little stack."""

from __future__ import annotations

import re
from functools import reduce
from operator import add
from pathlib import Path

import pytest

from fmu_tools import SPRING
from pages import TEXTS
from realtime_tools import (
    MACHINES,
    MEMORY,
    MOST_STACK,
    SPRINGS,
    Machine,
    Sizes,
    bits,
    exported,
    figures,
    on_host,
    sizes,
    steps,
)  # fmt: skip


@pytest.fixture(scope="module", params=SPRINGS)
def sources(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return exported(tmp_path_factory.mktemp(request.param), SPRINGS[request.param])


@pytest.fixture(scope="module")
def host(sources: Path) -> str:
    return on_host(sources, sources.parent)


@pytest.fixture(scope="module", params=MACHINES)
def machine(request: pytest.FixtureRequest) -> Machine:
    return MACHINES[request.param]


@pytest.fixture(scope="module")
def said(machine: Machine, sources: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """By the machine."""
    return machine.run(sources, tmp_path_factory.mktemp(machine.name))


def linked(machine: Machine, files: list[Path], folder: Path) -> Sizes:
    """Of all objects, without the names that one has for the others."""
    objects = [machine.compiled(folder / f"{path.stem}.o", f"-I{path.parent}", "-c", path) for path in files]
    return reduce(add, map(sizes, objects))


def test_steps_need_no_library_and_no_variables(machine: Machine, sources: Path, tmp_path: Path) -> None:
    found = linked(machine, [*steps(sources), sources.parent / "saturation_table.c"], tmp_path)
    assert {name for name in found.lacks if not name.startswith("spring_")} <= MEMORY
    assert found.variables == 0
    law = sizes(machine.compiled(tmp_path / "law.o", "-c", sources))
    # The table is constant and needs no start code; a pointer to it is not relocated before main.
    assert (law.lacks, law.code, law.variables) == (frozenset(), 0, 0)
    code, constants = found.code + found.constants, law.constants
    print(f"{machine.name}: {code} B of code, {constants} B of constants")
    # As the documentation says.
    processor = machine.name.replace("cortex_", "Cortex-").replace("-m", "-M").replace("-a", "-A")
    ((stated_code, stated_constants),) = re.findall(
        rf"\| {processor}\b.*? \| (\d+) kB \| (\d+) kB \|", TEXTS["real-time"]
    )
    assert 0.8 < code / (1000.0 * int(stated_code)) <= 1.0
    assert 0.8 < constants / (1000.0 * int(stated_constants)) <= 1.0


# A declaration, and a term that is added to the force.
FAULTS = {
    "a logarithm": ("double log(double);\n", "log(inside)"),
    "errno": ("int *__errno_location(void);\n", "*__errno_location()"),
    "an allocation": ("void *malloc(unsigned long);\n", "(malloc(8) != NULL)"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_planted_libraries_are_found(fault: str, tmp_path: Path) -> None:
    source = exported(tmp_path, SPRING).parent / "spring.c"
    line, (declaration, term) = "double force = elastic_inside(law, inside);", FAULTS[fault]
    text = source.read_text()
    assert line in text, "the fault cannot be planted: the source has changed"
    source.write_text(declaration + text.replace(line, f"{line} force += {term};"))
    machine = MACHINES["cortex_m7"]
    found = sizes(machine.compiled(tmp_path / "o.o", "-Wno-incompatible-library-redeclaration", "-c", source))
    assert not {name for name in found.lacks if not name.startswith("spring_")} <= MEMORY


def test_the_same_bits_as_on_the_host(said: str, host: str) -> None:
    expected = bits(host)
    assert len(expected) == 12
    assert len({word for line in expected for word in line}) == 48
    assert bits(said) == expected, said[:2000]


def test_stack_of_a_step(machine: Machine, said: str) -> None:
    stack, memory = figures(said)
    print(f"{machine.name}: {stack} B of stack, {memory} B of memory")
    assert 0 < stack < MOST_STACK


def test_stack_of_a_step_on_the_host(host: str) -> None:
    stack, _ = figures(host)
    print(f"host: {stack} B of stack")
    assert 0 < stack < MOST_STACK
