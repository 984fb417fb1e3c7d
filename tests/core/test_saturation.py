"""The saturation function W and its inverse against hypergeometric functions and elementary closed forms."""

from __future__ import annotations

import math
from functools import cache

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strandspring.core.saturation import Saturation, inverse_saturation, saturation
from strandspring.kernel.path import Vector, saturation_of

# The design asks for 1e-10; the worst measured below is 1.3e-13, and 2e-12 at n = 100, sigma = 1000.
ACCURACY = 5e-13

LAW = settings(derandomize=True, deadline=None, max_examples=150)

# Close to 0, in the middle and close to 1, in more digits than a double holds.
LEVELS = [
    *(mp.mpf(10) ** -k for k in (18, 12, 8, 5, 3, 2, 1)),
    *(mp.mpf(k) / 10 for k in (2, 3, 5, 7, 8, 9)),
    *(1 - mp.mpf(10) ** -k for k in (2, 3, 5, 8, 11, 14)),
    mp.mpf(1) / 3,
]

PAIRS = [(n, sigma) for n in (0.05, 0.22, 1.0, 2.0, 3.7, 20.0) for sigma in (0.5, 1.0, 3.0, 50.0)]
pairs = st.sampled_from(PAIRS)


@cache
def table_of(n: float, sigma: float) -> Saturation:
    return Saturation(n, sigma)


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


def worst_omega_error(n: float, sigma: float, levels: list[mp.mpf]) -> float:
    """Largest error of W at the xi where the hypergeometric form says that it is +-level."""
    table = Saturation(n, sigma)
    errors = [abs(saturation(table, float(exact_rising(u, n))) - u) for u in levels]
    errors += [abs(saturation(table, -float(exact_falling(w, n, sigma))) + w) for w in levels]
    return float(max(errors))


@pytest.mark.parametrize("n", [0.05, 0.1, 0.22, 0.5, 1.0, 1.7, 2.0, 5.0, 20.0])
def test_w_is_the_inverse_of_the_hypergeometric_form(n: float) -> None:
    for sigma in (0.5, 0.6, 1.0, 3.0, 50.0):
        assert worst_omega_error(n, sigma, LEVELS) <= ACCURACY, f"sigma = {sigma}"


def test_w_is_accurate_at_random_exponents_and_levels() -> None:
    rng = np.random.default_rng(11)
    for _ in range(25):
        n = float(np.exp(rng.uniform(math.log(0.05), math.log(20.0))))
        sigma = 0.5 + float(np.exp(rng.uniform(math.log(1e-3), math.log(49.5))))
        levels = [mp.mpf(float(u)) for u in rng.uniform(0.0, 1.0, 6)]
        assert worst_omega_error(n, sigma, levels) <= ACCURACY, f"n = {n}, sigma = {sigma}"


@pytest.mark.parametrize("n", [0.01, 100.0])
@pytest.mark.parametrize("sigma", [0.5, 1000.0])
def test_w_keeps_its_accuracy_at_the_limits_of_the_supported_range(n: float, sigma: float) -> None:
    assert worst_omega_error(n, sigma, LEVELS) <= 1e-11


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


def test_n_1_rises_exponentially() -> None:
    # 9th-degree interpolation of a difference that vanishes for n = 1: rounding only.
    assert saturation_of(Saturation(1.0, 2.0, Vector), XI) == pytest.approx(-np.expm1(-XI), rel=1e-14, abs=1e-16)


def test_n_2_rises_as_a_hyperbolic_tangent() -> None:
    # The interpolated difference is constant for n = 2, up to the rounding of its quadrature.
    assert saturation_of(Saturation(2.0, 2.0, Vector), XI) == pytest.approx(np.tanh(XI), rel=0.0, abs=1e-13)


@pytest.mark.parametrize("n", [0.05, 0.22, 1.0, 5.0, 20.0])
def test_sigma_one_half_recovers_linearly(n: float) -> None:
    zeta = np.concatenate([np.geomspace(1e-12, 1.0, 200), [0.0, 1.0]])
    # (2 sigma - 1) = 0 leaves T(w) = w, integrated in ln(w) by 8 points per cell.
    assert saturation_of(Saturation(n, 0.5, Vector), -zeta) == pytest.approx(-zeta, rel=1e-13, abs=1e-13)


@pytest.mark.parametrize("sigma", [0.6, 1.0, 3.0, 50.0])
def test_n_1_recovers_exponentially(sigma: float) -> None:
    curvature = 2.0 * sigma - 1.0
    zeta = np.geomspace(1e-12, 0.999 * math.log1p(curvature) / curvature, 200)
    # dw/ds = 1 + curvature*w; interpolation error below 2e-13 (measured).
    expected = -np.expm1(curvature * zeta) / curvature
    assert saturation_of(Saturation(1.0, sigma, Vector), -zeta) == pytest.approx(expected, rel=0.0, abs=1e-12)


@pytest.mark.parametrize("sigma", [0.6, 1.0, 3.0, 50.0])
def test_n_2_recovers_as_a_tangent(sigma: float) -> None:
    root = math.sqrt(2.0 * sigma - 1.0)
    zeta = np.geomspace(1e-12, 0.999 * math.atan(root) / root, 200)
    # dw/ds = 1 + root^2*w^2; interpolation error below 1e-13 (measured).
    expected = -np.tan(root * zeta) / root
    assert saturation_of(Saturation(2.0, sigma, Vector), -zeta) == pytest.approx(expected, rel=0.0, abs=1e-12)


def test_n_one_half_has_an_elementary_inverse() -> None:
    table = Saturation(0.5, 2.0)
    for u in np.linspace(0.05, 0.999, 50):
        root = math.sqrt(u)
        # Substituting v = s^2 gives S(u) = -2*(sqrt(u) + ln(1 - sqrt(u))).
        assert saturation(table, -2.0 * (root + math.log1p(-root))) == pytest.approx(u, abs=ACCURACY)


@LAW
@given(pairs, st.floats(-1.0, 1.0))
def test_w_undoes_its_inverse(pair: tuple[float, float], u: float) -> None:
    table = table_of(*pair)
    assert saturation(table, inverse_saturation(table, u)) == pytest.approx(u, rel=0.0, abs=ACCURACY)


@LAW
@given(pairs, st.floats(-50.0, 50.0), st.floats(0.0, 5.0))
def test_w_grows_and_never_faster_than_its_equation_allows(pair: tuple[float, float], xi: float, step: float) -> None:
    table = table_of(*pair)
    growth = saturation(table, xi + step) - saturation(table, xi)
    # Neighbouring cells meet to within the interpolation error, 1e-12.
    assert growth >= -1e-12
    # du/dxi lies in [0, 2 sigma], and within [0, 1] once u >= 0; xi + step itself is rounded.
    steepest = 2.0 * pair[1] if xi < 0.0 else 1.0
    assert growth <= steepest * (step + 1e-14) + 1e-12


@LAW
@given(pairs, st.floats(-1e300, 1e300))
def test_w_is_bounded_and_has_the_sign_of_its_argument(pair: tuple[float, float], xi: float) -> None:
    u = saturation(table_of(*pair), xi)
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


@pytest.mark.parametrize("pair", [*PAIRS, (0.01, 1000.0), (100.0, 1000.0)])
def test_single_steps_and_whole_paths_share_one_w(pair: tuple[float, float]) -> None:
    scalar, vector = Saturation(*pair), Saturation(*pair, Vector)
    extremes = [-1e300, -5e-324, 0.0, 5e-324, 1e300]
    xi = np.concatenate([-XI, XI, extremes, np.random.default_rng(5).uniform(-3.0, 60.0, 300)])
    one_by_one = [saturation(scalar, value) for value in xi.tolist()]
    # exp and log of NumPy and of the C library differ in the last bit; the tables amplify it to 2e-13 (measured).
    assert saturation_of(vector, xi) == pytest.approx(np.array(one_by_one), rel=0.0, abs=1e-12)
    # On the same tables the last bit is all that is left.
    as_lists = vector.converted(np.ndarray.tolist)
    one_by_one = [saturation(as_lists, value) for value in xi.tolist()]
    assert saturation_of(vector, xi) == pytest.approx(np.array(one_by_one), rel=0.0, abs=1e-15)
    for u in np.linspace(-1.0, 1.0, 101).tolist():
        expected = pytest.approx(inverse_saturation(scalar, u), rel=1e-14, abs=1e-14)  # nothing is amplified here
        assert inverse_saturation(as_lists, u) == expected
