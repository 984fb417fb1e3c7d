"""A spring exported as C, compiled by ziglang for targets without an operating system, and run by an emulator."""

from __future__ import annotations

import subprocess
from dataclasses import dataclass, replace
from pathlib import Path

import lief
import numpy as np
from numpy.polynomial import chebyshev

from fmu_tools import SPRING
from springs import TABLE, spring
from strandspring import SpringParameters
from strandspring.exchange.c_sources import STEP_SOURCES, law_path, write_c_sources
from strandspring.model.modelfile import ModelFile
from tools import program, ziglang

HERE = Path(__file__).parents[1] / "fmi" / "targets"
# FA as wild as a polynomial of degree 8 can be.
_WILD = chebyshev.cheb2poly([1.0, *[0.0] * 7, 0.9])
WILD = spring(
    n=0.22, sigma=3.0, saturations=20.0, amplifier=tuple(float(c) for c in np.trim_zeros(_WILD[1:] / _WILD[0], "b"))
)
SPRINGS = {"usual": SPRING, "wild": WILD, "table": TABLE}
MOST_STACK = 512  # of a step, as strandspring.h says [B]
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Werror")
FLAGS = ("-std=c11", "-ffp-contract=off")
# Compilers call these by themselves; those of Arm's ABI are the same.
MEMORY = {"memcpy", "memmove", "memset"} | {
    f"__aeabi_mem{what}{width}" for what in ("cpy", "set", "clr", "move") for width in ("", "4", "8")
}


@dataclass(frozen=True)
class Machine:
    """A target, and the machine of QEMU that has its processor.

    Attributes
    ----------
    flags : tuple of str      Of ziglang's compiler.
    emulator : tuple of str   Command, without the image.
    """

    name: str
    flags: tuple[str, ...]
    emulator: tuple[str, ...]

    def compiled(self, output: Path, *arguments: str | Path) -> Path:
        """Compile without a C library and an operating system."""
        freestanding = ("-ffreestanding", "-nostdlib", "-fno-unwind-tables")
        return cc(output, *self.flags, *FLAGS, *freestanding, *arguments, compiler=ziglang("cc"))

    def run(self, sources: Path, folder: Path) -> str:
        """What tests/fmi/targets/steps.c says on the machine."""
        image = self.compiled(
            folder / f"{self.name}.elf",
            f"-I{sources.parent}", "-T", HERE / f"{self.name}.ld", HERE / f"{self.name}.c", HERE / "steps.c", sources,
            *steps(sources), "-lcompiler_rt",
        )  # fmt: skip
        emulator = program(self.emulator[0], package="qemu-system-arm")
        semihosting = ("-nographic", "-semihosting-config", "enable=on,target=native")
        command = [emulator, *self.emulator[1:], *semihosting, "-kernel", str(image)]
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=120, check=False, stdin=subprocess.DEVNULL
        )
        # Semihosting writes where errors go.
        return done.stdout + done.stderr


MACHINES = {
    machine.name: machine
    for machine in (
        Machine(
            "cortex_m7",
            # With the unit for double precision that this processor may have.
            ("-target", "thumb-freestanding-eabihf", "-mcpu=cortex_m7+fp_armv8d16", "-Os"),
            ("qemu-system-arm", "-M", "mps2-an500"),
        ),
        Machine(
            "cortex_a53",
            ("-target", "aarch64-freestanding-none", "-mcpu=cortex_a53", "-O2"),
            ("qemu-system-aarch64", "-M", "virt", "-cpu", "cortex-a53", "-net", "none"),
        ),
    )
}


def cc(output: Path, *arguments: str | Path, compiler: tuple[str, ...] = ("cc",)) -> Path:
    """Run a C compiler; a warning is an error."""
    compiler = program(compiler[0], package="gcc libc6-dev"), *compiler[1:]
    command = [*compiler, *WARNINGS, *map(str, arguments), "-o", str(output)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}\n{done.stdout}{done.stderr[:4000]}")
    return output


def exported(folder: Path, parameters: SpringParameters, name: str = "mount") -> Path:
    """The C file of a spring, with what it needs beside it."""
    write_c_sources(folder, ModelFile(name, parameters), 0.0)
    return law_path(folder, name)


def steps(sources: Path) -> list[Path]:
    """What steps are compiled of."""
    return [sources.parent / name for name in STEP_SOURCES]


def on_host(sources: Path, folder: Path) -> str:
    """What tests/fmi/targets/steps.c says on this computer."""
    inputs = (HERE / "steps.c", HERE / "host.c", sources, *steps(sources))
    program = cc(folder / "steps", "-O2", *FLAGS, f"-I{sources.parent}", *inputs)
    return subprocess.run([program], capture_output=True, text=True, check=True).stdout


def bits(said: str) -> list[list[str]]:
    """Digests of force, stiffness, absorbed energy and omega along the path."""
    return [line.split() for line in said.splitlines() if not line.startswith("stack")]


def figures(said: str) -> tuple[int, int]:
    """The most stack that a step takes, and the size of SpringMemory [B]."""
    words = next(line for line in said.splitlines() if line.startswith("stack")).split()
    return int(words[1], 16), int(words[3], 16)


@dataclass(frozen=True)
class Sizes:
    """Of an object file: names that it lacks, and bytes by where they lie on a target."""

    lacks: frozenset[str]
    code: int = 0
    constants: int = 0
    variables: int = 0

    def __add__(self, other: Sizes) -> Sizes:
        return replace(
            self,
            lacks=self.lacks | other.lacks,
            code=self.code + other.code,
            constants=self.constants + other.constants,
            variables=self.variables + other.variables,
        )


def sizes(path: Path) -> Sizes:
    """Of an object file in ELF."""
    parsed = lief.parse(path)
    assert isinstance(parsed, lief.ELF.Binary)
    sections = [(str(section.name), section.size) for section in parsed.sections]

    def total(*prefixes: str) -> int:
        return sum(size for name, size in sections if name.startswith(prefixes))

    lacks = frozenset(
        str(symbol.name)
        for symbol in parsed.symbols
        if symbol.name and symbol.shndx == 0 and symbol.binding != lief.ELF.Symbol.BINDING.LOCAL
    )
    return Sizes(lacks, total(".text"), total(".rodata"), total(".data", ".bss"))
