"""Ni's method as a method of `identify`: Ni's model identified from a record and written as a spring of this package.

Ni's model r = F2*(F1 + Z) is the modified normalized Bouc-Wen model with FE = F2*F1 and kappa_omega*FA = z0*F2, which
are not polynomials: they are fitted by polynomials over the range of the record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..errors import RecordError
from ..identification.least_squares.stages import Backbone, Hysteresis
from ..identification.methods.fitted import Fitted, fitted
from ..identification.methods.method import Method
from ..identification.points.polynomials import Basis
from ..identification.points.sample_points import SamplePoints
from ..identification.points.steady_part import SteadyRecord
from ..identification.search.solution import Solution
from ..model.outcomes import IdentificationError, Outcome
from .ni import NiParameters
from .ni_method import NiOutcome, ni_method, plausible_start

_DEGREES = (8, 6)  # of the polynomials that stand for Ni's exponential
_SAMPLES = 400  # of the range at which they are fitted
_MILLIMETRE = 1e-3


@dataclass(frozen=True)
class NiOptions(Method):
    """Options of Ni's method.

    Parameters
    ----------
    degrees : (int, int) or None   Degrees N of FE and M of FA; (8, 6) if None.
    start : NiParameters or None   Start values; read off the record's secant stiffness and loop area if None.
    """

    name: ClassVar[str] = "ni"

    start: NiParameters | None = None

    def fit(self, parts: Sequence[SteadyRecord], where: str) -> Fitted:
        """Ni's method on one periodic record.

        Raises
        ------
        RecordError           If there are several records, or the record does not hold a whole period.
        IdentificationError   If it is not described by Ni's model about its neutral position.
        """
        if len(parts) > 1:
            raise RecordError(f"{where}: Ni's method takes one periodic record; give one, or use another method.")
        record, loops = parts[0].record, parts[0].loops
        if record.compared is not None:
            raise RecordError(
                f"{where}: Ni's method takes whole periods; select no range of displacement, or use another method."
            )
        # Ni's model has its neutral position at zero; the middle of the stroke stands for it.
        low, high = loops.reach
        x = record.displacement / _MILLIMETRE - 0.5 * (low + high) / _MILLIMETRE
        try:
            start = self.start or plausible_start(x, record.force)
            result = ni_method(x, record.force, start, time=record.time)
        except ValueError as problem:
            raise RecordError(f"{where}: {problem}") from None
        if result.outcome is NiOutcome.OUT_OF_STEPS:
            raise IdentificationError(Outcome.NOT_CONVERGED, where)
        p = result.parameters
        basis = Basis(low, high, *(self.degrees or _DEGREES))
        hysteresis = Hysteresis(p.rho / _MILLIMETRE, p.sigma, p.n)
        backbone = _backbone(p, basis, loops)
        omega = loops.omega(hysteresis.rho, hysteresis.sigma, hysteresis.n)
        cautions = [Outcome.NI_MODEL] if result.outcome is NiOutcome.LOCAL_MINIMUM else []
        return fitted(loops, Solution(basis, backbone, hysteresis, omega, 0.0), where, cautions)


def _backbone(p: NiParameters, basis: Basis, loops: SamplePoints) -> Backbone:
    """Polynomials for FE = F2*F1 and G = z0*F2 over the range."""
    grid = basis.offset + basis.half * np.cos(np.pi * (np.arange(_SAMPLES) + 0.5) / _SAMPLES)
    columns_E, columns_A = basis.columns(grid)
    x = (grid - basis.offset) / _MILLIMETRE
    elastic = np.linalg.lstsq(columns_E, p.amplifier(x) * p.elastic(x), rcond=None)[0]
    amplified = np.linalg.lstsq(columns_A, p.z0 * p.amplifier(x), rcond=None)[0]
    return Backbone.from_coefficients(np.concatenate([elastic, amplified]), basis.columns(loops.displacement))
