"""What a designer reads off the steady motions: transmissibility, resonance, equivalent stiffness and damping."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.parameters import SpringParameters
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.modelled import steady_loop_figures
from .continuation import SteadyMotion, follow, refine_peak
from .harmonic_balance import HARMONICS, SAMPLES, HarmonicBalance
from .system import Excitation, IsolatedMass, IsolationError, static_point

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


@dataclass(frozen=True)
class FrequencyResponse:
    """Steady motions of one level over a band, in the order of the curve, and their figures."""

    excitation: Excitation
    level: float
    points: tuple[ResponsePoint, ...]
    resonance: Resonance

    @property
    def told_level(self) -> str:
        """The level in the unit that people read."""
        return self.excitation.told(self.level)

    @property
    def extrapolating(self) -> bool:
        """Whether the spring leaves the identified range anywhere on the curve."""
        return any(point.extrapolating for point in self.points)

    def column(self, name: str) -> FloatArray:
        """One attribute of all points, shape (P,)."""
        return np.array([getattr(point, name) for point in self.points], dtype=np.float64)


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
    IsolationError   If the mass has no rest position, an argument is out of bounds, the motion leaves the identified
                     range, or no steady motion is found.
    """
    band = checked_band(frequencies)
    if not (math.isfinite(level) and level > 0.0):
        raise IsolationError(f"`level` must be finite and > 0 [{excitation.unit}], got {level!r}.")
    balance = HarmonicBalance(system, excitation, level, harmonics, samples)
    rest = static_point(system)
    motions = list(_inside(follow(balance, rest, 2.0 * np.pi * band), balance, extrapolate))
    motions = refine_peak(balance, motions, lambda motion: _point(balance, motion).transmissibility)
    points = tuple(_point(balance, motion) for motion in _inside(iter(motions), balance, extrapolate))
    return FrequencyResponse(excitation, level, points, _resonance(system, points))


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


def _inside(motions: Iterator[SteadyMotion], balance: HarmonicBalance, extrapolate: bool) -> Iterator[SteadyMotion]:
    """The motions, refused where they leave the identified range."""
    p = balance.system.spring
    for motion in motions:
        least, greatest = _ends(motion)
        if not extrapolate and _is_outside(p, least, greatest):
            raise IsolationError(
                f"At {motion.omega / (2.0 * np.pi):.4g} Hz and a level of {balance.excitation.told(balance.level)} the "
                f"spring moves from {1e3 * least:.4g} to {1e3 * greatest:.4g} mm, outside the identified range of "
                f"{1e3 * p.displacement_min:.4g} to {1e3 * p.displacement_max:.4g} mm; use a lower level, more "
                "springs, or a model identified over a larger range."
            )
        yield motion


def _ends(motion: SteadyMotion) -> tuple[float, float]:
    """Least and greatest displacement of one spring [m]."""
    turns = motion.balance.spring.turns
    return float(turns.min()), float(turns.max())


def _is_outside(p: SpringParameters, least: float, greatest: float) -> bool:
    slack = _SLACK * (p.displacement_max - p.displacement_min)
    return least < p.displacement_min - slack or greatest > p.displacement_max + slack


def _point(balance: HarmonicBalance, motion: SteadyMotion) -> ResponsePoint:
    system, basis, omega = balance.system, balance.basis, motion.omega
    half = basis.harmonics
    z = motion.z
    relative = complex(z[1], -z[1 + half])
    base = {
        Excitation.BASE_DISPLACEMENT: balance.level,
        Excitation.BASE_ACCELERATION: -balance.level / omega**2,
        Excitation.FORCE: 0.0,
    }[balance.excitation]
    # What the mount pushes the mass with, from the mass's own balance.
    inertia = -system.mass * omega**2 * (relative + base)
    force = -inertia + (balance.level if balance.excitation is Excitation.FORCE else 0.0)
    ratio = force / balance.level if balance.excitation is Excitation.FORCE else (relative + base) / base
    of_relative = relative / (balance.level if balance.excitation is Excitation.FORCE else base)
    speed = omega * (basis.columns @ basis.differentiate(z))
    least, greatest = _ends(motion)
    return ResponsePoint(
        frequency=omega / (2.0 * math.pi),
        transmissibility=abs(ratio),
        phase=_degrees(ratio),
        relative=abs(of_relative),
        relative_phase=_degrees(of_relative),
        amplitude=0.5 * system.series * (greatest - least),
        mean=float(z[0]) / system.series,
        least=least,
        greatest=greatest,
        force=abs(force),
        acceleration=float(np.abs(_pushed(balance, motion, speed)).max()) / system.mass,
        start_displacement=float(basis.columns[0] @ z),
        start_speed=float(speed[0]),
        start_omega=float(motion.balance.spring.omega[0]),
        stable=motion.rising,
        wanted=motion.wanted,
        extrapolating=_is_outside(system.spring, least, greatest),
    )


def _pushed(balance: HarmonicBalance, motion: SteadyMotion, speed: FloatArray) -> FloatArray:
    """Force on the mass at each sample of the period [N].

    The springs' force has kinks, which the second derivative of the motion's few harmonics would smear.
    """
    system = balance.system
    exciting = balance.level * np.cos(balance.basis.phase) if balance.excitation is Excitation.FORCE else 0.0
    springs = system.parallel * motion.balance.spring.force
    return np.asarray(system.static_load + exciting - springs - system.damping * speed)


def _degrees(value: complex) -> float:
    angle = math.degrees(math.atan2(value.imag, value.real))
    return angle - 360.0 if angle >= 180.0 else angle


def _resonance(system: IsolatedMass, points: Sequence[ResponsePoint]) -> Resonance:
    values = [point.transmissibility for point in points]
    at = int(np.argmax(values))
    peak = points[at]
    figures = steady_loop_figures(PathSolver(system.spring), peak.least, peak.greatest)
    stiffness = system.stiffness_scale * figures.secant_stiffness
    viscous = 2.0 * math.pi * peak.frequency * system.damping / stiffness
    below = [value < 1.0 for value in values]
    last = max((k for k, one in enumerate(below) if not one), default=-1)
    if last + 1 == len(points):
        isolation = math.nan
    elif last < 0:
        isolation = points[0].frequency
    else:
        # Both fall nearly by powers of each other.
        here, there = points[last], points[last + 1]
        share = math.log(here.transmissibility) / math.log(here.transmissibility / there.transmissibility)
        isolation = here.frequency * (there.frequency / here.frequency) ** share
    return Resonance(
        frequency=peak.frequency,
        transmissibility=peak.transmissibility,
        amplitude=peak.amplitude,
        stiffness=stiffness,
        loss_factor=figures.loss_factor + viscous,
        isolation_frequency=isolation,
        inside=0 < at < len(points) - 1,
    )
