"""Ni's method as a method of `identify`: Ni's model found from a record, written as a spring of this package.

Ni's model r = F2*(F1 + Z) is the modified normalized Bouc-Wen model with FE = F2*F1 and kappa_omega*FA = z0*F2, which
are not polynomials: they are fitted by polynomials over the range of the record.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import RecordError
from ..identification.loops import Loops
from ..identification.outcomes import IdentificationError, Outcome
from ..identification.polynomials import Basis
from ..identification.spring_of_fit import Solution
from ..identification.stages import Backbone, Hysteresis
from ..identification.two_stage import TwoStageOptions
from ..records.record import Record
from .ni import NiParameters
from .ni_method import NiOutcome, ni_method, plausible_start

_DEGREES = (8, 6)  # of the polynomials that stand for Ni's exponential
_SAMPLES = 400  # of the range at which they are fitted
_MILLIMETRE = 1e-3


@dataclass(frozen=True)
class NiOptions:
    """Options of Ni's method.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; (8, 6) if None.
    start : NiParameters or None   Start values; read off the record's secant stiffness and loop area if None.
    """

    degrees: tuple[int, int] | None = None
    start: NiParameters | None = None

    def __post_init__(self) -> None:
        TwoStageOptions(self.degrees)


def ni(record: Record, loops: Loops, options: NiOptions) -> tuple[Solution, list[Outcome]]:
    """Ni's method on one periodic record.

    Raises
    ------
    RecordError           If the record does not hold a whole period.
    IdentificationError   If it is not described by Ni's model about its neutral position.
    """
    x = record.displacement / _MILLIMETRE
    # Ni's model has its neutral position at zero; the middle of the stroke stands for it.
    low, high = loops.reach
    middle = 0.5 * (low + high)
    try:
        start = options.start or plausible_start(x - middle / _MILLIMETRE, record.force)
        result = ni_method(x - middle / _MILLIMETRE, record.force, start, time=record.time)
    except ValueError as problem:
        raise RecordError(f"{record.path}: {problem}") from None
    if result.outcome is NiOutcome.OUT_OF_STEPS:
        raise IdentificationError(Outcome.NOT_CONVERGED, record.path)
    basis = Basis(low, high, *(options.degrees or _DEGREES))
    hysteresis = Hysteresis(result.parameters.rho / _MILLIMETRE, result.parameters.sigma, result.parameters.n)
    backbone = _backbone(result.parameters, basis, loops)
    omega = loops.omega(hysteresis.rho, hysteresis.sigma, hysteresis.n)
    misfit = loops.rms(backbone.misfit(loops.force, omega))
    cautions = [Outcome.NI_MODEL] if result.outcome is NiOutcome.LOCAL_MINIMUM else []
    return Solution(basis, backbone, hysteresis, omega, 0.0, misfit), cautions


def _backbone(p: NiParameters, basis: Basis, loops: Loops) -> Backbone:
    """Polynomials for FE = F2*F1 and G = z0*F2 over the range."""
    grid = basis.offset + basis.half * np.cos(np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
    columns_E, columns_A = basis.columns(grid)
    x = (grid - basis.offset) / _MILLIMETRE
    elastic = np.linalg.lstsq(columns_E, p.amplifier(x) * p.elastic(x), rcond=None)[0].astype(np.float64)
    amplified = np.linalg.lstsq(columns_A, p.z0 * p.amplifier(x), rcond=None)[0].astype(np.float64)
    at_E, at_A = basis.columns(loops.displacement)
    return Backbone(elastic, amplified, at_E @ elastic, at_A @ amplified)
