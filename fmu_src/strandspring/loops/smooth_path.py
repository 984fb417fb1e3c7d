"""The noise of a displacement removed by smoothing that stops where the path bends or jumps.

The smoothed path y minimises sum (y - x)^2 + lambda * sum (third differences of y)^2, which makes it quadratic on the
scale of lambda^(1/6) samples (Whittaker, 1923; Eilers, Anal. Chem. 75, 2003). Third differences across a break, as at
the reversals of a triangle, the ends of a dwell or a gap, are left out of the sum; where the path bends at a sample but
does not jump, both parts share that sample. On each part between breaks, lambda is that of the least estimated error
(Mallows' Cp), or a larger one if that is hardly worse.
"""

from __future__ import annotations

import math
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from ..kernel.arrays import FloatArray
from .turning import turning_points

_ORDER = 3  # of the differences
_WEIGHTS = 10.0 ** np.arange(8, -2, -1)  # lambda; beyond, rounding errors grow
_BLOCKS = 1000  # to a stroke, about; of more samples the means of successive ones are smoothed
_FAR = 5.0  # times the noise, and two steps, from the median: a jump of the sensor
_SHARE = 6  # of a stroke is the half window in which breaks are looked for...
_LEAST, _MOST = 6, 40  # ...within these numbers of samples
# A break lowers the sum of squares by this many times what is usual; noise alone would do so once in 3*10^5 samples.
_BREAK = 12.0
_LEAST_WITHOUT = 0.1  # share of windows without a break from which what is usual is taken from them
# Variances of the noise by which the sum of squares of a path that bends may exceed that of one that jumps...
_BEND = 9.0
# ...by which a smaller lambda must lower the estimated error; otherwise short parts would often follow the noise.
_LOWER = 6.0


def smooth_path(displacement: FloatArray, noise: float, threshold: float) -> FloatArray:
    """The path without its noise, shape (K,) [m].

    Parameters
    ----------
    displacement : ndarray, shape (K,)   Sampled at a constant rate but for gaps [m].
    noise : float                        Standard deviation of its white noise [m], positive.
    threshold : float                    Smallest reversal [m].
    """
    size = displacement.size
    strokes = turning_points(displacement, threshold).size - 1
    block = size // (_BLOCKS * strokes)
    if block > 1:
        begins = np.arange(0, size, block)
        counts = np.diff(np.append(begins, size))
        means = np.add.reduceat(displacement, begins) / counts
        coarse = smooth_path(means, noise / math.sqrt(block), threshold)
        return np.interp(np.arange(size), begins + 0.5 * (counts - 1), coarse)
    half = int(np.clip(size // (_SHARE * strokes), _LEAST, _MOST))
    if size < 4 * half:
        return displacement
    displacement = _without_jumps(displacement, noise)
    breaks = _breaks(displacement, half)
    smoothed, error = _smoothed_between(displacement, noise, half, breaks)
    # One sharp reversal may be lost in the noise where all of them together are not.
    reversals = turning_points(smoothed, threshold)[1:-1]
    lost = reversals[[np.abs(breaks - turn).min(initial=size) > half for turn in reversals]]
    lost = lost[(lost >= half) & (lost <= size - half)]
    if lost.size:
        sharp, error_if_sharp = _smoothed_between(displacement, noise, half, np.union1d(breaks, lost))
        if error_if_sharp < error:
            return sharp
    return smoothed


def _smoothed_between(
    displacement: FloatArray, noise: float, half: int, breaks: NDArray[np.intp]
) -> tuple[FloatArray, float]:
    """The path smoothed between breaks, and its estimated error, up to a constant [m^2]."""
    breaks, jumps = _joined(displacement, noise, half, breaks)
    begins = np.concatenate([[0], breaks, [displacement.size]])
    rows = _within(breaks, jumps, displacement.size)
    chosen, least = displacement, np.full(begins.size - 1, np.inf)
    for weight in _WEIGHTS:
        smoothed = _smoothed(displacement, weight * rows)
        error = np.add.reduceat((displacement - smoothed) ** 2, begins[:-1])
        error += 2.0 * noise**2 * _degrees_of_freedom(begins, weight)
        better = error < least - _LOWER * noise**2
        least = np.where(better, error, least)
        chosen = np.where(np.repeat(better, np.diff(begins)), smoothed, chosen)
    return chosen, float(least.sum())


def _without_jumps(values: FloatArray, noise: float) -> FloatArray:
    """Single samples that lie far from those about them, as a laser gives, replaced by the mean of their neighbours."""
    medians, means = values.copy(), values.copy()
    medians[2:-2] = np.median(np.lib.stride_tricks.sliding_window_view(values, 5), axis=1)
    means[1:-1] = 0.5 * (values[:-2] + values[2:])
    # At a reversal the median is one step away.
    far = _FAR * noise + 2.0 * float(np.quantile(np.abs(np.diff(values)), 0.9))
    return np.where(np.abs(values - medians) > far, means, values)


def _breaks(values: FloatArray, half: int) -> NDArray[np.intp]:
    """First samples after a break: two parabolas follow the values about it far better than one cubic does."""
    position = (np.arange(-half, half) + 0.5) / half
    left = position < 0.0
    two = np.stack([side * position**power for side in (left, ~left) for power in range(3)], axis=1)
    cubic = np.linalg.qr(np.vander(position, 4))[0]
    # What two parabolas can do beyond a cubic that is orthogonal to it: three directions at least count.
    contrasts = np.linalg.svd(two - cubic @ (cubic.T @ two))[0][:, :3].T
    gain = np.sum([np.convolve(values, contrast[::-1], "valid") ** 2 for contrast in contrasts], axis=0)
    highest = np.lib.stride_tricks.sliding_window_view(np.pad(gain, half), 2 * half + 1).max(axis=1)
    peaks = gain >= highest
    breaks = peaks & (gain > _BREAK * float(np.median(gain)))
    # Where breaks are close together, most windows have one; what is usual is the gain of the others.
    without = np.convolve(breaks, np.ones(2 * half + 1), "same") < 0.5
    if np.mean(without) > _LEAST_WITHOUT:
        breaks = peaks & (gain > _BREAK * float(np.median(gain[without])))
    return np.asarray(np.flatnonzero(breaks) + half)


def _joined(
    values: FloatArray, noise: float, half: int, breaks: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The breaks, where the path bends at a sample moved to that sample, and those where it does not bend at one."""
    position = np.arange(-half, half) / half
    windows = values[breaks[:, None] + np.arange(-half, half)]

    def misfit(*columns: FloatArray) -> FloatArray:
        q = np.linalg.qr(np.stack(columns, axis=1))[0]
        return np.asarray(np.sum((windows - windows @ q @ q.T) ** 2, axis=1))

    sides = (position < 0.0, position >= 0.0)
    apart = misfit(*(side * position**power for side in sides for power in range(3)))
    # The last sample before the break or the first one after it.
    shifts = np.array([-1, 0])
    bent = np.stack(
        [
            misfit(position**0, *(side * (position - shift / half) ** power for side in sides for power in (1, 2)))
            for shift in shifts
        ]
    )
    best = bent.argmin(axis=0)
    bends = bent.min(axis=0) < apart + _BEND * noise**2
    return np.where(bends, breaks + shifts[best], breaks), breaks[~bends]


def _within(breaks: NDArray[np.intp], jumps: NDArray[np.intp], size: int) -> FloatArray:
    """1 for each third difference within a part, 0 for those across a break; parts share the sample of a bend."""
    rows = np.ones(size - _ORDER)
    across = np.concatenate([breaks - 1, breaks - 2, jumps - 3])
    rows[across[(across >= 0) & (across < rows.size)]] = 0.0
    return rows


def _smoothed(values: FloatArray, rows: FloatArray) -> FloatArray:
    """The minimum, `rows` being lambda for each third difference."""
    # Imported here because it takes time, and records without noise do without it.
    from scipy.linalg import solveh_banded

    difference = (-1.0, 3.0, -3.0, 1.0)
    band = np.zeros((_ORDER + 1, values.size))
    band[0] = 1.0
    for a, b in combinations_with_replacement(range(_ORDER + 1), 2):
        band[b - a, a : a + rows.size] += difference[a] * difference[b] * rows
    return np.asarray(solveh_banded(band, values, lower=True, check_finite=False))


def _degrees_of_freedom(begins: NDArray[np.intp], weight: float) -> FloatArray:
    """Trace of the smoothing of each part, from the eigenvalues of its third differences, which are nearly these."""
    traces = []
    for size in np.diff(begins):
        eigenvalues = (2.0 * np.sin(np.pi * (np.arange(_ORDER, size) - 1.0) / (2.0 * size))) ** (2 * _ORDER)
        traces.append(min(_ORDER, size) + float(np.sum(1.0 / (1.0 + weight * eigenvalues))))
    return np.array(traces)
