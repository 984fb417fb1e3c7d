"""Limit-cycle identification of the plain normalized Bouc-Wen model (Ikhouane and Gomis-Bellmunt 2008).

On the loading branch F(x) of a steady symmetric cycle, the pure hysteretic part

    theta(x) = F(x) - kappa_x*x = kappa_omega*omega

obeys paper eq. (22), which with a = rho*kappa_omega, b = a/kappa_omega^n and c = (2*sigma - 1)*b reads

    d(theta)/dx = a - b*theta^n          theta >= 0,
    d(theta)/dx = a + c*(-theta)^n       theta <  0.

The published method takes kappa_x first (from a second cycle about another mean displacement) and then reads a, n, b
and c from single points of theta and of its derivative; the paper's three-point formulas (23)-(25) are its
generalisation. The published formula for kappa_x from one cycle could not be consulted, and this file derives its own:
integrated along the branch from a point 0,

    F(x) - F(x_0) = (kappa_x + a)*(x - x_0) - b*integral of theta^n dx [theta > 0]
                                            + c*integral of (-theta)^n dx [theta < 0],

is linear in kappa_x + a, b and c for given kappa_x and n (inside theta). Both are scanned within bounds, kappa_x from
the slope at the end of the branch downwards (it can not be larger, and is that slope where the branch is saturated),
n over its whole range; the other coefficients follow by linear least squares. There are no start values and no
differences of neighbouring samples. kappa_omega = (a/b)^(1/n), rho = a/kappa_omega and sigma = (c/b + 1)/2 follow.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import RecordError
from ..identification.least_squares.stages import N_BOUNDS, SIGMA_BOUNDS
from ..kernel.arrays import FloatArray
from ..loops.noise_levels import noise_level
from ..loops.turning import turning_points
from ..model.conversions import NormalizedBoucWen
from ..model.outcomes import IdentificationError, Outcome
from .periods import Periods, whole_periods

_SCAN_N, _SCAN_STIFFNESS = 12, 24  # values tried before the minimum is bracketed
_LOG_N = (math.log(N_BOUNDS[0]), math.log(N_BOUNDS[1]))
_TOLERANCE = 1e-7  # of the logarithms scanned
_END = 0.8  # the end of a branch begins at this share of the reach
_LEAST_GAP = 2e-3  # least distance of kappa_x from its bound, in secant stiffnesses
_ASYMMETRY = 0.03  # rms difference between loading and mirrored unloading branch, share of the force range
_FLAT = 1e-7  # steps of theta below this share of its range are integrated by the trapezoidal rule


def limit_cycle(displacement: ArrayLike, force: ArrayLike, where: str = "<arrays>") -> NormalizedBoucWen:
    """Identify the plain normalized Bouc-Wen model from a steady symmetric cycle, or several.

    The centre of the cycle is taken as the zero of both columns, so that a preload does not matter.

    Parameters
    ----------
    displacement, force : array_like, shape (K,)   Whole periods with one rise and one fall each [m], [N].
    where : str                                    Name of the record for messages.

    Returns
    -------
    NormalizedBoucWen

    Raises
    ------
    RecordError            If the record holds no whole periods, or more than one rise and fall in each.
    IdentificationError    If the cycle is not that of such a model, with the outcome that says why.
    """
    cycle = _cycle(whole_periods(displacement, force), where)

    largest = cycle.end_slope()
    if largest <= _LEAST_GAP:
        raise IdentificationError(Outcome.FORCE_REVERSED, where)

    def best_n(share: float) -> _Fit:
        log_n = _least(lambda p: cycle.fit(share, math.exp(p)).misfit, *_LOG_N, _SCAN_N)
        return cycle.fit(share, math.exp(log_n))

    def below_largest(log_gap: float) -> float:
        return largest - math.exp(log_gap)

    log_gap = _least(
        lambda p: best_n(below_largest(p)).misfit, math.log(_LEAST_GAP), math.log(largest), _SCAN_STIFFNESS
    )
    best = best_n(below_largest(log_gap))
    if not np.isfinite(best.misfit):
        raise IdentificationError(Outcome.NO_STEADY_SECTION, where)
    return best.model()


@dataclass(frozen=True)
class _Fit:
    """Coefficients of the integrated equation for one kappa_x and n, in the cycle's units; and the rms misfit."""

    kappa_x: float
    n: float
    a: float
    b: float
    c: float
    misfit: float

    def model(self) -> NormalizedBoucWen:
        kappa_omega = (self.a / self.b) ** (1.0 / self.n)
        sigma = float(np.clip(0.5 * (self.c / self.b + 1.0), *SIGMA_BOUNDS))
        return NormalizedBoucWen(self.kappa_x, kappa_omega, self.a / kappa_omega, sigma, self.n)


@dataclass(frozen=True, eq=False)
class _Cycle:
    """Loading branch and mirrored unloading branch about the centre, both rising, and the reach and force there."""

    branches: tuple[tuple[FloatArray, FloatArray], ...]
    reach: float
    peak: float

    def end_slope(self) -> float:
        """Upper bound of kappa_x: the slope at the end of the branches with a margin, in secant stiffnesses."""
        pieces = [(x / self.reach, r / self.peak) for x, r in self.branches]
        slopes, errors = [], []
        for s, r in pieces:
            end = s >= _END
            (slope, _), covariance = np.polyfit(s[end], r[end], 1, cov=True)
            slopes.append(float(slope))
            errors.append(float(np.sqrt(covariance[0, 0])))
        return max(slopes) + 3.0 * max(errors) + 5.0 * _LEAST_GAP

    def fit(self, share: float, n: float) -> _Fit:
        """Least squares of the integrated equation with kappa_x = `share` of the secant stiffness."""
        rows, values = [], []
        for x, force in self.branches:
            s, r = x / self.reach, force / self.peak
            theta = r - share * s
            forth = _integral(np.maximum(theta, 0.0), s, n)
            back = _integral(np.maximum(-theta, 0.0), s, n)
            columns = np.stack([s, -forth, back], axis=1)
            # The branch's own constant drops out with the means.
            rows.append(columns - columns.mean(axis=0))
            values.append(r - r.mean())
        matrix, target = np.concatenate(rows), np.concatenate(values)
        solution = np.linalg.lstsq(matrix, target, rcond=None)[0]
        slope, b, c = solution.tolist()
        a = slope - share
        misfit = float(np.sqrt(np.mean((matrix @ solution - target) ** 2))) if min(a, b) > 0.0 else np.inf
        # From shares of reach and peak to m and N.
        stiffness, power = self.peak / self.reach, self.peak**n
        return _Fit(share * stiffness, n, a * stiffness, b * stiffness / power, c * stiffness / power, misfit)


def _cycle(periods: Periods, where: str) -> _Cycle:
    top = int(np.argmax(periods.displacement))
    x, r = (np.append(np.roll(v, -top), v[top]) for v in (periods.displacement, periods.mean_force))
    ends = turning_points(x, 0.0)
    if ends.size != 3:
        raise RecordError(f"{where}: the displacement must rise and fall once per period, got {ends.size - 1} strokes.")
    turn = int(ends[1])
    x = x - 0.5 * (x[0] + x[turn])
    branches = ((x[turn:], r[turn:]), (-x[: turn + 1], -r[: turn + 1]))
    reach = float(x[0])
    # Symmetry: the mirrored unloading branch differs from the loading branch by twice the force at the centre.
    grid = np.linspace(-reach, reach, 200)
    loading, mirrored = (np.interp(grid, *branch) for branch in branches)
    centre = 0.5 * float(np.mean(loading - mirrored))
    asymmetry = float(np.std(loading - mirrored))
    noise = noise_level(periods.mean_force)
    if asymmetry > _ASYMMETRY * float(np.ptp(r)) + 4.0 * noise:
        raise RecordError(
            f"{where}: the loop of a plain Bouc-Wen model is symmetric about its centre, but the branches differ by "
            f"{asymmetry:.4g} N rms; use the two-stage method."
        )
    half_height = float(np.mean(np.interp(grid, *branches[0]) - np.interp(grid, x[turn::-1], r[turn::-1]))) / 2.0
    if half_height <= 4.0 * noise / np.sqrt(r.size):
        raise IdentificationError(Outcome.NO_LOOP if half_height >= 0.0 else Outcome.COLUMNS_SWAPPED, where)
    upper, lower = (branches[0][0], branches[0][1] - centre), (branches[1][0], branches[1][1] + centre)
    peak = 0.5 * float(upper[1][-1] + lower[1][-1])
    if peak <= 0.0:
        raise IdentificationError(Outcome.FORCE_REVERSED, where)
    return _Cycle((upper, lower), reach, peak)


def _integral(values: FloatArray, s: FloatArray, n: float) -> FloatArray:
    """Integral of values^n from the first s to each, exact where the values are straight lines between samples."""
    rise = np.diff(values)
    flat = np.abs(rise) <= _FLAT
    powers = values**n
    mean = 0.5 * (powers[:-1] + powers[1:])
    mean[~flat] = np.diff(values * powers)[~flat] / ((n + 1.0) * rise[~flat])
    return np.concatenate([[0.0], np.cumsum(mean * np.diff(s))])


def _least(function: Callable[[float], float], low: float, high: float, count: int) -> float:
    """Where a function is least within (low, high): a scan, then a bracketed search between the neighbours."""
    grid = np.linspace(low, high, count + 2)[1:-1]
    values = [function(float(p)) for p in grid]
    k = int(np.argmin(values))
    if not np.isfinite(values[k]):
        return float(grid[k])
    from scipy.optimize import minimize_scalar  # slow to import, and only this needs it

    # An impossible fit must not enter the parabolas of the search as infinity.
    worst = 10.0 * max(v for v in values if np.isfinite(v))
    step = float(grid[1] - grid[0])
    found = minimize_scalar(
        lambda p: min(function(float(p)), worst),
        bounds=(grid[k] - step, grid[k] + step),
        method="bounded",
        options={"xatol": _TOLERANCE},
    )
    return float(found.x if found.fun < values[k] else grid[k])
