"""Bounded least squares on a problem with a known minimum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from strandspring.identification.trust_region import minimise
from strandspring.kernel.arrays import FloatArray


@dataclass(frozen=True)
class Valley:
    """Rosenbrock's function, whose minimum is 0 at (1, 1), beside variables that change nothing."""

    x: FloatArray

    @property
    def cost(self) -> float:
        return 0.5 * float(self._residuals @ self._residuals)

    def triangle(self) -> FloatArray:
        jacobian = np.zeros((2, self.x.size))
        jacobian[:, :2] = [[-20.0 * self.x[0], 10.0], [-1.0, 0.0]]
        rows = np.column_stack([jacobian, self._residuals])
        padding = np.zeros((self.x.size + 1, self.x.size + 1))
        return np.asarray(np.linalg.qr(np.vstack([rows, padding]), mode="r"))

    @property
    def _residuals(self) -> FloatArray:
        return np.array([10.0 * (self.x[1] - self.x[0] ** 2), 1.0 - self.x[0]])


@pytest.mark.parametrize("idle", [0, 1, 3])
def test_variables_without_effect_do_not_slow_the_search(idle: int) -> None:
    start = np.append([-1.2, 1.0], np.full(idle, 0.3))
    bound = np.full(start.size, 3.0)
    x, point, converged = minimise(Valley, start, -bound, bound, 100, 1e-10, 60)
    assert converged
    assert point.cost < 1e-20
    np.testing.assert_allclose(x[:2], 1.0, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(x[2:], start[2:])


def test_a_minimum_on_a_bound_is_found() -> None:
    x, _, converged = minimise(Valley, np.array([-1.2, 1.0]), np.full(2, -3.0), np.array([0.5, 3.0]), 100, 1e-10, 60)
    assert converged
    np.testing.assert_allclose(x, [0.5, 0.25], rtol=0.0, atol=1e-4)
