"""The implicit master: springs and plant agree on the displacements at the end of the step, by Newton's iteration.

Midpoint rule for the plant, with the mean force of each spring over the step. With `MeanForce.WORK` that is

    Fm = (E(d_1) - E(d_0))/(d_1 - d_0),    E = absorbed_energy,

so that the work the plant does on the spring is, to the tolerance, what the spring says it absorbed, at any step size:
an energy-momentum method with the discrete gradient of Gonzalez (J. Nonlinear Sci. 6, 1996). Its slope by d_1 is
(F(d_1) - Fm)/(d_1 - d_0), for F is the derivative of E; near d_1 = d_0, where both quotients cancel, they give way to
(F(d_0) + F(d_1))/2 and half the tangent stiffness.

With A = 2 M/h^2 + C/h + K/2, dq = q_1 - q_0 and the mean load f,

    A dq = 2 M v_0/h - K q_0 + f - sum_j count_j*g_j*Fm_j,    v_1 = 2 dq/h - v_0,

which leaves one equation for each spring's displacement.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..kernel.arrays import FloatArray
from .coupling import MEAN, Advance, Point, SpringPort, Stepper, stepped_to
from .plants import Plant, quadratic_load
from .unit import CosimulationError, Response

_EPSILON = float(np.finfo(np.float64).eps)
_LEAST_SHARE = 1e-3  # of a Newton step, below which a search along it gives up


class MeanForce(Enum):
    """The spring's mean force over a step."""

    WORK = "energy absorbed over displacement"
    ENDS = "mean of the forces at both ends"


class Trial(Enum):
    """How the response to a trial displacement is found; the answer is the same."""

    FEEDTHROUGH = "set the displacement and read"
    ROLLBACK = "step, read and restore the state"


class Slope(Enum):
    """Where the spring's tangent comes from; the answer is the same."""

    STIFFNESS = "the output stiffness"
    DIRECTIONAL_DERIVATIVE = "fmi2GetDirectionalDerivative"


@dataclass(frozen=True)
class Iterative:
    """Iterate each step until plant and springs agree.

    Parameters
    ----------
    mean_force : MeanForce
    trial : Trial
    slope : Slope
    tolerance : float    Disagreement in the springs' displacements at which the iteration ends [m].
    iterations : int     At most so many.
    """

    mean_force: MeanForce = MeanForce.WORK
    trial: Trial = Trial.FEEDTHROUGH
    slope: Slope = Slope.STIFFNESS
    tolerance: float = 1e-12
    iterations: int = 50

    def __post_init__(self) -> None:
        if not self.tolerance > 0.0:
            raise CosimulationError(f"`tolerance` must be > 0 [m], got {self.tolerance!r}.")
        if self.iterations < 1:
            raise CosimulationError(f"`iterations` must be >= 1, got {self.iterations!r}.")

    def stepper(self, plant: Plant, step: float) -> Stepper:
        inverse = np.linalg.inv(2.0 * plant.M / step**2 + plant.C / step + 0.5 * plant.K)
        # Displacement of the plant's coordinates, and of the springs, per mean spring force.
        yielding = inverse @ (plant.G * plant.counts)
        compliance = plant.G.T @ yielding

        def advance(time: float, point: Point, springs: Sequence[SpringPort]) -> Advance:
            load = MEAN @ quadratic_load(plant, time, step)
            momentum = 2.0 / step * plant.M @ point.speed
            free = inverse @ (momentum - plant.K @ point.q + load)
            # From where the springs are, so that what one step leaves open the next one closes.
            target = plant.displacements(time + step, point.q + free) - point.reached
            trials = _Trials(self, time, step, springs, point)
            travel, forces, iterations = self._solved(trials, point.forces[0], target, compliance)
            move = free - yielding @ forces
            q, speed = point.q + move, 2.0 / step * move - point.speed
            reached = point.reached + travel
            responses = stepped_to(springs, time, step, reached)
            given = plant.displacements(time + step, q)
            return Advance(point.followed_by(q, speed, given, reached, responses), forces, iterations)

        return advance

    def _solved(
        self, trials: _Trials, guess: FloatArray, target: FloatArray, compliance: FloatArray
    ) -> tuple[FloatArray, FloatArray, int]:
        """Travel of the springs with travel + compliance*mean force = target, these forces, and the trials it took."""
        travel = target - compliance @ guess
        direction, share, size = travel, 1.0, np.inf
        for count in range(1, self.iterations + 1):
            forces, slopes, noise = trials(travel)
            residual = travel + compliance @ forces - target
            now = float(np.max(np.abs(residual), initial=0.0))
            rounding = _EPSILON * np.abs(target) + np.abs(compliance) @ noise
            if now <= self.tolerance + float(np.max(rounding, initial=0.0)):
                return travel, forces, count
            if now < size or share < _LEAST_SHARE:
                size, share = now, 1.0
                direction = -np.linalg.solve(np.eye(travel.size) + compliance * slopes, residual)
                travel = travel + direction
            else:
                # The stiffness jumps at a reversal: go back half the way.
                share *= 0.5
                travel = travel - share * direction
        raise CosimulationError(
            f"Plant and springs must agree within {self.tolerance:g} m in {self.iterations} iterations, but differ by "
            f"{now:.3g} m in the step at {trials.time:.6g} s; take smaller steps."
        )


class _Trials:
    """Answers of all springs to travels from one point."""

    def __init__(
        self, master: Iterative, time: float, step: float, springs: Sequence[SpringPort], point: Point
    ) -> None:
        self.time = time
        self._master = master
        self._step = step
        self._springs = springs
        self._reached, self._energies = point.reached.tolist(), point.energies.tolist()
        self._forces = point.forces[0].tolist()

    def __call__(self, travel: FloatArray) -> FloatArray:
        """Mean forces, their slopes by the travel, and their rounding noise, shape (3, J)."""
        return np.array([self._one(place, way) for place, way in enumerate(travel.tolist())]).reshape(-1, 3).T

    def _one(self, place: int, wanted: float) -> tuple[float, float, float]:
        spring, reached = self._springs[place], self._reached[place]
        displacement = reached + wanted
        travel = displacement - reached  # that which is left of a tiny one after rounding
        response, tangent = self._response(spring, displacement)
        before, after = self._forces[place], response.force
        gained = response.absorbed_energy - self._energies[place]
        # Rounding of the difference, of the displacement, and of the potential from which the FMU takes its work.
        extent = abs(displacement) + spring.displacement_max - spring.displacement_min
        energies = abs(response.absorbed_energy) + abs(self._energies[place]) + abs(after) * extent
        noise = 2.0 * _EPSILON * energies
        if self._master.mean_force is MeanForce.ENDS or abs((after - before) * travel) <= noise:
            return 0.5 * (before + after), 0.5 * tangent, _EPSILON * (abs(before) + abs(after))
        return gained / travel, (after - gained / travel) / travel, noise / abs(travel)

    def _response(self, spring: SpringPort, displacement: float) -> tuple[Response, float]:
        """Response and tangent stiffness [N/m]."""
        if self._master.trial is Trial.FEEDTHROUGH:
            response = spring.tried(displacement)
            return response, self._tangent(spring, response)
        with spring.restored():
            response = spring.stepped(self.time, self._step, displacement)
            return response, self._tangent(spring, response)

    def _tangent(self, spring: SpringPort, response: Response) -> float:
        if self._master.slope is Slope.DIRECTIONAL_DERIVATIVE:
            return spring.directional_derivative()
        return response.stiffness
