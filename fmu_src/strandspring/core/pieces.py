"""W cut into pieces for the integrals that the spring's work needs.

With z = |xi|, |W| is within 1e-13 a polynomial of degree 11 on a piece, so that Gauss's rule of 10 points integrates
its product with FA, of degree 8. Over many pieces |W| is no polynomial, but FA still is one: the integral of |W|*p over
the first pieces is the sum of shares times p at Gauss's nodes on all of them, for every polynomial p of degree 9. The
shares are those that give the right integrals of |W| times Legendre's polynomials.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

from .saturation import Saturation, saturation, xi_of_abscissa

# Nodes and weights of Gauss-Legendre's rule on [-1, 1], exact for degree 19.
NODES = (
    -0.97390652851717172,
    -0.86506336668898451,
    -0.67940956829902441,
    -0.43339539412924719,
    -0.14887433898163121,
    0.14887433898163121,
    0.43339539412924719,
    0.67940956829902441,
    0.86506336668898451,
    0.97390652851717172,
)
_WEIGHTS = (
    0.066671344308688138,
    0.14945134915058059,
    0.21908636251598204,
    0.26926671930999636,
    0.29552422471475287,
    0.29552422471475287,
    0.26926671930999636,
    0.21908636251598204,
    0.14945134915058059,
    0.066671344308688138,
)
# Width of a piece in t = ln(expm1(n*xi)): z = 0, where W may have a cusp, is 4.5 half widths away at least.
_WIDTH = 0.45
# The branches are cut into pieces down to this z; below it the work is less than sigma*1e-16*kappa_omega/rho.
_FINEST = 1e-8


class Pieces(NamedTuple):
    """One branch of W.

    Attributes
    ----------
    edges : list of float                  z at the ends of the pieces, from 0 on.
    first_shares : list of list of float   Of the pieces up to each edge.
    weight : callable                      |W| at z.
    """

    edges: list[float]
    first_shares: list[list[float]]
    weight: Callable[[float], float]

    def shares(self, a: float, b: float) -> list[float]:
        """Of what lies between a and b, on one piece."""
        half, middle = 0.5 * (b - a), 0.5 * (b + a)
        return [half * share * self.weight(middle + half * node) for node, share in zip(NODES, _WEIGHTS, strict=True)]


def rising_pieces(table: Saturation) -> Pieces:
    """The branch W >= 0."""
    first, last = table.rising.edges[0], table.rising.edges[-1]
    count = int((last - first) / _WIDTH)
    ends = [xi_of_abscissa(table.n, first + _WIDTH * k) for k in range(count)]
    return _pieces([*ends, xi_of_abscissa(table.n, last)], partial(saturation, table))


def falling_pieces(table: Saturation) -> Pieces:
    """The branch W < 0."""
    # The quadrature's cells span half an e-fold in w at most; where n > 1, two of them do.
    stride = 2 if table.n >= 1.0 else 1
    ends = table.falling.integral[::-stride]
    return _pieces(ends[::-1], lambda z: -saturation(table, -z))


def _pieces(ends: Sequence[float], weight: Callable[[float], float]) -> Pieces:
    pieces = Pieces([0.0, *(z for z in ends if z > _FINEST)], [[0.0] * len(NODES)], weight)
    for a, b in pairwise(pieces.edges):
        integrals = [0.0] * len(NODES)
        # Of the pieces before, and of this one.
        for low, high, shares in ((0.0, a, pieces.first_shares[-1]), (a, b, pieces.shares(a, b))):
            for node, share in zip(NODES, shares, strict=True):
                z = 0.5 * (low + high) + 0.5 * (high - low) * node
                for m, value in enumerate(_legendre(2.0 * z / b - 1.0)):
                    integrals[m] += share * value
        pieces.first_shares.append(
            [sum(s * integral for s, integral in zip(row, integrals, strict=True)) for row in _TO_SHARES]
        )
    return pieces


def _legendre(t: float) -> list[float]:
    """Legendre's polynomials at t, as many as there are nodes."""
    values = [1.0, t]
    for m in range(2, len(NODES)):
        values.append((2.0 - 1.0 / m) * t * values[-1] - (1.0 - 1.0 / m) * values[-2])
    return values


# Of integrals of |W| times Legendre's polynomials.
_TO_SHARES = [
    [weight * (m + 0.5) * value for m, value in enumerate(_legendre(node))]
    for node, weight in zip(NODES, _WEIGHTS, strict=True)
]
