"""What all masters share: the point the coupled system has reached, and polynomials through past values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..kernel.arrays import FloatArray
from .plants import Plant
from .unit import CosimulationError, Response

# Through values at s = 0, -1, -2 (newest first): coefficients of 1, s, s^2 by order.
EXTRAPOLATION = (
    np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
    np.array([[1.0, 0.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 0.0]]),
    np.array([[1.0, 0.0, 0.0], [1.5, -2.0, 0.5], [0.5, -1.0, 0.5]]),
)
# The same through values at s = 1, 0, -1.
INTERPOLATION = (
    np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
    np.array([[0.0, 1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 0.0, 0.0]]),
    np.array([[0.0, 1.0, 0.0], [0.5, 0.0, -0.5], [0.5, -1.0, 0.5]]),
)
MEAN = np.array([1.0, 1.0 / 2.0, 1.0 / 3.0])  # of 1, s, s^2 over the step
END = np.ones(3)  # their values at s = 1


class SpringPort(Protocol):
    """What masters ask of a spring; `SpringUnit` is one."""

    displacement_min: float
    displacement_max: float

    def tried(self, displacement: float) -> Response: ...

    def restored(self) -> AbstractContextManager[None]: ...

    def stepped(self, time: float, step: float, displacement: float) -> Response: ...

    def stepped_along(self, time: float, step: float, displacement: float, first: float, second: float) -> Response: ...

    def directional_derivative(self) -> float: ...


@dataclass(frozen=True, eq=False)
class Point:
    """Where the coupled system stands at a communication point, and what it remembers of the last ones.

    Attributes
    ----------
    q, speed : ndarray, shape (N,)           Of the plant.
    displacements : ndarray, shape (3, J)    Of the springs as the plant has them here and at the two points before [m].
    reached : ndarray, shape (J,)            Where the springs' paths end [m]; masters that extrapolate get elsewhere.
    forces : ndarray, shape (3, J)           Of the springs here and at the two points before [N].
    energies : ndarray, shape (J,)           Absorbed by each spring [J].
    past : int                               Points before this one that are remembered, 1 or 2.
    """

    q: FloatArray
    speed: FloatArray
    displacements: FloatArray
    reached: FloatArray
    forces: FloatArray
    energies: FloatArray
    past: int

    def extrapolated(self, values: FloatArray, order: int) -> FloatArray:
        """Coefficients of 1, s, s^2 for `forces` or `displacements`; a line while too few points are remembered."""
        return EXTRAPOLATION[min(order, self.past)] @ values

    def interpolated(self, newest: FloatArray, values: FloatArray, order: int) -> FloatArray:
        """The same between the value at the end of the step and those remembered."""
        return INTERPOLATION[order] @ _with_newest(newest, values)

    def followed_by(
        self,
        q: FloatArray,
        speed: FloatArray,
        displacements: FloatArray,
        reached: FloatArray,
        responses: Sequence[Response],
    ) -> Point:
        """The next point."""
        forces = np.array([response.force for response in responses])
        return Point(
            q,
            speed,
            _with_newest(displacements, self.displacements),
            reached,
            _with_newest(forces, self.forces),
            np.array([response.absorbed_energy for response in responses]),
            min(self.past + 1, 2),
        )


def _with_newest(newest: FloatArray, values: FloatArray) -> FloatArray:
    """Three values, newest first."""
    three = np.empty_like(values)
    three[0], three[1:] = newest, values[:2]
    return three


@dataclass(frozen=True, eq=False)
class Advance:
    """One step done.

    Attributes
    ----------
    point : Point
    felt : ndarray, shape (J,)   Mean spring forces over the step as the plant felt them [N].
    iterations : int
    """

    point: Point
    felt: FloatArray
    iterations: int = 1


# Time at the beginning of the step, the point there, the springs.
Stepper = Callable[[float, Point, Sequence[SpringPort]], Advance]


class Master(Protocol):
    """How plant and springs exchange displacement and force."""

    def stepper(self, plant: Plant, step: float) -> Stepper:
        """The master made ready for steps of one size [s]."""


def checked_order(name: str, order: int) -> None:
    """Refuse an order of extrapolation that there is not."""
    if order not in (0, 1, 2):
        raise CosimulationError(f"`{name}` must be 0, 1 or 2, got {order!r}.")


def stepped_to(springs: Sequence[SpringPort], time: float, step: float, displacements: FloatArray) -> list[Response]:
    """Step every spring along the straight path to its displacement."""
    pairs = zip(springs, displacements.tolist(), strict=True)
    return [spring.stepped(time, step, displacement) for spring, displacement in pairs]


def stepped_along(springs: Sequence[SpringPort], time: float, step: float, paths: FloatArray) -> list[Response]:
    """Step every spring along a_0 + a_1*s + a_2*s^2, s = tau/step, for `paths` of shape (3, J)."""
    scaled = paths * np.array([[1.0], [1.0 / step], [2.0 / step**2]])
    pairs = zip(springs, scaled.T.tolist(), strict=True)
    return [spring.stepped_along(time, step, *path) for spring, path in pairs]
