"""Polynomials by ascending powers."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

_MOST_HALVINGS = 1200  # of a range of 1e6 m down to the least double, however the host rounds


def polynomial(coefficients: Sequence[float], x: float) -> float:
    """Sum of coefficients[i]*x**i by Horner's rule."""
    total = 0.0
    for coefficient in reversed(coefficients):
        total = total * x + coefficient
    return total


def derivative(coefficients: tuple[float, ...]) -> tuple[float, ...]:
    """Coefficients of the derivative of a polynomial given by ascending powers."""
    return tuple(i * c for i, c in enumerate(coefficients))[1:] or (0.0,)


def antiderivative(coefficients: tuple[float, ...]) -> tuple[float, ...]:
    """Coefficients of the antiderivative that is zero at x = 0."""
    return (0.0, *(c / (i + 1) for i, c in enumerate(coefficients)))


def least_value(coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float]:
    """Least value of a polynomial on [low, high] and where it is taken; NaN if a coefficient is.

    Exact up to rounding: the interval is cut at the real roots of the derivative, found by bisection between
    the roots of the next derivative, where each derivative is monotone.
    """
    candidates = [low, *_roots(derivative(coefficients), low, high), high]
    return min((polynomial(coefficients, x), x) for x in candidates)


def _roots(coefficients: tuple[float, ...], low: float, high: float) -> list[float]:
    """Real roots inside (low, high) at which the polynomial changes sign."""
    if len(coefficients) < 2:
        return []
    corners = [low, *_roots(derivative(coefficients), low, high), high]
    roots = []
    for left, right in pairwise(corners):
        at_left, at_right = polynomial(coefficients, left), polynomial(coefficients, right)
        # Not the sign of the product, which may underflow.
        if at_left == 0.0 or at_right == 0.0 or (at_left > 0.0) == (at_right > 0.0):
            continue
        a, b = left, right
        for _ in range(_MOST_HALVINGS):
            middle = 0.5 * (a + b)
            if not a < middle < b:
                break
            value = polynomial(coefficients, middle)
            if value != 0.0 and (value > 0.0) == (at_left > 0.0):
                a = middle
            else:
                b = middle
        roots.append(a)
    return roots
