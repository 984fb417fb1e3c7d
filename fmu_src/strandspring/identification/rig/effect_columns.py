"""What a test rig adds to the force of a spring, as a function of sizes that can be fitted.

Each effect changes the force by its size times a column: the derivative of the force by that size. Delay, play and the
zero of the displacement move the points along the path instead, which is done exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import FloatArray
from ...kernel.branches import maxwell_columns
from ...loops.strokes import Strokes
from ..least_squares.projection import Problem
from ..points.sample_points import SamplePoints, averaged_over, cells_of, join
from ..points.steady_part import SteadyRecord
from ..search.search import Candidate
from .effects import Effect as Effect

Sizes = dict[Effect, FloatArray]

_POWERS = np.arange(1, 4)  # of a curved drift

LOCKED = (Effect.DELAY, Effect.VISCOSITY, Effect.PLAY)  # follow the reversals, much alike on a single amplitude
ZEROS = (Effect.FORCE_ZERO, Effect.DISPLACEMENT_ZERO)  # differ between records, and are much alike
DRIFTS = (Effect.DRIFT, Effect.CURVED_DRIFT)
WEAR = (Effect.FRICTION_WEAR, Effect.STIFFNESS_WEAR)
_TIMED = (Effect.DELAY, Effect.VISCOSITY)
_MOVING = (Effect.DELAY, Effect.PLAY, Effect.DISPLACEMENT_ZERO)
_MOST_DELAY = 0.1  # share of a cycle
_MOST_WEAR = 0.9  # share of the force, lost or gained
_HALF_WINDOW = 3  # samples to either side over which the velocity is taken
# Points that effects are removed from before they are averaged: every sample, unless there are more.
_FINE = 40_000
_FINER = 2  # times as many cells where effects are looked for
# Points up to which all strokes have some: where a spring is sought, and where it is fitted.
_SEARCHED, _FITTED = 20_000, 1_000_000


@dataclass(frozen=True, eq=False)
class _Course:
    """The path of a record in time.

    Attributes
    ----------
    strokes : Strokes
    index, time, velocity : ndarray, shape (K,)   Number, time [s] and velocity [m/s] of the samples; without rising
                                                  times their numbers take the place of times.
    bend : ndarray, shape (2, K - 1)              Of the parabolas about the start and the end of each interval [m].
    """

    strokes: Strokes
    index: FloatArray
    time: FloatArray
    velocity: FloatArray
    bend: FloatArray

    @classmethod
    def from_record(cls, part: SteadyRecord) -> _Course:
        """That of a record."""
        index = np.arange(len(part.record), dtype=np.float64)
        time = index if part.record.rising_time is None else part.record.rising_time
        # By the difference over a few samples of the path, all of one stroke; at a reversal that before it.
        path, turning, stroke = part.strokes.displacement, part.strokes.turning, part.strokes.of_sample
        here = np.arange(time.size)
        half = np.minimum(_HALF_WINDOW, np.minimum(here - turning[stroke], turning[stroke + 1] - here))
        before = np.maximum(here - np.maximum(half, 1), 0)
        after = np.maximum(here + half, before + 1)
        velocity = (path[after] - path[before]) / np.maximum(time[after] - time[before], 1e-300)
        return cls(part.strokes, index, time, velocity, _bends(part.strokes, time))

    def earlier(self, sample: FloatArray, delay: float) -> FloatArray:
        """Place in the path a delay before other places."""
        if delay == 0.0:
            return sample
        return np.interp(np.interp(sample, self.index, self.time) - delay, self.time, self.index)

    def moved(self, loops: SamplePoints, delay: float, whole: bool) -> SamplePoints:
        """Points with the displacement that held a delay earlier, exactly on the path.

        Parameters
        ----------
        loops : SamplePoints   Of this record alone.
        delay : float   [s]
        whole : bool    Points that would lie beyond the ends of the record stay at its ends; they are dropped if not.
        """
        if not whole:
            moment = np.interp(loops.sample, self.index, self.time) - delay
            loops = loops.only((moment >= self.time[0]) & (moment <= self.time[-1]))
        place = self.earlier(loops.sample, delay)
        stroke = self.strokes.of_sample[np.ceil(place).astype(np.intp)]
        x = self._displacement(place)
        travel = np.abs(x - self.strokes.turning_displacement[stroke])
        return replace(loops, displacement=x, stroke=stroke, travel=travel)

    def _displacement(self, place: FloatArray) -> FloatArray:
        """Displacement at places between the samples [m]: the mean of the parabolas about both ends, by distance."""
        interval, share = self._within(place)
        bend = (1.0 - share) * self.bend[0, interval] + share * self.bend[1, interval]
        straight = np.interp(place, self.index, self.strokes.displacement)
        return np.asarray(straight - bend * share * (1.0 - share))

    def slope(self, place: FloatArray) -> FloatArray:
        """Velocity of the same path [m/s]; at a reversal that before it."""
        interval, share = self._within(place)
        early, late = self.bend[:, interval]
        path, time = self.strokes.displacement, self.time
        moved = path[interval + 1] - path[interval]
        moved = moved - early * (1.0 - share) * (1.0 - 3.0 * share) - late * share * (2.0 - 3.0 * share)
        return np.asarray(moved / np.maximum(time[interval + 1] - time[interval], 1e-300))

    def branch(self, time_constant: float) -> tuple[FloatArray, FloatArray]:
        """Deflection of the spring of a Maxwell branch at the samples, and its derivative by ln(time constant) [m]."""
        deflection, derivative = maxwell_columns([time_constant], self.strokes.displacement, self.time)
        return deflection[0], derivative[0]

    def _within(self, place: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
        """The interval before each sample, or about each place between samples, and the share of it that is over."""
        interval = np.maximum(np.ceil(place).astype(np.intp) - 1, 0)
        return interval, place - interval


def _bends(strokes: Strokes, time: FloatArray) -> FloatArray:
    """What the parabolas about the ends of each interval leave a straight line by, shape (2, K - 1) [m].

    A parabola through a sample and both its neighbours, which lie on one stroke; at a reversal that about the other end
    of the interval takes its place. It is bounded such that the path does not turn within an interval.
    """
    step, moved = np.maximum(np.diff(time), 1e-300), np.diff(strokes.displacement)
    # Second divided difference at each sample, none at the ends of strokes.
    second = np.zeros(time.size)
    second[1:-1] = np.diff(moved / step) / (step[1:] + step[:-1])
    inner = np.ones(time.size, dtype=bool)
    inner[strokes.turning] = False
    ends = np.stack([second[:-1], second[1:]])
    known = np.stack([inner[:-1], inner[1:]])
    bend = np.where(known, ends, np.where(known[::-1], ends[::-1], 0.0)) * step**2
    return np.asarray(np.clip(bend, -np.abs(moved), np.abs(moved)))


@dataclass(frozen=True, eq=False)
class Rig:
    """Points of the records of a test with what the effects of its rig depend on.

    Attributes
    ----------
    loops : SamplePoints           As measured, but for a known delay.
    parts : tuple of SteadyRecord
    fine : tuple of SamplePoints   Of each record before the points were averaged.
    points : int or None           Cells of a stroke that they are averaged over; None if they are not.
    courses : tuple of _Course     Of each record.
    delay : float or None          By which the force lags as far as it is known; the points allow for it [s].
    kept : frozenset of Effect     Effects that are left in the records.
    worn : float                   Share of the cycles after which the spring is described that changes during them.
    drifted : tuple of float       Share of the test after which it is, its square and its cube.
    zeroed : tuple of float        Shares that the zeros of the records have in the zero that it is described with, of
                                   all records but the first; of all the first if empty.
    """

    loops: SamplePoints
    parts: tuple[SteadyRecord, ...]
    fine: tuple[SamplePoints, ...]
    points: int | None
    courses: tuple[_Course, ...]
    delay: float | None = None
    kept: frozenset[Effect] = frozenset()
    worn: float = 0.0
    drifted: tuple[float, ...] = (0.0, 0.0, 0.0)
    zeroed: tuple[float, ...] = ()

    @classmethod
    def from_parts(cls, parts: Sequence[SteadyRecord], points: int | None, delay: float | None = None) -> Rig:
        """The rig of some records for a search: their steady parts, averaged over so many points of a stroke, or every
        sample; of very many strokes a part.
        """
        return cls._of(tuple(parts), tuple(map(_Course.from_record, parts)), points, delay, _SEARCHED)

    @classmethod
    def _of(
        cls,
        parts: tuple[SteadyRecord, ...],
        courses: tuple[_Course, ...],
        points: int | None,
        delay: float | None,
        most: int,
    ) -> Rig:
        strokes = sum(part.strokes.count for part in parts)
        if points is None:
            fine = tuple(part.all_samples() for part in parts)
        else:
            share = min(1.0, most / (strokes * points))
            fine, coarse = (
                tuple(part.loops_with(cells).part_of_cycles(share) for part in parts)
                for cells in (max(points, _FINE // strokes), points)
            )
        loops = join(list(fine if points is None else coarse))
        rig = cls(loops, parts, fine, points, courses)
        return replace(rig, loops=rig._moved(delay, {}), delay=delay) if delay else replace(rig, delay=delay)

    def with_points(self, points: int | None) -> Rig:
        """The same rig with strokes averaged over another number of points, or every sample."""
        other = Rig._of(self.parts, self.courses, points, self.delay, _FITTED)
        return replace(other, kept=self.kept, worn=self.worn, drifted=self.drifted, zeroed=self.zeroed)

    def keeping(self, effects: Iterable[Effect]) -> Rig:
        """The same rig with these effects left in the records, too."""
        return replace(self, kept=self.kept | frozenset(effects))

    def describing(self, state: str) -> Rig:
        """The same rig for the spring in another of STATES than at first, with sizes of `sizes_here`."""
        if state == "first":
            return replace(self, worn=0.0, drifted=(0.0, 0.0, 0.0), zeroed=())
        if state == "last":
            zeroed = (*[0.0] * (len(self.parts) - 2), 1.0) if len(self.parts) > 1 else ()
            return replace(self, worn=1.0, drifted=(1.0, 1.0, 1.0), zeroed=zeroed)
        weight = self.loops.weight
        drifted = np.average(self.elapsed(self.loops)[:, None] ** _POWERS, axis=0, weights=weight)
        of_record = [float(weight[points].sum()) for _, points in self.loops.by_record]
        return replace(
            self,
            worn=float(np.average(_cycles_over(self.loops), weights=weight)),
            drifted=tuple(drifted.tolist()),
            zeroed=tuple(count / sum(of_record) for count in of_record[1:]),
        )

    def sizes_here(self, sizes: Sizes) -> Sizes:
        """Sizes of wear, which are shares of the force at first, as shares of that of the spring described."""
        return {e: size / (1.0 + self.worn * size) if e in WEAR else size for e, size in sizes.items()}

    def finer(self) -> Rig:
        """With every sample, or cells of half the width where strokes have more samples than that.

        Points that effects move from cell to cell make the misfit of wide cells rugged.
        """
        if self.points is None:
            return self
        rig = replace(self, points=_FINER * self.points)
        return replace(rig, loops=rig._moved(self.delay or 0.0, {}))

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Those that the records can show."""
        if any(part.periodic for part in self.parts):
            return ()
        impossible: tuple[Effect, ...] = tuple(self.kept)
        if any(part.record.rising_time is None for part in self.parts):
            impossible += _TIMED
        if self.delay is not None:
            impossible += (Effect.DELAY,)
        if len(self.parts) == 1:
            impossible += ZEROS
        return tuple(effect for effect in Effect if effect not in impossible)

    def velocity(self, loops: SamplePoints) -> FloatArray:
        """Velocity of the path at the points, shape (P,) [m/s]; of no use without rising times."""
        return self._at(loops, 0.0, lambda course, place: np.interp(place, course.index, course.velocity))

    def _at(self, loops: SamplePoints, delay: float, value: Callable[[_Course, FloatArray], FloatArray]) -> FloatArray:
        """What belongs to places in the courses, at the points or a delay earlier, besides the known one [s]."""
        delay += self.delay or 0.0
        return np.concatenate(
            [
                value(course, course.earlier(loops.sample[at], delay))
                for course, (_, at) in zip(self.courses, loops.by_record, strict=True)
            ],
            axis=-1,
        )

    def elapsed(self, loops: SamplePoints) -> FloatArray:
        """Share of the test that is over at the points, 0 to 1: in time, or in samples where a record has no times."""
        elapsed = np.empty(loops.force.size)
        begun = 0.0
        timed = all(part.record.rising_time is not None for part in self.parts)
        for course, (_, at) in zip(self.courses, loops.by_record, strict=True):
            # Seconds and sample numbers do not add up: where one record has no times, samples count in all.
            clock = course.time - course.time[0] if timed else course.index
            elapsed[at] = begun + np.interp(loops.sample[at], course.index, clock)
            begun += float(clock[-1])
        return elapsed / begun

    def branch(self, loops: SamplePoints, time: float) -> FloatArray:
        """Spring deflection q of a Maxwell branch at the points, dq/dt = dx/dt - q/time, and dq/d(ln time), (2, P) [m].

        It begins at 0 with each record, and the displacement moves at constant velocity between the samples.
        """

        def at(course: _Course, place: FloatArray) -> FloatArray:
            return np.stack([np.interp(place, course.index, values) for values in course.branch(time)])

        return self._at(loops, 0.0, at)

    def durations(self, loops: SamplePoints) -> FloatArray:
        """Duration of each stroke [s], shape (S,); of samples where there are no times."""
        ends = [course.time[course.strokes.turning] for course in self.courses]
        durations = np.concatenate([np.diff(moments) for moments in ends])
        return durations if durations.size == loops.length.size else np.ones(loops.length.size)

    @property
    def period(self) -> float:
        """Mean duration of two strokes [s]."""
        duration = sum(float(course.time[-1] - course.time[0]) for course in self.courses)
        return 2.0 * duration / sum(part.strokes.count for part in self.parts)

    def plain_columns(self, effect: Effect, loops: SamplePoints) -> FloatArray:
        """Derivatives of the force by the sizes of an effect that does not depend on the spring, shape (P, sizes)."""
        match effect:
            case Effect.VISCOSITY:
                return self.velocity(loops)[:, None]
            case Effect.DRIFT:
                return self.elapsed(loops)[:, None] - self.drifted[0]
            case Effect.CURVED_DRIFT:
                return np.asarray(self.elapsed(loops)[:, None] ** _POWERS - self.drifted)
            case _:
                others = np.arange(1, len(self.parts))
                of_record = np.asarray(loops.record[loops.stroke][:, None] == others, np.float64)
                return of_record - self.zeroed if self.zeroed else of_record

    def columns(self, effect: Effect, fit: Candidate, loops: SamplePoints, delay: float = 0.0) -> FloatArray:
        """Derivatives of the force by the sizes of any effect, shape (P, sizes).

        Parameters
        ----------
        effect : Effect
        fit : Candidate   Of these points.
        loops : SamplePoints   As placed.
        delay : float     Of which they were placed, besides the known one [s].
        """
        h, backbone, omega = fit.hysteresis, fit.refinement.backbone, fit.refinement.omega
        if effect is Effect.FRICTION_WEAR:
            return np.asarray(((_cycles_over(loops) - self.worn) * omega * backbone.G)[:, None])
        if effect is Effect.STIFFNESS_WEAR:
            over = _cycles_over(loops) - self.worn
            return np.asarray((over * (backbone.FE - np.mean(backbone.FE)))[:, None])
        if effect not in _MOVING:
            return self.plain_columns(effect, loops)
        of_elastic, of_amplified = fit.basis.slopes(loops.displacement, backbone.elastic, backbone.amplified)
        slope = of_elastic + omega * of_amplified
        if effect is Effect.DISPLACEMENT_ZERO:
            return np.asarray(-slope[:, None] * self.plain_columns(Effect.FORCE_ZERO, loops))
        u = loops.side * omega
        growth = backbone.G * h.rho * (1.0 - np.where(u >= 0.0, 1.0, 1.0 - 2.0 * h.sigma) * np.abs(u) ** h.n)
        if effect is Effect.PLAY:
            return np.asarray(-(loops.side * (0.5 * slope + growth))[:, None])
        return np.asarray(-((slope + growth) * self._at(loops, delay, _Course.slope))[:, None])

    def placed(self, sizes: Sizes) -> SamplePoints:
        """The points where the spring itself was when their force arose."""
        if not any(effect in sizes for effect in _MOVING):
            return self.loops
        return self._moved((self.delay or 0.0) + float(sizes.get(Effect.DELAY, [0.0])[0]), sizes)

    def _moved(self, delay: float, sizes: Sizes) -> SamplePoints:
        """The points after a delay, play and zeros of the displacement; averaged last, as these move single samples.

        Those that were measured in one cell are averaged, so that sizes hardly change how much noise is left.
        """
        play = float(sizes.get(Effect.PLAY, [0.0])[0])
        shifts = sizes.get(Effect.DISPLACEMENT_ZERO, np.zeros(len(self.parts) - 1))
        zeros = np.append(0.0, shifts) - (shifts @ self.zeroed if self.zeroed else 0.0)
        pieces = []
        for loops, course, zero in zip(self.fine, self.courses, zeros.tolist(), strict=True):
            moved = course.moved(loops, delay, whole=self.points is None) if delay else loops
            kept = np.searchsorted(loops.sample, moved.sample) if delay else slice(None)
            moved = _followed(moved, play) if play else moved
            moved = _shifted(moved, zero) if zero else moved
            cells = None if self.points is None else cells_of(loops, self.points)
            pieces.append(moved if cells is None else averaged_over(moved, cells[kept]))
        return join(pieces)

    def added(self, sizes: Sizes, fit: Candidate | None, loops: SamplePoints) -> FloatArray:
        """Force that the other effects add at the points, shape (P,) [N].

        Parameters
        ----------
        sizes : dict
        fit : Candidate or None   Of these points; needed for effects that depend on the spring.
        loops : SamplePoints      As placed.
        """
        force = np.zeros(loops.force.size)
        for effect, size in sizes.items():
            if effect not in _MOVING:
                columns = self.plain_columns(effect, loops) if fit is None else self.columns(effect, fit, loops)
                force += columns @ size
        return force

    def is_possible(self, sizes: Sizes) -> bool:
        """Whether the sizes of effects that move the points are within what a rig can do.

        A delay is below a tenth of a cycle, a play below half of the longest stroke, a shift of the zero between
        records within the displacements of all of them, and the force does not wear away or double.
        """
        delay, play = (float(sizes.get(effect, [0.0])[0]) for effect in (Effect.DELAY, Effect.PLAY))
        shift = float(np.max(np.abs(sizes.get(Effect.DISPLACEMENT_ZERO, [0.0]))))
        low, high = self.loops.reach
        wear = max(abs(float(sizes.get(effect, [0.0])[0])) for effect in WEAR)
        moves = abs(delay) < _MOST_DELAY * self.period and play < 0.5 * self.loops.longest and shift <= high - low
        return moves and wear < _MOST_WEAR

    def corrected(self, sizes: Sizes, fit: Candidate | None) -> SamplePoints:
        """The points as a rig without these effects would have measured them.

        Parameters
        ----------
        sizes : dict
        fit : Candidate or None   Of other points of the same records; needed for effects that depend on the spring.
        """
        loops = self.placed(sizes)
        if fit is not None:
            fit = transferred(fit, loops) if wears(sizes) else None
        return replace(loops, force=loops.force - self.added(sizes, fit, loops))

    def predicted(self, sizes: Sizes, fit: Candidate) -> tuple[Candidate, FloatArray]:
        """A fit of other points of the same records at these points, and the force that the rig measures there [N]."""
        loops = self.placed(sizes)
        fit = transferred(fit, loops)
        return fit, fit.refinement.backbone.force(fit.refinement.omega) + self.added(sizes, fit, loops)


def wears(sizes: Sizes) -> bool:
    """Whether an effect that moves no points depends on the spring."""
    return any(effect in sizes for effect in WEAR)


def _followed(loops: SamplePoints, play: float) -> SamplePoints:
    """The points of a spring that follows the measured path with a play [m]."""
    start = loops.start + 0.5 * play * loops.direction
    travel = np.maximum(loops.travel - play, 0.0)
    at = np.asarray(start[loops.stroke] + loops.side * travel, np.float64)
    length = np.maximum(loops.length - play, 1e-6 * loops.length)
    return replace(loops, displacement=at, travel=travel, start=start, length=length)


def _shifted(loops: SamplePoints, zero: float) -> SamplePoints:
    """The points in coordinates that begin at a displacement [m]."""
    return replace(loops, displacement=loops.displacement - zero, start=loops.start - zero)


def transferred(fit: Candidate, loops: SamplePoints, coarse: bool = False) -> Candidate:
    """A fit at other points of the same records; omega to 1e-8 only, as it was fitted, if coarse."""
    refinement = Problem(loops, fit.basis, fit.hysteresis, coarse=coarse).at(fit.refinement)
    return replace(fit, refinement=refinement)


def _cycles_over(loops: SamplePoints) -> FloatArray:
    """Share of the cycles that are over at each point; the ends of a record may be parts of a stroke only."""
    share = np.ones(loops.length.size)
    for strokes, _ in loops.by_record:
        length = loops.length[strokes]
        if length.size > 1:
            share[strokes.start] = min(1.0, float(length[0] / length[1]))
            share[strokes.stop - 1] = min(1.0, float(length[-1] / length[-2]))
    over = np.cumsum(share) - share
    return np.asarray(
        (over[loops.stroke] + share[loops.stroke] * loops.travel / loops.length[loops.stroke]) / share.sum()
    )
