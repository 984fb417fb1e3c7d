"""The C sources of a spring: what they ask for, for whom they compile, and where Python finds their structures."""

from __future__ import annotations

import subprocess
import sys
from itertools import product

import numpy as np
import pytest

import instrumented
from kernel_tools import SOURCES, Kernel, build_folder, compiled, library
from springs import spring
from strandspring.compiled import zig
from strandspring.compiled.images import KERNEL
from strandspring.compiled.targets import FMU_TARGETS, Target
from strandspring.core.parameters import N_RANGE, SIGMA_RANGE
from strandspring.errors import BuildError
from strandspring.kernel.arrays import address
from strandspring.kernel.structures import constants, structures
from tools import program, tool

pytestmark = pytest.mark.long

# What C and its mathematics library offer.
LIBRARY = {"ceil", "cos", "exp", "expm1", "log", "log1p", "pow"}
LIBRARY |= {"memcpy", "memset", "snprintf", "strlen", "strpbrk", "strtod"}
OF_C = [f"tests/core/test_{name}.py" for name in ("gradients", "parameters", "saturation", "spring")]


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
def test_room_suffices_for_all_n_and_sigma() -> None:
    random = np.random.default_rng(3)
    smoothness = [*np.geomspace(*N_RANGE, 121), *np.geomspace(1.2, 1.5, 31), *10.0 ** random.uniform(-2.0, 2.0, 50)]
    recoveries = (0.5, 0.5001, 0.6, 1.0, 3.0, 30.0, 300.0, SIGMA_RANGE[1])
    for n, sigma in product(smoothness, recoveries):
        made = Kernel(spring(float(n), sigma, 1.0))
        assert library().driver_taken(made.address) <= constants()["SPRING_PIECES"]


@pytest.mark.slow
def test_sanitizers_find_nothing() -> None:
    program("gcc", package="gcc libc6-dev")
    command = [sys.executable, instrumented.__file__, "-q", "tests/kernel", *OF_C]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-5000:]


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


def test_other_structures_are_noticed_and_no_array_with_gaps_is_passed() -> None:
    sources = KERNEL.sources()
    path = "kernel/c/balance/balance.h"
    sources[path] = sources[path].replace(b"double parallel, series;", b"double series, parallel;")
    with pytest.raises(BuildError, match="parallel of BalancedAxis"):
        compile_with(sources, FMU_TARGETS[0])
    with pytest.raises(ValueError, match="contiguous"):
        address(np.zeros((3, 4)).T)
