"""Restoring force and tangent stiffness of the spring.

Paper eq. (10), r = FE(x) + kappa_omega*omega*FA(x), with x = displacement - displacement_offset. Outside the
identified range FE is continued along its tangent and FA keeps its value at the end, because polynomials explode.
"""

from __future__ import annotations

import math

from .law import SpringLaw
from .polynomials import polynomial


def elastic_force(law: SpringLaw, x: float) -> float:
    """FE(x) [N], paper eq. (9) or a table, continued along its tangent outside the range."""
    inside = law.inside(x)
    return law.elastic.force(inside) + law.elastic.slope(inside) * (x - inside)


def amplifier(law: SpringLaw, x: float) -> float:
    """FA(x) [-], paper eq. (8), held at its end value outside the range."""
    return polynomial(law.FA, law.inside(x))


def restoring_force(law: SpringLaw, x: float, omega: float) -> float:
    """r [N], paper eq. (10)."""
    return elastic_force(law, x) + law.parameters.kappa_omega * omega * amplifier(law, x)


def tangent_stiffness(law: SpringLaw, x: float, omega: float, direction: int) -> float:
    """dr/dx [N/m] when the motion goes on in `direction` (+1 or -1)."""
    p = law.parameters
    u = direction * omega
    # Paper eq. (22); d(omega)/dx equals du/ds in either direction.
    slope = 1.0 + (-1.0 if u >= 0.0 else law.table.curvature) * math.pow(abs(u), p.n)
    inside = law.inside(x)
    amplifier_slope = polynomial(law.dFA, inside) if x == inside else 0.0
    hysteretic = omega * amplifier_slope + polynomial(law.FA, inside) * p.rho * slope
    return law.elastic.slope(inside) + p.kappa_omega * hysteretic
