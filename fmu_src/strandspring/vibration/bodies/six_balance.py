"""Steady vibration of rigid bodies on mounts by harmonic balance, for small rotations about static equilibrium.

All D free coordinates q of the bodies (`small_motion`) are Fourier series. With g the derivatives of an axis'
displacement, its springs are at x + g.q/S, and the coefficients of all orders k balance,

    -m*(k*Omega)^2*q_k + i*k*Omega*C q_k + K_g q_k + sum of g*[P*r + stop]_k = W*[k = 0] + f*[k = 1],

with W the weight and K_g the geometric stiffness of the forces at rest: what is left out is of second order in the
rotations and in the turning of what vibrates. Each spring's steady force over a period is exact for its displacement
(`kernel.periodic_spring`); Newton's method has the exact Jacobian.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...kernel.arrays import FloatArray
from ...kernel.periodic import FourierBasis, fourier_basis
from ...kernel.periodic_spring import PeriodicSpring
from ..one_mass.harmonic_balance import HARMONICS, SAMPLES
from ..one_mass.system import Excitation
from .axis_laws import AxisLaws, ComplexArray
from .mounted import MountedSystem
from .shaking import Shaking
from .small_motion import Pose, SmallMotion

# An axis that moves by less than this share of the largest motion has its tangent stiffness.
_STILL = 1e-9
# Newton's method, as in balance.c
_STEPS, _HALVINGS = 40, 8
_BALANCED, _WITHIN_ROUNDING = 1e-9, 1e-7  # of the largest term
# From one wanted frequency to the next, as there: steps at the finest; of the motion's norm; of that
_PARTS, _LARGEST_CHANGE, _LARGEST_SURPRISE = 32, 0.6, 0.5


class AxisRanges(NamedTuple):
    """Lowest and highest displacement of one spring of each axis, shape (M,) [m]."""

    low: FloatArray
    high: FloatArray


class Course(NamedTuple):
    """A motion over a period: relative displacement [m] and acceleration [m/s^2] of the coordinates, shape (D, K).

    And the base's acceleration [m/s^2 or rad/s^2], shape (K,).
    """

    displacement: FloatArray
    acceleration: FloatArray
    base_acceleration: FloatArray


@dataclass(frozen=True, eq=False)
class BodiesBalance:
    """The balance of one motion at one frequency; attributes as of `kernel.balance.Balance`, in N*D coefficients."""

    residual: FloatArray
    jacobian: FloatArray
    by_frequency: FloatArray
    scale: float
    summary: AxisRanges


class SixBalance:
    """The balance of a system under one level of excitation.

    Parameters
    ----------
    system : MountedSystem
    pose : Pose                Of static equilibrium.
    shaking : Shaking
    level : float              In its unit, > 0.
    omega : ndarray or None    Of the springs at rest, shape (M,) [-], for geometric stiffness; by default 0.
    harmonics, samples : int   H of the Fourier series and K per period; H >= 1, K > 2H.
    """

    def __init__(
        self,
        system: MountedSystem,
        pose: Pose,
        shaking: Shaking,
        level: float,
        omega: FloatArray | None = None,
        harmonics: int = HARMONICS,
        samples: int = SAMPLES,
    ) -> None:
        self.system, self.shaking, self.level = system, shaking, level
        self.basis: FourierBasis = fourier_basis(harmonics, samples)
        self.motion = SmallMotion.about(system, pose)
        self.laws = AxisLaws(system)
        self.degrees = self.motion.along.shape[1]
        self._again = (pose, shaking, omega, harmonics, samples)
        self._springs = [PeriodicSpring(axis.spring, self.basis) for _, axis in system.axes()]
        forces = self.laws.forces(self.motion.springs, np.zeros(len(self._springs)) if omega is None else omega)
        self._geometric = self.motion.geometric(forces)
        self._tangents = self.laws.tangents(self.motion.springs)
        along = self.motion.along
        self._pairs = (along[:, :, None] * along[:, None, :]).reshape(len(along), -1).T
        self._functions = self.basis.at(self.basis.phase)
        count = self.basis.order.size
        self._projection = self._functions.T * np.where(self.basis.order > 0.0, 2.0, 1.0)[:, None] / samples
        # Derivative of a series by the phase.
        self._slope = np.zeros((count, count))
        rows = np.arange(1, harmonics + 1)
        self._slope[rows, rows + harmonics] = rows
        self._slope[rows + harmonics, rows] = -rows
        self._steady, self._inertial = (level * part for part in shaking.forcing(self.motion))

    def at_level(self, level: float) -> SixBalance:
        """The same balance at another level."""
        pose, shaking, omega, harmonics, samples = self._again
        return SixBalance(self.system, pose, shaking, level, omega, harmonics, samples)

    @property
    def level_text(self) -> str:
        """The level in the unit that people read."""
        return self.shaking.level_text(self.level)

    def forcing(self, frequency: float) -> FloatArray:
        """Amplitudes of the forces cos(Omega t) on the coordinates, shape (D,) [N]."""
        return self._by_square(frequency)[0]

    def linear_motion(self, frequency: float) -> FloatArray:
        """Coefficients of the motion with tangent stiffness and a loss factor of a tenth, shape (N*D,) [m]."""
        stiffness = self.motion.along.T @ (self._tangents[:, None] * self.motion.along) * (1.0 + 0.1j) + self._geometric
        inertia = self.motion.mass * frequency**2 * np.eye(self.degrees)
        first = np.linalg.solve(stiffness - inertia + 1j * frequency * self.motion.damping, self.forcing(frequency))
        z = np.zeros((self.basis.order.size, self.degrees))
        z[1], z[1 + self.basis.harmonics] = first.real, -first.imag
        return z.ravel()

    def at(self, z: FloatArray, frequency: float) -> BodiesBalance:
        """The balance of a motion, which need not be steady.

        Parameters
        ----------
        z : ndarray, shape (N*D,)   Coefficients of the coordinates, order by order [m].
        frequency : float           Omega [rad/s].

        Raises
        ------
        ValueError                  If nothing moves.
        """
        motion, count = self.motion, self.basis.order.size
        of_orders = z.reshape(count, self.degrees)
        forces, stiffness, summary, _ = self._axes(of_orders)
        speeds = self._slope @ of_orders
        squares = (self.basis.order**2)[:, None]
        springs = forces @ motion.along + of_orders @ self._geometric
        inertia = -motion.mass * frequency**2 * squares * of_orders
        damping = frequency * speeds @ motion.damping
        forcing, by_frequency_of_forcing = self._by_square(frequency)
        residual = springs + inertia + damping
        residual[0] -= motion.weight
        residual[1] -= forcing
        by_frequency = 2.0 * inertia / frequency + damping / frequency
        by_frequency[1] -= by_frequency_of_forcing
        jacobian = (
            (self._pairs @ stiffness.reshape(len(stiffness), -1))
            .reshape(self.degrees, self.degrees, count, count)
            .transpose(2, 0, 3, 1)
            .copy()
        )
        jacobian += frequency * self._slope[:, None, :, None] * motion.damping[None, :, None, :]
        orders, each = np.arange(count), np.arange(self.degrees)
        jacobian[orders, :, orders, :] += self._geometric
        jacobian[orders[:, None], each, orders[:, None], each] -= motion.mass * frequency**2 * squares
        largest = max(float(np.abs(part[1:]).max()) for part in (springs, inertia, damping))
        return BodiesBalance(
            residual=residual.ravel(),
            jacobian=jacobian.reshape(z.size, z.size),
            by_frequency=by_frequency.ravel(),
            # The static part, which may be far larger, is balanced as finely.
            scale=max(largest, float(np.abs(forcing).max())),
            summary=summary,
        )

    def solve(self, guess: FloatArray, frequency: float) -> tuple[FloatArray, AxisRanges] | None:
        """The steady motion at a fixed Omega [rad/s] by Newton's method; None if it does not converge.

        Parameters
        ----------
        guess : ndarray, shape (N*D,)   Where it starts [m].
        """
        solved = self._newton(guess, frequency)
        return None if solved is None else (solved[0], solved[1].summary)

    def sweep(
        self, log: float, z: FloatArray, logs: FloatArray, limits: tuple[float, float]
    ) -> Sequence[tuple[FloatArray, AxisRanges]]:
        """Steady motions at rising frequencies, as far as each is continuous with the one before.

        Parameters
        ----------
        log, z : float and ndarray, shape (N*D,)   ln(Omega) and coefficients of the steady motion before the first.
        logs : ndarray, shape (F,)                 Wanted ln(Omega), rising.
        limits : tuple of float                    Of `reach`, the higher one counts; the first motion beyond is the
                                                   last.

        Returns
        -------
        list                                       At most F steady motions.
        """
        found: list[tuple[FloatArray, AxisRanges]] = []
        here = self.at(z, float(np.exp(log)))
        for target in logs.tolist():
            reached = self._reach(log, z, here, target)
            if reached is None:
                break
            (z, here), log = reached, target
            found.append((z, here.summary))
            if self.reach(here.summary).max() > limits[1]:
                break
        return found

    def _reach(
        self, log: float, z: FloatArray, here: BodiesBalance, target: float
    ) -> tuple[FloatArray, BodiesBalance] | None:
        """The steady motion at another ln(Omega), in several steps if need be; None unless continuous with this one."""
        step, finest = target - log, (target - log) / _PARTS
        while log < target:
            after = target if log + 1.5 * step > target else log + step
            ahead = self._step(log, z, here, after)
            if ahead is not None:
                (z, here), log = ahead, after
            elif (step := 0.5 * step) < finest:
                return None
        return z, here

    def _step(
        self, log: float, z: FloatArray, here: BodiesBalance, after: float
    ) -> tuple[FloatArray, BodiesBalance] | None:
        """The steady motion at the next ln(Omega), if it is near and where it was expected."""
        size = _LARGEST_CHANGE * float(np.linalg.norm(z[self.degrees :]))
        try:
            tangent = np.linalg.solve(here.jacobian, -float(np.exp(log)) * here.by_frequency)
        except np.linalg.LinAlgError:
            return None
        guess = z + (after - log) * tangent
        if not np.linalg.norm(guess - z) <= size:
            return None
        solved = self._newton(guess, float(np.exp(after)))
        if solved is None or not (
            np.linalg.norm(solved[0] - z) <= size and np.linalg.norm(solved[0] - guess) <= _LARGEST_SURPRISE * size
        ):
            return None
        return solved

    def reach(self, ranges: AxisRanges) -> FloatArray:
        """How far springs move from the middle of their identified range, over half of it, shape (M,) [-]."""
        middle, half = 0.5 * (self.laws.high + self.laws.low), 0.5 * (self.laws.high - self.laws.low)
        return np.asarray(np.maximum(ranges.high - middle, middle - ranges.low) / half)

    def first_forces(self, z: FloatArray) -> ComplexArray:
        """First harmonic of each axis' force without its damper in a motion, shape (M,) [N]."""
        forces, *_ = self._axes(z.reshape(self.basis.order.size, self.degrees))
        return np.asarray(forces[1] - 1j * forces[1 + self.basis.harmonics])

    def course(self, z: FloatArray, frequency: float) -> Course:
        """A steady motion over a period.

        The acceleration is not that of the series, whose few harmonics would smear the kinks of the springs' force.
        """
        of_orders, motion = z.reshape(self.basis.order.size, self.degrees), self.motion
        forces = self._axes(of_orders)[3]
        displacement = self._functions @ of_orders
        speed = frequency * self._functions @ self._slope @ of_orders
        crest = self._functions[:, 1:2]
        push = motion.weight + crest * self.forcing(frequency) - forces.T @ motion.along
        push -= displacement @ self._geometric + speed @ motion.damping
        base = -(frequency**2) * self.shaking.base_amplitude(self.level, np.array(frequency)) * crest[:, 0]
        return Course(displacement.T, push.T / motion.mass, base)

    def _by_square(self, frequency: float) -> tuple[FloatArray, FloatArray]:
        """The forcing [N] and its derivative by Omega [N s]."""
        if self.shaking.kind is Excitation.BASE_ACCELERATION:
            # Displacement is acceleration over -Omega^2.
            of_base = -self._steady / frequency**2
            return of_base - self._inertial, -2.0 * of_base / frequency
        inertial = self._inertial * frequency**2
        return self._steady + inertial, 2.0 * inertial / frequency

    def _newton(self, guess: FloatArray, frequency: float) -> tuple[FloatArray, BodiesBalance] | None:
        z = guess
        try:
            here = self.at(z, frequency)
            for _ in range(_STEPS):
                size = float(np.abs(here.residual).max())
                if size <= _BALANCED * here.scale:
                    return z, here
                step = np.linalg.solve(here.jacobian, -here.residual)
                for halving in range(_HALVINGS):
                    there = self.at(z + 0.5**halving * step, frequency)
                    if float(np.abs(there.residual).max()) < size:
                        break
                else:
                    return (z, here) if size <= _WITHIN_ROUNDING * here.scale else None
                z, here = z + 0.5**halving * step, there
        except (ValueError, np.linalg.LinAlgError):
            # Nothing moves, or the matrix is singular.
            return None
        return None

    def _axes(self, of_orders: FloatArray) -> tuple[FloatArray, FloatArray, AxisRanges, FloatArray]:
        """The axes without their dampers: coefficients of their forces, shape (N, M), the derivatives of these by the
        displacements' coefficients, shape (M, N, N), ranges, and forces over the period, shape (M, K)."""
        motion, laws = self.motion, self.laws
        count, axes = self.basis.order.size, len(self._springs)
        each = of_orders @ motion.along.T / laws.series
        each[0] += motion.springs
        sizes = np.linalg.norm(each[1:] * laws.series, axis=0)
        if not sizes.max() > 0.0:
            raise ValueError("`z` must describe a motion, got a constant pose.")
        forces, stiffness = np.empty((count, axes)), np.zeros((axes, count, count))
        displacement, force = np.empty((2, axes, self.basis.samples))
        low, high = each[0].copy(), each[0].copy()
        still = sizes <= _STILL * sizes.max()
        for j in np.flatnonzero(~still).tolist():
            found = self._springs[j].respond(each[:, j])
            forces[:, j], stiffness[j] = found.coefficients, found.jacobian
            displacement[j], force[j] = found.displacement, found.force
            low[j], high[j] = found.turns.min(), found.turns.max()
        if still.any():
            constant, mean, of_motion = laws.still(each[0])
            forces[:, still] = of_motion[still] * each[:, still]
            forces[0, still] = constant[still]
            diagonal = np.arange(count)
            stiffness[np.ix_(still, diagonal, diagonal)] = of_motion[still, None, None] * np.eye(count)
            stiffness[still, 0, 0] = mean[still]
            displacement[still] = (self._functions @ each[:, still]).T
            force[still] = constant[still, None] + of_motion[still, None] * (displacement[still] - each[0, still, None])
        forces *= laws.parallel
        force *= laws.parallel[:, None]
        stiffness *= (laws.parallel / laws.series)[:, None, None]
        stops, of_stops = laws.stops(displacement)
        touched = np.flatnonzero(stops.any(axis=1))
        if touched.size:
            forces[:, touched] += self._projection @ stops[touched].T
            force[touched] += stops[touched]
            stiffness[touched] += np.einsum("ik,mk,kj->mij", self._projection, of_stops[touched], self._functions)
        return forces, stiffness, AxisRanges(low, high), force
