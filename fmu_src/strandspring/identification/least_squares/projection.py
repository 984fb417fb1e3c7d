"""Variable projection: least squares in rho, sigma, n and omega_start alone.

FE and FA enter linearly: for given rho, sigma, n (and omega_start of each record) their coefficients follow from one
linear least-squares problem, so only those few parameters are iterated on. With P the projection on the columns of that
problem the residuals are (1 - P) r, and their Jacobian in Kaufman's form is -(1 - P) (d omega/d theta)*G, with the
exact derivatives of `kernel.points`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...kernel.arrays import FloatArray
from ...kernel.record_fit import RecordFit
from ..points.loops import Loops
from ..points.polynomials import Basis
from .stages import N_BOUNDS, SIGMA_BOUNDS, Backbone, Hysteresis

# rho times the longest stroke: from a loop that hardly saturates (below, FA and rho are strongly correlated) to one
# that saturates within a millionth of the stroke.
RHO_BOUNDS = (2.0, 1e6)
# rho may move by this factor from its start. Records outside the model would else drive it to where FE imitates the
# loop of the one amplitude measured.
_TRUST = 10.0
_EVALUATIONS = 100
_INSIDE = 1e-6  # distance of a start from the bounds
_BLOCK = 256  # rows that are decomposed together, which stay in the cache


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
    loops : Loops
    basis : Basis
    start : Hysteresis                        Limits rho.
    further : ndarray, shape (P, k), or None  Further columns, whose coefficients follow those of FE.
    coarse : bool                             omega to 1e-8 only, the quicker for it.
    """

    def __init__(
        self,
        loops: Loops,
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
        around = (max(least, start.rho / _TRUST), min(most, start.rho * _TRUST))
        bounds = [around, SIGMA_BOUNDS, N_BOUNDS]
        self.low = np.array([*(math.log(low) for low, _ in bounds), *[-1.0] * self.records])
        self.high = np.array([*(math.log(high) for _, high in bounds), *[1.0] * self.records])

    @cached_property
    def _fit(self) -> RecordFit:
        return RecordFit(self.loops.points, *self.columns, self.loops.force, self.low, self.high, self._coarse)

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
        start = vector(hysteresis, omega_start).clip(self.low + _INSIDE, self.high - _INSIDE)
        found = self._fit.solve(start, np.sqrt(weight), tolerance, evaluations)
        rho, sigma, n = np.exp(found.variables[:3]).tolist()
        return Refinement(
            Hysteresis(rho, max(sigma, SIGMA_BOUNDS[0]), n),
            found.variables[3:],
            Backbone.from_coefficients(found.coefficients, self.columns),
            found.omega,
            found.derivatives,
            weight,
            weight,
            found.converged,
        )

    def omega(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """omega at every point and its derivatives with respect to theta."""
        rho, sigma, n = np.exp(theta[:3]).tolist()
        return self.loops.points.omega(rho, sigma, n, theta[3:], self._coarse)


def triangle_of(matrix: FloatArray) -> FloatArray:
    """R of the QR decomposition of a tall matrix, block by block."""
    rows, columns = matrix.shape
    blocks = rows // _BLOCK
    if blocks > 1:
        cut = blocks * _BLOCK
        parts = np.asarray(np.linalg.qr(matrix[:cut].reshape(blocks, _BLOCK, columns), mode="r"))
        matrix = np.concatenate([parts.reshape(-1, columns), matrix[cut:]])
    return np.asarray(np.linalg.qr(matrix, mode="r"))


def vector(hysteresis: Hysteresis, omega_start: FloatArray) -> FloatArray:
    """The nonlinear coefficients as `Problem` takes them, shape (3 + R,)."""
    h = hysteresis
    return np.array([math.log(h.rho), math.log(h.sigma), math.log(h.n), *omega_start.tolist()])
