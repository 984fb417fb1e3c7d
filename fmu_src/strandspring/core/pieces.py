"""W cut into pieces for the integrals that the spring's work needs.

With z = |xi|, |W| is within 1e-13 a polynomial of degree 11 on a piece, so that Gauss's rule of 10 points integrates
its product with FA, of degree 8.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

from .saturation import Saturation, saturation, xi_of_abscissa

# Nodes and weights of Gauss-Legendre's rule on [-1, 1], exact for degree 19.
_GAUSS_10 = tuple(
    (sign * node, weight)
    for node, weight in (
        (0.14887433898163121, 0.29552422471475287),
        (0.43339539412924719, 0.26926671930999636),
        (0.67940956829902441, 0.21908636251598204),
        (0.86506336668898451, 0.14945134915058059),
        (0.97390652851717172, 0.066671344308688138),
    )
    for sign in (-1.0, 1.0)
)
# Width of a piece in t = ln(expm1(n*xi)): z = 0, where W may have a cusp, is 4.5 half widths away at least.
_WIDTH = 0.45
# The branches are cut into pieces down to this z; below it the work is less than sigma*1e-16*kappa_omega/rho.
_FINEST = 1e-8


class Pieces(NamedTuple):
    """One branch of W.

    Attributes
    ----------
    edges : list of float   z at the ends of the pieces, from 0 on.
    weight : callable       |W| at z.
    """

    edges: list[float]
    weight: Callable[[float], float]

    def integral(self, a: float, b: float, factor: Callable[[float], float]) -> float:
        """Integral of |W|*factor from a to b, both functions of z."""
        inner = self.edges[bisect_right(self.edges, a) : bisect_left(self.edges, b)]
        total = 0.0
        for low, high in pairwise((a, *inner, b)):
            half, middle = 0.5 * (high - low), 0.5 * (high + low)
            for node, weight in _GAUSS_10:
                z = middle + half * node
                total += half * weight * self.weight(z) * factor(z)
        return total


def rising_pieces(table: Saturation) -> Pieces:
    """The branch W >= 0."""
    first, last = table.rising.edges[0], table.rising.edges[-1]
    count = int((last - first) / _WIDTH)
    ends = [xi_of_abscissa(table.n, first + _WIDTH * k) for k in range(count)]
    return Pieces(_from_zero([*ends, xi_of_abscissa(table.n, last)]), partial(saturation, table))


def falling_pieces(table: Saturation) -> Pieces:
    """The branch W < 0."""
    # The quadrature's cells span half an e-fold in w at most; where n > 1, two of them do.
    stride = 2 if table.n >= 1.0 else 1
    return Pieces(_from_zero(table.falling.integral[::-stride][::-1]), lambda z: -saturation(table, -z))


def _from_zero(ends: Sequence[float]) -> list[float]:
    return [0.0, *(z for z in ends if z > _FINEST)]
