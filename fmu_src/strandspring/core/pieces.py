"""W cut into pieces for the integrals that the spring's work needs.

With z = |xi|, |W| is smooth enough on a piece for 8 points of Gauss's rule. Over whole pieces the integral of W times a
polynomial of z is a sum of moments, which are tabulated; on the rising branch also those of 1 - W, which vanishes where
the spring is saturated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

from .saturation import GAUSS_8, Saturation, missing_saturation, saturation, xi_of_abscissa

# Width of a piece in t = ln(expm1(n*xi)): z = 0, where W may have a cusp, is 4.5 half widths away at least.
_WIDTH = 0.45
# The branches are cut into pieces down to this z; below it the work is less than sigma*1e-16*kappa_omega/rho.
_FINEST = 1e-8


class Pieces(NamedTuple):
    """One branch of W.

    Attributes
    ----------
    edges : list of float             z at the ends of the pieces, from 0 on.
    moments : list of list of float   For each edge the integrals of weight(z)*z^m from 0 to it, m = 0, 1, ...
    weight : callable                 |W| or 1 - W at z.
    """

    edges: list[float]
    moments: list[list[float]]
    weight: Callable[[float], float]


def rising_pieces(table: Saturation, powers: int) -> Pieces:
    """The branch W >= 0, with so many moments of W."""
    return _pieces(_rising_ends(table), partial(saturation, table), powers)


def missing_pieces(table: Saturation, powers: int) -> Pieces:
    """The branch W >= 0, with so many moments of 1 - W."""
    return _pieces(_rising_ends(table), partial(missing_saturation, table), powers)


def falling_pieces(table: Saturation, powers: int) -> Pieces:
    """The branch W < 0, with so many moments of |W|."""
    # The quadrature's cells span half an e-fold in w at most; where n > 1, two of them do.
    stride = 2 if table.n >= 1.0 else 1
    ends = table.falling.integral[::-stride]
    return _pieces(ends[::-1], lambda z: -saturation(table, -z), powers)


def _rising_ends(table: Saturation) -> list[float]:
    first, last = table.rising.edges[0], table.rising.edges[-1]
    count = int((last - first) / _WIDTH)
    ends = [xi_of_abscissa(table.n, first + _WIDTH * k) for k in range(count)]
    return [*ends, xi_of_abscissa(table.n, last)]


def _pieces(ends: Sequence[float], weight: Callable[[float], float], powers: int) -> Pieces:
    edges = [0.0, *(z for z in ends if z > _FINEST)]
    moments = [[0.0] * powers]
    for low, high in pairwise(edges):
        half, middle = 0.5 * (high - low), 0.5 * (high + low)
        sums = list(moments[-1])
        for node, share in GAUSS_8:
            z = middle + half * node
            term = half * share * weight(z)
            for m in range(powers):
                sums[m] += term
                term *= z
        moments.append(sums)
    return Pieces(edges, moments, weight)
