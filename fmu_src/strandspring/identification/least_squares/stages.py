"""The two stages of the paper, each one linear least-squares problem.

Stage 1 (paper eqs. 12-20) reads FE and kappa_omega*FA from the points at which omega is known. In the paper that is
the steady section, omega = +1 on loading and -1 on unloading points; here each branch is used wherever it alone is
saturated, so that the whole range is covered and nothing is extrapolated:

    r = FE(x) + omega*G(x),     G = kappa_omega*FA.

Stage 2 (eqs. 21-25) extracts omega = (r - FE)/G and reads rho, sigma, n from it. Instead of differentiating noisy
data at three points it integrates eq. (22) along each stroke; with u = side*omega and the travel s,

    u(s) = u(0) + a*[s - integral over u > 0 of u^n ds] + b*integral over u < 0 of (-u)^n ds,
    a = rho,   b = rho*(2*sigma - 1),

which is linear in a, b and u(0) for a given n; n comes from a bounded scan of its whole range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import SIGMA_RANGE
from ...kernel.arrays import FloatArray
from ...loops.noise_levels import noise_level
from ..points.polynomials import Columns
from ..points.sample_points import SamplePoints

SIGMA_BOUNDS = SIGMA_RANGE
N_BOUNDS = (0.05, 20.0)
_N_SCAN = np.geomspace(*N_BOUNDS, 19)
_N_FINER = np.geomspace(_N_SCAN[0] / _N_SCAN[1], _N_SCAN[1] / _N_SCAN[0], 9)[1:-1]  # about the best one
# Singular values of the steady section below this share of the largest are noise: the branches overlap too little.
_STEADY_RCOND = 1e-3
# FA may not fall below this share of its median while omega is extracted.
_LEAST_AMPLIFIER = 0.1
# omega is smoothed until its noise is below this share of the loop's half height, but never over more than that share
# of a stroke, where the loop's own shape would suffer.
_WANTED_NOISE = 0.01
_LARGEST_SHARE = 0.05
_FLAT = 1e-9  # change of u below which it is called constant between two points


@dataclass(frozen=True)
class Hysteresis:
    """rho [1/m], sigma, n of eq. (11)."""

    rho: float
    sigma: float
    n: float


@dataclass(frozen=True, eq=False)
class Backbone:
    """FE and G = kappa_omega*FA as Legendre coefficients, and both at the points of the loops [N]."""

    elastic: FloatArray
    amplified: FloatArray
    FE: FloatArray
    G: FloatArray

    @classmethod
    def from_coefficients(cls, coefficients: FloatArray, columns: Columns) -> Backbone:
        """The backbone of all coefficients, those of FE first, at the displacements of the columns."""
        terms = columns.elastic.shape[1]
        elastic, amplified = coefficients[:terms], coefficients[terms:]
        return cls(elastic, amplified, columns.elastic @ elastic, columns.amplifier @ amplified)

    def force(self, omega: FloatArray) -> FloatArray:
        """Predicted force at the points [N]."""
        return self.FE + omega * self.G

    def misfit(self, force: FloatArray, omega: FloatArray) -> FloatArray:
        """Residuals of a measured force at the points [N]."""
        return np.asarray(force - self.FE - omega * self.G)


def fit_backbone(
    loops: SamplePoints, columns: Columns, omega: FloatArray, chosen: NDArray[np.bool_] | None = None
) -> Backbone | None:
    """Stage 1: FE and G by linear least squares on the chosen points; None if they are too few.

    Parameters
    ----------
    loops : SamplePoints
    columns : Columns                      Basis functions at the points.
    omega : ndarray, shape (P,)            omega at each point: +-1 in the steady section.
    chosen : ndarray of bool, shape (P,)   The steady section; all points if None.
    """
    matrix = np.hstack([columns.elastic, omega[:, None] * columns.amplifier])
    root = np.sqrt(loops.weight)
    rows = slice(None) if chosen is None else chosen
    rcond = 1e-12 if chosen is None else _STEADY_RCOND
    weighted = (matrix * root[:, None])[rows]
    if weighted.shape[0] < 2 * weighted.shape[1]:
        return None
    return Backbone.from_coefficients(np.linalg.lstsq(weighted, (loops.force * root)[rows], rcond=rcond)[0], columns)


def extract_omega(loops: SamplePoints, backbone: Backbone) -> tuple[FloatArray, FloatArray] | None:
    """omega = (r - FE)/G (eq. 21) after smoothing, and the G it was divided by; None without a positive loop."""
    middle = float(np.median(backbone.G))
    if middle <= 0.0:
        return None
    G = np.maximum(backbone.G, _LEAST_AMPLIFIER * middle)
    omega = (loops.force - backbone.FE) / G
    return smoothed(loops, omega), G


def smoothed(loops: SamplePoints, omega: FloatArray) -> FloatArray:
    """omega with the noise brought below 1 % of its half height, which is 1, by a weighted mean over neighbours.

    The window shrinks symmetrically at the ends of a stroke.

    Parameters
    ----------
    loops : SamplePoints              Gives the stroke and weight of each point.
    omega : ndarray, shape (P,)
    """
    wanted = (noise_level(omega) / _WANTED_NOISE) ** 2
    points_per_stroke = omega.size / (loops.bounds.size - 1)
    half_width = int(min(0.5 * wanted, 0.5 * _LARGEST_SHARE * points_per_stroke))
    if half_width == 0:
        return omega
    position = np.arange(loops.stroke.size)
    begin, end = (np.repeat(ends, np.diff(loops.bounds)) for ends in (loops.bounds[:-1], loops.bounds[1:] - 1))
    reach = np.minimum(half_width, np.minimum(position - begin, end - position))
    low, high = position - reach, position + reach + 1
    sums, weights = (np.append(0.0, np.cumsum(column)) for column in (omega * loops.weight, loops.weight))
    return np.asarray((sums[high] - sums[low]) / (weights[high] - weights[low]))


def fit_hysteresis(loops: SamplePoints, backbones: Sequence[Backbone | None]) -> list[tuple[Hysteresis, float] | None]:
    """Stage 2 for each backbone: rho, sigma, n and the rms misfit [N] of the integrated eq. (22).

    None without a backbone, a positive loop or a rho > 0.
    """
    extracted = [None if each is None else extract_omega(loops, each) for each in backbones]
    possible = [each for each in extracted if each is not None]
    if not possible:
        return [None] * len(extracted)
    fits = iter(_fits(loops, *(np.array(each) for each in zip(*possible, strict=True))))
    return [None if each is None else next(fits) for each in extracted]


def _fits(loops: SamplePoints, omega: FloatArray, G: FloatArray) -> list[tuple[Hysteresis, float] | None]:
    """Stage 2 from each omega and its G, both of shape (L, P); None without a rho > 0."""
    u, weight = loops.side * omega, loops.weight * G**2
    # Each stroke begins with the reversal that ended the one before it, which turns the sign of u: without that point a
    # loop that switches between two samples, as dry friction does, would show nothing of rho.
    first = loops.bounds[:-1]
    stroke, before = loops.stroke[first[1:]], loops.stroke[first[1:] - 1]
    turns = first[1:][(stroke == before + 1) & (loops.record[stroke] == loops.record[before])]
    u = np.insert(u, turns, -u[:, turns - 1], axis=1)
    weight = np.insert(weight, turns, weight[:, turns], axis=1)
    first, travel = first + np.searchsorted(turns, first), np.insert(loops.travel, turns, 0.0)
    # Noise may carry u out of its bounds. A little of that is kept, in what is integrated too: a saturated branch would
    # have 1 - u^n above 0 in the mean without it, so rho too large and n too small.
    lines = IntegratedLines(first, travel, u.clip(-1.1, 1.1), weight)
    misfit, _, _ = _fit(lines, np.tile(_N_SCAN, (len(u), 1)))
    best = misfit.argmin(axis=1)[:, None]
    n = _N_SCAN[best] * np.where((best > 0) & (best < _N_SCAN.size - 1), _N_FINER, 1.0)
    found = np.stack([n, *_fit(lines, n)])
    best = found[1].argmin(axis=1)
    fits: list[tuple[Hysteresis, float] | None] = []
    for n_there, misfit_there, rho, recovery in found[:, np.arange(len(u)), best].T.tolist():
        if math.isinf(misfit_there):
            fits.append(None)
            continue
        sigma = min(max(0.5 * (1.0 + recovery / rho), SIGMA_BOUNDS[0]), SIGMA_BOUNDS[1])
        fits.append((Hysteresis(rho, sigma, n_there), math.sqrt(misfit_there / float(loops.weight.sum()))))
    return fits


def _fit(lines: IntegratedLines, n: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Weighted squared misfit, inf where no rho > 0 fits, and slopes a, b for each n, shapes (L, N)."""
    aa, ab, bb, ay, by = lines.sums(n)
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = aa * bb - ab**2
        a = (bb * ay - ab * by) / determinant
        b = (aa * by - ab * ay) / determinant
        # The bounds of sigma are bounds of b/a; on one of them the line has a single slope.
        low, high = (2.0 * sigma - 1.0 for sigma in SIGMA_BOUNDS)
        for outside, ratio in ((~(b >= low * a), low), (b > high * a, high)):
            on_bound = (ay + ratio * by) / (aa + 2.0 * ratio * ab + ratio**2 * bb)
            a, b = np.where(outside, on_bound, a), np.where(outside, ratio * on_bound, b)
        misfit = lines.squared[:, None] - 2 * (a * ay + b * by) + a**2 * aa + 2 * a * b * ab + b**2 * bb
        misfit = np.where((a > 0.0) & np.isfinite(misfit), np.maximum(misfit, 0.0), np.inf)
    return misfit, a, b


class IntegratedLines:
    """Lines u(s) = u(0) + a*d(s) + b*r(s) along strokes, u(0) of each stroke being free, with

        d = s - integral over u > 0 of u^n ds,    r = integral over u < 0 of (-u)^n ds.

    Between two points u is taken as a straight line and integrated exactly, across zero too.

    Parameters
    ----------
    first : ndarray of int, shape (S,)    First point of each stroke.
    travel : ndarray, shape (P,)          Distance from the beginning of the stroke [m], rising.
    u : ndarray, shape (L, P)             Of each line.
    weight : ndarray, shape (L, P)
    """

    def __init__(self, first: NDArray[np.intp], travel: FloatArray, u: FloatArray, weight: FloatArray) -> None:
        self._first, self._lengths, self._travel = first, np.diff(first, append=travel.size), travel
        weights = np.add.reduceat(weight, first, axis=1)
        mean = np.add.reduceat(u * weight, first, axis=1) / weights
        centred = u - np.repeat(mean, self._lengths, axis=1)
        self.squared = np.sum(weight * centred**2, axis=1)
        step, change = np.diff(travel, prepend=0.0), np.diff(u, prepend=0.0)
        step[first], change[:, first] = travel[first], 0.0
        changes = np.abs(change) >= _FLAT
        per_change = np.divide(step, change, out=np.zeros(u.shape), where=changes)
        flat = np.divide(step, np.abs(u), out=np.zeros(u.shape), where=~changes & (u != 0.0))
        with np.errstate(divide="ignore"):
            log = np.log(np.abs(u))
        self._lines = log, u, per_change, flat, weight, 1.0 / weights, centred

    def sums(self, n: FloatArray) -> FloatArray:
        """Weighted sums of d*d, d*r, r*r, d*u and r*u without each stroke's means, shape (5, L, N).

        Parameters
        ----------
        n : ndarray, shape (L, N)   Tried on each line.
        """
        sums = np.empty((5, *n.shape))
        first = self._first
        for k, (exponent, log, u, per_change, flat, weight, per_weights, centred) in enumerate(
            zip(n[:, :, None] + 1.0, *self._lines, strict=True)
        ):
            powers = np.exp(exponent * log) / exponent
            terms = np.empty((2, *powers.shape))  # d and r
            for term, side in zip(terms, (1.0, -1.0), strict=True):
                is_here = side * u > 0.0
                level = np.flatnonzero(is_here & (flat > 0.0))
                rises = powers * (side * per_change * is_here)
                rises[:, 1:] -= powers[:, :-1] * (side * per_change[1:] * is_here[:-1])
                rises[:, level] += exponent * flat[level] * powers[:, level]
                # Each stroke begins at 0.
                rises[:, first[1:]] -= np.add.reduceat(rises, first, axis=1)[:, :-1]
                np.cumsum(rises, axis=1, out=term)
            np.subtract(self._travel, terms[0], out=terms[0])
            weighted = weight * terms
            of_strokes = np.add.reduceat(weighted, first, axis=2)
            for row, (a, b) in enumerate(((0, 0), (0, 1), (1, 1))):
                means = np.einsum("ns,ns,s->n", of_strokes[a], of_strokes[b], per_weights)
                sums[row, k] = np.einsum("np,np->n", weighted[a], terms[b]) - means
            sums[3:, k] = weighted @ centred
        return sums
