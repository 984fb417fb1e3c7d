"""The path along which a rival is evaluated, with the force measured on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...identification.points.sample_points import POINTS_PER_STROKE, SamplePoints, join
from ...identification.points.steady_part import SteadyRecord
from ...kernel.arrays import FloatArray
from ...loops.noise_levels import noise_level
from ...loops.strokes import IndexArray, find_strokes
from ...records.record import Record

# Points in each stroke and, unless there are very many strokes, about how many in all.
_LEAST_POINTS, _POINTS = 40, 2000
# Cycles that are used in all, in evenly spaced runs of a record if it has more than its share; strokes before a run
# that set its memory.
_CYCLES, _RUNS, _MEMORY = 20, 5, 4
_SPEED_NOISE = 0.02  # of the speed that is accepted, share of its rms
_LONGEST_SHARE = 0.02  # of a stroke's samples over which the speed is a difference at most


@dataclass(frozen=True, eq=False)
class Track:
    """Points of one or more records along the path, and the speed there.

    Attributes
    ----------
    loops : SamplePoints                 Its `record` counts runs without a gap.
    speed : ndarray, shape (P,)          |dx/dt| [m/s]; [m per sample] of records without times.
    source : ndarray of int, shape (P,)  Record of each point.
    """

    loops: SamplePoints
    speed: FloatArray
    source: IndexArray

    @classmethod
    def from_steady(cls, parts: Sequence[SteadyRecord]) -> Track:
        """The steady parts of records, what lies before them setting the memory."""
        strokes = min(sum(part.strokes.count for part in parts), 2 * _CYCLES)
        points = min(POINTS_PER_STROKE, max(_LEAST_POINTS, _POINTS // strokes))
        # The speed is averaged over the same cells as the force.
        moved = [replace(part, record=_with_speed(part.record)) for part in parts]
        loops = join([part.loops_with(points) for part in parts])
        speed = np.concatenate([part.loops_with(points).force for part in moved])
        return _in_some_cycles(cls(loops, speed, loops.record[loops.stroke]))

    def stroke_ends(self) -> FloatArray:
        """Displacement at the end of each stroke, shape (S,) [m]."""
        loops = self.loops
        return np.asarray(loops.start + loops.direction * loops.length)


def _in_some_cycles(track: Track) -> Track:
    """The track with no more cycles than are used, each run of them as if it were a record."""
    loops = track.loops
    used = loops.used
    cycles = max(2, _CYCLES // (int(loops.record[-1]) + 1))
    runs = min(_RUNS, cycles)
    run_length = 2 * cycles // runs
    scored = np.zeros(loops.direction.size, dtype=bool)
    for strokes in np.split(used, np.flatnonzero(np.diff(loops.record[used])) + 1):
        if strokes.size > 2 * cycles:
            begins = np.linspace(0, strokes.size - run_length, runs).round().astype(np.intp)
            scored[strokes[(begins[:, None] + np.arange(run_length)).ravel()]] = True
        else:
            scored[strokes] = True
    if scored[used].all():
        return track
    kept = scored.copy()
    for back in range(1, _MEMORY + 1):
        kept[:-back] |= scored[back:] & (loops.record[:-back] == loops.record[back:])
    strokes = np.flatnonzero(kept)
    run = np.append(0, np.cumsum((np.diff(strokes) > 1) | (np.diff(loops.record[strokes]) > 0))).astype(np.intp)
    # Before each run a stroke comes from where the record began: what never yields remembers that for good.
    first = np.flatnonzero(np.diff(run, prepend=-1))
    origin = loops.start[np.searchsorted(loops.record, loops.record[strokes[first]])]
    side = -loops.direction[strokes[first]]
    length = np.maximum(side * (loops.start[strokes[first]] - origin), 0.0)
    points = scored[loops.stroke]
    moved = (np.cumsum(kept) - 1)[loops.stroke[points]]
    return Track(
        SamplePoints(
            loops.displacement[points], loops.force[points], loops.weight[points], loops.travel[points],
            moved + run[moved] + 1, loops.sample[points],
            np.insert(loops.direction[strokes], first, side),
            np.insert(loops.start[strokes], first, loops.start[strokes[first]] - side * length),
            np.insert(loops.length[strokes], first, length),
            np.insert(run, first, run[first]),
        ),
        track.speed[points],
        track.source[points],
    )  # fmt: skip


def _with_speed(record: Record) -> Record:
    """The record with its speed in place of the force.

    The speed is a central difference over as many samples as keep its noise low, a fiftieth of a stroke at most.
    """
    x = record.displacement
    index = np.arange(x.size, dtype=np.float64)
    times = index if record.rising_time is None else record.rising_time
    rough = np.abs(np.gradient(x, times))
    strokes = find_strokes(x)
    most = max(1, int(_LONGEST_SHARE * x.size / strokes.count))
    per_sample = float(np.sqrt(np.mean(np.diff(x) ** 2)))
    window = noise_level(x) / np.sqrt(2.0) / max(_SPEED_NOISE * per_sample, 1e-300)
    half = int(np.clip(np.ceil(window), 1, most))
    if half == 1:
        return replace(record, force=rough)
    low, high = np.maximum(index.astype(int) - half, 0), np.minimum(index.astype(int) + half, x.size - 1)
    return replace(record, force=np.abs((x[high] - x[low]) / (times[high] - times[low])))
