"""FE and FA as Legendre series over the identified range, where least squares is well conditioned."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from ...kernel.arrays import FloatArray


class Columns(NamedTuple):
    """Basis functions of FE and of FA at P displacements, shapes (P, N + 1) and (P, M + 1)."""

    elastic: FloatArray
    amplifier: FloatArray


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

    def columns(self, displacement: FloatArray, further: FloatArray | None = None) -> Columns:
        """Values of the basis functions at each displacement; further columns go with those of FE."""
        values = self._polynomials(displacement, max(self.elastic, self.amplifier))
        elastic = values[:, : self.elastic + 1]
        return Columns(elastic if further is None else np.hstack([elastic, further]), values[:, : self.amplifier + 1])

    def slopes(
        self, displacement: FloatArray, elastic: FloatArray, amplified: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Slopes [N/m] at each displacement of two series of force, FE and G."""
        values = self._polynomials(displacement, max(elastic.size, amplified.size) - 1)
        of_elastic, of_amplified = (
            values[:, : series.size] @ (_slope_of_series(series.size - 1) @ series / self.half)
            for series in (elastic, amplified)
        )
        return of_elastic, of_amplified

    def _polynomials(self, displacement: FloatArray, degree: int) -> FloatArray:
        """Legendre polynomials up to a degree at each displacement, shape (P, degree + 1)."""
        return np.asarray(legendre.legvander((displacement - self.offset) / self.half, degree), np.float64)

    def powers(self, coefficients: FloatArray) -> FloatArray:
        """Coefficients of powers of x [1/m^i] from those of the Legendre series."""
        return _powers_of_series(coefficients.size - 1) @ coefficients / self.half ** np.arange(coefficients.size)

    @property
    def elastic_name(self) -> str:
        """Name of the parameters of FE that the coefficients give."""
        return "kE"

    def elastic_parameters(self, coefficients: FloatArray) -> dict[str, tuple[float, ...]]:
        """FE as `SpringParameters` takes it."""
        return {"kE": tuple(self.powers(coefficients).tolist())}

    def elastic_matrix(self) -> FloatArray:
        """What turns the coefficients of FE into its parameters."""
        return self.powers_matrix(self.elastic)

    def powers_matrix(self, degree: int) -> FloatArray:
        """What turns coefficients of a Legendre series into those of powers of x, shape (degree + 1, degree + 1)."""
        return np.asarray(_powers_of_series(degree) / self.half ** np.arange(degree + 1)[:, None])


@lru_cache(maxsize=32)
def _powers_of_series(degree: int) -> FloatArray:
    """Coefficients of the powers in each Legendre polynomial, one to a column."""
    matrix = np.zeros((degree + 1, degree + 1))
    for k, row in enumerate(np.eye(degree + 1)):
        series = legendre.leg2poly(row)
        matrix[: series.size, k] = series
    return matrix


@lru_cache(maxsize=32)
def _slope_of_series(degree: int) -> FloatArray:
    """The Legendre series of the slope of each Legendre polynomial, one to a column."""
    matrix = np.zeros((degree + 1, degree + 1))
    matrix[:degree] = legendre.legder(np.eye(degree + 1))[:degree]
    return matrix
