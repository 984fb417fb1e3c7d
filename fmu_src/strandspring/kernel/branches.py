"""Maxwell branches along whole paths, in the compiled kernel: exact where x moves at constant velocity between samples.

`core/c/spring/branches.h` gives the equations; each branch begins without force at the first sample.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..core.branches import MaxwellBranch
from .arrays import FloatArray, address, floats
from .library import library


def as_times(time: ArrayLike, samples: int) -> FloatArray:
    """Check the times of a path of so many samples, shape (K,) [s]: finite, none before the one that it follows."""
    times = floats(time)
    if times.shape != (samples,):
        raise ValueError(f"`time` must have shape ({samples},) as the displacement has, got shape {times.shape}.")
    if not np.isfinite(times).all():
        bad = int(np.argmin(np.isfinite(times)))
        raise ValueError(f"`time` must be finite [s], got {times[bad]} at index {bad}.")
    steps = np.diff(times)
    if steps.size and not steps.min() >= 0.0:
        bad = int(np.argmin(steps >= 0.0)) + 1
        raise ValueError(f"`time` must not fall [s], got {times[bad]} after {times[bad - 1]} at index {bad}.")
    return times


def maxwell_sums(branches: Sequence[MaxwellBranch], path: FloatArray, time: FloatArray) -> FloatArray:
    """Sums over the branches at each sample, shape (3, K).

    Parameters
    ----------
    branches : sequence of MaxwellBranch
    path, time : ndarray, shape (K,)   [m], and as `as_times` gives it [s].

    Returns
    -------
    ndarray, shape (3, K)              Force [N], its integral over the displacement since the first sample [J], and the
                                       energy stored in the branches' springs [J], which is part of the integral.
    """
    path, time, sums = floats(path), floats(time), np.zeros((3, path.size))
    for branch in branches:
        library().spring_maxwell_path(
            branch.stiffness, branch.time_constant, path.size, address(path), address(time), *map(address, sums)
        )
    return sums


def maxwell_columns(
    time_constants: Sequence[float] | FloatArray, path: FloatArray, time: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Forces of branches of stiffness 1 N/m, and their derivatives by the logarithm of the time constant.

    The force of a branch is its stiffness times its column, and that the force's derivative by ln(tau) times the other.

    Parameters
    ----------
    time_constants : sequence of float, length B   [s].
    path, time : ndarray, shape (K,)               [m], and as `as_times` gives it [s].

    Returns
    -------
    ndarray, shape (B, K)                          Force at each sample [m].
    ndarray, shape (B, K)                          Its derivative by ln(tau) [m].
    """
    path, time, constants = floats(path), floats(time), floats(time_constants)
    columns = np.empty((2, constants.size, path.size))
    library().spring_maxwell_columns(
        constants.size, address(constants), path.size, address(path), address(time), *map(address, columns)
    )
    return columns[0], columns[1]
