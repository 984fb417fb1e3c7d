"""Steady periodic motion of systems on springs by harmonic balance with alternating frequency and time.

The motion is a Fourier series; the springs' force is taken in time, where the closed form gives a whole period at
once, and brought back by its projection. The compiled kernel solves the balance with exact derivatives
(`kernel/c/balance.h`). A mass on a mount is a system of one coordinate on one axis, about its static equilibrium.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import FloatArray
from ...kernel.balance import BalancedSystem
from ...kernel.periodic import fourier_basis
from ...kernel.structures import rows
from .continuation import SteadyMotion
from .options import Excitation
from .system import IsolatedMass, StaticEquilibrium

ComplexArray = NDArray[np.complex128]

# The force has kinks at the reversals, so that its harmonics fall with k^2 and those of the motion with k^4.
HARMONICS = 11
SAMPLES = 256
_LOSS_FACTOR = 0.1  # of the linear motion about which the first steady one is looked for
# Motion this share of the identified range beyond its ends still counts as inside.
_SLACK = 1e-6


def displacement_limits(low: FloatArray, high: FloatArray, extrapolate: bool) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest displacements that springs may reach: their identified ranges, or any [m]."""
    slack = np.inf if extrapolate else _SLACK * (high - low)
    return low - slack, high + slack


def forcing(excitation: Excitation, level: float, steady: FloatArray, inertial: FloatArray) -> FloatArray:
    """`BalancedSystem.forcing`, shape (2, D).

    Parameters
    ----------
    excitation : Excitation
    level : float
    steady, inertial : ndarray, shape (D,)   Forces on the coordinates by a unit of the exciting force or the base's
                                             displacement [N], and by that displacement and the square of Omega [N s^2].
    """
    if excitation is Excitation.BASE_ACCELERATION:
        # Displacement is acceleration over -Omega^2; without rotation of the base nothing is steady.
        return -level * np.array([inertial, np.zeros_like(steady)])
    return level * np.array([steady, inertial])


def mass_balance(
    system: IsolatedMass,
    equilibrium: StaticEquilibrium,
    excitation: Excitation,
    level: float,
    extrapolate: bool = True,
    harmonics: int = HARMONICS,
    samples: int = SAMPLES,
) -> BalancedSystem:
    """The balance of a mass under one level of excitation; its coordinate is that of the mount, from equilibrium on.

    Parameters
    ----------
    system : IsolatedMass
    equilibrium : StaticEquilibrium
    excitation : Excitation
    level : float              Amplitude [m], [m/s^2] or [N], > 0.
    extrapolate : bool         Whether the motion may leave the identified range.
    harmonics, samples : int   H of the Fourier series and K per period; H >= 1, K > 2H.
    """
    spring, is_force = system.spring, excitation is Excitation.FORCE
    ends = np.array([[spring.displacement_min], [spring.displacement_max]])
    low, high = displacement_limits(ends[0], ends[1], extrapolate)
    return BalancedSystem(
        springs=[spring],
        axes=rows(
            "BalancedAxis",
            1,
            parallel=system.mount.parallel,
            series=system.mount.series,
            position=equilibrium.displacement,
            damping=system.mount.damping,
            stop_low=-np.inf,
            stop_high=np.inf,
            low=low,
            high=high,
        ),
        basis=fourier_basis(harmonics, samples),
        mass=system.mass,
        along=np.ones((1, 1)),
        bend=np.zeros((1, 1, 1)),
        load=np.array([system.static_load]),
        forcing=forcing(excitation, level, np.array([float(is_force)]), np.array([(not is_force) * system.mass])),
        level_text=excitation.level_text(level),
    )


def linear_motion(balance: BalancedSystem, tangents: FloatArray, forces: FloatArray, frequency: float) -> FloatArray:
    """Coefficients of the motion with the axes' tangent stiffness and a loss factor of a tenth, shape (D*N,) [m].

    Parameters
    ----------
    balance : BalancedSystem
    tangents, forces : ndarray, shape (M,)   Stiffness of each axis for small motion [N/m], and its force at rest [N].
    frequency : float                        Omega [rad/s].
    """
    along = balance.along
    stiffness, damping = (along.T @ (of[:, None] * along) for of in (tangents, balance.axes["damping"]))
    inertia = balance.mass * frequency**2 * np.eye(balance.degrees)
    geometric = np.tensordot(forces, balance.bend, 1)
    dynamic = stiffness * (1.0 + 1j * _LOSS_FACTOR) + geometric - inertia + 1j * frequency * damping
    if any(spring.branches for spring in balance.springs):
        sums = [sum(b.dynamic_stiffness(frequency) for b in spring.branches) for spring in balance.springs]
        of_axes = np.array(sums) * balance.axes["parallel"] / balance.axes["series"]
        dynamic = dynamic + along.T @ (of_axes[:, None] * along)
    first = np.linalg.solve(dynamic, balance.forcing_at(frequency))
    z = np.zeros((balance.degrees, balance.basis.order.size))
    z[:, 1], z[:, 1 + balance.basis.harmonics] = first.real, -first.imag
    return z.ravel()


def first_beyond(balance: BalancedSystem, motions: Sequence[SteadyMotion]) -> tuple[SteadyMotion, int] | None:
    """The first motion in which springs go beyond the limits, and the axis that does so furthest; None if all stay."""
    figures = np.array([motion.motion.figures for motion in motions])
    beyond = np.maximum(figures[:, :, 1] - balance.axes["high"], balance.axes["low"] - figures[:, :, 0])
    outside = np.flatnonzero(beyond.max(axis=1) > 0.0)
    return (motions[outside[0]], int(np.argmax(beyond[outside[0]]))) if outside.size else None


def stacked(balance: BalancedSystem, motions: Sequence[SteadyMotion]) -> tuple[FloatArray, FloatArray]:
    """Omega, shape (F,) [rad/s], and the coefficients of all coordinates, shape (F, D, N) [m]."""
    z = np.array([motion.z for motion in motions])
    return np.exp([motion.log for motion in motions]), z.reshape(len(motions), balance.degrees, -1)


def first_harmonics(z: FloatArray) -> ComplexArray:
    """Of series of the shape (..., N), shape (...)."""
    return np.asarray(z[..., 1] - 1j * z[..., 1 + z.shape[-1] // 2])


def displacements(balance: BalancedSystem, motions: Sequence[SteadyMotion]) -> FloatArray:
    """Displacement of the coordinates over a period, shape (F, D, K) [m]."""
    return _sampled(balance, stacked(balance, motions)[1])


def rates(balance: BalancedSystem, motions: Sequence[SteadyMotion]) -> FloatArray:
    """Velocity of the coordinates over a period, shape (F, D, K) [m/s]."""
    omega, z = stacked(balance, motions)
    half, by_time = balance.basis.harmonics, np.zeros_like(z)
    order = omega[:, None, None] * balance.basis.order[1 : half + 1]
    by_time[..., 1 : half + 1], by_time[..., half + 1 :] = order * z[..., half + 1 :], -order * z[..., 1 : half + 1]
    return _sampled(balance, by_time)


def accelerations(balance: BalancedSystem, motions: Sequence[SteadyMotion]) -> FloatArray:
    """Acceleration of the coordinates over a period, shape (F, D, K) [m/s^2].

    It is not that of the series, whose few harmonics would smear the kinks of the springs' force.
    """
    forces = np.array([motion.motion.force for motion in motions])
    omega, _ = stacked(balance, motions)
    acting = balance.load[:, None] + balance.forcing_at(omega)[..., None] * balance.basis.functions[1]
    return np.asarray((acting - forces) / balance.mass)


def _sampled(balance: BalancedSystem, series: FloatArray) -> FloatArray:
    """Series of the shape (F, D, N) over a period, shape (F, D, K)."""
    samples = series.reshape(-1, series.shape[-1]) @ balance.basis.functions
    return np.asarray(samples.reshape(*series.shape[:-1], -1))


def largest_of_period(samples: FloatArray) -> FloatArray:
    """Largest values of periods of shape (..., K), of a parabola through the largest sample and its neighbours."""
    top, count = samples.argmax(axis=-1)[..., None], samples.shape[-1]
    before, most, after = (np.take_along_axis(samples, (top + k) % count, -1)[..., 0] for k in (-1, 0, 1))
    bend = 2.0 * most - before - after
    return np.asarray(most + (after - before) ** 2 / (8.0 * np.where(bend > 0.0, bend, 1.0)))
