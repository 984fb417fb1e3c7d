"""Samples of a record that say nothing of the spring: forces at the end of the sensor's range, and dwells."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..kernel.arrays import FloatArray
from ..records.record import Record
from .noise_levels import noise_level
from .strokes import Strokes

BoolArray = NDArray[np.bool_]

_CLIPPED = 4  # samples at one extreme force
_CLIPPED_SHARE = 3  # times as many of them as at any other level
_REST = 0.002  # change of displacement that is called a rest, share of its range
_RESTS = 8  # samples at least that make a dwell
_THINNED = 400  # samples of a stroke among which dwells are looked for, about
_SLOWER = 1.5  # a dwell lasts so many times as long as a sine stays at its turning points
_MOVES = 0.0002  # change of displacement within the middle half of a rest that is none, share of its range
_ENDS = 8  # share of a rest at either end over which the force is averaged, one in so many
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


@dataclass(frozen=True, eq=False)
class Dwells:
    """Where the displacement of a record of K samples rests.

    Attributes
    ----------
    resting : ndarray of bool, shape (K,)   Samples of rests but their first, those before and after the test included.
    within : ndarray of bool, shape (K,)    Those of rests within the test.
    relaxed : float                         Mean change of the force during these, the larger of those after loading
                                            and after unloading [N].
    scatter : float                         Standard deviation of that by the noise of the force alone [N].
    """

    resting: BoolArray
    within: BoolArray
    relaxed: float = 0.0
    scatter: float = 0.0


def dwells(record: Record, strokes: Strokes) -> Dwells:
    """Rests of the displacement, and how far the force relaxes in those between the first motion and the last."""
    # Dense records are thinned, or every step would look like a rest.
    thinned = slice(None, None, max(1, len(record) // (_THINNED * strokes.count)))
    stride = thinned.step
    x = strokes.displacement[thinned]
    span = float(np.ptp(x))
    none = np.zeros(len(record), dtype=bool)
    if not span:  # whatever the displacement does is taken for noise
        return Dwells(none, none)
    steps = np.abs(np.diff(x))
    smallest, jitter = float(np.min(steps[steps > 0.0], initial=span)), 4.0 * noise_level(x)
    rest, moves = max(_REST * span, smallest), max(_MOVES * span, smallest, jitter)
    first, last = _runs(steps <= max(rest / _RESTS, jitter))
    last = last + 1
    clock = np.arange(x.size, dtype=np.float64) if record.rising_time is None else record.rising_time[thinned]
    mean_stroke = float(clock[-1] - clock[0]) / strokes.count
    # A sine stays so long within a rest of its turning point.
    turning = _SLOWER * 2.0 / math.pi * math.acos(max(1.0 - 2.0 * rest / span, -1.0))
    rests = np.array([np.ptp(x[a : b + 1]) for a, b in zip(first, last, strict=True)]) <= _REST * span
    long = rests & (last - first + 1 >= _RESTS) & (clock[last] - clock[first] >= max(_DWELL, turning) * mean_stroke)
    resting, within = none, none.copy()
    changes: dict[bool, list[tuple[float, float]]] = {True: [], False: []}
    for begin, end in zip((stride * first[long]).tolist(), (stride * last[long]).tolist(), strict=True):
        resting[begin + 1 : end] = True
        rose = _rose_before(strokes.displacement, begin, end, rest)
        # Small strokes, as at the start of a test, turn within what is called a rest, but do not rest there.
        if rose is not None and np.ptp(_middle(strokes.displacement[begin : end + 1])) <= moves:
            within[begin + 1 : end] = True
            changes[rose].append(_change_at_rest(record, begin, end))
    # After loading the force relaxes the other way than after unloading; several rests tell more than the noise of one.
    means = [np.mean(group, axis=0) / [1.0, math.sqrt(len(group))] for group in changes.values() if group]
    if not means:
        return Dwells(resting, within)
    change, scatter = np.max([(abs(mean), deviation) for mean, deviation in means], axis=0).tolist()
    return Dwells(resting, within, change, scatter)


def _rose_before(path: FloatArray, begin: int, end: int, rest: float) -> bool | None:
    """Whether the displacement rose before a rest; None if it did not move before it, or does not after it."""
    level = np.median(path[begin : end + 1])
    before, after = (np.flatnonzero(np.abs(piece - level) > rest) for piece in (path[:begin], path[end + 1 :]))
    return bool(path[before[-1]] < level) if before.size and after.size else None


def _change_at_rest(record: Record, begin: int, end: int) -> tuple[float, float]:
    """Change of the force while the displacement rests, and the standard deviation of that by noise [N].

    At the ends of a rest the displacement still moves: these samples do not count, since the force follows it.
    """
    x, force = record.displacement[begin : end + 1], record.force[begin : end + 1]
    middle = _middle(x)
    level = np.median(middle)
    still = np.flatnonzero(np.abs(x - level) <= np.max(np.abs(middle - level)))
    force = force[still[0] : still[-1] + 1]
    ends = max(1, force.size // _ENDS)
    change = float(np.mean(force[-ends:]) - np.mean(force[:ends]))
    noise = float(np.std(np.diff(force))) / math.sqrt(2.0)
    return change, noise * math.sqrt(2.0 / ends)


def _middle(rest: FloatArray) -> FloatArray:
    """The middle half of a rest."""
    return rest[rest.size // 4 : rest.size - rest.size // 4]


def _runs(same: BoolArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First and last index of each run of True."""
    edges = np.diff(np.concatenate([[False], same, [False]]).astype(np.int8))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1
