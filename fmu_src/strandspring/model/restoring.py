"""Restoring force, tangent stiffness and work of the spring, elementwise for one step or a whole path.

Paper eq. (10), r = FE(x) + kappa_omega*omega*FA(x), with x = displacement - displacement_offset. Outside the
identified range FE goes on along its tangent and FA keeps its value at the end, because polynomials explode.

Standard library only: this file travels inside the FMU. ``ops`` is explained in `saturation`.
"""

from __future__ import annotations

import math
from typing import Any

from .parameters import SpringParameters, antiderivative, derivative, polynomial
from .saturation import GAUSS_8, Saturation, Scalar, abscissa, falling, quadrature, rising, xi_of_abscissa

# Work done within this distance of xi = 0 is below 1e-20*kappa_omega/rho and is left out.
_LEAST = 1e-10
# Down to here one piece does: its work is below 1e-12*kappa_omega/rho.
_FINEST = 1e-6

# Up to this degree of FA, 8 points on a piece of W give the work to 1e-12 of the force times the path.
_SMOOTH_DEGREE = 4
# Up to this 2 sigma - 1, two cells of the falling branch are one piece for them.
_BENT = 5.0


class SpringLaw:
    """What the force functions need of one spring, prepared once: coefficients, derivatives, tables of W.

    Parameters
    ----------
    parameters : SpringParameters
    table : Saturation or None   Tables of W; built for single steps if not given.
    """

    __slots__ = (
        "FA", "FE", "FE_work", "dFA", "dFE", "parameters", "roughness", "table", "work_edges", "work_rule", "x_max",
        "x_min",
    )  # fmt: skip

    def __init__(self, parameters: SpringParameters, table: Saturation | None = None) -> None:
        p = parameters
        self.parameters = p
        self.FE = p.kE
        self.dFE = derivative(p.kE)
        self.FE_work = antiderivative(p.kE)
        self.FA = p.kA
        self.dFA = derivative(p.kA)
        self.x_min = p.x_min
        self.x_max = p.x_max
        # A polynomial of degree M may change by all of itself over 1/M^2 of half its range (Markov); per unit of xi.
        self.roughness = 2.0 * (len(p.kA) - 1) ** 2 / p.rho / (p.x_max - p.x_min)
        self.table = Saturation(p.n, p.sigma) if table is None else table
        self.work_edges = _work_edges(self.table)
        self.work_rule = _work_rule(len(p.kA) - 1)


def _work_edges(table: Saturation) -> list[float]:
    """xi between which W is one analytic piece: the cell edges of both branches and the zero between them."""
    # Two cells of the falling branch span one e-fold at most, as one of the rising branch does. Where n and sigma are
    # large W bends within less, and the cells are as fine as that asks for.
    step = -1 if table.n > 0.5 and table.curvature > _BENT else -2
    before = [-zeta for zeta in list(table.falling.integral)[::step]]
    # Below its table the falling branch is a straight line, but the work's integrand still spans e-folds.
    while before[-1] < -_FINEST:
        before.append(before[-1] / math.e)
    after = [xi_of_abscissa(table.n, t, Scalar) for t in table.rising.edges]
    return [xi for xi in (*before, 0.0, *after) if xi == 0.0 or abs(xi) > _FINEST]


def _work_rule(degree: int) -> tuple[tuple[float, float], ...]:
    """The 8 points of Gauss on each of so many equal panels as the degree of FA asks for."""
    if degree <= _SMOOTH_DEGREE:
        return GAUSS_8
    panels = degree // 2
    return tuple(
        ((2.0 * panel + 1.0 + node) / panels - 1.0, weight / panels)
        for panel in range(panels)
        for node, weight in GAUSS_8
    )


def elastic_force(law: SpringLaw, x: Any, ops: Any = Scalar) -> Any:
    """FE(x) [N], paper eq. (9), continued along its tangent outside the range."""
    inside = ops.clip(x, law.x_min, law.x_max)
    return polynomial(law.FE, inside) + polynomial(law.dFE, inside) * (x - inside)


def elastic_work(law: SpringLaw, x: Any, ops: Any = Scalar) -> Any:
    """Integral of FE from the offset to x [J]."""
    inside = ops.clip(x, law.x_min, law.x_max)
    out = x - inside
    return polynomial(law.FE_work, inside) + out * (
        polynomial(law.FE, inside) + 0.5 * polynomial(law.dFE, inside) * out
    )


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


def is_narrow(law: SpringLaw, low: Any, high: Any, ops: Any = Scalar) -> Any:
    """Whether 3 points give the work from xi = `low` to `high`, not across 0, to 1e-14."""
    nearest = ops.clip(ops.where(low >= 0.0, low, -high), _LEAST, math.inf)
    return (high - low) * ((1.0 + law.parameters.n) * (1.0 + 1.0 / nearest) + law.roughness) < 0.05


def rising_work(
    law: SpringLaw, direction: Any, x_at_zero: Any, low: Any, high: Any, rule: Any, ops: Any = Scalar
) -> Any:
    """Integral of kappa_omega*omega*FA dx while xi >= 0 grows from `low` to `high` on one stroke [J].

    `low` and `high` must lie between two neighbours of `law.work_edges`, and x_at_zero + direction*xi/rho
    must not cross an end of the range in between: then the integrand is analytic in t = ln(expm1(n*xi)) and
    `law.work_rule` gives it nearly to rounding.
    """
    p = law.parameters

    def rate(t: Any) -> Any:
        xi = xi_of_abscissa(p.n, t, ops)
        x = x_at_zero + direction * xi / p.rho
        return rising(law.table, xi, ops) * amplifier(law, x, ops) * -ops.expm1(-p.n * xi) / p.n

    start = abscissa(p.n, ops.clip(low, _LEAST, math.inf), ops)
    end = abscissa(p.n, ops.clip(high, _LEAST, math.inf), ops)
    return p.kappa_omega / p.rho * quadrature(rate, start, end, rule)


def falling_work(
    law: SpringLaw, direction: Any, x_at_zero: Any, low: Any, high: Any, rule: Any, ops: Any = Scalar
) -> Any:
    """The same while xi <= 0: analytic in ln(-xi)."""
    p = law.parameters

    def rate(a: Any) -> Any:
        zeta = ops.exp(a)
        x = x_at_zero - direction * zeta / p.rho
        return falling(law.table, zeta, ops) * amplifier(law, x, ops) * zeta

    start = ops.log(ops.clip(-high, _LEAST, math.inf))
    end = ops.log(ops.clip(-low, _LEAST, math.inf))
    return -p.kappa_omega / p.rho * quadrature(rate, start, end, rule)
