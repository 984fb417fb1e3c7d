"""A plant with spring FMUs over time: `simulate` and its result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..kernel.arrays import FloatArray
from .coupling import Master, Point
from .iterative import Iterative
from .plants import Plant
from .unit import CosimulationError, SpringUnit


@dataclass(frozen=True, eq=False)
class Motion:
    """What a simulation found, for K steps, N coordinates and J springs.

    Attributes
    ----------
    times : ndarray, shape (K + 1,)                     [s].
    q, speed, acceleration : ndarray, shape (K + 1, N)  Of the plant.
    displacement, force, absorbed_energy : ndarray, shape (K + 1, J)   Of the springs [m], [N], [J]; of one of those
                                                        that an attachment counts.
    felt : ndarray, shape (K, J)                        Mean spring force over each step as the plant felt it [N].
    iterations : ndarray, shape (K,)                    Trials in each step; 1 for the explicit masters.
    left_range : tuple of bool, length J                Whether a spring left its identified range.
    """

    times: FloatArray
    q: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    displacement: FloatArray
    force: FloatArray
    absorbed_energy: FloatArray
    felt: FloatArray
    iterations: np.ndarray
    left_range: tuple[bool, ...]

    @property
    def stroke(self) -> FloatArray:
        """Largest less smallest displacement of each spring, shape (J,) [m]."""
        return np.asarray(np.ptp(self.displacement, axis=0))


_ITERATIVE = Iterative()


def simulate(
    plant: Plant,
    springs: Sequence[SpringUnit],
    stop: float,
    step: float,
    master: Master = _ITERATIVE,
    *,
    q: ArrayLike | None = None,
    speed: ArrayLike | None = None,
    begin: float = 0.0,
) -> Motion:
    """Simulate a plant with spring FMUs.

    Parameters
    ----------
    plant : Plant
    springs : sequence of SpringUnit   One for each attachment. Those whose path has not begun are started where q puts
                                       them; others go on from where they are.
    stop, step : float                 End and step [s]; `stop - begin` is rounded to whole steps.
    master : Master
    q, speed : array_like, shape (N,)  At the beginning; zero by default.
    begin : float                      [s].

    Raises
    ------
    CosimulationError   If the options do not fit together, an FMU refuses a call, or the motion diverges.
    """
    if len(springs) != len(plant.attachments):
        raise CosimulationError(
            f"The plant has {len(plant.attachments)} attachments, but {len(springs)} springs were given."
        )
    if not (np.isfinite(step) and step > 0.0 and np.isfinite(stop) and stop - begin >= 0.5 * step):
        raise CosimulationError(
            f"`step` must be > 0 [s] and `stop` at least a step after `begin` {begin!r}, got {step!r} and {stop!r}."
        )
    steps = round((stop - begin) / step)
    times: FloatArray = begin + step * np.arange(steps + 1, dtype=np.float64)
    point = start(plant, springs, begin, step, q, speed)
    points, felt, iterations = [point], [], []
    advance = master.stepper(plant, step)
    for time in times[:-1].tolist():
        done = advance(time, point, springs)
        point = done.point
        if not (np.isfinite(point.q).all() and np.isfinite(point.forces[0]).all()):
            raise CosimulationError(f"The motion diverged in the step at {time:.6g} s; take smaller steps.")
        points.append(point)
        felt.append(done.felt)
        iterations.append(done.iterations)
    rows = [
        plant.acceleration(time, one.q, one.speed, one.forces[0])
        for time, one in zip(times.tolist(), points, strict=True)
    ]
    displacement = np.array([one.displacements[0] for one in points])
    low = np.array([spring.displacement_min for spring in springs])
    high = np.array([spring.displacement_max for spring in springs])
    return Motion(
        times,
        np.array([one.q for one in points]),
        np.array([one.speed for one in points]),
        np.array(rows),
        displacement,
        np.array([one.forces[0] for one in points]),
        np.array([one.energies for one in points]),
        np.array(felt),
        np.array(iterations),
        tuple(np.any((displacement < low) | (displacement > high), axis=0).tolist()),
    )


def start(
    plant: Plant,
    springs: Sequence[SpringUnit],
    time: float,
    step: float = 0.0,
    q: ArrayLike | None = None,
    speed: ArrayLike | None = None,
) -> Point:
    """The point where a simulation begins; starts those springs whose path has not begun.

    What was one step before, which masters that extrapolate ask for, is taken to mirror what a step at constant speed
    would lead to: a motion that begins with a speed would cost them an order otherwise.
    """
    zero = np.zeros(plant.coordinates)
    position = zero if q is None else np.atleast_1d(np.asarray(q, dtype=np.float64))
    velocity = zero if speed is None else np.atleast_1d(np.asarray(speed, dtype=np.float64))
    for name, given in (("q", position), ("speed", velocity)):
        if given.shape != zero.shape or not np.isfinite(given).all():
            raise CosimulationError(f"`{name}` must be {zero.size} finite numbers, got {given.tolist()!r}.")
    displacements = plant.displacements(time, position)
    ahead = plant.displacements(time + step, position + step * velocity)
    responses = [
        spring.tried(spring.reached) if spring.started else spring.start(displacement, time)
        for spring, displacement in zip(springs, displacements.tolist(), strict=True)
    ]
    forces = np.array([response.force for response in responses])
    expected = np.array([spring.tried(d).force for spring, d in zip(springs, ahead.tolist(), strict=True)])
    before = 2.0 * displacements - ahead
    return Point(
        position,
        velocity,
        np.array([displacements, before, before]),
        np.array([spring.reached for spring in springs]),
        np.array([forces, 2.0 * forces - expected, 2.0 * forces - expected]),
        np.array([response.absorbed_energy for response in responses]),
        1,
    )
