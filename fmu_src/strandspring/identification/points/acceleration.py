"""Acceleration along a measured path: second derivatives of local quadratics.

Each sample takes the quadratic over the window about it, or one that begins or ends at it where that follows its own
window much better: a corner of the path, as at the reversals of a triangle or where the amplitude changes, lies outside
one of them. The window balances the noise of the displacement against the curvature of the acceleration, the path being
taken for a sine.
"""

from __future__ import annotations

import math

import numpy as np

from ...errors import RecordError
from ...kernel.arrays import FloatArray
from ...loops.strokes import find_strokes
from ...records.record import Record

_LEAST = 2  # half width of the smallest window, samples
_GROWTH = 1.4  # from one window tried to the next
_LARGEST = 0.25  # largest window, share of the usual stroke
_CELLS = 200  # samples of a stroke are averaged down to about this many
_SAME_TIME = 1e-6  # share of the mean step up to which two samples are of one time
_BETTER = 4.0  # times smaller the mean square must be for a window beside the sample


def acceleration(record: Record) -> FloatArray:
    """Acceleration at each sample, shape (K,) [m/s^2].

    Raises
    ------
    RecordError   Without a rising time column, or with too few samples.
    """
    if record.time is None:
        raise RecordError(
            f"{record.path}: a moving mass needs times, and the record has none; name its time column with `time=...`, "
            "or go without `moving_mass=...`."
        )
    time = record.time
    steps = np.diff(time)
    # Of the samples of each window, three times at least must differ.
    rises = np.cumsum([0, *(steps > _SAME_TIME * np.mean(steps))])
    if np.any(steps < 0.0) or time.size <= 2 * _LEAST or np.any(rises[2 * _LEAST :] < rises[: -2 * _LEAST] + 2):
        raise RecordError(
            f"{record.path}: a moving mass needs the acceleration, and the time column does not rise over "
            f"{2 * _LEAST + 1} samples throughout; check it with `time=...`."
        )
    strokes = find_strokes(record.displacement)
    turning = strokes.turning
    duration = float(np.median(np.diff(time[turning])))
    samples = float(np.median(np.diff(turning)))
    amplitude = 0.5 * float(strokes.length.max())
    cell = max(1, int(samples / _CELLS))
    moment, path = _averaged(time, cell), _averaged(record.displacement, cell)
    turned = math.pi / duration
    step = duration / (samples / cell)
    best, chosen = np.inf, np.zeros(moment.size)
    half = _LEAST
    while 2 * half + 1 <= min(moment.size, max(_LARGEST * samples / cell, 2 * _LEAST + 1)):
        second, left = _quadratics(moment, path, half)
        # Standard deviation of the second derivative over N even steps, and what a quadratic makes of a sine.
        noise = math.sqrt(720.0 * float(np.mean(left)) / (2 * half + 1) ** 5) / step**2
        bias = turned**2 * amplitude * (turned * half * step) ** 2 / 14.0
        if noise**2 + bias**2 < best:
            best, chosen = noise**2 + bias**2, second
        half = max(half + 1, int(_GROWTH * half))
    return np.asarray(np.interp(time, moment, chosen))


def _quadratics(time: FloatArray, values: FloatArray, half: int) -> tuple[FloatArray, FloatArray]:
    """Second derivative at each sample of the best quadratic over 2*half + 1 samples, and the mean square left."""
    middle = np.arange(half, time.size - half)
    scale = time[middle + half] - time[middle - half]
    moments, products, squares = np.zeros((5, middle.size)), np.zeros((3, middle.size)), np.zeros(middle.size)
    for offset in range(-half, half + 1):
        place = (time[middle + offset] - time[middle]) / scale
        value = values[middle + offset] - values[middle]
        power = np.ones(middle.size)
        for k in range(5):
            moments[k] += power
            if k < 3:
                products[k] += power * value
            power = power * place
        squares += value**2
    matrix = np.moveaxis(moments[np.add.outer(np.arange(3), np.arange(3))], 2, 0)
    solution = np.linalg.solve(matrix, products.T[:, :, None])[:, :, 0]
    left = np.maximum(squares - np.sum(solution * products.T, axis=1), 0.0) / (2 * half - 2)
    second = 2.0 * solution[:, 2] / scale**2
    sample = np.arange(time.size)
    centred, *beside = (np.clip(sample - half + shift, 0, middle.size - 1) for shift in (0, -half, half))
    other = np.where(left[beside[0]] <= left[beside[1]], *beside)
    used = np.where(_BETTER * left[other] < left[centred], other, centred)
    return second[used], left[used]


def _averaged(values: FloatArray, cell: int) -> FloatArray:
    """Means of so many successive values, the last of them of fewer."""
    begin = np.arange(0, values.size, cell)
    return np.asarray(np.add.reduceat(values, begin) / np.diff(begin, append=values.size))
