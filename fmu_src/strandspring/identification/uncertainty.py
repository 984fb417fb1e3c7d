"""How certain the refined parameters are: standard errors and correlations from the Jacobian.

At the optimum the covariance of all coefficients (Legendre coefficients of FE and G, ln rho, ln sigma, ln n,
omega_start) is the inverse of J'WJ, with W the inverse variances of the points, times the mean square of the weighted
misfits r. With Huber's loss, whose derivative psi is r held within bounds, that factor is mean(psi^2)/mean(psi')^2
(Huber, Ann. Math. Statist. 35, 1964). The errors of kE, kA, kappa_omega,
rho, sigma and n follow by linear propagation. A parameter at its bound is taken as known.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..kernel.arrays import FloatArray
from .loops import Loops
from .polynomials import Basis
from .projection import Refinement, triangle_of
from .stages import N_BOUNDS, SIGMA_BOUNDS, Hysteresis

_NAMES = ("kappa_omega", "rho", "sigma", "n")
# Two parameters with a larger correlation are not separated by the records; one with a larger relative error is hardly
# known.
_CORRELATED = 0.98
_UNCERTAIN = 0.5
_UNSURE_RECOVERY = 0.1  # standard error of ln(sigma) from which a sigma at its bound 1/2 is uncertain
_LEAST_FREE = 0.1  # share of misfits within the bounds; if fewer were, those beyond would be no outliers
_NORMAL_95 = 1.96  # standard errors to either side


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Standard errors, one standard deviation each.

    Attributes
    ----------
    kE, kA : ndarray                      Of the coefficients [N/m^i], [1/m^i]; 0 for kA[0].
    kappa_omega, rho, sigma, n : float    [N], [1/m], [-], [-]; nan at a bound.
    correlation : ndarray, shape (4, 4)   Between kappa_omega, rho, sigma and n.
    force : ndarray, shape (P,)           Of the predicted force at each point of the loops [N].
    """

    kE: FloatArray
    kA: FloatArray
    kappa_omega: float
    rho: float
    sigma: float
    n: float
    correlation: FloatArray
    force: FloatArray

    def as_json(self) -> dict[str, Any]:
        """Content of the model file's field `uncertainty`; null where an error is unknown."""

        def plain(value: float) -> float | None:
            return float(value) if np.isfinite(value) else None

        return {
            "meaning": "standard errors (one standard deviation) from the Jacobian, for independent noise",
            "kE": [plain(v) for v in self.kE],
            "kA": [plain(v) for v in self.kA],
            **{name: plain(getattr(self, name)) for name in _NAMES},
            "force_rms": float(np.sqrt(np.mean(self.force**2))),
            "force_max": float(np.max(self.force)),
            "correlation": {
                f"{a},{b}": plain(self.correlation[i, j]) for (i, a), (j, b) in combinations(enumerate(_NAMES), 2)
            },
        }

    def indistinct(self, refinement: Refinement) -> list[str]:
        """Sentences about parameters that are strongly correlated in these records, or hardly known."""
        h = refinement.hysteresis
        values = {"kappa_omega": float(refinement.backbone.amplified[0]), "rho": h.rho, "sigma": h.sigma, "n": h.n}
        sentences = [
            f"{name} is known to {100.0 * getattr(self, name) / abs(values[name]):.0f} % only"
            for name in _NAMES
            if getattr(self, name) > _UNCERTAIN * abs(values[name])
        ]
        sentences += [
            f"{a} and {b} are strongly correlated in these records ({self.correlation[i, j]:.3f})"
            for (i, a), (j, b) in combinations(enumerate(_NAMES), 2)
            if abs(self.correlation[i, j]) > _CORRELATED
        ]
        return sentences


@dataclass(frozen=True, eq=False)
class PredictionBand:
    """The last loop of the fit with the 95 % band of its predicted force.

    Attributes
    ----------
    displacement, low, force, high : ndarray, shape (B,)   In the order of the path [m], [N].
    """

    displacement: FloatArray
    low: FloatArray
    force: FloatArray
    high: FloatArray

    @classmethod
    def from_refinement(cls, loops: Loops, refinement: Refinement, error: FloatArray) -> PredictionBand:
        """The band on the last two strokes from the standard error at each point."""
        last = loops.stroke >= loops.stroke[-1] - 1
        force = refinement.backbone.force(refinement.omega)[last]
        reach = _NORMAL_95 * error[last]
        return cls(loops.displacement[last], force - reach, force, force + reach)


def uncertainty(loops: Loops, basis: Basis, refinement: Refinement) -> Uncertainty:
    """Standard errors of a refined fit."""
    free = _free(refinement)
    linear = _linearised(loops, basis, refinement, free)
    change = _propagation(basis, refinement, free)
    natural = change @ linear.covariance @ change.T
    errors = np.sqrt(np.maximum(np.diag(natural), 0.0))
    n_E, n_A = basis.elastic + 1, basis.amplifier + 1
    four = [n_E + n_A + k for k in range(4)]
    scale = np.where(errors[four] > 0.0, errors[four], np.nan)
    correlation = natural[np.ix_(four, four)] / np.outer(scale, scale)
    force = np.linalg.norm(linear.jacobian @ linear.root, axis=1)
    own = dict(zip(_NAMES, scale.tolist(), strict=True))
    return Uncertainty(errors[:n_E], errors[n_E : n_E + n_A], **own, correlation=np.asarray(correlation), force=force)


def _is_sigma_free(hysteresis: Hysteresis) -> bool:
    """Whether sigma lies off its bounds."""
    return SIGMA_BOUNDS[0] * 1.001 < hysteresis.sigma < SIGMA_BOUNDS[1] * 0.999


def is_sigma_uncertain(loops: Loops, basis: Basis, refinement: Refinement) -> bool:
    """Whether sigma lies on a bound because the points do not show how the force recovers after a reversal.

    The lower bound is a physical one, which springs may lie on: there the standard error that sigma would have
    decides, unless n is on a bound too.
    """
    if _is_sigma_free(refinement.hysteresis):
        return False
    free = _free(refinement)
    if refinement.hysteresis.sigma > SIGMA_BOUNDS[0] * 1.001 or not free[2]:
        return True
    free[1] = True
    covariance = _linearised(loops, basis, refinement, free).covariance
    place = -int(free[1:].sum())
    # A coefficient that no point depends on has the variance 0 here.
    return not 0.0 < float(np.sqrt(covariance[place, place])) <= _UNSURE_RECOVERY


def _free(refinement: Refinement) -> NDArray[np.bool_]:
    """Which of ln(rho), ln(sigma), ln(n) and omega_start vary: those off their bounds that the points depend on."""
    h = refinement.hysteresis
    free = np.ones(refinement.derivatives.shape[0], dtype=bool)
    free[1] = _is_sigma_free(h)
    free[2] = N_BOUNDS[0] * 1.001 < h.n < N_BOUNDS[1] * 0.999
    free[3:] = (np.abs(refinement.omega_start) < 0.999) & (np.abs(refinement.derivatives[3:]).max(axis=1) > 1e-6)
    return free


class _Linearised(NamedTuple):
    """Jacobian of the force by the fitted coefficients, and a root of their covariance."""

    jacobian: FloatArray
    root: FloatArray

    @property
    def covariance(self) -> FloatArray:
        return self.root @ self.root.T


def _linearised(loops: Loops, basis: Basis, refinement: Refinement, free: NDArray[np.bool_]) -> _Linearised:
    """In the coefficients of FE and G and in those of the nonlinear ones that are free."""
    columns = basis.columns(loops.displacement)
    backbone = refinement.backbone
    jacobian = np.hstack(
        [
            columns.elastic,
            refinement.omega[:, None] * columns.amplifier,
            (refinement.derivatives[free] * backbone.G).T,
        ]
    )
    root = np.sqrt(refinement.full_weight)
    misfit = root * backbone.misfit(loops.force, refinement.omega)
    bend = refinement.weight / refinement.full_weight
    held = bend * misfit
    degrees_of_freedom = max(1, misfit.size - jacobian.shape[1])
    within = max(float(np.mean(bend == 1.0)), _LEAST_FREE)
    noise = float(np.sqrt(held @ held / degrees_of_freedom)) / within
    inverse = np.asarray(np.linalg.pinv(triangle_of(jacobian * root[:, None])), np.float64)
    return _Linearised(jacobian, noise * inverse)


def _propagation(basis: Basis, refinement: Refinement, free: NDArray[np.bool_]) -> FloatArray:
    """Derivatives of kE, kA, kappa_omega, rho, sigma, n with respect to the fitted coefficients."""
    elastic, amplified = basis.elastic_matrix(), basis.powers_matrix(basis.amplifier)
    powers = amplified @ refinement.backbone.amplified
    n_E, n_A = elastic.shape[0], amplified.shape[0]
    change = np.zeros((n_E + n_A + 4, n_E + n_A + int(free.sum())))
    change[:n_E, :n_E] = elastic
    # kA = powers/powers[0], kappa_omega = powers[0].
    ratio = (amplified - np.outer(powers / powers[0], amplified[0])) / powers[0]
    ratio[0] = 0.0
    change[n_E : n_E + n_A, n_E : n_E + n_A] = ratio
    change[n_E + n_A, n_E : n_E + n_A] = amplified[0]
    h = refinement.hysteresis
    column = n_E + n_A
    for k, value in enumerate((h.rho, h.sigma, h.n)):
        if free[k]:
            change[n_E + n_A + 1 + k, column] = value
            column += 1
    return change
