"""Stationary Gaussian random vibration with a given power spectral density.

x(t) = sum of a_k*cos(2*pi*k*t/T) + b_k*sin(2*pi*k*t/T), with independent Gaussian a_k, b_k whose variance is the
integral of the density over the k-th band, of the width 1/T; T is a little longer than the duration. The sum is taken
at ten times the highest frequency, and the signal is straight between these samples. That would lower the density by
the factor sinc(f*dt)^4, by up to 6.4 %, so each term is divided by sinc(f*dt)^2: up to the highest frequency the
density is the one asked for. What the straight lines add above, near multiples of the sampling rate, is less than 3e-4
of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike
from scipy.fft import irfft, next_fast_len

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from .averaging import StraightPieces, check_duration
from .level_table import LevelTable

_SAMPLES_PER_PERIOD = 10  # of the highest frequency
MOST_SAMPLES = 20_000_000
_MOST_KEPT = 6  # signals at a time: a run asks twice for those of its channels


@dataclass(frozen=True)
class RandomVibration:
    """Gaussian random vibration; the same seed gives the same signal whatever the time step.

    Parameters
    ----------
    density : LevelTable       One-sided power spectral density [(m/s^2)^2/Hz] or [N^2/Hz].
    duration : float           [s]; the signal is 0 after it.
    seed : int                 >= 0, of numpy's default generator.
    stream : int               >= 0; signals of one seed and different streams are independent.

    Raises
    ------
    MountedSystemError         If the duration is shorter than a period of the lowest frequency or too long to sample.
    """

    density: LevelTable
    duration: float
    seed: int
    stream: int = 0

    def __post_init__(self) -> None:
        check_duration(self.duration, "duration")
        if self.seed < 0:
            raise MountedSystemError(f"`seed` must be an integer >= 0, got {self.seed!r}.")
        if self.duration * self.density.lowest < 1.0:
            raise MountedSystemError(
                f"A random vibration from {self.density.lowest:g} Hz on must last {1.0 / self.density.lowest:g} s or "
                f"more, got {self.duration:g} s; lengthen it or begin its density at a higher frequency."
            )
        if self.duration > MOST_SAMPLES * self._interval:
            raise MountedSystemError(
                f"A random vibration up to {self.density.highest:g} Hz may last {MOST_SAMPLES * self._interval:g} s "
                f"({MOST_SAMPLES} samples), got {self.duration:g} s; shorten it, the statistics need no more."
            )

    def redrawn(self, seed: int, number: int) -> RandomVibration:
        """Another realisation; the same seed and number give the same."""
        words = np.random.SeedSequence((self.seed, number, seed)).generate_state(1, np.uint64)
        return replace(self, seed=int(words[0]))

    @property
    def _interval(self) -> float:
        return 1.0 / (_SAMPLES_PER_PERIOD * self.density.highest)

    @property
    def shortest(self) -> float:
        """Half a period of its highest frequency [s]."""
        return 0.5 / self.density.highest

    def at(self, time: ArrayLike) -> FloatArray:
        """Its value at each time [s]."""
        return _pieces(self).at(time)

    def averages(self, step: float, count: int) -> FloatArray:
        """Its mean over each of `count` steps, shape (count,)."""
        return _pieces(self).averages(step, count)

    def pieces(self) -> StraightPieces:
        """The signal as straight pieces."""
        samples = 1 + math.ceil(self.duration / self._interval)
        period = next_fast_len(samples, real=True)
        width = 1.0 / (period * self._interval)
        bands = 1 + math.ceil(self.density.highest / width)
        edges = width * (np.arange(bands + 1) - 0.5)
        variance = self.density.by_band(edges)
        interpolation = np.sinc(np.arange(bands) / period) ** 2
        # A term a*cos + b*sin is the coefficient period/2*(a - ib) of the discrete transform.
        scale = 0.5 * period * np.sqrt(variance) / interpolation
        seeds = [self.seed, self.stream] if self.stream else self.seed
        drawn = np.random.default_rng(seeds).standard_normal((bands, 2))
        spectrum = np.zeros(period // 2 + 1, dtype=np.complex128)
        spectrum[1:bands] = (scale * (drawn[:, 0] - 1j * drawn[:, 1]))[1:]
        values = irfft(spectrum, n=period)[:samples]
        times = self._interval * np.arange(samples)
        last = values[-2] + (values[-1] - values[-2]) * (self.duration - times[-2]) / self._interval
        return StraightPieces(np.append(times[:-1], self.duration), np.append(values[:-1], last))


@lru_cache(maxsize=_MOST_KEPT)
def _pieces(vibration: RandomVibration) -> StraightPieces:
    return vibration.pieces()
