"""Variable projection: least squares in rho, sigma, n and omega_start alone.

FE and FA enter linearly: for given rho, sigma, n (and omega_start of each record) their coefficients follow from one
linear least-squares problem, so only those few parameters are iterated on. With P the projection on the columns of that
problem the residuals are (1 - P) r, and their Jacobian in Kaufman's form is -(1 - P) (d omega/d theta)*G, with the
exact derivatives of `kernel.points`. The column of an omega_start is zero at the points of other records: where there
are many records it is kept apart, and `trust_region` eliminates it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...kernel.arrays import FloatArray
from ..points.polynomials import Basis
from ..points.sample_points import SamplePoints
from .stages import N_BOUNDS, SIGMA_BOUNDS, Backbone, Hysteresis
from .trust_region import Reduced, minimise, triangle_of

# rho times the longest stroke: from a loop that hardly saturates (below, FA and rho are strongly correlated) to one
# that saturates within a millionth of the stroke.
RHO_BOUNDS = (2.0, 1e6)
# rho may move by this factor from its start. Records outside the model would else drive it to where FE imitates the
# loop of the one amplitude measured. Dry friction starts far beyond the bounds.
_TRUST = 10.0
_EVALUATIONS = 100
_INSIDE = 1e-6  # distance of omega_start from +-1, where it has no effect
_DEPENDENT = 1e-13  # of a column's length is left, and it is a combination of those before it
_FEW = 8  # records up to which omega_start is a variable like the others, which is quicker


@dataclass(frozen=True, eq=False)
class Refinement:
    """A refined fit.

    Attributes
    ----------
    hysteresis : Hysteresis
    omega_start : ndarray, shape (R,)      omega at the first sample of each record.
    backbone : Backbone
    omega : ndarray, shape (P,)
    derivatives : ndarray, shape (4, P)    d omega by ln(rho), ln(sigma), ln(n) and the omega_start of the record.
    weight : ndarray, shape (P,)           Weight of each squared misfit [1/N^2], counts included.
    full_weight : ndarray, shape (P,)      The same before Huber's loss lowered the weight of outliers.
    converged : bool                       Whether the iteration ended before its limit of evaluations.
    """

    hysteresis: Hysteresis
    omega_start: FloatArray
    backbone: Backbone
    omega: FloatArray
    derivatives: FloatArray
    weight: FloatArray
    full_weight: FloatArray
    converged: bool


class Problem:
    """The projected least-squares problem of a set of loops in theta = ln(rho), ln(sigma), ln(n), omega_start...

    Parameters
    ----------
    loops : SamplePoints
    basis : Basis
    start : Hysteresis                        Limits rho.
    further : ndarray, shape (P, k), or None  Further columns, whose coefficients follow those of FE.
    coarse : bool                             omega to 1e-8 only, the quicker for it.
    """

    def __init__(
        self,
        loops: SamplePoints,
        basis: Basis,
        start: Hysteresis,
        further: FloatArray | None = None,
        coarse: bool = False,
    ) -> None:
        self.loops = loops
        self._coarse = coarse
        self.columns = basis.columns(loops.displacement, further)
        self.records = loops.points.records
        longest = float(loops.length.max())
        least, most = (b / longest for b in RHO_BOUNDS)
        around = (max(least, min(start.rho, most) / _TRUST), min(most, max(start.rho, least) * _TRUST))
        bounds = [around, SIGMA_BOUNDS, N_BOUNDS]
        self.low = np.array([*(math.log(low) for low, _ in bounds), *[_INSIDE - 1.0] * self.records])
        self.high = np.array([*(math.log(high) for _, high in bounds), *[1.0 - _INSIDE] * self.records])

    def linearised(self, hysteresis: Hysteresis, backbone: Backbone) -> Refinement:
        """The fit of another method as a refinement that has not begun, with the derivatives there."""
        weight, start = self.loops.weight, np.zeros(self.records)
        omega, derivatives = self.omega(vector(hysteresis, start))
        return Refinement(hysteresis, start, backbone, omega, derivatives, weight, weight, False)

    def at(self, fit: Refinement) -> Refinement:
        """A fit of other points of the same records at these points, unweighted."""
        weight = self.loops.weight
        omega, derivatives = self.omega(vector(fit.hysteresis, fit.omega_start))
        coefficients = np.concatenate([fit.backbone.elastic, fit.backbone.amplified])
        return replace(
            fit,
            backbone=Backbone.from_coefficients(coefficients, self.columns),
            omega=omega,
            derivatives=derivatives,
            weight=weight,
            full_weight=weight,
        )

    def solve(
        self,
        hysteresis: Hysteresis,
        omega_start: FloatArray,
        weight: FloatArray,
        tolerance: float,
        evaluations: int = _EVALUATIONS,
    ) -> Refinement:
        """Minimise the weighted squared misfit from a start.

        Parameters
        ----------
        hysteresis : Hysteresis
        omega_start : ndarray, shape (R,)
        weight : ndarray, shape (P,)   [1/N^2]
        tolerance : float              Relative change of the squared misfit at which the iteration ends.
        evaluations : int              At which it ends in any case.
        """
        linear = partial(_Fit, _Weighted(self, weight))
        start = vector(hysteresis, omega_start)
        theta, fit, converged = minimise(linear, start, self.low, self.high, tolerance, evaluations)
        rho, sigma, n = np.exp(theta[:3]).tolist()
        return Refinement(
            Hysteresis(rho, max(sigma, SIGMA_BOUNDS[0]), n),
            theta[3:],
            Backbone.from_coefficients(fit.coefficients, self.columns),
            fit.omega,
            fit.derivatives,
            weight,
            weight,
            converged,
        )

    def omega(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """omega at every point and its derivatives, those by omega_start being of the record that a point is of."""
        rho, sigma, n = np.exp(theta[:3]).tolist()
        return self.loops.points.omega(rho, sigma, n, theta[3:], self._coarse)


class _Weighted:
    """A problem with weights, and its columns that never change: those of FE and whatever else is linear."""

    def __init__(self, problem: Problem, weight: FloatArray) -> None:
        self.problem = problem
        root = np.sqrt(weight)[:, None]
        self.fixed, self.moving = (columns * root for columns in problem.columns)
        self.force = problem.loops.force * root[:, 0]
        self.kept = np.arange(self.fixed.shape[1])
        while True:
            self.frame, self.R = np.linalg.qr(self.fixed[:, self.kept])
            is_new = np.abs(np.diag(self.R)) > _DEPENDENT * np.linalg.norm(self.R, axis=0)
            if is_new.all():
                break
            self.kept = self.kept[is_new]
        self.target = self.beside(self.force)

    def beside(self, columns: FloatArray) -> FloatArray:
        """What of columns does not lie along those that never change."""
        return columns - self.frame @ (self.frame.T @ columns)


class _Fit:
    """The linear problem at one theta."""

    def __init__(self, weighted: _Weighted, theta: FloatArray) -> None:
        self._weighted = weighted
        self.omega, self.derivatives = weighted.problem.omega(theta)
        self._moving = self.omega[:, None] * weighted.moving
        self._least = _DEPENDENT * np.linalg.norm(self._moving, axis=0)
        self._kept = np.arange(self._least.size)
        self._columns = weighted.beside(self._moving)
        while True:
            R = triangle_of(np.column_stack([self._columns, weighted.target]))
            is_new = np.abs(np.diag(R)[:-1]) > self._least[self._kept]
            if is_new.all():
                break
            self._kept, self._columns = self._kept[is_new], self._columns[:, is_new]
        self.squares = float(R[-1, -1] ** 2)
        self._amplified = np.zeros(self._least.size)
        self._amplified[self._kept] = np.linalg.solve(R[:-1, :-1], R[:-1, -1])

    def reduced(self) -> Reduced:
        """The residuals and their derivatives by theta in Kaufman's form."""
        weighted, loops = self._weighted, self._weighted.problem.loops
        *shared, own = self.derivatives * -(weighted.moving @ self._amplified)
        records = weighted.problem.records
        if records <= _FEW:
            shared.extend(np.where(loops.record[loops.stroke] == np.arange(records)[:, None], own, 0.0))
        # Of exact records the residuals are tiny: as a column they keep all their digits.
        residuals = weighted.target - self._columns @ self._amplified[self._kept]
        columns = np.column_stack([self._columns, weighted.beside(np.column_stack(shared)), residuals])
        R = triangle_of(columns)
        n = self._kept.size
        if records <= _FEW:
            return Reduced.without_own(R[n:, n:])
        length = np.sqrt(loops.sums_of_records(own**2))
        along = loops.sums_of_records(own[:, None] * np.hstack([weighted.frame, columns]))
        along /= np.where(length > 0.0, length, 1.0)[:, None]
        # In coordinates in which the columns are orthonormal, those that never change being so already.
        scale = np.maximum(np.linalg.norm(R, axis=0), 1e-300)
        fixed = weighted.frame.shape[1]
        along[:, fixed:] = np.linalg.lstsq((R / scale).T, (along[:, fixed:] / scale).T, rcond=_DEPENDENT)[0].T
        return Reduced(R[n:, n:-1], R[n:, -1], length, along)

    @property
    def coefficients(self) -> FloatArray:
        """Those of the columns that never change, then those of FA; 0 where a column depends on those before it."""
        weighted = self._weighted
        elastic = np.zeros(weighted.fixed.shape[1])
        left = weighted.force - self._moving @ self._amplified
        elastic[weighted.kept] = np.linalg.solve(weighted.R, weighted.frame.T @ left)
        return np.concatenate([elastic, self._amplified])


def vector(hysteresis: Hysteresis, omega_start: FloatArray) -> FloatArray:
    """The nonlinear coefficients as `Problem` takes them, shape (3 + R,)."""
    h = hysteresis
    return np.array([math.log(h.rho), math.log(h.sigma), math.log(h.n), *omega_start.tolist()])
