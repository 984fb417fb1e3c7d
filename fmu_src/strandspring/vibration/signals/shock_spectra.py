"""Shock response spectra: the largest responses of oscillators to an acceleration, over their natural frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray, floats
from ...kernel.shock import largest_responses, response_bounds, smooth_pieces, straight_pieces
from .averaging import LARGEST_SIGNAL, check_interval
from .level_table import FREQUENCY_RANGE, LevelTable

# Natural frequency times sampling interval. A signal that is straight between its samples has lost a share
# 1 - sinc(f*dt)^2 of what it holds at f, 19 %. An extremum of the response between two samples is that of a cubic, with
# an error up to (2*pi*f*dt)^4/384, 1.6 %.
_COARSEST = 0.25
MOST_FREQUENCIES = 100_000
_LEAST_PER_OCTAVE, _MOST_PER_OCTAVE, _PER_QUALITY = 12, 48, 1.2  # that are compared first
_SPARSE = 4  # of them one in so many is compared at the very first
_SAME, _NOTHING = 1e-9, 1e-200  # share of a frequency; level [m/s^2]
_CERTAIN = 5e-4  # of a maximum over frequency
_BULGE = 0.5  # of a second difference over half an interval: an eighth of a parabola, up to a half of a resonance
_MOST_HALVINGS = 16  # of the distance of frequencies
# Of a share of an allowed spectrum: of its maximum over frequency, and of an extremum between two parts of a step.
SHARE_ERROR = 1e-3
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

    @property
    def frequencies(self) -> FloatArray:
        """Those that are compared first: of its table, and between them at equal ratios, shape (F,) [Hz]."""
        per_octave = min(_MOST_PER_OCTAVE, max(_LEAST_PER_OCTAVE, math.ceil(_PER_QUALITY * self.quality)))
        return table_frequencies(self.levels, per_octave)

    def share(self, before: FloatArray, after: FloatArray, interval: float) -> float:
        """The largest share of it that the spectra of accelerations take, over all frequencies; of the values before
        and after each sample, shape (K, N).
        """
        largest, frequency, sizes = -math.inf, self.frequencies, np.maximum(abs(before), abs(after)).max(axis=0)
        least = min(level for _, level in self.levels.points) * self.damping * math.sqrt(1.0 - self.damping**2)
        for axis in np.argsort(-sizes):
            # What no oscillator exceeds; cubics rise above samples.
            if 2.0 * sizes[axis] <= math.exp(largest) * least:
                break
            pieces = smooth_pieces(before[:, axis], after[:, axis])
            bounds = response_bounds(pieces, 2.0 * np.pi * interval * frequency, self.damping)
            possible = np.log(np.maximum(bounds, _NOTHING) / self.at(frequency))
            largest = self._largest_excess(pieces, interval, frequency, possible, largest)
        return math.exp(largest)

    def deviation(self, samples: ArrayLike, interval: float) -> tuple[float, float]:
        """By how much the spectrum of an acceleration, straight between its samples, is below and above this one at
        most, over all frequencies [dB].
        """
        frequency, pieces = table_frequencies(self.levels, _MOST_PER_OCTAVE), straight_pieces(floats(samples))
        unbounded, decibels = np.full(frequency.size, np.inf), 20.0 * math.log10(math.e)
        below, above = (self._largest_excess(pieces, interval, frequency, unbounded, sign=k) for k in (-1.0, 1.0))
        return -decibels * below, decibels * above

    def _largest_excess(
        self, pieces: FloatArray, interval: float, frequency: FloatArray, possible: FloatArray,
        largest: float = -math.inf, sign: float = 1.0,
    ) -> float:  # fmt: skip
        """The largest of sign*log(spectrum/level) over all frequencies and of `largest`, with upper bounds `possible`
        at those that are compared first, shape (F,), all corners of the levels among them.

        Between two frequencies it rises above both by what a resonance does that lies midway, or by what its second
        difference tells; where the maximum may be, that interval is halved.
        """
        table = np.log(np.array(self.levels.points)).T

        def excess(place: FloatArray) -> FloatArray:
            extrema = largest_responses(pieces, 2.0 * np.pi * interval * np.exp(place), self.damping)
            maximax = np.maximum(np.abs(extrema).max(axis=1), _NOTHING)
            return floats(sign * (np.log(maximax) - np.interp(place, *table)))

        grid, found, is_sparse = np.log(frequency), possible.copy(), np.arange(frequency.size) % _SPARSE == 0
        for part in (is_sparse, ~is_sparse):
            chosen = part & (possible > largest)
            found[chosen] = excess(grid[chosen])
            largest = float(found[chosen].max(initial=largest))
        low, high, at_low, at_high = grid[:-1], grid[1:], found[:-1], found[1:]
        bulge = 0.5 * np.log1p((self.quality * (high - low)) ** 2)
        reach = np.minimum(np.maximum(at_low, at_high) + bulge, np.maximum(possible[:-1], possible[1:]))
        for _ in range(_MOST_HALVINGS):
            wide = reach > largest + _CERTAIN
            if not wide.any():
                break
            low, high, at_low, at_high = low[wide], high[wide], at_low[wide], at_high[wide]
            middle = 0.5 * (low + high)
            at_middle = excess(middle)
            largest = max(largest, float(at_middle.max()))
            bulge = np.tile(_BULGE * np.maximum(2.0 * at_middle - at_low - at_high, 0.0), 2)
            low, high = np.append(low, middle), np.append(middle, high)
            at_low, at_high = np.append(at_low, at_middle), np.append(at_middle, at_high)
            reach = np.maximum(at_low, at_high) + bulge
        return largest

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


@lru_cache(maxsize=64)
def table_frequencies(levels: LevelTable, per_octave: int) -> FloatArray:
    """Those of a table, and between them others at equal ratios, shape (F,) [Hz]."""
    given, even = np.array(levels.points)[:, 0], octave_frequencies(levels.lowest, levels.highest, per_octave)
    nearest = np.abs(np.log(even[:, None] / given)).min(axis=1)
    return np.unique(np.append(given, even[nearest > _SAME]))


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
