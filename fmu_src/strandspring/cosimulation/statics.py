"""Static equilibrium of a plant on spring FMUs, computed with the FMUs themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..kernel.arrays import FloatArray
from .coupled_motion import initial_state
from .fmu_spring import CosimulationError, FmuSpring
from .plants import Plant

_MAX_ITERATIONS = 50
_TOLERANCE = 1e-12  # of the displacements [m]


def apply_static_load(
    plant: Plant, springs: Sequence[FmuSpring], time: float = 0.0, increments: int = 20
) -> FloatArray:
    """Load the plant slowly until it is in static equilibrium, and commit the springs' paths.

    The equilibrium of a hysteretic mount depends on the path that leads to it. Here the load grows from the force of
    the springs at q = 0 to its full value. Springs that have not been started are started at q = 0; all end at the
    equilibrium.

    Parameters
    ----------
    plant : Plant
    springs : sequence of FmuSpring   One for each attachment.
    time : float                      At which the load and the bases are evaluated [s].
    increments : int                  Of the load. One is exact for one coordinate; with more coordinates, the
                                      springs' paths depend on how they share the load, which the increments follow.

    Returns
    -------
    ndarray, shape (N,)               q in static equilibrium.

    Raises
    ------
    CosimulationError                 If no equilibrium is found.
    """
    state = initial_state(plant, springs, time)
    q = state.q
    # Force on the plant before the load grows; it decreases to zero.
    unbalance = _unbalance(plant, time, q, state.forces)
    for k in range(increments):
        q = _equilibrium(plant, springs, time, q, (1.0 - (k + 1) / increments) * unbalance)
        for spring, displacement in zip(springs, plant.displacements(time, q).tolist(), strict=True):
            spring.commit(time, 0.0, displacement)
    return q


def _unbalance(plant: Plant, time: float, q: FloatArray, forces: FloatArray) -> FloatArray:
    """Sum of the generalized forces on the plant, shape (N,)."""
    return plant.load_at(time) + plant.generalized_force(forces) - plant.K @ q


def _equilibrium(
    plant: Plant, springs: Sequence[FmuSpring], time: float, q: FloatArray, target: FloatArray
) -> FloatArray:
    """q at which the unbalance equals `target`, by Newton's method from q."""
    for _ in range(_MAX_ITERATIONS):
        displacements = plant.displacements(time, q).tolist()
        responses = [spring.trial(d) for spring, d in zip(springs, displacements, strict=True)]
        residual = _unbalance(plant, time, q, np.array([r.force for r in responses])) - target
        tangents = plant.counts * np.array([r.stiffness for r in responses])
        try:
            increment = np.linalg.solve(plant.K + plant.G * tangents @ plant.G.T, residual)
        except np.linalg.LinAlgError:
            break
        q = q + increment
        if np.max(np.abs(plant.G.T @ increment), initial=0.0) <= _TOLERANCE:
            return q
    raise CosimulationError(
        f"The plant has no static equilibrium under its load at {time:.6g} s; reduce the load or use stiffer springs."
    )
