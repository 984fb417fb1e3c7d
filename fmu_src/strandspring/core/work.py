"""Work of the spring: integrals of the force over the displacement, exact nearly to rounding.

On one stroke dx = direction*d(xi)/rho, so that the hysteretic part of paper eq. (10) does the work

    kappa_omega/rho * integral of W(xi)*FA(x_at_zero + direction*xi/rho) d(xi)

where x_at_zero is where xi would be 0. It is integrated by Gauss's rule on the `pieces` of W.
"""

from __future__ import annotations

from itertools import pairwise

from .law import SpringLaw
from .restoring import amplifier


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
        if b <= 0.0:
            total -= law.falling.integral(-b, -a, lambda z: amplifier(law, x_at_zero - direction / rho * z))
        else:
            total += law.rising.integral(a, b, lambda z: amplifier(law, x_at_zero + direction / rho * z))
    return law.parameters.kappa_omega / rho * total
