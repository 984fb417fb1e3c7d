"""Which springs are refused, and the least value of a polynomial on which one refusal rests."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.polynomial import polyval

from springs import EXAMPLES, springs
from strandspring import SpringParameters
from strandspring.core.parameters import problems
from strandspring.core.polynomials import antiderivative, derivative, least_value, polynomial

LAW = settings(max_examples=200)

GOOD = SpringParameters(
    kE=(1.0, 2000.0),
    kA=(1.0, 2.0),
    kappa_omega=10.0,
    rho=500.0,
    sigma=1.5,
    n=0.5,
    displacement_offset=0.0,
    displacement_min=-0.25,
    displacement_max=0.25,
)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"kE": ()}, "`kE` must have between 1 and 21 coefficients, got 0."),
        ({"kE": (1.0,) * 22}, "`kE` must have between 1 and 21 coefficients, got 22."),
        ({"kA": ()}, "`kA` must have between 1 and 9 coefficients, got 0."),
        ({"kA": (1.0,) * 22}, "`kA` must have between 1 and 9 coefficients, got 22."),
        ({"kE": (1.0, math.nan)}, "`kE[1]` must be finite, got nan."),
        ({"kA": (1.0, 0.0, -math.inf)}, "`kA[2]` must be finite, got -inf."),
        ({"kappa_omega": math.inf}, "`kappa_omega` must be finite, got inf."),
        ({"rho": math.nan}, "`rho` must be finite, got nan."),
        ({"sigma": math.inf}, "`sigma` must be finite, got inf."),
        ({"n": math.nan}, "`n` must be finite, got nan."),
        ({"displacement_offset": math.nan}, "`displacement_offset` must be finite, got nan."),
        ({"displacement_min": -math.inf}, "`displacement_min` must be finite, got -inf."),
        ({"displacement_max": math.inf}, "`displacement_max` must be finite, got inf."),
        ({"kA": (2.0,)}, "`kA[0]` must be 1 (kappa_omega carries the scale), got 2.0."),
        ({"kappa_omega": 0.0}, "`kappa_omega` must be > 0 [N], got 0.0."),
        ({"kappa_omega": -3.0}, "`kappa_omega` must be > 0 [N], got -3.0."),
        ({"rho": 0.0}, "`rho` must be > 0 [1/m], got 0.0."),
        ({"rho": -1.0}, "`rho` must be > 0 [1/m], got -1.0."),
        ({"sigma": 0.4999}, "`sigma` must be within [0.5, 1000], got 0.4999."),
        ({"sigma": 1000.1}, "`sigma` must be within [0.5, 1000], got 1000.1."),
        ({"n": 0.0}, "`n` must be within [0.01, 100], got 0.0."),
        ({"n": -1.0}, "`n` must be within [0.01, 100], got -1.0."),
        ({"n": 100.5}, "`n` must be within [0.01, 100], got 100.5."),
        (
            {"displacement_min": 0.25},
            "`displacement_min` must be below `displacement_max` [m], got 0.25 and 0.25.",
        ),
        (
            {"displacement_min": 0.5},
            "`displacement_min` must be below `displacement_max` [m], got 0.5 and 0.25.",
        ),
        (
            {"displacement_offset": 0.26},
            "`displacement_offset` must lie between `displacement_min` and `displacement_max` [m], got 0.26.",
        ),
        (
            {"displacement_offset": -0.3},
            "`displacement_offset` must lie between `displacement_min` and `displacement_max` [m], got -0.3.",
        ),
        (
            {"displacement_min": -1e308, "displacement_max": 1e308},
            "`displacement_min` must be within +-1e+09 m, got -1e+308.",
        ),
        (
            {"displacement_min": 0.0, "displacement_max": 1e-323},
            "`displacement_min` must be below `displacement_max` by 1e-12 m to 1e+06 m, got 0.0 and 1e-323.",
        ),
        ({"kappa_omega": 1e-309}, "`kappa_omega` must be within [1e-15, 1e+15] N, got 1e-309."),
        ({"kappa_omega": 1e308}, "`kappa_omega` must be within [1e-15, 1e+15] N, got 1e+308."),
        (
            {"rho": 1e-309},
            "`rho` must be within [2e-09, 2e+12] 1/m, 1e-09 to 1e+12 over the identified range, got 1e-309.",
        ),
        (
            {"rho": 1e300},
            "`rho` must be within [2e-09, 2e+12] 1/m, 1e-09 to 1e+12 over the identified range, got 1e+300.",
        ),
        (
            {"kE": (1.0, 2000.0, -1e17)},
            "`kE[2]` must be within +-1.6e+16, 1e+15 N over the identified range, got -1e+17.",
        ),
        (
            {"kA": (1.0, 2.0, 0.0, 1e154)},
            "`kA[3]` must be within +-6.4e+10, 1e+09 over the identified range, got 1e+154.",
        ),
        (
            {
                "kE": (),
                "FE_knots": (-0.25, -0.2, -0.1, 0.0, 0.1, 0.2, 0.25),
                "FE_forces": (0.0, 1.0, 2.0, 1e154, 4.0, 5.0, 6.0),
            },
            "`FE_forces[3]` must be within +-1e+15 N, got 1e+154.",
        ),
        (
            {"kA": (1.0, -8.0)},
            "the amplifier FA (coefficients `kA`) must be > 0 over the identified range, "
            "got -1 at displacement 0.25 m.",
        ),
        (
            # FA = (1 - 4x)^2 touches zero at the end of the range.
            {"kA": (1.0, -8.0, 16.0)},
            "the amplifier FA (coefficients `kA`) must be > 0 over the identified range, got 0 at displacement 0.25 m.",
        ),
        (
            # The same about another offset: the displacement in the sentence is the measured one.
            {"kA": (1.0, 8.0), "displacement_offset": 0.125},
            "the amplifier FA (coefficients `kA`) must be > 0 over the identified range, "
            "got -2 at displacement -0.25 m.",
        ),
    ],
)
def test_every_refusal_is_one_sentence(change: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=r"`") as refusal:
        replace(GOOD, **change)
    assert str(refusal.value) == sentence


@pytest.mark.parametrize("slope", [4.7, 5.0, 7.0, 8.0, 9.3, 100.0])
def test_fa_may_not_touch_zero_inside_the_range(slope: float) -> None:
    # (1 - slope*x)^2 at its zero is computed as 0 or as rounding.
    with pytest.raises(ValueError, match=r"^the amplifier FA .* must be > 0 over .* got \S+ at displacement 0\.\d+ m"):
        replace(GOOD, kA=(1.0, -2.0 * slope, slope * slope))


def test_a_dip_of_fa_between_samples_is_found() -> None:
    # FA = ((x - c)^2 + e)/(c^2 + e) dips to 3e-10 between any reasonable samples, and below zero for -e.
    c, e = 0.1, 3e-12
    lifted = [c * c + e, -2.0 * c, 1.0]
    assert replace(GOOD, kA=tuple(k / lifted[0] for k in lifted)).kA[0] == 1.0
    sunk = [c * c - e, -2.0 * c, 1.0]
    with pytest.raises(ValueError, match=r"FA .* got -3e-10 at displacement 0\.1 m"):
        replace(GOOD, kA=tuple(k / sunk[0] for k in sunk))


def test_all_that_is_wrong_is_listed() -> None:
    wrong = object.__new__(SpringParameters)
    for name, value in (asdict(GOOD) | {"rho": -1.0, "n": 0.0, "sigma": 0.0}).items():
        object.__setattr__(wrong, name, value)
    found = problems(wrong)
    assert len(found) == 3
    assert [sentence.split("`")[1] for sentence in found] == ["rho", "sigma", "n"]


def test_numbers_become_floats_and_good_springs_have_no_problem() -> None:
    parameters = replace(GOOD, kE=[1, 2], kA=np.array([1, 3]))
    assert parameters.kE == (1.0, 2.0)
    assert parameters.kA == (1.0, 3.0)
    assert all(type(c) is float for c in (*parameters.kE, *parameters.kA))
    for example in EXAMPLES.values():
        assert problems(example) == []


@pytest.mark.parametrize("coefficients", ["13", b"13", {0.0, 3000.0}])
def test_what_is_no_sequence_of_numbers_is_refused(coefficients: Any) -> None:
    with pytest.raises(TypeError, match="`kE` must be a sequence of numbers"):
        replace(GOOD, kE=coefficients)


def test_the_limits_themselves_are_allowed() -> None:
    for change in ({"sigma": 0.5}, {"sigma": 1000.0}, {"n": 0.01}, {"n": 100.0}, {"displacement_offset": -0.25}):
        assert problems(replace(GOOD, **change)) == []


@LAW
@given(springs())
def test_random_springs_of_these_tests_are_possible(parameters: SpringParameters) -> None:
    assert problems(parameters) == []
    x = np.linspace(parameters.x_min, parameters.x_max, 500)
    assert np.min(polyval(x, parameters.kA)) > 0.0


coefficients = st.lists(st.floats(-100.0, 100.0), min_size=1, max_size=21).map(tuple)


@LAW
@given(coefficients, st.floats(-1.5, 1.5), st.floats(1e-6, 3.0))
def test_the_least_value_is_a_value_and_none_is_lower(values: tuple[float, ...], low: float, width: float) -> None:
    high = low + width
    least, where = least_value(values, low, high)
    assert low <= where <= high
    grid = np.linspace(low, high, 2001)
    # 21 terms of up to 100*|x|^20 are summed with rounding 1e-16 each.
    rounding = 1e-14 * float(np.sum(np.abs(values) * max(abs(low), abs(high), 1.0) ** np.arange(len(values))))
    rounding += 1e-300
    assert least == pytest.approx(float(polyval(where, values)), rel=0.0, abs=rounding)
    assert least <= float(np.min(polyval(grid, values))) + rounding


def test_the_least_value_of_tiny_polynomials() -> None:
    # Of (1 - x)^2 - 1/4, times a factor with which products of two values underflow.
    for factor in (1e-160, 1e-200, 1e-300):
        least, where = least_value((0.75 * factor, -2.0 * factor, factor), 0.0, 3.0)
        assert (least / factor, where) == (pytest.approx(-0.25), pytest.approx(1.0))


def test_the_least_value_of_a_chebyshev_polynomial() -> None:
    for degree in (2, 3, 10, 20):
        powers = tuple(np.polynomial.chebyshev.cheb2poly([0.0] * degree + [1.0]).tolist())
        # T_M takes -1 between; coefficients up to 1e7 cancel at degree 20.
        assert least_value(powers, -1.0, 1.0)[0] == pytest.approx(-1.0, abs=1e-8)


@LAW
@given(coefficients, st.floats(-1.2, 1.2))
def test_derivative_undoes_antiderivative(values: tuple[float, ...], x: float) -> None:
    # (c/k)*k rounds twice.
    assert derivative(antiderivative(values)) == pytest.approx(values, rel=1e-15, abs=1e-300)
    scale = float(np.sum(np.abs(values) * abs(x) ** np.arange(len(values)))) + 1e-300
    # Horner's rule here and in NumPy.
    assert polynomial(values, x) == pytest.approx(float(polyval(x, values)), rel=0.0, abs=1e-14 * scale)


def test_the_derivative_of_a_constant_is_a_polynomial_too() -> None:
    assert derivative((3.0,)) == (0.0,)
