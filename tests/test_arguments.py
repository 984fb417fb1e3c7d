"""Numbers as Python users give them to the functions of the package."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import strandspring
from strandspring import (
    RefinedOptions,
    Spring,
    SpringParameters,
    compare,
    info,
    isolate,
    isolate_system,
    simulate,
    study,
    study_system,
    synthesize,
    synthesize_ni,
)
from strandspring.examples.system_models import SYSTEMS
from strandspring.ground.arguments import flag, limits, number, numbers, whole

SPRING = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
CRADLE = SYSTEMS / "gun_cradle.toml"
NO_NUMBER = ("13", b"13", True, np.bool_(True), None, [1.0], {1.0: 2.0}, 1j, pd.NaT, np.array([1.0]), Path("1"))


def test_one_number() -> None:
    for value in (2, 2.0, np.int8(2), np.float32(2), np.array(2.0), Decimal(2)):
        assert number("mass", value) == 2.0
    for value in NO_NUMBER:
        with pytest.raises(TypeError, match=r"`mass` must be a number \[kg\], got"):
            number("mass", value, "kg")
    assert number("mass", 10**400) == np.inf  # which is out of every bound


def test_numbers_in_a_row() -> None:
    for values in (
        [1, 2],
        (1.0, 2.0),
        range(1, 3),
        np.array([1, 2]),
        pd.Series([1.0, 2.0], index=[5, 9]),
        iter([1, 2]),
    ):
        assert numbers("amplitudes", values) == (1.0, 2.0)
    assert numbers("amplitudes", np.array(3.0)) == numbers("amplitudes", 3) == (3.0,)
    for values in ("13", b"13", {1.0, 2.0}, {"a": 1.0}, None, True, [[1.0, 2.0]], ["1"], pd.DataFrame({"a": [1.0]})):
        with pytest.raises(TypeError, match=r"`amplitudes` must be numbers \[m\], got"):
            numbers("amplitudes", values, "m")
    assert limits("band", [1, 2.5]) == (1.0, 2.5)
    for values in ((5,), 5, "13", b"13", (1, 2, 3)):
        with pytest.raises(TypeError, match=r"`band` must be two numbers, low and high \[Hz\], got"):
            limits("band", values, "Hz")


def test_whole_numbers() -> None:
    for value in (3, np.int16(3), np.array(3)):
        assert whole("draws", value) == 3
    for value in (3.0, "3", True, np.bool_(True), None, [3], np.array([3])):
        with pytest.raises(TypeError, match="`draws` must be a whole number, got"):
            whole("draws", value)


def test_truth_values() -> None:
    assert flag("robust", True) is flag("robust", np.bool_(True)) is True
    for value in ("no", 0, 1.0, None, [True], np.array([True])):
        with pytest.raises(TypeError, match="`robust` must be True or False, got"):
            flag("robust", value)


def test_methods_of_a_spring_are_the_functions_of_these_names() -> None:
    for name in ("predict", "info", "synthesize", "compare", "isolate", "study", "build_fmu", "export"):
        function = getattr(strandspring, name)
        assert getattr(Spring, name) is function
        assert getattr(SPRING, name).__func__ is function
        assert getattr(SPRING, name).__self__ is SPRING
    kinds = {parameter.kind for parameter in signature(SPRING.isolate).parameters.values()}
    assert Parameter.VAR_KEYWORD not in kinds
    with pytest.raises(TypeError):
        SPRING.synthesize(0.01, 0.02)  # the mean displacement is named


@pytest.mark.parametrize(
    ("call", "what"),
    [
        (lambda: info(SPRING, amplitudes="13"), "`amplitudes` must be numbers"),
        (lambda: info(SPRING, zero=True), "`zero` must be"),
        (lambda: isolate(SPRING, [5.0]), "`mass` must be a number"),
        (lambda: isolate(SPRING, 5.0, band=(5,)), "`band` must be two numbers"),
        (lambda: isolate(SPRING, 5.0, points=1), "`points` must be >= 2"),
        (lambda: isolate(SPRING, 5.0, force="13"), "`force` must be numbers"),
        (lambda: isolate_system(CRADLE, band=b"13"), "`band` must be two numbers"),
        (lambda: isolate_system(CRADLE, points=5.5), "`points` must be a whole number"),
        (lambda: study(SPRING, "13", draws=0), "`mass` must be numbers"),
        (lambda: study(SPRING, 5.0, draws=2.5), "`draws` must be a whole number"),
        (lambda: study(SPRING, 5.0, draws=0, workers=-1), "`workers` must be at least 1"),
        (lambda: study(SPRING, 5.0, draws=0, band=(5,)), "`band` must be two numbers"),
        (lambda: synthesize(SPRING, "13"), "`amplitudes` must be numbers"),
        (lambda: synthesize(SPRING, [0.01], cycles=2.5), "`cycles` must be a whole number"),
        (lambda: synthesize(SPRING, [0.01], seed=None), "`seed` must be a whole number"),
        (lambda: synthesize_ni(exponent=[0.2]), "`exponent` must be a number"),
        (lambda: compare(SPRING, SPRING, draws=float("nan")), "`draws` must be a whole number"),
        (lambda: compare(SPRING, SPRING, amplitudes="13"), "`amplitudes` must be numbers"),
        (lambda: SPRING.response([0.0, 0.01], omega_start="1"), "`omega_start` must be a number"),
        (lambda: SPRING.export("nowhere", ssv="no"), "`ssv` must be True or False"),
        (lambda: SPRING.build_fmu("nowhere", arrays=1), "`arrays` must be True or False"),
        (lambda: isolate(SPRING, 5.0, extrapolate="no"), "`extrapolate` must be True or False"),
        (lambda: study(SPRING, 5.0, draws=0, extrapolate=0), "`extrapolate` must be True or False"),
        (lambda: isolate_system(CRADLE, extrapolate=None), "`extrapolate` must be True or False"),
        (lambda: simulate(CRADLE, courses="yes"), "`courses` must be True or False"),
        (lambda: RefinedOptions(robust="no"), "`robust` must be True or False"),  # type: ignore[arg-type]
        (lambda: SPRING.export("nowhere", ssp_mass="1"), "`ssp_mass` must be a number"),
        (lambda: simulate(CRADLE, draws=-1), "`draws` must be >= 16"),
        (lambda: simulate(CRADLE, step=0), "`step` must be finite and > 0"),
        (lambda: study_system(CRADLE, {}, step=-1.0), "`step` must be finite and > 0"),
    ],
)
def test_wrong_ones_are_named(call: Callable[[], Any], what: str) -> None:
    with pytest.raises((TypeError, ValueError)) as caught:
        call()
    assert str(caught.value).startswith(what)
