"""What a saved spring may be wrong by: a single force on recorded paths, loops that were not recorded, what it misses.

The 95 % interval of a measured force F is +- sqrt(q^2*(a^2 + (b*F)^2) + z^2*max(0, e^2 - m^2)): a and b are the parts
of the residuals, noise and misfit together, that do not grow and that grow with the force, q is calibrated on blocks of
strokes that were held out, and the last term, of the standard error e of the prediction and the largest one m along the
records, widens it where a path asks for more than these have shown.

Loops that were not recorded are judged by rivals: all classes and minima whose held-out errors are those of the best
fit within their standard error or 1 %. They agree along the records, and where they do not agree nothing is known.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..kernel.arrays import FloatArray
from ..loops.strokes import noise_level
from ..model.joint import LEVEL
from ..records.record import Record
from .bases import AMPLIFIER, ELASTIC, fraction, step_on
from .choice import NO_WORSE, Allowed, Choice, Judged, Search, difference
from .figures import autocorrelation_time, growing_variance, white_variance
from .fit import NOISE_ONLY, Fit, Problem
from .samples import BoolArray, IndexArray, Samples

NORMAL_95 = 1.959964  # 97.5 % quantile
AMPLITUDE = 0.3  # of small loops, share of half the range
BEYOND = 1.2  # where the force beyond the range is judged, in halves of it
_TOO_LITTLE = 0.9  # share of held-out samples below which the interval is called too narrow
_INDEPENDENT = 6.0  # samples at least, which Student's quantile is for
_CLOSED = 0.05  # difference of two strokes in a closed loop, share of one
_CYCLES, _STEPS = 10, 60  # of small loops, until they are steady, and steps of a stroke
# Reversals of nested loops after a full cycle, in halves of the range.
_NESTED = (1.0, -1.0, 0.6, -0.2, 0.6, -0.3, 0.3, -0.3, 0.3, 0.2, 0.8, 0.2, 0.8, -1.0)
_ALIKE = (1.5, 0.7)  # longest stroke in their median, and shortest fifth in the longest, of one amplitude
# rho*h, sigma - 1/2 and n where further minima are sought.
_ELSEWHERE = ((1.0, 4.0, 20.0, 100.0), (0.05, 0.6, 5.0), (0.2, 1.0, 5.0))
_STARTS, _WORSE = 4, 1.3  # minima that are sought, and squared misfit in the best up to which one is judged
_APART = 0.2  # difference of a logarithm between two minima
_TURNS, _ENDS = 0.15, 0.8  # travel of a stroke after its turn, and |y| from which a place is at an end
_PLACES = {
    "turns": "after turns", "ends": "at the ends of the range", "cycles": "from cycle to cycle",
    "speed": "with the speed", "record": "in one record",
}  # fmt: skip
_WHITE = 2.0  # autocorrelation time up to which residuals are white
_THERE = 0.25  # share of the misfit that lies in one place beside an even one, from which it is named


@dataclass(frozen=True)
class ForceInterval:
    """95 % interval of a measured force.

    Attributes
    ----------
    factor, additive, relative : float   q [-], a [N], b [-].
    error : float                        m, the largest standard error of the prediction along the records [N].
    half_width : float                   Root mean square over the records [N].
    held_out_coverage : float or None    Share of the samples of each held-out block inside the interval that the others
                                         give; None without blocks.
    held_out_cycles : float              Number of cycles that were held out, block by block.
    """

    factor: float
    additive: float
    relative: float
    error: float
    half_width: float
    held_out_coverage: float | None
    held_out_cycles: float

    @classmethod
    def of(cls, problem: Problem, fit: Fit, force_error: FloatArray, time: float) -> ForceInterval:
        """That of a fit, given standard errors at the rows [N] and the autocorrelation time of its residuals."""
        residuals, block = _held_out(problem, fit)
        force = problem.samples.r + _residuals(problem, fit)
        residuals, counted = residuals[block >= 0], block[block >= 0]
        additive, relative = growing_variance(force[block >= 0], residuals)
        scale = np.sqrt(additive + relative * force**2)
        ratio = np.abs(residuals) / scale[block >= 0]
        independent = max(ratio.size / time, _INDEPENDENT)
        wider = student_95(independent) / NORMAL_95
        held = [
            np.mean(ratio[counted == k] <= wider * np.quantile(ratio[counted != k], LEVEL)) * np.mean(counted == k)
            for k in np.unique(counted)
            if (counted != k).any()
        ]
        factor = wider * float(np.quantile(ratio, LEVEL))
        return cls(
            factor, math.sqrt(additive), math.sqrt(relative), float(force_error.max()),
            factor * float(np.sqrt(np.mean(scale**2))), float(sum(held)) if held else None,
            0.5 * len(problem.samples.strokes),
        )  # fmt: skip

    @property
    def sentence(self) -> str:
        """The interval with what it held, in words."""
        share, narrow = self.held_out_coverage, ": it is too narrow" if self.is_too_narrow else ""
        held = "not tried on held-out strokes" if share is None else f"holds {100.0 * share:.0f} % of held-out strokes"
        return f"95 % prediction interval +- {self.half_width:.2g} N, {held}{narrow}"

    @property
    def is_too_narrow(self) -> bool:
        """Whether it held clearly less than it says of what was held out."""
        return self.held_out_coverage is not None and self.held_out_coverage < _TOO_LITTLE

    def reach(self, force: FloatArray, error: FloatArray) -> FloatArray:
        """Half-width [N] at predicted forces [N] of these standard errors [N]."""
        scale = self.additive**2 + (self.relative * force) ** 2
        beyond = np.maximum(error**2 - self.error**2, 0.0)
        return np.asarray(np.sqrt(self.factor**2 * scale + NORMAL_95**2 * beyond))

    def as_json(self) -> dict[str, Any]:
        """Content of the model file's field `uncertainty.prediction_interval`."""
        return {"level": LEVEL, **asdict(self)}

    @classmethod
    def from_uncertainty(cls, uncertainty: Mapping[str, Any]) -> ForceInterval | None:
        """The interval in a checked `uncertainty` of a model file; None if it holds none."""
        given = uncertainty.get("prediction_interval")
        return given and cls(**{field.name: given.get(field.name) for field in fields(cls)})


@dataclass(frozen=True, eq=False)
class PredictionBand:
    """The last closed loop of the fit with the 95 % confidence band of its mean force and the 95 % prediction interval.

    Attributes
    ----------
    displacement, low, force, high : ndarray, shape (B,)   In the order of the path [m], [N].
    reach : ndarray, shape (B,)                            Half-width of the prediction interval [N].
    """

    displacement: FloatArray
    low: FloatArray
    force: FloatArray
    high: FloatArray
    reach: FloatArray

    @classmethod
    def of(cls, problem: Problem, fit: Fit, force_error: FloatArray, interval: ForceInterval) -> PredictionBand:
        """The band on the last two strokes that make a closed loop; on the last two if there is none."""
        samples = problem.samples
        stroke = samples.stroke_of_row
        ends = samples.displacement[samples.strokes]
        alike = np.abs(ends[:-1, 0] - ends[1:, 1]) < _CLOSED * np.abs(ends[1:, 1] - ends[1:, 0])
        joined = samples.strokes[:-1, 1] == samples.strokes[1:, 0]
        closed = np.flatnonzero(alike & joined & np.isin(np.arange(alike.size), stroke))
        first = int(closed[-1]) if closed.size else max(int(stroke[-1]) - 1, 0)
        last = (stroke == first) | (stroke == first + 1)
        force, error = (samples.r + _residuals(problem, fit))[last], force_error[last]
        sure = NORMAL_95 * error
        return cls(samples.x[last], force - sure, force, force + sure, interval.reach(force, error))


@dataclass(frozen=True)
class Unrecorded:
    """What loops may do that were not recorded, by all fits that predict held-out strokes as well.

    Attributes
    ----------
    amplitude, energy, low, high : float   Of small loops about mid-range [m], their energy a cycle and its range [J].
    nested : float                 Largest rms difference of the force on nested loops, share of the force's deviation.
    beyond : tuple of (x, force, low, high)   Force beyond either end of the range [m], [N].
    rivals : int                   Number of fits that predict as well, beside the best.
    one_amplitude : bool           Whether all recorded loops are of about one amplitude, which leave small ones open.
    """

    amplitude: float
    energy: float
    low: float
    high: float
    nested: float
    beyond: tuple[tuple[float, float, float, float], ...]
    rivals: int
    one_amplitude: bool

    @property
    def sentence(self) -> str:
        """The energy of small loops and its range in words."""
        return (
            f"loops of {1e3 * self.amplitude:.3g} mm take {self.energy:.3g} J a cycle, {self.low:.2g} to "
            f"{self.high:.2g} J by all springs that predict as well"
        )

    @classmethod
    def of(cls, choice: Choice, root: FloatArray, missed: float) -> Unrecorded:
        """By a choice, the root of the covariance of the best fit's coefficients [N] and q, and the misfit that is not
        noise [N], which may be part of small loops.
        """
        path = _Path(choice.problem)
        force, jacobian = path.force(choice.best.fit)
        error = NORMAL_95 * np.linalg.norm(jacobian @ root, axis=1)
        ties = [path.force(judged.fit)[0] for judged in _ties(choice)]
        forces = np.array([force, force - error, force + error, *ties])
        energy = path.energy(force)
        amplitude = AMPLITUDE * choice.problem.half
        unsure = NORMAL_95 * float(np.linalg.norm(path.energy(jacobian) @ root)) + 4.0 * amplitude * missed
        energies = [energy, *(path.energy(other) for other in ties)]
        nested = forces[:, path.nested] - force[path.nested]
        beyond = []
        for at in path.ends:
            possible = np.concatenate([forces[:, at], path.continued(forces, at)])
            beyond.append((float(path.x[at]), float(force[at]), float(possible.min()), float(possible.max())))
        return cls(
            amplitude, float(energy), max(float(min(energies)) - unsure, 0.0), float(max(energies)) + unsure,
            float(np.sqrt(np.mean(nested**2, axis=1)).max()) / choice.problem.deviation, tuple(beyond), len(ties),
            has_one_amplitude(choice.problem.samples),
        )  # fmt: skip


class _Path:
    """A path that was not recorded: small loops, nested ones, and beyond either end; sines of the records' duration."""

    def __init__(self, problem: Problem) -> None:
        small = np.resize([AMPLITUDE, -AMPLITUDE], 2 * _CYCLES)
        turns = np.array([0.0, *small, *_NESTED, BEYOND, -BEYOND])
        share = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, _STEPS + 1) / _STEPS)
        y = np.concatenate([[0.0], *(a + (b - a) * share for a, b in pairwise(turns.tolist()))])
        self.x = 0.5 * (problem.frame.low + problem.frame.high) + problem.half * y
        self.problem = problem
        time = np.arange(0.0, y.size) * (0.5 * problem.samples.cycle_time / _STEPS)
        record = Record(self.x, np.zeros(y.size), time if problem.samples.is_timed else None)
        reach = (problem.frame.low, problem.frame.high)
        self.unrecorded = Problem(Samples((record,), np.arange(y.size), reach))
        first = 2 * _CYCLES * _STEPS
        self.loop = slice(first - 2 * _STEPS, first + 1)
        self.nested = slice(first + 2 * _STEPS, y.size - 2 * _STEPS)
        self.ends = (y.size - 1 - _STEPS, y.size - 1)

    def force(self, fit: Fit) -> tuple[FloatArray, FloatArray]:
        """The force of a fit [N], and its derivatives by all c, nuisances included, and q."""
        c = fit.spring_class
        solved = self.problem.linear(c, fit.q)
        bare = replace(c, zeros=False, drift=False)
        A = self.unrecorded.columns(bare, fit.q, self.problem.frame)
        count, deviation = A.shape[1], self.problem.deviation
        own = replace(
            solved,
            coefficients=solved.coefficients[:count],
            inside=np.zeros(count, bool),
            columns=A,
            normal=np.empty((count, count)),
        )
        by_q = self.unrecorded.derivatives(bare, fit.q, own) * deviation
        fall = solved.fall * A[:, 1 : solved.terms].sum(axis=1)
        nuisances = np.zeros((self.x.size, solved.coefficients.size - count))
        return solved.base - fall + A @ own.coefficients * deviation, np.hstack([A, nuisances, by_q])

    def continued(self, forces: FloatArray, end: int) -> FloatArray:
        """Forces at an end by the cubic through the last quarter of the range, of forces along the path, shape (F, K).

        The spring itself goes on along a tangent, since a cubic may do anything; the mount may follow either.
        """
        y = fraction(self.x, self.problem.frame.low, self.problem.frame.high)[end - _STEPS : end + 1]
        near = (np.abs(y) <= 1.0) & (np.sign(y) == np.sign(y[-1])) & (np.abs(y) > 0.5)
        cubic = np.polynomial.polynomial.polyfit(y[near], forces[:, end - _STEPS : end + 1][:, near].T, 3)
        return np.asarray(np.polynomial.polynomial.polyval(y[-1], cubic))

    def energy(self, force: FloatArray) -> FloatArray:
        """Of the last small loop [J], of a force or of its derivatives."""
        around = force[self.loop]
        return np.asarray(np.diff(self.x[self.loop]) @ (0.5 * (around[1:] + around[:-1])))


def _ties(choice: Choice) -> Iterator[Judged]:
    """All fits that predict held-out strokes as well as the best one."""
    for judged in (*choice.seen, *_elsewhere(choice)):
        mean, error = difference(judged, choice.best)
        if mean <= max(error, NO_WORSE):
            yield judged


def _elsewhere(choice: Choice) -> Iterator[Judged]:
    """Further minima of the first mechanism alone, in its class and in those one step from it."""
    search, c = Search(choice.problem, Allowed()), choice.best.fit.spring_class
    richer = tuple(step_on(AMPLIFIER, degree) for degree in c.amplifiers)
    class_of_all = replace(c, elastic=step_on(ELASTIC, c.elastic), amplifiers=richer)
    yield search.judged(choice.problem.local(class_of_all, choice.best.fit.q, 8, 1e-4))
    bare = replace(c, branches=0, amplifiers=c.amplifiers[:1])
    place = bare.amplifiers[0]
    minima: list[Fit] = []
    for start in search.grid(bare, *_ELSEWHERE)[:_STARTS]:
        fit = choice.problem.local(bare, start, 6, 1e-3)
        apart = all(np.abs(fit.q - other.q).max() > _APART for other in minima)
        if apart and fit.squares < _WORSE * choice.best.fit.squares:
            minima.append(fit)
    neighbours = {
        replace(bare, elastic=step_on(ELASTIC, c.elastic)),
        replace(bare, amplifiers=(step_on(AMPLIFIER[::-1], place),)),
        replace(bare, amplifiers=(step_on(AMPLIFIER, place),)),
    }
    for fit in minima:
        yield search.judged(fit)
        for other in neighbours - {bare}:
            further = choice.problem.local(other, fit.q, 6, 1e-3)
            if further.squares < _WORSE * choice.best.fit.squares:
                yield search.judged(further)


def has_one_amplitude(samples: Samples) -> bool:
    """Whether all strokes but those that begin or end a record are about as long."""
    lengths = [np.abs(np.diff(samples.displacement[turning]))[1:-1] for turning in samples.turning]
    length = np.concatenate(lengths)
    longest, shortest = _ALIKE
    if not length.size:
        return True
    return bool(length.max() < longest * np.median(length) and np.quantile(length, 0.2) > shortest * length.max())


@dataclass(frozen=True)
class LackOfFit:
    """What a spring misses.

    Attributes
    ----------
    missed : float                  rms misfit that is not noise, share of the force's deviation.
    not_noise : float               Its share of the squared misfit.
    autocorrelation_time : float    Of the residuals [rows].
    places : dict of str to float   How far the squared misfit lies in one place, 0 where it is even, 1 where all of it
                                    is there: at turns, at the ends of the range, in one record; and the share of it
                                    that goes with the speed, and with the shape of the loop from cycle to cycle.
    """

    missed: float
    not_noise: float
    autocorrelation_time: float
    places: dict[str, float]

    @classmethod
    def of(cls, problem: Problem, fit: Fit) -> LackOfFit:
        """That of a fit."""
        samples = problem.samples
        # With their weights: outliers are no misfit of the spring.
        residuals = problem.linear(fit.spring_class, fit.q).residuals * problem.deviation
        squares = residuals**2
        mean = max(float(squares.mean()), 1e-300)
        noise = min(white_variance(residuals), _white_noise(samples))
        y = fraction(samples.x, problem.frame.low, problem.frame.high)
        stroke = samples.stroke_of_row
        ends = samples.displacement[samples.strokes[stroke]]
        length = ends[:, 1] - ends[:, 0]
        travel = np.abs(samples.x - ends[:, 0]) / np.maximum(np.abs(length), 1e-300)
        place = stroke / max(int(stroke.max()), 1) - 0.5
        direction = np.sign(length)
        places = {
            "turns": _concentrated(squares, travel < _TURNS),
            "ends": _concentrated(squares, np.abs(y) > _ENDS),
            "cycles": _explained(residuals, np.stack([place, place * y, place * direction], 1)),
        }
        if samples.is_timed:
            speed = np.concatenate(
                [np.gradient(r.displacement, r.rising_time) for r in samples.records if r.rising_time is not None]
            )[samples.rows]
            places["speed"] = _explained(residuals, np.stack([speed, speed * np.abs(speed)], 1))
        if len(samples.records) > 1:
            here = [_concentrated(squares, samples.record_of_row == k) for k in range(len(samples.records))]
            places["record"] = max(here)
        return cls(
            math.sqrt(max(mean - noise, 0.0)) / problem.deviation, max(1.0 - noise / mean, 0.0),
            autocorrelation_time(residuals), places,
        )  # fmt: skip

    @property
    def is_structured(self) -> bool:
        """Whether more than noise is left."""
        return self.not_noise > NOISE_ONLY and self.autocorrelation_time > _WHITE

    @property
    def sentence(self) -> str:
        """How much is missed, and where, in words."""
        if not self.is_structured:
            return "nothing but noise is left"
        where = " and ".join(_PLACES[name] for name in self.where)
        beside = f", mostly {where}" if where else ""
        return f"the model misses {100.0 * self.missed:.2g} % of the force that is not noise{beside}"

    @property
    def where(self) -> list[str]:
        """The places in which much of the misfit lies, the first one first."""
        return sorted((name for name, share in self.places.items() if share > _THERE), key=lambda n: -self.places[n])


def _white_noise(samples: Samples) -> float:
    """Mean variance of white noise at the rows, by the samples beside them [N^2]."""
    variances = []
    for record, turning, begin in zip(samples.records, samples.turning, samples.begins, strict=False):
        level = noise_level(record.force, turning[1:-1] - begin)
        # A median over all is that of the usual force, and noise may grow with it.
        differences = np.abs(np.diff(record.force, 4))[np.argsort(np.abs(record.force[2:-2]))]
        medians = [float(np.median(part)) for part in np.array_split(differences, 4)]
        growth = float(np.mean(np.square(medians))) / max(float(np.median(differences)) ** 2, 1e-300)
        variances.append(level**2 * growth)
    return float(np.average(variances, weights=np.bincount(samples.record_of_row, minlength=len(variances))))


def _concentrated(squares: FloatArray, there: BoolArray) -> float:
    """Share of some squares that lies there beside an even one: 0 to 1."""
    rows, share = float(there.mean()), float(squares[there].sum()) / max(float(squares.sum()), 1e-300)
    return max(share - rows, 0.0) / (1.0 - rows) if rows < 1.0 else 0.0


def _explained(residuals: FloatArray, columns: FloatArray) -> float:
    """Share of the squared residuals that columns explain."""
    columns = columns / np.maximum(np.abs(columns).max(axis=0), 1e-300)
    left = residuals - columns @ np.linalg.lstsq(columns, residuals, rcond=1e-8)[0]
    return 1.0 - float(left @ left) / max(float(residuals @ residuals), 1e-300)


def _residuals(problem: Problem, fit: Fit) -> FloatArray:
    """Predicted less measured force at the rows [N]."""
    return np.asarray(problem.linear(fit.spring_class, fit.q).residuals / problem.roots * problem.deviation)


def _held_out(problem: Problem, fit: Fit) -> tuple[FloatArray, IndexArray]:
    """Residuals of blocks of strokes to the fit without them [N], and the block of each row, -1 without one.

    The blocks come first among the folds; what lies beyond the range that is left is not held against the fit.
    """
    x, block = problem.samples.x, np.full(problem.samples.rows.size, -1)
    residuals = np.zeros(x.size)
    for k, fold in enumerate(problem.samples.folds):
        if (block[fold] >= 0).any():
            break
        kept = ~fold
        within = fold & (x >= x[kept].min()) & (x <= x[kept].max())
        solved = problem.linear(fit.spring_class, fit.q, None, kept)
        residuals[within] = (solved.residuals / problem.roots)[within] * problem.deviation
        block[within] = k
    return residuals, block


def student_95(nu: float) -> float:
    """97.5 % quantile of Student's distribution of 4 degrees of freedom or more (Abramowitz and Stegun 26.7.5)."""
    z = NORMAL_95
    return z + (z**3 + z) / (4.0 * nu) + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * nu**2)
