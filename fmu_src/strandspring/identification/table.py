"""FE by its forces at knots, for shapes that no polynomial follows; FA stays a polynomial.

The spline is linear in the forces, so that they are fitted by linear least squares, as coefficients of polynomials are.
Every interval needs points: forces that no point depends on are not determined.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline

from ..kernel.arrays import FloatArray
from .polynomials import Basis, Columns


@dataclass(frozen=True)
class TableBasis(Basis):
    """Cardinal splines of knots equally far apart from `low` to `high`: the k-th is 1 at knot k and 0 at the others.

    Parameters
    ----------
    low, high : float    Identified range of displacement [m].
    elastic : int        Number of intervals, 6 to 24; there is one more coefficient of FE, its force at each knot [N].
    amplifier : int      Degree M of FA.
    """

    _splines: CubicSpline = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Not-a-knot, as core.spline.
        splines = CubicSpline(self.knots, np.eye(self.elastic + 1), bc_type="not-a-knot")
        object.__setattr__(self, "_splines", splines)

    @property
    def knots(self) -> FloatArray:
        """Displacements, shape (elastic + 1,) [m]."""
        return np.linspace(self.low, self.high, self.elastic + 1)

    def columns(self, displacement: FloatArray, further: FloatArray | None = None) -> Columns:
        """Values of the basis functions at each displacement; further columns go with those of FE."""
        amplifier = Basis(self.low, self.high, 0, self.amplifier).columns(displacement).amplifier
        elastic = np.asarray(self._splines(displacement), np.float64)
        return Columns(elastic if further is None else np.hstack([elastic, further]), amplifier)

    def slopes(
        self, displacement: FloatArray, elastic: FloatArray, amplified: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Slopes [N/m] at each displacement of FE and G."""
        of_elastic = np.asarray(self._splines(displacement, 1) @ elastic, np.float64)
        _, of_amplified = super().slopes(displacement, np.zeros(1), amplified)
        return of_elastic, of_amplified

    @property
    def elastic_name(self) -> str:
        """Name of the parameters of FE that the coefficients give."""
        return "FE_forces"

    def elastic_parameters(self, coefficients: FloatArray) -> dict[str, tuple[float, ...]]:
        """FE as `SpringParameters` takes it."""
        return {"kE": (), "FE_knots": tuple(self.knots.tolist()), "FE_forces": tuple(coefficients.tolist())}

    def elastic_matrix(self) -> FloatArray:
        """What turns the coefficients of FE into its parameters."""
        return np.eye(self.elastic + 1)
