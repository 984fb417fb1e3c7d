"""Simulation of a plant with spring FMUs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..kernel.arrays import FloatArray
from .coupling import CoupledState, Master
from .fmu_spring import CosimulationError, DivergenceError, FmuSpring
from .iterative import Iterative
from .plants import Plant


@dataclass(frozen=True, eq=False)
class Motion:
    """Result of a simulation, for K steps, N coordinates and J springs.

    Attributes
    ----------
    times : ndarray, shape (K + 1,)                     [s].
    q, velocity, acceleration : ndarray, shape (K + 1, N)   Of the plant.
    displacement, force, absorbed_energy : ndarray, shape (K + 1, J)   Of each spring [m], [N], [J]; where an
                                                        attachment has several equal springs, of one of them.
    applied_force : ndarray, shape (K, J)               Mean spring force over each step as applied to the plant [N].
    iterations : ndarray, shape (K,)                    Trials in each step; 1 for the explicit masters.
    left_range : tuple of bool, length J                Whether a spring left its identified range.
    """

    times: FloatArray
    q: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    displacement: FloatArray
    force: FloatArray
    absorbed_energy: FloatArray
    applied_force: FloatArray
    iterations: np.ndarray
    left_range: tuple[bool, ...]

    @property
    def stroke(self) -> FloatArray:
        """Difference between the largest and the smallest displacement of each spring, shape (J,) [m]."""
        return np.asarray(np.ptp(self.displacement, axis=0))


_ITERATIVE = Iterative()


def simulate(
    plant: Plant,
    springs: Sequence[FmuSpring],
    stop: float,
    step: float,
    master: Master = _ITERATIVE,
    *,
    q: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    start: float = 0.0,
) -> Motion:
    """Simulate a plant with spring FMUs.

    Parameters
    ----------
    plant : Plant
    springs : sequence of FmuSpring   One for each attachment. Springs that have not been started are started at the
                                      displacements of q; others continue their committed paths.
    stop, step : float                End and step [s]; `stop - start` is rounded to whole steps.
    master : Master
    q, velocity : array_like, shape (N,)   Initial values; zero by default.
    start : float                     [s].

    Raises
    ------
    CosimulationError   If an argument is invalid, a call of an FMU fails, or the motion diverges.
    """
    if len(springs) != len(plant.attachments):
        raise CosimulationError(
            f"The plant has {len(plant.attachments)} attachments, but {len(springs)} springs were given."
        )
    if not (np.isfinite(step) and step > 0.0 and np.isfinite(stop) and stop - start >= 0.5 * step):
        raise CosimulationError(
            f"`step` must be > 0 [s] and `stop` at least a step after `start` {start!r}, got {step!r} and {stop!r}."
        )
    steps = round((stop - start) / step)
    times: FloatArray = start + step * np.arange(steps + 1, dtype=np.float64)
    state = initial_state(plant, springs, start, step, q, velocity)
    states, applied_forces, iterations = [state], [], []
    advance = master.stepper(plant, step)
    for time in times[:-1].tolist():
        try:
            result = advance(time, state, springs)
            if not (np.isfinite(result.state.q).all() and np.isfinite(result.state.forces[0]).all()):
                raise DivergenceError
        except DivergenceError:
            raise CosimulationError(f"The motion diverged in the step at {time:.6g} s; take smaller steps.") from None
        state = result.state
        states.append(state)
        applied_forces.append(result.applied_force)
        iterations.append(result.iterations)
    accelerations = [
        plant.acceleration(time, state.q, state.velocity, state.forces[0])
        for time, state in zip(times.tolist(), states, strict=True)
    ]
    displacement = np.array([state.displacements[0] for state in states])
    low = np.array([spring.displacement_min for spring in springs])
    high = np.array([spring.displacement_max for spring in springs])
    return Motion(
        times,
        np.array([state.q for state in states]),
        np.array([state.velocity for state in states]),
        np.array(accelerations),
        displacement,
        np.array([state.forces[0] for state in states]),
        np.array([state.energies for state in states]),
        np.array(applied_forces),
        np.array(iterations),
        tuple(np.any((displacement < low) | (displacement > high), axis=0).tolist()),
    )


def initial_state(
    plant: Plant,
    springs: Sequence[FmuSpring],
    time: float,
    step: float = 0.0,
    q: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
) -> CoupledState:
    """The state in which a simulation begins; starts the springs that have not been started.

    The values one step before, which extrapolating masters need, mirror those after a step at constant velocity. A
    motion with an initial velocity would otherwise reduce their order.
    """
    zero = np.zeros(plant.coordinates)
    position = zero if q is None else np.atleast_1d(np.asarray(q, dtype=np.float64))
    rate = zero if velocity is None else np.atleast_1d(np.asarray(velocity, dtype=np.float64))
    for name, values in (("q", position), ("velocity", rate)):
        if values.shape != zero.shape or not np.isfinite(values).all():
            raise CosimulationError(f"`{name}` must be {zero.size} finite numbers, got {values.tolist()!r}.")
    displacements = plant.displacements(time, position)
    after = plant.displacements(time + step, position + step * rate)
    responses = [
        spring.trial(spring.committed_displacement) if spring.started else spring.start(displacement, time)
        for spring, displacement in zip(springs, displacements.tolist(), strict=True)
    ]
    forces = np.array([response.force for response in responses])
    forces_after = np.array([spring.trial(d).force for spring, d in zip(springs, after.tolist(), strict=True)])
    displacements_before, forces_before = 2.0 * displacements - after, 2.0 * forces - forces_after
    return CoupledState(
        position,
        rate,
        np.array([displacements, displacements_before, displacements_before]),
        np.array([spring.committed_displacement for spring in springs]),
        np.array([forces, forces_before, forces_before]),
        np.array([response.absorbed_energy for response in responses]),
        1,
    )
