"""Least squares of a spring with several friction mechanisms and Maxwell branches, by variable projection.

    F = FE(x) + sum over mechanisms of G_k(x)*omega_k + sum over branches of c_j*q_j,    dq_j/dt = dx/dt - q_j/tau_j.

For given rho, sigma and n of every mechanism, omega_start of every record and tau of every branch, the coefficients of
FE, of the G_k = kappa_k*FA_k > 0 and the stiffnesses c_j >= 0 follow from one linear problem, so that only those few
are iterated on. The Jacobian is that of Kaufman, as in `least_squares.projection`; where a bound holds, it is that of
the columns that are left.

Polynomials of degree two that are positive on [-1, 1] are sums of squares (x - s)^2, |s| <= 1, and of 1 - x^2, with
coefficients that are not negative; here of those with s at five places, each a little above zero everywhere. Those of
degree four are sums of products of two of these. Where the solution without bounds is not possible, non-negative least
squares in these finds the nearest that is (Lawson and Hanson, Solving Least Squares Problems, 1974, ch. 23).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement

import numpy as np
from numpy.polynomial import legendre, polynomial

from ...kernel.arrays import FloatArray
from ..least_squares.projection import RHO_BOUNDS
from ..least_squares.stages import N_BOUNDS, SIGMA_BOUNDS, Hysteresis
from ..least_squares.trust_region import Reduced, minimise, triangle_of
from ..points.polynomials import Basis
from ..points.sample_points import SamplePoints
from ..rig.effect_columns import Rig

_INSIDE = 1e-6  # distance of omega_start from +-1, where it has no effect
_DEPENDENT = 1e-10  # singular value in the largest below which a combination of columns is none
_LEAST_FRICTION = 1e-6  # of a mechanism, share of the force (rms): a model file has some
_TOLERANCE, _EVALUATIONS = 1e-5, 40
_SHORTEST = 0.5  # of time constants, in sample intervals
_LONGEST = 3.0  # of them, in durations of the longest record
_PLACES = np.linspace(-1.0, 1.0, 5)
_ABOVE = 0.005  # least value of a square over its mean
_GRID = np.linspace(-1.0, 1.0, 129)
_MARGIN = 1.5e-3  # least value in the mean of a positive series
_ROUNDS = 60  # of exchanging columns
_TINY = 1e-12  # of a gradient, share of the longest target


@dataclass(frozen=True)
class Shape:
    """What is not linear in a spring of a wider class.

    Attributes
    ----------
    hysteresis : tuple of Hysteresis   Of each mechanism.
    times : tuple of float             Time constants of the branches [s].
    """

    hysteresis: tuple[Hysteresis, ...]
    times: tuple[float, ...] = ()

    @property
    def vector(self) -> FloatArray:
        """The logarithms, mechanism by mechanism, then of the times."""
        of_mechanisms = [(h.rho, h.sigma, h.n) for h in self.hysteresis]
        return np.log([*np.ravel(of_mechanisms), *self.times])


@dataclass(frozen=True, eq=False)
class ClassFit:
    """A fitted spring of a wider class.

    Attributes
    ----------
    basis : Basis                   Of FE.
    degrees : tuple of int          Of FA of each mechanism.
    shape : Shape
    omega_start : ndarray, shape (R,)
    elastic : ndarray               Coefficients of FE [N].
    amplified : tuple of ndarray    Coefficients of each G [N].
    stiffness : ndarray, shape (B,) Of the branches [N/m].
    squares : float                 Weighted sum of squared misfits.
    converged : bool
    """

    basis: Basis
    degrees: tuple[int, ...]
    shape: Shape
    omega_start: FloatArray
    elastic: FloatArray
    amplified: tuple[FloatArray, ...]
    stiffness: FloatArray
    squares: float
    converged: bool

    @property
    def parameters(self) -> int:
        """Number of fitted parameters, without omega_start."""
        linear = self.elastic.size + sum(series.size for series in self.amplified) + self.stiffness.size
        return linear + self.shape.vector.size


@dataclass(frozen=True, eq=False)
class Along:
    """A fit at the points of a problem.

    Attributes
    ----------
    force : ndarray, shape (P,)        Predicted [N].
    jacobian : ndarray, shape (P, p)   Derivatives of the force by the coefficients of FE, of each G, the stiffnesses,
                                       the logarithms of `Shape` and each omega_start [N].
    parts : tuple of ndarray           Force of each mechanism and each branch, shape (P,) [N].
    """

    force: FloatArray
    jacobian: FloatArray
    parts: tuple[FloatArray, ...]


class ClassProblem:
    """The projected least-squares problem of a class on some points.

    Parameters
    ----------
    rig : Rig
    loops : SamplePoints           Of its records.
    basis : Basis                  Of FE.
    degrees : tuple of int         Of FA of each mechanism, 0 to 2 or 4.
    branches : int
    weight : ndarray, shape (P,)   Of each squared misfit.
    """

    def __init__(
        self, rig: Rig, loops: SamplePoints, basis: Basis, degrees: Sequence[int], branches: int, weight: FloatArray
    ) -> None:
        self.loops, self.basis, self.degrees, self.branches = loops, basis, tuple(degrees), branches
        self.rig, self.records, self.weight = rig, loops.points.records, weight
        self.root = np.sqrt(weight)
        self.record = loops.record[loops.stroke]
        self.elastic = basis.columns(loops.displacement).elastic
        self.amplifiers = [self.amplifier_columns(degree) for degree in degrees]
        self._frame, self._triangle = np.linalg.qr(self.elastic * self.root[:, None])
        self.target = self.beside(loops.force * self.root)
        self.low, self.high = self._bounds()
        self.cone = _cone(self.degrees, branches)

    def _bounds(self) -> FloatArray:
        longest = float(self.loops.length.max())
        of_mechanism = [np.log(np.array(RHO_BOUNDS) / longest), np.log(SIGMA_BOUNDS), np.log(N_BOUNDS)]
        times = [np.log(time_bounds(self.rig))] * self.branches
        starts = [(_INSIDE - 1.0, 1.0 - _INSIDE)] * self.records
        return np.array([*of_mechanism * len(self.degrees), *times, *starts]).T

    def amplifier_columns(self, degree: int) -> FloatArray:
        """Basis functions of an FA of a degree, shape (P, degree + 1)."""
        basis = self.basis
        return Basis(basis.low, basis.high, 0, degree).columns(self.loops.displacement).amplifier

    def beside(self, columns: FloatArray) -> FloatArray:
        """What of weighted columns does not lie along those of FE."""
        return columns - self._frame @ (self._frame.T @ columns)

    def elastic_of(self, force: FloatArray) -> FloatArray:
        """Coefficients of FE that follow a force best."""
        return np.asarray(np.linalg.solve(self._triangle, self._frame.T @ (self.root * force)))

    def branch(self, log_time: float) -> FloatArray:
        """Deflection of a branch's spring at the points, and its derivative by ln(tau), shape (2, P) [m]."""
        return self.rig.branch(self.loops, float(np.exp(log_time)))

    def solve(
        self,
        shape: Shape,
        omega_start: FloatArray | None = None,
        tolerance: float = _TOLERANCE,
        evaluations: int = _EVALUATIONS,
    ) -> ClassFit:
        """Minimise the weighted squared misfit from a start."""
        starts = np.zeros(self.records) if omega_start is None else omega_start
        start = np.append(shape.vector, starts).clip(self.low, self.high)
        theta, trial, converged = minimise(
            lambda theta: _Trial(self, theta), start, self.low, self.high, tolerance, evaluations
        )
        return self._fit(theta, trial, converged)

    def linear(self, shape: Shape, omega_start: FloatArray) -> ClassFit:
        """The fit with this shape, the linear coefficients alone being fitted."""
        theta = np.append(shape.vector, omega_start).clip(self.low, self.high)
        return self._fit(theta, _Trial(self, theta), False)

    def _fit(self, theta: FloatArray, trial: _Trial, converged: bool) -> ClassFit:
        count = 3 * len(self.degrees)
        values = np.exp(theta[: count + self.branches])
        rows = values[:count].reshape(-1, 3)
        hysteresis = tuple(Hysteresis(rho, max(sigma, SIGMA_BOUNDS[0]), n) for rho, sigma, n in rows.tolist())
        elastic = self.elastic_of(self.loops.force - trial.moving @ trial.coefficients)
        amplified, stiffness = self.separated(trial.coefficients)
        least = _LEAST_FRICTION * self.loops.rms(self.loops.force)
        return ClassFit(
            self.basis,
            self.degrees,
            Shape(hysteresis, tuple(values[count:].tolist())),
            theta[count + self.branches :],
            elastic,
            tuple(series if series.any() else np.eye(1, series.size)[0] * least for series in amplified),
            stiffness,
            trial.squares,
            converged,
        )

    def separated(self, coefficients: FloatArray) -> tuple[tuple[FloatArray, ...], FloatArray]:
        """Linear coefficients but those of FE as those of each G and the stiffnesses."""
        ends = np.cumsum([degree + 1 for degree in self.degrees])
        return tuple(np.split(coefficients[: ends[-1]], ends[:-1])), coefficients[ends[-1] :]

    def at(self, fit: ClassFit) -> Along:
        """A fit of other points of the same records at these points."""
        theta = np.append(fit.shape.vector, fit.omega_start)
        trial = _Trial(self, theta, solve=False)
        trial.coefficients = np.concatenate([*fit.amplified, fit.stiffness])
        force = self.elastic @ fit.elastic + trial.moving @ trial.coefficients
        jacobian = np.hstack([self.elastic, trial.moving, trial.changes()])
        ends = np.cumsum([*(degree + 1 for degree in self.degrees), *[1] * self.branches])[:-1]
        pieces = zip(np.split(trial.moving, ends, axis=1), np.split(trial.coefficients, ends), strict=True)
        return Along(force, jacobian, tuple(columns @ values for columns, values in pieces))


class _Trial:
    """The linear problem at one theta."""

    def __init__(self, problem: ClassProblem, theta: FloatArray, solve: bool = True) -> None:
        self._problem, self._theta = problem, theta
        mechanisms, starts = len(problem.degrees), theta[3 * len(problem.degrees) + problem.branches :]
        self._along = []
        for rho, sigma, n in np.exp(theta[: 3 * mechanisms]).reshape(-1, 3).tolist():
            self._along.append(problem.loops.points.omega(rho, sigma, n, starts, coarse=True))
        times = theta[3 * mechanisms : 3 * mechanisms + problem.branches].tolist()
        self._branches = [problem.branch(log_time) for log_time in times]
        parts = [omega[:, None] * a for (omega, _), a in zip(self._along, problem.amplifiers, strict=True)]
        self.moving = np.hstack([*parts, *(deflection[:, None] for deflection, _ in self._branches)])
        if solve:
            self._solve()

    def _solve(self) -> None:
        problem = self._problem
        moving = self.moving * problem.root[:, None]
        self._scale = np.maximum(np.linalg.norm(moving, axis=0), 1e-300)
        self._columns = problem.beside(moving) / self._scale
        R = triangle_of(np.column_stack([self._columns, problem.target]))
        square, along = R[:-1, :-1], R[:-1, -1]
        self._directions = _directions(square)
        coefficients = self._directions @ (square @ self._directions).T @ along
        if not _is_possible(problem, coefficients / self._scale):
            # Combinations of the columns that are positive amplifiers and stiffnesses that are not negative.
            rays = self._scale[:, None] * problem.cone
            values = non_negative(square @ rays, along)
            coefficients = rays @ values
            used = rays[:, values > 0.0]
            self._directions = used @ _directions(square @ used) if used.size else np.zeros((used.shape[0], 0))
        self.coefficients = coefficients / self._scale
        left = square @ coefficients - along
        self.squares = float(R[-1, -1] ** 2 + left @ left)

    def changes(self) -> FloatArray:
        """Derivatives of the force by theta, shape (P, v) [N]."""
        problem = self._problem
        amplified, stiffness = problem.separated(self.coefficients)
        changes = np.zeros((problem.loops.force.size, self._theta.size))
        first_start = 3 * len(problem.degrees) + problem.branches
        for k, ((_, derivatives), terms, series) in enumerate(
            zip(self._along, problem.amplifiers, amplified, strict=True)
        ):
            by = (derivatives * (terms @ series)).T
            changes[:, 3 * k : 3 * k + 3] = by[:, :3]
            changes[np.arange(by.shape[0]), first_start + problem.record] += by[:, 3]
        for j, (_, by_time) in enumerate(self._branches):
            changes[:, 3 * len(problem.degrees) + j] = stiffness[j] * by_time
        return changes

    def reduced(self) -> Reduced:
        """The residuals and their derivatives by theta in Kaufman's form; all of theta counts as shared."""
        problem = self._problem
        free = self._columns @ self._directions
        change = problem.beside(self.changes() * -problem.root[:, None])
        R = triangle_of(np.column_stack([free, change, problem.target]))
        return Reduced.without_own(R[free.shape[1] :, free.shape[1] :])


def _directions(matrix: FloatArray) -> FloatArray:
    """Combinations of the columns that are orthonormal, shape (k, rank)."""
    _, singular, vt = np.linalg.svd(matrix, full_matrices=False)
    kept = singular > _DEPENDENT * singular[:1]
    return np.asarray(vt[kept].T / singular[kept])


def _cone(degrees: Sequence[int], branches: int) -> FloatArray:
    """Coefficients of positive amplifiers and stiffnesses, one to a column."""
    blocks = [positive_rays(degree) for degree in degrees] + [np.ones((1, 1))] * branches
    cone = np.zeros((sum(b.shape[0] for b in blocks), sum(b.shape[1] for b in blocks)))
    row = column = 0
    for block in blocks:
        cone[row : row + block.shape[0], column : column + block.shape[1]] = block
        row, column = row + block.shape[0], column + block.shape[1]
    return cone


def _is_possible(problem: ClassProblem, coefficients: FloatArray) -> bool:
    """Whether each G is positive over the range, and no stiffness negative."""
    amplified, stiffness = problem.separated(coefficients)
    return bool((stiffness >= 0.0).all()) and all(map(is_positive_series, amplified))


def time_bounds(rig: Rig) -> tuple[float, float]:
    """Time constants that the records can show: from that of a dashpot to that of a spring [s]."""
    duration = max(float(course.time[-1] - course.time[0]) for course in rig.courses)
    step = max(float(np.median(np.diff(course.time))) for course in rig.courses)
    return max(_SHORTEST * step, 1e-3 * rig.period), _LONGEST * duration


@lru_cache(maxsize=8)
def positive_rays(degree: int) -> FloatArray:
    """Legendre series whose sums with coefficients >= 0 are positive amplifiers, shape (degree + 1, rays)."""
    if degree == 0:
        return np.ones((1, 1))
    if degree == 1:
        return np.array([[1.0 + _ABOVE, 1.0 + _ABOVE], [1.0, -1.0]])
    rays = [*([s**2, -2.0 * s, 1.0] for s in _PLACES.tolist()), [1.0, 0.0, -1.0]]
    if degree > 2:
        rays += [polynomial.polymul(a, b).tolist() for a, b in combinations_with_replacement(rays, 2)]
    raised = np.zeros((degree + 1, len(rays)))
    for column, ray in zip(raised.T, rays, strict=True):
        column[: len(ray)] = legendre.poly2leg(ray)[: degree + 1]
    raised[0] += _ABOVE
    return raised[:, np.abs(raised).max(axis=0) > 0.0]


def is_positive_series(series: FloatArray) -> bool:
    """Whether a Legendre series is positive on [-1, 1], with a margin for rounding."""
    return bool(legendre.legval(_GRID, series).min() > _MARGIN * abs(float(series[0])))


def non_negative(matrix: FloatArray, target: FloatArray) -> FloatArray:
    """The x >= 0 with the least |matrix*x - target|, shape (k,).

    Parameters
    ----------
    matrix : ndarray, shape (m, k)
    target : ndarray, shape (m,)
    """
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    unit = matrix / scale
    x = np.zeros(unit.shape[1])
    free = np.zeros(x.size, dtype=bool)
    least = _TINY * max(float(np.linalg.norm(target)), 1e-300)
    for _ in range(_ROUNDS):
        gradient = unit.T @ (target - unit @ x)
        gradient[free] = -np.inf
        if gradient.max() <= least:
            break
        free[np.argmax(gradient)] = True
        while True:
            step = np.zeros(x.size)
            step[free] = np.linalg.lstsq(unit[:, free], target, rcond=1e-12)[0]
            if (step[free] > 0.0).all():
                break
            falling = np.flatnonzero(free & (step <= 0.0))
            shares = x[falling] / np.maximum(x[falling] - step[falling], 1e-300)
            x = x + shares.min() * (step - x)
            free &= x > 1e-15 * x.max(initial=0.0)
            free[falling[shares.argmin()]] = False  # whatever its rounding: so the loop ends
            x[~free] = 0.0
            if not free.any():
                break
        x = step if free.any() else x
    return np.asarray(x / scale)
