"""From fitted coefficients to a spring: physically possible or not, and what to say about it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.parameters import SpringParameters, least_value
from ..kernel.arrays import FloatArray
from .loops import Loops
from .outcomes import IdentificationError, Outcome
from .polynomials import Basis
from .stages import N_BOUNDS, Backbone, Hysteresis, fit_backbone

# |omega| that full strokes must reach for a steady section to exist.
_SATURATED = 0.9
# A bound is reached within this share of it.
_AT_BOUND = 1e-3
# |omega| to either side below which FE and FA can no longer be told apart, and the memory of where the record
# starts does not fade: a huge FA times a tiny omega is not a spring.
_DISTINCT = 0.6


@dataclass(frozen=True, eq=False)
class Solution:
    """What a method found on a set of loops.

    Attributes
    ----------
    basis, backbone, hysteresis : Basis, Backbone, Hysteresis
    omega : ndarray, shape (P,)
    steady_share : float     Where the steady section begins, share of the longest stroke.
    misfit : float           rms [N].
    """

    basis: Basis
    backbone: Backbone
    hysteresis: Hysteresis
    omega: FloatArray
    steady_share: float
    misfit: float


def is_distinct(omega: FloatArray) -> bool:
    """Whether omega swings far enough to both sides for FE and FA to be told apart."""
    return bool(min(omega.max(), -omega.min()) >= _DISTINCT)


def finished(loops: Loops, solution: Solution, where: str) -> tuple[SpringParameters, Solution, list[Outcome]]:
    """A physically possible spring: the degree of FA is lowered until it is positive over the whole range.

    Raises
    ------
    IdentificationError   If even a constant FA is not.
    """
    cautions: list[Outcome] = []
    basis, backbone = solution.basis, solution.backbone
    while not is_positive(basis, backbone):
        fitted = None
        if basis.amplifier > 0:
            basis = replace(basis, amplifier=basis.amplifier - 1)
            fitted = fit_backbone(loops, basis, solution.omega)
        if fitted is None:
            raise IdentificationError(Outcome.BRANCHES_CROSS, where)
        backbone = fitted
        cautions = [Outcome.AMPLIFIER_REDUCED]
    misfit = loops.rms(backbone.misfit(loops.force, solution.omega))
    solution = replace(solution, basis=basis, backbone=backbone, misfit=misfit)
    cautions += cautions_of(loops, solution.hysteresis, solution.omega)
    return spring_of(basis, backbone, solution.hysteresis), solution, cautions


def is_positive(basis: Basis, backbone: Backbone) -> bool:
    """FA > 0 over the range, with a margin of a thousandth of its mean for rounding."""
    powers = tuple(basis.powers(backbone.amplified).tolist())
    least, _ = least_value(powers, -basis.half, basis.half)
    return least > 1e-3 * abs(float(backbone.amplified[0])) and powers[0] > 0.0


def cautions_of(loops: Loops, hysteresis: Hysteresis, omega: FloatArray) -> list[Outcome]:
    """What a user should know about a fit, but for how well it tells sigma."""
    found = []
    full = loops.length[loops.stroke] >= 0.9 * float(loops.length[np.unique(loops.stroke)].max())
    if np.max(np.abs(omega[full])) < _SATURATED:
        found.append(Outcome.NO_STEADY_SECTION)
    if any(abs(hysteresis.n - bound) <= _AT_BOUND * bound for bound in N_BOUNDS):
        found.append(Outcome.N_AT_BOUND)
    return found


def spring_of(basis: Basis, backbone: Backbone, hysteresis: Hysteresis) -> SpringParameters:
    """The spring of a fit whose FA is positive, normalised to FA(x0) = 1 (paper eq. 19)."""
    amplified = basis.powers(backbone.amplified)
    return SpringParameters(
        kE=tuple(basis.powers(backbone.elastic).tolist()),
        kA=(1.0, *(amplified[1:] / amplified[0]).tolist()),
        kappa_omega=float(amplified[0]),
        rho=hysteresis.rho,
        sigma=hysteresis.sigma,
        n=hysteresis.n,
        displacement_offset=basis.offset,
        displacement_min=basis.low,
        displacement_max=basis.high,
    )
