"""What a designer reads off the steady motions: transmissibility, resonance, equivalent stiffness and damping."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import IsolationError
from ...findings import Finding, Outcome
from ...ground.result_columns import figure
from ...kernel.arrays import BoolArray, FloatArray
from ...kernel.path import PathSolver
from ...loops.loop import steady_loop
from .continuation import SteadyMotion, follow, refine_peak, refine_superharmonics
from .curve_points import ExcitedMass, ResponsePoint
from .harmonic_balance import HARMONICS, SAMPLES, first_beyond, linear_motion, mass_balance
from .options import Excitation
from .system import IsolatedMass, branch_stiffness, static_equilibrium

# Superharmonic resonances lie at half the resonance's frequency and below.
_SUPERHARMONIC = 0.7


@dataclass(frozen=True)
class Resonance:
    """Figures of one level at the greatest transmissibility."""

    frequency: float = figure("Hz", "resonance", "resonance", "Hz")
    transmissibility: float = figure("1", "transmissibility", "transmissibility")
    amplitude: float = figure("m", "amplitude", "amplitude", "mm", 1e3)
    stiffness: float = figure("N/m", "secant stiffness", "stiffness", "N/mm", 1e-3)  # of the mount's loop
    loss_factor: float = figure("1", "loss factor", "loss factor", digits=3)  # of it, with the mount's viscous damping
    # From here on the transmissibility stays below 1; NaN if it does nowhere.
    isolation_frequency: float = figure("Hz", "isolation begins", "isolates from", "Hz")
    inside: bool = figure("", "inside the band")  # not at one of its ends


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Steady motions of one level over a band, in the order of the curve, and their figures.

    Attributes
    ----------
    excitation : Excitation
    level : float                             Amplitude [m], [m/s^2] or [N].
    columns : mapping of ndarray, shape (P,)  What `ResponsePoint` names, over all points.
    resonance : Resonance
    natural_frequency : float                 Of small motion about the static equilibrium [Hz].
    """

    excitation: Excitation
    level: float
    columns: Mapping[str, NDArray[Any]]
    resonance: Resonance
    natural_frequency: float

    @cached_property
    def points(self) -> tuple[ResponsePoint, ...]:
        """The points of the curve."""
        rows = zip(*(self.columns[field.name].tolist() for field in fields(ResponsePoint)), strict=True)
        return tuple(ResponsePoint(*row) for row in rows)

    @property
    def resonances(self) -> tuple[Resonance]:
        """The one resonance, as responses of systems have several."""
        return (self.resonance,)

    @property
    def level_text(self) -> str:
        """The level in the unit that people read."""
        return self.excitation.level_text(self.level)

    @property
    def where(self) -> str:
        """Which of the curves of a system it is."""
        return self.level_text

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What limits the worth of these motions."""
        columns = self.columns
        return curve_findings(columns["frequency"], ~self.unstable, columns["extrapolating"].astype(bool))

    @property
    def extrapolating(self) -> bool:
        """Whether the spring leaves the identified range anywhere on the curve."""
        return bool(self.columns["extrapolating"].any())

    def column(self, name: str) -> FloatArray:
        """One attribute of all points, shape (P,)."""
        return self.columns[name].astype(np.float64)

    @property
    def unstable(self) -> NDArray[np.bool_]:
        """Points between two folds, shape (P,)."""
        return ~self.columns["stable"].astype(bool)

    @property
    def dotted(self) -> NDArray[np.bool_]:
        """Unstable points with their stable neighbours, shape (P,): drawn so, the curve has no gaps."""
        return with_neighbours(self.unstable)


def curve_findings(frequency: FloatArray, is_stable: BoolArray, is_outside: BoolArray) -> tuple[Finding, ...]:
    """Where a curve folds, and where its motions leave the identified range; arrays of shape (P,), [Hz]."""
    found = []
    if unstable := int(np.sum(~is_stable)):
        found.append(Finding(Outcome.CURVE_FOLDS, {"motions": unstable}))
    if is_outside.any():
        outside = frequency[is_outside]
        ends = (float(outside.min()), float(outside.max()))
        counts = {"count": outside.size, "points": frequency.size}
        found.append(Finding(Outcome.OUTSIDE_RANGE, {**counts, "frequencies": (ends,)}))
    return tuple(found)


def with_neighbours(is_marked: BoolArray) -> BoolArray:
    """Marked points of a curve and those beside them, shape (P,)."""
    return np.asarray(is_marked | np.append(is_marked[1:], False) | np.insert(is_marked[:-1], 0, False))


def frequency_response(
    system: IsolatedMass,
    excitation: Excitation,
    level: float,
    frequencies: Sequence[float] | FloatArray,
    extrapolate: bool = False,
    harmonics: int = HARMONICS,
    samples: int = SAMPLES,
    resolve: bool = False,
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
    resolve : bool               Add points to the superharmonic resonances that the frequencies meet, for a plot.

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
    equilibrium = static_equilibrium(system)
    balance = mass_balance(system, equilibrium, excitation, level, extrapolate, harmonics, samples)
    shaken = ExcitedMass(system, equilibrium, excitation, level, balance)
    linear = partial(linear_motion, balance, np.array([equilibrium.stiffness]), np.zeros(1))
    motions = list(follow(balance, linear, 2.0 * np.pi * band))
    _check_range(shaken, motions)
    motions = refine_peak(balance, motions, shaken.transmissibility)
    if resolve:
        peak = motions[int(np.argmax(shaken.transmissibility(motions)))]
        motions = refine_superharmonics(balance, motions, _strokes, _SUPERHARMONIC * peak.omega)
    _check_range(shaken, motions)
    columns = shaken.columns(motions)
    return FrequencyResponse(excitation, level, columns, _resonance(system, columns), equilibrium.frequency)


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


def _strokes(motions: Sequence[SteadyMotion]) -> FloatArray:
    """Stroke of a spring in each motion, shape (P,) [m]."""
    return np.array([motion.motion.high[0] - motion.motion.low[0] for motion in motions])


def _check_range(shaken: ExcitedMass, motions: Sequence[SteadyMotion]) -> None:
    """Refuse motions that leave the identified range."""
    beyond = first_beyond(shaken.balance, motions)
    if beyond is not None:
        p, motion = shaken.system.spring, beyond[0].motion
        raise IsolationError(
            f"At {beyond[0].omega / (2.0 * np.pi):.4g} Hz and a level of {shaken.balance.level_text} the spring moves "
            f"from {1e3 * motion.low[0]:.4g} to {1e3 * motion.high[0]:.4g} mm, outside the identified range of "
            f"{1e3 * p.displacement_min:.4g} to {1e3 * p.displacement_max:.4g} mm; use a lower level, more "
            "springs, or a model identified over a larger range."
        )


def _resonance(system: IsolatedMass, columns: Mapping[str, NDArray[Any]]) -> Resonance:
    frequency, ratio = columns["frequency"], columns["transmissibility"]
    peak = int(np.argmax(ratio))
    figures = steady_loop(PathSolver(system.spring), float(columns["min"][peak]), float(columns["max"][peak])).figures
    omega = 2.0 * math.pi * float(frequency[peak])
    slow, branches = system.mount.stiffness_scale * figures.secant_stiffness, branch_stiffness(system, omega)
    stiffness = slow + branches.real
    viscous = (omega * system.mount.damping + branches.imag) / stiffness
    return Resonance(
        frequency=float(frequency[peak]),
        transmissibility=float(ratio[peak]),
        amplitude=float(columns["amplitude"][peak]),
        stiffness=stiffness,
        loss_factor=figures.loss_factor * (slow / stiffness) + viscous,
        isolation_frequency=isolation_frequency(frequency, ratio),
        inside=0 < peak < ratio.size - 1,
    )


def isolation_frequency(frequency: FloatArray, ratio: FloatArray) -> float:
    """Where the transmissibility falls below 1 for good [Hz]; NaN if it does nowhere.

    Parameters
    ----------
    frequency, ratio : ndarray, shape (P,)   Points of a curve in its order [Hz], [-].
    """
    above = np.flatnonzero(~(ratio < 1.0))
    if above.size == 0:
        return float(frequency[0])
    last = int(above[-1])
    if last + 1 == ratio.size:
        return math.nan
    # Above the resonance of a mass on a plain spring 1/ratio is (frequency/resonance)^2 - 1.
    low, high = frequency[last] ** 2, frequency[last + 1] ** 2
    share = (1.0 - 1.0 / ratio[last]) / (1.0 / ratio[last + 1] - 1.0 / ratio[last])
    return math.sqrt(low + share * (high - low))
