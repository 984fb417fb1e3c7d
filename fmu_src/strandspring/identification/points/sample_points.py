"""The strokes of one or more records as weighted points, the form every identification works on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, starmap

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import FloatArray
from ...kernel.points import RecordPoints
from ...loops.strokes import Strokes

IndexArray = NDArray[np.intp]

# A stroke with more samples than this is averaged over cells of travel; the cells are narrow after the reversal,
# where the force bends most.
POINTS_PER_STROKE = 160
_REMEMBERED = 64  # strokes
ONE_AMPLITUDE = 0.9  # smallest amplitude in the largest from which there is one only


@dataclass(frozen=True, eq=False)
class SamplePoints:
    """P points on S strokes; a stroke may have no points and still carry the memory to the next.

    Attributes
    ----------
    displacement, force, weight : ndarray, shape (P,)   [m], [N], number of samples behind the point.
    travel : ndarray, shape (P,)        Distance from the reversal before [m], rising within a stroke.
    stroke : ndarray of int, shape (P,) Stroke of each point, ascending.
    sample : ndarray, shape (P,)        Mean place of the samples behind the point in the path of its record.
    direction, start, length : ndarray, shape (S,)      +1 or -1, where it begins [m], how long it is [m].
    record : ndarray of int, shape (S,) Record of each stroke; the memory starts anew with each record.
    selected : (float, float)           Displacements among which the points were selected [m].
    """

    displacement: FloatArray
    force: FloatArray
    weight: FloatArray
    travel: FloatArray
    stroke: IndexArray
    sample: FloatArray
    direction: NDArray[np.int64]
    start: FloatArray
    length: FloatArray
    record: IndexArray
    selected: tuple[float, float] = (-math.inf, math.inf)

    @cached_property
    def side(self) -> NDArray[np.int64]:
        """+1 on loading points, -1 on unloading points, shape (P,)."""
        return self.direction[self.stroke]

    @cached_property
    def bounds(self) -> IndexArray:
        """First point of each stroke that has points, and the number of all."""
        changes = np.flatnonzero(self.stroke[1:] != self.stroke[:-1]) + 1
        return np.concatenate([[0], changes, [self.stroke.size]])

    @cached_property
    def used(self) -> IndexArray:
        """The strokes that have points."""
        return self.stroke[self.bounds[:-1]]

    @cached_property
    def reach(self) -> tuple[float, float]:
        """Lowest and highest displacement of the strokes that have points [m], as far as they are selected.

        Averaged points stay within it.
        """
        used = self.used
        ends = np.concatenate([self.start[used], (self.start + self.direction * self.length)[used]])
        low, high = self.selected
        return max(low, float(ends.min())), min(high, float(ends.max()))

    @cached_property
    def longest(self) -> float:
        """Length of the longest stroke that has points [m]."""
        return float(self.length[self.used].max())

    @cached_property
    def shortest(self) -> float:
        """Length of the shortest stroke that has points [m]; first and last of a record, often cut, do not count."""
        of_records = np.split(self.used, np.searchsorted(self.used, [strokes.stop for strokes, _ in self.by_record]))
        whole = [used[1:-1] if used.size > 2 else used for used in of_records]
        return float(self.length[np.concatenate(whole)].min())

    @property
    def has_one_amplitude(self) -> bool:
        """Whether all strokes are about as long as the longest."""
        return self.shortest >= ONE_AMPLITUDE * self.longest

    @cached_property
    def force_deviation(self) -> float:
        """Weighted standard deviation of the force at the points [N]."""
        return self.rms(self.force - np.average(self.force, weights=self.weight))

    def rms(self, values: FloatArray) -> float:
        """Root of the weighted mean square of values at the points."""
        return float(np.sqrt(self.weight @ values**2 / self.weight.sum()))

    def work(self, force: FloatArray) -> float:
        """Work of a force along the strokes [J], by the trapezoidal rule between points of one stroke."""
        within = np.diff(self.stroke) == 0
        return float(np.sum((0.5 * (force[1:] + force[:-1]) * np.diff(self.displacement))[within]))

    def omega(self, rho: float, sigma: float, n: float) -> FloatArray:
        """omega at every point to 1e-8 by the closed form, each record starting from omega = 0."""
        return np.asarray(self.points.omega_by_rate(np.array([rho]), sigma, n)[0])

    @cached_property
    def points(self) -> RecordPoints:
        """The points as the kernel takes them."""
        first_stroke, first_point = (
            np.array([0, *(piece.stop for piece in pieces)]) for pieces in zip(*self.by_record, strict=True)
        )
        # Of strokes without points those that points remember count; others are left out two by two.
        strokes = np.arange(self.length.size)
        ahead = np.append(self.used, strokes[-1] + 2 * _REMEMBERED)[np.searchsorted(self.used, strokes)] - strokes
        kept = ahead <= _REMEMBERED
        beside = strokes + 1 - 2 * ((strokes - first_stroke[self.record]) % 2)
        kept |= kept[np.minimum(beside, strokes[-1])] & (beside < first_stroke[self.record + 1])
        place = np.append(0, np.cumsum(kept))
        return RecordPoints(
            place[first_stroke], first_point, self.direction[kept], self.length[kept], place[self.stroke], self.travel
        )

    def sums_of_records(self, values: FloatArray) -> FloatArray:
        """Sums over the points of each record, shape (R, ...), of values at the points, shape (P, ...)."""
        first, end = np.array([(points.start, points.stop) for _, points in self.by_record]).T
        sums = np.zeros((first.size, *values.shape[1:]))
        sums[first < end] = np.add.reduceat(values, first[first < end])
        return sums

    def unit_vectors(self, column: FloatArray) -> FloatArray:
        """A column, shape (P,), divided by its length in each of the records; 0 where it is."""
        length = np.sqrt(self.sums_of_records(column**2))
        return np.asarray(column / np.where(length > 0.0, length, 1.0)[self.record[self.stroke]])

    def beside_starts(self, columns: FloatArray, start: FloatArray) -> FloatArray:
        """What of columns, shape (P, C), does not lie along one, shape (P,), in each of the records.

        Coefficients that each record has for itself, as its omega_start, are eliminated by that.
        """
        unit = self.unit_vectors(start)[:, None]
        return np.asarray(columns - unit * self.sums_of_records(unit * columns)[self.record[self.stroke]])

    def cycles(self) -> IndexArray:
        """Cycle of each point: two strokes of one record, a last single stroke belonging to the cycle before it."""
        cycle = np.zeros(self.stroke.size, np.intp)
        first = 0
        for _, points in self.by_record:
            if points.start == points.stop:  # nothing of this record is left
                continue
            stroke = self.stroke[points] - self.stroke[points.start]
            count = max(1, (int(stroke[-1]) + 1) // 2)
            cycle[points] = first + np.minimum(stroke // 2, count - 1)
            first += count
        return cycle

    def part_of_cycles(self, share: float) -> SamplePoints:
        """Those on a share of the cycles of one record, drawn two by two, and on those of the extreme strokes."""
        if share >= 1.0:
            return self
        pair = self.cycles() // 2
        count = int(pair[-1]) + 1
        draws = np.random.default_rng(0).uniform(size=round(count * share))
        drawn = np.floor((np.arange(draws.size) + draws) / share)
        length, end = (values[self.used] for values in (self.length, self.start + self.direction * self.length))
        extreme = [self.bounds[place] for values in (length, end) for place in (values.argmin(), values.argmax())]
        return self.only(np.isin(pair, [*drawn, *pair[extreme]]))

    def only(self, kept: NDArray[np.bool_]) -> SamplePoints:
        """Some of the points; the strokes all stay."""
        names = ("displacement", "force", "weight", "travel", "stroke", "sample")
        return replace(self, **{name: getattr(self, name)[kept] for name in names})

    @cached_property
    def by_record(self) -> list[tuple[slice, slice]]:
        """The strokes and the points of each record."""
        strokes = np.searchsorted(self.record, np.arange(int(self.record[-1]) + 2))
        points = np.searchsorted(self.stroke, strokes)
        return list(
            zip(starmap(slice, pairwise(strokes.tolist())), starmap(slice, pairwise(points.tolist())), strict=True)
        )


def gather(
    strokes: Strokes,
    force: FloatArray,
    first_used: int,
    points: int = POINTS_PER_STROKE,
    usable: NDArray[np.bool_] | None = None,
) -> SamplePoints:
    """Points of one record, averaged where a stroke has many samples.

    Parameters
    ----------
    strokes : Strokes
    force : ndarray, shape (K,)   [N]
    first_used : int              Strokes before this one carry memory only.
    points : int                  A stroke with more samples is averaged over this many cells.
    usable : ndarray of bool, shape (K,), or None   Samples that become points; all if None.
    """
    used = strokes.of_sample >= first_used
    used[0] = first_used == 0
    if usable is not None:
        used &= usable
    # Travel rises within a stroke because the displacement was made monotone.
    samples = SamplePoints(
        strokes.displacement[used], force[used], np.ones(np.count_nonzero(used)), strokes.travel[used],
        strokes.of_sample[used], np.flatnonzero(used).astype(np.float64),
        strokes.direction, strokes.turning_displacement[:-1], strokes.length, np.zeros(strokes.count, np.intp),
    )  # fmt: skip
    cells = cells_of(samples, points)
    return samples if cells is None else averaged_over(samples, cells)


def cells_of(loops: SamplePoints, points: int) -> IndexArray | None:
    """Cell of each point of one record, numbered on from stroke to stroke; None where none has more points than cells.

    Parameters
    ----------
    loops : SamplePoints
    points : int    Cells of a stroke.
    """
    if np.bincount(loops.stroke).max(initial=0) <= points:
        return None
    share = np.sqrt(np.minimum(loops.travel / loops.length[loops.stroke], 1.0))
    return np.asarray(loops.stroke * points + np.minimum((share * points).astype(np.intp), points - 1))


def averaged_over(loops: SamplePoints, cells: IndexArray) -> SamplePoints:
    """The points of one record, averaged over runs of one stroke and one cell, however they have been moved since."""
    is_first = np.ones(cells.size, dtype=bool)
    is_first[1:] = (cells[1:] != cells[:-1]) | (loops.stroke[1:] != loops.stroke[:-1])
    begins = np.flatnonzero(is_first)
    weight = np.add.reduceat(loops.weight, begins)
    x, r, s, sample = (
        np.add.reduceat(loops.weight * column, begins) / weight
        for column in (loops.displacement, loops.force, loops.travel, loops.sample)
    )
    stroke = loops.stroke[begins]
    return replace(loops, displacement=x, force=r, weight=weight, travel=s, stroke=stroke, sample=sample)


def join(parts: Sequence[SamplePoints]) -> SamplePoints:
    """The loops of several records of one spring as one."""
    if len(parts) == 1:
        return parts[0]
    counts = [part.direction.size for part in parts]
    offsets = np.cumsum([0, *counts[:-1]])

    def column(name: str) -> FloatArray:
        return np.concatenate([getattr(part, name) for part in parts])

    return SamplePoints(
        column("displacement"), column("force"), column("weight"), column("travel"),
        np.concatenate([part.stroke + offset for part, offset in zip(parts, offsets, strict=True)]),
        column("sample"),
        np.concatenate([part.direction for part in parts]),
        column("start"), column("length"),
        np.repeat(np.arange(len(parts)), counts),
        (min(part.selected[0] for part in parts), max(part.selected[1] for part in parts)),
    )  # fmt: skip
