"""How certain an identified spring is: all that is said of it comes from one linearised fit, and from its rivals.

With A the columns of the linear coefficients c that are not held at 0 and D the derivatives of the residuals by those
q = (ln rho*h, ln(sigma - 1/2), ln n, ..., ln tau), both weighted as in the fit, (c, q) has the covariance

    s^2*T*(J'J)^-1,      J = [A, D],

with s^2 the variance and T the autocorrelation time of the residuals; those of the saved parameters follow from their
derivatives by (c, q). A coefficient that is held at 0, the end of what a spring may be, counts as known: it may lie on
one side only, and by how little the records do not say. A q at its bound has no standard error of its own, but the
others have theirs as if it were free, since it may lie on the other side. Where a logarithm is little known, or at a
bound, its interval ends where the misfit, all else fitted again, has risen by as much as it would at the end of a
linear one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from ..core.parameters import SpringParameters
from ..kernel.arrays import FloatArray, IndexArray
from ..model.joint import further_names, names_of
from .bases import AMPLIFIER, ELASTIC, amplifier_columns, step_on
from .choice import Choice
from .figures import autocorrelation_time
from .fit import Fit, Linear, Problem
from .predictions import LackOfFit, Unrecorded, force_interval, student_95
from .spring import spring_of

NAMES = ("kappa_omega", "rho", "sigma", "n")
AT_BOUND = 1e-3  # distance of a q from its bound that counts as none
_CURVED = 0.1  # standard error of a logarithm from which the misfit is not taken as parabolic: 10 % of the parameter
Interval = tuple[float | None, float | None]


@dataclass(frozen=True, eq=False)
class Certainty:
    """What is known of a spring."""

    uncertainty: dict[str, Any]  # content of the model file's field
    unrecorded: Unrecorded  # what loops may do that were not recorded
    lack: LackOfFit  # what the spring misses


def certainty(choice: Choice, problem: Problem, spring: SpringParameters) -> Certainty:
    """That of the spring that was saved of the best fit of a choice, which was fitted to a problem of more rows."""
    linear = Linearised(problem, choice.best.fit)
    lack = LackOfFit.of(problem, choice.best.fit)
    errors = problem.deviation * np.linalg.norm(linear.jacobian @ linear.root, axis=1) / problem.roots
    interval = force_interval(choice, float(errors.max()), linear.time)
    return Certainty(
        {**_uncertainty(linear, choice.problem, spring), "prediction_interval": interval.as_json()},
        Unrecorded.of(choice, problem, lack, linear.spread),
        lack,
    )


class Linearised:
    """A fit as a linear problem in its coefficients c, those held at 0 being known, and its q."""

    def __init__(self, problem: Problem, fit: Fit) -> None:
        self.problem, self.fit = problem, fit
        self.solved = problem.linear(fit.spring_class, fit.q)
        low, high = problem.bounds(fit.spring_class)
        self.free = (fit.q > low + AT_BOUND) & (fit.q < high - AT_BOUND)
        self.time = autocorrelation_time(self.solved.residuals)

    @cached_property
    def jacobian(self) -> FloatArray:
        """Of the residuals by all c and q, shape (P, p + Q)."""
        solved = self.solved
        apart = replace(solved, inside=np.zeros_like(solved.inside))  # the derivatives by q alone
        by_q = self.problem.derivatives(self.fit.spring_class, self.fit.q, apart)
        return np.hstack([solved.columns * solved.inside, by_q])

    @cached_property
    def felt(self) -> IndexArray:
        """The columns of the Jacobian that are not 0."""
        return np.flatnonzero(np.any(self.jacobian != 0.0, axis=0))

    @cached_property
    def variance(self) -> float:
        """s^2*T, over the squared deviation of the force."""
        r = self.solved.residuals
        return float(r @ r) / max(r.size - self.felt.size, 1) * self.time

    @property
    def quantile(self) -> float:
        """97.5 % quantile of a parameter in standard errors, by the independent rows beside those it takes to fit."""
        return student_95(self.solved.residuals.size / self.time - self.felt.size)

    @cached_property
    def root(self) -> FloatArray:
        """R of the covariance R*R' of (c, q) over the force's deviation, rows of what is known being 0.

        Its last columns are no noise: how far the small penalty of the fit has pulled the parameters, and what turns
        that lie between two steps of the displacement may have done to them.
        """
        J = self.jacobian[:, self.felt]
        scale = np.linalg.norm(J, axis=0)
        J = J / scale
        values, vectors = np.linalg.eigh(J.T @ J)
        inverse = vectors / np.sqrt(np.maximum(values, 1e-13))  # rounding, of combined unit columns
        wrong = J.T @ np.column_stack([self.solved.residuals, self._by_steps])
        root = np.zeros((self.jacobian.shape[1], values.size + wrong.shape[1]))
        root[self.felt] = np.hstack([math.sqrt(self.variance) * inverse, inverse @ (inverse.T @ wrong)])
        root[self.felt] /= scale[:, None]
        return root

    @cached_property
    def _by_steps(self) -> FloatArray:
        """Changes of the force at the rows, over its deviation, shape (P, draws), whose products with each other are
        those of turns that are moved to either side by half a step, those of one displacement together.
        """
        problem, samples, terms, draw = self.problem, self.problem.samples, self.solved.terms, np.random.default_rng(0)
        steps = [0.5 * resolution(record.displacement) for record in samples.records]
        if max(steps) < 1e-5 * problem.half:  # no steps, but digits
            return np.empty((samples.rows.size, 0))
        forces = []
        for _ in range(8):
            records = []
            for record, turning, begin, step in zip(
                samples.records, samples.turning, samples.begins, steps, strict=False
            ):
                path, at = record.displacement.copy(), turning[1:-1] - begin
                places, of_turn = np.unique(path[at], return_inverse=True)
                outwards = np.sign(path[at] - path[turning[:-2] - begin])
                path[at] += step * outwards * (draw.random(places.size) < 0.5)[of_turn]
                records.append(replace(record, displacement=path))
            moved = Problem(samples.on(records), problem.starts, problem.roots)
            columns = moved.columns(self.fit.spring_class, self.fit.q, problem.frame)[:, terms:]
            forces.append(columns @ self.solved.coefficients[terms:])
        # By half a step outwards or not at all is by a quarter to either side.
        return np.asarray(2.0 * (np.array(forces) - np.mean(forces, axis=0)).T / math.sqrt(len(forces) - 1))

    def spread(self, of: Callable[[Fit, Linear], FloatArray]) -> FloatArray:
        """R of what a function makes of the fit and its linear problem, by differences."""
        split, at = self.solved.inside.size, np.concatenate([self.solved.coefficients, self.fit.q])
        # Steps of what is above 0 are small beside it.
        steps = 1e-4 * np.where(np.arange(at.size) < split, np.abs(at), 1.0).clip(1e-9)

        def moved(x: FloatArray) -> FloatArray:
            return of(replace(self.fit, q=x[split:]), replace(self.solved, coefficients=x[:split]))

        moves, base = steps * np.eye(at.size), moved(at)
        columns = [(moved(at + moves[k]) - base) / steps[k] for k in self.felt]
        return np.asarray(np.stack(columns, axis=1) @ self.root[self.felt])


def resolution(path: FloatArray) -> float:
    """Least distance between two displacements that are not the same: the step of those in steps, else hardly any."""
    apart = np.diff(np.unique(path))
    return float(np.min(apart, initial=float(np.ptp(path)), where=apart > 1e-9 * np.ptp(path)))


def _values(spring: SpringParameters) -> FloatArray:
    """The parameters of a spring in the order of `names_of`, with logarithms as there."""
    further: list[float] = []
    if (second := spring.second) is not None:
        further = [*second.kA[1:], *(math.log(getattr(second, name)) for name in NAMES)]
    for branch in spring.branches:
        further += [math.log(branch.stiffness), math.log(branch.time_constant)]
    logarithms = [math.log(getattr(spring, name)) for name in NAMES]
    return np.array([*getattr(spring, spring.elastic_name), *further, *spring.kA[1:], *logarithms])


def _uncertainty(linear: Linearised, few: Problem, spring: SpringParameters) -> dict[str, Any]:
    """Content of the model file's field `uncertainty`, but for the prediction interval."""
    natural = linear.spread(lambda fit, solved: _values(spring_of(linear.problem, fit, solved=solved)))
    values, elastic = _values(spring), len(getattr(spring, spring.elastic_name))
    errors = np.linalg.norm(natural, axis=1)
    errors[-3:][~linear.free[:3]] = 0.0  # at a bound
    shares = np.where(errors[-4:] > 0.0, errors[-4:], np.nan)
    matrix = np.clip(natural[-4:] @ natural[-4:].T / np.outer(shares, shares), -1.0, 1.0)  # but for rounding
    correlation = {f"{NAMES[i]},{NAMES[j]}": _plain(matrix[i, j]) for i, j in combinations(range(4), 2)}
    intervals = _intervals(linear, few, spring, errors[-4:])
    return {
        spring.elastic_name: errors[:elastic].tolist(),
        "kA": [0.0, *errors[-3 - len(spring.kA) : -4].tolist()],  # kA[0] is 1
        **{name: _plain(getattr(spring, name) * share) for name, share in zip(NAMES, shares, strict=True)},
        "interval_95": {name: list(ends) for name, ends in intervals.items()},
        "further": {
            name.removeprefix("ln "): _further(name, float(values[k]), float(errors[k]), linear.quantile)
            for k, name in enumerate(further_names(spring), elastic)
        },
        "autocorrelation_time": linear.time,
        "correlation": correlation,
        "joint": {
            "parameters": names_of(spring),
            "root": _lower(natural),
        },
        "indistinct": _indistinct(shares.tolist(), intervals, correlation),
    }


def _further(name: str, value: float, error: float, quantile: float) -> dict[str, Any]:
    """Standard error and 95 % interval of a parameter of a second mechanism or a branch, or of its logarithm."""
    if not error > 0.0:
        return {"standard_error": None, "interval_95": [None, None]}
    if not name.startswith("ln "):
        return {"standard_error": error, "interval_95": [value - quantile * error, value + quantile * error]}
    return {"standard_error": math.exp(value) * error, "interval_95": list(_around(math.exp(value), quantile * error))}


def _around(value: float, reach: float) -> Interval:
    """The interval of a logarithm known to so much; open where that is nothing: 50 is beyond all bounds of it."""
    return (None, None) if reach > 50.0 else (value * math.exp(-reach), value * math.exp(reach))


def _lower(root: FloatArray) -> list[list[float]]:
    """Rows of the lower triangular root with a diagonal >= 0 of the same covariance."""
    rows, columns = root.shape
    upper = np.asarray(np.linalg.qr(np.hstack([root, np.zeros((rows, max(0, rows - columns)))]).T, mode="r"))
    triangle = upper.T * np.where(np.diag(upper) < 0.0, -1.0, 1.0)
    return [[float(f"{v:.9g}") for v in row[: k + 1]] for k, row in enumerate(triangle)]


def _plain(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


# -- intervals


def _intervals(linear: Linearised, few: Problem, spring: SpringParameters, errors: FloatArray) -> dict[str, Interval]:
    """95 % intervals of kappa_omega, rho, sigma and n, open on a side on which the search's bound is reached first.

    To the standard errors adds how much the parameters change in the class that is one step richer in FE and in FA:
    what that is beyond chance, the chosen class has left out (Hausman, Econometrica 46, 1978). kappa_omega is a sum of
    c, which goes with the others: its interval holds the kappa_omega at the ends of theirs that are profiled, and is
    open where these are and it has moved.
    """
    if not errors.any():
        return {name: (0.5, None) if name == "sigma" else (None, None) for name in NAMES}
    c, q, law = linear.fit.spring_class, linear.fit.q, _law(linear.problem, linear.fit)
    degrees = tuple(step_on(AMPLIFIER, degree) for degree in c.amplifiers)
    richer = linear.problem.local(replace(c, elastic=step_on(ELASTIC, c.elastic), amplifiers=degrees), q, 8, 1e-4)
    reaches = linear.quantile * np.hypot(errors, np.log(_law(linear.problem, richer) / law))
    around = [_around(getattr(spring, name), float(reach)) for name, reach in zip(NAMES, reaches, strict=True)]
    lows, highs = [around[0][0] or 0.0], [around[0][1] or math.inf]
    best = Linearised(few, few.local(c, q, 8, 1e-6))
    for k in (k for k in (1, 2, 3) if not 0.0 < errors[k] <= _CURVED):
        ends = [_end(best, k, side, float(reaches[k])) for side in (-1, 1)]
        around[k] = ends[0][0], ends[1][0]
        for value, kappa in ends:
            is_open = value is None and abs(math.log(kappa / law[0])) > _CURVED
            lows.append(0.0 if is_open and kappa < law[0] else kappa)
            highs.append(math.inf if is_open and kappa > law[0] else kappa)
    around[0] = min(lows) or None, _plain(max(highs))
    around[2] = max(around[2][0] or 0.5, 0.5), around[2][1]  # what no spring can be is not part of it
    return dict(zip(NAMES, around, strict=True))


def _law(problem: Problem, fit: Fit) -> FloatArray:
    """kappa_omega [N], rho [1/m], sigma and n of the first mechanism."""
    solved, degree = problem.linear(fit.spring_class, fit.q), fit.spring_class.amplifiers[0]
    a = solved.coefficients[solved.terms : solved.terms + degree + 1]
    kappa = float(amplifier_columns(np.zeros(1), degree)[0] @ a) * problem.deviation
    rate, excess, n = np.exp(fit.q[:3]).tolist()
    return np.array([max(kappa, 1e-300), rate / problem.half, 0.5 + excess, n])


def _end(linear: Linearised, k: int, side: int, reach: float) -> tuple[float | None, float]:
    """An end of the interval of a parameter of `_law`: where the misfit, all else fitted again, has risen by what a
    linear one allows, None if it does not; and the kappa_omega there [N].
    """
    few, best, c, place = linear.problem, linear.fit, linear.fit.spring_class, k - 1
    allowed = linear.quantile**2 * linear.variance / linear.solved.residuals.size
    room = side * float(few.bounds(c)[side > 0][place] - best.q[place])
    inside, outside, fit, step = (0.0, 0.0), None, best, min(max(reach, 0.05), 1.0)
    for _ in range(8 if room > AT_BOUND else 0):  # 1.6^8 is 40 times the linear interval
        step = min(step, room)
        start = fit.q.copy()
        start[place] = best.q[place] + side * step
        fit = few.local(c, start, 5, 1e-3, held=place)
        rise = math.sqrt(max(fit.squares - best.squares, 0.0) / allowed)
        if rise >= 1.0:
            outside = step, rise
        elif step == room:
            break
        else:
            inside = step, rise
        if outside is None:
            step *= 1.6
        elif abs(rise - 1.0) < 0.1:
            fit.q[place] = best.q[place] + side * step / rise
            break
        else:  # the root of the rise is nearly a straight line
            step = inside[0] + (outside[0] - inside[0]) * (1.0 - inside[1]) / (outside[1] - inside[1])
    law = _law(few, fit)
    return None if outside is None else float(law[k]), float(law[0])


def _indistinct(
    shares: Sequence[float], intervals: Mapping[str, Interval], correlation: Mapping[str, float | None]
) -> list[str]:
    """Sentences about parameters that are strongly correlated in these records, or hardly known."""
    sentences, known = [], dict(zip(NAMES, shares, strict=True))
    for name, (low, high) in intervals.items():
        least = 0.5005 if name == "sigma" else 0.0  # which is no bound of the records
        is_bounded = low is not None and low > least
        if high is None and not is_bounded:
            sentences.append(f"{name} is not bounded by these records")
        elif high is None:
            sentences.append(f"{name} > {low:.2g}: these records bound it from below only (95 %)")
        elif low is None:
            sentences.append(f"{name} < {high:.2g}: these records bound it from above only (95 %)")
        elif known[name] > 0.5:
            sentences.append(f"{name} is known to lie between {low:.2g} and {high:.2g} only (95 %)")
    for pair, value in correlation.items():
        a, b = pair.split(",")
        # What is known to 2 % is distinct. At 0.98 errors are 5 times those of each alone.
        if value is not None and abs(value) > 0.98 and max(known[a], known[b]) > 0.02:
            sentences.append(f"{a} and {b} are strongly correlated in these records ({value:.3f})")
    return sentences
