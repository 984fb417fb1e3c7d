"""The universal saturation function W of the normalized Bouc-Wen model, and its inverse.

On a monotone stroke the paper's eq. (22) is autonomous in u = d*omega, d = sgn(dx), and in the
travelled distance scaled by rho, d(xi) = rho*|dx|:

    du/dxi = 1 - u^n                        u >= 0   (the stroke drives omega towards saturation)
    du/dxi = 1 + (2*sigma - 1)*(-u)^n       u <  0   (the stroke recovers from the previous one)

so one increasing function u = W(xi), W(0) = 0, describes every stroke. It is the inverse of

    xi = S(u)  = integral_0^u dv/(1 - v^n)                      u >= 0
    xi = -T(w) = -integral_0^w dv/(1 + (2*sigma - 1)*v^n)       u = -w < 0

S and T are integrated by Gauss-Legendre quadrature of analytic integrands: S over q = logit(u), T over
y = ln(w). Their inverses are tabulated as a Chebyshev interpolant per cell of a *bounded, smooth
difference*, exact at both ends of the range:

    q - t(xi),      t = ln(expm1(n*xi))     (zero for n = 1, constant for n = 2)
    y - ln(-xi)                             (zero for sigma = 1/2)

Every elementwise function takes ``ops``: `Scalar` here, or its NumPy twin `strandspring.kernel.path.Vector` with the
same names, so that one source serves one step at a time and whole paths.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from itertools import accumulate
from operator import mul
from typing import Any

# Gauss-Legendre nodes and weights on [-1, 1]: 8 points are exact for degree 15, 3 for degree 5.
GAUSS_3 = ((-0.77459666924148338, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.77459666924148338, 5.0 / 9.0))
GAUSS_8 = tuple(
    (sign * node, weight)
    for node, weight in (
        (0.18343464249564980, 0.36268378337836198),
        (0.52553240991632899, 0.31370664587788729),
        (0.79666647741362674, 0.22238103445337447),
        (0.96028985649753623, 0.10122853629037626),
    )
    for sign in (-1.0, 1.0)
)

# Degree of the interpolant per cell; with cells of width 1 in t its error is below 2e-13 in u, and 2e-12 where n and
# sigma are as large as they may be.
_DEGREE = 9
_CHEBYSHEV = tuple(math.cos(math.pi * (1.0 - k / _DEGREE)) for k in range(_DEGREE + 1))

_LOWEST = -32.0  # ln of the smallest u resolved, 1.3e-14: below it W(xi) = xi within that
_HIGHEST = 40.0  # logit of the largest u resolved: above it 1 - u < 5e-18, which a double cannot hold
_QUADRATURE_STEP = 0.25  # cell of the quadrature in q
_CORRECTED = 1e-3  # of what W bends in, the most by which xi is corrected
_NEWTON_STEPS = 3  # quadratic convergence from a linear start within a cell: 1e-2, 1e-4, 1e-8, 1e-16


def _monomials_from_chebyshev_values() -> list[list[float]]:
    """Rows that turn values at the Chebyshev points into coefficients of powers of theta in [-1, 1]."""
    size = _DEGREE + 1
    # Lagrange basis polynomials, multiplied out.
    basis = []
    for j in range(size):
        polynomial = [1.0]
        for k in range(size):
            if k != j:
                gap = _CHEBYSHEV[j] - _CHEBYSHEV[k]
                raised = [0.0, *polynomial]
                polynomial = [
                    (up - _CHEBYSHEV[k] * low) / gap for up, low in zip(raised, [*polynomial, 0.0], strict=True)
                ]
        basis.append(polynomial)
    return [[basis[j][power] for j in range(size)] for power in range(size)]


_TO_MONOMIALS = _monomials_from_chebyshev_values()


class Scalar:
    """Operations on one float; `path.Vector` has the same on arrays."""

    exp = staticmethod(math.exp)
    log = staticmethod(math.log)
    log1p = staticmethod(math.log1p)
    expm1 = staticmethod(math.expm1)

    @staticmethod
    def column(values: Any) -> list[float]:
        return list(values)

    @staticmethod
    def clip(value: float, low: float, high: float) -> float:
        return min(max(value, low), high)

    @staticmethod
    def where(condition: bool, chosen: float, other: float) -> float:
        return chosen if condition else other

    @staticmethod
    def locate(edges: Any, value: float) -> int:
        """Index of the cell [edges[i], edges[i+1]] that holds `value`; the first or last one outside."""
        return min(max(bisect_right(edges, value) - 1, 0), len(edges) - 2)

    @staticmethod
    def combine(weights: list[float], columns: list[Any]) -> list[float]:
        """Weighted sum of columns, entry by entry."""
        return [sum(map(mul, weights, entries)) for entries in zip(*columns, strict=True)]

    @staticmethod
    def map(function: Any, *columns: Any) -> list[Any]:
        return [function(*row) for row in zip(*columns, strict=True)]


class Branch:
    """Quadrature grid and interpolation cells of one of the two integrals.

    Attributes
    ----------
    grid, integral : columns   Quadrature nodes in p (q or y) and the integral xi up to each.
    edges : column             Cell edges in the abscissa a (t or ln(-xi)).
    coefficients : list of columns   ``coefficients[k][cell]`` of theta^k, theta in [-1, 1] over the cell.
    """

    __slots__ = ("coefficients", "edges", "grid", "integral")

    def __init__(self, grid: Any, integral: Any, edges: Any, coefficients: list[Any]) -> None:
        self.grid = grid
        self.integral = integral
        self.edges = edges
        self.coefficients = coefficients


class Saturation:
    """Tables of W for one pair (n, sigma), built once and read by the functions of this module."""

    __slots__ = ("curvature", "falling", "n", "rising")

    def __init__(self, n: float, sigma: float, ops: Any = Scalar) -> None:
        self.n = n
        self.curvature = 2.0 * sigma - 1.0
        self.rising = _rising_branch(n, ops)
        self.falling = _falling_branch(n, self.curvature, ops)

    def converted(self, column: Any) -> Saturation:
        """The same tables with every column turned by `column`, such as an array into a list."""
        twin = object.__new__(Saturation)
        twin.n, twin.curvature = self.n, self.curvature
        twin.rising, twin.falling = (
            Branch(column(b.grid), column(b.integral), column(b.edges), [column(c) for c in b.coefficients])
            for b in (self.rising, self.falling)
        )
        return twin


def quadrature(rate: Any, start: Any, end: Any, rule: tuple[tuple[float, float], ...] = GAUSS_8) -> Any:
    """Integral of `rate` from `start` to `end`, elementwise."""
    half = 0.5 * (end - start)
    middle = 0.5 * (end + start)
    total = 0.0
    for node, weight in rule:
        total = total + weight * rate(middle + half * node)
    return half * total


def _rising_rate(n: float, ops: Any) -> Any:
    """d(xi)/dq = u*(1 - u)/(1 - u^n) with u = logistic(q), free of cancellation at both ends."""

    def rate(q: Any) -> Any:
        decay = ops.exp(-q)
        log_u = -ops.log1p(decay)
        return ops.exp(log_u) * (decay / (1.0 + decay)) / -ops.expm1(n * log_u)

    return rate


def _falling_rate(n: float, curvature: float, ops: Any) -> Any:
    """d(-xi)/dy = w/(1 + (2 sigma - 1) w^n) with w = exp(y)."""

    def rate(y: Any) -> Any:
        return ops.exp(y) / (1.0 + curvature * ops.exp(n * y))

    return rate


def abscissa(n: float, xi: Any, ops: Any) -> Any:
    """t = ln(expm1(n*xi)), xi > 0."""
    scaled = n * xi
    return scaled + ops.log(-ops.expm1(-scaled))


def xi_of_abscissa(n: float, t: Any, ops: Any) -> Any:
    """xi = ln(1 + e^t)/n, written so that a large t does not overflow."""
    return (ops.clip(t, 0.0, math.inf) + ops.log1p(ops.exp(-abs(t)))) / n


def _rising_branch(n: float, ops: Any) -> Branch:
    rate = _rising_rate(n, ops)
    cells = round((_HIGHEST - _LOWEST) / _QUADRATURE_STEP)
    grid = ops.column([_LOWEST + _QUADRATURE_STEP * k for k in range(cells + 1)])
    pieces = ops.map(lambda a, b: quadrature(rate, a, b), grid[:-1], grid[1:])
    integral = ops.column(list(accumulate(pieces, initial=math.exp(_LOWEST))))
    first = abscissa(n, integral[0], Scalar)
    last = abscissa(n, integral[-1], Scalar)
    count = math.ceil(last - first)
    width = (last - first) / count
    edges = ops.column([first + width * k for k in range(count)] + [last])
    spots = _chebyshev_points(edges, ops)
    targets = ops.map(lambda t: xi_of_abscissa(n, t, ops), spots)
    parameters = _invert(rate, grid, integral, targets, ops)
    differences = ops.map(lambda q, t: q - t, parameters, spots)
    return Branch(grid, integral, edges, _interpolants(differences, ops))


def _falling_branch(n: float, curvature: float, ops: Any) -> Branch:
    rate = _falling_rate(n, curvature, ops)
    # Below this w the term (2 sigma - 1) w^n is lost in rounding and T(w) = w.
    lowest = max(_LOWEST, -(36.0 + math.log1p(curvature)) / n)
    # A cell may span half an e-fold in w and a quarter of e-fold in w^n: the nearest pole of the integrand,
    # (2 sigma - 1) w^n = -1, is then at least four half cells away from the next cell.
    count = math.ceil(-lowest / min(0.5, 0.25 / n))
    grid = ops.column([lowest * (1.0 - k / count) for k in range(count + 1)])
    pieces = ops.map(lambda a, b: quadrature(rate, a, b), grid[:-1], grid[1:])
    start = math.exp(lowest) / (1.0 + curvature * math.exp(n * lowest) / (1.0 + n))
    integral = ops.column(list(accumulate(pieces, initial=start)))
    edges = ops.map(ops.log, integral)
    spots = _chebyshev_points(edges, ops)
    targets = ops.map(ops.exp, spots)
    parameters = _invert(rate, grid, integral, targets, ops)
    differences = ops.map(lambda y, a: y - a, parameters, spots)
    return Branch(grid, integral, edges, _interpolants(differences, ops))


def _chebyshev_points(edges: Any, ops: Any) -> Any:
    """The Chebyshev points of all cells, one point index after the other."""
    points: list[Any] = []
    for theta in _CHEBYSHEV:
        points.extend(
            ops.map(lambda a, b, theta=theta: 0.5 * ((1.0 - theta) * a + (1.0 + theta) * b), edges[:-1], edges[1:])
        )
    return ops.column(points)


def _invert(rate: Any, grid: Any, integral: Any, targets: Any, ops: Any) -> Any:
    """Parameters p at which the integral reaches each target: Newton's method on the quadrature."""

    def solve(target: Any) -> Any:
        cell = ops.locate(integral, target)
        origin = grid[cell]
        base = integral[cell]
        p = origin + (grid[cell + 1] - origin) * ops.clip((target - base) / (integral[cell + 1] - base), 0.0, 1.0)
        for _ in range(_NEWTON_STEPS):
            p = p + (target - base - quadrature(rate, origin, p)) / rate(p)
        return p

    return ops.map(solve, targets)


def _interpolants(values: Any, ops: Any) -> list[Any]:
    """Coefficients per power from values at the Chebyshev points (ordered as `_chebyshev_points`)."""
    cells = len(values) // (_DEGREE + 1)
    columns = [values[k * cells : (k + 1) * cells] for k in range(_DEGREE + 1)]
    # Of differences from the middle, or the matrix would magnify the rounding of large values.
    middle = columns[_DEGREE // 2]
    columns = [ops.map(lambda value, m: value - m, column, middle) for column in columns]
    coefficients = [ops.combine(row, columns) for row in _TO_MONOMIALS]
    coefficients[0] = ops.map(lambda c, m: c + m, coefficients[0], middle)
    return coefficients


def _interpolate(branch: Branch, abscissa: Any, ops: Any) -> Any:
    cell = ops.locate(branch.edges, abscissa)
    low = branch.edges[cell]
    high = branch.edges[cell + 1]
    theta = ops.clip((2.0 * abscissa - low - high) / (high - low), -1.0, 1.0)
    total = branch.coefficients[_DEGREE][cell]
    for power in range(_DEGREE - 1, -1, -1):
        total = total * theta + branch.coefficients[power][cell]
    return total


def rising(table: Saturation, xi: Any, ops: Any = Scalar) -> Any:
    """W(xi) for xi >= 0, elementwise: in [0, 1]."""
    t = abscissa(table.n, ops.clip(xi, 1e-300, math.inf), ops)
    return 1.0 / (1.0 + ops.exp(-(t + _interpolate(table.rising, t, ops))))


def falling(table: Saturation, zeta: Any, ops: Any = Scalar) -> Any:
    """w = -W(-zeta) for zeta >= 0, elementwise: in [0, 1]."""
    a = ops.log(ops.clip(zeta, 1e-300, math.inf))
    return ops.clip(zeta * ops.exp(_interpolate(table.falling, a, ops)), 0.0, 1.0)


def saturation(table: Saturation, xi: float) -> float:
    """W(xi) of one float: u = d*omega after the scaled distance xi from its zero crossing."""
    if xi >= 0.0:
        return rising(table, xi)  # type: ignore[no-any-return]
    return -falling(table, -xi)  # type: ignore[no-any-return]


def inverse_saturation(table: Saturation, u: float) -> float:
    """W^-1(u), -1 <= u <= 1: S(u) or -T(-u) by quadrature from the nearest node, no interpolation.

    u = 1 gives the largest resolved xi, from which W returns 1 within rounding.
    """
    if u == 0.0:
        return 0.0
    if u > 0.0:
        q = math.log(u) - math.log1p(-u) if u < 1.0 else _HIGHEST
        return _integral_to(table.rising, _rising_rate(table.n, Scalar), min(q, _HIGHEST))
    return -_integral_to(table.falling, _falling_rate(table.n, table.curvature, Scalar), math.log(-u))


def stroke_start(table: Saturation, u: float) -> float:
    """xi where a stroke begins that takes over u: the inverse of the tabulated W itself.

    W^-1 by quadrature is exact, but W is not: without this last correction each reversal would change u by the
    difference, some 1e-13, which many small ones add up.
    """
    xi = inverse_saturation(table, u)
    error = saturation(table, xi) - u
    # Paper eq. (22).
    slope = 1.0 - u**table.n if u >= 0.0 else 1.0 + table.curvature * (-u) ** table.n
    # Where W is nearly level, xi matters little and cannot be told.
    return xi - error / slope if abs(error) * (1.0 + table.n) < _CORRECTED * slope else xi


def _integral_to(branch: Branch, rate: Any, p: float) -> float:
    if p <= branch.grid[0]:
        return float(branch.integral[0]) * math.exp(p - branch.grid[0])
    cell = Scalar.locate(branch.grid, p)
    return float(branch.integral[cell]) + float(quadrature(rate, branch.grid[cell], p))
