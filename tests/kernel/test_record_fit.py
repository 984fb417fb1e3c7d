"""Springs fitted to points by the kernel, against NumPy's and SciPy's least squares, and against each record alone."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from strandspring.kernel.arrays import FloatArray
from strandspring.kernel.points import RecordPoints
from strandspring.kernel.record_fit import FoundFit, RecordFit
from stroke_points import omega_with_derivatives

DIRECTION, LENGTH = np.array([1, -1, 1, -1]), np.array([1.0, 1.7, 1.3, 2.0])
PER_STROKE = 60
STROKE = np.repeat(np.arange(4), PER_STROKE)
TRAVEL = LENGTH[STROKE] * np.tile(np.linspace(0.01, 1.0, PER_STROKE), 4)
BEGIN = np.cumsum([0.0, *(DIRECTION * LENGTH)])[:-1]
PLACE = BEGIN[STROKE] + DIRECTION[STROKE] * TRAVEL
START = np.array([np.log(3.0), np.log(1.7), np.log(0.6), 0.4])
LOW, HIGH = np.array([-3.0, np.log(0.5), -3.0, -1.0]), np.array([6.0, 3.0, 3.0, 1.0])
ONES = np.ones(STROKE.size)


def points(direction: np.ndarray = DIRECTION, length: np.ndarray = LENGTH, travel: np.ndarray = TRAVEL) -> RecordPoints:
    return RecordPoints(
        np.array([0, direction.size]), np.array([0, travel.size]), direction, length, STROKE[: travel.size], travel
    )


def columns(fixed: int = 4, moving: int = 3) -> tuple[FloatArray, FloatArray]:
    """Basis functions of FE and of FA."""
    both = np.polynomial.legendre.legvander(PLACE / np.abs(PLACE).max(), max(fixed, moving) - 1)
    return both[:, :fixed], both[:, :moving]


def linear(
    fixed: FloatArray, moving: FloatArray, force: FloatArray, given: RecordPoints | None = None, root: FloatArray = ONES
) -> FoundFit:
    """The linear problem alone: one evaluation, at the start."""
    fit = RecordFit(given or points(), fixed, moving, force, LOW, HIGH, coarse=False)
    found = fit.solve(START, root[: force.size], 1e-5, 1)
    np.testing.assert_array_equal(found.variables, START)
    return found


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize(("fixed", "moving"), [(1, 1), (4, 3), (9, 1), (20, 5)])
def test_coefficients(fixed: int, moving: int, order: Literal["C", "F"]) -> None:
    generator = np.random.default_rng(fixed + 10 * moving)
    elastic, amplifier = (np.asarray(each, order=order) for each in columns(fixed, moving))
    force, root = generator.standard_normal(ONES.size), generator.uniform(0.5, 2.0, ONES.size)
    found = linear(elastic, amplifier, force, root=root)
    matrix = np.hstack([elastic, found.omega[:, None] * amplifier])
    expected, *_ = np.linalg.lstsq(matrix * root[:, None], force * root, rcond=None)
    np.testing.assert_allclose(found.coefficients, expected, rtol=1e-9, atol=1e-10)  # condition below 1e4


def test_a_column_that_depends_on_others_gets_no_share() -> None:
    elastic, amplifier = columns()
    force = np.random.default_rng(3).standard_normal(ONES.size)
    twice = np.column_stack([elastic, elastic[:, 1] - 2.0 * elastic[:, 3]])
    found, lean = (linear(fixed, amplifier, force) for fixed in (twice, elastic))
    assert found.coefficients[4] == 0.0
    np.testing.assert_allclose(np.delete(found.coefficients, 4), lean.coefficients, rtol=1e-10)
    # omega that does not vary makes FA a part of FE.
    far = 50.0 + TRAVEL[:PER_STROKE]
    flat = linear(
        elastic[:PER_STROKE], amplifier[:PER_STROKE], force[:PER_STROKE], points(np.ones(1, int), np.array([60.0]), far)
    )
    np.testing.assert_array_equal(flat.omega, 1.0)
    np.testing.assert_array_equal(flat.coefficients[4:], 0.0)


def test_a_force_within_the_columns_is_met() -> None:
    elastic, amplifier = columns()
    omega = linear(elastic, amplifier, ONES).omega
    wanted = np.arange(1.0, 8.0)
    force = np.hstack([elastic, omega[:, None] * amplifier]) @ wanted
    np.testing.assert_allclose(linear(elastic, amplifier, force).coefficients, wanted, rtol=1e-12)


@pytest.mark.parametrize("coarse", [False, True])
def test_minimum_against_scipy(coarse: bool) -> None:
    elastic, amplifier = columns()
    generator = np.random.default_rng(11)
    true = np.array([np.log(4.0), np.log(2.0), np.log(1.5), -0.2])
    root = generator.uniform(0.5, 2.0, ONES.size)

    def omega(x: FloatArray) -> FloatArray:
        return omega_with_derivatives(*np.exp(x[:3]), x[3], DIRECTION, LENGTH, STROKE, TRAVEL)[0]

    def left(x: FloatArray) -> FloatArray:
        matrix = np.hstack([elastic, omega(x)[:, None] * amplifier]) * root[:, None]
        return matrix @ np.linalg.lstsq(matrix, force * root, rcond=None)[0] - force * root

    force = elastic @ [1.0, 2.0, 0.3, 0.2] + omega(true) * (amplifier @ [1.0, 0.1, 0.2])
    force += 0.02 * generator.standard_normal(ONES.size)
    found = RecordFit(points(), elastic, amplifier, force, LOW, HIGH, coarse).solve(START, root, 1e-12, 100)
    assert found.converged
    expected = least_squares(left, START, bounds=(LOW, HIGH), xtol=1e-12, ftol=1e-15, gtol=1e-12)
    assert np.sum(left(found.variables) ** 2) == pytest.approx(2.0 * expected.cost, rel=1e-9)
    np.testing.assert_allclose(found.variables, expected.x, rtol=0.0, atol=1e-4)  # its differences are not exact
    np.testing.assert_allclose(found.omega, omega(found.variables), rtol=0.0, atol=1e-7 if coarse else 1e-12)
    own = omega_with_derivatives(
        *np.exp(found.variables[:3]), found.variables[3], DIRECTION, LENGTH, STROKE, TRAVEL, coarse
    )[1]
    natural = np.append(np.exp(found.variables[:3]), 1.0)[[0, 1, 2, 3], None]
    np.testing.assert_allclose(found.derivatives, own * natural, rtol=1e-12, atol=1e-13)


@settings(derandomize=True, deadline=None, max_examples=100)
@given(st.tuples(*(st.floats(0.01, 0.99) for _ in START)), st.integers(0, 2**32 - 1), st.integers(1, 40), st.booleans())
def test_from_any_start_the_fit_ends_within_the_bounds_and_no_worse(
    share: tuple[float, ...], seed: int, evaluations: int, coarse: bool
) -> None:
    elastic, amplifier = columns()
    force = np.random.default_rng(seed).standard_normal(ONES.size)
    fit = RecordFit(points(), elastic, amplifier, force, LOW, HIGH, coarse)
    start = LOW + (HIGH - LOW) * np.array(share)

    def square(found: FoundFit) -> float:
        matrix = np.hstack([elastic, found.omega[:, None] * amplifier])
        return float(np.sum((force - matrix @ found.coefficients) ** 2))

    found = fit.solve(start, ONES, 1e-9, evaluations)
    assert np.all((found.variables > LOW) & (found.variables < HIGH))
    # omega that is nearly level makes coefficients of FA huge, which roundings then count for.
    before = square(fit.solve(start, ONES, 1e-9, 1))
    assert square(found) <= before * (1.0 + 1e-9) or np.abs(found.coefficients).max() > 1e6


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
        np.testing.assert_array_equal(derivatives[3 + k, at], by[3])
        assert np.all(derivatives[4 - k, at] == 0.0)
