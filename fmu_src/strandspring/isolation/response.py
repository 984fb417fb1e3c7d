"""What a designer reads off the steady motions: transmissibility, resonance, equivalent stiffness and damping."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import SpringParameters
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.modelled import steady_loop_figures
from .continuation import SteadyMotion, follow, refine_peak
from .harmonic_balance import HARMONICS, SAMPLES, HarmonicBalance
from .system import Excitation, IsolatedMass, IsolationError, static_equilibrium

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
    least, greatest : float         Displacement of one spring [m].
    force : float                   First harmonic of the force on the base [N].
    acceleration : float            Largest acceleration of the mass, not relative to the base, of either sign [m/s^2].
    start_displacement, start_speed, start_omega : float   Of the mount [m, m/s] and of a spring [-] at the crest of the
                                    excitation: a simulation that begins there is steady at once.
    stable : bool                   False between two folds of the curve, where no steady motion stays.
    wanted : bool                   Whether this frequency was asked for; the others are steps along the curve.
    extrapolating : bool            Whether the spring leaves the identified range.
    """

    frequency: float
    transmissibility: float
    phase: float
    relative: float
    relative_phase: float
    amplitude: float
    mean: float
    least: float
    greatest: float
    force: float
    acceleration: float
    start_displacement: float
    start_speed: float
    start_omega: float
    stable: bool
    wanted: bool
    extrapolating: bool


@dataclass(frozen=True)
class Resonance:
    """Figures of one level.

    Attributes
    ----------
    frequency, transmissibility, amplitude : float   At the greatest transmissibility [Hz], [-], [m].
    stiffness : float                 Secant stiffness of the mount's loop there [N/m].
    loss_factor : float               Of the same loop, viscous damping of the mount included [-].
    isolation_frequency : float       From here on the transmissibility stays below 1 [Hz]; NaN if it does nowhere.
    inside : bool                     Whether the greatest lies inside the band, not at one of its ends.
    """

    frequency: float
    transmissibility: float
    amplitude: float
    stiffness: float
    loss_factor: float
    isolation_frequency: float
    inside: bool


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Steady motions of one level over a band, in the order of the curve, and their figures.

    Attributes
    ----------
    excitation : Excitation
    level : float                             Amplitude [m], [m/s^2] or [N].
    columns : mapping of ndarray, shape (P,)  What `ResponsePoint` names, over all points.
    resonance : Resonance
    """

    excitation: Excitation
    level: float
    columns: Mapping[str, NDArray[Any]]
    resonance: Resonance

    @cached_property
    def points(self) -> tuple[ResponsePoint, ...]:
        """The points of the curve."""
        rows = zip(*(self.columns[field.name].tolist() for field in fields(ResponsePoint)), strict=True)
        return tuple(ResponsePoint(*row) for row in rows)

    @property
    def level_text(self) -> str:
        """The level in the unit that people read."""
        return self.excitation.level_text(self.level)

    @property
    def extrapolating(self) -> bool:
        """Whether the spring leaves the identified range anywhere on the curve."""
        return bool(self.columns["extrapolating"].any())

    def column(self, name: str) -> FloatArray:
        """One attribute of all points, shape (P,)."""
        return self.columns[name].astype(np.float64)


def frequency_response(
    system: IsolatedMass,
    excitation: Excitation,
    level: float,
    frequencies: Sequence[float] | FloatArray,
    extrapolate: bool = False,
    harmonics: int = HARMONICS,
    samples: int = SAMPLES,
) -> FrequencyResponse:
    """Steady motion of a mass on a mount over a band of frequencies, through folds if there are any.

    Parameters
    ----------
    system : IsolatedMass
    excitation : Excitation
    level : float                Amplitude [m], [m/s^2] or [N], > 0.
    frequencies : array_like     Shape (F,), F >= 2, rising [Hz], > 0.
    extrapolate : bool           Go on where the motion leaves the identified range.
    harmonics, samples : int     Of the Fourier series, and per period.

    Returns
    -------
    FrequencyResponse

    Raises
    ------
    IsolationError   If there is no static equilibrium, an argument is out of bounds, the motion leaves the identified
                     range, or no steady motion is found.
    """
    band = checked_band(frequencies)
    if not (math.isfinite(level) and level > 0.0):
        raise IsolationError(f"`level` must be finite and > 0 [{excitation.unit}], got {level!r}.")
    balance = HarmonicBalance(system, excitation, level, harmonics, samples)
    limits = _limits(system.spring, extrapolate)
    motions = []
    for motion in follow(balance, static_equilibrium(system), 2.0 * np.pi * band, limits):
        _check_range(balance, motion, limits)
        motions.append(motion)
    motions = refine_peak(balance, motions, lambda at: np.abs(_transmissibility(balance, *_stacked(at))))
    for motion in motions:
        _check_range(balance, motion, limits)
    columns = _columns(balance, motions)
    return FrequencyResponse(excitation, level, columns, _resonance(system, columns))


def checked_band(frequencies: Sequence[float] | FloatArray) -> FloatArray:
    """Frequencies of a band [Hz] as an array.

    Raises
    ------
    IsolationError   Unless they are at least two, finite, > 0 and rising.
    """
    band = np.asarray(frequencies, dtype=np.float64)
    if band.ndim != 1 or band.size < 2:
        raise IsolationError(f"`frequencies` must be at least two, got shape {band.shape}.")
    bad = np.flatnonzero(~(np.isfinite(band) & (band > 0.0)))
    if bad.size:
        raise IsolationError(f"Every frequency must be finite and > 0 [Hz], got {float(band[bad[0]])!r}.")
    if np.any(np.diff(band) <= 0.0):
        raise IsolationError("`frequencies` must rise.")
    return band


def _limits(spring: SpringParameters, extrapolate: bool) -> tuple[float, float]:
    """Displacements between which a spring may move [m]."""
    if extrapolate:
        return -math.inf, math.inf
    slack = _SLACK * (spring.displacement_max - spring.displacement_min)
    return spring.displacement_min - slack, spring.displacement_max + slack


def _check_range(balance: HarmonicBalance, motion: SteadyMotion, limits: tuple[float, float]) -> None:
    """Refuse a motion that leaves the identified range."""
    low, high = motion.summary.low, motion.summary.high
    if low < limits[0] or high > limits[1]:
        p = balance.system.spring
        raise IsolationError(
            f"At {motion.omega / (2.0 * np.pi):.4g} Hz and a level of {balance.excitation.level_text(balance.level)} the "
            f"spring moves from {1e3 * low:.4g} to {1e3 * high:.4g} mm, outside the identified range of "
            f"{1e3 * p.displacement_min:.4g} to {1e3 * p.displacement_max:.4g} mm; use a lower level, more "
            "springs, or a model identified over a larger range."
        )


def _stacked(motions: Sequence[SteadyMotion]) -> tuple[FloatArray, FloatArray]:
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


def _transmissibility(balance: HarmonicBalance, omega: FloatArray, z: FloatArray) -> ComplexArray:
    """As `ResponsePoint` has it, with its phase, shape (P,) [-]."""
    if balance.excitation is Excitation.FORCE:
        return _force(balance, omega, z) / balance.level
    base = _base(balance, omega)
    return (_relative(balance, z) + base) / base


def _columns(balance: HarmonicBalance, motions: Sequence[SteadyMotion]) -> dict[str, NDArray[Any]]:
    """What `ResponsePoint` names, over all motions."""
    system, order, half = balance.system, balance.basis.order, balance.basis.harmonics
    omega, z = _stacked(motions)
    low, high, start_omega, push = np.array([motion.summary for motion in motions]).T
    of_force = balance.excitation is Excitation.FORCE
    ratio = _transmissibility(balance, omega, z)
    relative = _relative(balance, z) / (balance.level if of_force else _base(balance, omega))
    within_low, within_high = _limits(system.spring, extrapolate=False)
    return {
        "frequency": omega / (2.0 * np.pi),
        "transmissibility": np.abs(ratio),
        "phase": _degrees(ratio),
        "relative": np.abs(relative),
        "relative_phase": _degrees(relative),
        "amplitude": 0.5 * system.series * (high - low),
        "mean": z[:, 0] / system.series,
        "least": low,
        "greatest": high,
        "force": np.abs(_force(balance, omega, z)),
        "acceleration": push / system.mass,
        "start_displacement": z[:, : half + 1].sum(axis=1),
        "start_speed": omega * (z[:, half + 1 :] @ order[half + 1 :]),
        "start_omega": start_omega,
        "stable": np.array([motion.rising for motion in motions]),
        "wanted": np.array([motion.wanted for motion in motions]),
        "extrapolating": (low < within_low) | (high > within_high),
    }


def _degrees(values: ComplexArray) -> FloatArray:
    """Phase within [-180, 180)."""
    angle = np.degrees(np.angle(values))
    return np.where(angle >= 180.0, angle - 360.0, angle)


def _resonance(system: IsolatedMass, columns: Mapping[str, NDArray[Any]]) -> Resonance:
    frequency, ratio = columns["frequency"], columns["transmissibility"]
    peak = int(np.argmax(ratio))
    figures = steady_loop_figures(
        PathSolver(system.spring), float(columns["least"][peak]), float(columns["greatest"][peak])
    )
    stiffness = system.stiffness_scale * figures.secant_stiffness
    viscous = 2.0 * math.pi * float(frequency[peak]) * system.damping / stiffness
    return Resonance(
        frequency=float(frequency[peak]),
        transmissibility=float(ratio[peak]),
        amplitude=float(columns["amplitude"][peak]),
        stiffness=stiffness,
        loss_factor=figures.loss_factor + viscous,
        isolation_frequency=_isolation_frequency(frequency, ratio),
        inside=0 < peak < ratio.size - 1,
    )


def _isolation_frequency(frequency: FloatArray, ratio: FloatArray) -> float:
    """Where the transmissibility falls below 1 for good [Hz]; NaN if it does nowhere."""
    above = np.flatnonzero(~(ratio < 1.0))
    if above.size == 0:
        return float(frequency[0])
    last = int(above[-1])
    if last + 1 == ratio.size:
        return math.nan
    # Both fall nearly by powers of each other.
    share = math.log(ratio[last]) / math.log(ratio[last] / ratio[last + 1])
    return float(frequency[last] * (frequency[last + 1] / frequency[last]) ** share)
