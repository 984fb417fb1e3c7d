"""The saturation function W and its inverse, in Python and in C, against hypergeometric functions."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from kernel_tools import FloatArray, Kernel
from oracles import travel_to
from strandspring import SpringParameters
from strandspring.core.parameters import N_RANGE, SIGMA_RANGE
from strandspring.core.saturation import Saturation, inverse_saturation, saturation, stroke_start
from strandspring.kernel.saturation_table import SaturationTable

# The design asks for 1e-10. The interpolants are good to this, and W' multiplies the rounding of xi.
ACCURACY = 1e-13
ROUNDING = float(np.finfo(float).eps)
# Of u from 1e-18 to 1 - 1e-14.
LOGITS = [-41.4, -27.6, -18.4, -11.5, -6.9, -2.2, -0.7, 0.0, 0.7, 2.2, 6.9, 11.5, 18.4, 32.2]
exponents = st.floats(*np.log(N_RANGE)).map(lambda x: float(np.clip(math.exp(x), *N_RANGE)))
sigmas = st.sampled_from(SIGMA_RANGE) | st.floats(math.log(1e-3), math.log(999.5)).map(lambda x: 0.5 + math.exp(x))

Elementwise = Callable[[FloatArray], FloatArray]
Implementation = Callable[[float, float], tuple[Elementwise, Elementwise]]
python_table = cache(Saturation)


@cache
def kernel_of(n: float, sigma: float) -> Kernel:
    return Kernel(SpringParameters((0.0,), (1.0,), 1.0, 1.0, sigma, n, 0.0, -1.0, 1.0))


def in_python(n: float, sigma: float) -> tuple[Elementwise, Elementwise]:
    """W and its inverse, with which strokes begin."""

    def elementwise(of: Callable[[Saturation, float], float], values: FloatArray) -> FloatArray:
        return np.array([of(python_table(n, sigma), value) for value in values.tolist()])

    return partial(elementwise, saturation), partial(elementwise, stroke_start)


def in_c(n: float, sigma: float) -> tuple[Elementwise, Elementwise]:
    return lambda xi: kernel_of(n, sigma).saturation(xi)[0], lambda u: kernel_of(n, sigma).saturation(u)[1]


implementations = pytest.mark.parametrize("ways", [in_python, pytest.param(in_c, marks=pytest.mark.long)])


def exact(logit: float, sign: int, n: float, sigma: float) -> tuple[Any, float]:
    """u in more digits than a double holds, and the integrals of the paper's eq. (22) over u: S(u) from 0 to u > 0, and
    -T(-u) to u < 0.
    """
    import mpmath as mp

    with mp.workdps(30):
        u = sign / (1 + mp.exp(-mp.mpf(logit)))
        return u, travel_to(u, n, sigma)


def rounding_of(u: FloatArray, xi: FloatArray, n: float, sigma: float) -> FloatArray:
    """What a rounding of xi does to W."""
    slope = np.where(u >= 0.0, 1.0 - np.abs(u) ** n, 1.0 + (2.0 * sigma - 1.0) * np.abs(u) ** n)
    return ROUNDING * (np.abs(u) + np.abs(xi) * slope)


def check(ways: Implementation, n: float, sigma: float, logits: list[float]) -> None:
    """W at the xi where the hypergeometric form is +-u, and the inverse there."""
    w, inverse = ways(n, sigma)
    for sign in (1, -1):
        levels, places = zip(*(exact(logit, sign, n, sigma) for logit in logits), strict=True)
        u, xi = np.array(levels, dtype=float), np.array(places)
        tolerance = ACCURACY + 3.0 * rounding_of(u, xi, n, sigma)
        errors = [float(got - level) for got, level in zip(w(xi).tolist(), levels, strict=True)]
        assert np.all(np.abs(errors) <= tolerance), (n, sigma, sign)
        # An error of xi counts by the W that it leads to.
        slope = rounding_of(u, np.ones_like(u), n, sigma) / ROUNDING - np.abs(u)
        assert np.all(np.abs(inverse(u) - xi) * slope <= tolerance + 3.0 * ROUNDING), (n, sigma, sign)


@implementations
@settings(max_examples=15)
@given(exponents, sigmas, st.lists(st.floats(-34.0, 34.0), min_size=6, max_size=6))
@example(0.01, 0.5, LOGITS)
@example(1.0, 0.6, LOGITS)
@example(100.0, 1000.0, LOGITS)
def test_w_is_accurate_at_all_exponents_and_levels(
    ways: Implementation, n: float, sigma: float, logits: list[float]
) -> None:
    check(ways, n, sigma, logits)


@pytest.mark.long
@settings(max_examples=15)
@given(exponents, sigmas)
def test_python_and_c_share_one_w(n: float, sigma: float) -> None:
    end = inverse_saturation(python_table(n, sigma), -1.0)
    near, close = np.geomspace(1e-16, 1.0, 300), 1.0 - np.geomspace(1e-16, 0.5, 100)
    xi = np.concatenate([np.geomspace(1e-16, 60.0 / n, 300), end * near, end * close, [0.0, -0.0, 1e300, math.inf]])
    one, other = in_python(n, sigma)[0](xi), in_c(n, sigma)[0](xi)
    assert np.all(np.abs(one - other) <= 2.0 * ACCURACY + 3.0 * rounding_of(one, np.clip(xi, end, 1e3), n, sigma))
    # Relative too, so that |u|^n is right for small n; below 1e-13 both tables end, and W is taken for a straight line.
    resolved = np.abs(one) > 1e-13
    np.testing.assert_allclose(other[resolved], one[resolved], rtol=5e-13 + 4e-16 * sigma)
    u = np.linspace(-1.0, 1.0, 99)
    assert np.array_equal(SaturationTable(n, sigma).inverse(u), kernel_of(n, sigma).saturation(u)[1])


@implementations
@pytest.mark.parametrize("pair", [(0.05, 50.0), (0.22, 3.0), (3.7, 0.5), (100.0, 1000.0)])
def test_w_is_bounded_and_has_the_sign_of_its_argument_at_the_extremes(
    ways: Implementation, pair: tuple[float, float]
) -> None:
    w, inverse = ways(*pair)
    assert w(np.array([1e300, -1e300, math.inf])).tolist() == [1.0, -1.0, 1.0]
    assert np.abs(w(np.array([0.0, 5e-324, 1e-30, -5e-324, -1e-30]))).max() <= 1e-14  # linear there, cusp or not
    ends = inverse(np.array([-1.0, 0.0, 1.0]))
    # W undoes its inverse to rounding, so that many small reversals do not drift; Python corrects xi once.
    u = np.linspace(-1.0, 1.0, 99)
    assert np.all(np.abs(w(inverse(u)) - u) <= 1e-14 + 3.0 * rounding_of(u, inverse(u), *pair))
    assert ends[1] == pytest.approx(0.0, abs=1e-299)  # Python counts smaller xi as 1e-300
    # The largest xi resolved is as good as infinite; the recovery from there starts where the table ends.
    assert w(ends) == pytest.approx([-1.0, 0.0, 1.0], abs=ACCURACY)
    xi = np.linspace(1.2 * ends[0], min(ends[2], 50.0), 5000)
    growth = np.diff(w(xi))
    # Neighbouring cells meet to within the interpolation error, and du/dxi lies in [0, 2 sigma].
    assert growth.min() >= -1e-12
    assert growth.max() <= 2.0 * pair[1] * (xi[1] - xi[0]) + 1e-12
    assert (w(xi) * xi).min() >= 0.0


@implementations
@pytest.mark.parametrize("sigma", [0.75, 1.0, 4.0])
def test_exponents_of_1_and_2_have_closed_forms(ways: Implementation, sigma: float) -> None:
    """Eq. (22): logarithms for n = 1, and inverse tangents for n = 2, hyperbolic where omega grows in size."""
    xi, a = np.linspace(0.0, 12.0, 61), 2.0 * sigma - 1.0
    grown = {1.0: -np.expm1(-xi), 2.0: np.tanh(xi)}
    left = np.linspace(0.0, 1.0, 41)
    travelled = {1.0: np.log1p(a * left) / a, 2.0: np.arctan(np.sqrt(a) * left) / np.sqrt(a)}
    for n in (1.0, 2.0):
        w, _ = ways(n, sigma)
        np.testing.assert_allclose(w(xi), grown[n], rtol=0.0, atol=ACCURACY)
        np.testing.assert_allclose(w(-travelled[n]), -left, rtol=0.0, atol=ACCURACY)
