"""Restoring force and tangent stiffness of the spring, elementwise for one step or a whole path.

Paper eq. (10), r = FE(x) + kappa_omega*omega*FA(x), with x = displacement - displacement_offset. Outside the
identified range FE goes on along its tangent and FA keeps its value at the end, because polynomials explode.

``ops`` is explained in `saturation`.
"""

from __future__ import annotations

from typing import Any

from .law import SpringLaw
from .parameters import polynomial
from .saturation import Scalar


def elastic_force(law: SpringLaw, x: Any, ops: Any = Scalar) -> Any:
    """FE(x) [N], paper eq. (9), continued along its tangent outside the range."""
    inside = ops.clip(x, law.x_min, law.x_max)
    return polynomial(law.FE, inside) + polynomial(law.dFE, inside) * (x - inside)


def amplifier(law: SpringLaw, x: Any, ops: Any = Scalar) -> Any:
    """FA(x) [-], paper eq. (8), held at its end value outside the range."""
    return polynomial(law.FA, ops.clip(x, law.x_min, law.x_max))


def restoring_force(law: SpringLaw, x: Any, omega: Any, ops: Any = Scalar) -> Any:
    """r [N], paper eq. (10)."""
    hysteretic = law.parameters.kappa_omega * omega * amplifier(law, x, ops)
    return elastic_force(law, x, ops) + hysteretic


def tangent_stiffness(law: SpringLaw, x: Any, omega: Any, direction: Any, ops: Any = Scalar) -> Any:
    """dr/dx [N/m] when the motion goes on in `direction` (+1 or -1)."""
    p = law.parameters
    u = direction * omega
    # Paper eq. (22); d(omega)/dx equals du/ds in either direction.
    slope = 1.0 + ops.where(u >= 0.0, -1.0, 2.0 * p.sigma - 1.0) * abs(u) ** p.n
    inside = ops.clip(x, law.x_min, law.x_max)
    amplifier_slope = ops.where(x == inside, polynomial(law.dFA, inside), 0.0)
    hysteretic = omega * amplifier_slope + polynomial(law.FA, inside) * p.rho * slope
    return polynomial(law.dFE, inside) + p.kappa_omega * hysteretic
