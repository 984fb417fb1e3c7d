"""Work of the spring: integrals of the force over the displacement, exact nearly to rounding.

On one stroke dx = direction*d(xi)/rho, so that the hysteretic part of paper eq. (10) does the work

    kappa_omega/rho * integral of W(xi)*FA(x_at_zero + direction*xi/rho) d(xi)

where x_at_zero is where xi would be 0. It is integrated by quadrature of short pieces; many pieces at once come from
the moments of W, FA being expanded about x_at_zero.

``ops`` is explained in `saturation`.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from .law import SpringLaw
from .parameters import polynomial
from .restoring import amplifier
from .saturation import GAUSS_3, Scalar, abscissa, falling, rising, xi_of_abscissa

# Work done within this distance of xi = 0 is below sigma*1e-20*kappa_omega/rho and is left out.
_LEAST = 1e-10
# Where sums of moments would lose more than this factor in accuracy, they are not used.
_WORST_CANCELLATION = 300.0


def elastic_work(law: SpringLaw, x: Any, ops: Any = Scalar) -> Any:
    """Integral of FE from the offset to x [J]."""
    inside = ops.clip(x, law.x_min, law.x_max)
    out = x - inside
    return polynomial(law.FE_work, inside) + out * (
        polynomial(law.FE, inside) + 0.5 * polynomial(law.dFE, inside) * out
    )


def is_narrow(law: SpringLaw, low: Any, high: Any, ops: Any = Scalar) -> Any:
    """Whether 3 points give the work from xi = `low` to `high`, not across 0, to 1e-14."""
    n = law.parameters.n
    nearest = ops.clip(ops.where(low >= 0.0, low, -high), _LEAST, math.inf)
    # On the falling branch W''/W' = n*(2 sigma - 1)*w^(n-1), where w, being convex, lies between zeta and its chord.
    w = ops.clip(low / law.work_edges[0], _LEAST, 1.0) if n > 1.0 else nearest
    bend = ops.where(low < 0.0, n * law.table.curvature * w ** (n - 1.0), 0.0)
    return (high - low) * ((1.0 + n) * (1.0 + 1.0 / nearest) + bend + law.roughness) < 0.05


def rising_work(
    law: SpringLaw, direction: Any, x_at_zero: Any, low: Any, high: Any, rule: Any, ops: Any = Scalar
) -> Any:
    """Integral of kappa_omega*omega*FA dx while xi >= 0 grows from `low` to `high` on one stroke [J].

    `low` and `high` must lie between two neighbours of `law.work_edges`, and x_at_zero + direction*xi/rho
    must not cross an end of the range in between: then the integrand is analytic in t = ln(expm1(n*xi)) and
    `law.work_rule` gives it nearly to rounding.
    """
    p = law.parameters
    total = 0.0
    for xi, share in _rising_shares(law, low, high, rule, ops):
        total = total + share * amplifier(law, x_at_zero + direction * xi / p.rho, ops)
    return p.kappa_omega / p.rho * total


def falling_work(
    law: SpringLaw, direction: Any, x_at_zero: Any, low: Any, high: Any, rule: Any, ops: Any = Scalar
) -> Any:
    """The same while xi <= 0: analytic in ln(-xi)."""
    p = law.parameters
    total = 0.0
    for zeta, share in _falling_shares(law, low, high, rule, ops):
        total = total + share * amplifier(law, x_at_zero - direction * zeta / p.rho, ops)
    return -p.kappa_omega / p.rho * total


def _rising_shares(law: SpringLaw, low: Any, high: Any, rule: Any, ops: Any) -> Iterator[tuple[Any, Any]]:
    """xi >= 0 and shares such that sum(share*g(xi)) is the integral of W*g from `low` to `high`."""
    n = law.parameters.n
    start = abscissa(n, ops.clip(low, _LEAST, math.inf), ops)
    end = abscissa(n, ops.clip(high, _LEAST, math.inf), ops)
    half, middle = 0.5 * (end - start), 0.5 * (end + start)
    for node, weight in rule:
        xi = xi_of_abscissa(n, middle + half * node, ops)
        yield xi, weight * half * rising(law.table, xi, ops) * -ops.expm1(-n * xi) / n


def _falling_shares(law: SpringLaw, low: Any, high: Any, rule: Any, ops: Any) -> Iterator[tuple[Any, Any]]:
    """zeta = -xi >= 0 and shares such that sum(share*g(zeta)) is the integral of |W|*g from xi = `low` to `high`."""
    start = ops.log(ops.clip(-high, _LEAST, math.inf))
    end = ops.log(ops.clip(-low, _LEAST, math.inf))
    half, middle = 0.5 * (end - start), 0.5 * (end + start)
    for node, weight in rule:
        zeta = ops.exp(middle + half * node)
        yield zeta, weight * half * falling(law.table, zeta, ops) * zeta


def hysteretic_work(law: SpringLaw, direction: int, x_at_zero: float, low: float, high: float) -> float:
    """Integral of kappa_omega*omega*FA dx while xi grows from `low` to `high` on one stroke [J]."""
    rho = law.parameters.rho
    ends = (direction * rho * (x - x_at_zero) for x in (law.x_min, law.x_max))
    cuts = [xi for xi in sorted((0.0, *ends)) if low < xi < high]
    return sum(_branch_work(law, direction, x_at_zero, a, b) for a, b in pairwise((low, *cuts, high)))


def _branch_work(law: SpringLaw, direction: int, x_at_zero: float, low: float, high: float) -> float:
    """The same on one branch of W and on one side of the ends of the range."""
    edges = law.work_edges
    first, last = bisect_right(edges, low), bisect_left(edges, high) - 1
    if first > last:
        return _piece_work(law, direction, x_at_zero, low, high)
    total = _piece_work(law, direction, x_at_zero, low, edges[first])
    total += _piece_work(law, direction, x_at_zero, edges[last], high)
    if first == last:
        return total
    between = _moments_work(law, direction, x_at_zero, first, last)
    if between is None:
        pieces = pairwise(edges[first : last + 1])
        between = sum(_piece_work(law, direction, x_at_zero, a, b) for a, b in pieces)
    return total + between


def _piece_work(law: SpringLaw, direction: int, x_at_zero: float, low: float, high: float) -> float:
    work = rising_work if low >= 0.0 else falling_work
    rule = GAUSS_3 if is_narrow(law, low, high) else law.work_rule
    return float(work(law, direction, x_at_zero, low, high, rule))


def _moments_work(law: SpringLaw, direction: int, x_at_zero: float, first: int, last: int) -> float | None:
    """The same from one edge to another, or None where the terms would cancel: when xi = 0 lies many times the range
    away."""
    if law.moments is None:
        law.moments = _moments(law)
    p = law.parameters
    low, high = law.work_edges[first], law.work_edges[last]
    # Of |xi| on the branch, away from 0.
    sign, near, far = (1.0, first, last) if low >= 0.0 else (-1.0, last, first)
    gained = [b - a for a, b in zip(law.moments[near], law.moments[far], strict=True)]
    scale = sign * p.kappa_omega / p.rho
    x = x_at_zero + 0.5 * direction * (low + high) / p.rho
    if not law.x_min <= x <= law.x_max:
        return float(scale * amplifier(law, x) * gained[0])
    step = sign * direction / p.rho
    reach = abs(x_at_zero) + abs(law.work_edges[far]) / p.rho
    largest = polynomial([abs(c) for c in law.FA], reach)
    total, power = 0.0, 1.0
    coefficients = list(law.FA)
    for m, gain in enumerate(gained):
        # Horner's rule once more for each power: coefficients[m] becomes that of (x - x_at_zero)^m.
        for k in range(len(coefficients) - 2, m - 1, -1):
            coefficients[k] += x_at_zero * coefficients[k + 1]
        total += coefficients[m] * power * gain
        power *= step
    return scale * total if largest * law.moments[far][0] < _WORST_CANCELLATION * total else None


def _moments(law: SpringLaw) -> list[list[float]]:
    """For each edge the integrals of |W|*|xi|^m from 0 to it."""
    edges = law.work_edges
    zero = edges.index(0.0)
    powers = range(len(law.FA))
    found = [[0.0 for _ in powers] for _ in edges]
    sides = (
        (_rising_shares, [(k, k + 1) for k in range(zero, len(edges) - 1)]),
        (_falling_shares, [(k, k - 1) for k in range(zero, 0, -1)]),
    )
    for shares, steps in sides:
        for near, far in steps:
            low, high = sorted((edges[near], edges[far]))
            sums = list(found[near])
            for z, share in shares(law, low, high, law.work_rule, Scalar):
                for m in powers:
                    sums[m] += share * z**m
            found[far] = sums
    return found
