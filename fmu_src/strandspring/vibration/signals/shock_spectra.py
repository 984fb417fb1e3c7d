"""Shock response spectra: the largest responses of oscillators to an acceleration, over their natural frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray, floats
from ...kernel.shock import largest_responses, straight_pieces
from .averaging import LARGEST_SIGNAL, check_interval
from .level_table import FREQUENCY_RANGE, LevelTable

# Natural frequency times sampling interval. A signal that is straight between its samples has lost a share
# 1 - sinc(f*dt)^2 of what it holds at f, 19 %. An extremum of the response between two samples is that of a cubic, with
# an error up to (2*pi*f*dt)^4/384, 1.6 %.
_COARSEST = 0.25
MOST_FREQUENCIES = 100_000
QUALITY_RANGE = (0.5, 1000.0)


@dataclass(frozen=True, eq=False)
class ShockSpectrum:
    """Largest absolute accelerations of oscillators that are at rest before [m/s^2].

    Parameters
    ----------
    frequency : ndarray, shape (F,)    Natural frequencies [Hz].
    extrema : ndarray, shape (4, F)    Largest and smallest response during the samples, and likewise after them.
    """

    frequency: FloatArray
    extrema: FloatArray

    @property
    def maximax(self) -> FloatArray:
        """Largest magnitude, shape (F,)."""
        return np.asarray(np.abs(self.extrema).max(axis=0))


@dataclass(frozen=True)
class RequiredSpectrum:
    """A shock response spectrum that is asked for, as a load or as a limit.

    Parameters
    ----------
    levels : LevelTable      Largest magnitudes of the oscillators' accelerations [m/s^2].
    quality : float          Quality factor Q of the oscillators; their damping is 1/(2*Q) of critical.

    Raises
    ------
    MountedSystemError       If the quality factor is out of its bounds.
    """

    levels: LevelTable
    quality: float = 10.0

    def __post_init__(self) -> None:
        if not QUALITY_RANGE[0] < self.quality <= QUALITY_RANGE[1]:
            raise MountedSystemError(
                f"The quality factor Q of a shock response spectrum must be above {QUALITY_RANGE[0]:g} and at most "
                f"{QUALITY_RANGE[1]:g}, got {self.quality!r}; with a damping ratio zeta it is 1/(2*zeta)."
            )

    @property
    def damping(self) -> float:
        """Share of critical damping."""
        return 0.5 / self.quality

    def frequencies(self, per_octave: int = 12) -> FloatArray:
        """From the first to the last of its frequencies at equal ratios, shape (F,) [Hz]."""
        return octave_frequencies(self.levels.lowest, self.levels.highest, per_octave)

    def excess(self, samples: ArrayLike, interval: float, per_octave: int = 12) -> FloatArray:
        """By how much the spectrum of an acceleration is above this one at `frequencies`, shape (F,) [dB]."""
        frequency = self.frequencies(per_octave)
        maximax = shock_spectrum(samples, interval, frequency, self.damping).maximax
        with np.errstate(divide="ignore"):
            return floats(20.0 * np.log10(maximax / self.at(frequency)))

    def at(self, frequency: ArrayLike) -> FloatArray:
        """The level at each frequency, beyond the table that of its nearer end [m/s^2]."""
        return self.levels.at(np.clip(floats(frequency), self.levels.lowest, self.levels.highest))


def shock_spectrum(
    samples: ArrayLike,
    interval: float,
    frequency: ArrayLike,
    damping: float = 0.05,
) -> ShockSpectrum:
    """Shock response spectrum of an acceleration, straight between its samples and 0 after the last.

    Parameters
    ----------
    samples : array_like, shape (K,)      Acceleration [m/s^2], K >= 2.
    interval : float                      Between two samples [s].
    frequency : array_like, shape (F,)    Natural frequencies of the oscillators [Hz].
    damping : float                       Share of critical damping, >= 0 and < 1; 0.05 is a quality factor of 10.

    Raises
    ------
    MountedSystemError                    If an argument is out of its bounds, or the samples are too coarse for a
                                          frequency.
    """
    x, f = floats(samples), np.atleast_1d(floats(frequency))
    _check(x, interval, f, damping)
    return ShockSpectrum(f, largest_responses(straight_pieces(x), 2.0 * np.pi * f * interval, damping).T)


def octave_frequencies(low: float, high: float, per_octave: int = 12) -> FloatArray:
    """Frequencies from low to high at equal ratios, at least `per_octave` in an octave, shape (F,) [Hz]."""
    if not 0.0 < low < high < math.inf:
        raise MountedSystemError(f"A range of frequencies must rise from > 0 [Hz], got {low!r} to {high!r}.")
    intervals = max(1, math.ceil(per_octave * math.log2(high / low) * (1.0 - 1e-12)))
    if not (per_octave >= 1 and intervals < MOST_FREQUENCIES):
        raise MountedSystemError(
            f"There must be 1 frequency per octave or more and at most {MOST_FREQUENCIES:,} in all, got {per_octave!r} "
            f"per octave from {low:g} to {high:g} Hz."
        )
    return np.geomspace(low, high, intervals + 1)


def _check(samples: FloatArray, interval: float, frequency: FloatArray, damping: float) -> None:
    if samples.ndim != 1 or samples.size < 2 or not np.all(np.abs(samples) <= LARGEST_SIGNAL):
        raise MountedSystemError(
            f"A shock response spectrum needs two samples or more, finite and within +-{LARGEST_SIGNAL:g} m/s^2."
        )
    check_interval(interval)
    if not 0.0 <= damping < 1.0:
        raise MountedSystemError(
            f"The damping of a shock response spectrum must be a share of critical damping within [0, 1), got "
            f"{damping!r}; a quality factor Q is 1/(2*Q)."
        )
    if (
        frequency.ndim != 1
        or not 1 <= frequency.size <= MOST_FREQUENCIES
        or not np.all(frequency >= FREQUENCY_RANGE[0])
    ):
        raise MountedSystemError(
            f"A shock response spectrum needs 1 to {MOST_FREQUENCIES:,} natural frequencies in a row, each >= "
            f"{FREQUENCY_RANGE[0]:g} Hz."
        )
    highest = float(frequency.max())
    if not highest * interval <= _COARSEST:
        raise MountedSystemError(
            f"A natural frequency of {highest:g} Hz is beyond a quarter of the sampling rate of {1.0 / interval:g} Hz; "
            f"end the spectrum at {_COARSEST / interval:g} Hz or sample faster."
        )
