"""Static equilibrium of a plant on spring FMUs, computed with the FMUs themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..kernel.arrays import FloatArray
from .coupled_motion import initial_state
from .fmu_spring import CosimulationError, FmuSpring
from .masters import commit
from .plants import Plant

_INCREMENTS = 20  # of the load
_MAX_ITERATIONS = 50
_TOLERANCE = 1e-12  # of the displacements [m]


def apply_static_load(plant: Plant, springs: Sequence[FmuSpring]) -> FloatArray:
    """Load the plant slowly until it is in static equilibrium, and commit the springs' paths.

    The equilibrium of a hysteretic mount depends on the path that leads to it. Here the load grows from the force of
    the springs at q = 0 to that of time 0 in 20 increments: with several coordinates, the springs' paths depend on how
    they share the load. Springs that have not been started are started at q = 0; all end at the equilibrium.

    Parameters
    ----------
    plant : Plant
    springs : sequence of FmuSpring   One for each attachment.

    Returns
    -------
    ndarray, shape (N,)               q in static equilibrium.

    Raises
    ------
    CosimulationError                 If no equilibrium is found.
    """
    state = initial_state(plant, springs)
    q = state.q
    # Force on the plant before the load grows; it decreases to zero.
    unbalance = _unbalance(plant, q, state.forces)
    for k in range(_INCREMENTS):
        q = _equilibrium(plant, springs, q, (1.0 - (k + 1) / _INCREMENTS) * unbalance)
        commit(springs, 0.0, 0.0, plant.displacements(0.0, q))
    return q


def _unbalance(plant: Plant, q: FloatArray, forces: FloatArray) -> FloatArray:
    """Sum of the generalized forces on the plant, shape (N,)."""
    return plant.load_at(0.0) + plant.generalized_force(forces) - plant.K @ q


def _equilibrium(plant: Plant, springs: Sequence[FmuSpring], q: FloatArray, target: FloatArray) -> FloatArray:
    """q at which the unbalance equals `target`, by Newton's method from q."""
    for _ in range(_MAX_ITERATIONS):
        displacements = plant.displacements(0.0, q).tolist()
        responses = [spring.trial(d) for spring, d in zip(springs, displacements, strict=True)]
        residual = _unbalance(plant, q, np.array([r.force for r in responses])) - target
        tangents = plant.counts * np.array([r.stiffness for r in responses])
        try:
            increment = np.linalg.solve(plant.K + plant.G * tangents @ plant.G.T, residual)
        except np.linalg.LinAlgError:
            break
        q = q + increment
        if np.max(np.abs(plant.G.T @ increment), initial=0.0) <= _TOLERANCE:
            return q
    raise CosimulationError(
        "The plant has no static equilibrium under its load; reduce the load or use stiffer springs."
    )
