"""Which class of spring the records show: the paper's, with a Maxwell branch, with a second mechanism, or with both.

Classes are nested. A wider one is chosen only if it predicts what it was not fitted to better, by a good part of the
error or so well that nothing but noise is left, and lowers the criterion of `search`, which counts independent samples,
by more than its price. What a linear problem does not promise is not tried.

Where to begin with one more branch or mechanism: the residuals and every column tried are reduced to what the fit's own
derivatives do not reach, so that one linear least-squares problem says how much it would take.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, product
from typing import TypeVar

import numpy as np

from ...kernel.arrays import FloatArray
from ..least_squares.projection import RHO_BOUNDS
from ..least_squares.stages import Hysteresis
from ..points.polynomials import Basis
from ..points.residuals import autocorrelation_time
from ..points.sample_points import IndexArray, SamplePoints
from ..points.table import TableBasis
from ..rig.effect_columns import Rig
from ..rig.other_mounts import groups_of_strokes
from ..search.search import MARGIN, NOISE_ONLY, WHITE, Candidate, Criterion, force_floor
from .problem import Along, ClassFit, ClassProblem, Shape, time_bounds
from .rates import changes_over_cycles, is_timed, shows_rate

_WORTH = 0.1  # share of the held-out error that a wider class must explain, unless nothing but noise is left
_AS_WELL = 1.02  # held-out error in the least up to which a polynomial FE is taken
_NEARLY = 0.75  # share of the squared held-out error which a branch explains as well as a second mechanism
_STARTS = 3  # of each kind that are refined
# Degrees of FE as a polynomial, and of FA, with which a class is tried before leaner ones.
_LEAST_ELASTIC, _HIGHEST_ELASTIC, _HIGHEST_AMPLIFIER = 5, 8, 2
_FIRST_TOLERANCE, _FIRST_EVALUATIONS = 1e-3, 15
_OF_BRANCH, _OF_MECHANISM = 2, 6  # parameters of each

Kind = tuple[int, int]  # number of mechanisms and of branches
_FOLDS = 4
_GROUPS = 3  # amplitudes, rates or records from which whole ones are left out
_TOLERANCE, _EVALUATIONS = 1e-3, 12
Start = TypeVar("Start")
_TIMES = 14  # time constants tried
_RATES = 10  # values of rho tried
_RATE_BOUNDS = (3.0, 3e3)  # of rho times the longest stroke
_SIGMAS, _EXPONENTS = (0.6, 2.0), (0.4, 1.0, 3.0)
# Of a grid in all of a class, and how many of its points are refined.
_COARSE_RATES, _COARSE_TIMES, _COARSE_EXPONENTS, _ANEW = 6, 8, (0.5, 2.0), 2
_DEGREE = 2  # of the amplifier of a mechanism that is tried


@dataclass(frozen=True, eq=False)
class Tried:
    """A class that was fitted.

    Attributes
    ----------
    fit : ClassFit
    misfit : float      rms [N].
    held_out : float    rms error on what was left out [N].
    time : float        Autocorrelation time of the residuals [points].
    """

    fit: ClassFit
    misfit: float
    held_out: float
    time: float

    @property
    def kind(self) -> Kind:
        """Number of mechanisms and of branches."""
        return len(self.fit.degrees), self.fit.stiffness.size


@dataclass(frozen=True, eq=False)
class Choice:
    """The classes that were tried.

    Attributes
    ----------
    chosen : Tried
    tried : tuple of Tried        The paper's class first.
    open_branch : Tried or None   With a branch that would pay if the records told it from friction, which they do not.
    """

    chosen: Tried
    tried: tuple[Tried, ...]
    open_branch: Tried | None = None


@dataclass(frozen=True)
class AllowedClasses:
    """Which classes are allowed.

    Attributes
    ----------
    mechanisms, branches : int or None   So many; chosen if None.
    """

    mechanisms: int | None = None
    branches: int | None = None

    @property
    def least(self) -> Kind:
        """The leanest class."""
        return self.mechanisms or 1, self.branches or 0

    def next(self, kind: Kind) -> list[Kind]:
        """The classes that have one mechanism or branch more."""
        mechanisms, branches = kind
        wider = [(mechanisms, branches + 1)] if self.branches is None and branches == 0 else []
        return wider + ([(mechanisms + 1, branches)] if self.mechanisms is None and mechanisms == 1 else [])


class Classes:
    """The classes on the points of a spring of the paper's class.

    Parameters
    ----------
    rig : Rig
    loops : SamplePoints   Points without effects of the rig.
    fit : Candidate        The spring.
    noise : float          The rms that noise alone gives the residuals at these points [N].
    """

    def __init__(self, rig: Rig, loops: SamplePoints, fit: Candidate, noise: float) -> None:
        self._rig, self.loops, self._noise = rig, loops, noise
        self.is_timed = is_timed(rig)
        h = fit.hysteresis
        problem = self.problem(fit.basis, (fit.basis.amplifier,), 0)
        self._plain = problem.linear(Shape((h,)), fit.refinement.omega_start)

    @cached_property
    def _fold(self) -> IndexArray:
        return folds(self._rig, self.loops)

    @cached_property
    def shows_rate(self) -> bool:
        """Whether the records tell a force that depends on the rate from friction."""
        return self.is_timed and shows_rate(self._rig)

    def problem(self, basis: Basis, degrees: Sequence[int], branches: int) -> ClassProblem:
        """The least-squares problem of a class."""
        return ClassProblem(self._rig, self.loops, basis, degrees, branches, self.loops.weight)

    def problem_of(self, fit: ClassFit) -> ClassProblem:
        """That of a fit."""
        return self.problem(fit.basis, fit.degrees, fit.stiffness.size)

    def choice(self, wanted: AllowedClasses) -> Choice | None:
        """The class that the records show; None where no wider one is promising.

        Parameters
        ----------
        wanted : AllowedClasses
        """
        if wanted.least == (1, 0) and not any(self._starts(self._plain, kind) for kind in wanted.next((1, 0))):
            return None
        best = self.tried(self._plain)
        tried = [best]
        while best.kind != wanted.least:
            mechanisms, branches = best.kind
            more = (mechanisms + 1, branches) if mechanisms < wanted.least[0] else (mechanisms, branches + 1)
            if (forced := self._wider(best.fit, more, is_forced=True)) is None:
                break
            best = forced
        if best is not tried[0]:
            tried.append(best)
        open_branch: Tried | None = None
        while True:
            wider = [found for kind in wanted.next(best.kind) if (found := self._wider(best.fit, kind))]
            tried += wider
            paying = [each for each in wider if self.pays(each, best)]
            if any(each.kind == (2, 0) for each in paying) and (like := self._like_friction(best, paying)):
                tried.append(like)
                open_branch = like if self.is_timed else None
                if self.loops.has_one_amplitude:
                    return Choice(best, tuple(tried), open_branch)
            if not paying and wider:
                # Neither may pay alone, where both do.
                start = min(wider, key=lambda each: each.held_out)
                both = [found for kind in wanted.next(start.kind) if (found := self._wider(start.fit, kind))]
                tried += both
                paying = [each for each in both if self.pays(each, best)]
            if not paying:
                break
            best = max(paying, key=lambda each: self.gain(each, best))
        if wanted.branches is not None or not self.is_timed or best.fit.stiffness.size:
            open_branch = None
        else:
            open_branch = open_branch or self._open_branch(best)
        return Choice(best, tuple(tried), open_branch)

    def tried(self, fit: ClassFit) -> Tried:
        """A fit with what it leaves."""
        problem = self.problem_of(fit)
        residuals = self.loops.force - problem.at(fit).force
        time = autocorrelation_time(problem.root * residuals)
        return Tried(fit, self.loops.rms(residuals), held_out_error(problem, fit, self._fold), time)

    def gain(self, richer: Tried, leaner: Tried) -> float:
        """By how much the criterion favours one class over another."""
        criterion = Criterion.from_points(self.loops, min(richer, leaner, key=lambda each: each.misfit).time)
        values = [criterion.value(each.misfit, each.fit.parameters) for each in (leaner, richer)]
        return values[0] - values[1]

    def pays(self, richer: Tried, leaner: Tried) -> bool:
        """Whether a wider class is worth its price."""
        if richer.misfit**2 > leaner.misfit**2 - force_floor(self.loops) ** 2:
            return False
        explained = richer.misfit <= NOISE_ONLY * self._noise and richer.time <= WHITE
        worth = 0.0 if explained else _WORTH
        return richer.held_out < (1.0 - worth) * leaner.held_out and self.gain(richer, leaner) > MARGIN

    def _starts(self, leaner: ClassFit, kind: Kind, is_forced: bool = False) -> list[Shape]:
        """Where to begin with one more mechanism or branch, the most promising first; none where none promises."""
        problem = self.problem_of(leaner)
        along = problem.at(leaner)
        if not is_forced and self.loops.rms(self.loops.force - along.force) <= force_floor(self.loops):
            return []
        residuals = Residuals.of(problem, along)
        shape = leaner.shape
        if kind[0] > len(leaner.degrees):
            found = [(t, Shape((*shape.hysteresis, h), shape.times)) for t, h in mechanism_starts(problem, residuals)]
            price = _OF_MECHANISM
        elif not self.is_timed and not is_forced:
            return []
        else:
            found = [
                (taken, Shape(shape.hysteresis, (*shape.times, time)))
                for taken, time in branch_starts(problem, residuals)
                if is_forced or self._shows(time)
            ]
            price = _OF_BRANCH
        if is_forced:
            return [start for _, start in found[:_STARTS]]
        # As if the residuals were independent: what is promised is judged once it is fitted.
        criterion = Criterion.from_points(self.loops, 1.0)
        misfit = float(np.linalg.norm(residuals.misfit)) / float(np.sqrt(self.loops.weight.sum()))
        before = criterion.value(misfit, 0)
        return [
            start
            for taken, start in found[:_STARTS]
            if before - criterion.value(misfit * np.sqrt(max(1.0 - taken, 0.0)), price) > MARGIN
        ]

    def _shows(self, time: float) -> bool:
        """Whether the records tell a branch of a time constant [s] from friction."""
        if self.shows_rate:
            return True
        return changes_over_cycles(self._rig, self.loops, self._rig.branch(self.loops, time)[0], time)

    def _like_friction(self, leaner: Tried, paying: Sequence[Tried]) -> Tried | None:
        """A class with a branch that explains about as much as one with a second mechanism, where the rate does not
        vary and so little tells one from the other; None otherwise. Without times, samples count as even ones.
        """
        branch = None if self.shows_rate else self._wider(leaner.fit, (1, 1), is_forced=True)
        if branch is None:
            return None
        least = min(each.held_out for each in paying)
        if self.loops.has_one_amplitude:
            return branch if branch.held_out * (1.0 - _WORTH) <= least else None
        explained = leaner.held_out**2 - branch.held_out**2
        return branch if explained >= _NEARLY * (leaner.held_out**2 - least**2) else None

    def _open_branch(self, leaner: Tried) -> Tried | None:
        """A class with a branch that would pay, which the records do not tell from friction; where all of them are of
        one rate, what was left out does not decide either, and a branch that takes a good part of the loops counts.
        """
        wider = self._wider(leaner.fit, (leaner.kind[0], 1), is_forced=True)
        if wider is None:
            return None
        is_open = (
            not self.shows_rate and self._share_of_branch(wider.fit) > _WORTH and self.gain(wider, leaner) > MARGIN
        )
        return wider if is_open or self.pays(wider, leaner) else None

    def _share_of_branch(self, fit: ClassFit) -> float:
        """Share of the loops' energy that the last branch of a fit takes."""
        work = [abs(self.loops.work(part)) for part in self.problem_of(fit).at(fit).parts]
        return work[-1] / max(sum(work), 1e-300)

    def _wider(self, leaner: ClassFit, kind: Kind, is_forced: bool = False) -> Tried | None:
        """With one more mechanism or branch; None where none promises enough."""
        starts = self._starts(leaner, kind, is_forced)
        if not starts:
            return None
        found: list[Tried] = []
        for basis in self._bases(leaner.basis):
            problem = self.problem(basis, [_HIGHEST_AMPLIFIER] * kind[0], kind[1])
            if found:  # a table takes long, and has the minima of the polynomial
                starts = [found[0].fit.shape, starts[0]]
            else:
                starts = [*starts, *anew(problem, leaner.shape, leaner.omega_start)]
            rough = [problem.solve(start, leaner.omega_start, _FIRST_TOLERANCE, _FIRST_EVALUATIONS) for start in starts]
            first = min(rough, key=lambda fit: fit.squares)
            found.append(self.tried(self._lean(problem.solve(first.shape, first.omega_start))))
        least = min(each.held_out for each in found)
        best = next(each for each in found if each.held_out <= _AS_WELL * least)
        is_shown = is_forced or all(self._shows(time) for time in best.fit.shape.times)
        return best if is_shown else None

    def _bases(self, basis: Basis) -> list[Basis]:
        """FE with which a wider class is tried: a table may have been rich only to imitate what the class adds."""
        polynomial = Basis(basis.low, basis.high, _HIGHEST_ELASTIC, 0)
        if isinstance(basis, TableBasis):
            return [polynomial, basis]
        return [replace(basis, elastic=max(basis.elastic, _LEAST_ELASTIC))]

    def _lean(self, fit: ClassFit) -> ClassFit:
        """With the degrees of FE and of each FA that the criterion asks for."""
        problem = self.problem_of(fit)
        residuals = problem.root * (self.loops.force - problem.at(fit).force)
        criterion = Criterion.from_points(self.loops, autocorrelation_time(residuals))
        total = float(self.loops.weight.sum())
        elastics = [fit.basis.elastic] if isinstance(fit.basis, TableBasis) else range(1, fit.basis.elastic + 1)
        best, least = fit, np.inf
        for elastic in elastics:
            basis = replace(fit.basis, elastic=elastic)
            for degrees in product(range(_HIGHEST_AMPLIFIER + 1), repeat=len(fit.degrees)):
                leaner = self.problem(basis, degrees, fit.stiffness.size).linear(fit.shape, fit.omega_start)
                value = criterion.value(float(np.sqrt(leaner.squares / total)), leaner.parameters)
                if value < least:
                    best, least = leaner, value
        return self.problem_of(best).solve(best.shape, best.omega_start)


def folds(rig: Rig, loops: SamplePoints) -> IndexArray:
    """Fold of each point, shape (P,): strokes of like amplitude, rate and record, or runs of cycles of all of them."""
    group = groups_of_strokes(rig, loops)
    names, number = np.unique(group, return_inverse=True)
    weight = np.bincount(number, weights=loops.weight)
    # Loading and unloading of unlike durations are groups, too; neither is known from the other.
    forth = np.bincount(number, weights=loops.side > 0.0)
    has_both_ways = bool(np.all((forth > 0.0) & (forth < np.bincount(number))))
    if names.size >= _GROUPS and weight.max() < 0.7 * weight.sum() and has_both_ways:
        # Of many groups, neighbours in amplitude go to different folds.
        return np.asarray(number % _FOLDS, np.intp)
    fold = np.zeros(loops.force.size, np.intp)
    for _, points in loops.by_record:
        if points.stop > points.start:
            stroke = loops.stroke[points] - loops.stroke[points.start]
            cycles = max(1, (int(stroke[-1]) + 1) // 2)
            parts = min(_FOLDS, cycles)
            fold[points] = np.minimum(stroke // 2, cycles - 1) * parts // cycles if parts > 1 else 0
    if fold.max() == 0:  # a single cycle: parts of its strokes
        fold = np.asarray((4.0 * loops.travel / loops.length[loops.stroke]).astype(np.intp) % 2)
    return fold


def held_out_error(problem: ClassProblem, fit: ClassFit, fold: IndexArray) -> float:
    """rms error [N] at the points of each fold by the class fitted to the others, where these have been."""
    loops = problem.loops
    squares = total = 0.0
    for held in range(int(fold.max()) + 1):
        out = fold == held
        if not out.any() or out.all():
            continue
        rest = loops.only(~out)
        part = ClassProblem(problem.rig, rest, fit.basis, fit.degrees, problem.branches, problem.weight[~out])
        without = part.solve(fit.shape, fit.omega_start, _TOLERANCE, _EVALUATIONS)
        there = ClassProblem(
            problem.rig, loops.only(out), fit.basis, fit.degrees, problem.branches, problem.weight[out]
        ).at(without)
        x = loops.displacement
        judged = (x[out] >= x[~out].min()) & (x[out] <= x[~out].max())
        squares += float(loops.weight[out][judged] @ (loops.force[out] - there.force)[judged] ** 2)
        total += float(loops.weight[out][judged].sum())
    return float(np.sqrt(squares / max(total, 1e-300)))


@dataclass(frozen=True, eq=False)
class Residuals:
    """Weighted residuals of a fit beside what its own coefficients reach.

    Attributes
    ----------
    frame : ndarray, shape (P, p)   Orthonormal columns of what they reach.
    misfit : ndarray, shape (P,)
    """

    frame: FloatArray
    misfit: FloatArray

    @classmethod
    def of(cls, problem: ClassProblem, along: Along) -> Residuals:
        """Those of a fit at the points of a problem."""
        columns = along.jacobian * problem.root[:, None]
        columns = columns[:, np.abs(columns).max(axis=0) > 0.0]
        frame, singular, _ = np.linalg.svd(columns / np.linalg.norm(columns, axis=0), full_matrices=False)
        frame = frame[:, singular > 1e-10 * singular[0]]
        misfit = problem.root * (problem.loops.force - along.force)
        return cls(frame, misfit - frame @ (frame.T @ misfit))

    def taken(self, columns: FloatArray) -> float:
        """Share of the squared residuals that weighted columns would take, shape (P, k)."""
        beside = columns - self.frame @ (self.frame.T @ columns)
        length = np.linalg.norm(columns, axis=0)
        beside = beside[:, np.linalg.norm(beside, axis=0) > 1e-6 * length]
        if not beside.size:
            return 0.0
        q, _ = np.linalg.qr(beside / np.linalg.norm(beside, axis=0))
        along = q.T @ self.misfit
        return float(along @ along) / max(float(self.misfit @ self.misfit), 1e-300)


def branch_starts(problem: ClassProblem, residuals: Residuals) -> list[tuple[float, float]]:
    """Time constants [s] at which a branch would take most, with the share of the squared residuals, the most first."""
    times = np.geomspace(*time_bounds(problem.rig), _TIMES)
    taken = [
        residuals.taken((problem.branch(log_time)[0] * problem.root)[:, None]) for log_time in np.log(times).tolist()
    ]
    return _peaks(np.array(taken), times.tolist())


def mechanism_starts(problem: ClassProblem, residuals: Residuals) -> list[tuple[float, Hysteresis]]:
    """A second mechanism that would take most, for every range of rho; the most first."""
    loops = problem.loops
    longest = float(loops.length.max())
    low, high = (max(_RATE_BOUNDS[0], RHO_BOUNDS[0]), min(_RATE_BOUNDS[1], RHO_BOUNDS[1]))
    rates = np.geomspace(low, high, _RATES) / longest
    wide = problem.amplifier_columns(_DEGREE) * problem.root[:, None]
    taken = np.zeros(_RATES)
    best = [Hysteresis(rate, 1.0, 1.0) for rate in rates.tolist()]
    for sigma, n in product(_SIGMAS, _EXPONENTS):
        for k, omega in enumerate(loops.points.omega_by_rate(rates, sigma, n)):
            share = residuals.taken(omega[:, None] * wide)
            if share > taken[k]:
                taken[k], best[k] = share, Hysteresis(float(rates[k]), sigma, n)
    return _peaks(taken, best)


def _peaks(taken: FloatArray, starts: Sequence[Start]) -> list[tuple[float, Start]]:
    """Starts at the maxima of what they take, the largest first."""
    padded = np.concatenate([[-np.inf], taken, [-np.inf]])
    peaks = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] > padded[2:]))
    return [(float(taken[k]), starts[k]) for k in peaks[np.argsort(-taken[peaks], kind="stable")].tolist()]


def anew(problem: ClassProblem, leaner: Shape, omega_start: FloatArray) -> list[Shape]:
    """Shapes of a class from a grid in all of it: a leaner one may have imitated what the class adds by its own.

    Parameters
    ----------
    problem : ClassProblem       With one mechanism or branch more than the leaner class.
    leaner : Shape
    omega_start : ndarray, shape (R,)
    """
    rates = np.geomspace(*_RATE_BOUNDS, _COARSE_RATES) / float(problem.loops.length.max())
    single = [Hysteresis(rate, 1.0, n) for rate in rates.tolist() for n in _COARSE_EXPONENTS]
    if len(problem.degrees) > len(leaner.hysteresis):
        shapes = [Shape(pair, leaner.times) for pair in combinations(single, 2) if pair[0].rho < pair[1].rho]
    elif len(problem.degrees) == 1:
        times = np.geomspace(*time_bounds(problem.rig), _COARSE_TIMES).tolist()
        shapes = [Shape((h,), (*leaner.times, time)) for h, time in product(single, times)]
    else:
        return []
    fits = sorted((problem.linear(shape, omega_start).squares, k) for k, shape in enumerate(shapes))
    return [shapes[k] for _, k in fits[:_ANEW]]
