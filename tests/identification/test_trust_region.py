"""Bounded least squares on a problem with a known minimum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from strandspring.identification.least_squares.trust_region import Reduced, _joint_step, _step, minimise
from strandspring.kernel.arrays import FloatArray

EVALUATIONS = 60


@dataclass
class Rosenbrock:
    """Rosenbrock's function, whose minimum is 0 at (1, 1), beside variables that change nothing."""

    x: FloatArray

    @property
    def residuals(self) -> FloatArray:
        return np.array([10.0 * (self.x[1] - self.x[0] ** 2), 1.0 - self.x[0]])

    @property
    def squares(self) -> float:
        return float(self.residuals @ self.residuals)

    def reduced(self) -> Reduced:
        jacobian = np.zeros((2, self.x.size))
        jacobian[:, :2] = [[-20.0 * self.x[0], 10.0], [-1.0, 0.0]]
        return Reduced(jacobian, self.residuals, np.zeros(0), np.zeros((0, 2)))


def minimum(start: FloatArray, low: FloatArray, high: FloatArray, evaluations: int = EVALUATIONS) -> tuple:
    """Point, number of evaluations and whether it is said to be a minimum, all trials being within the bounds."""
    trials: list[FloatArray] = []

    def evaluate(x: FloatArray) -> Rosenbrock:
        trials.append(x)
        return Rosenbrock(x)

    x, best, converged = minimise(evaluate, start, low, high, 1e-10, evaluations)
    assert all(np.all((low <= trial) & (trial <= high)) for trial in trials)
    assert best.squares == min(Rosenbrock(trial).squares for trial in trials)
    np.testing.assert_array_equal(best.x, x)
    return x, len(trials), converged


@pytest.mark.parametrize("idle", [0, 1, 3])
def test_variables_without_effect_do_not_slow_the_search(idle: int) -> None:
    start = np.append([-1.2, 1.0], np.full(idle, 0.3))
    bound = np.full(start.size, 3.0)
    x, count, converged = minimum(start, -bound, bound)
    assert converged
    assert count < EVALUATIONS // 2
    np.testing.assert_allclose(x[:2], 1.0, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(x[2:], start[2:])


def test_a_minimum_on_a_bound_is_found() -> None:
    x, _, converged = minimum(np.array([-1.2, 1.0]), np.full(2, -3.0), np.array([0.5, 3.0]))
    assert converged
    np.testing.assert_allclose(x, [0.5, 0.25], rtol=0.0, atol=1e-9)


def test_a_variable_without_room_stays_and_the_other_follows() -> None:
    x, _, converged = minimum(np.array([-1.2, 1.0]), np.array([-1.2, -3.0]), np.array([-1.2, 3.0]))
    assert converged
    np.testing.assert_allclose(x, [-1.2, 1.44], rtol=1e-9)


def test_bounds_that_cross_by_rounding_leave_a_variable_no_room() -> None:
    low, high = np.array([-1.2, -3.0]), np.array([np.nextafter(-1.2, -2.0), 3.0])
    x, best, converged = minimise(Rosenbrock, np.array([-1.2, 1.0]), low, high, 1e-10, EVALUATIONS)
    assert converged
    assert x[0] == low[0]
    assert x[1] == pytest.approx(1.44, rel=1e-9)  # the minimum over the other, as without rounding
    assert best.squares == pytest.approx(2.2**2, rel=1e-9)


def test_derivatives_whose_squares_vanish_take_no_part() -> None:
    wide = np.full(2, np.inf)
    step, is_full = _step(np.diag([0.0, 1e-200]), np.ones(2), 1.0, -wide, wide)
    assert is_full
    np.testing.assert_array_equal(step, 0.0)


def test_used_up_evaluations_are_no_minimum() -> None:
    _, count, converged = minimum(np.array([-1.2, 1.0]), np.full(2, -3.0), np.full(2, 3.0), evaluations=3)
    assert count == 3
    assert not converged


def test_a_step_between_bounds_promises_a_lower_sum() -> None:
    generator = np.random.default_rng(5)
    for _ in range(300):
        J, r = generator.standard_normal((5, 4)) * 10.0 ** generator.uniform(-2.0, 1.0, 4), generator.standard_normal(5)
        low, high = -generator.uniform(0.0, 1.0, 4), generator.uniform(0.0, 1.0, 4)
        low[generator.uniform(size=4) < 0.3] = 0.0
        radius = 10.0 ** generator.uniform(-1.0, 2.0)
        step, _ = _step(J, r, radius, low, high)
        assert np.all((low <= step) & (step <= high))
        assert np.linalg.norm(step) <= 1.02 * radius
        downhill = -J.T @ r
        if np.any((downhill > 0.0) & (high > 0.0) | (downhill < 0.0) & (low < 0.0)):
            assert np.sum((r + J @ step) ** 2) < np.sum(r**2)


def test_own_variables_go_with_the_others_as_in_one_dense_problem() -> None:
    """Residuals of five parts with an own variable each, three linear coefficients and two variables of all parts."""
    generator = np.random.default_rng(8)
    part = np.repeat(np.arange(5), 8)
    linear, shared, own, r = (generator.standard_normal((part.size, n)) for n in (3, 2, 1, 1))
    own *= 10.0 ** generator.uniform(-2.0, 1.0, 5)[part][:, None]
    frame = np.linalg.qr(linear)[0]
    shared, r = (columns - frame @ (frame.T @ columns) for columns in (shared, r))
    rows, triangle = np.linalg.qr(np.hstack([shared, r]))
    unit = own[:, 0] / np.sqrt(np.bincount(part, own[:, 0] ** 2))[part]
    along = np.array([unit * (part == k) for k in range(5)]) @ np.hstack([frame, rows])
    length = np.sqrt(np.bincount(part, own[:, 0] ** 2))
    at = Reduced(triangle[:, :2], triangle[:, 2], length, along)
    scale = np.linalg.norm(at.J, axis=0)

    def dense(columns: FloatArray, target: FloatArray) -> FloatArray:
        return np.linalg.lstsq(columns, -target, rcond=None)[0]

    columns = np.hstack([shared, own * (part[:, None] == np.arange(5)), linear])
    wanted = dense(columns, r[:, 0])
    wide = np.full(7, 1e6)
    step, is_full, promised = _joint_step(at, scale, 1e9, -wide, wide)
    assert is_full
    np.testing.assert_allclose(step, wanted[:7], rtol=1e-9)
    assert promised == pytest.approx(float(r[:, 0] @ r[:, 0] - np.sum((r[:, 0] + columns @ wanted) ** 2)), rel=1e-9)
    # With a bound in its way one stays there, and all others do what is best beside it.
    first = 2 + int(np.argmax(np.abs(wanted[2:7])))
    low, high = -wide, wide.copy()
    low[first], high[first] = sorted((0.0, 0.5 * wanted[first]))
    step, _, promised = _joint_step(at, scale, 1e9, low, high)
    assert step[first] == pytest.approx(0.5 * wanted[first], rel=1e-12)
    others = np.delete(np.arange(columns.shape[1]), first)
    target = r[:, 0] + columns[:, first] * step[first]
    rest = dense(columns[:, others], target)
    np.testing.assert_allclose(np.delete(step, first), rest[:6], rtol=1e-9)
    left = target + columns[:, others] @ rest
    assert promised == pytest.approx(float(r[:, 0] @ r[:, 0] - left @ left), rel=1e-9)
