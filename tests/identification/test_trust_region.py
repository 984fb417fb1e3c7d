"""Bounded least squares on a problem with a known minimum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from strandspring.identification.least_squares.trust_region import _step, minimise
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

    def reduced(self) -> tuple[FloatArray, FloatArray]:
        jacobian = np.zeros((2, self.x.size))
        jacobian[:, :2] = [[-20.0 * self.x[0], 10.0], [-1.0, 0.0]]
        return jacobian, self.residuals


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
