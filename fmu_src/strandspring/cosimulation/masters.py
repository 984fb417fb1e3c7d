"""Explicit masters: each subsystem steps once, with forces and displacements held, extrapolated or interpolated.

All take the plant's exact solution (`plants.LinearFlow`), so that error and instability are the coupling's own. How
large steps may be is told by `stability`: on an undamped mass and spring, those that hold forces or extrapolate them by
a line feed energy in at any step, the less the smaller it is; Verlet is stable up to h*omega = 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..kernel.arrays import FloatArray
from .coupling import END, MEAN, Advance, Point, SpringPort, Stepper, checked_order, stepped_along, stepped_to
from .plants import LinearFlow, Plant, quadratic_load
from .unit import Response


class First(Enum):
    """Which subsystem steps first."""

    PLANT = "plant"
    SPRINGS = "springs"


class Course(Enum):
    """How a spring goes along the displacement that it is given for a step.

    `STRAIGHT`: to its end. The others give the FMU derivatives of its input, so that it turns within the step where the
    displacement does. `RESET` begins each step where the plant was, as masters do that pass values and derivatives on:
    if displacements are extrapolated, that moves the spring back by the error of the last step, and a spring that
    remembers every turn then drifts. `CURVED` goes on from where the spring is.
    """

    STRAIGHT = "straight"
    CURVED = "curved"
    RESET = "curved, from where the plant was"


@dataclass(frozen=True)
class Jacobi:
    """Both step at once from what they knew at the beginning; most master tools couple so, with both orders 0.

    Parameters
    ----------
    force_order : int          The plant feels the forces held (0) or extrapolated by a line (1) or a parabola (2).
    displacement_order : int   The springs go where the displacements held or extrapolated lead.
    course : Course            Others than straight need FMUs that interpolate inputs.
    """

    force_order: int = 0
    displacement_order: int = 0
    course: Course = Course.STRAIGHT

    def __post_init__(self) -> None:
        checked_order("force_order", self.force_order)
        checked_order("displacement_order", self.displacement_order)

    def stepper(self, plant: Plant, step: float) -> Stepper:
        flow = LinearFlow(plant, step)

        def advance(time: float, point: Point, springs: Sequence[SpringPort]) -> Advance:
            forces = point.extrapolated(point.forces, self.force_order)
            q, speed = _plant_step(plant, flow, time, step, point, forces)
            paths = point.extrapolated(point.displacements, self.displacement_order)
            responses = _springs_step(springs, time, step, point, paths, self.course)
            given = plant.displacements(time + step, q)
            return Advance(point.followed_by(q, speed, given, END @ paths, responses), MEAN @ forces)

        return advance


@dataclass(frozen=True)
class GaussSeidel:
    """One steps first, the other with the result.

    Parameters
    ----------
    first : First              `PLANT`: forces are extrapolated, displacements interpolated; `SPRINGS`: the reverse.
    force_order : int          0, 1 or 2; constant, line, parabola through the latest values.
    displacement_order : int   The same; interpolated, it matters only if the course is not straight.
    course : Course            As in `Jacobi`.
    """

    first: First = First.PLANT
    force_order: int = 2
    displacement_order: int = 2
    course: Course = Course.STRAIGHT

    def __post_init__(self) -> None:
        checked_order("force_order", self.force_order)
        checked_order("displacement_order", self.displacement_order)

    def stepper(self, plant: Plant, step: float) -> Stepper:
        flow = LinearFlow(plant, step)

        def plant_first(time: float, point: Point, springs: Sequence[SpringPort]) -> Advance:
            forces = point.extrapolated(point.forces, self.force_order)
            q, speed = _plant_step(plant, flow, time, step, point, forces)
            given = plant.displacements(time + step, q)
            paths = point.interpolated(given, point.displacements, self.displacement_order)
            responses = _springs_step(springs, time, step, point, paths, self.course)
            return Advance(point.followed_by(q, speed, given, given, responses), MEAN @ forces)

        def springs_first(time: float, point: Point, springs: Sequence[SpringPort]) -> Advance:
            paths = point.extrapolated(point.displacements, self.displacement_order)
            responses = _springs_step(springs, time, step, point, paths, self.course)
            newest = np.array([response.force for response in responses])
            forces = point.interpolated(newest, point.forces, self.force_order)
            q, speed = _plant_step(plant, flow, time, step, point, forces)
            given = plant.displacements(time + step, q)
            return Advance(point.followed_by(q, speed, given, END @ paths, responses), MEAN @ forces)

        return plant_first if self.first is First.PLANT else springs_first


@dataclass(frozen=True)
class Verlet:
    """Springs act on the plant by half an impulse at either end of the step; in between it moves without them.

    Velocity Verlet where the plant is mass alone. Of second order and symplectic: without damping the energy error
    stays bounded up to h*omega = 2, omega being the highest natural frequency.
    """

    def stepper(self, plant: Plant, step: float) -> Stepper:
        flow = LinearFlow(plant, step)
        kick = -0.5 * step * plant.inverse_mass @ (plant.G * plant.counts)

        def advance(time: float, point: Point, springs: Sequence[SpringPort]) -> Advance:
            speed = point.speed + kick @ point.forces[0]
            q, speed = flow.advance(point.q, speed, quadratic_load(plant, time, step))
            given = plant.displacements(time + step, q)
            responses = stepped_to(springs, time, step, given)
            forces = np.array([response.force for response in responses])
            after = point.followed_by(q, speed + kick @ forces, given, given, responses)
            return Advance(after, 0.5 * (point.forces[0] + forces))

        return advance


def _plant_step(
    plant: Plant, flow: LinearFlow, time: float, step: float, point: Point, forces: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """q and q' after the step under the load and spring forces of shape (3, J) in powers of s."""
    generalized = quadratic_load(plant, time, step) - forces * plant.counts @ plant.G.T
    return flow.advance(point.q, point.speed, generalized)


def _springs_step(
    springs: Sequence[SpringPort], time: float, step: float, point: Point, given: FloatArray, course: Course
) -> list[Response]:
    """Step the springs to the end of displacements of shape (3, J) in powers of s."""
    if course is Course.STRAIGHT:
        return stepped_to(springs, time, step, END @ given)
    if course is Course.CURVED:
        jump = point.reached - given[0]
        given = given + np.array([jump, -jump, np.zeros_like(jump)])
    return stepped_along(springs, time, step, given)
