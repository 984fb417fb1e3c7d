"""The points of a response curve: what the Fourier coefficients of steady motions say to a designer."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from ...kernel.balance import MotionSummary
from .continuation import SteadyMotion
from .harmonic_balance import HarmonicBalance
from .system import Excitation

ComplexArray = NDArray[np.complex128]

# Motion this share of the identified range beyond its ends still counts as inside.
_SLACK = 1e-6


@dataclass(frozen=True)
class ResponsePoint:
    """The steady motion at one frequency.

    Attributes
    ----------
    frequency : float               [Hz]
    transmissibility : float        First harmonic of the absolute motion over that of the base; where a force excites,
                                    of the force on the base over that force [-].
    phase : float                   Of the same, negative where it lags, within [-180, 180) [degrees].
    relative : float                First harmonic of the relative motion over that of the base [-]; over the exciting
                                    force where a force excites [m/N].
    relative_phase : float          Of the same [degrees].
    amplitude : float               Half the stroke of the mount, all harmonics [m].
    mean : float                    Mean displacement of one spring [m].
    min, max : float                Displacement of one spring [m].
    force : float                   First harmonic of the force on the base [N].
    acceleration : float            Largest acceleration of the mass, not relative to the base, of either sign [m/s^2].
    start_displacement, start_speed, start_omega : float   Of the mount [m, m/s] and of a spring [-] at the crest of the
                                    excitation: a simulation that begins there is steady at once.
    stable : bool                   False between two folds of the curve, where no steady motion stays.
    requested : bool                Whether this frequency was asked for; the others are steps along the curve.
    extrapolating : bool            Whether the spring leaves the identified range.
    """

    frequency: float
    transmissibility: float
    phase: float
    relative: float
    relative_phase: float
    amplitude: float
    mean: float
    min: float
    max: float
    force: float
    acceleration: float
    start_displacement: float
    start_speed: float
    start_omega: float
    stable: bool
    requested: bool
    extrapolating: bool


def displacement_limits(spring: SpringParameters, extrapolate: bool) -> tuple[float, float]:
    """Lowest and highest displacement that a spring may reach: the identified range, or any [m]."""
    if extrapolate:
        return -math.inf, math.inf
    slack = _SLACK * (spring.displacement_max - spring.displacement_min)
    return spring.displacement_min - slack, spring.displacement_max + slack


def _stacked(motions: Sequence[SteadyMotion[MotionSummary]]) -> tuple[FloatArray, FloatArray]:
    """Omega, shape (P,) [rad/s], and Fourier coefficients, shape (P, N) [m]."""
    return np.exp([motion.log for motion in motions]), np.array([motion.z for motion in motions])


def _relative(balance: HarmonicBalance, z: FloatArray) -> ComplexArray:
    """First harmonic of the mount's displacement, shape (P,) [m]."""
    return np.asarray(z[:, 1] - 1j * z[:, 1 + balance.basis.harmonics])


def _base(balance: HarmonicBalance, omega: FloatArray) -> FloatArray:
    """Amplitude of the base's displacement, shape (P,) [m]."""
    if balance.excitation is Excitation.FORCE:
        return np.zeros_like(omega)
    of_displacement = balance.excitation is Excitation.BASE_DISPLACEMENT
    return np.full_like(omega, balance.level) if of_displacement else -balance.level / omega**2


def _force(balance: HarmonicBalance, omega: FloatArray, z: FloatArray) -> ComplexArray:
    """First harmonic of the force on the base, from the mass's own balance, shape (P,) [N]."""
    inertia = -balance.system.mass * omega**2 * (_relative(balance, z) + _base(balance, omega))
    return np.asarray((balance.level if balance.excitation is Excitation.FORCE else 0.0) - inertia)


def _ratio(balance: HarmonicBalance, omega: FloatArray, z: FloatArray) -> ComplexArray:
    """Transmissibility with its phase, shape (P,) [-]; see `ResponsePoint`."""
    if balance.excitation is Excitation.FORCE:
        return _force(balance, omega, z) / balance.level
    base = _base(balance, omega)
    return (_relative(balance, z) + base) / base


def transmissibility(balance: HarmonicBalance, motions: Sequence[SteadyMotion[MotionSummary]]) -> FloatArray:
    """Transmissibility at each motion, shape (P,) [-]."""
    return np.abs(_ratio(balance, *_stacked(motions)))


def response_columns(
    balance: HarmonicBalance, motions: Sequence[SteadyMotion[MotionSummary]]
) -> dict[str, NDArray[Any]]:
    """The attributes of `ResponsePoint` over all motions, each of shape (P,)."""
    system, order, half = balance.system, balance.basis.order, balance.basis.harmonics
    omega, z = _stacked(motions)
    low, high, start_omega, push = np.array([motion.summary for motion in motions]).T
    of_force = balance.excitation is Excitation.FORCE
    ratio = _ratio(balance, omega, z)
    relative = _relative(balance, z) / (balance.level if of_force else _base(balance, omega))
    within_low, within_high = displacement_limits(system.spring, extrapolate=False)
    return {
        "frequency": omega / (2.0 * np.pi),
        "transmissibility": np.abs(ratio),
        "phase": _degrees(ratio),
        "relative": np.abs(relative),
        "relative_phase": _degrees(relative),
        "amplitude": 0.5 * system.series * (high - low),
        "mean": z[:, 0] / system.series,
        "min": low,
        "max": high,
        "force": np.abs(_force(balance, omega, z)),
        "acceleration": push / system.mass,
        "start_displacement": z[:, : half + 1].sum(axis=1),
        "start_speed": omega * (z[:, half + 1 :] @ order[half + 1 :]),
        "start_omega": start_omega,
        "stable": np.array([motion.rising for motion in motions]),
        "requested": np.array([motion.wanted for motion in motions]),
        "extrapolating": (low < within_low) | (high > within_high),
    }


def _degrees(values: ComplexArray) -> FloatArray:
    """Phase within [-180, 180)."""
    angle = np.degrees(np.angle(values))
    return np.where(angle >= 180.0, angle - 360.0, angle)
