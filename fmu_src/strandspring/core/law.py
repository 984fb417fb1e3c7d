"""What the functions of force and work need of one spring, prepared once."""

from __future__ import annotations

import math

from .parameters import SpringParameters, antiderivative, derivative
from .saturation import GAUSS_8, Saturation, Scalar, xi_of_abscissa

# Down to this |xi| W is cut into e-folds; the work of the piece that is left is below sigma*1e-16*kappa_omega/rho.
_FINEST = 1e-8
# Up to this degree of FA, 8 points on a piece of W give the work to 1e-12 of the force times the path.
_SMOOTH_DEGREE = 4
# Up to this 2 sigma - 1, two cells of the falling branch are one piece for them.
_BENT = 5.0


class SpringLaw:
    """Coefficients, their derivatives, and the tables of W of one spring.

    Parameters
    ----------
    parameters : SpringParameters
    table : Saturation or None   Tables of W; built for single steps if not given.

    Attributes
    ----------
    work_edges : list of float   xi between which W is one analytic piece, ascending, with 0 among them.
    work_rule : tuple of pairs   Nodes and weights on [-1, 1] that give the work of a piece.
    moments : list or None       For each edge the integrals of |W|*|xi|^m from 0 to it, m = 0 .. degree of FA;
                                 None until `work` needs them, for they take some 20 ms.
    """

    __slots__ = (
        "FA", "FE", "FE_work", "dFA", "dFE", "moments", "parameters", "roughness", "table", "work_edges", "work_rule",
        "x_max", "x_min",
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
        self.moments: list[list[float]] | None = None


def _work_edges(table: Saturation) -> list[float]:
    """The cell edges of both branches of W and the zero between them."""
    # Two cells of the falling branch span one e-fold at most, as one of the rising branch does. Where sigma is large
    # W bends within less, and the cells are as fine as that asks for.
    step = -1 if table.curvature > _BENT else -2
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
