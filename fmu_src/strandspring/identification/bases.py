"""FE and FA as sums of basis functions whose coefficients say by themselves what a spring may be.

With y = 2(x - low)/(high - low) - 1, FE is a B-spline, written as a constant and increments: the coefficients of a
B-spline bound it, so a constant within the recorded force and increments of 0 or above make an FE that rises from
there. FA is a polynomial in Bernstein's form, which is 0 or above where its coefficients are. Beyond the range FE goes
on along its tangent and FA keeps its end value, as in the saved spring.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.polynomial import polynomial

from ..kernel.arrays import FloatArray

T = TypeVar("T")
# Degree of FE and number of knots within the range, from the simplest on.
ELASTIC = ((1, 0), (2, 0), (3, 0), (4, 0), (5, 0), (3, 3), (3, 6), (3, 10), (3, 21))
AMPLIFIER = (0, 1, 2, 3, 5, 8)  # degree of FA


def step_on(ladder: Sequence[T], place: T, step: int = 1) -> T:
    """What stands so many steps on, or at the end; a place that is none of the ladder stays."""
    return ladder[min(ladder.index(place) + step, len(ladder) - 1)] if place in ladder else place


def fraction(x: FloatArray, low: float, high: float) -> FloatArray:
    """y: the place in the range, -1 to 1."""
    return 2.0 * (x - low) / (high - low) - 1.0


def inner_knots(number: int, y: FloatArray) -> FloatArray:
    """So many equidistant knots, or fewer, so that each interval holds four distinct displacements."""
    distinct = np.unique(np.round(500.0 * y)) / 500.0
    while number > 0:
        ends = np.linspace(-1.0, 1.0, number + 2)
        if np.histogram(distinct, ends)[0].min() >= 4:
            return ends[1:-1]
        number -= 1
    return np.empty(0)


def b_splines(y: FloatArray, degree: int, knots: FloatArray) -> FloatArray:
    """Values of the clamped B-splines on [-1, 1] at y within it, shape (P, degree + knots + 1); de Boor's recursion."""
    t = np.concatenate([[-1.0] * (degree + 1), knots, [1.0] * (degree + 1)])
    intervals = t.size - 1
    at = np.clip(np.searchsorted(t, y, side="right") - 1, degree, intervals - degree - 1)
    values = np.zeros((y.size, intervals))
    values[np.arange(y.size), at] = 1.0
    for p in range(1, degree + 1):
        left, right = t[p:-1] - t[: -p - 1], t[p + 1 :] - t[1:-p]
        with np.errstate(divide="ignore", invalid="ignore"):
            rising = np.where(left > 0.0, (y[:, None] - t[: -p - 1]) / left, 0.0)
            falling = np.where(right > 0.0, (t[p + 1 :] - y[:, None]) / right, 0.0)
        values = rising * values[:, :-1] + falling * values[:, 1:]
    return values


def elastic_columns(y: FloatArray, degree: int, knots: FloatArray) -> FloatArray:
    """Columns of FE: 1, and one for each increment of the coefficients, along tangents beyond the range."""
    within = np.clip(y, -1.0, 1.0)
    values = b_splines(within, degree, knots)
    columns = np.cumsum(values[:, ::-1], axis=1)[:, ::-1]
    # At an end only the increment next to it has a slope.
    first, last = (knots[0], knots[-1]) if knots.size else (1.0, -1.0)
    columns[:, 1] += np.where(y < -1.0, degree / (first + 1.0) * (y - within), 0.0)
    columns[:, -1] += np.where(y > 1.0, degree / (1.0 - last) * (y - within), 0.0)
    return columns


def amplifier_columns(y: FloatArray, degree: int) -> FloatArray:
    """Columns of FA: Bernstein polynomials, shape (P, degree + 1)."""
    return b_splines(np.clip(y, -1.0, 1.0), degree, np.empty(0))


@dataclass(frozen=True, eq=False)
class Shape:
    """FE and FA of a fit as they are saved, over a range [m]."""

    low: float
    high: float
    degree: int  # of FE
    knots: FloatArray
    elastic: FloatArray  # coefficients of its columns [N]

    def elastic_parameters(self) -> dict[str, tuple[float, ...]]:
        """FE as `SpringParameters` takes it: a polynomial of x - offset, or a table of forces."""
        if not self.knots.size:
            y = np.cos(np.pi * (np.arange(self.degree + 1) + 0.5) / (self.degree + 1))
            powers = polynomial.polyfit(y, elastic_columns(y, self.degree, self.knots) @ self.elastic, self.degree)
            return {"kE": tuple((powers / self.half ** np.arange(powers.size)).tolist())}
        # The two knots next to the ends of a table are none of its spline: both polynomials at an end are one.
        inner = self.knots
        while inner.size < 3:
            widest = int(np.argmax(np.diff(np.concatenate([[-1.0], inner, [1.0]]))))
            ends = np.concatenate([[-1.0], inner, [1.0]])
            inner = np.insert(inner, widest, 0.5 * (ends[widest] + ends[widest + 1]))
        y = np.concatenate([[-1.0, 0.5 * (inner[0] - 1.0)], inner, [0.5 * (inner[-1] + 1.0), 1.0]])
        forces = elastic_columns(y, self.degree, self.knots) @ self.elastic
        places = [self.low, *(0.5 * (self.low + self.high) + self.half * y[1:-1]).tolist(), self.high]
        return {"FE_knots": tuple(places), "FE_forces": tuple(forces.tolist())}

    @property
    def half(self) -> float:
        """Half the range [m]."""
        return 0.5 * (self.high - self.low)

    def amplifier_parameters(self, coefficients: FloatArray) -> dict[str, Any]:
        """kappa_omega [N] and kA of an FA, 1 in the middle of the range."""
        degree = coefficients.size - 1
        y = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        powers = polynomial.polyfit(y, amplifier_columns(y, degree) @ coefficients, degree)
        kappa = float(powers[0])
        return {"kappa_omega": kappa, "kA": tuple((powers / kappa / self.half ** np.arange(degree + 1)).tolist())}
