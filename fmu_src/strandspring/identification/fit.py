"""The fit of one class of springs: a constrained linear problem inside a search over the few parameters that are not.

With y the place in the range, a spring of K mechanisms and B branches has the force

    r = sum_j e_j*E_j(y) + sum_k omega_k*sum_i a_ki*A_i(y) + sum_b c_b*m_b(t) + nuisances,

linear in e, a and c. omega_k depends on rho, sigma and n of a mechanism and on the path, m_b on tau. For given rho,
sigma, n and tau the linear coefficients follow from the normal equations with their constraints (`bases`,
`constrained`); the others are iterated on by Gauss and Newton (variable projection). With P the projection on the
columns whose coefficients are not held at 0, the derivatives of the residuals are (1 - P) times those of omega and m,
which the kernel gives exactly. No record is differentiated: a dashpot is a branch whose tau is short.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..kernel.arrays import BoolArray, FloatArray
from .bases import amplifier_columns, elastic_columns, fraction, inner_knots
from .constrained import nonnegative
from .figures import growing_variance, white_variance
from .samples import Samples

# Of rho times half the range, sigma - 1/2 and n, as logarithms.
LOW, HIGH = np.log([0.6, 1e-3, 0.05]), np.log([1000.0, 60.0, 12.0])
_MARGIN = 0.05  # by which FE may leave the recorded forces at its ends, share of their span
_SLACK = 0.02  # by which a rising FE may fall in all, likewise
NOTHING = 1e-6  # squared misfit over the variance of the force that is none: it is 0.1 % of the force
NOISE_ONLY = 0.1  # share of the squared misfit that is not white, up to which nothing but noise is left


@dataclass(frozen=True)
class SpringClass:
    """A class of springs; zeros of the force of further records, and its linear drift, are the rig's."""

    elastic: tuple[int, int] = (3, 0)  # degree of FE, and its knots within the range
    amplifiers: tuple[int, ...] = (0,)  # degree of the FA of each mechanism
    branches: int = 0
    may_fall: bool = False  # FE need not rise
    zeros: bool = False
    drift: bool = False

    @property
    def mechanisms(self) -> int:
        """One or two."""
        return len(self.amplifiers)

    @property
    def nonlinear(self) -> int:
        """Number of parameters that are iterated on."""
        return 3 * self.mechanisms + self.branches


@dataclass(frozen=True, eq=False)
class Frame:
    """The range that FE and FA are written on, and its distinct places: of a fold, without what is held out."""

    low: float
    high: float
    places: FloatArray


@dataclass(frozen=True, eq=False)
class Fit:
    """A class fitted."""

    spring_class: SpringClass
    q: FloatArray  # ln(rho*h), ln(sigma - 1/2), ln(n) of each mechanism, then ln(tau) of each branch
    squares: float  # mean squared residual over the variance of the force


class Problem:
    """The fits to some samples.

    Parameters
    ----------
    samples : Samples
    starts : ndarray, shape (R,), or None         omega at the first sample of each record; 0 if None.
    roots : ndarray, shape (P,), or None   Of the weights of the rows; 1 if None.
    """

    def __init__(self, samples: Samples, starts: FloatArray | None = None, roots: FloatArray | None = None) -> None:
        self.samples = samples
        self.roots = np.ones(samples.rows.size) if roots is None else roots
        self.starts = np.zeros(len(samples.records)) if starts is None else starts
        self.frame = Frame(*samples.reach, fraction(samples.x, *samples.reach))
        self.half = 0.5 * (self.frame.high - self.frame.low)
        # Their range without outliers.
        low, high = np.quantile(samples.force, [5e-4, 1.0 - 5e-4]).tolist()
        self.lowest, self.span = low, high - low
        self.deviation = float(np.std(samples.r)) or 1.0
        self._omegas: dict[tuple[float, ...], tuple[FloatArray, FloatArray]] = {}
        self._statics: dict[tuple[object, ...], tuple[FloatArray, list[FloatArray]]] = {}

    # -- columns

    def _statics_of(self, c: SpringClass, frame: Frame) -> tuple[FloatArray, list[FloatArray]]:
        """Columns of FE and of each FA at the rows."""
        key = (c.elastic, c.amplifiers, frame.low, frame.high)
        if key not in self._statics:
            y = fraction(self.samples.x, frame.low, frame.high)
            degree, knots = c.elastic
            elastic = elastic_columns(y, degree, inner_knots(knots, frame.places))
            self._statics[key] = elastic, [amplifier_columns(y, a) for a in c.amplifiers]
        return self._statics[key]

    def _omega(self, q: FloatArray) -> tuple[FloatArray, FloatArray]:
        """omega at the rows, and its derivatives by the three logarithms, shape (3, P)."""
        key = (0.0, *np.round(q, 12).tolist())
        if key not in self._omegas:
            self._forget()
            rho, excess, n = np.exp(q).tolist()
            sigma = 0.5 + excess
            omega, derivatives = self.samples.points.omega(rho / self.half, sigma, n, self.starts, coarse=True)
            self._omegas[key] = omega, derivatives[:3] * np.array([[1.0], [excess / sigma], [1.0]])
        return self._omegas[key]

    def _maxwell(self, log_tau: float) -> tuple[FloatArray, FloatArray]:
        """Force of a branch and its derivative by ln(tau), scaled so that the largest is 1."""
        key = (1.0, round(log_tau, 12))
        if key not in self._omegas:
            self._forget()
            column, derivative = self.samples.maxwell(math.exp(log_tau))
            self._omegas[key] = column / self.half, derivative / self.half
        return self._omegas[key]

    def _forget(self) -> None:
        if len(self._omegas) > 400:
            self._omegas.clear()

    @cached_property
    def _zeros(self) -> FloatArray:
        of_row = self.samples.record_of_row
        return np.array([(of_row == k) - np.mean(of_row == k) for k in range(1, len(self.samples.records))]).T

    @cached_property
    def _drift(self) -> FloatArray:
        """-1/2 to 1/2 from the first sample to the last."""
        return (self.samples.rows / (self.samples.displacement.size - 1) - 0.5)[:, None]

    def columns(self, c: SpringClass, q: FloatArray, frame: Frame) -> FloatArray:
        """All columns at the rows: FE, the FA of each mechanism times omega, branches, nuisances."""
        elastic, amplifiers = self._statics_of(c, frame)
        blocks = [elastic]
        blocks += [A * self._omega(q[3 * k : 3 * k + 3])[0][:, None] for k, A in enumerate(amplifiers)]
        blocks += [self._maxwell(log_tau)[0][:, None] for log_tau in q[3 * c.mechanisms :].tolist()]
        blocks += [self._zeros] if c.zeros else []
        blocks += [self._drift] if c.drift else []
        return np.hstack(blocks) * self.roots[:, None]

    # -- the linear problem

    def linear(
        self, c: SpringClass, q: FloatArray, frame: Frame | None = None, kept: BoolArray | None = None
    ) -> Linear:
        """Its solution on the rows that are kept, all if None."""
        frame = self.frame if frame is None else frame
        A = self.columns(c, q, frame)
        terms = self._statics_of(c, frame)[0].shape[1]
        fall = self.span * (1.0 if c.may_fall else _SLACK) / (terms - 1)
        base = self.lowest - _MARGIN * self.span
        # FE = base + fall, falling, + what may not be negative.
        origin = base * self.roots - fall * A[:, 1:terms].sum(axis=1)
        scale = self.deviation
        target = (self.samples.r * self.roots - origin) / scale
        B, b = (A, target) if kept is None else (A[kept], target[kept])
        size = A.shape[1]
        G, g = np.zeros((size + 1, size + 1)), np.zeros(size + 1)
        G[:-1, :-1] = B.T @ B
        g[:-1] = B.T @ b
        free = np.zeros(size + 1, bool)
        free[size - self._count(c) : size] = True
        diagonal = np.arange(size + 1)
        # So small that it only decides where data do not.
        ridge = 1e-6 * b.size
        least = ridge + 1e-10 * np.trace(G) / size
        # The upper end of FE is a sum of coefficients, and with one more that is not negative the highest force.
        bounded, heavy = np.zeros(size + 1), 1e3 * b.size
        bounded[:terms] = bounded[size] = 1.0
        highest = (self.span * (1.0 + 2.0 * _MARGIN) + fall * (terms - 1)) / scale
        G += heavy * np.outer(bounded, bounded)
        g += heavy * highest * bounded
        G[diagonal, diagonal] += least
        if terms > 4:
            bends = np.diff(np.eye(terms - 1), axis=0)
            G[1:terms, 1:terms] += ridge * (terms - 1) * bends.T @ bends
        coefficients, inside = nonnegative(G, g, free)
        residuals = A @ coefficients[:-1] - target
        # The further coefficient, where it is not at 0, gives way as the others move.
        normal = G[:-1, :-1] - np.outer(G[-1, :-1], G[-1, :-1]) / G[-1, -1] if inside[-1] else G[:-1, :-1]
        return Linear(coefficients[:-1], inside[:-1], A, residuals, terms, base, fall, normal)

    def derivatives(self, c: SpringClass, q: FloatArray, solved: Linear, kept: BoolArray | None = None) -> FloatArray:
        """Of the residuals by q, shape (P, Q)."""
        _, amplifiers = self._statics_of(c, self.frame)
        at, columns = solved.terms, []
        for k, A in enumerate(amplifiers):
            G = A @ solved.coefficients[at : at + A.shape[1]]
            at += A.shape[1]
            columns += list(G * self._omega(q[3 * k : 3 * k + 3])[1])
        for b, log_tau in enumerate(q[3 * c.mechanisms :].tolist()):
            columns.append(solved.coefficients[at + b] * self._maxwell(log_tau)[1])
        D = np.stack(columns, axis=1) * self.roots[:, None]
        A = solved.columns[:, solved.inside]
        within = slice(None) if kept is None else kept
        along = np.linalg.solve(solved.normal[np.ix_(solved.inside, solved.inside)], A[within].T @ D[within])
        return D - A @ along

    # -- the search

    def bounds(self, c: SpringClass) -> tuple[FloatArray, FloatArray]:
        """Of q."""
        low, high = [LOW] * c.mechanisms, [HIGH] * c.mechanisms
        if c.branches:
            # Beyond these a branch is a dashpot or a spring.
            shortest, longest = self.taus
            low.append(np.full(c.branches, math.log(0.2 * shortest)))
            high.append(np.full(c.branches, math.log(3.0 * longest)))
        return np.concatenate(low), np.concatenate(high)

    @cached_property
    def taus(self) -> tuple[float, float]:
        """Median step of the times and duration of all records [s]."""
        times = [record.time for record in self.samples.records if record.time is not None]
        return float(np.median(np.concatenate([np.diff(time) for time in times]))), self.samples.duration

    def nuisances(self, fit: Fit) -> tuple[FloatArray, float]:
        """Zero of each record beside their mean, and the drift from the first sample to the last [N]."""
        c, records = fit.spring_class, self.samples.records
        solved = self.linear(c, fit.q)
        found = solved.coefficients[solved.coefficients.size - self._count(c) :] * self.deviation
        offsets = np.zeros(len(records))
        if c.zeros:
            offsets[1:] = found[: len(records) - 1]
            offsets -= float(np.mean(offsets[self.samples.record_of_row]))
        return offsets, float(found[-1]) if c.drift else 0.0

    def _count(self, c: SpringClass) -> int:
        """Number of nuisances."""
        return (len(self.samples.records) - 1 if c.zeros else 0) + c.drift

    def squares(self, c: SpringClass, q: FloatArray) -> float:
        """Mean squared residual with these q."""
        return float(np.mean(self.linear(c, q).residuals ** 2))

    def local(
        self, c: SpringClass, start: FloatArray, iterations: int = 12, tolerance: float = 1e-4, held: int | None = None
    ) -> Fit:
        """The minimum near a start by Gauss-Newton steps with damping, within the bounds; one q may be held."""
        low, high = self.bounds(c)
        q = np.clip(start, low, high)
        solved = self.linear(c, q)
        cost = float(solved.residuals @ solved.residuals)
        damping = 1e-2
        for _ in range(iterations):
            J = self.derivatives(c, q, solved)
            H, slope = J.T @ J, J.T @ solved.residuals
            moves = ~((q <= low) & (slope > 0.0) | (q >= high) & (slope < 0.0)) & (np.arange(q.size) != held)
            if not moves.any():
                break
            trial = None
            for _ in range(5):
                step = np.zeros(q.size)
                damped = H + np.diag(damping * np.diag(H) + 1e-9 * J.shape[0])
                step[moves] = -np.linalg.solve(damped[np.ix_(moves, moves)], slope[moves])
                there = np.clip(q + np.clip(step, -1.0, 1.0), low, high)
                trial = self.linear(c, there)
                after = float(trial.residuals @ trial.residuals)
                if after < cost:
                    break
                damping *= 6.0
            else:
                break
            gain = cost - after
            q, solved, cost = there, trial, after
            damping = max(0.2 * damping, 1e-7)
            if gain < tolerance * cost:
                break
        return Fit(c, q, cost / solved.residuals.size)

    def is_noise(self, fit: Fit) -> bool:
        """Whether nothing but noise is left, by the differences of neighbouring residuals, or hardly anything."""
        residuals = self.linear(fit.spring_class, fit.q).residuals
        return fit.squares < NOTHING or white_variance(residuals) > (1.0 - NOISE_ONLY) * float(np.mean(residuals**2))

    def criterion(self, fit: Fit) -> float:
        """K*ln(S) + 2*p*ln(ln(K)) of K rows, squares S, p parameters (Hannan and Quinn, J. R. Stat. Soc. B 41, 1979).

        It decides where nothing but white noise is left: the held-out errors are those of the noise then.
        """
        c, rows = fit.spring_class, self.samples.rows.size
        parameters = sum(c.elastic) + sum(c.amplifiers) + c.may_fall + c.nonlinear
        return rows * math.log(fit.squares + NOTHING) + 2.0 * parameters * math.log(math.log(rows))

    def weighted(self, fit: Fit, robust: bool) -> Problem | None:
        """The problem with rows weighted by their residuals (Huber) or by their noise; None where that changes nothing.

        The noise counts where it grows with the force and nothing else is left.
        """
        misfit = self.linear(fit.spring_class, fit.q).residuals / self.roots
        squares = float(np.mean(misfit**2))
        if robust:
            large = np.abs(misfit) / max(float(np.median(np.abs(misfit))) / 0.6745, 1e-300)
            # In standard deviations; 1.345 is 95 % efficient for normal noise (Huber 1981).
            roots = np.sqrt(np.minimum(1.0, 1.345 / np.maximum(large, 1e-300)))
        else:
            # By the predicted force: weights by the measured one would favour what noise makes small.
            force = self.samples.r / self.deviation + misfit
            additive, growing = growing_variance(force, misfit)
            if not growing or 1.0 - white_variance(misfit) / squares > NOISE_ONLY:
                return None
            roots = np.sqrt(squares / (additive + growing * force**2))
        weighted = Problem(self.samples, self.starts, roots)
        weighted.frame = self.frame
        return weighted

    def refined(self, fit: Fit, samples: Samples, robust: bool) -> tuple[Problem, Fit]:
        """The fit on more rows, weighted again and again where that is called for."""
        finer = Problem(samples, self.starts)
        finer.frame = self.frame
        for _ in range(3):
            fit = finer.local(fit.spring_class, fit.q, 15, 1e-6)
            other = finer.weighted(fit, robust)
            if other is None:
                break
            finer = other
        return finer, finer.local(fit.spring_class, fit.q, 15, 1e-6)

    def held_out(self, fit: Fit) -> FloatArray:
        """Residuals of each fold over the force's deviation, nan beside it, shape (F, P); the fit moved by one step."""
        c, q = fit.spring_class, fit.q
        low, high = self.bounds(c)
        solved = self.linear(c, q)
        J = self.derivatives(c, q, solved)
        held_out = np.full(self.samples.folds.shape, np.nan)
        for fold, here in zip(self.samples.folds, held_out, strict=True):
            kept = ~fold
            H = J[kept].T @ J[kept]
            step = -np.linalg.solve(
                H + np.diag(0.03 * np.diag(H) + 1e-6 * kept.sum()), J[kept].T @ solved.residuals[kept]
            )
            x = self.samples.x[kept]
            ends = float(x.min()), float(x.max())
            frame = Frame(*ends, fraction(x, *ends))
            least = float(np.mean(solved.residuals[kept] ** 2))
            for place in (np.clip(q + np.clip(step, -0.7, 0.7), low, high), q):
                residuals = self.linear(c, place, frame, kept).residuals
                here[fold] = (self._zeroed(residuals, kept) if c.zeros else residuals)[fold]
                # Where the step is too long there is none.
                if np.mean(residuals[kept] ** 2) <= least:
                    break
        return held_out

    def _zeroed(self, residuals: FloatArray, kept: BoolArray) -> FloatArray:
        """The zero of a record that is held out as a whole is its own."""
        residuals = residuals.copy()
        for k in range(len(self.samples.records)):
            here = self.samples.record_of_row == k
            if not (here & kept).any():
                residuals[here] -= residuals[here].mean()
        return residuals


@dataclass(frozen=True, eq=False)
class Linear:
    """Solution of the linear problem at some q."""

    coefficients: FloatArray  # over the force's deviation, those of FE beyond its falling line, shape (p,)
    inside: BoolArray  # those not held at 0
    columns: FloatArray  # shape (P, p)
    residuals: FloatArray  # predicted minus measured force, over its deviation, shape (P,)
    terms: int  # columns of FE
    base: float  # of the falling line [N]
    fall: float
    normal: FloatArray  # shape (p, p)
