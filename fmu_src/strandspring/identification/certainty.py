"""How certain an identified spring is: all that is said of it comes from one linearised fit, and from its rivals.

With A the columns of the linear coefficients c that are not held at 0 and D the derivatives of the residuals by those
q = (ln rho*h, ln(sigma - 1/2), ln n, ..., ln tau), both weighted as in the fit, (c, q) has the covariance

    s^2*T*(J'J)^-1,      J = [A, D],

with s^2 the variance and T the autocorrelation time of the residuals. Saved are functions of (c, q): kE, the table of
FE and kA*kappa_omega are linear in c, so that their errors are exact; those of kA and of all logarithms follow from the
first derivatives. A coefficient that is held at 0, the end of what a spring may
be, counts as known: it may lie on one side only, and by how little the records do not say. A q at its bound has no
standard error of its own, but the others have theirs as if it were free, since it may lie on the other side. Where a
logarithm is little known, or at a bound, its interval ends where the misfit, all else fitted again, has risen by as
much as it would at the end of a linear one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from ..core.parameters import SpringParameters
from ..kernel.arrays import FloatArray
from ..model.joint import joint_names
from .bases import AMPLIFIER, ELASTIC, Shape, amplifier_columns, inner_knots, step_on
from .choice import Choice
from .figures import autocorrelation_time
from .fit import Fit, Linear, Problem, SpringClass
from .predictions import ForceInterval, LackOfFit, PredictionBand, Unrecorded, student_95
from .spring import FLOOR

NAMES = ("kappa_omega", "rho", "sigma", "n")
_RANK = 1e-13  # squared length of combined unit columns below which they are as little known as that
_FINE, _DRAWS, _SEED = 1e-5, 8, 0  # share of half the range that is no step; draws of turns moved within a step
_AT_BOUND = 1e-3  # distance of a q from its bound that counts as none
_CURVED = 0.1  # standard error of a logarithm from which the misfit is not taken as parabolic
_UNKNOWN = 50.0  # reach of a logarithm from which nothing is known of its parameter
_LONGEST, _EVALUATIONS, _NEAR = 1.0, 7, 0.08  # step, points and accuracy of an end of a profile
_CORRELATED, _WELL_KNOWN, _UNCERTAIN = 0.98, 0.02, 0.5  # from which parameters are called indistinct, or hardly known
_MEANING = (
    "standard errors (one standard deviation) and 95 % intervals for residuals that are correlated from sample to "
    "sample; the intervals of kappa_omega, rho, sigma and n are null on a side on which the records do not bound them"
)
Interval = tuple[float | None, float | None]


@dataclass(frozen=True, eq=False)
class Certainty:
    """What is known of a spring.

    Attributes
    ----------
    uncertainty : dict           Content of the model file's field.
    unrecorded : Unrecorded      What loops may do that were not recorded.
    lack : LackOfFit             What the spring misses.
    band : PredictionBand        Its last closed loop.
    """

    uncertainty: dict[str, Any]
    unrecorded: Unrecorded
    lack: LackOfFit
    band: PredictionBand


def certainty(choice: Choice, problem: Problem, spring: SpringParameters) -> Certainty:
    """That of the spring that was saved of the best fit of a choice.

    Parameters
    ----------
    choice : Choice             What was judged; its problem has few rows, on which rivals are sought.
    problem : Problem           To which `choice.best` was fitted in the end.
    spring : SpringParameters   As saved.
    """
    linear = Linearised(problem, choice.best.fit)
    lack = LackOfFit.of(problem, choice.best.fit)
    interval = ForceInterval.of(problem, choice.best.fit, linear.force_error, linear.time)
    return Certainty(
        {**_uncertainty(linear, choice.problem, spring), "prediction_interval": interval.as_json()},
        Unrecorded.of(choice, linear.coefficient_root, lack.missed * problem.deviation),
        lack,
        PredictionBand.of(problem, choice.best.fit, linear.force_error, interval),
    )


class Linearised:
    """A fit as a linear problem in its coefficients c, those held at 0 being known, and its q."""

    def __init__(self, problem: Problem, fit: Fit) -> None:
        self.problem, self.fit = problem, fit
        self.solved = problem.linear(fit.spring_class, fit.q)
        low, high = problem.bounds(fit.spring_class)
        self.free = (fit.q > low + _AT_BOUND) & (fit.q < high - _AT_BOUND)
        self.time = autocorrelation_time(self.solved.residuals)

    @cached_property
    def jacobian(self) -> FloatArray:
        """Of the residuals by all c and q, shape (P, p + Q)."""
        solved = self.solved
        apart = replace(solved, inside=np.zeros_like(solved.inside))  # the derivatives by q alone
        by_q = self.problem.derivatives(self.fit.spring_class, self.fit.q, apart)
        return np.hstack([solved.columns * solved.inside, by_q])

    @property
    def degrees_of_freedom(self) -> float:
        """Rows that are independent, without those that the parameters take."""
        return max(self.solved.residuals.size / self.time - int(self._felt.sum()), 4.0)

    @cached_property
    def _felt(self) -> NDArray[np.bool_]:
        return np.asarray(np.any(self.jacobian != 0.0, axis=0))

    @cached_property
    def variance(self) -> float:
        """s^2*T, over the squared deviation of the force."""
        r = self.solved.residuals
        return float(r @ r) / max(r.size - int(self._felt.sum()), 1) * self.time

    @cached_property
    def root(self) -> FloatArray:
        """R of the covariance R*R' of (c, q) over the force's deviation, rows of what is known being 0.

        Its last columns are no noise: how far the small penalty of the fit has pulled the parameters, and what turns
        that lie between two steps of the displacement may have done to them.
        """
        used = np.flatnonzero(self._felt)
        J = self.jacobian[:, used]
        scale = np.linalg.norm(J, axis=0)
        J = J / scale
        values, vectors = np.linalg.eigh(J.T @ J)
        inverse = vectors / np.sqrt(np.maximum(values, _RANK))
        wrong = J.T @ np.column_stack([self.solved.residuals, self._by_steps])
        root = np.zeros((self._felt.size, used.size + wrong.shape[1]))
        root[used] = np.hstack([math.sqrt(self.variance) * inverse, inverse @ (inverse.T @ wrong)]) / scale[:, None]
        return root

    @cached_property
    def _by_steps(self) -> FloatArray:
        """Changes of the force at the rows, over its deviation, shape (P, draws), whose products with each other are
        those of turns that are moved to either side by half a step, those of one displacement together.
        """
        samples = self.problem.samples
        steps = [0.5 * resolution(record.displacement) for record in samples.records]
        if max(steps) < _FINE * self.problem.half:
            return np.empty((samples.rows.size, 0))
        draw = np.random.default_rng(_SEED)
        base, everywhere, *some = [self._moved(steps, share, draw) for share in (0.0, 1.0, *[0.5] * _DRAWS)]
        # Those moved outwards less those moved inwards.
        return np.stack([2.0 * part - everywhere - base for part in some], axis=1) / math.sqrt(_DRAWS)

    def _moved(self, steps: Sequence[float], share: float, draw: np.random.Generator) -> FloatArray:
        """Force but FE at the rows, over its deviation, with a share of the turns moved outwards by a step."""
        samples, records = self.problem.samples, []
        for record, turning, begin, step in zip(samples.records, samples.turning, samples.begins, steps, strict=False):
            path, at = record.displacement.copy(), turning[1:-1] - begin
            places, of_turn = np.unique(path[at], return_inverse=True)
            outwards = np.sign(path[at] - path[turning[:-2] - begin])
            path[at] += step * outwards * (draw.random(places.size) < share)[of_turn]
            records.append(replace(record, displacement=path))
        other = Problem(samples.on(records), self.problem.starts)
        other.frame = self.problem.frame
        columns = other.columns(self.fit.spring_class, self.fit.q, self.problem.frame)[:, self.solved.terms :]
        return np.asarray((columns @ self.solved.coefficients[self.solved.terms :]) * self.problem.roots)

    @cached_property
    def coefficient_root(self) -> FloatArray:
        """The same of coefficients in newtons."""
        root = self.root.copy()
        root[: self.solved.inside.size] *= self.problem.deviation
        return root

    @cached_property
    def force_error(self) -> FloatArray:
        """Standard error of the predicted force at the rows, shape (P,) [N]."""
        error = np.linalg.norm(self.jacobian @ self.root, axis=1)
        return np.asarray(self.problem.deviation * error / self.problem.roots)

    @property
    def quantile(self) -> float:
        """97.5 % quantile of a parameter in standard errors."""
        return student_95(self.degrees_of_freedom)


def resolution(path: FloatArray) -> float:
    """Least distance between two displacements that are not the same: the step of those in steps, else hardly any."""
    apart = np.diff(np.unique(path))
    return float(np.min(apart, initial=float(np.ptp(path)), where=apart > 1e-9 * np.ptp(path)))


@dataclass(frozen=True, eq=False)
class _Saved:
    """Derivatives of the saved parameters by (c, q), c in newtons: rows of FE, of what is further, of kA and of the
    logarithms of `NAMES`.
    """

    elastic: FloatArray
    further: dict[str, FloatArray]
    amplifier: FloatArray
    logarithms: FloatArray

    @classmethod
    def of(cls, linear: Linearised, spring: SpringParameters) -> _Saved:
        """Those of the parameters of a saved spring, whose mechanisms are some of the fit's."""
        problem, c, q, solved = linear.problem, linear.fit.spring_class, linear.fit.q, linear.solved
        frame, width = problem.frame, solved.inside.size + q.size
        degree, knots = c.elastic
        elastic = np.zeros((len(getattr(spring, spring.elastic_name)), width))
        for j, unit in enumerate(np.eye(solved.terms)):
            shape = Shape(frame.low, frame.high, degree, inner_knots(knots, frame.places), unit)
            elastic[:, j] = shape.elastic_parameters()[spring.elastic_name]
        at, mechanisms = solved.terms, []
        for k, place in enumerate(c.amplifiers):
            columns = np.arange(at, at + place + 1)
            at = int(columns[-1]) + 1
            mechanisms.append(_of_mechanism(problem, solved, columns, q[3 * k : 3 * k + 3], 3 * k, width))
        rates = np.exp(q[: 3 * c.mechanisms : 3]) / problem.half
        own = [
            m
            for m, rho in zip(mechanisms, rates, strict=True)
            if any(math.isclose(rho, s.rho) for s in spring.mechanisms)
        ]
        amplifier, logarithms = own[0] if own else (np.zeros((1, width)), np.zeros((4, width)))
        further: dict[str, FloatArray] = {}
        if spring.second is not None:
            further |= {f"second.kA[{k}]": row for k, row in enumerate(own[1][0]) if k}
            further |= {f"ln second.{name}": row for name, row in zip(NAMES, own[1][1], strict=True)}
        saved = [branch.time_constant for branch in spring.branches]
        for b, tau in enumerate(np.exp(q[3 * c.mechanisms :]).tolist()):
            for j in (j for j, other in enumerate(saved) if math.isclose(other, tau)):
                stiffness, time = np.zeros((2, width))
                stiffness[at + b] = 1.0 / (solved.coefficients[at + b] * problem.deviation)
                time[solved.inside.size + 3 * c.mechanisms + b] = 1.0
                further |= {f"ln branches[{j}].stiffness": stiffness, f"ln branches[{j}].time_constant": time}
        return cls(elastic, further, amplifier, logarithms)


def _of_mechanism(
    problem: Problem, solved: Linear, columns: NDArray[np.intp], q: FloatArray, place: int, width: int
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of kA and of the four logarithms of a mechanism."""
    powers = _powers(columns.size - 1, problem.half)
    amplifier, logarithms = np.zeros((columns.size, width)), np.zeros((4, width))
    values = powers @ solved.coefficients[columns].clip(FLOOR * solved.coefficients[columns].max()) * problem.deviation
    if not values[0] > 0.0:
        return amplifier, logarithms  # it is not saved
    amplifier[:, columns] = (powers - np.outer(values / values[0], powers[0])) / values[0]
    amplifier[0] = 0.0  # 1 by definition
    logarithms[0, columns] = powers[0] / values[0]
    excess = math.exp(q[1])
    at = solved.inside.size + place
    logarithms[[1, 2, 3], [at, at + 1, at + 2]] = 1.0, excess / (0.5 + excess), 1.0
    return amplifier, logarithms


def _powers(degree: int, half: float) -> FloatArray:
    """The powers of x about the middle in which Bernstein polynomials over a range are written."""
    y = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    return polynomial.polyfit(y, amplifier_columns(y, degree), degree) / half ** np.arange(degree + 1)[:, None]


def _uncertainty(linear: Linearised, few: Problem, spring: SpringParameters) -> dict[str, Any]:
    """Content of the model file's field `uncertainty`, but for the prediction interval."""
    saved = _Saved.of(linear, spring)
    rows = [saved.elastic, *(row[None] for row in saved.further.values()), saved.amplifier, saved.logarithms]
    natural = np.vstack(rows) @ linear.coefficient_root
    errors = np.linalg.norm(natural, axis=1)
    errors[-3:][~linear.free[:3]] = 0.0  # at a bound
    elastic, further, amplifier = saved.elastic.shape[0], len(saved.further), saved.amplifier.shape[0]
    scale = np.where(errors[-4:] > 0.0, errors[-4:], np.nan)
    matrix = np.clip(natural[-4:] @ natural[-4:].T / np.outer(scale, scale), -1.0, 1.0)  # but for rounding
    correlation = {(a, b): float(matrix[i, j]) for (i, a), (j, b) in combinations(enumerate(NAMES), 2)}
    shares = dict(zip(NAMES, scale.tolist(), strict=True))
    intervals = _intervals(linear, few, spring, errors[-4:])
    return {
        "meaning": _MEANING,
        spring.elastic_name: errors[:elastic].tolist(),
        "kA": errors[-4 - amplifier : -4].tolist(),
        **{name: _plain(getattr(spring, name) * share) for name, share in shares.items()},
        "interval_95": {name: list(ends) for name, ends in intervals.items()},
        "further": _further(saved.further, errors[elastic : elastic + further], linear.quantile, spring),
        "autocorrelation_time": linear.time,
        "force_rms": float(np.sqrt(np.mean(linear.force_error**2))),
        "force_max": float(linear.force_error.max()),
        "correlation": {f"{a},{b}": _plain(value) for (a, b), value in correlation.items()},
        "joint": {
            "meaning": "rows of the lower triangular root L of the joint covariance L*L'",
            "parameters": joint_names(spring.elastic_name, elastic, amplifier - 1, list(saved.further)),
            "root": _lower(np.delete(natural, elastic + further, axis=0)),  # kA[0] is 1
        },
        "indistinct": _indistinct(shares, intervals, correlation),
    }


def _further(
    rows: Mapping[str, FloatArray], errors: FloatArray, quantile: float, spring: SpringParameters
) -> dict[str, Any]:
    """Standard error and 95 % interval of each parameter of a second mechanism and of branches, by its name."""
    known: dict[str, Any] = {}
    for name, error in zip(rows, errors.tolist(), strict=True):
        plain = name.removeprefix("ln ")
        value = _value(spring, plain)
        if not error > 0.0:
            known[plain] = {"standard_error": None, "interval_95": [None, None]}
        elif plain == name:
            known[name] = {"standard_error": error, "interval_95": [value - quantile * error, value + quantile * error]}
        else:
            known[plain] = {"standard_error": value * error, "interval_95": list(_around(value, quantile * error))}
    return known


def _value(spring: SpringParameters, name: str) -> float:
    """A parameter by its name as in "second.kA[1]" and "branches[0].stiffness"."""
    owner, _, field = name.partition(".")
    if owner == "second":
        second = spring.second
        return float(second.kA[int(field[3:-1])] if field.startswith("kA") else getattr(second, field))  # type: ignore[union-attr]
    return float(getattr(spring.branches[int(owner[9:-1])], field))


def _around(value: float, reach: float) -> Interval:
    """The interval of a logarithm known to so much; open where that is nothing."""
    return (None, None) if reach > _UNKNOWN else (value * math.exp(-reach), value * math.exp(reach))


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
    """95 % intervals of kappa_omega, rho, sigma and n: open on a side on which the search's bound is reached first.

    kappa_omega is a sum of c, which goes with the others: where one of these is profiled, its interval holds the
    kappa_omega at the ends of theirs, and is open where these are.
    """
    if not errors.any():
        return {name: (0.5, None) if name == "sigma" else (None, None) for name in NAMES}
    reaches = linear.quantile * np.hypot(errors, _against_richer(linear))
    intervals = {name: _around(getattr(spring, name), float(r)) for name, r in zip(NAMES, reaches, strict=True)}
    kappas: list[Interval] = [intervals["kappa_omega"]]
    profile = None
    for k, name in enumerate(NAMES[1:]):
        if not 0.0 < errors[1 + k] <= _CURVED:
            profile = profile or _Profile(few, linear.fit)
            ends = [profile.end(k, side, float(reaches[1 + k])) for side in (-1, 1)]
            intervals[name] = ends[0][0], ends[1][0]
            kappas += [ends[0][1], ends[1][1]]
    lows, highs = zip(*kappas, strict=True)
    intervals["kappa_omega"] = None if None in lows else min(lows), None if None in highs else max(highs)
    low, high = intervals["sigma"]
    intervals["sigma"] = max(low or 0.5, 0.5), high  # what no spring can be is not part of it
    return intervals


def _against_richer(linear: Linearised) -> FloatArray:
    """Change of the logarithms of kappa_omega, rho, sigma and n in the class that is one step richer in FE and in FA.

    What it is beyond chance, the chosen class has left out (Hausman, Econometrica 46, 1978).
    """
    problem, fit, c = linear.problem, linear.fit, linear.fit.spring_class
    richer = replace(
        c,
        elastic=step_on(ELASTIC, c.elastic),
        amplifiers=tuple(step_on(AMPLIFIER, degree) for degree in c.amplifiers),
    )
    other = problem.local(richer, fit.q, 8, 1e-4)
    logarithms: list[FloatArray] = [
        np.array([math.log(max(_kappa(problem, one), 1e-300)), one.q[0], math.log(0.5 + math.exp(one.q[1])), one.q[2]])
        for one in (fit, other)
    ]
    return np.asarray(logarithms[1] - logarithms[0])


def _kappa(problem: Problem, fit: Fit) -> float:
    """kappa_omega of the first mechanism [N]."""
    solved, terms = problem.linear(fit.spring_class, fit.q), fit.spring_class.amplifiers[0] + 1
    a = solved.coefficients[solved.terms : solved.terms + terms]
    return max(float(_powers(terms - 1, problem.half)[0] @ a), 0.0) * problem.deviation


class _Held(Problem):
    """A problem with one of its q held."""

    def __init__(self, problem: Problem, place: int, value: float) -> None:
        self.__dict__.update(problem.__dict__)
        self._place, self._value = place, value

    def bounds(self, c: SpringClass) -> tuple[FloatArray, FloatArray]:
        low, high = super().bounds(c)
        low[self._place] = high[self._place] = self._value
        return low, high


class _Profile:
    """Rise of the squared misfit with one q of the first mechanism, all else being fitted again."""

    def __init__(self, problem: Problem, fit: Fit) -> None:
        self.problem, self.c = problem, fit.spring_class
        self.best = problem.local(fit.spring_class, fit.q, 8, 1e-6)
        linear = Linearised(problem, self.best)
        self.rows = linear.solved.residuals.size
        self.allowed = linear.quantile**2 * linear.variance / self.rows
        self.low, self.high = problem.bounds(self.c)

    def end(self, k: int, side: int, reach: float) -> tuple[float | None, Interval]:
        """The parameter at an end of its interval, None if the misfit does not rise enough; and what interval of
        kappa_omega goes with it.
        """

        def logarithm(value: float) -> float:
            return math.log(0.5 + math.exp(value)) if k == 1 else value

        def back(value: float) -> float:
            return math.log(max(math.exp(value) - 0.5, 1e-9)) if k == 1 else value

        centre = logarithm(float(self.best.q[k]))
        room = side * (logarithm(float((self.low if side < 0 else self.high)[k])) - centre)
        kappa = _kappa(self.problem, self.best)
        if room <= _AT_BOUND:
            return None, (kappa, kappa)
        step = min(reach or room / 4.0, _LONGEST, room)
        inside, outside, fit, value = (0.0, 0.0), (math.inf, math.inf), self.best, None
        for _ in range(_EVALUATIONS):
            start = fit.q.copy()
            start[k] = back(centre + side * step)
            there = _Held(self.problem, k, float(start[k])).local(self.c, start, 5, 1e-3)
            rise = math.sqrt(max(there.squares - self.best.squares, 0.0) / self.allowed)
            if rise >= 1.0:
                outside = step, rise
            else:
                inside, fit = (step, rise), there
                if step >= room * (1.0 - 1e-9):
                    break
            if abs(rise - 1.0) < _NEAR:
                value = step
                break
            if math.isinf(outside[0]):
                step = min(room, step + min(_LONGEST, max(0.5 * step, step * (1.0 / max(rise, 0.3) - 1.0))))
            else:
                share = (1.0 - inside[1]) / (outside[1] - inside[1])  # the root of the rise is nearly a straight line
                value = step = inside[0] + (outside[0] - inside[0]) * min(max(share, 0.1), 0.9)
        other = _kappa(self.problem, there)
        low, high = min(kappa, other), max(kappa, other)
        if value is not None:
            return math.exp(centre + side * value) / (self.problem.half if k == 0 else 1.0), (low, high)
        far = high > kappa * math.exp(_CURVED), low < kappa * math.exp(-_CURVED)
        return None, (None if far[1] else low, None if far[0] else high)


def _indistinct(
    shares: Mapping[str, float], intervals: Mapping[str, Interval], correlation: Mapping[tuple[str, str], float]
) -> Sequence[str]:
    """Sentences about parameters that are strongly correlated in these records, or hardly known."""
    sentences = []
    for name, (low, high) in intervals.items():
        least = 0.5 if name == "sigma" else 0.0
        if high is None and (low is None or low <= least * 1.001):
            sentences.append(f"{name} is not bounded by these records")
        elif high is None:
            sentences.append(f"{name} > {low:.2g}: these records bound it from below only (95 %)")
        elif low is None:
            sentences.append(f"{name} < {high:.2g}: these records bound it from above only (95 %)")
        elif shares[name] > _UNCERTAIN:
            sentences.append(f"{name} is known to lie between {low:.2g} and {high:.2g} only (95 %)")
    return sentences + [
        f"{a} and {b} are strongly correlated in these records ({value:.3f})"
        for (a, b), value in correlation.items()
        if abs(value) > _CORRELATED and max(shares[a], shares[b]) > _WELL_KNOWN
    ]
