"""Sinusoidal base motion: dwells and sweeps, with their averages over time steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray, floats
from .averaging import check_duration, check_level, smooth_averages
from .level_table import LevelTable, check_frequency


@dataclass(frozen=True)
class SineDwell:
    """amplitude*sin(2*pi*frequency*t) for the duration, after a soft start if asked.

    During the soft start the amplitude rises by (1 - cos(pi*t/soft_start))/2.

    Parameters
    ----------
    amplitude : float      [m/s^2] or [N].
    frequency : float      [Hz]
    duration : float       The soft start included [s].
    soft_start : float     [s]

    Raises
    ------
    MountedSystemError     If a value is out of its bounds.
    """

    amplitude: float
    frequency: float
    duration: float
    soft_start: float = 0.0

    def __post_init__(self) -> None:
        check_level(self.amplitude, "amplitude")
        check_frequency(self.frequency, "the frequency of a sine dwell")
        check_duration(self.duration, "duration")
        if self.soft_start != 0.0:
            check_duration(self.soft_start, "soft_start")
        if not self.soft_start <= self.duration:
            raise MountedSystemError(
                f"`soft_start` must be at most {self.duration:g} s, the duration of the dwell, got {self.soft_start!r}."
            )

    @property
    def shortest(self) -> float:
        """Half a period [s]."""
        return 0.5 / self.frequency

    def at(self, time: ArrayLike) -> FloatArray:
        """Its value at each time [s]."""
        times = floats(time)
        envelope = np.where((times >= 0.0) & (times <= self.duration), self.amplitude, 0.0)
        if self.soft_start > 0.0:
            share = np.clip(times / self.soft_start, 0.0, 1.0)
            envelope = envelope * np.sin(0.5 * np.pi * share) ** 2
        return floats(envelope * np.sin(2.0 * np.pi * self.frequency * times))

    def averages(self, step: float, count: int) -> FloatArray:
        """Its mean over each of `count` steps, shape (count,)."""
        rate = 2.0 * math.pi * self.frequency
        if self.soft_start > 0.0:
            rate += math.pi / max(self.soft_start, step)
        return smooth_averages(self.at, rate, np.array([self.soft_start, self.duration]), step, count)


@dataclass(frozen=True)
class SineSweep:
    """A sine whose frequency goes from the first to the last, at a constant rate in octaves or in hertz per time.

    Parameters
    ----------
    first, last : float           Frequencies at its beginning and end [Hz]; downwards if the last is the lower.
    duration : float              [s]
    amplitude : LevelTable        Over frequency [m/s^2] or [N]; it must cover the sweep.
    is_logarithmic : bool         Whether the rate is constant in octaves per time.

    Raises
    ------
    MountedSystemError            If a value is out of its bounds.
    """

    first: float
    last: float
    duration: float
    amplitude: LevelTable
    is_logarithmic: bool = True

    def __post_init__(self) -> None:
        check_frequency(self.first, "the first frequency of a sweep")
        check_frequency(self.last, "the last frequency of a sweep")
        check_duration(self.duration, "duration")
        low, high = sorted((self.first, self.last))
        if not low < high:
            raise MountedSystemError(f"A sweep must end at another frequency than its first, {low:g} Hz; use a dwell.")
        if not (self.amplitude.lowest <= low and high <= self.amplitude.highest):
            raise MountedSystemError(
                f"The table of amplitudes must cover the sweep from {low:g} to {high:g} Hz, but covers "
                f"{self.amplitude.lowest:g} to {self.amplitude.highest:g} Hz."
            )

    @classmethod
    def at_octaves_per_minute(cls, first: float, last: float, rate: float, amplitude: LevelTable) -> SineSweep:
        """A logarithmic sweep at a rate > 0 [octave/min]."""
        return cls(first, last, 60.0 * abs(math.log2(_ratio(first, last))) / _positive(rate), amplitude)

    @classmethod
    def at_hertz_per_second(cls, first: float, last: float, rate: float, amplitude: LevelTable) -> SineSweep:
        """A linear sweep at a rate > 0 [Hz/s]."""
        return cls(first, last, abs(last - first) / _positive(rate), amplitude, is_logarithmic=False)

    @property
    def shortest(self) -> float:
        """Half a period of its highest frequency [s]."""
        return 0.5 / max(self.first, self.last)

    def frequency(self, time: ArrayLike) -> FloatArray:
        """Its frequency at each time within the duration [Hz]."""
        share = floats(time) / self.duration
        if self.is_logarithmic:
            return floats(self.first * np.exp(math.log(self.last / self.first) * share))
        return floats(self.first + (self.last - self.first) * share)

    def time(self, frequency: ArrayLike) -> FloatArray:
        """When it is at each frequency between the first and the last [s]."""
        frequencies = floats(frequency)
        if self.is_logarithmic:
            return floats(self.duration * np.log(frequencies / self.first) / math.log(self.last / self.first))
        return floats(self.duration * (frequencies - self.first) / (self.last - self.first))

    def phase(self, time: ArrayLike) -> FloatArray:
        """2*pi times the integral of the frequency [rad]."""
        times = floats(time)
        if self.is_logarithmic:
            octaves = math.log(self.last / self.first)
            cycles = self.first * self.duration / octaves * np.expm1(octaves * times / self.duration)
        else:
            cycles = times * (self.first + 0.5 * (self.last - self.first) * times / self.duration)
        return floats(2.0 * np.pi * cycles)

    def at(self, time: ArrayLike) -> FloatArray:
        """Its value at each time [s]."""
        times = floats(time)
        inside = (times >= 0.0) & (times <= self.duration)
        within = np.clip(times, 0.0, self.duration)
        low, high = sorted((self.first, self.last))
        amplitude = self.amplitude.at(np.clip(self.frequency(within), low, high))
        return np.where(inside, amplitude * np.sin(self.phase(within)), 0.0)

    def averages(self, step: float, count: int) -> FloatArray:
        """Its mean over each of `count` steps, shape (count,)."""
        low, high = sorted((self.first, self.last))
        bends = self.time([f for f, _ in self.amplitude.points if low < f < high])
        return smooth_averages(self.at, 2.0 * math.pi * high, np.append(bends, self.duration), step, count)


def _ratio(first: float, last: float) -> float:
    check_frequency(first, "the first frequency of a sweep")
    check_frequency(last, "the last frequency of a sweep")
    return last / first


def _positive(rate: float) -> float:
    if not (math.isfinite(rate) and rate > 0.0):
        raise MountedSystemError(
            f"The rate of a sweep must be finite and > 0, got {rate!r}; a last frequency below the first sweeps down."
        )
    return rate
