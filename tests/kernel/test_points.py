"""omega at points of given strokes: against whole paths, difference quotients and analytic cases."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strandspring import SpringParameters
from strandspring.core.parameters import N_RANGE, SIGMA_RANGE
from strandspring.kernel.arrays import address
from strandspring.kernel.path import PathSolver
from strandspring.kernel.points import RecordPoints
from stroke_points import omega_with_derivatives

LAW = settings(max_examples=100)
RHO = 4.0
TURNS = np.array([0.1, 0.8, -0.2, 0.1, -0.05, 0.02, -0.9, 0.3, 0.29, 0.6])
SHARES = np.linspace(0.05, 1.0, 20)


def omega_at_points(*arguments: object) -> np.ndarray:
    return omega_with_derivatives(*arguments)[0]


def points(turns: np.ndarray = TURNS) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Direction and length of the strokes between `turns`, stroke and travel of 20 points on each."""
    length = np.diff(turns)
    stroke = np.repeat(np.arange(length.size), SHARES.size)
    return np.sign(length).astype(int), np.abs(length), stroke, np.tile(SHARES, length.size) * np.abs(length)[stroke]


@LAW
@given(
    st.floats(np.log(N_RANGE[0]), np.log(N_RANGE[1])).map(lambda x: float(np.clip(np.exp(x), *N_RANGE))),
    st.sampled_from(SIGMA_RANGE) | st.floats(0.5, 60.0),
    st.floats(-1.0, 1.0),
    st.lists(st.floats(1e-3, 2.0), min_size=1, max_size=8),
)
def test_points_lie_on_the_path(n: float, sigma: float, omega_start: float, lengths: list[float]) -> None:
    turns = np.cumsum([0.0, *(size * (-1.0) ** k for k, size in enumerate(lengths))])
    direction, length, stroke, travel = points(turns)
    found = omega_at_points(RHO, sigma, n, omega_start, direction, length, stroke, travel)
    parameters = SpringParameters((0.0,), (1.0,), 1.0, RHO, sigma, n, 0.0, -20.0, 20.0)
    path = np.concatenate([turns[:1], turns[stroke] + direction[stroke] * travel])
    expected = PathSolver(parameters).omega(path, omega_start)[1:]
    # xi is rounded in other ways; W' is at most 2 sigma.
    assert np.max(np.abs(found - expected)) <= 1e-14 * (1.0 + 20.0 * sigma)


@pytest.mark.parametrize(("n", "sigma"), [(0.22, 3.0), (0.7, 0.55), (1.0, 1.0), (2.5, 1.4), (9.0, 40.0)])
@pytest.mark.parametrize("omega_start", [-0.7, 0.1, 0.35])
def test_derivatives_equal_difference_quotients(n: float, sigma: float, omega_start: float) -> None:
    strokes = points()
    at = np.array([RHO, sigma, n, omega_start])
    _, derivatives = omega_with_derivatives(*at, *strokes)
    for row, size in enumerate((RHO, sigma, n, 1.0)):
        # Tables of neighbouring n and sigma differ by 1e-13, over a step of 2e-4 by 1e-9; fourth order leaves 1e-9.
        step = 2e-4 * size
        response = {}
        for k in (-2, -1, 1, 2):
            moved = at.copy()
            moved[row] += k * step
            response[k] = omega_at_points(*moved, *strokes)
        quotient = (8.0 * (response[1] - response[-1]) - (response[2] - response[-2])) / (12.0 * step)
        # Where omega passes zero the quotient crosses the cusp of n < 1.
        smooth = np.min([np.abs(response[k]) for k in response], axis=0) > 0.02
        assert np.count_nonzero(smooth) > 100
        scale = np.max(np.abs(derivatives[row])) * size
        assert np.max(np.abs(derivatives[row] - quotient)[smooth]) * size <= 2e-7 * max(scale, 1.0)


@pytest.mark.parametrize(("n", "sigma"), [(0.22, 3.0), (1.0, 1.0), (9.0, 40.0)])
def test_rates_in_one_call_equal_one_after_the_other(n: float, sigma: float) -> None:
    rates = RHO * np.array([0.3, 1.0, 7.0])
    found = RecordPoints.of_one(*points()).omega_by_rate(rates, sigma, n)
    expected = [omega_at_points(rho, sigma, n, 0.0, *points()) for rho in rates]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-8)  # a coarse table's error


@pytest.mark.parametrize("s_1", [0.15, 3.0, 30.0])  # the last two saturate, the third by far
def test_derivatives_of_exponential_saturation_and_recovery(s_1: float) -> None:
    """n = 1: omega = 1 - (1 - omega_start)*exp(-rho*s) in loading, then recovery with the rate (2 sigma - 1)*rho."""
    sigma, start = 1.7, 0.2
    c = 2.0 * sigma - 1.0
    direction, length = np.array([1, -1]), np.array([s_1, 0.05])
    s_2 = np.linspace(0.0, 0.05, 11)
    _, found = omega_with_derivatives(RHO, sigma, 1.0, start, direction, length, np.full(s_2.size, 1), s_2)
    top = 1.0 - (1.0 - start) * np.exp(-RHO * s_1)
    # On the way back w = omega > 0 obeys dw/ds = -rho*(1 + c*w).
    decay = np.exp(-c * RHO * s_2)
    assert np.all((1.0 + c * top) * decay > 1.0)
    by_top = decay
    by_rho = (1.0 - start) * s_1 * np.exp(-RHO * s_1) * by_top - (1.0 + c * top) * s_2 * decay
    by_c = (top * decay - (1.0 + c * top) * RHO * s_2 * decay) / c - ((1.0 + c * top) * decay - 1.0) / c**2
    np.testing.assert_allclose(found[0], by_rho, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found[1], 2.0 * by_c, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found[3], np.exp(-RHO * s_1) * by_top, rtol=0.0, atol=1e-12)


def test_derivatives_of_tanh() -> None:
    """n = 2: omega = tanh(artanh(omega_start) + rho*s)."""
    s = np.linspace(0.01, 1.0, 10)
    omega, found = omega_with_derivatives(RHO, 1.7, 2.0, 0.2, np.array([1]), np.array([1.0]), np.zeros(10, int), s)
    expected = np.tanh(np.arctanh(0.2) + RHO * s)
    np.testing.assert_allclose(omega, expected, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(found[0], (1.0 - expected**2) * s, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found[1], 0.0, rtol=0.0, atol=0.0)
    np.testing.assert_allclose(found[3], (1.0 - expected**2) / (1.0 - 0.2**2), rtol=0.0, atol=1e-12)


def test_arrays_with_gaps_have_no_address() -> None:
    with pytest.raises(ValueError, match="contiguous"):
        address(np.zeros((3, 4)).T)


def test_arrays_that_are_read_only_or_empty_have_an_address() -> None:
    array = np.arange(6.0)[2:]
    expected = array.ctypes.data
    assert address(array) == expected
    array.setflags(write=False)
    assert address(array) == expected
    assert address(np.zeros(0)) > 0


def test_records_are_as_each_alone() -> None:
    direction, length = np.array([1, -1, 1, -1, 1]), np.array([1.0, 1.6, 0.7, 0.9, 2.0])
    stroke = np.repeat(np.arange(5), 7)
    travel = length[stroke] * np.tile(np.linspace(0.1, 1.0, 7), 5)
    first_stroke, first_point, starts = [0, 3, 5], [0, 21, 35], np.array([0.4, -0.7])
    law = (3.0, 1.7, 0.6)
    both = RecordPoints(np.array(first_stroke), np.array(first_point), direction, length, stroke, travel)
    omega, derivatives = both.omega(*law, starts)
    for k in range(2):
        strokes, at = (slice(first[k], first[k + 1]) for first in (first_stroke, first_point))
        own, by = omega_with_derivatives(
            *law, starts[k], direction[strokes], length[strokes], stroke[at] - strokes.start, travel[at]
        )
        np.testing.assert_array_equal(omega[at], own)
        natural = np.array([law[0], law[1], law[2]])[:, None]
        np.testing.assert_allclose(derivatives[:3, at], by[:3] * natural, rtol=1e-15, atol=0.0)
        np.testing.assert_array_equal(derivatives[3, at], by[3])
