"""What the C kernel refuses, the memory it takes, and how it compiles."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import kernel_tools
from fmu_tools import SPRING
from kernel_tools import SOURCES, Kernel, c_parameters, compiled
from springs import TABLE, spring
from strandspring import SpringParameters
from strandspring.core.parameters import N_RANGE, SCALARS, SIGMA_RANGE
from tools import ziglang

pytestmark = pytest.mark.long

BAD = {
    "kA[0]": {"kA": (1.5, 2.0)},
    "kA[0] by a bit": {"kA": (1.0 + 2.0**-52,)},
    **{
        f"{name} {value}": {name: value}
        for name in ("kappa_omega", "rho", "sigma", "n")
        for value in (
            0.0,
            -0.0,
            -1.0,
            -1.0 / 3.0,
            -1e-5,
            -1e-4,
            -0.00012,
            -1e15,
            -1.5e16,
            -1e22,
            -1e23,
            -2.5e-308,
            -1.7976931348623157e308,
        )
    },
    **{
        f"sigma {value}": {"sigma": value}
        for value in (0.1, 0.49999999999999994, 1000.0000000000001, 1e16, 123456789.125)
    },
    **{f"n {value}": {"n": value} for value in (0.1 - 0.0901, 0.009999999999999998, 100.1, 1e100)},
    "order": {"displacement_min": 0.5, "displacement_max": -0.1},
    "empty range": {"displacement_min": 0.1, "displacement_max": 0.1},
    "range overflows": {"displacement_min": -1.7e308, "displacement_max": 1.7e308},
    "offset below": {"displacement_offset": -3.0},
    "offset above": {"displacement_offset": 0.05000000000000001},
    "FA at the end": {"kA": (1.0, 60.0)},
    "FA inside": {"kA": (1.0, -300.0, 1.5e4)},
    "FA zero": {"kA": (1.0, 0.0, -1.0 / SPRING.x_max**2)},
    "FA overflows": {"kA": (1.0, 1e308, -1e308), "displacement_max": 10.0},
    "narrow": {"displacement_min": 0.0, "displacement_max": 5e-324, "displacement_offset": 0.0},
    "wide": {"displacement_max": 1.1e6},
    "far": {"displacement_max": 1.1e9},
    **{
        f"{name} {value}": {name: value}
        for name in ("kappa_omega", "rho")
        for value in (5e-324, 1e-309, 1e-20, 1e19, 1e154, 1.7976931348623157e308)
    },
    **{f"kE[{i}]": {"kE": (*(0.0,) * i, -1e308)} for i in (0, 1, 7, 20)},
    **{f"kA[{i}]": {"kA": (1.0, *(0.0,) * (i - 1), 1e154)} for i in (1, 8)},
    "FA of degree 8": {"kA": (1.0, *(0.0,) * 6, -1e30, 1e28)},
}


KNOTS, FORCES = TABLE.FE_knots, TABLE.FE_forces
BAD_TABLES = {
    "low end": {"displacement_min": KNOTS[0] - 1e-9},
    "high end": {"displacement_max": KNOTS[-1] + 1e-9},
    "falling": {"FE_knots": (*KNOTS[:3], KNOTS[2] - 0.001, *KNOTS[4:])},
    "close": {"FE_knots": (*KNOTS[:3], KNOTS[2] + 3.9e-5, *KNOTS[4:])},
    "amplifier": {"kA": (1.0, 90.0)},
    "huge force": {"FE_forces": (*FORCES[:2], -1e16, *FORCES[3:])},
}
CASES = [*((SPRING, changes) for changes in BAD.values()), *((TABLE, changes) for changes in BAD_TABLES.values())]


@pytest.mark.parametrize(("good", "changes"), CASES, ids=[*BAD, *BAD_TABLES])
def test_problems_are_reported_in_the_same_words(good: SpringParameters, changes: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r".") as refusal:
        replace(good, **changes)
    given = c_parameters(good)
    counts = {"kE": "elastic", "kA": "amplifier", "FE_knots": "knots", "FE_forces": "forces"}
    for name, value in changes.items():
        if name in SCALARS:
            setattr(given, name, value)
            continue
        setattr(given, counts[name], len(value))
        column = getattr(given, name)
        for i, entry in enumerate(value):
            column[i] = entry
    # Named as the FMU's variables are.
    assert kernel_tools.problem(given) == re.sub(r"\[(\d+)\]`", r"_\1`", str(refusal.value))


def test_no_problem() -> None:
    assert kernel_tools.problem(c_parameters(SPRING)) == ""
    assert kernel_tools.problem(c_parameters(TABLE)) == ""


def test_problem_is_cut_where_the_room_ends() -> None:
    given = c_parameters(SPRING)
    given.rho = -1.0
    assert kernel_tools.problem(given, 10) == "`rho` must"[:9]


@pytest.mark.slow
def test_room_suffices_for_all_n_and_sigma() -> None:
    random = np.random.default_rng(3)
    smoothness = [*np.geomspace(*N_RANGE, 121), *np.geomspace(1.2, 1.5, 31), *10.0 ** random.uniform(-2.0, 2.0, 50)]
    recoveries = (0.5, 0.5001, 0.6, 1.0, 3.0, 30.0, 300.0, SIGMA_RANGE[1])
    taken = (Kernel(spring(float(n), sigma, 1.0)).taken() for n, sigma in product(smoothness, recoveries))
    assert max(taken) <= kernel_tools.room()


@pytest.mark.slow
def test_sanitizers_find_nothing() -> None:
    program = compiled(
        kernel_tools.build_folder() / "shaken",
        "-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all",
        kernel_tools.HERE / "kernel_shaken.c", *SOURCES, "-lm",
    )  # fmt: skip
    done = subprocess.run([program, "60", "400"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


# What C and its mathematics library offer.
LIBRARY = {
    *("ceil", "cos", "exp", "expm1", "log", "log1p", "pow"),
    *("memcpy", "memset", "snprintf", "strlen", "strpbrk", "strtod"),
}


def test_objects_hold_no_variable_and_ask_for_the_c_library_only() -> None:
    kinds: dict[str, set[str]] = {}
    for source in SOURCES:
        compiled_object = compiled(kernel_tools.build_folder() / f"{source.stem}.o", "-O2", "-c", source)
        listed = subprocess.run(["nm", "-P", compiled_object], capture_output=True, text=True, check=True).stdout
        for line in listed.splitlines():
            name, kind = line.split()[:2]
            kinds.setdefault(kind, set()).add(name)
    # T and t are functions, r constants; D, d, B, b, C would be variables.
    assert set(kinds) <= {"T", "t", "r", "U"}, kinds
    assert kinds["U"] <= LIBRARY | kinds["T"], kinds["U"] - LIBRARY - kinds["T"]
    assert all(name.startswith("spring_") for name in kinds["T"])


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.stem)
@pytest.mark.parametrize("target", ["x86_64-linux-gnu.2.17", "x86_64-windows-gnu", "aarch64-macos.11.0"])
def test_every_target_compiles_without_a_warning(target: str, source: Path) -> None:
    clang = (*ziglang("cc"), "-target", target)
    # Windows adds one page after the other to a stack, which takes a call for each larger frame.
    compiled(
        kernel_tools.build_folder() / f"{source.stem}-{target}.o",
        "-O2", "-Wframe-larger-than=5500", "-c", source,
        compiler=clang,
    )  # fmt: skip
