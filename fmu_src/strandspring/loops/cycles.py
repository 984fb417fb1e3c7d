"""Full cycles of a measured record, with the figures of each, and of those of one amplitude."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import RecordError
from ..kernel.arrays import FloatArray
from ..records.record import Record
from .loop import AMPLITUDE_TOLERANCE, Loop, LoopBranch, LoopFigures, group_by_amplitude, mean_figures
from .noise_levels import noise_level
from .strokes import Strokes, find_strokes

# The force at a turning point is that of a parabola fitted to this last share of the stroke before it, which averages
# the noise; the force is smooth before a reversal, not after it...
_FITTED_SHARE = 0.05
# ...provided that it has this many samples; with fewer, the parabola is no better than the last sample.
_MIN_FITTED_SAMPLES = 8
# A loop is open if the force at its end differs by more than this share of its height, and more than noise does.
_GAP_TOLERANCE = 0.1
_NOISE_FACTOR = 5.0


@dataclass(frozen=True, eq=False)
class Cycle(Loop):
    """One measured cycle.

    Attributes
    ----------
    path : str                  Of the record.
    frequency : float or None   Reciprocal of its duration [Hz]; None without increasing times.
    first_sample : int          Index of its first sample in the record.
    last_sample : int           Of its last one, which is the first one of the next cycle in a series.
    gap : float                 Force at its end less that at its beginning [N], where these differ because no equal
                                stroke came before the first one, as in a first loading; else 0.
    """

    path: str
    frequency: float | None
    first_sample: int
    last_sample: int
    gap: float = 0.0


def find_cycles(record: Record) -> tuple[Cycle, ...]:
    """Full cycles of a record all samples of which are compared; no two of them overlap.

    A cycle is two consecutive strokes whose lengths agree within 3 %. The first stroke of a series of such strokes
    depends on the motion before it, so cycles begin with the second stroke if there are at least three; of only two,
    `Cycle.gap` says whether the loop is open. Likewise, a record of one period that begins within a stroke is one
    cycle.

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
    min_force, max_force = (extreme.reduceat(r, strokes.turning[:-1]) for extreme in (np.minimum, np.maximum))
    noise = noise_level(r, strokes.turning[1:-1])
    cycles = []
    for k, count, is_first in _cycle_strokes(strokes):
        cycle = slice(k, k + count)
        begin, end = int(strokes.turning[k]), int(strokes.turning[k + count])
        if record.compared is not None and not record.compared[begin : end + 1].all():
            continue
        closing_work = 0.5 * (r[begin] + r[end]) * (x[begin] - x[end])
        # The turning points are the ends of the first two strokes; the first point may lie within a stroke.
        ends = strokes.turning_displacement[k + 1 : k + 3]
        bottom, top = int(np.argmin(ends)), int(np.argmax(ends))
        figures = LoopFigures(
            low=float(ends[bottom]),
            high=float(ends[top]),
            force_low=float(end_force[k + bottom]),
            force_high=float(end_force[k + top]),
            mean_force=float(np.sum(strokes.direction[cycle] * stroke_work[cycle]) / np.sum(strokes.length[cycle])),
            min_force=float(min(min_force[cycle].min(), r[end])),
            max_force=float(max(max_force[cycle].max(), r[end])),
            energy_per_cycle=float(np.sum(stroke_work[cycle]) + closing_work),
        )
        loading, unloading = (_branch(strokes, r, range(k, k + count), direction) for direction in (1, -1))
        duration = 0.0 if record.time is None else float(record.time[end] - record.time[begin])
        frequency = 1.0 / duration if duration > 0.0 else None
        reversal = int(strokes.turning[k + 1])
        tolerance = max(_GAP_TOLERANCE * abs(figures.height), _NOISE_FACTOR * noise)
        gap = _gap(x, r, begin, reversal, end, tolerance) if is_first else 0.0
        cycles.append(Cycle(figures, loading, unloading, noise, record.path, frequency, begin, end, gap))
    return tuple(cycles)


def _cycle_strokes(strokes: Strokes) -> list[tuple[int, int, bool]]:
    """First stroke and number of strokes of each cycle, and whether the first stroke follows no equal one."""
    length = strokes.length
    equal = np.abs(np.diff(length)) <= AMPLITUDE_TOLERANCE * np.maximum(length[1:], length[:-1])
    edges = np.flatnonzero(~equal) + 1
    cycles = []
    for first, last in zip([0, *edges], [*edges, strokes.count], strict=True):
        begin = first + 1 if last - first >= 3 else first
        cycles += [(int(k), 2, bool(k == first)) for k in range(begin, last - 1, 2)]
    x = strokes.turning_displacement
    if not cycles and strokes.count == 3 and abs(x[3] - x[0]) <= AMPLITUDE_TOLERANCE * length[1]:
        cycles = [(0, 3, True)]
    return cycles


def _gap(x: FloatArray, r: FloatArray, begin: int, reversal: int, end: int, tolerance: float) -> float:
    """Force at the end of a loop less that at its beginning [N]; 0 within a tolerance.

    The way that is missing between them may lie behind a reversal, where the force changes most: what it changes over
    as much of the way behind the reversal within the loop is tolerated, as is what it changes from sample to sample.
    """
    behind = reversal + int(np.argmax(np.abs(x[reversal:end] - x[reversal]) >= abs(x[begin] - x[end])))
    tolerance += abs(r[behind] - r[reversal]) + abs(r[begin + 1] - r[begin]) + abs(r[end] - r[end - 1])
    gap = float(r[end] - r[begin])
    return gap if abs(gap) > tolerance else 0.0


def _end_forces(strokes: Strokes, force: FloatArray) -> FloatArray:
    """Force at the end of each stroke, shape (S,) [N], by a parabola fitted to its last samples."""
    length = strokes.length[strokes.of_sample]
    # While the displacement is constant at the end, the force may relax or reverse already.
    constant = np.bincount(strokes.of_sample[strokes.travel >= length], minlength=strokes.count)
    arrival = strokes.turning[1:] - np.maximum(constant - 1, 0)
    at_end = force[arrival]
    remaining = 1.0 - strokes.travel / np.maximum(length, 1e-300)
    near = (remaining <= _FITTED_SHARE) & (np.arange(force.size) <= arrival[strokes.of_sample])
    stroke, t = strokes.of_sample[near], remaining[near] / _FITTED_SHARE
    excess = force[near] - at_end[stroke]

    def total(weights: FloatArray) -> FloatArray:
        return np.bincount(stroke, weights=weights, minlength=strokes.count).astype(np.float64)

    moments = np.stack([total(t**power) for power in range(5)])
    matrix = np.moveaxis(np.stack([moments[k : k + 3] for k in range(3)]), 2, 0)
    right = np.stack([total(excess * t**power) for power in range(3)], axis=1)
    # Fewer than three distinct displacements give a singular matrix; the least-norm solution still fits their means.
    coefficients = np.linalg.pinv(matrix, rcond=1e-10, hermitian=True) @ right[:, :, None]
    return np.where(moments[0] >= _MIN_FITTED_SAMPLES, at_end + coefficients[:, 0, 0], at_end)


def _branch(strokes: Strokes, force: FloatArray, cycle: range, direction: int) -> LoopBranch:
    """Samples of the strokes in one direction; of a period that begins within a stroke, the last stroke comes first."""
    pieces = [
        np.arange(strokes.turning[k], strokes.turning[k + 1] + 1) for k in cycle if strokes.direction[k] == direction
    ]
    order = np.concatenate(pieces[::-1])[::direction]
    return LoopBranch(strokes.displacement[order], force[order])


@dataclass(frozen=True)
class FigureSpread:
    """Standard deviation of the figures from cycle to cycle.

    Attributes
    ----------
    secant_stiffness, energy_per_cycle : float   [N/m], [J].
    loss_factor, damping_ratio : float           [-], [-].
    """

    secant_stiffness: float
    energy_per_cycle: float
    loss_factor: float
    damping_ratio: float


@dataclass(frozen=True)
class MeasuredLoop:
    """Cycles of one amplitude in a record.

    Attributes
    ----------
    path : str                     Of the record.
    figures : LoopFigures          Of the mean cycle.
    spread : FigureSpread or None  None for a single cycle.
    cycles : int                   Number of cycles.
    gap : float                    Force at the end of the loop less that at its beginning, over the loop's height [-];
                                   0 for closed loops. Where a loop is open, as in a first loading, so are the figures.
    frequency : float or None      Mean of the cycles' frequencies [Hz]; None without times.
    """

    path: str
    figures: LoopFigures
    spread: FigureSpread | None
    cycles: int
    frequency: float | None
    gap: float = 0.0


def measured_loops(record: Record) -> tuple[MeasuredLoop, ...]:
    """Figures of the loops in a record in ascending order of amplitude; cycles that agree within 3 % are averaged,
    open ones only where none is closed.

    Energies are trapezoidal sums over the samples of the closed loop; peak forces are sampled and include noise.

    Parameters
    ----------
    record : Record

    Returns
    -------
    tuple of MeasuredLoop

    Raises
    ------
    RecordError   If the record has no full cycle.
    """
    cycles = find_cycles(record)
    if not cycles:
        selected = "lies within the selected displacements; select a range that holds one"
        where = "was found; record at least one full cycle" if record.compared is None else selected
        raise RecordError(f"{record.path}: no full cycle (two consecutive strokes equal in length within 3 %) {where}.")
    return tuple(_measured(group) for group in group_by_amplitude(cycles))


def _measured(cycles: Sequence[Cycle]) -> MeasuredLoop:
    group = [cycle for cycle in cycles if cycle.gap == 0.0] or cycles
    frequencies = [cycle.frequency for cycle in group if cycle.frequency is not None]
    return MeasuredLoop(
        path=group[0].path,
        figures=mean_figures(group),
        spread=spread_of(group),
        cycles=len(group),
        frequency=float(np.mean(frequencies)) if frequencies else None,
        gap=float(np.mean([_gap_share(cycle) for cycle in group])),
    )


def _gap_share(cycle: Cycle) -> float:
    """The gap over the height of the loop; over its peak-to-peak force where the branches have no distance."""
    figures = cycle.figures
    return cycle.gap / (figures.height or figures.max_force - figures.min_force) if cycle.gap else 0.0


def spread_of(group: Sequence[Cycle]) -> FigureSpread | None:
    """Standard deviation of the figures of cycles; None for a single one."""
    names = FigureSpread.__dataclass_fields__
    columns = ([getattr(cycle.figures, name) for cycle in group] for name in names)
    return FigureSpread(*(float(np.std(column, ddof=1)) for column in columns)) if len(group) > 1 else None
