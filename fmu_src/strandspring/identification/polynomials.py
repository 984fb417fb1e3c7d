"""FE and FA as Legendre series over the identified range, where least squares is well conditioned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from ..kernel.arrays import FloatArray


@dataclass(frozen=True)
class Basis:
    """Legendre polynomials of x/half, |x| <= half, x = displacement - offset.

    Parameters
    ----------
    low, high : float      Identified range of displacement [m].
    elastic, amplifier : int   Degrees N of FE and M of FA.
    """

    low: float
    high: float
    elastic: int
    amplifier: int

    @property
    def offset(self) -> float:
        """Mid-stroke x0, where FA = 1 [m]."""
        return 0.5 * (self.low + self.high)

    @property
    def half(self) -> float:
        """Half the range [m]."""
        return 0.5 * (self.high - self.low)

    def columns(self, displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Values of the basis functions of FE and of FA at each displacement, shapes (P, N + 1) and (P, M + 1)."""
        z = (displacement - self.offset) / self.half
        values = legendre.legvander(z, max(self.elastic, self.amplifier)).astype(np.float64)
        return values[:, : self.elastic + 1], values[:, : self.amplifier + 1]

    def powers(self, coefficients: FloatArray) -> FloatArray:
        """Coefficients of powers of x [1/m^i] from those of the Legendre series."""
        scaled = legendre.leg2poly(coefficients)
        return np.asarray(scaled / self.half ** np.arange(scaled.size))
