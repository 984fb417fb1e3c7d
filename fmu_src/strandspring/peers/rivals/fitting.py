"""One fit for all classes: variable projection over the shape parameters from several seeded starts.

FE is projected out once; for given shape parameters the c_k follow by (non-negative) linear least squares, and the
shape parameters by bounded least squares. All classes get the same points with the same weights, the same number of
starts at the same middling degrees, and their degrees by the same criterion: the fewest parameters whose error on
points held out is within 2 % of the least, the shape being kept from the fit to all points and the linear coefficients
fitted anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...identification.points.polynomials import Basis
from ...identification.search.search import force_floor
from ...kernel.arrays import FloatArray
from ...loops.strokes import IndexArray
from .classes import Rival
from .track import Track

STARTS = 8
SEED = 0
_PILOT = (5, 2)  # degrees at which the starts are tried
_KEPT = 2  # minima that are carried to other degrees
_ELASTIC = (1, 2, 3, 4, 5, 6, 8)  # degrees of FE tried
_AMPLIFIER = (0, 1, 2, 3, 4)  # degrees of the factor of the hysteretic part tried
_ROUNDS = 60  # evaluations with a Jacobian from each start
_AS_WELL = 1.02  # errors within this factor of the least are equally good
_DIFFERENCE = 1e-5  # of a shape parameter for the derivatives, share of its range
_TINY = 1e-10  # singular values below this share of the largest are dropped, and squares of columns below this share


@dataclass(frozen=True, eq=False)
class RivalFit:
    """A fitted model of a class.

    Attributes
    ----------
    rival : Rival
    basis : Basis
    searched : ndarray              The shape parameters on the scale of the search.
    elastic, coefficients : ndarray Legendre coefficients of FE [N]; the c_k.
    misfit : float                  rms over the points it was fitted to [N].
    """

    rival: Rival
    basis: Basis
    searched: FloatArray
    elastic: FloatArray
    coefficients: FloatArray
    misfit: float

    @property
    def shape(self) -> dict[str, float]:
        """The shape parameters, lengths in half ranges."""
        shapes = self.rival.shapes(self.basis)
        return {s.name: s.value(float(p)) for s, p in zip(shapes, self.searched, strict=True)}

    @property
    def parameters(self) -> int:
        """Number of fitted parameters."""
        return int(self.searched.size + self.elastic.size + self.coefficients.size)

    def at_points(self, track: Track) -> FloatArray:
        """Force at the points of a track [N]."""
        values = np.array(list(self.shape.values()))
        columns = self.rival.columns(track, self.basis, values)
        return np.asarray(
            self.basis.columns(track.loops.displacement).elastic @ self.elastic + columns @ self.coefficients
        )


@dataclass(frozen=True, eq=False)
class RivalProblem:
    """A class, the points it is fitted to and the degrees.

    Parameters
    ----------
    rival : Rival
    basis : Basis
    track : Track
    weight : ndarray, shape (P,)   Of each point; 0 where it is held out.
    """

    rival: Rival
    basis: Basis
    track: Track
    weight: FloatArray

    def minima(self, starts: Iterable[FloatArray]) -> list[RivalFit]:
        """The models reached from starts on the scale of the search, best first; impossible ones are left out."""
        from scipy.optimize import least_squares  # slow to import, and only this needs it

        low, high = np.array([shape.bounds for shape in self.rival.shapes(self.basis)]).T
        residuals, solve = self.projected()
        margin = 1e-6 * (high - low)
        steps = np.diag(_DIFFERENCE * (high - low))

        def jacobian(searched: FloatArray) -> FloatArray:
            here = residuals(searched)
            # Away from the nearer bound.
            signs = np.where(searched < 0.5 * (low + high), 1.0, -1.0)
            slopes = [(residuals(searched + s * h) - here) / (s * h.sum()) for s, h in zip(signs, steps, strict=True)]
            return np.stack(slopes, axis=1)

        fits = []
        for start in starts:
            inside = np.clip(start, low + margin, high - margin)
            minimum = least_squares(
                residuals, inside, jac=jacobian, bounds=(low, high), x_scale=high - low, ftol=1e-8, xtol=1e-8,
                gtol=1e-12, max_nfev=_ROUNDS,
            ).x  # fmt: skip
            elastic, coefficients, misfit = solve(minimum)
            if self.rival.dissipates(self.basis, self.values(minimum), coefficients):
                fits.append(RivalFit(self.rival, self.basis, minimum, elastic, coefficients, misfit))
        return sorted(fits, key=lambda fit: fit.misfit)

    def carried(self, fits: Iterable[RivalFit]) -> list[RivalFit]:
        """The minima that are reached from those of other degrees or other points."""
        size = len(self.rival.shapes(self.basis))
        return self.minima(np.append(fit.searched, np.zeros(size))[:size] for fit in fits)

    def held_out_error(self, searched: FloatArray, fold: IndexArray) -> float:
        """rms error [N] on each fold with linear coefficients from the other folds."""
        terms, loops = self.basis.columns(self.track.loops.displacement).elastic, self.track.loops
        squares = 0.0
        for held in range(int(fold.max()) + 1):
            out = fold == held
            rest = replace(self, weight=np.where(out, 0.0, self.weight))
            columns = rest.hysteretic(searched)
            elastic, coefficients, _ = rest.projected()[1](searched)
            error = (loops.force - terms @ elastic - columns @ coefficients)[out]
            squares += float(self.weight[out] @ error**2)
        return float(np.sqrt(squares / self.weight.sum()))

    def random_starts(self) -> list[FloatArray]:
        """`STARTS` Latin hypercube samples of the shape parameters."""
        shapes = self.rival.shapes(self.basis)
        draw = np.random.default_rng(SEED)
        shares = np.stack([(draw.permutation(STARTS) + draw.random(STARTS)) / STARTS for _ in shapes], axis=1)
        low, high = np.array([shape.bounds for shape in shapes]).T
        return list(low + shares * (high - low))

    def hysteretic(self, searched: FloatArray) -> FloatArray:
        """H_k at all points, shape (P, L)."""
        return self.rival.columns(self.track, self.basis, self.values(searched))

    def values(self, searched: FloatArray) -> FloatArray:
        """The shape parameters at a point of the search."""
        shapes = self.rival.shapes(self.basis)
        return np.array([shape.value(float(p)) for shape, p in zip(shapes, searched, strict=True)])

    def projected(self) -> tuple[Callable[[FloatArray], FloatArray], Callable[[FloatArray], Any]]:
        """Weighted residuals for a point of the search, and the linear coefficients and rms misfit there."""
        track, used = self.track, self.weight > 0.0
        root = np.sqrt(self.weight[used])
        matrix = self.basis.columns(track.loops.displacement[used]).elastic * root[:, None]
        ortho, triangle = np.linalg.qr(matrix)
        target = track.loops.force[used] * root
        outside = target - ortho @ (ortho.T @ target)

        def linear(searched: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
            columns = self.hysteretic(searched)[used] * root[:, None]
            free = columns - ortho @ (ortho.T @ columns)
            return columns, free, self._coefficients(columns, free, outside)

        def residuals(searched: FloatArray) -> FloatArray:
            _, free, coefficients = linear(searched)
            return np.asarray(outside - free @ coefficients)

        def solve(searched: FloatArray) -> tuple[FloatArray, FloatArray, float]:
            columns, free, coefficients = linear(searched)
            elastic = np.linalg.solve(triangle, ortho.T @ (target - columns @ coefficients))
            left = outside - free @ coefficients
            return elastic, coefficients, float(np.sqrt(left @ left / self.weight.sum()))

        return residuals, solve

    def _coefficients(self, columns: FloatArray, free: FloatArray, target: FloatArray) -> FloatArray:
        """The c_k; `free` are the columns without what FE can do."""
        # What FE leaves of a column may be rounding only: the scale is that of the whole column.
        scale = np.maximum(np.sqrt(np.sum(columns**2, axis=0)), 1e-300)
        scaled = free / scale
        if not self.rival.is_nonnegative:
            return np.asarray(np.linalg.lstsq(scaled, target, rcond=_TINY)[0] / scale)
        if scaled.shape[1] == 1:
            only = scaled[:, 0]
            return np.asarray(np.array([max(float(only @ target), 0.0) / max(float(only @ only), _TINY)]) / scale)
        from scipy.optimize import nnls

        # A stop that never slips is a polynomial: rounding is all that FE leaves of it.
        scaled[:, np.sum(scaled**2, axis=0) < _TINY] = 0.0
        ortho, triangle = np.linalg.qr(scaled)  # the same problem with as many rows as columns
        return np.asarray(nnls(triangle, ortho.T @ target)[0] / scale)


def fit_class(rival: Rival, track: Track, fold: IndexArray) -> list[RivalFit]:
    """Fit a class to a track, degrees included.

    Parameters
    ----------
    rival : Rival
    track : Track
    fold : ndarray of int, shape (P,)   Points of one fold are held out together to choose the degrees.

    Returns
    -------
    list of RivalFit   At the chosen degrees, best first; empty if no model that dissipates is found.
    """
    basis = Basis(*track.loops.reach, _PILOT[0], _PILOT[1] if rival.has_amplifier else 0)
    problem = RivalProblem(rival, basis, track, track.loops.weight)
    pilots = distinct(problem.minima(problem.random_starts()))
    if not pilots:
        return []
    floor = force_floor(track.loops)  # error below which fits are equally good
    amplifiers = _AMPLIFIER if rival.has_amplifier else (0,)

    def leanest(degrees: Iterable[tuple[int, int]], starts: list[RivalFit]) -> list[RivalFit]:
        """The minima at the best of some degrees."""
        tried = []
        for elastic, amplifier in degrees:
            at = replace(problem, basis=replace(basis, elastic=elastic, amplifier=amplifier))
            if fits := distinct(at.carried(starts)):
                tried.append((max(at.held_out_error(fits[0].searched, fold), floor), fits))
        if not tried:
            return starts
        enough = _AS_WELL * min(error for error, _ in tried)
        return min((fits for error, fits in tried if error <= enough), key=lambda fits: fits[0].parameters)

    best = leanest(((elastic, basis.amplifier) for elastic in _ELASTIC), pilots)
    return leanest(((best[0].basis.elastic, amplifier) for amplifier in amplifiers), [*best, *pilots])


def distinct(fits: list[RivalFit]) -> list[RivalFit]:
    """The best few of different minima, best first."""
    kept: list[RivalFit] = []
    for fit in fits:
        if all(fit.misfit > 1.001 * other.misfit for other in kept):
            kept.append(fit)
    return kept[:_KEPT]
