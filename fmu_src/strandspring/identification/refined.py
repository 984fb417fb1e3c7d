"""Least-squares refinement of a start to the statistical limit, by variable projection.

FE and FA enter linearly: for given rho, sigma, n (and omega_start of each record) their coefficients follow from one
linear least-squares problem, so only those few parameters are iterated on. With the weighted basis A = QR, residual
rho = (1 - QQ^T) r, and its Jacobian in Kaufman's form is -(1 - QQ^T) (d omega/d theta)*G, with the exact derivatives
of `kernel.points`.

Weights come from the record: its noise (additive and relative parts) and, where the model itself is further from the
force than the noise explains, that distance as a constant.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..core.parameters import SpringParameters
from ..kernel.arrays import FloatArray
from ..kernel.points import omega_with_derivatives
from .loops import POINTS_PER_STROKE, Loops, join
from .noise import ForceNoise, force_noise
from .outcomes import IdentificationError, Outcome
from .polynomials import Basis
from .scan import ScanOptions, scan
from .spring_of_fit import Solution, cautions_of, is_positive, spring_of
from .stages import N_BOUNDS, SIGMA_BOUNDS, Backbone, Hysteresis
from .steady_part import SteadyRecord
from .two_stage import TwoStageOptions, two_stage

# rho times the longest stroke: from a loop that hardly saturates (below, FA and rho cannot be told apart) to one
# that saturates within a millionth of the stroke.
_RHO_BOUNDS = (2.0, 1e6)
# rho may move by this factor from its start. Records outside the model would else drive it to where FE imitates the
# loop of the one amplitude measured.
_TRUST = 10.0
# A fit whose strokes do not saturate must be better by this than one whose strokes do.
_PREFERENCE = 0.9
# Relative change of the squared misfit at which the iteration ends. With K samples one standard error of a parameter
# changes it by 1/K; without noise it falls by decades per step until rounding ends it.
_TOLERANCE = 1e-5
_FIRST_TOLERANCE = 1e-3  # before the weights are known, which need no more than a fair fit
_FIRST_EVALUATIONS = 4
_EVALUATIONS = 100
# Misfit in standard deviations of the noise up to which the model explains the records.
_EXPLAINED = 1.5
# All samples are used up to this many in a stroke and about this many in all; more are averaged over so fine cells
# that what is lost is far below the noise.
_POINTS_PER_STROKE = 2000
_POINTS = 40_000
# Share of the rms force within which no polynomial follows a real spring; it keeps relative noise, which vanishes
# where the force crosses zero, from giving all the weight to those few samples.
_FINEST = 0.005
_MEDIAN = 0.455  # of a squared standard normal
_ROBUST_ROUNDS = 5  # of reweighting for Huber's loss
_HUBER = 1.345  # standard deviations beyond which the robust loss grows linearly: 95 % efficient for normal noise


@dataclass(frozen=True)
class RefinedOptions:
    """Options of the refined method.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; chosen by the two-stage start if None.
    robust : bool                  Huber's loss instead of squares, for records with outliers.
    bootstrap : int                Repetitions of a stroke-wise bootstrap for the standard errors; 0 for none.
    seed : int                     Of the bootstrap.
    """

    degrees: tuple[int, int] | None = None
    robust: bool = False
    bootstrap: int = 0
    seed: int = 0

    def __post_init__(self) -> None:
        TwoStageOptions(self.degrees)
        if not 0 <= self.bootstrap <= 10_000:
            raise ValueError(f"`bootstrap` must be within [0, 10000] repetitions, got {self.bootstrap}.")
        if self.seed < 0:
            raise ValueError(f"`seed` must be >= 0, got {self.seed}.")


class Convergence(Enum):
    """How the refinement ended, in words."""

    CONVERGED = "The refinement converged."
    STOPPED = "The refinement stopped at its limit of evaluations; the result is the best point reached."


@dataclass(frozen=True, eq=False)
class Refinement:
    """A refined fit.

    Attributes
    ----------
    hysteresis : Hysteresis
    omega_start : ndarray, shape (R,)      omega at the first sample of each record.
    backbone : Backbone
    omega : ndarray, shape (P,)
    derivatives : ndarray, shape (3 + R, P)   d omega by ln(rho), ln(sigma), ln(n) and each omega_start.
    weight : ndarray, shape (P,)           Weight of each squared misfit [1/N^2], counts included.
    full_weight : ndarray, shape (P,)      The same before Huber's loss lowered the weight of outliers.
    convergence : Convergence
    evaluations : int
    """

    hysteresis: Hysteresis
    omega_start: FloatArray
    backbone: Backbone
    omega: FloatArray
    derivatives: FloatArray
    weight: FloatArray
    full_weight: FloatArray
    convergence: Convergence
    evaluations: int


@dataclass(frozen=True, eq=False)
class RefinedFit:
    """A physically possible refined fit and the points it was made on."""

    loops: Loops
    basis: Basis
    refinement: Refinement
    start: Solution


def refined(
    parts: list[SteadyRecord], options: RefinedOptions, where: str
) -> tuple[SpringParameters, RefinedFit, list[Outcome]]:
    """Identify by the better of two-stage and scan, and refine the result on all samples.

    The scan is asked only where the refinement of the two-stage result leaves more than noise.

    Raises
    ------
    IdentificationError   If no physically possible model is found.
    """
    coarse = join([part.loops for part in parts])
    strokes = sum(part.strokes.count for part in parts)
    points = max(POINTS_PER_STROKE, min(_POINTS_PER_STROKE, _POINTS // strokes))
    loops = join([part.loops_with(points) for part in parts])
    noise = [force_noise(part.record.force) for part in parts]
    fits: list[RefinedFit] = []
    start = two_stage(coarse, TwoStageOptions(options.degrees))
    if start is not None:
        fits.append(_possible(loops, start, noise, options.robust, where))
    if start is None or _excess(loops, fits[0].refinement, noise) > _EXPLAINED:
        degrees = options.degrees if start is None else (start.basis.elastic, start.basis.amplifier)
        other = scan(coarse, ScanOptions(degrees))
        if other is not None:
            fits.append(_possible(loops, other, noise, options.robust, where))
    if not fits:
        raise IdentificationError(Outcome.NO_STEADY_SECTION, where)
    fit = min(fits, key=lambda one: _rms(loops, one.refinement) * (_PREFERENCE if _is_steady(loops, one) else 1.0))
    found = fit.refinement
    cautions = [Outcome.AMPLIFIER_REDUCED] if fit.basis != fit.start.basis else []
    if found.hysteresis.rho * loops.length.max() < 1.01 * _RHO_BOUNDS[0]:
        cautions.append(Outcome.NO_STEADY_SECTION)
    if found.convergence is Convergence.STOPPED:
        cautions.append(Outcome.NOT_CONVERGED)
    cautions += cautions_of(loops, found.hysteresis, found.omega)
    return spring_of(fit.basis, found.backbone, found.hysteresis), fit, cautions


def linearised(loops: Loops, solution: Solution) -> Refinement:
    """The solution of another method as a refinement that has not begun, with the derivatives there."""
    problem = _Problem(loops, solution.basis, solution.hysteresis)
    theta = problem.parameters(solution.hysteresis)
    omega, derivatives = problem.omega(theta)
    return Refinement(
        solution.hysteresis,
        theta[3:],
        solution.backbone,
        omega,
        derivatives,
        loops.weight,
        loops.weight,
        Convergence.STOPPED,
        0,
    )


def bootstrap(fit: RefinedFit, repetitions: int, seed: int, where: str) -> dict[str, float]:
    """Standard errors of kappa_omega, rho, sigma and n from refits to strokes drawn with replacement.

    Whole strokes are drawn, because what a model leaves over is alike along a stroke. The weights stay those of the
    fit.

    Raises
    ------
    IdentificationError   If there are not two strokes in each direction to draw from; `where` names the records.
    """
    loops, found = fit.loops, fit.refinement
    generator = np.random.default_rng(seed)
    strokes = np.unique(loops.stroke)
    # Loading and unloading are drawn apart: without one of them FE and FA cannot be told apart.
    kinds = [strokes[loops.direction[strokes] == side] for side in (1, -1)]
    fewest = min(kind.size for kind in kinds)
    if fewest < 2:
        raise IdentificationError(Outcome.TOO_FEW_TO_DRAW, where)
    problem = _Problem(loops, fit.basis, fit.start.hysteresis)
    rows = []
    for _ in range(repetitions):
        count = np.zeros(int(strokes.max()) + 1)
        for kind in kinds:
            count[kind] = generator.multinomial(kind.size, np.full(kind.size, 1.0 / kind.size))
        again = problem.solve(problem.vector(found), found.weight * count[loops.stroke], _FIRST_TOLERANCE)
        powers = fit.basis.powers(again.backbone.amplified)
        rows.append((powers[0], again.hysteresis.rho, again.hysteresis.sigma, again.hysteresis.n))
    # Draws from m strokes vary by m - 1 parts in m of what m strokes do.
    errors = np.std(np.array(rows), axis=0, ddof=1) * np.sqrt(fewest / (fewest - 1.0))
    return dict(zip(("kappa_omega", "rho", "sigma", "n"), errors.tolist(), strict=True))


def _possible(loops: Loops, start: Solution, noise: list[ForceNoise], robust: bool, where: str) -> RefinedFit:
    """The refinement of a start, with the degree of FA lowered until it is positive."""
    basis = start.basis
    found = refine(loops, basis, start.hysteresis, noise, robust)
    while not is_positive(basis, found.backbone):
        if basis.amplifier == 0:
            raise IdentificationError(Outcome.BRANCHES_CROSS, where)
        basis = replace(basis, amplifier=basis.amplifier - 1)
        found = refine(loops, basis, start.hysteresis, noise, robust)
    return RefinedFit(loops, basis, found, start)


def _is_steady(loops: Loops, fit: RefinedFit) -> bool:
    return Outcome.NO_STEADY_SECTION not in cautions_of(loops, fit.refinement.hysteresis, fit.refinement.omega)


def _misfit(loops: Loops, found: Refinement) -> FloatArray:
    return found.backbone.misfit(loops.force, found.omega)


def _rms(loops: Loops, found: Refinement) -> float:
    return loops.rms(_misfit(loops, found))


def _excess(loops: Loops, found: Refinement, noise: list[ForceNoise]) -> float:
    """Typical misfit in standard deviations of the noise; 1 if the model explains the records.

    By the median, since relative noise vanishes where the force crosses zero.
    """
    # Without noise rounding takes its place.
    variance = _noise_variance(loops, loops.force, noise) + (1e-9 * np.abs(loops.force).max()) ** 2
    return float(np.sqrt(np.median(loops.weight * _misfit(loops, found) ** 2 / variance) / _MEDIAN))


def _noise_variance(loops: Loops, force: FloatArray, noise: list[ForceNoise]) -> FloatArray:
    """Variance of a single sample of this force at every point [N^2]."""
    record = loops.record[loops.stroke]
    variance = np.empty(force.size)
    for k, one in enumerate(noise):
        variance[record == k] = one.variance(force[record == k])
    return variance


def refine(loops: Loops, basis: Basis, start: Hysteresis, noise: list[ForceNoise], robust: bool = False) -> Refinement:
    """Refine rho, sigma, n, omega_start, FE and FA.

    Parameters
    ----------
    loops : Loops
    basis : Basis            Degrees of FE and FA.
    start : Hysteresis       From `two_stage` or `scan`.
    noise : list of ForceNoise, one for each record
    robust : bool            Huber's loss, by reweighting.
    """
    problem = _Problem(loops, basis, start)
    found = problem.solve(problem.parameters(start), loops.weight, _FIRST_TOLERANCE, _FIRST_EVALUATIONS)
    for _ in range(_ROBUST_ROUNDS if robust else 1):
        full_weight = _weights(loops, found, noise, robust)
        pull = np.sqrt(full_weight) * np.abs(_misfit(loops, found))
        bend = np.minimum(1.0, _HUBER / np.maximum(pull, 1e-300)) if robust else 1.0
        found = replace(problem.solve(problem.vector(found), full_weight * bend, _TOLERANCE), full_weight=full_weight)
    return found


def _weights(loops: Loops, found: Refinement, noise: list[ForceNoise], robust: bool) -> FloatArray:
    """Inverse variance of each point from the noise and from what the model leaves over beyond it.

    With outliers about, the typical misfit decides.
    """
    predicted = found.backbone.force(found.omega)
    squared = (loops.force - predicted) ** 2
    record = loops.record[loops.stroke]
    variance = _noise_variance(loops, predicted, noise) / loops.weight
    weight = np.empty(loops.force.size)
    level = loops.rms(loops.force)
    for k in range(len(noise)):
        of = record == k
        beyond = max(_misfit_variance(squared[of], variance[of], robust), (_FINEST * level) ** 2)
        weight[of] = 1.0 / (variance[of] + beyond)
    return weight


def _misfit_variance(squared: FloatArray, variance: FloatArray, robust: bool) -> float:
    """The constant that, added to the noise's variance, makes the mean squared misfit what it should be.

    With outliers about, the median takes the place of the mean.
    """

    def excess(constant: float) -> float:
        ratios = squared / (variance + constant)
        return float(np.median(ratios)) / _MEDIAN - 1.0 if robust else float(np.mean(ratios)) - 1.0

    least = max(1e-12 * float(np.mean(squared)), 1e-300)
    if excess(least) <= 0.0:
        return least
    # SciPy's optimizer takes a quarter of a second to import; commands that do not identify go without.
    from scipy.optimize import brentq

    return float(brentq(excess, least, float(np.max(squared)) + least, rtol=1e-3))


def _orthogonal(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Q and R of a tall matrix by two rounds of Cholesky, which for few columns is much faster than Householder.

    The Legendre basis keeps the condition number far below the 1e7 up to which two rounds are as good.
    """
    r = np.eye(matrix.shape[1])
    q = matrix
    for _ in range(2):
        try:
            upper = np.linalg.cholesky(q.T @ q).T
        except np.linalg.LinAlgError:
            q, r = np.linalg.qr(matrix)
            return np.asarray(q), np.asarray(r)
        q, r = np.linalg.solve(upper.T, q.T).T, upper @ r
    return np.asarray(q), np.asarray(r)


class _Point(NamedTuple):
    """What one evaluation of the projected problem gives; q spans the weighted linear part."""

    omega: FloatArray
    derivatives: FloatArray
    q: FloatArray
    backbone: Backbone


class _Problem:
    """The projected least-squares problem of a set of loops in theta = ln(rho), ln(sigma), ln(n), omega_start..."""

    def __init__(self, loops: Loops, basis: Basis, start: Hysteresis) -> None:
        self.loops = loops
        self.columns_E, self.columns_A = basis.columns(loops.displacement)
        self.records = int(loops.record.max()) + 1
        longest = float(loops.length.max())
        least, most = (b / longest for b in _RHO_BOUNDS)
        around = (max(least, start.rho / _TRUST), min(most, start.rho * _TRUST))
        bounds = [around, SIGMA_BOUNDS, N_BOUNDS]
        self.low = np.append([np.log(low) for low, _ in bounds], -np.ones(self.records))
        self.high = np.append([np.log(high) for _, high in bounds], np.ones(self.records))

    def parameters(self, start: Hysteresis) -> FloatArray:
        """theta of a start, omega_start being 0."""
        logs = np.log([start.rho, start.sigma, start.n])
        return np.append(logs, np.zeros(self.records))

    def vector(self, found: Refinement) -> FloatArray:
        """theta of a refinement."""
        h = found.hysteresis
        return np.append(np.log([h.rho, h.sigma, h.n]), found.omega_start)

    def omega(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """omega at every point and its derivatives with respect to theta."""
        loops = self.loops
        rho, sigma, n = np.exp(theta[:3])
        omega = np.empty(loops.force.size)
        derivatives = np.zeros((theta.size, loops.force.size))
        for k, (strokes, points) in enumerate(loops.of_records()):
            omega[points], of = omega_with_derivatives(
                float(rho), float(sigma), float(n), float(theta[3 + k]),
                loops.direction[strokes], loops.length[strokes],
                loops.stroke[points] - strokes.start, loops.travel[points],
            )  # fmt: skip
            derivatives[:3, points] = of[:3] * np.array([rho, sigma, n])[:, None]
            derivatives[3 + k, points] = of[3]
        return omega, derivatives

    def solve(
        self, start: FloatArray, weight: FloatArray, tolerance: float, evaluations: int = _EVALUATIONS
    ) -> Refinement:
        """Minimise the weighted squared misfit from a start."""
        from scipy.optimize import least_squares  # see `_misfit_variance`

        root = np.sqrt(weight)
        target = self.loops.force * root

        # least_squares asks for residual and Jacobian of a point one after the other, and its last point is wanted too.
        @lru_cache(maxsize=2)
        def at(key: bytes) -> _Point:
            omega, derivatives = self.omega(np.frombuffer(key))
            return _Point(omega, derivatives, *self._project(omega, root, target))

        def residual(theta: FloatArray) -> FloatArray:
            q = at(theta.tobytes()).q
            return np.asarray(target - q @ (q.T @ target))

        def jacobian(theta: FloatArray) -> FloatArray:
            point = at(theta.tobytes())
            steepest = (point.derivatives * (point.backbone.G * root)).T
            return np.asarray(point.q @ (point.q.T @ steepest) - steepest)

        found = least_squares(
            residual,
            np.clip(start, self.low + 1e-6, self.high - 1e-6),
            jacobian,
            bounds=(self.low, self.high),
            x_scale="jac",
            ftol=tolerance,
            xtol=1e-12,
            gtol=1e-14,
            max_nfev=evaluations,
        )
        best = at(found.x.tobytes())
        rho, sigma, n = (float(v) for v in np.exp(found.x[:3]))
        return Refinement(
            Hysteresis(rho, max(sigma, SIGMA_BOUNDS[0]), n),
            found.x[3:],
            best.backbone,
            best.omega,
            best.derivatives,
            weight,
            weight,
            Convergence.CONVERGED if found.success else Convergence.STOPPED,
            int(found.nfev),
        )

    def _project(self, omega: FloatArray, root: FloatArray, target: FloatArray) -> tuple[FloatArray, Backbone]:
        """Orthonormal basis of the linear part, and FE and G fitted with this omega."""
        matrix = np.hstack([self.columns_E, omega[:, None] * self.columns_A]) * root[:, None]
        q, r = _orthogonal(matrix)
        coefficients = np.linalg.solve(r, q.T @ target)
        elastic, amplified = np.split(coefficients, [self.columns_E.shape[1]])
        return q, Backbone(elastic, amplified, self.columns_E @ elastic, self.columns_A @ amplified)
