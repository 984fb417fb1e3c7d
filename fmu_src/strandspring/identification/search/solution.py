"""From the solution of a method to a spring: whether it is physically possible, and what to caution."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.branches import MaxwellBranch, Mechanism
from ...core.parameters import SpringParameters
from ...core.polynomials import least_value
from ...kernel.arrays import FloatArray
from ...kernel.saturation_table import table
from ...model.outcomes import IdentificationError, Outcome
from ..least_squares.projection import RHO_BOUNDS
from ..least_squares.stages import N_BOUNDS, Backbone, Hysteresis
from ..points.polynomials import Basis
from ..points.sample_points import SamplePoints

# |omega| that full strokes must reach for a steady section to exist.
_SATURATED = 0.9
_STEADY = 0.98  # omega from which the hysteresis counts as steady
# A bound is reached within this share of it.
_AT_BOUND = 1e-3
# |omega| to either side below which FE and FA are strongly correlated, and the memory of where the record starts does
# not fade: a huge FA times a tiny omega is not a spring.
_DISTINCT = 0.6


@dataclass(frozen=True, eq=False)
class Solution:
    """Solution of a method on a set of loops.

    Attributes
    ----------
    basis, backbone, hysteresis : Basis, Backbone, Hysteresis
    omega : ndarray, shape (P,)
    steady_share : float     Where the steady section begins, share of the longest stroke.
    """

    basis: Basis
    backbone: Backbone
    hysteresis: Hysteresis
    omega: FloatArray
    steady_share: float


def saturation_distance(n: float, sigma: float) -> float:
    """rho times the travel from a reversal in saturation to the steady section."""
    steady, reversed_ = table(n, sigma, coarse=True).inverse(np.array([_STEADY, -1.0])).tolist()
    return float(steady - reversed_)


def saturation_share(loops: SamplePoints, hysteresis: Hysteresis) -> float:
    """Where the steady section begins, share of the longest stroke."""
    return saturation_distance(hysteresis.n, hysteresis.sigma) / (hysteresis.rho * loops.longest)


def is_distinct(omega: FloatArray) -> NDArray[np.bool_]:
    """Whether omega, along its last axis, swings far enough to both sides for FE and FA to be separated."""
    return np.asarray(np.minimum(omega.max(axis=-1), -omega.min(axis=-1)) >= _DISTINCT)


def least_points(basis: Basis, records: int) -> int:
    """Number of points without which a fit leaves nothing to judge it by: one more than it has parameters."""
    return basis.elastic + basis.amplifier + 2 + 3 + records + 1


def refuse_too_few(loops: SamplePoints, basis: Basis, where: str) -> None:
    """Raise IdentificationError if there are no more points than parameters."""
    least = least_points(basis, int(loops.record[-1]) + 1)
    if loops.force.size < least:
        detail = f" Found {loops.force.size} samples after the first stroke; {least} are needed at least."
        raise IdentificationError(Outcome.TOO_FEW_SAMPLES, where, detail)


def is_positive(basis: Basis, backbone: Backbone) -> bool:
    """FA > 0 over the range, with a margin of a thousandth of its mean for rounding."""
    powers = tuple(basis.powers(backbone.amplified).tolist())
    least, _ = least_value(powers, -basis.half, basis.half)
    return least > 1e-3 * abs(float(backbone.amplified[0])) and powers[0] > 0.0


def cautions_of(loops: SamplePoints, hysteresis: Hysteresis, omega: FloatArray) -> list[Outcome]:
    """Cautions about the saturation and the knee of the loop."""
    cautions = []
    full = loops.length[loops.stroke] >= 0.9 * loops.longest
    reaches_bound = hysteresis.rho * loops.length.max() < 1.01 * RHO_BOUNDS[0]
    if reaches_bound or np.max(np.abs(omega[full])) < _SATURATED:
        cautions.append(Outcome.NO_STEADY_SECTION)
    if any(abs(hysteresis.n - bound) <= _AT_BOUND * bound for bound in N_BOUNDS):
        cautions.append(Outcome.N_AT_BOUND)
    return cautions


def spring_of(
    basis: Basis,
    backbone: Backbone,
    hysteresis: Hysteresis,
    where: str,
    second: Mechanism | None = None,
    branches: tuple[MaxwellBranch, ...] = (),
) -> SpringParameters:
    """The spring of a fit whose FA is positive, normalised to FA(x0) = 1 (paper eq. 19).

    Parameters
    ----------
    basis, backbone, hysteresis : Basis, Backbone, Hysteresis   The fit.
    where : str          Names of the records, for messages.
    second, branches     What a wider class has.

    Raises
    ------
    IdentificationError  If its parameters are beyond the limits of a spring.
    """
    amplified = basis.powers(backbone.amplified)
    return spring_within_limits(
        where,
        **basis.elastic_parameters(backbone.elastic),
        kA=(1.0, *(amplified[1:] / amplified[0]).tolist()),
        kappa_omega=float(amplified[0]),
        rho=hysteresis.rho,
        sigma=hysteresis.sigma,
        n=hysteresis.n,
        displacement_offset=basis.offset,
        displacement_min=basis.low,
        displacement_max=basis.high,
        second=second,
        branches=branches,
    )


def spring_within_limits(where: str, **parameters: Any) -> SpringParameters:
    """A spring, or IdentificationError if its parameters are beyond the limits of a spring."""
    try:
        return SpringParameters(**parameters)
    except ValueError as problem:
        raise IdentificationError(Outcome.BEYOND_LIMITS, where, f" ({str(problem).rstrip('.')})") from None
