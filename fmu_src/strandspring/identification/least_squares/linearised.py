"""A refined fit as a linear one: Jacobian of the force, and the covariance of the coefficients."""

from __future__ import annotations

from dataclasses import dataclass
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
class Linearised:
    """A refined fit in the coefficients of FE and G and in those of the nonlinear ones that are free.

    Attributes
    ----------
    loops, basis, refinement : SamplePoints, Basis, Refinement
    free : ndarray of bool, shape (3 + R,)   Which of ln(rho), ln(sigma), ln(n) and omega_start vary.
    """

    loops: SamplePoints
    basis: Basis
    refinement: Refinement
    free: NDArray[np.bool_]

    @classmethod
    def from_refinement(cls, loops: SamplePoints, basis: Basis, refinement: Refinement) -> Linearised:
        """With those free that lie off their bounds and that the points depend on."""
        h = refinement.hysteresis
        free = np.ones(refinement.derivatives.shape[0], dtype=bool)
        free[1] = is_sigma_free(h)
        free[2] = N_BOUNDS[0] * 1.001 < h.n < N_BOUNDS[1] * 0.999
        free[3:] = (np.abs(refinement.omega_start) < 0.999) & (np.abs(refinement.derivatives[3:]).max(axis=1) > 1e-6)
        return cls(loops, basis, refinement, free)

    def freed(self, parameter: int) -> Linearised:
        """With one more of the nonlinear coefficients free."""
        free = self.free.copy()
        free[parameter] = True
        return Linearised(self.loops, self.basis, self.refinement, free)

    @property
    def linear_count(self) -> int:
        """Number of coefficients of FE and G, which come before the nonlinear ones."""
        return self.basis.elastic + self.basis.amplifier + 2

    def column(self, parameter: int) -> int:
        """Column of a nonlinear coefficient that is free."""
        return self.linear_count + int(self.free[:parameter].sum())

    @cached_property
    def jacobian(self) -> FloatArray:
        """Derivatives of the force by the coefficients, shape (P, p) [N]."""
        columns = self.basis.columns(self.loops.displacement)
        fit = self.refinement
        return np.hstack(
            [
                columns.elastic,
                fit.omega[:, None] * columns.amplifier,
                (fit.derivatives[self.free] * fit.backbone.G).T,
            ]
        )

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
        return np.asarray(np.linalg.norm(self.jacobian @ self.root, axis=1))

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
            self.jacobian * root[:, None], held / within, [points for _, points in self.loops.by_record]
        )
        return noise._replace(models=noise.models * repetition(self.loops, held))


def is_sigma_free(hysteresis: Hysteresis) -> bool:
    """Whether sigma lies off its bounds."""
    return SIGMA_BOUNDS[0] * 1.001 < hysteresis.sigma < SIGMA_BOUNDS[1] * 0.999
