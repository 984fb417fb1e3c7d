"""What all masters share: the state of the coupled system, and polynomials through its latest values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..kernel.arrays import FloatArray
from .fmu_spring import CosimulationError, Response
from .plants import Plant

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


class CoupledSpring(Protocol):
    """What masters require of a spring; `FmuSpring` provides it.

    `trial` and whatever happens within `rollback` leave the spring unchanged; `commit` and `commit_curve` extend its
    path.
    """

    displacement_min: float
    displacement_max: float

    def trial(self, displacement: float) -> Response: ...

    def rollback(self) -> AbstractContextManager[None]: ...

    def commit(self, time: float, step: float, displacement: float) -> Response: ...

    def commit_curve(
        self, time: float, step: float, displacement: float, velocity: float, acceleration: float
    ) -> Response: ...

    def directional_derivative(self) -> float: ...


@dataclass(frozen=True, eq=False)
class CoupledState:
    """The coupled system at a communication point, with values of up to two points before.

    Attributes
    ----------
    q, velocity : ndarray, shape (N,)        Of the plant.
    displacements : ndarray, shape (3, J)    Of the springs as the plant moves, here and at the two points before [m].
    committed : ndarray, shape (J,)          Committed displacements of the springs [m]; masters that extrapolate commit
                                             others than the plant's.
    forces : ndarray, shape (3, J)           Of the springs, here and at the two points before [N].
    energies : ndarray, shape (J,)           Absorbed by each spring [J].
    past : int                               Valid points before this one, 1 or 2.
    """

    q: FloatArray
    velocity: FloatArray
    displacements: FloatArray
    committed: FloatArray
    forces: FloatArray
    energies: FloatArray
    past: int

    def extrapolate(self, values: FloatArray, order: int) -> FloatArray:
        """Coefficients of 1, s, s^2 for `forces` or `displacements`; linear while only one point before is valid."""
        return EXTRAPOLATION[min(order, self.past)] @ values

    def interpolate(self, newest: FloatArray, values: FloatArray, order: int) -> FloatArray:
        """The same between the value at the end of the step and the latest ones."""
        return INTERPOLATION[order] @ _prepend(newest, values)

    def next(
        self,
        q: FloatArray,
        velocity: FloatArray,
        displacements: FloatArray,
        committed: FloatArray,
        responses: Sequence[Response],
    ) -> CoupledState:
        """The state at the next communication point."""
        forces = np.array([response.force for response in responses])
        return CoupledState(
            q,
            velocity,
            _prepend(displacements, self.displacements),
            committed,
            _prepend(forces, self.forces),
            np.array([response.absorbed_energy for response in responses]),
            min(self.past + 1, 2),
        )


def _prepend(newest: FloatArray, values: FloatArray) -> FloatArray:
    """The latest three values, newest first."""
    latest = np.empty_like(values)
    latest[0], latest[1:] = newest, values[:2]
    return latest


@dataclass(frozen=True, eq=False)
class StepResult:
    """Result of one step.

    Attributes
    ----------
    state : CoupledState
    applied_force : ndarray, shape (J,)   Mean spring forces over the step as applied to the plant [N].
    iterations : int
    """

    state: CoupledState
    applied_force: FloatArray
    iterations: int = 1


# Time at the beginning of the step, the state there, the springs.
Stepper = Callable[[float, CoupledState, Sequence[CoupledSpring]], StepResult]


class Master(Protocol):
    """How plant and springs exchange displacement and force."""

    def stepper(self, plant: Plant, step: float) -> Stepper:
        """The function that performs steps of this size [s]."""


def check_order(name: str, order: int) -> None:
    """Raise CosimulationError unless `order` is one that polynomials exist for."""
    if order not in (0, 1, 2):
        raise CosimulationError(f"`{name}` must be 0, 1 or 2, got {order!r}.")


def commit_straight(
    springs: Sequence[CoupledSpring], time: float, step: float, displacements: FloatArray
) -> list[Response]:
    """Commit each spring's straight path to its displacement."""
    pairs = zip(springs, displacements.tolist(), strict=True)
    return [spring.commit(time, step, displacement) for spring, displacement in pairs]


def commit_curves(springs: Sequence[CoupledSpring], time: float, step: float, paths: FloatArray) -> list[Response]:
    """Commit each spring's path a_0 + a_1*s + a_2*s^2, s = tau/step, for `paths` of shape (3, J)."""
    derivatives = paths * np.array([[1.0], [1.0 / step], [2.0 / step**2]])
    pairs = zip(springs, derivatives.T.tolist(), strict=True)
    return [spring.commit_curve(time, step, *path) for spring, path in pairs]
