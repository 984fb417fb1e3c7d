"""From the solution of a method to a spring: whether it is physically possible, and what to caution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import SpringParameters, least_value
from ...kernel.arrays import FloatArray
from ...kernel.saturation_table import table
from ..certainty.uncertainty import is_sigma_uncertain
from ..least_squares.projection import RHO_BOUNDS, Problem
from ..least_squares.stages import N_BOUNDS, Backbone, Hysteresis, fit_backbone
from ..method import Fitted
from ..outcomes import IdentificationError, Outcome
from ..points.loops import Loops
from ..points.polynomials import Basis

# |omega| that full strokes must reach for a steady section to exist.
_SATURATED = 0.9
_FULL = 0.9  # share of the longest stroke from which a stroke counts as a full one
_DRIFT = 0.05  # change of a stroke's mean force over the record that is called drift, share of the rms force
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


def saturation_share(loops: Loops, hysteresis: Hysteresis) -> float:
    """Where the steady section begins, share of the longest stroke."""
    return saturation_distance(hysteresis.n, hysteresis.sigma) / (hysteresis.rho * loops.longest)


def is_distinct(omega: FloatArray) -> NDArray[np.bool_]:
    """Whether omega, along its last axis, swings far enough to both sides for FE and FA to be separated."""
    return np.asarray(np.minimum(omega.max(axis=-1), -omega.min(axis=-1)) >= _DISTINCT)


def fitted(loops: Loops, solution: Solution | None, where: str, cautions: Sequence[Outcome] = ()) -> Fitted:
    """The spring of a solution: the degree of FA is lowered until it is positive over the whole range.

    Parameters
    ----------
    loops : Loops
    solution : Solution or None
    where : str                     Names of the records, for messages.
    cautions : sequence of Outcome  Further cautions of the method.

    Raises
    ------
    IdentificationError   If there is no solution, it has as many parameters as there are points, or even a constant FA
                          is not positive.
    """
    if solution is None:
        raise IdentificationError(Outcome.NO_STEADY_SECTION, where)
    basis, backbone, hysteresis = solution.basis, solution.backbone, solution.hysteresis
    refuse_too_few(loops, basis, where)
    reduced = []
    while not is_positive(basis, backbone):
        again = None
        if basis.amplifier > 0:
            basis = replace(basis, amplifier=basis.amplifier - 1)
            again = fit_backbone(loops, basis.columns(loops.displacement), solution.omega)
        if again is None:
            raise IdentificationError(Outcome.BRANCHES_CROSS, where)
        backbone, reduced = again, [Outcome.AMPLIFIER_REDUCED]
    all_cautions = [*reduced, *cautions_of(loops, hysteresis, solution.omega), *cautions]
    if drifts(loops):
        all_cautions.append(Outcome.DRIFT)
    refinement = Problem(loops, basis, hysteresis).linearised(hysteresis, backbone)
    if is_sigma_uncertain(loops, basis, refinement):
        all_cautions.append(Outcome.SIGMA_AT_BOUND)
    return Fitted(spring_of(basis, backbone, hysteresis, where), dict.fromkeys(all_cautions, ""), solution.steady_share)


def least_points(basis: Basis, records: int) -> int:
    """Number of points without which a fit leaves nothing to judge it by: one more than it has parameters."""
    return basis.elastic + basis.amplifier + 2 + 3 + records + 1


def refuse_too_few(loops: Loops, basis: Basis, where: str) -> None:
    """Raise IdentificationError if there are no more points than parameters."""
    least = least_points(basis, int(loops.record[-1]) + 1)
    if loops.force.size < least:
        detail = f" Found {loops.force.size} samples after the first stroke; {least} are needed at least."
        raise IdentificationError(Outcome.TOO_FEW_SAMPLES, where, detail)


def drifts(loops: Loops) -> bool:
    """Whether the mean force of the full strokes of a kind changes from the first to the last of a record."""
    used, first, samples = np.unique(loops.stroke, return_index=True, return_counts=True)
    spread = loops.force_deviation
    full = {
        int(stroke): _mean(loops.travel[at : at + n], loops.force[at : at + n])
        for stroke, at, n in zip(used, first, samples, strict=True)
        if n > 1 and loops.length[stroke] >= _FULL * loops.longest
    }
    for record, side in product(range(int(loops.record.max()) + 1), (1, -1)):
        means = [mean for k, mean in full.items() if loops.record[k] == record and loops.direction[k] == side]
        if len(means) >= 3:
            slope = np.polyfit(np.arange(len(means)), means, 1)[0]
            if abs(slope) * (len(means) - 1) > _DRIFT * spread:
                return True
    return False


def _mean(travel: FloatArray, force: FloatArray) -> float:
    """Mean of the force over the travel [N]."""
    return float(np.trapezoid(force, travel)) / float(travel[-1] - travel[0])


def is_positive(basis: Basis, backbone: Backbone) -> bool:
    """FA > 0 over the range, with a margin of a thousandth of its mean for rounding."""
    powers = tuple(basis.powers(backbone.amplified).tolist())
    least, _ = least_value(powers, -basis.half, basis.half)
    return least > 1e-3 * abs(float(backbone.amplified[0])) and powers[0] > 0.0


def cautions_of(loops: Loops, hysteresis: Hysteresis, omega: FloatArray) -> list[Outcome]:
    """Cautions about the saturation and the knee of the loop."""
    cautions = []
    full = loops.length[loops.stroke] >= 0.9 * loops.longest
    reaches_bound = hysteresis.rho * loops.length.max() < 1.01 * RHO_BOUNDS[0]
    if reaches_bound or np.max(np.abs(omega[full])) < _SATURATED:
        cautions.append(Outcome.NO_STEADY_SECTION)
    if any(abs(hysteresis.n - bound) <= _AT_BOUND * bound for bound in N_BOUNDS):
        cautions.append(Outcome.N_AT_BOUND)
    return cautions


def spring_of(basis: Basis, backbone: Backbone, hysteresis: Hysteresis, where: str) -> SpringParameters:
    """The spring of a fit whose FA is positive, normalised to FA(x0) = 1 (paper eq. 19).

    Parameters
    ----------
    basis, backbone, hysteresis : Basis, Backbone, Hysteresis   The fit.
    where : str          Names of the records, for messages.

    Raises
    ------
    IdentificationError  If its parameters are beyond the limits of a spring.
    """
    amplified = basis.powers(backbone.amplified)
    try:
        return SpringParameters(
            **basis.elastic_parameters(backbone.elastic),
            kA=(1.0, *(amplified[1:] / amplified[0]).tolist()),
            kappa_omega=float(amplified[0]),
            rho=hysteresis.rho,
            sigma=hysteresis.sigma,
            n=hysteresis.n,
            displacement_offset=basis.offset,
            displacement_min=basis.low,
            displacement_max=basis.high,
        )
    except ValueError as problem:
        raise IdentificationError(Outcome.BEYOND_LIMITS, where, f" ({str(problem).rstrip('.')})") from None
