"""Reversals and strokes of a measured path, separated from noise.

A stroke is the path between two consecutive reversals. Reversals below a threshold are noise: the smallest are removed
in pairs until none is below it, as in rainflow counting.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..kernel.arrays import FloatArray
from .noise_levels import is_white_noise, least_reversal, path_noise_level
from .smooth_path import smooth_path
from .turning import turning_points

IndexArray = NDArray[np.intp]

# A reversal must exceed this many standard deviations of the displacement's noise (a million samples of white
# noise span 10 of them).
_NOISE_FACTOR = 12.0


@dataclass(frozen=True, eq=False)
class Strokes:
    """A path of K samples divided at its S - 1 reversals.

    Attributes
    ----------
    turning : ndarray of int, shape (S + 1,)    First sample, reversals, last sample.
    direction : ndarray of int, shape (S,)      +1 loading, -1 unloading.
    of_sample : ndarray of int, shape (K,)      Stroke that leads to each sample.
    displacement : ndarray, shape (K,)          The path, smoothed and made monotone within each stroke [m].
    travel : ndarray, shape (K,)                Distance from the reversal before each sample [m].
    noise : float                               Standard deviation of the white noise that was smoothed out [m].
    beyond : ndarray, shape (S + 1,), or None   How far the path goes on beyond the sample at each of `turning` [m];
                                                None if it turns at the samples.
    """

    turning: IndexArray
    direction: NDArray[np.int64]
    of_sample: IndexArray
    displacement: FloatArray
    travel: FloatArray
    noise: float
    beyond: FloatArray | None = None

    @property
    def count(self) -> int:
        """Number of strokes S."""
        return int(self.direction.size)

    @property
    def period(self) -> float:
        """Samples in a cycle, on average between the first reversal and the last; of the whole path without two."""
        inner = self.turning[1:-1] if self.count > 2 else self.turning
        return 2.0 * float(inner[-1] - inner[0]) / (inner.size - 1)

    @cached_property
    def turning_displacement(self) -> FloatArray:
        """Displacement at the start of the path, its reversals and its end, shape (S + 1,) [m]."""
        at_samples = self.displacement[self.turning]
        return at_samples if self.beyond is None else at_samples + np.append(0, self.direction) * self.beyond

    @cached_property
    def length(self) -> FloatArray:
        """Length of each stroke, shape (S,) [m]."""
        return np.abs(np.diff(self.turning_displacement))

    @cached_property
    def lost_at_reversals(self) -> float:
        """How far the displacement goes beyond the samples at reversals, as a share of a stroke; medians."""
        return float(np.median(self.beyond_samples()) / np.median(self.length)) if self.count > 1 else 0.0

    def beyond_samples(self, corners: bool = False) -> FloatArray:
        """How far the path goes on beyond the sample at each reversal, shape (S - 1,) [m].

        Parameters
        ----------
        corners : bool   Where straight lines through two samples on either side meet; else where a parabola through
                         the sample and its neighbours turns, at most an eighth of what the path bends there.
        """
        y, later = self._about_reversals()
        far, near, following = (np.where(later, y[2 + k], y[2 - k]) for k in (-1, 1, 2))
        rise, fall, bend = y[2] - far, near - following, 2.0 * y[2] - near - far
        if corners:
            share = np.clip(_quotient(near + fall - y[2], rise + fall), 0.0, 1.0)
            samples = np.diff(self.turning)
            return np.where(np.minimum(samples[:-1], samples[1:]) > 1, rise * share, 0.0)
        return _quotient((near - far) ** 2, 8.0 * bend)

    def turning_between_samples(self, corners: bool) -> Strokes:
        """The same strokes with reversals where these turn, before or after the samples that were taken for them."""
        beyond = np.concatenate([[0.0], self.beyond_samples(corners), [0.0]])
        _, later = self._about_reversals()
        of_sample, travel = self.of_sample.copy(), self.travel.copy()
        earlier = self.turning[1:-1][~later]
        of_sample[earlier] += 1
        travel[earlier] = 0.0
        return replace(self, of_sample=of_sample, travel=travel + beyond[of_sample], beyond=beyond)

    def _about_reversals(self) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Displacement at each reversal and two samples to either side, crests upwards, and whether it turns later."""
        top = self.turning[1:-1]
        at = np.clip(top + np.arange(-2, 3)[:, None], 0, self.displacement.size - 1)
        y = self.direction[:-1] * self.displacement[at]
        return y, y[3] >= y[1]


def _quotient(dividend: FloatArray, divisor: FloatArray) -> FloatArray:
    """dividend/divisor where the divisor is positive, else 0."""
    return np.divide(dividend, divisor, out=np.zeros(divisor.size), where=divisor > 0.0)


def find_strokes(displacement: FloatArray, threshold: float | None = None) -> Strokes:
    """Divide a measured path into strokes.

    Parameters
    ----------
    displacement : ndarray, shape (K,)   K >= 2 [m].
    threshold : float or None            Smallest reversal [m]; from the noise by default, which is then smoothed out.
    """
    noise = 0.0
    if threshold is None:
        level = path_noise_level(displacement)
        threshold = max(_NOISE_FACTOR * level, least_reversal(displacement))
        if is_white_noise(displacement, level):
            noise = level
            displacement = smooth_path(displacement, noise, threshold)
    turning = turning_points(displacement, threshold)
    ends = displacement[turning]
    direction = np.where(np.diff(ends) >= 0.0, 1, -1).astype(np.int64)
    samples = np.arange(displacement.size)
    of_sample = np.clip(np.searchsorted(turning, samples, side="left") - 1, 0, direction.size - 1)
    monotone = np.empty_like(displacement)
    for k, sign in enumerate(direction):
        piece = slice(turning[k], turning[k + 1] + 1)
        accumulate = np.maximum if sign > 0 else np.minimum
        monotone[piece] = accumulate.accumulate(displacement[piece])
    low, high = np.sort([ends[:-1], ends[1:]], axis=0)[:, of_sample]
    monotone = np.clip(monotone, low, high)
    travel = np.abs(monotone - ends[of_sample])
    return Strokes(turning, direction, of_sample, monotone, travel, noise)
