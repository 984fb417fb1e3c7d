"""The C sources of a spring: what they ask for, for whom they compile, and where Python finds their structures."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import instrumented
from kernel_tools import SOURCES, Kernel, build_folder, compiled
from springs import spring
from strandspring.compiled import zig
from strandspring.compiled.images import KERNEL
from strandspring.compiled.targets import FMU_TARGETS, Target
from strandspring.core.parameters import N_RANGE, SIGMA_RANGE
from strandspring.errors import BuildError
from strandspring.kernel.arrays import address
from strandspring.kernel.structures import constants, rows, structures
from tools import program, tool, ziglang

pytestmark = pytest.mark.long

# What C and its mathematics library offer.
LIBRARY = {
    *("ceil", "cos", "exp", "expm1", "log", "log1p", "pow"),
    *("memcpy", "memset", "snprintf", "strlen", "strpbrk", "strtod"),
}


def test_objects_hold_no_variable_and_ask_for_the_c_library_only() -> None:
    kinds: dict[str, set[str]] = {}
    for source in SOURCES:
        made = compiled(build_folder() / f"{source.stem}.o", "-O2", "-c", source)
        listed = subprocess.run(["nm", "-P", made], capture_output=True, text=True, check=True).stdout
        for line in listed.splitlines():
            name, kind = line.split()[:2]
            kinds.setdefault(kind, set()).add(name)
    # T and t are functions, r constants; D, d, B, b, C would be variables.
    assert set(kinds) <= {"T", "t", "r", "U"}, kinds
    assert kinds["U"] <= LIBRARY | kinds["T"], kinds["U"] - LIBRARY - kinds["T"]
    assert all(name.startswith("spring_") for name in kinds["T"])


@pytest.mark.slow
@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.stem)
@pytest.mark.parametrize("target", ["x86_64-windows-gnu", "aarch64-macos.11.0"])
def test_every_system_compiles_without_a_warning(target: str, source: Path) -> None:
    # Windows adds one page after the other to a stack, which takes a call for each larger frame.
    flags = "-O2", "-Wframe-larger-than=5500", "-c", source
    compiled(build_folder() / f"{source.stem}-{target}.o", *flags, compiler=(*ziglang("cc"), "-target", target))


@pytest.mark.slow
def test_room_suffices_for_all_n_and_sigma() -> None:
    random = np.random.default_rng(3)
    smoothness = [*np.geomspace(*N_RANGE, 121), *np.geomspace(1.2, 1.5, 31), *10.0 ** random.uniform(-2.0, 2.0, 50)]
    recoveries = (0.5, 0.5001, 0.6, 1.0, 3.0, 30.0, 300.0, SIGMA_RANGE[1])
    taken = (Kernel(spring(float(n), sigma, 1.0)).taken() for n, sigma in product(smoothness, recoveries))
    assert max(taken) <= constants()["SPRING_PIECES"]


@pytest.mark.slow
def test_sanitizers_find_nothing(tmp_path: Path) -> None:
    program("gcc", package="gcc libc6-dev")
    command = [sys.executable, instrumented.__file__, "-q", "tests/kernel", "tests/core", "--deselect", f"{__file__}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1800, check=False)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]
    # The library that is named is what they use.
    environment = {**os.environ, instrumented.VARIABLE: str(tmp_path / "none.so")}
    command = [sys.executable, "-m", "pytest", "-n", "0", "-p", "instrumented", "-q", "tests/kernel/test_balance.py"]
    done = subprocess.run(
        command, cwd=instrumented.ROOT, env=environment, capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 1
    assert "none.so: cannot open shared object file" in done.stdout


# Structures


def compile_with(sources: dict[str, bytes], target: Target) -> None:
    """Compile what a compiler refuses where it puts a field elsewhere than ctypes does."""
    tool("ziglang")
    lines = [f'#include "kernel/c/{header}.h"' for header in ("balance/balance", "motion/motion")]
    for name, structure in structures().items():
        lines.append(f'_Static_assert(sizeof({name}) == {np.dtype(structure).itemsize}, "{name}");')
        for field, *_ in structure._fields_:
            place = f"offsetof({name}, {field}) == {getattr(structure, field).offset}"
            lines.append(f'_Static_assert({place}, "{field} of {name}");')
    assert len(lines) > 150
    unit = "\n".join([*lines, "int compared;"])
    zig.shared_library(target, {**sources, "compared.c": unit.encode()}, ("compared.c",), KERNEL.name, ("-O1",))


@pytest.mark.parametrize("target", FMU_TARGETS, ids=lambda target: target.triple)
def test_fields_are_where_compilers_put_them(target: Target) -> None:
    compile_with(KERNEL.sources(), target)


@pytest.mark.parametrize(
    ("header", "before", "after", "where"),
    [
        ("motion/motion", "double mass, center[3];", "double mass, added, center[3];", "MotionBody"),
        ("balance/balance", "double parallel, series;", "double series, parallel;", "parallel of BalancedAxis"),
    ],
)
def test_other_structures_are_noticed(header: str, before: str, after: str, where: str) -> None:
    sources = KERNEL.sources()
    path = f"kernel/c/{header}.h"
    assert sources[path].count(before.encode()) == 1
    sources[path] = sources[path].replace(before.encode(), after.encode())
    with pytest.raises(BuildError, match=where):
        compile_with(sources, FMU_TARGETS[0])


def test_structures_and_arrays_are_passed_as_they_lie() -> None:
    channel = rows("MotionChannel", 2, body=[1, 2], direction=[[1, 2, 3], [4, 5, 6]])
    assert channel.view(np.float64)[8:].tolist() == [4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 0.0, 2.0]
    assert rows("MotionPoint", 0, place=[], body=[]).size == 0
    with pytest.raises(ValueError, match="added"):
        rows("MotionPoint", 1, added=[1.0])
    with pytest.raises(AttributeError, match="added"):
        structures()["MotionPoint"](added=1.0)
    assert constants()["MOTION_OF_POINT"] == 18
    array = np.arange(6.0)[2:]
    array.setflags(write=False)
    assert address(array) == array.ctypes.data
    assert address(np.zeros(0)) > 0
    with pytest.raises(ValueError, match="contiguous"):
        address(np.zeros((3, 4)).T)
