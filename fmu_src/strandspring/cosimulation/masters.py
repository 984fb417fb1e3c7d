"""Explicit masters: each subsystem steps once, with forces and displacements held, extrapolated or interpolated.

All use the plant's exact solution (`plants.LinearFlow`), so that error and instability come from the coupling alone.
`stability` computes the largest stable step: on an undamped mass and spring, masters that hold forces or extrapolate
them linearly add energy at any step, the less the smaller it is; Verlet is stable up to h*omega = 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..kernel.arrays import FloatArray
from .coupling import (
    END,
    MEAN,
    CoupledSpring,
    CoupledState,
    Stepper,
    StepResult,
    check_order,
    commit_curves,
    commit_straight,
)
from .fmu_spring import Response
from .plants import LinearFlow, Plant, quadratic_load


class Subsystem(Enum):
    """The two sides of the coupling."""

    PLANT = "plant"
    SPRINGS = "springs"


class InputPath(Enum):
    """Path of a spring's displacement within a step.

    `STRAIGHT` goes to the displacement at the end. The others give the FMU derivatives of its input, so that it turns
    within the step where the displacement does. `RESET` begins each step at the plant's displacement, as masters do
    that pass on values and derivatives: if displacements are extrapolated, this moves the spring back by the error of
    the last step, and a hysteretic spring, which remembers every reversal, drifts. `CURVED` begins at the spring's
    committed displacement.
    """

    STRAIGHT = "straight"
    CURVED = "curved"
    RESET = "curved, reset to the plant's displacement"


@dataclass(frozen=True)
class Jacobi:
    """Both subsystems step at once with what is known at the beginning; most master tools do so, with both orders 0.

    Parameters
    ----------
    force_order : int          Forces on the plant: held (0), extrapolated linearly (1) or by a parabola (2).
    displacement_order : int   The same for the displacements of the springs.
    input_path : InputPath     Other than straight, it needs FMUs that interpolate inputs.
    """

    force_order: int = 0
    displacement_order: int = 0
    input_path: InputPath = InputPath.STRAIGHT

    def __post_init__(self) -> None:
        check_order("force_order", self.force_order)
        check_order("displacement_order", self.displacement_order)

    def stepper(self, plant: Plant, step: float) -> Stepper:
        flow = LinearFlow(plant, step)

        def advance(time: float, state: CoupledState, springs: Sequence[CoupledSpring]) -> StepResult:
            forces = state.extrapolate(state.forces, self.force_order)
            q, velocity, displacements = _advance_plant(plant, flow, time, step, state, forces)
            paths = state.extrapolate(state.displacements, self.displacement_order)
            responses = _commit(springs, time, step, state, paths, self.input_path)
            return StepResult(state.next(q, velocity, displacements, END @ paths, responses), MEAN @ forces)

        return advance


@dataclass(frozen=True)
class GaussSeidel:
    """One subsystem steps first, the other with its result.

    Parameters
    ----------
    first : Subsystem          `PLANT`: forces are extrapolated, displacements interpolated; `SPRINGS`: the reverse.
    force_order : int          0, 1 or 2: constant, linear, parabola through the latest values.
    displacement_order : int   The same; if displacements are interpolated on a straight path, it has no effect.
    input_path : InputPath     As in `Jacobi`.
    """

    first: Subsystem = Subsystem.PLANT
    force_order: int = 2
    displacement_order: int = 2
    input_path: InputPath = InputPath.STRAIGHT

    def __post_init__(self) -> None:
        check_order("force_order", self.force_order)
        check_order("displacement_order", self.displacement_order)

    def stepper(self, plant: Plant, step: float) -> Stepper:
        flow = LinearFlow(plant, step)

        def plant_first(time: float, state: CoupledState, springs: Sequence[CoupledSpring]) -> StepResult:
            forces = state.extrapolate(state.forces, self.force_order)
            q, velocity, displacements = _advance_plant(plant, flow, time, step, state, forces)
            paths = state.interpolate(displacements, state.displacements, self.displacement_order)
            responses = _commit(springs, time, step, state, paths, self.input_path)
            return StepResult(state.next(q, velocity, displacements, displacements, responses), MEAN @ forces)

        def springs_first(time: float, state: CoupledState, springs: Sequence[CoupledSpring]) -> StepResult:
            paths = state.extrapolate(state.displacements, self.displacement_order)
            responses = _commit(springs, time, step, state, paths, self.input_path)
            end_forces = np.array([response.force for response in responses])
            forces = state.interpolate(end_forces, state.forces, self.force_order)
            q, velocity, displacements = _advance_plant(plant, flow, time, step, state, forces)
            return StepResult(state.next(q, velocity, displacements, END @ paths, responses), MEAN @ forces)

        return plant_first if self.first is Subsystem.PLANT else springs_first


@dataclass(frozen=True)
class Verlet:
    """Springs act on the plant by half an impulse at either end of the step; in between it moves without them.

    Velocity Verlet where the plant is mass alone. Of second order and symplectic: without damping the energy error
    stays bounded up to h*omega = 2, where omega is the highest natural frequency.
    """

    def stepper(self, plant: Plant, step: float) -> Stepper:
        flow = LinearFlow(plant, step)
        half_impulse = -0.5 * step * plant.inverse_mass @ (plant.G * plant.counts)

        def advance(time: float, state: CoupledState, springs: Sequence[CoupledSpring]) -> StepResult:
            velocity = state.velocity + half_impulse @ state.forces[0]
            q, velocity = flow.advance(state.q, velocity, quadratic_load(plant, time, step))
            displacements = plant.displacements(time + step, q)
            responses = commit_straight(springs, time, step, displacements)
            forces = np.array([response.force for response in responses])
            end = state.next(q, velocity + half_impulse @ forces, displacements, displacements, responses)
            return StepResult(end, 0.5 * (state.forces[0] + forces))

        return advance


def _advance_plant(
    plant: Plant, flow: LinearFlow, time: float, step: float, state: CoupledState, forces: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """q, q' and the springs' displacements after the step under the load and forces of shape (3, J) in powers of s."""
    generalized = quadratic_load(plant, time, step) - forces * plant.counts @ plant.G.T
    q, velocity = flow.advance(state.q, state.velocity, generalized)
    return q, velocity, plant.displacements(time + step, q)


def _commit(
    springs: Sequence[CoupledSpring],
    time: float,
    step: float,
    state: CoupledState,
    displacements: FloatArray,
    input_path: InputPath,
) -> list[Response]:
    """Commit the springs' paths to the end of displacements of shape (3, J) in powers of s."""
    if input_path is InputPath.STRAIGHT:
        return commit_straight(springs, time, step, END @ displacements)
    if input_path is InputPath.CURVED:
        offset = state.committed - displacements[0]
        displacements = displacements + np.array([offset, -offset, np.zeros_like(offset)])
    return commit_curves(springs, time, step, displacements)
