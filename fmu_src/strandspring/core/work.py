"""Work of the spring: integrals of the force over the displacement, exact nearly to rounding.

On one stroke dx = direction*d(xi)/rho, so that the hysteretic part of paper eq. (10) does the work

    kappa_omega/rho * integral of W(xi)*FA(x_at_zero + direction*xi/rho) d(xi)

where x_at_zero is where xi would be 0. It is integrated by Gauss's rule on the `pieces` of W that hold the ends, and on
all pieces in between.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from .law import SpringLaw
from .parameters import polynomial
from .pieces import NODES, Pieces
from .restoring import amplifier


class _Part(NamedTuple):
    """Part of a stroke on one branch of W and on one side of each end of the range.

    There x = x_at_zero + per_z*|xi|, and FA has these coefficients: one where it is constant.
    """

    pieces: Pieces
    FA: Sequence[float]
    x_at_zero: float
    per_z: float
    from_zero: bool  # whether FA may be asked for from xi = 0 on


def elastic_work(law: SpringLaw, x: float) -> float:
    """Integral of FE from the offset to x [J]."""
    inside = law.inside(x)
    out = x - inside
    work = law.elastic.work(inside)
    return work + out * (law.elastic.force(inside) + 0.5 * law.elastic.slope(inside) * out)


def hysteretic_work(law: SpringLaw, direction: int, x_at_zero: float, low: float, high: float) -> float:
    """Integral of kappa_omega*omega*FA dx while xi grows from `low` to `high` on one stroke [J]."""
    rho = law.parameters.rho
    # Where the stroke crosses the ends of the range, and xi = 0, the integrand has a kink.
    ends = (direction * rho * (x - x_at_zero) for x in (law.x_min, law.x_max))
    cuts = [xi for xi in sorted((0.0, *ends)) if low < xi < high]
    total = 0.0
    for a, b in pairwise((low, *cuts, high)):
        middle = x_at_zero + 0.5 * direction / rho * (a + b)
        is_inside = middle == law.inside(middle)
        FA = law.FA if is_inside else (amplifier(law, middle),)
        from_zero = not is_inside or x_at_zero == law.inside(x_at_zero)
        if b <= 0.0:
            total -= _branch_work(_Part(law.falling, FA, x_at_zero, -direction / rho, from_zero), -b, -a)
        else:
            total += _branch_work(_Part(law.rising, FA, x_at_zero, direction / rho, from_zero), a, b)
    return law.parameters.kappa_omega / rho * total


def _branch_work(part: _Part, a: float, b: float) -> float:
    """Integral of |W|*FA over z = |xi| from a to b."""
    edges, first_shares = part.pieces.edges, part.pieces.first_shares
    piece, last = bisect_right(edges, a) - 1, bisect_right(edges, b) - 1
    if piece == last:
        return _piece_work(part, a, b)
    if not part.from_zero or last - piece <= 2:
        return sum(_piece_work(part, low, high) for low, high in pairwise((a, *edges[piece + 1 : last + 1], b)))
    total = _amplifier_sum(part, 0.0, edges[last], first_shares[last]) + _piece_work(part, edges[last], b)
    if a == 0.0:
        return total
    before = _amplifier_sum(part, 0.0, edges[piece], first_shares[piece]) + _piece_work(part, edges[piece], a)
    return total - before


def _piece_work(part: _Part, a: float, b: float) -> float:
    """The same on one piece."""
    return _amplifier_sum(part, a, b, part.pieces.shares(a, b))


def _amplifier_sum(part: _Part, a: float, b: float, shares: Sequence[float]) -> float:
    """The sum of shares times FA at Gauss's nodes between z = a and b."""
    middle, reach = part.x_at_zero + 0.5 * part.per_z * (a + b), 0.5 * part.per_z * (b - a)
    FA = part.FA
    return sum(share * polynomial(FA, middle + reach * node) for node, share in zip(NODES, shares, strict=True))
