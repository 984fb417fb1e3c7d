"""Maxwell branches along whole paths, in the compiled kernel: exact where x moves at constant velocity between samples.

`core/c/spring/branches.h` gives the equations; each branch begins without force at the first sample. What does not
compute branches or a second mechanism refuses them by `require_plain`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.branch_variables import OF_BRANCH
from ..core.branches import MaxwellBranch
from ..core.parameters import SpringParameters
from ..errors import StrandspringError
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


def added_fields(parameters: SpringParameters) -> dict[str, Any]:
    """The fields of SpringAdded of branches.h."""
    second, branches = parameters.second, parameters.branches
    of_second = {} if second is None else {**asdict(second), "mechanisms": 1, "amplifier": len(second.kA)}
    return {
        **of_second,
        "branches": len(branches),
        **{name: tuple(getattr(branch, name) for branch in branches) for name in OF_BRANCH},
    }


def require_plain(parameters: SpringParameters, where: str) -> None:
    """Raise StrandspringError unless this is the paper's spring.

    Parameters
    ----------
    parameters : SpringParameters
    where : str      What cannot take others, as the subject of the sentence.
    """
    if parameters.is_plain:
        return
    has = ["`second`, a second mechanism"] if parameters.second else []
    has += ["`branches`, Maxwell branches"] if parameters.branches else []
    raise StrandspringError(
        "{where} cannot take a spring with {has}; compute its force by `Spring.response`, or identify a spring without "
        "them ({to[mechanisms=1]} and {to[branches=0]}).",
        where=where,
        has=" and ".join(has),
    )
