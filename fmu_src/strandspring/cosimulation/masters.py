"""Two masters, which exchange displacement and force between a plant and its springs.

`Jacobi` steps both at once, as most simulators and SSP tools do: the force on the plant is held, and the springs move
to the displacements of the beginning of the step. The plant's solution is exact (`plants.LinearFlow`), so that error
and instability come from the coupling alone: it is of first order, and on an undamped mass and spring it adds energy at
any step.

`Iterative` repeats each step, rolling the FMUs back, until plant and springs agree on the displacements at its end. It
takes the midpoint rule for the plant, with the mean force of each spring over the step

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

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..kernel.arrays import FloatArray
from .fmu_spring import CosimulationError, FmuSpring
from .plants import LinearFlow, Plant, quadratic_load

_EPSILON = float(np.finfo(np.float64).eps)
_MIN_STEP_FRACTION = 1e-3  # of a Newton step, at which the line search stops
_MEAN = np.array([1.0, 1.0 / 2.0, 1.0 / 3.0])  # of 1, s, s^2 over a step, 0 <= s <= 1


@dataclass(frozen=True, eq=False)
class CoupledState:
    """The coupled system at a communication point.

    Attributes
    ----------
    q, velocity : ndarray, shape (N,)       Of the plant.
    displacements : ndarray, shape (J,)     Of the springs as the plant moves [m].
    forces, energies : ndarray, shape (J,)  Of the springs at the displacements they have been moved to [N], [J].
    """

    q: FloatArray
    velocity: FloatArray
    displacements: FloatArray
    forces: FloatArray
    energies: FloatArray


# Time at the beginning of the step and the state there; returns the state at its end.
Stepper = Callable[[float, CoupledState], CoupledState]


class Master(Protocol):
    """How plant and springs exchange displacement and force."""

    def stepper(self, plant: Plant, springs: Sequence[FmuSpring], step: float) -> Stepper:
        """The function that performs steps of this size [s]."""


@dataclass(frozen=True)
class Jacobi:
    """Each side steps once, with what is known at the beginning of the step."""

    def stepper(self, plant: Plant, springs: Sequence[FmuSpring], step: float) -> Stepper:
        flow = LinearFlow(plant, step)

        def advance(time: float, state: CoupledState) -> CoupledState:
            load = quadratic_load(plant, time, step)
            load[0] += plant.generalized_force(state.forces)
            q, velocity = flow.advance(state.q, state.velocity, load)
            forces, energies = commit(springs, time, step, state.displacements)
            return CoupledState(q, velocity, plant.displacements(time + step, q), forces, energies)

        return advance


@dataclass(frozen=True)
class Iterative:
    """Repeat each step until plant and springs agree.

    Parameters
    ----------
    tolerance : float          Difference in the springs' displacements at which the iteration ends [m].
    max_iterations : int
    """

    tolerance: float = 1e-12
    max_iterations: int = 50

    def __post_init__(self) -> None:
        if not self.tolerance > 0.0:
            raise CosimulationError(f"`tolerance` must be > 0 [m], got {self.tolerance!r}.")
        if self.max_iterations < 1:
            raise CosimulationError(f"`max_iterations` must be >= 1, got {self.max_iterations!r}.")

    def stepper(self, plant: Plant, springs: Sequence[FmuSpring], step: float) -> Stepper:
        inverse = np.linalg.inv(2.0 * plant.M / step**2 + plant.C / step + 0.5 * plant.K)
        # Displacement of the plant's coordinates, and of the springs, per mean spring force.
        plant_compliance = inverse @ (plant.G * plant.counts)
        compliance = plant.G.T @ plant_compliance

        def advance(time: float, state: CoupledState) -> CoupledState:
            load = _MEAN @ quadratic_load(plant, time, step)
            momentum = 2.0 / step * plant.M @ state.velocity
            free_increment = inverse @ (momentum - plant.K @ state.q + load)
            # Relative to the committed displacements, so that the residual of a step is corrected in the next one.
            committed = np.array([spring.committed_displacement for spring in springs])
            target = plant.displacements(time + step, state.q + free_increment) - committed

            def trial(travel: FloatArray) -> FloatArray:
                """Mean forces, their derivatives by the travel, and their rounding noise, shape (3, J)."""
                starts = zip(springs, travel.tolist(), state.forces.tolist(), state.energies.tolist(), strict=True)
                return np.array([_mean_force(time, step, *start) for start in starts]).reshape(-1, 3).T

            travel, forces = self._solve(trial, state.forces, target, compliance, time)
            increment = free_increment - plant_compliance @ forces
            q, velocity = state.q + increment, 2.0 / step * increment - state.velocity
            end_forces, energies = commit(springs, time, step, committed + travel)
            return CoupledState(q, velocity, plant.displacements(time + step, q), end_forces, energies)

        return advance

    def _solve(
        self,
        trial: Callable[[FloatArray], FloatArray],
        guess: FloatArray,
        target: FloatArray,
        compliance: FloatArray,
        time: float,
    ) -> tuple[FloatArray, FloatArray]:
        """Travel of the springs with travel + compliance*mean force = target, and these forces."""
        travel = target - compliance @ guess
        newton_step, fraction, last_error = travel, 1.0, np.inf
        for _ in range(self.max_iterations):
            forces, derivatives, noise = trial(travel)
            residual = travel + compliance @ forces - target
            error = float(np.max(np.abs(residual), initial=0.0))
            rounding = _EPSILON * np.abs(target) + np.abs(compliance) @ noise
            if error <= self.tolerance + float(np.max(rounding, initial=0.0)):
                return travel, forces
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
            f"by {error:.3g} m in the step at {time:.6g} s; take smaller steps."
        )


def commit(
    springs: Sequence[FmuSpring], time: float, step: float, displacements: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Commit each spring's straight path to its displacement; forces and absorbed energies there, shape (J,)."""
    responses = [
        spring.commit(time, step, displacement)
        for spring, displacement in zip(springs, displacements.tolist(), strict=True)
    ]
    forces, energies, _ = np.array(responses).reshape(-1, 3).T
    return forces, energies


def _mean_force(
    time: float, step: float, spring: FmuSpring, trial_travel: float, start_force: float, start_energy: float
) -> tuple[float, float, float]:
    """Mean force of a spring over a trial step, its derivative by the travel, and its rounding noise."""
    committed = spring.committed_displacement
    displacement = committed + trial_travel
    travel = displacement - committed  # after rounding, which matters where it is tiny
    with spring.rollback():
        end_force, end_energy, stiffness = spring.commit(time, step, displacement)
    absorbed = end_energy - start_energy
    # Rounding of the difference, of the displacement, and of the potential from which the FMU computes the energy.
    extent = abs(displacement) + spring.displacement_max - spring.displacement_min
    noise = 2.0 * _EPSILON * (abs(end_energy) + abs(start_energy) + abs(end_force) * extent)
    if abs((end_force - start_force) * travel) <= noise:
        return 0.5 * (start_force + end_force), 0.5 * stiffness, _EPSILON * (abs(start_force) + abs(end_force))
    return absorbed / travel, (end_force - absorbed / travel) / travel, noise / abs(travel)
