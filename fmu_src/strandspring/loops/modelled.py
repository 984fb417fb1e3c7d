"""The model's steady loop between two turning points; `kernel.steady` gives omega at them."""

from __future__ import annotations

import numpy as np

from ..core.parameters import SpringParameters
from ..kernel.path import PathSolver
from ..kernel.steady import steady_start
from .loop import Loop, LoopBranch, LoopFigures

# Of the figures of loops, where there are branches.
_RELAXED = (
    "Loops of the model are slow: its Maxwell branches have relaxed. At the recorded rates stiffness and energy are "
    "larger."
)
_POINTS = 513  # on each branch, for the peak forces and for comparing branches


def steady_loop(solver: PathSolver, low: float, high: float) -> Loop:
    """The steady loop with its two branches; arguments as for `steady_loop_figures`.

    Where the spring has Maxwell branches the loop is slow: they have relaxed.
    """
    if not (np.isfinite([low, high]).all() and low < high):
        raise ValueError(f"`low` must be below `high`, both finite [m], got {low!r} and {high!r}.")
    solver, omega = solver.slow, steady_start(solver.parameters, high - low)
    rising = np.linspace(low, high, _POINTS)
    force = solver.force(np.concatenate([rising, rising[-2::-1]]), omega)
    loading, unloading = force[:_POINTS], force[: _POINTS - 2 : -1]
    _, loading_energy, cycle_energy = solver.absorbed_energy(np.array([low, high, low]), omega).tolist()
    figures = LoopFigures(
        low=low,
        high=high,
        force_low=float(loading[0]),
        force_high=float(loading[-1]),
        mean_force=(2.0 * loading_energy - cycle_energy) / (2.0 * (high - low)),
        min_force=float(force.min()),
        max_force=float(force.max()),
        energy_per_cycle=cycle_energy,
    )
    return Loop(figures, LoopBranch(rising, loading), LoopBranch(rising, unloading), noise=0.0)


def relaxed_branches(spring: SpringParameters) -> tuple[str, ...]:
    """What has to be said of the figures of a spring's loops: a caution if it has Maxwell branches, else nothing."""
    return (_RELAXED,) if spring.branches else ()


def steady_loop_figures(solver: PathSolver, low: float, high: float) -> LoopFigures:
    """Figures of the steady loop between two turning points, exact except for the peak forces, which are sampled.

    Parameters
    ----------
    solver : PathSolver
    low, high : float    Turning points [m]; outside the identified range the model is extrapolated linearly.

    Returns
    -------
    LoopFigures

    Raises
    ------
    ValueError           Unless both are finite and low < high.
    """
    return steady_loop(solver, low, high).figures
