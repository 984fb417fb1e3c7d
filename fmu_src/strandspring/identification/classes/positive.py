"""Least squares whose amplifiers are positive over the range and whose stiffnesses are not negative.

Polynomials of degree two that are positive on [-1, 1] are sums of squares (x - s)^2, |s| <= 1, and of 1 - x^2, with
coefficients that are not negative; here of those with s at five places, each a little above zero everywhere. Those of
degree four are sums of products of two of these. Where the solution without bounds is not possible, non-negative least
squares in these finds the nearest that is (Lawson and Hanson, Solving Least Squares Problems, 1974, ch. 23).
"""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations_with_replacement

import numpy as np
from numpy.polynomial import legendre, polynomial

from ...kernel.arrays import FloatArray

_PLACES = np.linspace(-1.0, 1.0, 5)
_ABOVE = 0.005  # least value of a square over its mean
_GRID = np.linspace(-1.0, 1.0, 129)
_MARGIN = 1.5e-3  # least value in the mean of a positive series
_ROUNDS = 60  # of exchanging columns
_TINY = 1e-12  # of a gradient, share of the longest target


@lru_cache(maxsize=8)
def positive_rays(degree: int) -> FloatArray:
    """Legendre series whose sums with coefficients >= 0 are positive amplifiers, shape (degree + 1, rays)."""
    if degree == 0:
        return np.ones((1, 1))
    if degree == 1:
        return np.array([[1.0 + _ABOVE, 1.0 + _ABOVE], [1.0, -1.0]])
    rays = [*([s**2, -2.0 * s, 1.0] for s in _PLACES.tolist()), [1.0, 0.0, -1.0]]
    if degree > 2:
        rays += [polynomial.polymul(a, b).tolist() for a, b in combinations_with_replacement(rays, 2)]
    raised = np.zeros((degree + 1, len(rays)))
    for column, ray in zip(raised.T, rays, strict=True):
        column[: len(ray)] = legendre.poly2leg(ray)[: degree + 1]
    raised[0] += _ABOVE
    return raised[:, np.abs(raised).max(axis=0) > 0.0]


def is_positive_series(series: FloatArray) -> bool:
    """Whether a Legendre series is positive on [-1, 1], with a margin for rounding."""
    return bool(legendre.legval(_GRID, series).min() > _MARGIN * abs(float(series[0])))


def non_negative(matrix: FloatArray, target: FloatArray) -> FloatArray:
    """The x >= 0 with the least |matrix*x - target|, shape (k,).

    Parameters
    ----------
    matrix : ndarray, shape (m, k)
    target : ndarray, shape (m,)
    """
    scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
    unit = matrix / scale
    x = np.zeros(unit.shape[1])
    free = np.zeros(x.size, dtype=bool)
    least = _TINY * max(float(np.linalg.norm(target)), 1e-300)
    for _ in range(_ROUNDS):
        gradient = unit.T @ (target - unit @ x)
        gradient[free] = -np.inf
        if gradient.max() <= least:
            break
        free[np.argmax(gradient)] = True
        while True:
            step = np.zeros(x.size)
            step[free] = np.linalg.lstsq(unit[:, free], target, rcond=1e-12)[0]
            if (step[free] > 0.0).all():
                break
            falling = free & (step <= 0.0)
            share = np.min(x[falling] / np.maximum(x[falling] - step[falling], 1e-300))
            x = x + share * (step - x)
            free &= x > 1e-15 * x.max(initial=0.0)
            x[~free] = 0.0
            if not free.any():
                break
        x = step if free.any() else x
    return np.asarray(x / scale)
