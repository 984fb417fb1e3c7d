"""What all classes of models that are compared have in common.

Each class predicts a force

    r = FE(x) + sum of c_k * H_k(path; shape),

FE a polynomial of degree N, in which the coefficients of FE and the c_k are linear. A class is its shape parameters
with their bounds, and the columns H_k.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...identification.points.polynomials import Basis
from ...kernel.arrays import FloatArray
from .track import Track

# Bounds of the knee of a stroke: the inverse of the length over which the force saturates, in half ranges.
KNEE = (0.3, 300.0)


@dataclass(frozen=True)
class Shape:
    """One shape parameter; it is searched on the scale given, uniformly at the start.

    Parameters
    ----------
    name : str
    low, high : float   Bounds.
    logarithmic : bool
    """

    name: str
    low: float
    high: float
    logarithmic: bool = True

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds on the scale of the search."""
        return (float(np.log(self.low)), float(np.log(self.high))) if self.logarithmic else (self.low, self.high)

    def value(self, searched: float) -> float:
        """The parameter at a point of the search."""
        return float(np.exp(searched)) if self.logarithmic else searched


class Rival(ABC):
    """One class of models; it holds nothing but its description.

    Attributes
    ----------
    name, title : str            Identifier, and name with its source.
    memory : tuple of Shape      The shape parameters but those of the polynomial factor, lengths in half ranges.
    has_amplifier : bool         Whether its hysteretic part has a polynomial factor, of degree M.
    is_nonnegative : bool        Whether the c_k must not be negative. The coefficients of the factor are then shape
                                 parameters, otherwise they are the c_k.
    needs_time : bool            Whether it depends on the rate.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    memory: ClassVar[tuple[Shape, ...]]
    has_amplifier: ClassVar[bool] = False
    is_nonnegative: ClassVar[bool] = True
    needs_time: ClassVar[bool] = False

    @abstractmethod
    def columns(self, track: Track, basis: Basis, values: FloatArray) -> FloatArray:
        """H_k at the points of a track for values of the shape parameters, shape (P, L)."""

    def shapes(self, basis: Basis) -> tuple[Shape, ...]:
        """All shape parameters."""
        factors = basis.amplifier if self.has_amplifier and self.is_nonnegative else 0
        return self.memory + tuple(Shape(f"amplifier {k + 1}", -0.9, 0.9, False) for k in range(factors))

    def dissipates(self, basis: Basis, values: FloatArray, coefficients: FloatArray) -> bool:
        """Whether the polynomial factor is positive over the range, with a margin for rounding."""
        if not self.has_amplifier:
            return True
        series = np.append(1.0, values[len(self.memory) :]) if self.is_nonnegative else coefficients
        grid = basis.offset + basis.half * np.linspace(-1.0, 1.0, 201)
        return bool(np.min(basis.columns(grid).amplifier @ series) > 1e-3 * abs(float(series[0])))
