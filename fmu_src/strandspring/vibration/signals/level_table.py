"""Levels over frequency as standards give them: straight lines in logarithmic coordinates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray, floats

FREQUENCY_RANGE = (1e-6, 1e7)  # [Hz]
_LEVEL_RANGE = (1e-30, 1e30)


@dataclass(frozen=True)
class LevelTable:
    """Levels over frequency, with straight lines of log(level) over log(frequency) between the points.

    A power spectral density is one-sided and 0 outside the table.

    Parameters
    ----------
    points : tuple of (float, float)      Rising frequencies [Hz], each with its level > 0; two or more.

    Raises
    ------
    MountedSystemError                    If the points are not of this kind.
    """

    points: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if len(self.points) < 2:
            raise MountedSystemError(f"A table of levels must have two points or more, got {len(self.points)}.")
        for number, (frequency, level) in enumerate(self.points, start=1):
            check_frequency(frequency, f"the frequency of point {number} of the table")
            if not _LEVEL_RANGE[0] <= level <= _LEVEL_RANGE[1]:
                raise MountedSystemError(
                    f"The level of point {number} of the table must be within [{_LEVEL_RANGE[0]:g}, "
                    f"{_LEVEL_RANGE[1]:g}], got {level!r}; end the table where nothing is asked for."
                )
        for number, (before, after) in enumerate(pairwise(self.points), start=2):
            if not after[0] > before[0]:
                raise MountedSystemError(
                    f"The frequencies of a table must rise, but point {number} at {after[0]:g} Hz follows "
                    f"{before[0]:g} Hz; sort them, and put a jump between two close frequencies."
                )

    @property
    def lowest(self) -> float:
        """Where the table begins [Hz]."""
        return self.points[0][0]

    @property
    def highest(self) -> float:
        """Where the table ends [Hz]."""
        return self.points[-1][0]

    @property
    def root_mean_square(self) -> float:
        """Of a signal with this power spectral density."""
        return math.sqrt(float(self.by_band([self.lowest, self.highest])[0]))

    def at(self, frequency: ArrayLike) -> FloatArray:
        """The level at each frequency [Hz], 0 outside the table."""
        frequencies = floats(frequency)
        x, y = np.log(np.array(self.points)).T
        inside = (frequencies >= self.lowest) & (frequencies <= self.highest)
        return np.where(inside, np.exp(np.interp(np.log(np.where(inside, frequencies, self.lowest)), x, y)), 0.0)

    def by_band(self, edges: ArrayLike) -> FloatArray:
        """Integral of the level over each of the bands between rising edges [Hz], shape (E - 1,), in closed form."""
        f, g = np.array(self.points).T
        slope = np.diff(np.log(g)) / np.diff(np.log(f))
        bounds = np.clip(floats(edges), self.lowest, self.highest)
        cuts = np.sort(np.concatenate([bounds, f]))
        left, right = cuts[:-1], cuts[1:]
        piece = np.minimum(np.searchsorted(f, left, side="right") - 1, slope.size - 1)
        area = _area(left, g[piece] * (left / f[piece]) ** slope[piece], slope[piece], right)
        band = np.searchsorted(bounds, left, side="right") - 1
        within = (band >= 0) & (band < bounds.size - 1)
        return floats(np.bincount(band[within], weights=area[within], minlength=bounds.size - 1))


def _area(f: FloatArray, g: FloatArray, slope: FloatArray, end: FloatArray) -> FloatArray:
    """Integral from f to end of g*(x/f)^slope, in a form that holds for slope = -1 too."""
    way = np.log(end / f)
    exponent = (slope + 1.0) * way
    safe = np.where(exponent == 0.0, 1.0, exponent)
    return floats(f * g * way * np.where(exponent == 0.0, 1.0, np.expm1(safe) / safe))


@dataclass(frozen=True)
class Slope:
    """A straight line in logarithmic coordinates, as standards state it.

    Parameters
    ----------
    decibels : float       Per octave.
    """

    decibels: float


def with_slopes(
    rows: Sequence[tuple[float, float | Slope]], decibels_per_decade: float
) -> tuple[tuple[float, float], ...]:
    """Points of which some are given by the slope that leads to them.

    Before the first level a slope is that up to the next row, after the last level that from the row before.

    Parameters
    ----------
    rows : sequence of (float, float or Slope)   Frequencies [Hz], each with a level or a slope.
    decibels_per_decade : float                  Of a tenfold level: 10 of a density, 20 of an amplitude.

    Raises
    ------
    MountedSystemError                           If no row has a level, or one between levels has a slope.
    """
    levels = [None if isinstance(level, Slope) else level for _, level in rows]
    known = [number for number, level in enumerate(levels) if level is not None]
    if not known:
        raise MountedSystemError("must have a level in one row or more, got slopes in dB/oct only")
    first, last = known[0], known[-1]

    def stepped(number: int, neighbour: int, slope: float | Slope) -> float:
        """The level of a row on a line through that of its neighbour."""
        low, high, level = rows[number][0], rows[neighbour][0], levels[neighbour]
        if not (isinstance(slope, Slope) and level is not None and min(low, high) > 0.0):
            raise MountedSystemError(
                "must have slopes in dB/oct before the first level or after the last one only, at frequencies > 0, "
                f"but entry {number + 1} has one; give its level"
            )
        exponent = slope.decibels * math.log2(low / high) / decibels_per_decade
        return level * math.pow(10.0, min(max(exponent, -300.0), 300.0))

    for number in range(last + 1, len(rows)):
        levels[number] = stepped(number, number - 1, rows[number][1])
    for number in range(first - 1, -1, -1):
        levels[number] = stepped(number, number + 1, rows[number][1])
    return tuple(
        (frequency, stepped(number, number, given) if level is None else level)
        for number, ((frequency, given), level) in enumerate(zip(rows, levels, strict=True))
    )


def displacement_limited(displacement: float, acceleration: float, low: float, high: float) -> LevelTable:
    """Amplitude of a sine test [m/s^2]: of constant displacement up to the crossover, of constant acceleration above.

    Parameters
    ----------
    displacement : float      Amplitude (half of peak to peak) [m].
    acceleration : float      Amplitude [m/s^2].
    low, high : float         Where the test begins and ends [Hz].
    """
    for name, value in (("displacement", displacement), ("acceleration", acceleration)):
        if not (math.isfinite(value) and value > 0.0):
            raise MountedSystemError(f"The amplitude of {name} must be finite and > 0, got {value!r}.")
    crossover = math.sqrt(acceleration / displacement) / (2.0 * math.pi)
    frequencies: Sequence[float] = (low, high)
    if low < crossover < high:
        frequencies = (low, crossover, high)
    amplitudes = (min(acceleration, (2.0 * math.pi * f) ** 2 * displacement) for f in frequencies)
    return LevelTable(tuple(zip(frequencies, amplitudes, strict=True)))


def check_frequency(value: float, name: str) -> None:
    """Refuse what is no frequency."""
    if not FREQUENCY_RANGE[0] <= value <= FREQUENCY_RANGE[1]:
        raise MountedSystemError(
            f"{name[0].upper()}{name[1:]} must be within [{FREQUENCY_RANGE[0]:g}, {FREQUENCY_RANGE[1]:g}] Hz, "
            f"got {value!r}."
        )
