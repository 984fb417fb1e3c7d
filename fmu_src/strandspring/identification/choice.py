"""Which class of springs the records ask for: what predicts held-out strokes better, and then the simplest that does.

A class is compared with another by the logarithms of their held-out errors, fold by fold. It is taken if their mean
difference is below -3 %, and below its own standard error over the folds: one fold that extrapolates decides nothing,
and chance takes little. From the simplest spring each step takes the best of all classes that are a few degrees, a
branch, a mechanism or a nuisance richer; at the end whatever costs nothing is dropped again. Where nothing but noise is
left, held-out errors are those of the noise, and a criterion decides on degrees.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np

from ..kernel.arrays import FloatArray
from .bases import AMPLIFIER, ELASTIC, step_on
from .fit import NOTHING, Fit, Problem, SpringClass

_BETTER = 0.03  # by which a logarithm of errors must fall
NO_WORSE = 0.01  # by which it may rise for a simpler class, or for one that predicts as well
# rho*h, sigma - 1/2 and n where the search of a first and of a second mechanism begins.
_RATES, _EXCESSES, _EXPONENTS = (1.0, 3.0, 10.0, 40.0), (0.15, 1.2), (0.4, 1.0, 2.5)
_SECOND = ((1.5, 6.0, 25.0, 100.0), (0.1, 1.0), (0.6, 2.0))
_ANEW = (0.15, 0.4, 1.0, 2.5, 6.0)  # n, where the first mechanism is sought again
_FLEXIBLE = SpringClass((3, 6), (2,))  # of which omega at the beginning is judged


@dataclass(frozen=True)
class Allowed:
    """The classes that may be chosen, with the least and the greatest number of mechanisms and branches."""

    degrees: tuple[int, int] | None = None  # of FE and FA, both polynomials; any if None
    mechanisms: tuple[int, int] = (1, 2)
    branches: tuple[int, int] = (0, 2)
    drift: bool = True


@dataclass(frozen=True, eq=False)
class Judged:
    """A fit with its residuals over the force's deviation where a fold holds them out, nan elsewhere, shape (F, P)."""

    fit: Fit
    held_out: FloatArray

    @cached_property
    def errors(self) -> FloatArray:
        """Mean squares by fold."""
        return np.asarray(np.nanmean(self.held_out**2, axis=1))

    @property
    def logarithm(self) -> float:
        """Mean over the folds; differences of halves of it are relative errors."""
        return float(np.mean(np.log(self.errors + NOTHING)))


@dataclass(frozen=True, eq=False)
class Choice:
    """The class that was chosen, and all that were judged on a problem."""

    best: Judged
    seen: tuple[Judged, ...]
    problem: Problem


def difference(one: Judged, other: Judged) -> tuple[float, float]:
    """Mean and standard error over the folds of ln(error of one/error of other)."""
    d = 0.5 * np.log((one.errors + NOTHING) / (other.errors + NOTHING))
    return float(d.mean()), float(d.std(ddof=1) / math.sqrt(d.size)) if d.size > 2 else 0.0


def is_better(one: Judged, other: Judged) -> bool:
    """Whether one predicts what was held out better than another."""
    mean, error = difference(one, other)
    return mean < -max(error, _BETTER)


class Search:
    """The search over classes on one problem."""

    def __init__(self, problem: Problem, allowed: Allowed) -> None:
        self.problem, self.allowed = problem, allowed
        self.seen: list[Judged] = []

    def judged(self, fit: Fit) -> Judged:
        """The fit with its held-out errors, remembered."""
        judged = Judged(fit, self.problem.held_out(fit))
        self.seen.append(judged)
        return judged

    def best_of(
        self, c: SpringClass, starts: Sequence[FloatArray], iterations: int = 8, tolerance: float = 1e-3
    ) -> Fit:
        """The best minimum from some starts."""
        fits = [self.problem.local(c, start, iterations, tolerance) for start in starts]
        return min(fits, key=lambda fit: fit.squares)

    def begin(self) -> Judged:
        """The simplest class that is allowed, from the best points of a grid."""
        given = self.allowed.degrees
        c = SpringClass() if given is None else SpringClass((given[0], 0), (given[1],))
        starts = self.grid(c, _RATES, _EXCESSES, _EXPONENTS)
        return self.judged(self.grown(self.best_of(c, starts, 12, 1e-4)))

    def grown(self, fit: Fit) -> Fit:
        """A fit with the mechanisms and branches that are asked for."""
        while (c := fit.spring_class).mechanisms < self.allowed.mechanisms[0]:
            richer = replace(c, amplifiers=(*c.amplifiers, 0))
            fit = self.best_of(richer, self.starts(fit, richer))
        while (c := fit.spring_class).branches < self.allowed.branches[0]:
            richer = replace(c, branches=c.branches + 1)
            fit = self.best_of(richer, self.starts(fit, richer))
        return fit

    def grid(
        self, c: SpringClass, rates: Sequence[float], excesses: Sequence[float], exponents: Sequence[float]
    ) -> list[FloatArray]:
        """Points of a grid of the first mechanism, the best first, that are apart from each other."""
        points = [np.log(point) for point in product(rates, excesses, exponents)]
        order = sorted(points, key=lambda q: self.problem.squares(c, q))
        apart: list[FloatArray] = []
        for q in order:
            if all(np.abs(q - p).max() > 1.0 or abs(q[2] - p[2]) > 0.5 for p in apart):
                apart.append(q)
        return apart[:3]

    def climb(self, current: Judged) -> Judged:
        """Step by step to the class that predicts best."""
        for _ in range(7):
            c, is_noise = current.fit.spring_class, self.problem.is_noise(current.fit)
            candidates = []
            for richer in self.richer(c, is_noise):
                fit = self.best_of(richer, self.starts(current.fit, richer))
                # Where the misfit hardly falls, held-out errors do not either.
                pays = is_noise and self.problem.criterion(fit) < self.problem.criterion(current.fit)
                if pays or fit.squares <= (1.0 - _BETTER) ** 2 * current.fit.squares:
                    judged = self.judged(fit)
                    if pays or is_better(judged, current):
                        candidates.append(judged)
            if not candidates:
                break
            current = min(candidates, key=lambda j: j.logarithm + 0.02 * j.fit.spring_class.nonlinear)
        return current

    def richer(self, c: SpringClass, only_degrees: bool) -> Iterator[SpringClass]:
        """The classes up to three steps richer in FE, two in FA, and one in all else."""
        if self.allowed.degrees is None:
            elastic = dict.fromkeys(step_on(ELASTIC, c.elastic, step) for step in (1, 2, 3))
            yield from (replace(c, elastic=other) for other in elastic if other != c.elastic)
            for k, degree in enumerate(c.amplifiers):
                for other in dict.fromkeys(step_on(AMPLIFIER, degree, step) for step in (1, 2)):
                    if other != degree:
                        yield replace(c, amplifiers=(*c.amplifiers[:k], other, *c.amplifiers[k + 1 :]))
        if not c.may_fall:
            yield replace(c, may_fall=True)
        if only_degrees:
            return
        samples = self.problem.samples
        if samples.is_timed and c.branches < self.allowed.branches[1]:
            yield replace(c, branches=c.branches + 1)
        if c.mechanisms < self.allowed.mechanisms[1]:
            yield replace(c, amplifiers=(*c.amplifiers, 0))
        if not c.zeros and len(samples.records) > 1:
            yield replace(c, zeros=True)
        if self.allowed.drift and not c.drift and len(samples.strokes) > 4:
            yield replace(c, drift=True)

    def starts(self, fit: Fit, richer: SpringClass) -> list[FloatArray]:
        """Where the fit of a richer class begins."""
        c, q = fit.spring_class, fit.q
        split = 3 * c.mechanisms
        if richer.branches > c.branches:
            step, duration = self.problem.taus
            cycle = self.problem.samples.cycle_time
            taus = np.geomspace(max(step, cycle / 200.0), min(3.0 * cycle, duration), 6)
            points = [np.append(q, math.log(tau)) for tau in taus]
        elif richer.mechanisms > c.mechanisms:
            points = [np.concatenate([q[:split], np.log(second), q[split:]]) for second in product(*_SECOND)]
        else:
            return [q]
        return sorted(points, key=lambda p: self.problem.squares(richer, p))[:2]

    def anew(self, current: Judged) -> Judged:
        """The first mechanism sought once more in the class found, which may have another basin there."""
        c = current.fit.spring_class
        bare = replace(c, branches=0, amplifiers=c.amplifiers[:1])
        fit = self.grown(self.best_of(bare, self.grid(bare, _RATES, _EXCESSES, _ANEW)[:2], 12))
        if fit.spring_class != c:
            judged = self.judged(fit)
            return current if is_better(current, judged) else self.climb(judged)
        return self.climb(self.judged(fit)) if fit.squares < 0.95 * current.fit.squares else current

    def prune(self, current: Judged) -> Judged:
        """The simplest class that is no worse."""
        while True:
            is_noise = self.problem.is_noise(current.fit)
            for simpler in self.simpler(current.fit.spring_class):
                fit = self.problem.local(simpler, current.fit.q, 6, 1e-3)
                if fit.squares <= 1.1 * current.fit.squares:
                    judged = self.judged(fit)
                    mean, error = difference(judged, current)
                    pays = not is_noise or self.problem.criterion(fit) < self.problem.criterion(current.fit)
                    if pays and mean <= min(error, NO_WORSE):
                        current = judged
                        break
            else:
                return current

    def simpler(self, c: SpringClass) -> Iterator[SpringClass]:
        """Classes of lower degrees, the simplest first."""
        if self.allowed.degrees is None:
            for lower in ELASTIC[: ELASTIC.index(c.elastic)]:
                # A cubic may rise everywhere, and have increments below 0.
                yield from (replace(c, elastic=lower, may_fall=falls) for falls in {c.may_fall, lower == (3, 0)})
            for k, highest in enumerate(c.amplifiers):
                for degree in AMPLIFIER[: AMPLIFIER.index(highest)]:
                    yield replace(c, amplifiers=(*c.amplifiers[:k], degree, *c.amplifiers[k + 1 :]))
        if c.may_fall:
            yield replace(c, may_fall=False)


def choose(problem: Problem, allowed: Allowed = Allowed()) -> Choice:
    """The class that predicts held-out strokes best, fitted on the rows of the problem."""
    problem = _begun(problem)
    search = Search(problem, allowed)
    current = search.climb(search.begin())
    current = search.prune(search.anew(current))
    if current.fit.spring_class.drift and not problem.is_noise(current.fit):
        # A drift that does not explain the rest is hardly one.
        return choose(problem, replace(allowed, drift=False))
    final = problem.local(current.fit.spring_class, current.fit.q, 15, 1e-6)
    return Choice(Judged(final, current.held_out), tuple(search.seen), problem)


def _begun(problem: Problem) -> Problem:
    """The problem with omega = 0 where a record begins, or, if that fits far better, as after a long stroke the other
    way, in records whose first strokes are fitted: a mount that is unloaded need not be at rest.
    """
    samples = problem.samples
    fitted = np.isin(samples.strokes[:, 0], samples.strokes[np.unique(samples.stroke_of_row), 0])
    for k, turning in enumerate(samples.turning):
        if fitted[np.flatnonzero(samples.strokes[:, 0] == turning[0])[0]]:
            starts = problem.starts.copy()
            starts[k] = -np.sign(samples.displacement[turning[1]] - samples.displacement[turning[0]])
            other = Problem(samples, starts, problem.roots)
            squares = [flexible(each).squares for each in (problem, other)]
            problem = other if squares[1] < 0.8 * squares[0] else problem
    return problem


def flexible(problem: Problem, c: SpringClass = _FLEXIBLE) -> Fit:
    """The fit of a flexible class of one mechanism, near the best of some points."""
    points = [np.log([rate, 0.3, 1.0]) for rate in _RATES[1:]]
    start = min(points, key=lambda q: problem.squares(c, q))
    return problem.local(c, start, 8, 1e-2)
