"""The implicit master: displacements at the end of the step that plant and springs agree on, by Newton's method.

Midpoint rule for the plant, with the mean force of each spring over the step. With `MeanForce.WORK` this is

    Fm = (E(d_1) - E(d_0))/(d_1 - d_0),    E = absorbed_energy,

so that the work of the plant on the spring equals the energy the spring absorbs, within the tolerance, at any step
size: an energy-momentum method with the discrete gradient of Gonzalez (J. Nonlinear Sci. 6, 1996). Its derivative by
d_1 is (F(d_1) - Fm)/(d_1 - d_0), as F is the derivative of E. Near d_1 = d_0, where both quotients lose precision,
(F(d_0) + F(d_1))/2 and half the tangent stiffness replace them.

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
from .coupling import MEAN, CoupledSpring, CoupledState, Stepper, StepResult, commit_straight
from .fmu_spring import CosimulationError, Response
from .plants import Plant, quadratic_load

_EPSILON = float(np.finfo(np.float64).eps)
_MIN_STEP_FRACTION = 1e-3  # of a Newton step, at which the line search stops


class MeanForce(Enum):
    """The spring's mean force over a step."""

    WORK = "energy absorbed over displacement"
    ENDS = "mean of the forces at both ends"


class TrialMethod(Enum):
    """How the response to a trial displacement is obtained.

    Both give the same response. `FEEDTHROUGH` is faster; `ROLLBACK` also works with an FMU, such as one wrapped by
    another tool, that updates its outputs at steps only.
    """

    FEEDTHROUGH = "set the displacement and get the outputs"
    ROLLBACK = "step, get the outputs and restore the state"


class TangentSource(Enum):
    """Where the spring's tangent stiffness comes from.

    Both give the same tangent. `STIFFNESS` works with every spring FMU; `DIRECTIONAL_DERIVATIVE` uses the interface
    that FMI provides for this, which the native back end implements.
    """

    STIFFNESS = "the output stiffness"
    DIRECTIONAL_DERIVATIVE = "fmi2GetDirectionalDerivative"


@dataclass(frozen=True)
class Iterative:
    """Repeat each step until plant and springs agree.

    Parameters
    ----------
    mean_force : MeanForce
    trial_method : TrialMethod
    tangent : TangentSource
    tolerance : float          Difference in the springs' displacements at which the iteration ends [m].
    max_iterations : int
    """

    mean_force: MeanForce = MeanForce.WORK
    trial_method: TrialMethod = TrialMethod.FEEDTHROUGH
    tangent: TangentSource = TangentSource.STIFFNESS
    tolerance: float = 1e-12
    max_iterations: int = 50

    def __post_init__(self) -> None:
        if not self.tolerance > 0.0:
            raise CosimulationError(f"`tolerance` must be > 0 [m], got {self.tolerance!r}.")
        if self.max_iterations < 1:
            raise CosimulationError(f"`max_iterations` must be >= 1, got {self.max_iterations!r}.")

    def stepper(self, plant: Plant, step: float) -> Stepper:
        inverse = np.linalg.inv(2.0 * plant.M / step**2 + plant.C / step + 0.5 * plant.K)
        # Displacement of the plant's coordinates, and of the springs, per mean spring force.
        plant_compliance = inverse @ (plant.G * plant.counts)
        compliance = plant.G.T @ plant_compliance

        def advance(time: float, state: CoupledState, springs: Sequence[CoupledSpring]) -> StepResult:
            load = MEAN @ quadratic_load(plant, time, step)
            momentum = 2.0 / step * plant.M @ state.velocity
            free_increment = inverse @ (momentum - plant.K @ state.q + load)
            # Relative to the committed displacements, so that the residual of a step is corrected in the next one.
            target = plant.displacements(time + step, state.q + free_increment) - state.committed
            trials = _Trials(self, time, step, springs, state)
            travel, forces, iterations = self._solve(trials, state.forces[0], target, compliance)
            increment = free_increment - plant_compliance @ forces
            q, velocity = state.q + increment, 2.0 / step * increment - state.velocity
            committed = state.committed + travel
            responses = commit_straight(springs, time, step, committed)
            displacements = plant.displacements(time + step, q)
            return StepResult(state.next(q, velocity, displacements, committed, responses), forces, iterations)

        return advance

    def _solve(
        self, trials: _Trials, guess: FloatArray, target: FloatArray, compliance: FloatArray
    ) -> tuple[FloatArray, FloatArray, int]:
        """Travel of the springs with travel + compliance*mean force = target, these forces, and the trial count."""
        travel = target - compliance @ guess
        newton_step, fraction, last_error = travel, 1.0, np.inf
        for count in range(1, self.max_iterations + 1):
            forces, derivatives, noise = trials(travel)
            residual = travel + compliance @ forces - target
            error = float(np.max(np.abs(residual), initial=0.0))
            rounding = _EPSILON * np.abs(target) + np.abs(compliance) @ noise
            if error <= self.tolerance + float(np.max(rounding, initial=0.0)):
                return travel, forces, count
            if error < last_error or fraction < _MIN_STEP_FRACTION:
                last_error, fraction = error, 1.0
                newton_step = -np.linalg.solve(np.eye(travel.size) + compliance * derivatives, residual)
                travel = travel + newton_step
            else:
                # The stiffness jumps at a reversal: halve the Newton step.
                fraction *= 0.5
                travel = travel - fraction * newton_step
        raise CosimulationError(
            f"Plant and springs must agree within {self.tolerance:g} m in {self.max_iterations} iterations, but differ "
            f"by {error:.3g} m in the step at {trials.time:.6g} s; take smaller steps."
        )


class _Trials:
    """Responses of all springs to trial travels from one state."""

    def __init__(
        self, master: Iterative, time: float, step: float, springs: Sequence[CoupledSpring], state: CoupledState
    ) -> None:
        self.time = time
        self._master = master
        self._step = step
        self._springs = springs
        self._committed, self._energies = state.committed.tolist(), state.energies.tolist()
        self._forces = state.forces[0].tolist()

    def __call__(self, travel: FloatArray) -> FloatArray:
        """Mean forces, their derivatives by the travel, and their rounding noise, shape (3, J)."""
        return np.array([self._mean_force(j, d) for j, d in enumerate(travel.tolist())]).reshape(-1, 3).T

    def _mean_force(self, j: int, trial_travel: float) -> tuple[float, float, float]:
        """The same for spring j."""
        spring, committed = self._springs[j], self._committed[j]
        displacement = committed + trial_travel
        travel = displacement - committed  # after rounding, which matters where it is tiny
        response, tangent = self._response(spring, displacement)
        start_force, end_force = self._forces[j], response.force
        absorbed = response.absorbed_energy - self._energies[j]
        # Rounding of the difference, of the displacement, and of the potential from which the FMU computes the energy.
        extent = abs(displacement) + spring.displacement_max - spring.displacement_min
        energies = abs(response.absorbed_energy) + abs(self._energies[j]) + abs(end_force) * extent
        noise = 2.0 * _EPSILON * energies
        if self._master.mean_force is MeanForce.ENDS or abs((end_force - start_force) * travel) <= noise:
            return 0.5 * (start_force + end_force), 0.5 * tangent, _EPSILON * (abs(start_force) + abs(end_force))
        return absorbed / travel, (end_force - absorbed / travel) / travel, noise / abs(travel)

    def _response(self, spring: CoupledSpring, displacement: float) -> tuple[Response, float]:
        """Response and tangent stiffness [N/m]."""
        if self._master.trial_method is TrialMethod.FEEDTHROUGH:
            response = spring.trial(displacement)
            return response, self._tangent(spring, response)
        with spring.rollback():
            response = spring.commit(self.time, self._step, displacement)
            return response, self._tangent(spring, response)

    def _tangent(self, spring: CoupledSpring, response: Response) -> float:
        if self._master.tangent is TangentSource.DIRECTIONAL_DERIVATIVE:
            return spring.directional_derivative()
        return response.stiffness
