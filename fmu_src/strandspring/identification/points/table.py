"""FE by its forces at knots, for shapes that no polynomial follows; FA stays a polynomial.

The spline is linear in the forces, so that they are fitted by linear least squares, as coefficients of polynomials are.
Every interval needs points at two displacements or more: forces that no point depends on are not determined, and many
points at the same few displacements say no more than one at each.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...core.parameters import LEAST_SPACING
from ...core.spline import pieces
from ...kernel.arrays import FloatArray
from .polynomials import Basis, Columns

_LEAST_PLACES = 2  # displacements in each interval


@dataclass(frozen=True)
class TableBasis(Basis):
    """Cardinal splines of knots equally far apart from `low` to `high`: the k-th is 1 at knot k and 0 at the others.

    Parameters
    ----------
    low, high : float    Identified range of displacement [m].
    elastic : int        Number of intervals, 6 to 24; there is one more coefficient of FE, its force at each knot [N].
    amplifier : int      Degree M of FA.
    """

    @property
    def knots(self) -> FloatArray:
        """Displacements, shape (elastic + 1,) [m]."""
        return np.linspace(self.low, self.high, self.elastic + 1)

    def is_determined(self, displacement: FloatArray) -> bool:
        """Whether points at these displacements [m] lie at enough distinct ones in each interval."""
        cells = np.unique((displacement - self.low) / (LEAST_SPACING * (self.high - self.low)) // 1.0)
        distinct = [cells[0]]
        for cell in cells:
            if cell > distinct[-1] + 1.0:  # in the next cell it may be the same place with noise
                distinct.append(cell)
        counts, _ = np.histogram(distinct, self.elastic, (0.0, 1.0 / LEAST_SPACING))
        return bool(counts.min() >= _LEAST_PLACES)

    def columns(self, displacement: FloatArray, further: FloatArray | None = None) -> Columns:
        """Values of the basis functions at each displacement; further columns go with those of FE."""
        amplifier = Basis(self.low, self.high, 0, self.amplifier).columns(displacement).amplifier
        elastic = self._splines(displacement, 0)
        return Columns(elastic if further is None else np.hstack([elastic, further]), amplifier)

    def slopes(
        self, displacement: FloatArray, elastic: FloatArray, amplified: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Slopes [N/m] at each displacement of FE and G."""
        of_elastic = np.asarray(self._splines(displacement, 1) @ elastic)
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

    def _splines(self, displacement: FloatArray, derivative: int) -> FloatArray:
        """Values or first derivatives of the cardinal splines at each displacement, shape (P, elastic + 1)."""
        width = (self.high - self.low) / self.elastic
        place = (displacement - self.low) / width
        interval = np.clip(place.astype(np.intp), 0, self.elastic - 1)
        powers = np.arange(derivative, 4)
        t = (place - interval)[:, None] ** (powers - derivative)
        factors = powers**derivative / width**derivative
        return np.asarray(np.einsum("pj,pjk->pk", t * factors, _cardinal_cubics(self.elastic)[interval, derivative:]))


@lru_cache(maxsize=32)
def _cardinal_cubics(intervals: int) -> FloatArray:
    """Cardinal splines of knots 0 .. intervals, by powers, on each interval, shape (intervals, 4, intervals + 1)."""
    knots = range(intervals + 1)
    return np.array(
        [[piece.force for piece in pieces(knots, unit)] for unit in np.eye(intervals + 1).tolist()]
    ).transpose(1, 2, 0)
