"""The samples of one or more records as a fit sees them: paths that omega follows, rows that are fitted, folds.

The path is the recorded one, sample by sample, since that is what drives the saved spring. Rows are the samples that
the linear algebra looks at: all of them, or so many spread evenly. Strokes are motion from one reversal of more than a
twentieth of the range of a record to the next; the folds are made of whole strokes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..kernel.arrays import BoolArray, FloatArray, IndexArray
from ..kernel.branches import maxwell_columns
from ..kernel.points import RecordPoints
from ..loops.strokes import Strokes, turning_points
from ..records.record import Record

REVERSAL = 0.05  # of a record's range, from which motion back is a stroke: ten times the noise of a poor sensor
_MOST_BLOCKS = 6  # of consecutive strokes among the folds
_PARTS = 10  # of each stroke, where there are few


@dataclass(frozen=True, eq=False)
class Samples:
    """Samples of records.

    Attributes
    ----------
    records : tuple of Record
    rows : ndarray of int, shape (P,)   Samples that are fitted, numbered through all records.
    reach : (float, float)              Least and greatest displacement of all that may be [m].
    measured : tuple of Record          Where some of `records` are a period that follows itself, those as measured.
    """

    records: tuple[Record, ...]
    rows: IndexArray
    reach: tuple[float, float]
    measured: tuple[Record, ...] = ()

    @classmethod
    def of(
        cls, records: Sequence[Record], most: int, usable: BoolArray | None = None, measured: Sequence[Record] = ()
    ) -> Samples:
        """At most so many rows of some records as measured, of those that are usable, shape (K,), all if None.

        Left out are first strokes of records that begin under load, as their memory is unknown; of three or more.
        """
        samples = cls(tuple(records), np.empty(0, np.intp), (0.0, 0.0), tuple(measured or records))
        used = np.ones(samples.displacement.size, bool) if usable is None else usable.copy()
        for begin, turning, is_loaded in zip(samples.begins[:-1], samples.turning, samples.are_loaded, strict=True):
            if is_loaded and turning.size > 3:
                used[begin : turning[1]] = False
        all_rows = np.flatnonzero(used)
        x = samples.displacement[all_rows]
        return replace(samples, rows=all_rows, reach=(float(x.min()), float(x.max()))).thinned(most)

    def thinned(self, most: int) -> Samples:
        """The same with so many of the rows at most, spread evenly."""
        chosen = np.linspace(0, self.rows.size - 1, min(self.rows.size, most)).astype(np.intp)
        return replace(self, rows=self.rows[chosen])

    def on(self, records: Sequence[Record]) -> Samples:
        """The same rows of other records, of as many samples."""
        return replace(self, records=tuple(records))

    def restored(self, corners: bool) -> Samples:
        """The same rows on paths that turn between samples: where the lines through two samples on either side of a
        reversal meet, or at the vertex of the parabola through it and its neighbours.
        """
        records, shifts, added = [], [], [0]
        for record, turning, begin in zip(self.records, self.turning, self.begins, strict=False):
            places, beyond = _turns_between(record.displacement, turning[1:-1] - begin, corners)
            columns: dict[str, Any] = {
                name: np.insert(column, places, 0.5 * (column[places - 1] + column[places]))
                for name in ("force", "time")
                if (column := getattr(record, name)) is not None
            }
            if record.compared is not None:
                columns["compared"] = np.insert(record.compared, places, values=False)
            records.append(replace(record, displacement=np.insert(record.displacement, places, beyond), **columns))
            shifts.append(added[-1] + np.searchsorted(places, np.arange(len(record)), side="right"))
            added.append(added[-1] + places.size)
        rows = self.rows + np.concatenate(shifts)[self.rows]
        return replace(self, records=tuple(records), rows=rows)

    @cached_property
    def displacement(self) -> FloatArray:
        """Of all records one after the other, shape (K,) [m]."""
        return np.concatenate([record.displacement for record in self.records])

    @cached_property
    def force(self) -> FloatArray:
        """Likewise [N]."""
        return np.concatenate([record.force for record in self.records])

    @cached_property
    def begins(self) -> IndexArray:
        """First sample of each record, and the number of all."""
        return np.concatenate([[0], np.cumsum([len(record) for record in self.records])])

    @cached_property
    def x(self) -> FloatArray:
        """Displacement at the rows, shape (P,) [m]."""
        return self.displacement[self.rows]

    @cached_property
    def r(self) -> FloatArray:
        """Force at the rows, shape (P,) [N]."""
        return self.force[self.rows]

    @cached_property
    def record_of_row(self) -> IndexArray:
        """The record that each row is of."""
        return np.searchsorted(self.begins, self.rows, side="right") - 1

    @cached_property
    def turning(self) -> list[IndexArray]:
        """First sample, reversals and last sample of each record, numbered through all records."""
        return [
            begin + turning_points(record.displacement, REVERSAL * float(np.ptp(record.displacement)))
            for begin, record in zip(self.begins, self.records, strict=False)
        ]

    @cached_property
    def are_loaded(self) -> list[bool]:
        """Whether each record begins under load, so that its memory at first is unknown."""
        return [bool(abs(r.force[0]) > 0.05 * np.ptp(r.force)) for r in self.records]

    @cached_property
    def strokes(self) -> IndexArray:
        """First and last sample of each stroke, shape (S, 2)."""
        return np.concatenate([np.stack([turning[:-1], turning[1:]], 1) for turning in self.turning])

    @cached_property
    def stroke_of_row(self) -> IndexArray:
        """The stroke that each row is on."""
        return np.searchsorted(self.strokes[:, 0], self.rows, side="right") - 1

    @cached_property
    def cycles(self) -> FloatArray:
        """Amplitude [mm] and, where there are times, frequency [Hz] at each stroke, shape (1 or 2, S)."""
        amplitude = 500.0 * np.abs(np.diff(self.displacement[self.strokes.T], axis=0))
        if not self.is_timed:
            return np.asarray(amplitude)
        time = np.concatenate([record.time for record in self.records if record.time is not None])
        # With half of both neighbours, as strokes of one direction may be quicker.
        lasting = np.pad(np.diff(time[self.strokes.T], axis=0)[0], 1, "edge")
        return np.vstack([amplitude, 1.0 / np.maximum(0.5 * (lasting[:-2] + lasting[2:]) + lasting[1:-1], 1e-12)])

    @property
    def is_timed(self) -> bool:
        """Whether all records have times."""
        return all(record.rising_time is not None for record in self.records)

    @cached_property
    def cycle_time(self) -> float:
        """Mean duration of two strokes [s]."""
        return 2.0 * self.duration / len(self.strokes)

    @cached_property
    def duration(self) -> float:
        """Of all records [s]."""
        return float(sum(record.time[-1] - record.time[0] for record in self.records if record.time is not None))

    @cached_property
    def points(self) -> RecordPoints:
        """The rows on the strokes of the path as recorded, where each change of direction begins one."""
        firsts, first_points, columns = [0], [0], []
        for k, record in enumerate(self.records):
            raw = Strokes(record.displacement, turning_points(record.displacement, 0.0))
            here = self.rows[self.record_of_row == k] - self.begins[k]
            stroke = raw.of_sample[here]
            travel = np.abs(raw.path[here] - raw.ends[stroke])
            columns.append((raw.direction, raw.length, stroke + firsts[-1], travel))
            firsts.append(firsts[-1] + raw.count)
            first_points.append(first_points[-1] + here.size)
        return RecordPoints(np.array(firsts), np.array(first_points), *map(np.concatenate, zip(*columns, strict=True)))

    def maxwell(self, time_constant: float) -> FloatArray:
        """Force of a branch of 1 N/m at the rows, and its derivative by ln(tau), shape (2, P) [m]."""
        both = [
            np.concatenate(maxwell_columns([time_constant], record.displacement, record.time))
            for record in self.records
            if record.time is not None
        ]
        return np.concatenate(both, axis=1)[:, self.rows]

    @cached_property
    def folds(self) -> BoolArray:
        """Rows held out together, shape (F, P): blocks of consecutive strokes, strokes of like length, and records."""
        of_row = self.stroke_of_row
        used = np.unique(of_row)
        blocks = used.size if used.size <= _MOST_BLOCKS else min(max(used.size // 2, 4), _MOST_BLOCKS)
        folds = [np.isin(of_row, part) for part in np.array_split(used, blocks)]
        if used.size < _MOST_BLOCKS:
            # Without a stroke the only other in its direction may be gone: of few strokes a tenth, another of each.
            rows = [np.flatnonzero(of_row == stroke) for stroke in used]
            place = np.concatenate([_PARTS * np.arange(of.size) // of.size + 2 * i for i, of in enumerate(rows)])
            folds = [place % _PARTS == k for k in range(_PARTS)]
        ends = self.displacement[self.strokes[used]]
        groups = _groups_of_length(np.abs(ends[:, 1] - ends[:, 0]))
        folds += [np.isin(of_row, used[group]) for group in groups]
        if len(self.records) > 1:
            folds += [self.record_of_row == k for k in range(len(self.records))]
        eighth = self.rows.size // 8
        fewest, beside = min(10, eighth - 1), min(20, 2 * eighth)
        large = [fold for fold in folds if fewest < fold.sum() < self.rows.size - beside]
        # Of very few samples every fifth.
        large = large or [np.arange(self.rows.size) % 5 == k for k in range(5)]
        return np.array(list({fold.tobytes(): fold for fold in large}.values()), bool).reshape(-1, self.rows.size)


def _groups_of_length(length: FloatArray) -> list[BoolArray]:
    """Up to three groups of strokes by their length, divided at the widest gaps; none where all are about as long."""
    if length.max() <= 1.5 * length.min():
        return []
    order = np.sort(np.log(np.maximum(length, 1e-12)))
    gaps = np.diff(order)
    widest = np.sort(np.argsort(gaps)[-2:])
    cuts = order[widest] + 0.5 * gaps[widest]
    if gaps[widest].min() <= 0.1:
        cuts = np.quantile(order, [0.4, 0.75])
    group = np.searchsorted(cuts, np.log(np.maximum(length, 1e-12)))
    return [group == k for k in np.unique(group) if (group == k).mean() < 0.8]


def _turns_between(x: FloatArray, top: IndexArray, corners: bool) -> tuple[IndexArray, FloatArray]:
    """Samples before which a path turns, where that is beyond both neighbours, and the displacements there [m]."""
    side = np.sign(2.0 * x[top] - x[top - 1] - x[top + 1])
    # Crests upwards: two samples on either side.
    y = side * x[np.clip(top + np.arange(-2, 3)[:, None], 0, x.size - 1)]
    later = y[3] >= y[1]
    far, near, following = np.where(later, y[[1, 3, 4]], y[[3, 1, 0]])
    rise, fall, bend = y[2] - far, near - following, 2.0 * y[2] - near - far
    with np.errstate(divide="ignore", invalid="ignore"):
        if corners:
            beyond = rise * np.clip((near + fall - y[2]) / (rise + fall), 0.0, 1.0)
        else:
            beyond = (near - far) ** 2 / (8.0 * bend)
    turns = beyond > 0.0
    return (top + later)[turns], side[turns] * (y[2] + beyond)[turns]
