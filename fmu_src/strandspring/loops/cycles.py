"""The full cycles of a measured record and the figures of each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernel.arrays import FloatArray
from ..records.record import Record
from .loop import ALIKE, Branch, Loop, LoopFigures
from .strokes import Strokes, find_strokes, noise_level

# The force at a turning point is read from this last share of the stroke that leads there by a parabola, so that the
# noise of one sample does not make the secant: before a reversal the force is smooth, behind it it is not...
_APPROACH = 0.05
# ...if at least so many samples are there; with fewer the parabola's end is no better than the last sample.
_APPROACH_SAMPLES = 8


@dataclass(frozen=True, eq=False)
class Cycle(Loop):
    """One measured cycle.

    Attributes
    ----------
    path : str                  The record it is from.
    frequency : float or None   One over its duration [Hz]; None without times that rise.
    """

    path: str
    frequency: float | None


def find_cycles(record: Record) -> tuple[Cycle, ...]:
    """The full cycles of a record, none overlapping another.

    A cycle is two neighbouring strokes whose lengths agree within 3 %. The first stroke of a run of such strokes
    brings the memory of another motion, so cycles begin with the second one if there are three. A record that is one
    period begun amid a stroke is one cycle.

    Parameters
    ----------
    record : Record

    Returns
    -------
    tuple of Cycle   In the order of the record; empty if there is no full cycle.
    """
    strokes = find_strokes(record.displacement)
    x, r = record.displacement, record.force
    work = np.concatenate([[0.0], np.cumsum(0.5 * (r[1:] + r[:-1]) * np.diff(x))])
    stroke_work = np.diff(work[strokes.turning])
    end_force = _end_forces(strokes, r)
    least, greatest = (extreme.reduceat(r, strokes.turning[:-1]) for extreme in (np.minimum, np.maximum))
    noise = noise_level(r)
    cycles = []
    for k, count in _cycle_strokes(strokes):
        used = slice(k, k + count)
        begin, end = int(strokes.turning[k]), int(strokes.turning[k + count])
        closing = 0.5 * (r[begin] + r[end]) * (x[begin] - x[end])
        # The turning points are the ends of the first two strokes; a first point may be amid a stroke.
        ends = strokes.turning_displacement[k + 1 : k + 3]
        bottom, top = int(np.argmin(ends)), int(np.argmax(ends))
        figures = LoopFigures(
            low=float(ends[bottom]),
            high=float(ends[top]),
            force_low=float(end_force[k + bottom]),
            force_high=float(end_force[k + top]),
            mean_force=float(np.sum(strokes.direction[used] * stroke_work[used]) / np.sum(strokes.length[used])),
            least_force=float(min(least[used].min(), r[end])),
            greatest_force=float(max(greatest[used].max(), r[end])),
            energy_per_cycle=float(np.sum(stroke_work[used]) + closing),
        )
        loading, unloading = (_branch(strokes, r, range(k, k + count), side) for side in (1, -1))
        duration = 0.0 if record.time is None else float(record.time[end] - record.time[begin])
        frequency = 1.0 / duration if duration > 0.0 else None
        cycles.append(Cycle(figures, loading, unloading, noise, record.path, frequency))
    return tuple(cycles)


def _cycle_strokes(strokes: Strokes) -> list[tuple[int, int]]:
    """First stroke and number of strokes of each cycle."""
    length = strokes.length
    alike = np.abs(np.diff(length)) <= ALIKE * np.maximum(length[1:], length[:-1])
    edges = np.flatnonzero(~alike) + 1
    found = []
    for first, last in zip([0, *edges], [*edges, strokes.count], strict=True):
        begin = first + 1 if last - first >= 3 else first
        found += [(int(k), 2) for k in range(begin, last - 1, 2)]
    x = strokes.turning_displacement
    if not found and strokes.count == 3 and abs(x[3] - x[0]) <= ALIKE * length[1]:
        found = [(0, 3)]
    return found


def _end_forces(strokes: Strokes, force: FloatArray) -> FloatArray:
    """Force on arriving at the end of each stroke, shape (S,) [N]: a parabola through the stroke's last samples."""
    length = strokes.length[strokes.of_sample]
    # While the displacement stands still at the end the force may relax or turn already.
    standing = np.bincount(strokes.of_sample[strokes.travel >= length], minlength=strokes.count)
    arrival = strokes.turning[1:] - np.maximum(standing - 1, 0)
    at_end = force[arrival]
    remaining = 1.0 - strokes.travel / np.maximum(length, 1e-300)
    near = (remaining <= _APPROACH) & (np.arange(force.size) <= arrival[strokes.of_sample])
    stroke, t = strokes.of_sample[near], remaining[near] / _APPROACH
    excess = force[near] - at_end[stroke]

    def total(weights: FloatArray) -> FloatArray:
        return np.bincount(stroke, weights=weights, minlength=strokes.count).astype(np.float64)

    moments = np.stack([total(t**power) for power in range(5)])
    matrix = np.moveaxis(np.stack([moments[k : k + 3] for k in range(3)]), 2, 0)
    right = np.stack([total(excess * t**power) for power in range(3)], axis=1)
    # Fewer than three different displacements give a singular matrix; the least solution still passes their means.
    coefficients = np.linalg.pinv(matrix, rcond=1e-10, hermitian=True) @ right[:, :, None]
    return np.where(moments[0] >= _APPROACH_SAMPLES, at_end + coefficients[:, 0, 0], at_end)


def _branch(strokes: Strokes, force: FloatArray, used: range, side: int) -> Branch:
    """The samples of the strokes of one direction; of a period begun amid a stroke the last stroke comes first."""
    pieces = [np.arange(strokes.turning[k], strokes.turning[k + 1] + 1) for k in used if strokes.direction[k] == side]
    order = np.concatenate(pieces[::-1])[::side]
    return Branch(strokes.displacement[order], force[order])
