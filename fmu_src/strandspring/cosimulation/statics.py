"""Static equilibrium of a plant on spring FMUs, found on the FMUs themselves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..kernel.arrays import FloatArray
from .plants import Plant
from .simulation import start
from .unit import CosimulationError, SpringUnit

_NEWTON_STEPS = 50
_TOLERANCE = 1e-12  # of the displacements [m]


def loaded_slowly(plant: Plant, springs: Sequence[SpringUnit], time: float = 0.0, increments: int = 20) -> FloatArray:
    """Bring the plant to rest under its load, which grows from what the springs carry at q = 0, and commit the path.

    The rest position of a hysteretic mount depends on how it got there; this is the one of slow loading. The springs
    start where q = 0 puts them unless they are started, and end where the plant rests.

    Parameters
    ----------
    plant : Plant
    springs : sequence of SpringUnit   One for each attachment.
    time : float                       At which the load and the bases are taken [s].
    increments : int                   Of the load. One is exact for one coordinate; with more, the springs' paths are
                                       followed as the coordinates share the load.

    Returns
    -------
    ndarray, shape (N,)                q at rest.

    Raises
    ------
    CosimulationError                  If no equilibrium is found.
    """
    point = start(plant, springs, time)
    q = point.q
    # What acts on the plant before the load grows, and must have gone when it has.
    missing = _unbalance(plant, time, q, point.forces[0])
    for k in range(increments):
        q = _rest(plant, springs, time, q, (1.0 - (k + 1) / increments) * missing)
        for spring, displacement in zip(springs, plant.displacements(time, q).tolist(), strict=True):
            spring.stepped(time, 0.0, displacement)
    return q


def _unbalance(plant: Plant, time: float, q: FloatArray, forces: FloatArray) -> FloatArray:
    return plant.load_at(time) + plant.pull(forces) - plant.K @ q


def _rest(plant: Plant, springs: Sequence[SpringUnit], time: float, q: FloatArray, supported: FloatArray) -> FloatArray:
    """q at which springs and load leave `supported`, by Newton's method from q."""
    for _ in range(_NEWTON_STEPS):
        displacements = plant.displacements(time, q).tolist()
        responses = [spring.tried(d) for spring, d in zip(springs, displacements, strict=True)]
        unbalance = _unbalance(plant, time, q, np.array([r.force for r in responses])) - supported
        tangents = plant.counts * np.array([r.stiffness for r in responses])
        try:
            move = np.linalg.solve(plant.K + plant.G * tangents @ plant.G.T, unbalance)
        except np.linalg.LinAlgError:
            break
        q = q + move
        if np.max(np.abs(plant.G.T @ move), initial=0.0) <= _TOLERANCE:
            return q
    raise CosimulationError(
        f"The plant finds no rest under its load at {time:.6g} s; use another load, or springs that are stiff enough."
    )
