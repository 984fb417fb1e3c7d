"""The paper's own formulas: mean branches in the steady section, and three points for rho, n and sigma.

Kept beside the whole-branch least squares for comparison with the paper; fragile under noise, most of all for
n well below 1, where the slope of omega has a cusp just where eq. (23) reads it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..identification.least_squares.stages import N_BOUNDS, SIGMA_BOUNDS, Backbone, Hysteresis
from ..identification.points.polynomials import Basis, Columns
from ..identification.points.sample_points import SamplePoints, single_branch
from ..identification.points.smoothing import automatic_half_width, moving_average
from ..identification.points.steady_part import mean_loop
from ..kernel.arrays import FloatArray

# omega at the points H1 (recovering), H2 and H3 (approaching saturation). H1 moves towards zero if the branch is
# sampled from later on only.
_H1, _H2, _H3 = -0.5, 0.35, 0.7
# Where the loading branch is looked at: densely after the reversal.
_BRANCH_SHARES = ((np.arange(200) + 0.5) / 200) ** 2


def three_point_stages(
    loops: SamplePoints, basis: Basis, columns: Columns, steady_travels: Sequence[float], smoothing: int | None
) -> list[tuple[Hysteresis, float] | None]:
    """Both stages by the paper's formulas; arguments and result as `identification.two_stage.Stages` says."""
    return [_both_stages(loops, basis, columns, travel, smoothing) for travel in steady_travels]


def _both_stages(
    loops: SamplePoints, basis: Basis, columns: Columns, steady_travel: float, smoothing: int | None
) -> tuple[Hysteresis, float] | None:
    backbone = fit_backbone_paper(loops, basis, columns, steady_travel)
    if backbone is None:
        return None
    mean = mean_loop(loops, _BRANCH_SHARES)
    at_E, at_A = basis.columns(mean.displacement)
    G = at_A @ backbone.amplified
    if not (G > 0.0).all():
        return None
    u = (mean.loading - at_E @ backbone.elastic) / G
    branch = single_branch(mean.displacement, u)
    half_width = automatic_half_width(branch, u) if smoothing is None else smoothing
    hysteresis = three_points(mean.displacement - basis.low, moving_average(branch, u, half_width))
    if hysteresis is None:
        return None
    omega = loops.omega(hysteresis.rho, hysteresis.sigma, hysteresis.n)
    return hysteresis, loops.rms(backbone.misfit(loops.force, omega))


def fit_backbone_paper(loops: SamplePoints, basis: Basis, columns: Columns, steady_travel: float) -> Backbone | None:
    """Stage 1 by paper eqs. (14)-(20): both branches at the same x, where both have travelled far enough.

    Parameters
    ----------
    loops : SamplePoints
    basis : Basis
    columns : Columns       Basis functions at the points of the loops.
    steady_travel : float   Distance from a reversal beyond which a branch counts as saturated [m].

    Returns
    -------
    Backbone or None        None if the steady section is too short for the degrees or the branches touch at x0.
    """
    mean = mean_loop(loops)
    x = mean.displacement
    steady = (x >= basis.low + steady_travel) & (x <= basis.high - steady_travel)
    columns_E, columns_A = basis.columns(x[steady])
    if steady.sum() < 2 * max(columns_E.shape[1], columns_A.shape[1]):
        return None
    upper, lower = mean.loading[steady], mean.unloading[steady]
    kappa = float(np.interp(basis.offset, x[steady], 0.5 * (upper - lower)))
    if kappa <= 0.0:
        return None
    elastic = np.asarray(np.linalg.lstsq(columns_E, 0.5 * (upper + lower), rcond=None)[0], np.float64)
    amplifier = np.asarray(np.linalg.lstsq(columns_A, 0.5 * (upper - lower) / kappa, rcond=None)[0], np.float64)
    return Backbone(elastic, kappa * amplifier, columns.elastic @ elastic, kappa * (columns.amplifier @ amplifier))


def three_points(travel: FloatArray, u: FloatArray) -> Hysteresis | None:
    """Stage 2 by paper eqs. (23)-(25) on one branch of the extracted, smoothed loop.

    Parameters
    ----------
    travel : ndarray, shape (P,)   Distance from the reversal [m], rising.
    u : ndarray, shape (P,)        omega of the branch, times -1 on an unloading one.

    Returns
    -------
    Hysteresis or None             None if the branch does not pass the points in order.
    """
    slope = np.gradient(u, travel)
    rising = np.maximum.accumulate(u)

    def at(level: float) -> tuple[float, float]:
        k = int(np.searchsorted(rising, level))
        if not 0 < k < u.size:
            return np.nan, np.nan
        share = (level - rising[k - 1]) / max(rising[k] - rising[k - 1], 1e-300)
        return level, float(slope[k - 1] + share * (slope[k] - slope[k - 1]))

    _, rho = at(0.0)  # eq. (23)
    u1, slope1 = at(max(_H1, 0.5 * float(u[0])))
    u2, slope2 = at(_H2)
    u3, slope3 = at(_H3)
    with np.errstate(invalid="ignore", divide="ignore"):
        n = np.log((slope2 - rho) / (slope3 - rho)) / np.log(u2 / u3)  # eq. (24)
        sigma = 0.5 * ((slope1 / rho - 1.0) / np.abs(u1) ** n + 1.0)  # eq. (25)
    if not (rho > 0.0 and np.isfinite(n) and n > 0.0 and np.isfinite(sigma)):
        return None
    return Hysteresis(rho, float(np.clip(sigma, *SIGMA_BOUNDS)), float(np.clip(n, *N_BOUNDS)))
