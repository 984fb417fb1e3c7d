"""Springs where there is little: FMUs for real time, and exported C in programs and on targets without a system."""

from __future__ import annotations

import re
import subprocess
from functools import reduce
from operator import add
from pathlib import Path

import fmpy
import numpy as np
import pytest

from branched_springs import BRANCHED, uneven_motion
from fmu_tools import SPRING
from native_tools import write_file, write_native
from oracles import OracleSpring, maxwell
from pages import TEXTS, blocks
from realtime_tools import (
    FLAGS,
    HERE,
    MACHINES,
    MEMORY,
    MOST_STACK,
    SPRINGS,
    Machine,
    bits,
    cc,
    exported,
    figures,
    on_host,
    sizes,
    steps,
)
from springs import TABLE
from strandspring import Spring, SpringParameters, export
from strandspring.compiled.sources import fmi_headers
from strandspring.core.parameters import N_RANGE
from strandspring.exchange.c_sources import write_c_sources
from strandspring.fmu.native.native_fmu import native_contents
from strandspring.model.modelfile import ModelFile
from tools import slow_but, ziglang

# FMUs: by version of FMI, the unit of the sources, and the file and function of a step.

pytestmark = pytest.mark.long
UNITS = {2: "fmi2_all.c", 3: "fmi3_all.c"}
STEPS = {2: ("fmi2/fmi2_life.c", "fmi2Status fmi2DoStep("), 3: ("fmi3/fmi3_life.c", "fmi3Status fmi3DoStep(")}


def write_sources(folder: Path, parameters: SpringParameters, fmi: int, no_energy: bool) -> Path:
    """The sources of an FMU for real time, with its model description and the headers of FMI."""
    contents = native_contents(
        ModelFile("spring", parameters), (), zero=0.0, fmi=fmi, real_time=True, no_energy=no_energy
    )
    write_native(folder, contents)
    for path, content in fmi_headers(fmi).items():
        write_file(folder / path.removeprefix("core/c/"), content)
    return folder


def measured(sources: Path, parameters: SpringParameters) -> tuple[int, dict[str, int]]:
    """How often steps allocate or free, and the stack of each call [B]."""
    description = fmpy.read_model_description(str(sources), validate=False)
    fmi = int(description.fmiVersion[0])
    references = {v.name: str(v.valueReference) for v in description.modelVariables}
    # Functions of the C library are not looked for at their first call, which takes kilobytes.
    flags = (*FLAGS, f"-DFMI_VERSION={fmi}", f"-I{sources}/fmi{fmi}", "-Wl,-z,now")
    host = cc(sources / "fmu_steps", "-O2", *flags, HERE / "fmu_steps.c", sources / UNITS[fmi], "-lm")
    limits = (repr(parameters.displacement_min), repr(parameters.displacement_max))
    outputs = ("force", "stiffness", "absorbed_energy", "omega")
    token = description.guid if fmi == 2 else description.instantiationToken
    read = [references[name] for name in outputs if name in references]
    done = subprocess.run(
        [host, str(token), *limits, references["displacement"], *read], capture_output=True, text=True, check=True
    )
    allocations, *stack = map(int, done.stdout.split())
    return allocations, dict(zip(("set", "step", "get"), stack, strict=True))


CASES = [*((s, 2, False) for s in ("usual", "table")), *(("wild", f, n) for f in UNITS for n in (False, True))]


@pytest.mark.parametrize("case", slow_but(CASES, (("wild", 2, False), ("wild", 3, True))), ids=str)
def test_steps_allocate_nothing_and_take_little_stack(case: tuple[str, int, bool], tmp_path: Path) -> None:
    spring, *form = SPRINGS[case[0]], *case[1:]
    allocations, stack = measured(write_sources(tmp_path / "sources", spring, *form), spring)
    assert allocations == 0
    assert 0 < max(stack.values()) < MOST_STACK, stack


@pytest.mark.parametrize("fmi", UNITS)
def test_planted_faults_are_found(fmi: int, tmp_path: Path) -> None:
    """An allocation, and an array on the stack, at the beginning of the step."""
    name, function = STEPS[fmi]
    sources = write_sources(tmp_path / "sources", SPRING, fmi, no_energy=False)
    text = (sources / name).read_text()
    assert text.count(function) == 1, f"the fault cannot be planted: {name} has changed"
    begin = text.index("{", text.index(function)) + 1
    unit = sources / UNITS[fmi]
    unit.write_text(f"#define _POSIX_C_SOURCE 200809L\n{unit.read_text()}")
    memory = {2: "void *volatile memory = malloc(8); free(memory);", 3: 'char *volatile a = strdup("a"); free(a);'}[fmi]
    room = "volatile char room[600]; memset((char *)room, 1, sizeof room);"
    includes = "#include <stdlib.h>\n#include <string.h>\n"
    (sources / name).write_text(f"{includes}{text[:begin]}\n    {memory} {room}\n{text[begin:]}")
    allocations, stack = measured(sources, SPRING)
    assert allocations == 2 * 6000
    assert stack["step"] > MOST_STACK


# Exported C


def answers(program: Path) -> str:
    return subprocess.run([program], capture_output=True, text=True, check=True).stdout


def test_the_example_in_the_header_runs_as_it_stands_there(tmp_path: Path) -> None:
    """In C and in C++; without a description of the model, and in the same bytes beside other springs."""
    (law,) = export(Spring(SPRING, "mount", "*/ #error planted /* äöü"), tmp_path, c=True, zero=0.0)
    header = (law.parent / "strandspring.h").read_text(encoding="utf-8")
    block = re.findall(r"(?:^ \*(?:     .*)?\n)+", header, re.MULTILINE)[0]
    text = "".join(f"{line[7:]}\n" for line in block.splitlines()[1:-1])
    example = law.parent / "mount_example.c"
    assert example.read_text() == text == blocks("real-time", "c")[0]
    assert len([line for line in text.splitlines() if line.startswith("    ")]) == 5
    for standard in ("-std=c11", "-std=gnu17", "-std=c2x"):
        answers(cc(tmp_path / "example", standard, example, law, *steps(law)))
    c, cpp = ziglang("cc"), ziglang("c++")
    objects = [cc(tmp_path / f"{p.stem}.o", "-O1", *FLAGS, "-c", p, compiler=c) for p in (law, *steps(law))]
    main = cc(tmp_path / "main.o", "-O1", "-std=c++17", "-x", "c++", "-c", example, compiler=cpp)
    # Linked as C: ziglang would compile the whole library of C++, of which the example uses nothing.
    answers(cc(tmp_path / "cpp", "-O1", main, *objects, compiler=c))
    before = {path.name: path.read_bytes() for path in law.parent.iterdir()}
    assert not any(b"planted" in content for content in before.values())
    exported(tmp_path, TABLE, "two")
    write_c_sources(tmp_path, ModelFile("mount", SPRING), 0.0)
    after = {path.name: path.read_bytes() for path in law.parent.iterdir()}
    assert {name: content for name, content in after.items() if not name.startswith("two")} == before
    local = law.parent / "spring_local.h"
    local.write_text(re.sub(r"SPRING_KERNEL 0x\w{8}", "SPRING_KERNEL 0x0", local.read_text()))
    with pytest.raises(RuntimeError, match="export the spring again"):
        cc(tmp_path / "law.o", *FLAGS, "-c", law)


@pytest.mark.parametrize("name", ["int", "class", "SPRING", "strandspring", "memcpy", "linux", "main", "NULL", "a__b"])
def test_any_name_compiles_and_takes_the_place_of_no_other_file(name: str, tmp_path: Path) -> None:
    law = exported(tmp_path, SPRING, name)
    alone = {path.name.lower() for path in exported(tmp_path / "other", SPRING, "mount").parent.iterdir()}
    own = {f"{name}_law.c".lower(), f"{name}_law.h".lower(), f"{name}_example.c".lower()}
    kernel = {path for path in alone if not path.startswith("mount_")}
    assert not own & kernel
    assert {path.name.lower() for path in law.parent.iterdir()} == own | kernel
    cc(tmp_path / "none", "-std=gnu11", "-fsyntax-only", law.parent / f"{name}_example.c", law)


PLAIN_HOST = """#include "mount_law.h"
#include <stdio.h>
static const double motion[][2] = {ROWS};
static SpringTable table;
static SpringLaw made;
int main(void)
{
    spring_tabulate(&table, mount_law.parameters.n, mount_law.parameters.sigma, SPRING_WITH_ENERGIES);
    spring_prepare(&made, &mount_law.parameters, &table);
    SpringMemory memory = spring_start(motion[0][1], 0.2), other = memory;
    for (int i = 0; i < COUNT; i++) {
        spring_commit(&mount_law, &memory, NULL, motion[i][1]);
        spring_commit(&made, &other, NULL, motion[i][1]);
        printf("%a %a %a %a\\n", spring_force(&mount_law, &memory), spring_absorbed_energy(&mount_law, &memory),
               spring_stiffness(&mount_law, &memory), spring_force(&made, &other));
    }
}
"""
ADDED_HOST = """#include "mount_law.h"
#include "plain_law.h"
#include <stdio.h>
static const double motion[][2] = {ROWS};
int main(void)
{
    const SpringAdded *has = &mount_law_added;
    SpringMemory first = spring_start(motion[0][1], 0.2);
    SpringAddedMemory added = spring_added_start(motion[0][1], -0.4);
    for (int i = 0; i < COUNT; i++) {
        SpringDecay decays[SPRING_MAXWELLS];
        for (int j = 0; j < has->branches; j++)
            decays[j] = spring_decay(motion[i][0] / has->time_constant[j]);
        spring_added_commit(has, &mount_law_second, &added, 0, first.displacement, motion[i][1], motion[i][0], decays);
        spring_commit(&mount_law_first, &first, NULL, motion[i][1]);
        printf("%a %a %a 0\\n", spring_force(&mount_law_first, &first)
               + spring_added_force(has, &mount_law_second, &added),
               spring_absorbed_energy(&mount_law_first, &first) + spring_added_energy(has, &mount_law_second, &added),
               spring_added_stored(has, &added));
    }
    return plain_law.parameters.n > 0.0 ? 0 : 1;
}
"""


@pytest.mark.parametrize("name", slow_but(["plain", "plain table", *BRANCHED], ("plain", "both")))
def test_the_exported_spring_answers_as_the_ode_and_the_package(name: str, tmp_path: Path) -> None:
    """One with a second mechanism and branches beside a plain one; a target with a mathematics library makes tables."""
    p = {"plain": SPRING, "plain table": TABLE, **BRANCHED}[name]
    time, path = uneven_motion()
    path = p.displacement_min + (path - path.min()) / np.ptp(path) * (p.displacement_max - p.displacement_min)
    law = exported(tmp_path, p)
    plain, kernel = exported(tmp_path, SPRING, "plain"), [*steps(law)]
    local = law.parent / "spring_local.h"
    if p.is_plain:
        assert local.read_text().count("#define SPRING_STEPS_ONLY\n") == 1
        local.write_text(local.read_text().replace("#define SPRING_STEPS_ONLY\n", ""))
        kernel.append(law.parent / "saturation_table.c")
        assert N_RANGE == (0.01, 100.0)  # as the header says
    else:
        kernel += [law.with_name("branches.c"), plain]
        answers(cc(tmp_path / "example", "-O2", *FLAGS, law.with_name("mount_example.c"), law, *kernel))
        declared = re.findall(r"\bextern const \w+ (\w+);", law.with_suffix(".h").read_text())
        assert declared == ["mount_law_first", "mount_law_second", "mount_law_added"]  # none leaves a part out
    pairs = zip(np.diff(time, prepend=0.0).tolist(), path.tolist(), strict=True)
    text = ", ".join(f"{{{h.hex()}, {x.hex()}}}" for h, x in pairs)
    host = tmp_path / "host.c"
    source = (PLAIN_HOST if p.is_plain else ADDED_HOST).replace("ROWS", text).replace("COUNT", str(path.size))
    host.write_text(source)
    program = cc(tmp_path / "host", "-O2", *FLAGS, f"-I{law.parent}", host, law, *kernel, "-lm")
    rows = [[float.fromhex(word) for word in line.split()] for line in answers(program).splitlines()]
    force, energy, third, made = np.array(rows).T
    spring, starts = Spring(p), (0.2, -0.4) if p.second else 0.2
    size = np.abs(force).max()
    assert force == pytest.approx(spring.response(path, starts, time), abs=1e-12 * size)
    oracle = sum(OracleSpring(m.as_dict()).force(path, w) for m, w in zip(p.mechanisms, (0.2, -0.4), strict=False))
    assert force == pytest.approx(oracle + branch_forces(p, path, time), abs=1e-6 * size)  # of the solver
    work = spring.absorbed_energy(path, starts, time=time)
    assert energy == pytest.approx(work, abs=1e-11 * np.abs(work).max())  # rounding of sums
    if p.is_plain:
        assert third == pytest.approx(spring.stiffness(path, 0.2), rel=1e-11)
        assert made == pytest.approx(force, abs=1e-12 * size)
    else:
        assert third == pytest.approx(spring.stored_energy(path, time=time), rel=1e-10, abs=1e-15)


def branch_forces(p: SpringParameters, path: np.ndarray, time: np.ndarray) -> np.ndarray:
    return np.asarray(sum((maxwell(b.stiffness, b.time_constant, path, time) for b in p.branches), np.zeros(path.size)))


# Targets without an operating system

FAULTS = {
    "a logarithm": ("double log(double);\n", "log(inside)"),
    "errno": ("int *__errno_location(void);\n", "*__errno_location()"),
    "an allocation": ("void *malloc(unsigned long);\n", "(malloc(8) != NULL)"),
}


@pytest.mark.parametrize("machine", MACHINES.values(), ids=MACHINES)
@pytest.mark.parametrize("name", slow_but(SPRINGS, ("wild",)))
def test_targets_need_no_library_and_give_the_bits_of_the_host(name: str, machine: Machine, tmp_path: Path) -> None:
    law = exported(tmp_path, SPRINGS[name])
    files = [*steps(law), law.parent / "saturation_table.c"]
    objects = [machine.compiled(tmp_path / f"{path.stem}.o", f"-I{path.parent}", "-c", path) for path in files]
    found, constant = reduce(add, map(sizes, objects)), sizes(machine.compiled(tmp_path / "law.o", "-c", law))
    assert {one for one in found.lacks if not one.startswith("spring_")} <= MEMORY
    # The table is constant and needs no start code; a pointer to it is not relocated before main.
    assert (found.variables, constant.lacks, constant.code, constant.variables) == (0, frozenset(), 0, 0)
    processor = machine.name.replace("cortex_", "Cortex-").replace("-m", "-M").replace("-a", "-A")
    ((code, constants),) = re.findall(rf"\| {processor}\b.*? \| (\d+) kB \| (\d+) kB \|", TEXTS["real-time"])
    assert 0.8 < (found.code + found.constants) / (1000.0 * int(code)) <= 1.0  # as the documentation says
    assert 0.8 < constant.constants / (1000.0 * int(constants)) <= 1.0
    host, said = on_host(law, tmp_path), machine.run(law, tmp_path)
    expected = bits(host)
    assert (len(expected), len({word for line in expected for word in line})) == (12, 48)
    assert bits(said) == expected, said[:2000]
    assert all(0 < figures(text)[0] < MOST_STACK for text in (host, said))


def test_planted_libraries_are_found(tmp_path: Path) -> None:
    source = exported(tmp_path, SPRING).parent / "spring.c"
    line, text, machine = "double force = elastic_inside(law, inside);", source.read_text(), MACHINES["cortex_m7"]
    assert line in text, "the fault cannot be planted: the source has changed"
    for declaration, term in FAULTS.values():
        source.write_text(declaration + text.replace(line, f"{line} force += {term};"))
        found = sizes(machine.compiled(tmp_path / "o.o", "-Wno-incompatible-library-redeclaration", "-c", source))
        assert not {name for name in found.lacks if not name.startswith("spring_")} <= MEMORY
