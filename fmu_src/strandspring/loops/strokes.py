"""Strokes of a measured path, from one reversal to the next, and the noise of sampled signals that could hide them.

The noise is estimated from what differences over a few samples cannot be of the signal itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..kernel.arrays import FloatArray, IndexArray, IntArray

# Least stroke of a path without noise, share of its range: sensors jump, and so small a loop dissipates almost nothing.
LEAST_STROKE = 0.02
# Standard deviations of white noise, which a million samples do not span: more is motion.
NOISE_SPAN = 12.0
FEWEST_SAMPLES = 16  # that can show a loop
_ENOUGH = 9  # differences from which noise is estimated


def turning_points(displacement: FloatArray, threshold: float) -> IndexArray:
    """First sample, reversals of at least `threshold` [m], last sample.

    The smallest swings are removed until none is below the threshold, as in rainflow counting: within the path both
    ends of a swing, at the start or the end of the path the outer one.
    """
    signs = np.sign(np.diff(displacement))
    moving = np.flatnonzero(signs)
    turns = moving[np.flatnonzero(np.diff(signs[moving])) + 1]
    points = np.concatenate([[0], turns, [displacement.size - 1]])
    while points.size > 2:
        span = np.pad(np.abs(np.diff(displacement[points])), 1, constant_values=np.inf)
        # Local minima only, so that no two neighbours are removed at once and the larger swing always remains.
        small = (span[1:-1] < threshold) & (span[1:-1] <= span[:-2]) & (span[1:-1] < span[2:])
        if not small.any():
            break
        keep = ~(np.append(small, False) | np.append(False, small))
        keep[1] |= small[0]
        keep[-2] |= small[-1]
        points = points[keep]
    points[[0, -1]] = 0, displacement.size - 1
    return points


@dataclass(eq=False)
class Strokes:
    """A path of K samples cut at its S - 1 reversals."""

    path: FloatArray  # as recorded, shape (K,) [m]
    turning: IndexArray  # first sample, reversals, last sample, shape (S + 1,)

    @property
    def count(self) -> int:
        """Number of strokes S."""
        return self.turning.size - 1

    @cached_property
    def ends(self) -> FloatArray:
        """Displacement at the start of the path, its reversals and its end, shape (S + 1,) [m]."""
        return self.path[self.turning]

    @cached_property
    def length(self) -> FloatArray:
        """Length of each stroke, shape (S,) [m]."""
        return np.abs(np.diff(self.ends))

    @cached_property
    def direction(self) -> IntArray:
        """+1 loading, -1 unloading, shape (S,)."""
        return np.where(np.diff(self.ends) >= 0.0, 1, -1)

    @cached_property
    def of_sample(self) -> IndexArray:
        """Stroke that leads to each sample, shape (K,)."""
        return np.searchsorted(self.turning[1:-1], np.arange(self.path.size), side="left")


def find_strokes(displacement: FloatArray) -> Strokes:
    """Cut a path [m] at its reversals beyond the noise."""
    least = max(NOISE_SPAN * path_noise(displacement), LEAST_STROKE * float(np.ptp(displacement)))
    return Strokes(displacement, turning_points(displacement, least))


def noise_level(values: FloatArray, turns: Sequence[int] | IndexArray = ()) -> float:
    """Standard deviation of white noise on a signal, from the median of its fourth differences.

    The fourth difference of white noise of variance s^2 has variance 70*s^2; that of a sine with 20 samples per cycle
    is 0.1 % of its amplitude. If many reach across bends, those that do not are used, or third or second differences,
    more of which do not, if the estimate from these is less. `turns` are samples at or next to which the signal bends
    sharply, such as reversals.
    """
    if values.size < _ENOUGH:
        return 0.0
    level = _level_of(np.diff(values, 4), 4)
    for order in (4, 3, 2):
        differences = np.diff(values, order)
        places = (np.asarray(turns, np.intp)[:, None] - np.arange(order + 1)).ravel()
        across = np.unique(places[(places >= 0) & (places < differences.size)])
        if across.size <= 0.1 * differences.size:  # which hardly moves the median
            break
        if differences.size - across.size >= _ENOUGH:
            return min(level, _level_of(np.delete(differences, across), order))
    return level


def _level_of(differences: FloatArray, order: int) -> float:
    """Standard deviation of white noise from the median of its differences of an order."""
    return float(np.median(np.abs(differences))) / (0.6745 * math.sqrt(math.comb(2 * order, order)))


def path_noise(displacement: FloatArray) -> float:
    """`noise_level` of a path [m]; 0 where it is negligible, or of a path that bends from sample to sample."""
    span, level = float(np.ptp(displacement)), noise_level(displacement)
    # Loops are known far worse than to a ten-thousandth of the range.
    if level <= 1e-4 * span:
        return 0.0
    level = noise_level(displacement, turning_points(displacement, LEAST_STROKE * span)[1:-1])
    # Sixth differences of white noise tell the same as fourth ones; those of a path of 12 samples per cycle less.
    is_white = level > 1e-4 * span and _level_of(np.diff(displacement, 6), 6) >= 0.7 * level
    return level if is_white else 0.0
