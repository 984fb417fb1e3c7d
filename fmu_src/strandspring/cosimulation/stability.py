"""Linear theory of a master's stability: the growth of free motion on springs of constant stiffness.

One step of a master is then a linear map of what the coupled system remembers, and the largest magnitude of its
eigenvalues is the factor by which free motion grows in a step.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..kernel.arrays import FloatArray
from .coupling import Master, Point
from .plants import Attachment, Plant
from .unit import Response

_MARGIN = 1e-11  # growth below this is rounding
_GRID = 200
_HALVINGS = 30


class _LinearSpring:
    """A spring of constant stiffness in place of an FMU."""

    displacement_min = displacement_max = 0.0

    def __init__(self, stiffness: float) -> None:
        self._stiffness = stiffness

    def tried(self, displacement: float) -> Response:
        return Response(self._stiffness * displacement, 0.5 * self._stiffness * displacement**2, self._stiffness)

    def restored(self) -> AbstractContextManager[None]:
        return nullcontext()

    def stepped(self, _time: float, _step: float, displacement: float) -> Response:
        return self.tried(displacement)

    def stepped_along(self, _time: float, step: float, displacement: float, first: float, second: float) -> Response:
        return self.tried(displacement + step * (first + 0.5 * step * second))

    def directional_derivative(self) -> float:
        return self._stiffness


def growth(master: Master, plant: Plant, stiffness: ArrayLike, step: float) -> float:
    """Factor by which free motion grows in one step; at most 1 where the master is stable.

    Parameters
    ----------
    master : Master
    plant : Plant                         Its load and the motion of its bases are left out.
    stiffness : array_like, shape (J,)    Of the springs [N/m], > 0; of a hysteretic spring the largest tangent
                                          decides, which is that after a reversal.
    step : float                          [s].
    """
    tangents = np.atleast_1d(np.asarray(stiffness, dtype=np.float64))
    free = replace(
        plant, load=None, attachments=[Attachment(one.direction, count=one.count) for one in plant.attachments]
    )
    advance = master.stepper(free, step)
    springs = [_LinearSpring(tangent) for tangent in tangents.tolist()]
    columns = []
    for unit in np.eye(2 * free.coordinates + 6 * tangents.size):
        after = advance(0.0, _point(unit, free.coordinates, tangents), springs).point
        columns.append(np.concatenate([after.q, after.speed, after.displacements.ravel(), after.forces.ravel()]))
    return float(np.max(np.abs(np.linalg.eigvals(np.array(columns).T))))


def largest_stable_step(master: Master, plant: Plant, stiffness: ArrayLike) -> float:
    """The step up to which free motion does not grow [s]; 0 if it grows at any, infinity if at none.

    Looked for up to ten times the reciprocal of the highest natural frequency, sqrt(stiffness/mass).
    """
    tangents = np.atleast_1d(np.asarray(stiffness, dtype=np.float64))
    total = plant.K + plant.G * (plant.counts * tangents) @ plant.G.T
    coupled = _natural_frequencies(plant.M, total)
    end = 10.0 / float(coupled[-1])
    grid = np.union1d(
        np.linspace(0.0, end, _GRID + 1)[1:], _half_periods(_natural_frequencies(plant.M, plant.K), coupled, end)
    )

    def stable(step: float) -> bool:
        return growth(master, plant, tangents, step) <= 1.0 + _MARGIN

    first = next((k for k, step in enumerate(grid.tolist()) if not stable(step)), None)
    if first is None:
        return float("inf")
    low, high = (0.0 if first == 0 else float(grid[first - 1])), float(grid[first])
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    # At small steps slow growth cannot be told from none, but damping can.
    only_by_rounding = first == 0 and growth(master, plant, tangents, 0.5 * low) > 1.0 - _MARGIN
    return 0.0 if only_by_rounding else low


def _natural_frequencies(mass: FloatArray, stiffness: FloatArray) -> FloatArray:
    """In ascending order [rad/s]."""
    return np.sort(np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(mass, stiffness)))))


def _half_periods(alone: FloatArray, coupled: FloatArray, end: float) -> FloatArray:
    """Steps up to `end` in the middle between whole numbers of half periods of the plant alone and coupled [s].

    Forces that come once in a step, as impulses, feed a motion that the plant itself turns over between them: in
    windows that the springs' share of the stiffness makes as narrow as it is small.
    """
    modes = [(a, b) for a, b in zip(alone.tolist(), coupled.tolist(), strict=True) if a > 0.0]
    steps = [
        0.5 * np.pi * count * (1.0 / a + 1.0 / b)
        for a, b in modes
        for count in range(1, 1 + int(end * max(a, b) / np.pi))
    ]
    return np.array([step for step in steps if step <= end])


def _point(memory: FloatArray, coordinates: int, tangents: FloatArray) -> Point:
    """The point with these contents: q, q', displacements, forces."""
    q, speed, rest = np.split(memory, [coordinates, 2 * coordinates])
    displacements, forces = rest.reshape(2, 3, tangents.size)
    reached = forces[0] / tangents
    return Point(q, speed, displacements, reached, forces, 0.5 * tangents * reached**2, 2)
