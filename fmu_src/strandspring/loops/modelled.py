"""The model's steady loop between two turning points, exact.

omega on a stroke is d*W(xi0 + rho*s) whatever its direction d, so the steady loop has omega = -w at its low and +w
at its high turning point. With xi the end of a stroke of length L, W(xi) = w and W(xi - rho*L) = -w: one increasing
equation W(xi) + W(xi - rho*L) = 0 for xi, and no cycles to run until they repeat.
"""

from __future__ import annotations

import numpy as np

from ..kernel.path import PathSolver
from ..kernel.steady import steady_omega
from .loop import Branch, Loop, LoopFigures

_POINTS = 513  # on each branch; they serve the peak forces and the comparison of branches only


def model_curve(solver: PathSolver, low: float, high: float) -> Loop:
    """The model's steady loop with its branches; see `model_loop`."""
    if not (np.isfinite([low, high]).all() and low < high):
        raise ValueError(f"`low` must be below `high`, both finite [m], got {low!r} and {high!r}.")
    omega = -steady_omega(solver.parameters, high - low)
    rising = np.linspace(low, high, _POINTS)
    force = solver.force(np.concatenate([rising, rising[-2::-1]]), omega)
    loading, unloading = force[:_POINTS], force[: _POINTS - 2 : -1]
    _, forth, both = solver.absorbed_energy(np.array([low, high, low]), omega).tolist()
    figures = LoopFigures(
        low=low,
        high=high,
        force_low=float(loading[0]),
        force_high=float(loading[-1]),
        mean_force=(2.0 * forth - both) / (2.0 * (high - low)),
        least_force=float(force.min()),
        greatest_force=float(force.max()),
        energy_per_cycle=both,
    )
    return Loop(figures, Branch(rising, loading), Branch(rising, unloading), noise=0.0)


def model_loop(solver: PathSolver, low: float, high: float) -> LoopFigures:
    """Figures of the model's steady loop between two turning points, without sampling but for the peak forces.

    Parameters
    ----------
    solver : PathSolver
    low, high : float    Turning points [m]; outside the identified range the model is continued linearly.

    Returns
    -------
    LoopFigures

    Raises
    ------
    ValueError           Unless both are finite and low < high.
    """
    return model_curve(solver, low, high).figures
