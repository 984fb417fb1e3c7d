"""Samples of a record that say nothing of the spring: forces at the end of the sensor's range, and dwells."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..kernel.arrays import FloatArray
from ..records.record import Record
from .noise_levels import median, noise_level
from .strokes import Strokes

BoolArray = NDArray[np.bool_]

_CLIPPED = 4  # samples at one extreme force
_CLIPPED_SHARE = 3  # times as many of them as at any other level
_REST = 0.002  # change of displacement that is called a rest, share of its range
_RESTS = 8  # samples at least that make a dwell
_THINNED = 400  # samples of a stroke among which dwells are looked for, about
_SLOWER = 1.5  # a dwell lasts so many times as long as a sine stays at its turning points
_DWELL = 0.12  # time that makes a dwell, share of the mean stroke's


def clipped_samples(force: FloatArray) -> BoolArray:
    """Samples at an extreme of the force that comes far more often than any other, as at the end of a sensor's range.

    A coarse sensor repeats every level, and a record without noise every force of a cycle.
    """
    clipped = np.zeros(force.size, dtype=bool)
    extremes = (force.max(), force.min())
    for extreme in extremes:
        at = force == extreme
        count = int(at.sum())
        if count < _CLIPPED:
            continue
        others, counts = np.unique(force[~at], return_counts=True)
        elsewhere = int(np.max(counts[~np.isin(others, extremes)], initial=1))
        if count >= _CLIPPED_SHARE * elsewhere:
            clipped |= at
    return clipped


def dwells(record: Record, strokes: Strokes) -> tuple[BoolArray, float]:
    """Samples within dwells but their first, and the median change of the force during one [N]."""
    # Dense records are thinned, or every step would look like a rest.
    thinned = slice(None, None, max(1, len(record) // (_THINNED * strokes.count)))
    stride = thinned.step
    x, force = strokes.displacement[thinned], record.force[thinned]
    span = float(np.ptp(x))
    if not span:  # whatever the displacement does is taken for noise
        return np.zeros(len(record), dtype=bool), 0.0
    steps = np.abs(np.diff(x))
    rest = max(_REST * span, float(np.min(steps[steps > 0.0], initial=span)))
    first, last = _runs(steps <= max(rest / _RESTS, 4.0 * noise_level(x)))
    last = last + 1
    clock = np.arange(x.size, dtype=np.float64) if record.rising_time is None else record.rising_time[thinned]
    mean_stroke = float(clock[-1] - clock[0]) / strokes.count
    # A sine stays so long within a rest of its turning point.
    turning = _SLOWER * 2.0 / math.pi * math.acos(max(1.0 - 2.0 * rest / span, -1.0))
    rests = np.array([np.ptp(x[a : b + 1]) for a, b in zip(first, last, strict=True)]) <= _REST * span
    long = rests & (last - first + 1 >= _RESTS) & (clock[last] - clock[first] >= max(_DWELL, turning) * mean_stroke)
    resting = np.zeros(len(record), dtype=bool)
    for begin, end in zip(stride * first[long], stride * last[long], strict=True):
        resting[begin + 1 : end] = True
    if not long.any():
        return resting, 0.0
    return resting, median(np.abs(force[last[long]] - force[first[long]]))


def _runs(same: BoolArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and last index of each run of True."""
    edges = np.diff(np.concatenate([[False], same, [False]]).astype(np.int8))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
