"""A refined fit as a linear one: Jacobian of the force, and the covariance of the coefficients."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import FloatArray
from ..points.polynomials import Basis
from ..points.residuals import repetition
from ..points.sample_points import SamplePoints
from .coloured_noise import CoefficientCovariance, coefficient_covariance
from .projection import Refinement
from .stages import N_BOUNDS, SIGMA_BOUNDS, Hysteresis

_LEAST_FREE = 0.1  # share of misfits within the bounds; if fewer were, those beyond would be no outliers


@dataclass(frozen=True, eq=False)
class Further:
    """Coefficients of what a spring of a wider class has beside the first mechanism.

    Attributes
    ----------
    names : tuple of str            Of m parameters of the spring, as the joint covariance names them.
    values : tuple of float         The parameters; a name with "ln" before it is that of the logarithm of its one.
    jacobian : ndarray, shape (P, k)   Derivatives of the force by k fitted coefficients that are free [N].
    change : ndarray, shape (m, k)  Derivatives of the named parameters by these.
    """

    names: tuple[str, ...]
    values: tuple[float, ...]
    jacobian: FloatArray
    change: FloatArray


@dataclass(frozen=True, eq=False)
class Linearised:
    """A refined fit in the coefficients of FE and G and in those of rho, sigma and n that are free.

    The omega_start of each record is a coefficient of its own, which the others are beside.

    Attributes
    ----------
    loops, basis, refinement : SamplePoints, Basis, Refinement
    free : ndarray of bool, shape (3,)        Which of ln(rho), ln(sigma) and ln(n) vary.
    is_start_free : ndarray of bool, shape (R,)   Which omega_start does.
    further : Further or None   What a wider class has; its coefficients come last.
    """

    loops: SamplePoints
    basis: Basis
    refinement: Refinement
    free: NDArray[np.bool_]
    is_start_free: NDArray[np.bool_]
    further: Further | None = None

    @classmethod
    def from_refinement(
        cls, loops: SamplePoints, basis: Basis, refinement: Refinement, further: Further | None = None
    ) -> Linearised:
        """With those free that lie off their bounds and that the points depend on."""
        h = refinement.hysteresis
        free = np.array([True, is_sigma_free(h), N_BOUNDS[0] * 1.001 < h.n < N_BOUNDS[1] * 0.999])
        felt = [np.abs(refinement.derivatives[3, points]).max(initial=0.0) > 1e-6 for _, points in loops.by_record]
        return cls(loops, basis, refinement, free, (np.abs(refinement.omega_start) < 0.999) & felt, further)

    def freed(self, parameter: int) -> Linearised:
        """With one more of the nonlinear coefficients free."""
        free = self.free.copy()
        free[parameter] = True
        return replace(self, free=free)

    @property
    def linear_count(self) -> int:
        """Number of coefficients of FE and G, which come before the nonlinear ones."""
        return self.basis.elastic + self.basis.amplifier + 2

    def column(self, parameter: int) -> int:
        """Column of a nonlinear coefficient that is free."""
        return self.linear_count + int(self.free[:parameter].sum())

    @property
    def further_columns(self) -> slice:
        """Columns of the coefficients of a wider class."""
        return slice(self.linear_count + int(self.free.sum()), None)

    @cached_property
    def jacobian(self) -> FloatArray:
        """Derivatives of the force by the coefficients, shape (P, p) [N]."""
        columns = self.basis.columns(self.loops.displacement)
        fit = self.refinement
        yielding = (fit.derivatives[:3][self.free] * fit.backbone.G).T
        parts = [columns.elastic, fit.omega[:, None] * columns.amplifier, yielding]
        return np.hstack(parts if self.further is None else [*parts, self.further.jacobian])

    @cached_property
    def by_start(self) -> FloatArray:
        """Derivative of the force by the omega_start of the record, 0 where that is not free, shape (P,) [N]."""
        of_point = self.loops.record[self.loops.stroke]
        return np.asarray(self.refinement.derivatives[3] * self.refinement.backbone.G * self.is_start_free[of_point])

    def weighted(self, weight: FloatArray) -> FloatArray:
        """The weighted Jacobian beside the derivatives by omega_start, shape (P, p)."""
        root = np.sqrt(weight)
        return self.loops.beside_starts(self.jacobian * root[:, None], self.by_start * root)

    @cached_property
    def misfit(self) -> FloatArray:
        """Measured less predicted force, shape (P,) [N]."""
        return self.refinement.backbone.misfit(self.loops.force, self.refinement.omega)

    @cached_property
    def root(self) -> FloatArray:
        """Matrix R with the covariance R*R' of the coefficients, shape (p, q)."""
        return self.estimate.root

    @cached_property
    def force_error(self) -> FloatArray:
        """Standard error of the predicted force, shape (P,) [N]."""
        root = np.sqrt(self.refinement.full_weight)
        shared = self.weighted(self.refinement.full_weight)
        start = self.loops.unit_vectors(self.by_start * root)
        with_start = self.estimate.with_own[self.loops.record[self.loops.stroke]]
        crossed = np.einsum("pi,pi->p", shared @ self.estimate.scale, with_start[:, :-1])
        variance = np.sum((shared @ self.root) ** 2, axis=1) + start * (2.0 * crossed + start * with_start[:, -1])
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)) / root)

    @cached_property
    def estimate(self) -> CoefficientCovariance:
        """Covariance of the coefficients; misfit that comes back in every cycle is not averaged over cycles.

        With Huber's loss, whose derivative psi is the misfit held within bounds, psi takes the place of the misfit,
        and the errors grow by one over the share of misfits within them (Huber, Ann. Math. Statist. 35, 1964).
        """
        fit = self.refinement
        root = np.sqrt(fit.full_weight)
        bend = fit.weight / fit.full_weight
        within = max(float(np.mean(bend == 1.0)), _LEAST_FREE)
        held = root * bend * self.misfit
        noise = coefficient_covariance(
            self.weighted(fit.full_weight), self.loops.unit_vectors(self.by_start * root), held / within,
            [points for _, points in self.loops.by_record],
        )  # fmt: skip
        repeated = repetition(self.loops, held)
        return noise._replace(models=noise.models * repeated, with_own=noise.with_own * repeated)


def is_sigma_free(hysteresis: Hysteresis) -> bool:
    """Whether sigma lies off its bounds."""
    return SIGMA_BOUNDS[0] * 1.001 < hysteresis.sigma < SIGMA_BOUNDS[1] * 0.999
