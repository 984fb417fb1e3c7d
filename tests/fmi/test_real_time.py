"""Springs where there is little: exported C in programs and on targets without an operating system.

FMUs for real time are measured in test_hosts.py.
"""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from branched_springs import BRANCHED, uneven_motion
from fmu_tools import SPRING
from oracles import OracleSpring, maxwell
from pages import TEXTS, blocks
from portable_host import run
from springs import TABLE, spring
from strandspring import Spring, SpringParameters, export
from strandspring.core.parameters import N_RANGE
from strandspring.exchange.c_sources import STEP_SOURCES, law_path, write_c_sources
from strandspring.model.modelfile import ModelFile
from tools import program, slow_but, ziglang

pytestmark = pytest.mark.long
HERE = Path(__file__).with_name("targets")
# FA as wild as a polynomial of degree 8 can be: a Chebyshev polynomial.
WILD = spring(
    n=0.22, sigma=3.0, saturations=20.0,
    amplifier=(0.0, -288.0 / 19.0, 0.0, 1440.0 / 19.0, 0.0, -2304.0 / 19.0, 0.0, 1152.0 / 19.0),
)  # fmt: skip
SPRINGS = {"usual": SPRING, "wild": WILD, "table": TABLE}
MOST_STACK = 512  # of a step, as strandspring.h says [B]
FLAGS = ("-std=c11", "-ffp-contract=off")
# Compilers call these by themselves; those of Arm's ABI are the same.
MEMORY = {"memcpy", "memmove", "memset"} | {
    f"__aeabi_mem{what}{width}" for what in ("cpy", "set", "clr", "move") for width in ("", "4", "8")
}


def cc(output: Path, *arguments: str | Path, compiler: tuple[str, ...] = ("cc",)) -> Path:
    """Run a C compiler; a warning is an error."""
    compiler = program(compiler[0], package="gcc libc6-dev"), *compiler[1:]
    warnings = ("-Wall", "-Wextra", "-Wpedantic", "-Werror")
    run([*compiler, *warnings, *arguments, "-o", output])
    return output


def exported(folder: Path, parameters: SpringParameters, name: str = "mount") -> Path:
    """The C file of a spring, with what it needs beside it."""
    write_c_sources(folder, ModelFile(name, parameters), 0.0)
    return law_path(folder, name)


def steps(sources: Path) -> list[Path]:
    """What steps are compiled of."""
    return [sources.parent / name for name in STEP_SOURCES]


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
        run([cc(tmp_path / "example", standard, example, law, *steps(law))])
    c, cpp = ziglang("cc"), ziglang("c++")
    objects = [cc(tmp_path / f"{p.stem}.o", "-O1", *FLAGS, "-c", p, compiler=c) for p in (law, *steps(law))]
    main = cc(tmp_path / "main.o", "-O1", "-std=c++17", "-x", "c++", "-c", example, compiler=cpp)
    # Linked as C: ziglang would compile the whole library of C++, of which the example uses nothing.
    run([cc(tmp_path / "cpp", "-O1", main, *objects, compiler=c)])
    before = {path.name: path.read_bytes() for path in law.parent.iterdir()}
    assert not any(b"planted" in content for content in before.values())
    exported(tmp_path, TABLE, "two")
    write_c_sources(tmp_path, ModelFile("mount", SPRING), 0.0)
    after = {path.name: path.read_bytes() for path in law.parent.iterdir()}
    assert {name: content for name, content in after.items() if not name.startswith("two")} == before
    local = law.parent / "spring_local.h"
    local.write_text(re.sub(r"SPRING_KERNEL 0x\w{8}", "SPRING_KERNEL 0x0", local.read_text()))
    with pytest.raises(AssertionError, match="export the spring again"):
        cc(tmp_path / "law.o", *FLAGS, "-c", law)


def test_any_name_compiles_and_takes_the_place_of_no_other_file(tmp_path: Path) -> None:
    for name in ("int", "SPRING", "memcpy", "NULL"):
        law = exported(tmp_path / name, SPRING, name)
        cc(tmp_path / "none", "-std=gnu11", "-fsyntax-only", law.parent / f"{name}_example.c", law)
        others = {path.name.lower() for path in law.parent.iterdir()}
        assert len(others) == len(list(exported(tmp_path / "other", SPRING, "mount").parent.iterdir()))


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
        run([cc(tmp_path / "example", "-O2", *FLAGS, law.with_name("mount_example.c"), law, *kernel)])
        declared = re.findall(r"\bextern const \w+ (\w+);", law.with_suffix(".h").read_text())
        assert declared == ["mount_law_first", "mount_law_second", "mount_law_added"]  # none leaves a part out
    pairs = zip(np.diff(time, prepend=0.0).tolist(), path.tolist(), strict=True)
    text = ", ".join(f"{{{h.hex()}, {x.hex()}}}" for h, x in pairs)
    host = tmp_path / "host.c"
    source = (PLAIN_HOST if p.is_plain else ADDED_HOST).replace("ROWS", text).replace("COUNT", str(path.size))
    host.write_text(source)
    host_program = cc(tmp_path / "host", "-O2", *FLAGS, f"-I{law.parent}", host, law, *kernel, "-lm")
    rows = [[float.fromhex(word) for word in line.split()] for line in run([host_program]).splitlines()]
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


@dataclass(frozen=True)
class Machine:
    """A target, its processor by the page's name, and the machine of QEMU that has it, without the image."""

    flags: tuple[str, ...]
    processor: str
    emulator: tuple[str, ...]

    def compiled(self, output: Path, *arguments: str | Path) -> Path:
        """Compile without a C library and an operating system."""
        freestanding = ("-ffreestanding", "-nostdlib", "-fno-unwind-tables")
        return cc(output, *self.flags, *FLAGS, *freestanding, *arguments, compiler=ziglang("cc"))


MACHINES = {
    "cortex_m7": Machine(  # with the unit for double precision that this processor may have
        ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m7+fp_armv8d16", "-Os"), "Cortex-M7",
        ("qemu-system-arm", "-M", "mps2-an500"),
    ),
    "cortex_a53": Machine(
        ("-target", "aarch64-freestanding-none", "-mcpu=cortex_a53", "-O2"), "Cortex-A53",
        (),
    ),
}  # fmt: skip


def sizes(*paths: Path) -> tuple[set[str], dict[str, int]]:
    """Names that object files in ELF lack, and bytes of code, constants and variables."""
    import lief

    lacks, sizes = set[str](), {".text": 0, ".rodata": 0, ".data": 0, ".bss": 0}
    for path in paths:
        parsed = lief.parse(path)
        assert isinstance(parsed, lief.ELF.Binary)
        for section, kind in ((one, kind) for one in parsed.sections for kind in sizes):
            sizes[kind] += section.size if str(section.name).startswith(kind) else 0
        local = lief.ELF.Symbol.BINDING.LOCAL
        lacks |= {str(one.name) for one in parsed.symbols if one.name and one.shndx == 0 and one.binding != local}
    return {name for name in lacks if not name.startswith("spring_")} - MEMORY, sizes


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("name", slow_but(SPRINGS, ("wild",)))
def test_targets_need_no_library_and_give_the_bits_of_the_host(name: str, machine: str, tmp_path: Path) -> None:
    law, target = exported(tmp_path, SPRINGS[name]), MACHINES[machine]
    files, include = [*steps(law), law.parent / "saturation_table.c"], f"-I{law.parent}"
    objects = [target.compiled(tmp_path / f"{path.stem}.o", include, "-c", path) for path in files]
    lacks, code = sizes(*objects)
    constant = sizes(target.compiled(tmp_path / "law.o", "-c", law))[1]
    # The table is constant and needs no start code; a pointer to it is not relocated before main.
    assert (lacks, code[".data"] + code[".bss"]) == (set(), 0)
    assert constant[".text"] == constant[".data"] == constant[".bss"] == 0
    said = re.findall(rf"\| {target.processor}\b.*? \| (\d+) kB \| (\d+) kB \|", TEXTS["real-time"])
    ((whole, constants),) = said  # as the documentation says
    assert 0.8 < (code[".text"] + code[".rodata"]) / (1000.0 * int(whole)) <= 1.0
    assert 0.8 < constant[".rodata"] / (1000.0 * int(constants)) <= 1.0
    if machine == "cortex_a53":
        return  # the other is emulated
    here = run([cc(tmp_path / "steps", "-O2", *FLAGS, include, HERE / "steps.c", law, *steps(law))])
    image = target.compiled(
        tmp_path / "image.elf", include, "-T", HERE / f"{machine}.ld", HERE / "semihosting.c", HERE / "steps.c", law,
        *steps(law), "-lcompiler_rt",
    )  # fmt: skip
    command = [program(target.emulator[0], package="qemu-system-arm"), *target.emulator[1:], "-nographic"]
    command += ["-semihosting-config", "enable=on,target=native", "-kernel", str(image)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, stdin=subprocess.DEVNULL)
    there = done.stdout + done.stderr  # semihosting writes where errors go
    *digests, _ = here.split()
    assert (len(digests), len(set(digests))) == (48, 48)
    assert there.split()[:-1] == digests, there[:2000]
    assert all(0 < int(text.split()[-1], 16) < MOST_STACK for text in (here, there))


def test_a_planted_library_is_found(tmp_path: Path) -> None:
    source = exported(tmp_path, SPRING).parent / "spring.c"
    line, text, machine = "double force = elastic_inside(law, inside);", source.read_text(), MACHINES["cortex_m7"]
    assert line in text, "the fault cannot be planted: the source has changed"
    source.write_text(f"double log(double);\n{text.replace(line, f'{line} force += log(inside);')}")
    planted = machine.compiled(tmp_path / "o.o", "-Wno-incompatible-library-redeclaration", "-c", source)
    assert sizes(planted)[0] == {"log"}
