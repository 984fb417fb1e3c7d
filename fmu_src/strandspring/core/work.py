"""Work of the spring: integrals of the force over the displacement, exact nearly to rounding.

On one stroke dx = direction*d(xi)/rho, so that the hysteretic part of paper eq. (10) does the work

    kappa_omega/rho * integral of W(xi)*FA(x_at_zero + direction*xi/rho) d(xi)

where x_at_zero is where xi would be 0. Where W rises above 1/2 it is what full saturation would do, which FA's
antiderivative gives, less the same integral of 1 - W, which is short where FA changes little; below, little would be
left of that difference. All are integrated by the moments of `pieces`, FA being expanded about x_at_zero, and by
quadrature of the pieces that hold the ends.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

from .law import SpringLaw
from .parameters import polynomial
from .pieces import Pieces
from .restoring import amplifier
from .saturation import GAUSS_8, saturation

# Gauss-Legendre nodes and weights on [-1, 1], exact for degree 5.
_GAUSS_3 = ((-0.77459666924148338, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.77459666924148338, 5.0 / 9.0))
# Up to this share of a piece, and of what FA may change in, 3 points are enough.
_NARROW = 0.05
# Where terms of the sum of moments may be so many times the work that full saturation does, it is not used.
_WORST_CANCELLATION = 300.0


class _Part(NamedTuple):
    """Part of a stroke on one branch of W, where x = x_at_zero + per_z*|xi|."""

    law: SpringLaw
    pieces: Pieces
    x_at_zero: float
    per_z: float


def elastic_work(law: SpringLaw, x: float) -> float:
    """Integral of FE from the offset to x [J]."""
    inside = law.inside(x)
    out = x - inside
    work = law.elastic.work(inside)
    return work + out * (law.elastic.force(inside) + 0.5 * law.elastic.slope(inside) * out)


def amplifier_work(law: SpringLaw, x: float) -> float:
    """Integral of FA from the offset to x [m]."""
    inside = law.inside(x)
    return polynomial(law.FA_work, inside) + (x - inside) * polynomial(law.FA, inside)


def hysteretic_work(law: SpringLaw, direction: int, x_at_zero: float, low: float, high: float) -> float:
    """Integral of kappa_omega*omega*FA dx while xi grows from `low` to `high` on one stroke [J]."""
    rho = law.parameters.rho
    # Where the stroke crosses the ends of the range, and xi = 0, the integrand has a kink.
    ends = (direction * rho * (x - x_at_zero) for x in (law.x_min, law.x_max))
    cuts = [xi for xi in sorted((0.0, *ends)) if low < xi < high]
    total = 0.0
    for a, b in pairwise((low, *cuts, high)):
        branch_work = _falling_work if b <= 0.0 else _rising_work
        total += branch_work(law, direction, x_at_zero, a, b)
    return law.parameters.kappa_omega * total


def _rising_work(law: SpringLaw, direction: int, x_at_zero: float, low: float, high: float) -> float:
    """The same for xi >= 0 and kappa_omega = 1, without a kink in between."""
    rho = law.parameters.rho
    part = _Part(law, law.rising, x_at_zero, direction / rho)
    edges = part.pieces.edges
    on_one_piece = high < edges[-1] and _piece_of(part, low) == _piece_of(part, high)
    if on_one_piece or saturation(law.table, high) < 0.5:
        return _integral(part, low, high) / rho
    a, b = x_at_zero + part.per_z * low, x_at_zero + part.per_z * high
    saturated = direction * (amplifier_work(law, b) - amplifier_work(law, a))
    # Beyond the last edge nothing is missing.
    missing = _integral(part._replace(pieces=law.missing), low, min(high, edges[-1])) if low < edges[-1] else 0.0
    return saturated - missing / rho


def _falling_work(law: SpringLaw, direction: int, x_at_zero: float, low: float, high: float) -> float:
    """The same for xi <= 0."""
    rho = law.parameters.rho
    return -_integral(_Part(law, law.falling, x_at_zero, -direction / rho), -high, -low) / rho


def _piece_of(part: _Part, z: float) -> int:
    """The piece that holds z; the last one beyond all."""
    edges = part.pieces.edges
    return bisect_right(edges, z, 1, len(edges) - 1) - 1


def _integral(part: _Part, a: float, b: float) -> float:
    """Integral of weight*FA over z = |xi| from a to b."""
    edges, weight = part.pieces.edges, part.pieces.weight
    first, last = _piece_of(part, a), _piece_of(part, b)
    if first == last:
        return _piece_work(part, first, a, b, weight)
    total = _piece_work(part, first, a, edges[first + 1], weight) + _piece_work(part, last, edges[last], b, weight)
    return total if first + 1 == last else total + _whole_pieces_work(part, first + 1, last)


def _piece_work(part: _Part, piece: int, a: float, b: float, weight: Callable[[float], float]) -> float:
    """The same on one piece by quadrature."""
    law = part.law
    rough = (b - a) * law.roughness
    width = part.pieces.edges[piece + 1] - part.pieces.edges[piece]
    rule, panels = GAUSS_8, 1
    if rough < _NARROW and b - a < _NARROW * width:
        rule = _GAUSS_3
    elif rough >= 16.0:
        # 8 points on each of so many panels suffice for the degree of FA, whatever part of the range it is.
        panels = min(int(rough / 8.0), len(law.FA) // 2)
    half = 0.5 * (b - a) / panels
    total = 0.0
    for panel in range(panels):
        for node, share in rule:
            z = a + half * (2 * panel + 1 + node)
            total += share * weight(z) * amplifier(law, part.x_at_zero + part.per_z * z)
    return half * total


def _whole_pieces_work(part: _Part, first: int, last: int) -> float:
    """The same from one edge to another."""
    edges = part.pieces.edges
    total = _moments_work(part, first, last)
    if total is not None:
        return total
    # Piece by piece only where FA changes over a piece.
    smooth = min(max(bisect_right(edges, 1.0 / part.law.roughness) - 1, first), last) if part.law.roughness else last
    total = _moments_work(part, first, smooth) if first < smooth < last else None
    begin = first if total is None else smooth
    pieces = range(begin, last)
    by_piece = sum(_piece_work(part, i, edges[i], edges[i + 1], part.pieces.weight) for i in pieces)
    return by_piece + (total or 0.0)


def _moments_work(part: _Part, first: int, last: int) -> float | None:
    """The same from the moments, or None where their terms would cancel: when xi = 0 lies many times the range away, or
    FA is of a high degree."""
    law = part.law
    edges, moments = part.pieces.edges, part.pieces.moments
    gained = [b - a for a, b in zip(moments[first], moments[last], strict=True)]
    x = part.x_at_zero + 0.5 * part.per_z * (edges[first] + edges[last])
    if x != law.inside(x):
        return amplifier(law, x) * gained[0]
    reach = abs(part.x_at_zero) + abs(part.per_z) * edges[last]
    largest = polynomial([abs(c) for c in law.FA], reach)
    total, power = 0.0, 1.0
    coefficients = list(law.FA)
    for m, gain in enumerate(gained):
        # Horner's rule once more for each power: coefficients[m] becomes that of (x - x_at_zero)^m.
        for k in range(len(coefficients) - 2, m - 1, -1):
            coefficients[k] += part.x_at_zero * coefficients[k + 1]
        total += coefficients[m] * power * gain
        power *= part.per_z
    saturated = (edges[last] - edges[first]) * amplifier(law, x)
    return total if largest * moments[last][0] < _WORST_CANCELLATION * saturated else None
