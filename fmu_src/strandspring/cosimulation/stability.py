"""Linear stability of a master: growth of free motion on springs of constant stiffness.

One step of a master is then a linear map of the coupled state, and the largest magnitude of its eigenvalues is the
factor by which free motion grows in a step.
"""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ..kernel.arrays import FloatArray
from .coupling import CoupledState, Master
from .fmu_spring import Response
from .plants import Attachment, Plant

_MARGIN = 1e-11  # growth below this is rounding
_GRID = 200  # steps at which stability is tested before the bisection
_BISECTIONS = 30


class _LinearSpring:
    """A spring of constant stiffness in place of an FMU."""

    displacement_min = displacement_max = 0.0

    def __init__(self, stiffness: float) -> None:
        self._stiffness = stiffness

    def trial(self, displacement: float) -> Response:
        return Response(self._stiffness * displacement, 0.5 * self._stiffness * displacement**2, self._stiffness)

    def rollback(self) -> AbstractContextManager[None]:
        return nullcontext()

    def commit(self, _time: float, _step: float, displacement: float) -> Response:
        return self.trial(displacement)

    def commit_curve(
        self, _time: float, step: float, displacement: float, velocity: float, acceleration: float
    ) -> Response:
        return self.trial(displacement + step * (velocity + 0.5 * step * acceleration))

    def directional_derivative(self) -> float:
        return self._stiffness


def growth_factor(master: Master, plant: Plant, stiffness: ArrayLike, step: float) -> float:
    """Factor by which free motion grows in one step; at most 1 where the master is stable.

    Parameters
    ----------
    master : Master
    plant : Plant                         Its load and the motion of its bases are ignored.
    stiffness : array_like, shape (J,)    Of the springs [N/m], > 0; for a hysteretic spring use the largest
                                          tangent, which occurs after a reversal.
    step : float                          [s].
    """
    tangents = np.atleast_1d(np.asarray(stiffness, dtype=np.float64))
    free = replace(
        plant, load=None, attachments=[Attachment(spring.direction, count=spring.count) for spring in plant.attachments]
    )
    advance = master.stepper(free, step)
    springs = [_LinearSpring(tangent) for tangent in tangents.tolist()]
    columns = []
    for unit_vector in np.eye(2 * free.coordinates + 6 * tangents.size):
        end = advance(0.0, _state(unit_vector, free.coordinates, tangents), springs).state
        columns.append(np.concatenate([end.q, end.velocity, end.displacements.ravel(), end.forces.ravel()]))
    return float(np.max(np.abs(np.linalg.eigvals(np.array(columns).T))))


def largest_stable_step(master: Master, plant: Plant, stiffness: ArrayLike) -> float:
    """The step up to which free motion does not grow [s]; 0 if it grows at any step, infinity if at none.

    The search ends at ten times the reciprocal of the highest natural frequency, sqrt(stiffness/mass).
    """
    tangents = np.atleast_1d(np.asarray(stiffness, dtype=np.float64))
    total = plant.K + plant.G * (plant.counts * tangents) @ plant.G.T
    coupled = _natural_frequencies(plant.M, total)
    end = 10.0 / float(coupled[-1])
    grid = np.union1d(
        np.linspace(0.0, end, _GRID + 1)[1:], _half_periods(_natural_frequencies(plant.M, plant.K), coupled, end)
    )

    def stable(step: float) -> bool:
        return growth_factor(master, plant, tangents, step) <= 1.0 + _MARGIN

    first = next((k for k, step in enumerate(grid.tolist()) if not stable(step)), None)
    if first is None:
        return float("inf")
    low, high = (0.0 if first == 0 else float(grid[first - 1])), float(grid[first])
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if stable(middle) else (low, middle)
    # At small steps rounding hides slow growth, but not damping.
    stable_by_rounding = first == 0 and growth_factor(master, plant, tangents, 0.5 * low) > 1.0 - _MARGIN
    return 0.0 if stable_by_rounding else low


def _natural_frequencies(mass: FloatArray, stiffness: FloatArray) -> FloatArray:
    """In ascending order [rad/s]."""
    return np.sort(np.sqrt(np.abs(np.linalg.eigvals(np.linalg.solve(mass, stiffness)))))


def _half_periods(alone: FloatArray, coupled: FloatArray, end: float) -> FloatArray:
    """Steps up to `end` midway between multiples of the half periods of the plant alone and coupled [s].

    Forces applied as impulses once a step excite a motion that the plant itself reverses in between. The windows of
    instability are narrow where the springs' share of the stiffness is small.
    """
    modes = [(a, b) for a, b in zip(alone.tolist(), coupled.tolist(), strict=True) if a > 0.0]
    steps = [
        0.5 * np.pi * count * (1.0 / a + 1.0 / b)
        for a, b in modes
        for count in range(1, 1 + int(end * max(a, b) / np.pi))
    ]
    return np.array([step for step in steps if step <= end])


def _state(values: FloatArray, coordinates: int, tangents: FloatArray) -> CoupledState:
    """The state with these values of q, q', displacements and forces."""
    q, velocity, spring_values = np.split(values, [coordinates, 2 * coordinates])
    displacements, forces = spring_values.reshape(2, 3, tangents.size)
    committed = forces[0] / tangents
    return CoupledState(q, velocity, displacements, committed, forces, 0.5 * tangents * committed**2, 2)
