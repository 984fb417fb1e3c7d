"""The saturation function W and its inverse, in Python and in C, against hypergeometric functions and closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from itertools import product

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import kernel_tools
from strandspring.core.parameters import N_RANGE, SIGMA_RANGE
from strandspring.core.saturation import (
    Saturation,
    inverse_saturation,
    saturation,
    stroke_start,
)
from strandspring.kernel.arrays import FloatArray, address, floats
from strandspring.kernel.saturation_table import SaturationTable

pytestmark = pytest.mark.long

# The design asks for 1e-10. The interpolants are good to this, and W' multiplies the rounding of xi.
ACCURACY = 1e-13
ROUNDING = float(np.finfo(float).eps)

LAW = settings(max_examples=150)

# Close to 0, in the middle and close to 1, in more digits than a double holds.
LEVELS = [
    *(mp.mpf(10) ** -k for k in (18, 12, 8, 5, 3, 2, 1)),
    *(mp.mpf(k) / 10 for k in (2, 3, 5, 7, 8, 9)),
    *(1 - mp.mpf(10) ** -k for k in (2, 3, 5, 8, 11, 14)),
    mp.mpf(1) / 3,
]

PAIRS = [(n, sigma) for n in (0.05, 0.22, 1.0, 2.0, 3.7, 20.0) for sigma in (0.5, 1.0, 3.0, 50.0)]
CORNERS = list(product(N_RANGE, SIGMA_RANGE))
pairs = st.sampled_from([*PAIRS, *CORNERS])
# All of the supported range.
exponents = st.floats(math.log(N_RANGE[0]), math.log(N_RANGE[1])).map(
    lambda x: min(max(math.exp(x), N_RANGE[0]), N_RANGE[1])
)
sigmas = st.sampled_from(SIGMA_RANGE) | st.floats(math.log(1e-3), math.log(999.5)).map(lambda x: 0.5 + math.exp(x))

Elementwise = Callable[[FloatArray], FloatArray]
Implementation = Callable[[float, float], tuple[Elementwise, Elementwise]]


@cache
def table_of(n: float, sigma: float) -> Saturation:
    return Saturation(n, sigma)


@cache
def compiled_table_of(n: float, sigma: float) -> SaturationTable:
    return SaturationTable(n, sigma)


def in_python(n: float, sigma: float) -> tuple[Elementwise, Elementwise]:
    """W and its inverse, with which strokes begin."""
    table = table_of(n, sigma)
    return (
        lambda xi: np.array([saturation(table, value) for value in np.asarray(xi).tolist()]),
        lambda u: np.array([stroke_start(table, value) for value in np.asarray(u).tolist()]),
    )


def in_c(n: float, sigma: float) -> tuple[Elementwise, Elementwise]:
    table = compiled_table_of(n, sigma)

    def compiled_saturation(xi: FloatArray) -> FloatArray:
        xi = floats(xi)
        u = np.empty_like(xi)
        kernel_tools.library().driver_saturation(table.address, xi.size, address(xi), address(u))
        return u

    return compiled_saturation, table.inverse


implementations = pytest.mark.parametrize("implementation", [in_python, in_c])


def exact_rising(u: mp.mpf, n: float) -> mp.mpf:
    """S(u) = integral of 1/(1 - v^n) from 0 to u."""
    with mp.workdps(30):
        b = 1 / mp.mpf(n)
        return u * mp.hyp2f1(1, b, 1 + b, u**n)


def exact_falling(w: mp.mpf, n: float, sigma: float) -> mp.mpf:
    """T(w) = integral of 1/(1 + (2 sigma - 1) v^n) from 0 to w."""
    with mp.workdps(30):
        b = 1 / mp.mpf(n)
        return w * mp.hyp2f1(1, b, 1 + b, -(2 * mp.mpf(sigma) - 1) * w**n)


def rounding_of(u: FloatArray, xi: FloatArray, n: float, sigma: float) -> FloatArray:
    """What a rounding of xi does to W."""
    slope = np.where(u >= 0.0, 1.0 - np.abs(u) ** n, 1.0 + (2.0 * sigma - 1.0) * np.abs(u) ** n)
    return ROUNDING * (np.abs(u) + np.abs(xi) * slope)


def check_against_the_hypergeometric_form(
    implementation: Implementation,
    n: float,
    sigma: float,
    levels: list[mp.mpf],
) -> None:
    """W at the xi where the hypergeometric form is +-level, and the inverse there."""
    w, inverse = implementation(n, sigma)
    sizes = np.array(levels, dtype=float)
    for sign, exact in (
        (1.0, [exact_rising(u, n) for u in levels]),
        (-1.0, [-exact_falling(u, n, sigma) for u in levels]),
    ):
        xi = np.array(exact, dtype=float)
        tolerance = ACCURACY + 3.0 * rounding_of(sign * sizes, xi, n, sigma)
        errors = np.array([float(got - sign * u) for got, u in zip(w(xi), levels, strict=True)])
        assert np.all(np.abs(errors) <= tolerance), (n, sigma, sign)
        # An error of xi counts by the W that it leads to.
        slope = rounding_of(sign * sizes, np.ones_like(sizes), n, sigma) / ROUNDING - sizes
        back = inverse(sign * sizes)
        assert np.all(np.abs(back - xi) * slope <= tolerance + 3.0 * ROUNDING), (n, sigma, sign)


@implementations
@pytest.mark.parametrize("n", [0.01, 0.05, 0.1, 0.22, 0.5, 1.0, 1.7, 2.0, 5.0, 20.0, 57.0, 100.0])
def test_w_is_the_inverse_of_the_hypergeometric_form(implementation: Implementation, n: float) -> None:
    for sigma in (0.5, 0.6, 1.0, 3.0, 50.0, 1000.0):
        check_against_the_hypergeometric_form(implementation, n, sigma, LEVELS)


@implementations
@settings(LAW, max_examples=40)
@given(exponents, sigmas, st.lists(st.floats(-34.0, 34.0), min_size=12, max_size=12))
def test_w_is_accurate_at_all_exponents_and_levels(
    implementation: Implementation,
    n: float,
    sigma: float,
    logits: list[float],
) -> None:
    with mp.workdps(30):
        levels = [1 / (1 + mp.exp(-mp.mpf(q))) for q in logits]
    check_against_the_hypergeometric_form(implementation, n, sigma, levels)


@implementations
@settings(LAW, max_examples=40)
@given(exponents, sigmas, st.lists(st.floats(-1.0, 1.0), min_size=50, max_size=50))
def test_w_undoes_its_inverse_to_rounding(
    implementation: Implementation,
    n: float,
    sigma: float,
    levels: list[float],
) -> None:
    """So that many small reversals do not drift."""
    w, inverse = implementation(n, sigma)
    u = np.array([*levels, -1.0, -1e-20, -0.0, 0.0, 1e-20, 0.4, 1.0 - 1e-15, 1.0])
    xi = inverse(u)
    # Python corrects xi once, where W is not nearly level.
    assert np.all(np.abs(w(xi) - u) <= 1e-15 + 3.0 * rounding_of(u, xi, n, sigma))


@settings(LAW, max_examples=40)
@given(exponents, sigmas)
def test_python_and_c_share_one_w(n: float, sigma: float) -> None:
    end = inverse_saturation(table_of(n, sigma), -1.0)
    near, close = np.geomspace(1e-16, 1.0, 300), 1.0 - np.geomspace(1e-16, 0.5, 100)
    xi = np.concatenate([np.geomspace(1e-16, 60.0 / n, 300), end * near, end * close, [0.0, -0.0, 1e300, math.inf]])
    one, other = in_python(n, sigma)[0](xi), in_c(n, sigma)[0](xi)
    assert np.all(np.abs(one - other) <= 2.0 * ACCURACY + 3.0 * rounding_of(one, np.clip(xi, end, 1e3), n, sigma))
    # Relative too, so that |u|^n is right for small n; below 1e-13 both tables end, and W is taken for a straight line.
    resolved = np.abs(one) > 1e-13
    np.testing.assert_allclose(other[resolved], one[resolved], rtol=5e-13 + 4e-16 * sigma)


@pytest.mark.parametrize(("n", "sigma"), [(0.01, 1000.0), (0.05, 50.0), (0.22, 3.0), (1.0, 1.0), (20.0, 0.5)])
def test_the_inverse_is_the_hypergeometric_form(n: float, sigma: float) -> None:
    table = Saturation(n, sigma)
    for level in LEVELS:
        u = float(level)
        # Quadrature of 8 points per cell and rounding; |u| below 1e-14 counts as linear, hence the absolute part.
        tolerance = {"rel": 1e-13, "abs": 1e-13}
        assert inverse_saturation(table, u) == pytest.approx(float(exact_rising(mp.mpf(u), n)), **tolerance)
        assert inverse_saturation(table, -u) == pytest.approx(-float(exact_falling(mp.mpf(u), n, sigma)), **tolerance)


XI = np.concatenate([np.geomspace(1e-12, 40.0, 400), np.linspace(0.0, 5.0, 101)])


@implementations
def test_n_1_rises_exponentially(implementation: Implementation) -> None:
    w = implementation(1.0, 2.0)[0]
    # Interpolation of a difference that vanishes for n = 1, or of an entire function: rounding only.
    assert w(XI) == pytest.approx(-np.expm1(-XI), rel=1e-14, abs=4e-16)


@implementations
def test_n_2_rises_as_a_hyperbolic_tangent(implementation: Implementation) -> None:
    w = implementation(2.0, 2.0)[0]
    # The interpolated difference is constant for n = 2, up to the rounding of its quadrature.
    assert w(XI) == pytest.approx(np.tanh(XI), rel=0.0, abs=1e-13)


@implementations
@pytest.mark.parametrize("n", [0.05, 0.22, 1.0, 5.0, 20.0])
def test_sigma_one_half_recovers_linearly(implementation: Implementation, n: float) -> None:
    zeta = np.concatenate([np.geomspace(1e-12, 1.0, 200), [0.0, 1.0]])
    # (2 sigma - 1) = 0 leaves T(w) = w, integrated in ln(w) by 8 points per cell.
    assert implementation(n, 0.5)[0](-zeta) == pytest.approx(-zeta, rel=1e-13, abs=1e-13)


@implementations
@pytest.mark.parametrize("sigma", [0.6, 1.0, 3.0, 50.0])
def test_n_1_recovers_exponentially(implementation: Implementation, sigma: float) -> None:
    curvature = 2.0 * sigma - 1.0
    zeta = np.geomspace(1e-12, 0.999 * math.log1p(curvature) / curvature, 200)
    # dw/ds = 1 + curvature*w.
    expected = -np.expm1(curvature * zeta) / curvature
    assert implementation(1.0, sigma)[0](-zeta) == pytest.approx(expected, rel=0.0, abs=ACCURACY)


@implementations
@pytest.mark.parametrize("sigma", [0.6, 1.0, 3.0, 50.0])
def test_n_2_recovers_as_a_tangent(implementation: Implementation, sigma: float) -> None:
    root = math.sqrt(2.0 * sigma - 1.0)
    zeta = np.geomspace(1e-12, 0.999 * math.atan(root) / root, 200)
    # dw/ds = 1 + root^2*w^2.
    expected = -np.tan(root * zeta) / root
    assert implementation(2.0, sigma)[0](-zeta) == pytest.approx(expected, rel=0.0, abs=ACCURACY)


@implementations
def test_n_one_half_has_an_elementary_inverse(
    implementation: Implementation,
) -> None:
    u = np.linspace(0.05, 0.999, 50)
    # Substituting v = s^2 gives S(u) = -2*(sqrt(u) + ln(1 - sqrt(u))).
    xi = -2.0 * (np.sqrt(u) + np.log1p(-np.sqrt(u)))
    assert implementation(0.5, 2.0)[0](xi) == pytest.approx(u, rel=0.0, abs=ACCURACY)


@implementations
@LAW
@given(pairs, st.floats(-50.0, 50.0), st.floats(0.0, 5.0))
def test_w_grows_and_never_faster_than_its_equation_allows(
    implementation: Implementation,
    pair: tuple[float, float],
    xi: float,
    step: float,
) -> None:
    low, high = implementation(*pair)[0](np.array([xi, xi + step]))
    growth = high - low
    # Neighbouring cells meet to within the interpolation error, 1e-12.
    assert growth >= -1e-12
    # du/dxi lies in [0, 2 sigma], and within [0, 1] once u >= 0; xi + step itself is rounded.
    steepest = 2.0 * pair[1] if xi < 0.0 else 1.0
    assert growth <= steepest * (step + 1e-14) + 1e-12


@implementations
@LAW
@given(pairs, st.floats(-1e300, 1e300))
def test_w_is_bounded_and_has_the_sign_of_its_argument(
    implementation: Implementation, pair: tuple[float, float], xi: float
) -> None:
    (u,) = implementation(*pair)[0](np.array([xi]))
    assert abs(u) <= 1.0
    assert u * xi >= 0.0


@pytest.mark.parametrize("pair", PAIRS)
def test_w_at_the_extremes(pair: tuple[float, float]) -> None:
    table = table_of(*pair)
    assert saturation(table, 0.0) == pytest.approx(0.0, abs=1e-299)  # xi is raised to 1e-300 before its logarithm
    assert inverse_saturation(table, 0.0) == 0.0
    assert saturation(table, 1e300) == 1.0
    assert saturation(table, -1e300) == -1.0
    # The largest xi resolved is as good as infinite; the recovery from there starts where the table ends.
    assert saturation(table, inverse_saturation(table, 1.0)) == pytest.approx(1.0, rel=0.0, abs=1e-15)
    assert saturation(table, inverse_saturation(table, -1.0)) == pytest.approx(-1.0, rel=0.0, abs=ACCURACY)
    for tiny in (5e-324, 1e-300, 1e-30):
        # Below 1e-14 all of W is linear within 1e-14, cusp or not.
        assert saturation(table, tiny) == pytest.approx(0.0, abs=1e-14)
        assert saturation(table, -tiny) == pytest.approx(0.0, abs=1e-14)
