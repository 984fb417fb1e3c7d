"""Simulation of a plant with spring FMUs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..kernel.arrays import FloatArray
from .fmu_spring import CosimulationError, DivergenceError, FmuSpring
from .masters import CoupledState, Iterative, Master
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
    """

    times: FloatArray
    q: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    displacement: FloatArray
    force: FloatArray
    absorbed_energy: FloatArray


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
) -> Motion:
    """Simulate a plant with spring FMUs.

    Parameters
    ----------
    plant : Plant
    springs : sequence of FmuSpring   One for each attachment. Springs that have not been started are started at the
                                      displacements of q; others continue their committed paths. Each that leaves
                                      its identified range by more than 1 % of it gives a UserWarning.
    stop, step : float                End and step [s]; `stop` is rounded to whole steps.
    master : Master
    q, velocity : array_like, shape (N,)   Initial values; zero by default.

    Raises
    ------
    CosimulationError   If an argument is invalid, a call of an FMU fails, or the motion diverges.
    """
    if len(springs) != len(plant.attachments):
        raise CosimulationError(
            f"The plant has {len(plant.attachments)} attachments, but {len(springs)} springs were given."
        )
    if not (np.isfinite(step) and step > 0.0 and np.isfinite(stop) and stop >= 0.5 * step):
        raise CosimulationError(f"`step` must be > 0 [s] and `stop` at least a step, got {step!r} and {stop!r}.")
    times: FloatArray = step * np.arange(round(stop / step) + 1, dtype=np.float64)
    states = [initial_state(plant, springs, q, velocity)]
    advance = master.stepper(plant, springs, step)
    for time in times[:-1].tolist():
        try:
            state = advance(time, states[-1])
            if not (np.isfinite(state.q).all() and np.isfinite(state.forces).all()):
                raise DivergenceError
        except DivergenceError:
            raise CosimulationError(f"The motion diverged in the step at {time:.6g} s; take smaller steps.") from None
        states.append(state)
    for spring in springs:
        spring.warn_outside(stacklevel=2)
    accelerations = [
        plant.acceleration(time, state.q, state.velocity, state.forces)
        for time, state in zip(times.tolist(), states, strict=True)
    ]
    return Motion(
        times,
        np.array([state.q for state in states]),
        np.array([state.velocity for state in states]),
        np.array(accelerations),
        np.array([state.displacements for state in states]),
        np.array([state.forces for state in states]),
        np.array([state.energies for state in states]),
    )


def initial_state(
    plant: Plant, springs: Sequence[FmuSpring], q: ArrayLike | None = None, velocity: ArrayLike | None = None
) -> CoupledState:
    """The state at time 0, in which a simulation begins; starts the springs that have not been started."""
    zero = np.zeros(plant.coordinates)
    position = zero if q is None else np.atleast_1d(np.asarray(q, dtype=np.float64))
    rate = zero if velocity is None else np.atleast_1d(np.asarray(velocity, dtype=np.float64))
    for name, values in (("q", position), ("velocity", rate)):
        if values.shape != zero.shape or not np.isfinite(values).all():
            raise CosimulationError(f"`{name}` must be {zero.size} finite numbers, got {values.tolist()!r}.")
    displacements = plant.displacements(0.0, position)
    responses = [
        spring.trial(spring.committed_displacement) if spring.started else spring.start(displacement)
        for spring, displacement in zip(springs, displacements.tolist(), strict=True)
    ]
    forces, energies, _ = np.array(responses).reshape(-1, 3).T
    return CoupledState(position, rate, displacements, forces, energies)
