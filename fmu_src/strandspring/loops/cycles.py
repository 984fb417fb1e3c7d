"""Full cycles of a measured record, two strokes of equal length each, with the figures of one and of an amplitude."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..kernel.arrays import FloatArray
from ..records.record import Record
from .loop import ALIKE, Loop, LoopBranch, LoopFigures, group_by_amplitude, mean_figures
from .strokes import Strokes, find_strokes, noise_level


@dataclass(frozen=True, eq=False)
class Cycle(Loop):
    """One measured cycle.

    The gap is the force at its end less that at its beginning [N], where these differ because no equal stroke came
    before the first one, as in a first loading; else 0.
    """

    frequency: float | None  # reciprocal of its duration [Hz]; None without increasing times
    first_sample: int  # in the record
    last_sample: int  # which is the first one of the next cycle in a series
    gap: float


def find_cycles(record: Record) -> tuple[Cycle, ...]:
    """Full cycles of a record all samples of which are compared, in their order; no two of them overlap.

    A cycle is two consecutive strokes whose lengths agree within 3 %. The first stroke of a series of such strokes
    depends on the motion before it, so cycles begin with the second stroke if there are at least three; of only two,
    `Cycle.gap` says whether the loop is open. Likewise, a record of one period that begins within a stroke is one
    cycle.
    """
    strokes = find_strokes(record.displacement)
    x, r = record.displacement, record.force
    work = np.concatenate([[0.0], np.cumsum(0.5 * (r[1:] + r[:-1]) * np.diff(x))])
    stroke_work = np.diff(work[strokes.turning])
    noise = noise_level(r, strokes.turning[1:-1])
    cycles = []
    for k, count, is_first in _cycle_strokes(strokes):
        cycle = slice(k, k + count)
        begin, end = int(strokes.turning[k]), int(strokes.turning[k + count])
        samples = slice(begin, end + 1)
        if record.compared is not None and not record.compared[samples].all():
            continue
        closing_work = 0.5 * (r[begin] + r[end]) * (x[begin] - x[end])
        # The turning points are the ends of the first two strokes; the first point may lie within a stroke.
        (low, force_low), (high, force_high) = sorted((_end(strokes, r, k), _end(strokes, r, k + 1)))
        figures = LoopFigures(
            low=low,
            high=high,
            force_low=force_low,
            force_high=force_high,
            mean_force=float(np.sum(strokes.direction[cycle] * stroke_work[cycle]) / np.sum(strokes.length[cycle])),
            min_force=float(r[samples].min()),
            max_force=float(r[samples].max()),
            energy_per_cycle=float(np.sum(stroke_work[cycle]) + closing_work),
        )
        loading, unloading = (_branch(strokes, r, range(k, k + count), direction) for direction in (1, -1))
        duration = 0.0 if record.time is None else float(record.time[end] - record.time[begin])
        frequency = 1.0 / duration if duration > 0.0 else None
        # Open is a loop by more than a tenth of its height and more than noise makes.
        tolerance = max(0.1 * abs(figures.height), 5.0 * noise)
        gap = _gap(x, r, (begin, int(strokes.turning[k + 1]), end), tolerance) if is_first else 0.0
        cycles.append(Cycle(figures, loading, unloading, noise, frequency, begin, end, gap))
    return tuple(cycles)


def _cycle_strokes(strokes: Strokes) -> list[tuple[int, int, bool]]:
    """First stroke and number of strokes of each cycle, and whether the first stroke follows no equal one."""
    length, x = strokes.length, strokes.ends
    equal = np.abs(np.diff(length)) <= ALIKE * np.maximum(length[1:], length[:-1])
    edges = np.flatnonzero(~equal) + 1
    cycles = []
    for first, last in zip([0, *edges], [*edges, strokes.count], strict=True):
        begin = first + 1 if last - first >= 3 else first
        cycles += [(int(k), 2, bool(k == first)) for k in range(begin, last - 1, 2)]
    if not cycles and strokes.count == 3 and abs(x[3] - x[0]) <= ALIKE * length[1]:
        cycles = [(0, 3, True)]
    return cycles


def _gap(x: FloatArray, r: FloatArray, samples: tuple[int, int, int], tolerance: float) -> float:
    """Force at the end of a loop less that at its beginning [N]; 0 within a tolerance.

    The way that is missing between them may lie behind a reversal, where the force changes most: what it changes over
    as much of the way behind the reversal within the loop is tolerated, as is what it changes from sample to sample.
    """
    begin, reversal, end = samples
    behind = reversal + int(np.argmax(np.abs(x[reversal:end] - x[reversal]) >= abs(x[begin] - x[end])))
    tolerance += abs(r[behind] - r[reversal]) + abs(r[begin + 1] - r[begin]) + abs(r[end] - r[end - 1])
    gap = float(r[end] - r[begin])
    return gap if abs(gap) > tolerance else 0.0


def _end(strokes: Strokes, force: FloatArray, k: int) -> tuple[float, float]:
    """Displacement [m] and force [N] at the end of a stroke.

    The force is that of a parabola fitted to the last twentieth of the stroke, which averages noise; it is smooth
    before a reversal, not after it.
    """
    samples = slice(int(strokes.turning[k]) + (k > 0), int(strokes.turning[k + 1]) + 1)
    end = float(strokes.ends[k + 1])
    t = np.abs(end - strokes.path[samples]) / max(0.05 * float(strokes.length[k]), 1e-300)
    # While the displacement is constant at the end, the force may relax or reverse already.
    arrival = int(np.argmax(t == 0.0))
    near = np.flatnonzero(t[: arrival + 1] <= 1.0)
    own, last = force[samples][near], float(force[samples][arrival])
    if near.size < 8:  # no better than the last sample
        return end, last
    # Fewer than three distinct displacements give a singular matrix; the least-norm solution fits their means.
    return end, last + float(np.linalg.lstsq(np.vander(t[near], 3), own - last, rcond=1e-5)[0][-1])


def _branch(strokes: Strokes, force: FloatArray, cycle: range, direction: int) -> LoopBranch:
    """Samples of the strokes in one direction."""
    pairs = [strokes.turning[k : k + 2] for k in cycle if strokes.direction[k] == direction]
    samples = np.concatenate([np.arange(first, last + 1) for first, last in pairs])
    return LoopBranch(strokes.path[samples], force[samples])


@dataclass(frozen=True)
class FigureSpread:
    """Standard deviation of figures of `LoopFigures` from cycle to cycle."""

    secant_stiffness: float
    energy_per_cycle: float
    loss_factor: float
    damping_ratio: float


@dataclass(frozen=True)
class MeasuredLoop:
    """Cycles that are alike: of one amplitude and, where times are known, of one rate.

    Attributes
    ----------
    path : str                       Of the record; of several the first one's.
    figures : LoopFigures            Of the mean cycle.
    spread : FigureSpread or None    None for a single cycle.
    cycles : int                     Number of cycles.
    frequency : float or None        Mean of the cycles' frequencies [Hz]; None without times.
    gap : float                      Force at the end of the loop less that at its beginning, over the loop's height
                                     [-]; 0 for closed loops. Where a loop is open, as in a first loading, so are the
                                     figures.
    noise : float                    Standard error that the noise of the force gives the energy [J].
    predicted : LoopFigures or None  Of the mean cycle with the force that a model predicts along the same path.
    """

    path: str
    figures: LoopFigures
    spread: FigureSpread | None
    cycles: int
    frequency: float | None
    gap: float = 0.0
    noise: float = 0.0
    predicted: LoopFigures | None = None


def measured_loops(records: Iterable[Record], predictions: Sequence[FloatArray] = ()) -> tuple[MeasuredLoop, ...]:
    """The loops of records in ascending order of amplitude and rate; none of records without a full cycle.

    Cycles whose turning points agree within 3 % of the amplitude, and whose frequencies within 10 %, are averaged, open
    ones only where none is closed. Energies are trapezoidal sums over the samples of the closed loop; peak forces are
    sampled and include noise.

    Parameters
    ----------
    records : iterable of Record
    predictions : sequence of ndarrays   Force that a model predicts along each record [N], shape (K,) each.
    """
    record_of: dict[Cycle, Record] = {}
    predicted: dict[Cycle, Cycle] = {}
    for number, record in enumerate(records):
        cycles = find_cycles(record)
        record_of.update(dict.fromkeys(cycles, record))
        if predictions:
            predicted.update(zip(cycles, find_cycles(replace(record, force=predictions[number])), strict=True))
    groups = (group for alike in group_by_amplitude(record_of) for group in by_rate(alike))
    return tuple(_measured(group, record_of, predicted) for group in groups)


def by_rate(cycles: Sequence[Cycle]) -> list[list[Cycle]]:
    """Cycles of rising frequency, those within a tenth together; those without times are one group."""
    groups: list[list[Cycle]] = []
    for cycle in sorted(cycles, key=lambda cycle: cycle.frequency or 0.0):
        first = groups[-1][0].frequency or 0.0 if groups else -1.0
        if groups and (cycle.frequency or 0.0) <= 1.1 * first:
            groups[-1].append(cycle)
        else:
            groups.append([cycle])
    return groups


def _measured(
    cycles: Sequence[Cycle], record_of: Mapping[Cycle, Record], predicted: Mapping[Cycle, Cycle]
) -> MeasuredLoop:
    group = [cycle for cycle in cycles if cycle.gap == 0.0] or cycles
    frequencies = [cycle.frequency for cycle in group if cycle.frequency is not None]
    # Over the peak-to-peak force where the branches have no distance.
    gaps = [c.gap / (c.figures.height or c.figures.max_force - c.figures.min_force) if c.gap else 0.0 for c in group]
    steps = (np.diff(record_of[c].displacement[c.first_sample : c.last_sample + 1]) for c in group)
    variances = [c.noise**2 * float(np.sum(step**2)) for c, step in zip(group, steps, strict=True)]
    return MeasuredLoop(
        record_of[group[0]].path,
        mean_figures(group),
        spread_of(group),
        len(group),
        float(np.mean(frequencies)) if frequencies else None,
        float(np.mean(gaps)),
        math.sqrt(sum(variances)) / len(group),
        mean_figures([predicted[cycle] for cycle in group]) if predicted else None,
    )


def spread_of(group: Sequence[Cycle]) -> FigureSpread | None:
    """Standard deviation of the figures of cycles; None for a single one."""
    names = FigureSpread.__dataclass_fields__
    columns = ([getattr(cycle.figures, name) for cycle in group] for name in names)
    return FigureSpread(*(float(np.std(column, ddof=1)) for column in columns)) if len(group) > 1 else None
