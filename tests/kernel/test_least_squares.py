"""The kernel's bounded least squares on a problem with a known minimum, whose residuals Python gives it."""

from __future__ import annotations

import ctypes
from ctypes import CFUNCTYPE, POINTER, c_double, c_size_t, c_void_p

import numpy as np
import pytest

from strandspring.kernel.arrays import FloatArray, address
from strandspring.kernel.library import library

_Cost = CFUNCTYPE(c_double, c_void_p, POINTER(c_double))
_Keep = CFUNCTYPE(None, c_void_p)
_Triangle = CFUNCTYPE(None, c_void_p, POINTER(c_double))
EVALUATIONS = 60


class _LeastSquares(ctypes.Structure):
    """LeastSquares of least_squares.h."""

    _fields_ = [
        ("variables", c_size_t),
        ("residuals", c_size_t),
        ("low", c_void_p),
        ("high", c_void_p),
        ("tolerance", c_double),
        ("evaluations", c_size_t),
        ("problem", c_void_p),
        ("cost", _Cost),
        ("keep", _Keep),
        ("triangle", _Triangle),
    ]


def residuals(x: FloatArray) -> FloatArray:
    """Rosenbrock's function, whose minimum is 0 at (1, 1), beside variables that change nothing."""
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def minimise(start: FloatArray, low: FloatArray, high: FloatArray) -> tuple[FloatArray, list[FloatArray], bool]:
    """Minimum, the points kept on the way to it, and whether it is said to be one."""
    size, trials, kept = start.size, [start], []

    def cost(_: int, x: ctypes._Pointer[c_double]) -> float:
        trials.append(np.ctypeslib.as_array(x, (size,)).copy())
        return 0.5 * float(residuals(trials[-1]) @ residuals(trials[-1]))

    def keep(_: int) -> None:
        kept.append(trials[-1])

    def triangle(_: int, out: ctypes._Pointer[c_double]) -> None:
        x = kept[-1]
        jacobian = np.zeros((2, size))
        jacobian[:, :2] = [[-20.0 * x[0], 10.0], [-1.0, 0.0]]
        padding = np.zeros((size + 1, size + 1))
        R = np.linalg.qr(np.vstack([np.column_stack([jacobian, residuals(x)]), padding]), mode="r")
        np.ctypeslib.as_array(out, R.shape)[:] = R.T

    kernel = library()
    workspace = kernel.least_squares_workspace
    workspace.restype, workspace.argtypes = c_size_t, (c_size_t,)
    memory, x = np.empty(workspace(size)), start.copy()
    given = _LeastSquares(
        size, 100, address(low), address(high), 1e-10, EVALUATIONS, None, _Cost(cost), _Keep(keep), _Triangle(triangle)
    )
    solve = kernel.least_squares
    solve.argtypes = (c_void_p, c_void_p, c_void_p)
    converged = solve(ctypes.addressof(given), address(x), address(memory))
    assert len(trials) <= EVALUATIONS + 1
    assert all(np.all((low < trial) & (trial < high)) for trial in trials)
    np.testing.assert_array_equal(kept[-1], x)
    return x, kept, bool(converged)


@pytest.mark.parametrize("idle", [0, 1, 3])
def test_variables_without_effect_do_not_slow_the_search(idle: int) -> None:
    start = np.append([-1.2, 1.0], np.full(idle, 0.3))
    bound = np.full(start.size, 3.0)
    x, kept, converged = minimise(start, -bound, bound)
    assert converged
    assert np.all(np.diff([residuals(point) @ residuals(point) for point in kept]) < 0.0)
    np.testing.assert_allclose(x[:2], 1.0, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(x[2:], start[2:])


def test_a_minimum_on_a_bound_is_found() -> None:
    x, _, converged = minimise(np.array([-1.2, 1.0]), np.full(2, -3.0), np.array([0.5, 3.0]))
    assert converged
    np.testing.assert_allclose(x, [0.5, 0.25], rtol=0.0, atol=1e-4)
