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
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

# Gauss-Legendre nodes and weights on [-1, 1], exact for degree 15.
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

# Degree of the interpolant per cell; with these cells its error is below 1e-13 in u.
_DEGREE = 9
_CELL = 0.9  # width of a cell of the rising branch in t
_CHEBYSHEV = tuple(math.cos(math.pi * (1.0 - k / _DEGREE)) for k in range(_DEGREE + 1))

_LOWEST = -32.0  # ln of the smallest u resolved, 1.3e-14: below it W is a straight line
_HIGHEST = 40.0  # logit of the largest u resolved: above it 1 - u < 5e-18, which a double cannot hold
_QUADRATURE_STEP = 0.25  # cell of the quadrature in q
_LEAST_XI = 1e-300  # below it xi counts as this, so that it has a logarithm
_LARGEST_CORRECTION = 1e-3  # of the distance in which W bends, the most by which `stroke_start` corrects xi
_MOST_TERMS = 1000  # of a series, however the host rounds; 200 are the most that count
_NEWTON_STEPS = 3  # quadratic convergence from a linear start within a cell: 1e-2, 1e-4, 1e-8, 1e-16


@dataclass(frozen=True)
class SaturationBranch:
    """Quadrature grid and interpolation cells of one of the two integrals.

    Attributes
    ----------
    rate : callable                Derivative of the integral by p.
    grid, integral : list          Quadrature nodes in p (q or y) and the integral |xi| up to each.
    edges : list                   Cell edges in the abscissa a (t or ln(-xi)).
    polynomials : list of tuples   Of each cell, coefficients of theta in [-1, 1] by descending powers.
    """

    rate: Callable[[float], float]
    grid: list[float]
    integral: list[float]
    edges: list[float]
    polynomials: list[tuple[float, ...]]


class Saturation:
    """Tables of W for one pair (n, sigma), built once and read by the functions of this module."""

    __slots__ = ("curvature", "falling", "n", "rising")

    def __init__(self, n: float, sigma: float) -> None:
        self.n = n
        self.curvature = 2.0 * sigma - 1.0
        self.rising = _rising_branch(n)
        self.falling = _falling_branch(n, self.curvature)


def saturation(table: Saturation, xi: float) -> float:
    """W(xi): u = d*omega after the scaled distance xi from its zero crossing."""
    if xi >= 0.0:
        return 1.0 / (1.0 + math.exp(-_logit(table, xi)))
    zeta = -xi
    a = math.log(max(zeta, _LEAST_XI))
    return -min(zeta * math.exp(_interpolate(table.falling, a)), 1.0)


def inverse_saturation(table: Saturation, u: float) -> float:
    """W^-1(u), -1 <= u <= 1: S(u) or -T(-u) by quadrature from the nearest node, no interpolation.

    u = 1 gives the largest resolved xi, from which W returns 1 within rounding.
    """
    if u == 0.0:
        return 0.0
    if u > 0.0:
        q = math.log(u) - math.log1p(-u) if u < 1.0 else _HIGHEST
        return _integral_to(table.rising, min(q, _HIGHEST))
    return -_integral_to(table.falling, math.log(-u))


def stroke_start(table: Saturation, u: float) -> float:
    """xi where a stroke begins that takes over u: the inverse of the tabulated W itself.

    W^-1 by quadrature is exact, but W is not: without this last correction each reversal would change u by the
    difference, some 1e-13, which many small ones add up.
    """
    xi = inverse_saturation(table, u)
    error = saturation(table, xi) - u
    # Paper eq. (22).
    slope = 1.0 - u**table.n if u >= 0.0 else 1.0 + table.curvature * (-u) ** table.n
    # Where W is nearly level, xi matters little and cannot be determined.
    return xi - error / slope if abs(error) * (1.0 + table.n) < _LARGEST_CORRECTION * slope else xi


def xi_of_abscissa(n: float, t: float) -> float:
    """xi = ln(1 + e^t)/n, written so that a large t does not overflow."""
    return (max(t, 0.0) + math.log1p(math.exp(-abs(t)))) / n


def _abscissa(n: float, xi: float) -> float:
    """t = ln(expm1(n*xi)), xi > 0."""
    scaled = n * xi
    return scaled + math.log(-math.expm1(-scaled))


def _logit(table: Saturation, xi: float) -> float:
    """q = logit(W(xi)), xi >= 0."""
    t = _abscissa(table.n, max(xi, _LEAST_XI))
    return t + _interpolate(table.rising, t)


def _interpolate(branch: SaturationBranch, abscissa: float) -> float:
    cell = _cell_of(branch.edges, abscissa)
    low, high = branch.edges[cell], branch.edges[cell + 1]
    theta = min(max((2.0 * abscissa - low - high) / (high - low), -1.0), 1.0)
    total = 0.0
    for coefficient in branch.polynomials[cell]:
        total = total * theta + coefficient
    return total


def _integral_to(branch: SaturationBranch, p: float) -> float:
    """The integral up to p; below the grid it is proportional to e^p."""
    if p <= branch.grid[0]:
        return branch.integral[0] * math.exp(p - branch.grid[0])
    cell = _cell_of(branch.grid, p)
    return branch.integral[cell] + _quadrature(branch.rate, branch.grid[cell], p)


def _cell_of(edges: Sequence[float], value: float) -> int:
    """Index of the cell [edges[i], edges[i+1]] that holds `value`; the first or last one outside."""
    return bisect_right(edges, value, 1, len(edges) - 1) - 1


def _rising_branch(n: float) -> SaturationBranch:
    def rate(q: float) -> float:
        """d(xi)/dq = u*(1 - u)/(1 - u^n) with u = logistic(q), free of cancellation at both ends."""
        decay = math.exp(-q)
        log_u = -math.log1p(decay)
        return math.exp(log_u) * (decay / (1.0 + decay)) / -math.expm1(n * log_u)

    cells = round((_HIGHEST - _LOWEST) / _QUADRATURE_STEP)
    grid = [_LOWEST + _QUADRATURE_STEP * k for k in range(cells + 1)]
    integral = _integrals(rate, grid, _rising_series(n, 1.0 / (1.0 + math.exp(-_LOWEST))))
    first, last = _abscissa(n, integral[0]), _abscissa(n, integral[-1])
    count = math.ceil((last - first) / _CELL)
    width = (last - first) / count
    edges = [first + width * k for k in range(count)] + [last]
    return _branch(rate, grid, integral, edges, lambda t: xi_of_abscissa(n, t))


def _rising_series(n: float, u: float) -> float:
    """S(u) = sum of u^(k n + 1)/(k n + 1), k = 0, 1, ..., for a small u."""
    factor, power, total = math.pow(u, n), u, u
    for k in range(1, _MOST_TERMS + 1):
        power *= factor
        before, total = total, total + power / (k * n + 1.0)
        if total == before:
            break
    return total


def _falling_series(n: float, curvature: float, w: float) -> float:
    """T(w) for a small w: with p = (2 sigma - 1) w^n it is the sum of

        w/(1 + p) * k!/((1 + 1/n) (2 + 1/n) ... (k + 1/n)) * (p/(1 + p))^k,    k = 0, 1, ...,

    2F1 after Pfaff's transformation, which converges for every p.
    """
    p = curvature * math.pow(w, n)
    term = total = w / (1.0 + p)
    for k in range(1, _MOST_TERMS + 1):
        term *= k / (k + 1.0 / n) * (p / (1.0 + p))
        before, total = total, total + term
        if total == before:
            break
    return total


def _falling_branch(n: float, curvature: float) -> SaturationBranch:
    def rate(y: float) -> float:
        """d(-xi)/dy = w/(1 + (2 sigma - 1) w^n) with w = exp(y)."""
        return math.exp(y) / (1.0 + curvature * math.exp(n * y))

    # Below this w the term (2 sigma - 1) w^n is lost in rounding and T(w) = w.
    lowest = max(_LOWEST, -(36.0 + math.log1p(curvature)) / n)
    # A cell may span half an e-fold in w and a quarter of e-fold in w^n: the nearest pole of the integrand,
    # (2 sigma - 1) w^n = -1, is then at least four half cells away from the next cell.
    count = math.ceil(-lowest / min(0.5, 0.25 / n))
    grid = [lowest * (1.0 - k / count) for k in range(count + 1)]
    integral = _integrals(rate, grid, _falling_series(n, curvature, math.exp(lowest)))
    return _branch(rate, grid, integral, [math.log(zeta) for zeta in integral], math.exp)


def _quadrature(rate: Callable[[float], float], start: float, end: float) -> float:
    """Integral of `rate` from `start` to `end`."""
    half = 0.5 * (end - start)
    middle = 0.5 * (end + start)
    total = 0.0
    for node, weight in GAUSS_8:
        total += weight * rate(middle + half * node)
    return half * total


def _integrals(rate: Callable[[float], float], grid: Sequence[float], start: float) -> list[float]:
    """The integral up to each node, `start` at the first: each sum is exact, for W' may multiply its error by 2000."""
    pieces = [start, *(_quadrature(rate, a, b) for a, b in pairwise(grid))]
    return [math.fsum(pieces[: k + 1]) for k in range(len(pieces))]


def _branch(
    rate: Callable[[float], float],
    grid: list[float],
    integral: list[float],
    edges: list[float],
    xi_of: Callable[[float], float],
) -> SaturationBranch:
    """The branch with the interpolant p - a on each cell of the abscissa a, where `xi_of` gives |xi|."""
    polynomials = []
    for low, high in pairwise(edges):
        points = [0.5 * ((1.0 - theta) * low + (1.0 + theta) * high) for theta in _CHEBYSHEV]
        polynomials.append(_interpolant([_invert(rate, grid, integral, xi_of(a)) - a for a in points]))
    return SaturationBranch(rate, grid, integral, edges, polynomials)


def _invert(rate: Callable[[float], float], grid: Sequence[float], integral: Sequence[float], target: float) -> float:
    """The parameter p at which the integral reaches the target: Newton's method on the quadrature."""
    cell = _cell_of(integral, target)
    origin, base = grid[cell], integral[cell]
    share = min(max((target - base) / (integral[cell + 1] - base), 0.0), 1.0)
    p = origin + (grid[cell + 1] - origin) * share
    for _ in range(_NEWTON_STEPS):
        p += (target - base - _quadrature(rate, origin, p)) / rate(p)
    return p


def _monomials_from_chebyshev_values() -> list[list[float]]:
    """Rows that turn values at the Chebyshev points into coefficients of powers of theta in [-1, 1], highest first."""
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
    return [[basis[j][power] for j in range(size)] for power in range(_DEGREE, -1, -1)]


_TO_MONOMIALS = _monomials_from_chebyshev_values()


def _interpolant(values: Sequence[float]) -> tuple[float, ...]:
    """Coefficients by descending powers from values at the Chebyshev points."""
    # Of differences from the middle, or the matrix would magnify the rounding of large values.
    middle = values[_DEGREE // 2]
    differences = [value - middle for value in values]
    coefficients = [
        sum(factor * value for factor, value in zip(row, differences, strict=True)) for row in _TO_MONOMIALS
    ]
    coefficients[-1] += middle
    return tuple(coefficients)
