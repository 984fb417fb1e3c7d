"""Exact derivatives of omega with respect to rho, sigma, n and omega_start, along the strokes of a path.

u = W(xi; n, sigma) is the inverse of the integrals S and T of `saturation`, whose integrands depend on n and sigma at
a fixed u. With I(u) the integral and I_theta(u) its derivative at fixed u, xi = I(u) gives

    dW/dtheta = -W'(xi) * I_theta(u),        W'(xi) = du/dxi,

and I_theta is another quadrature of an analytic integrand on the same grid. On a stroke xi = xi0 + rho*s, and xi0 =
W^-1(u0) inherits its derivatives from the end of the stroke before, u0 = -u(end).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..core.saturation import GAUSS_3, Branch, Saturation, quadrature
from .path import FloatArray, IntArray, Vector, inherited_xi, saturation_of

Rate = Callable[[FloatArray], FloatArray]


class Sensitivity:
    """W, W' and dW/d(sigma, n) of one table, elementwise.

    Parameters
    ----------
    arrays, lists : Saturation   The same tables as arrays and as lists (`path.tables`).
    """

    def __init__(self, arrays: Saturation, lists: Saturation) -> None:
        self.arrays = arrays
        self.lists = lists
        n, c = arrays.n, arrays.curvature

        def rising_n(q: FloatArray) -> FloatArray:
            # d/dn of u(1 - u)/(1 - u^n): u(1 - u) u^n ln(u)/(1 - u^n)^2.
            log_u = -np.log1p(np.exp(-q))
            complement = -np.expm1(n * log_u)
            return np.asarray(np.exp((1.0 + n) * log_u) / (1.0 + np.exp(q)) * log_u / complement**2)

        def falling_n(y: FloatArray) -> FloatArray:
            power = c * np.exp(n * y)
            return np.asarray(-np.exp(y) * y * power / (1.0 + power) ** 2)

        def falling_sigma(y: FloatArray) -> FloatArray:
            # d(2 sigma - 1)/d(sigma) = 2.
            power = np.exp(n * y)
            return np.asarray(-2.0 * np.exp(y) * power / (1.0 + c * power) ** 2)

        self._rising_n = _Running(arrays.rising, rising_n)
        self._falling_n = _Running(arrays.falling, falling_n)
        self._falling_sigma = _Running(arrays.falling, falling_sigma)

    def __call__(self, xi: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """u, du/dxi, du/dsigma and du/dn at fixed xi."""
        u = saturation_of(self.arrays, xi)
        n, c = self.arrays.n, self.arrays.curvature
        up = u >= 0.0
        size = np.maximum(np.abs(u), 1e-300)
        slope = np.where(up, -np.expm1(n * np.log(size)), 1.0 + c * size**n)
        by_sigma, by_n = np.zeros_like(u), np.zeros_like(u)
        # u = 1 within rounding has no logit, and no derivative left.
        open_ = up & (u < 1.0) & (u > 0.0)
        q = np.log(u[open_]) - np.log1p(-u[open_])
        by_n[open_] = -slope[open_] * self._rising_n(q)
        down = ~up
        y = np.log(size[down])
        by_n[down] = slope[down] * self._falling_n(y)
        by_sigma[down] = slope[down] * self._falling_sigma(y)
        return u, slope, by_sigma, by_n


class _Running:
    """Integral of a rate from the left end of a branch's grid to given points, by quadrature from the nearest node.

    Over the grid's cells 3 points are good to 1e-8, which is plenty for a derivative.
    """

    def __init__(self, branch: Branch, rate: Rate) -> None:
        self.grid = branch.grid
        self.rate = rate
        pieces = quadrature(rate, self.grid[:-1], self.grid[1:], GAUSS_3)
        self.sums = np.concatenate([[0.0], np.cumsum(pieces)])

    def __call__(self, p: FloatArray) -> FloatArray:
        cell = Vector.locate(self.grid, p)
        inside = np.maximum(p, self.grid[0])
        return np.asarray(self.sums[cell] + quadrature(self.rate, self.grid[cell], inside, GAUSS_3))


def omega_with_derivatives(
    tables: tuple[Saturation, Saturation],
    rho: float,
    direction: IntArray,
    length: FloatArray,
    omega_start: float,
    stroke: IntArray,
    travel: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """omega at points of S consecutive strokes, and its derivatives.

    Parameters
    ----------
    tables : (Saturation, Saturation)    `path.tables(n, sigma)`.
    rho : float                          [1/m]
    direction, length : ndarray, shape (S,)   +1 or -1, alternating; length of each stroke [m].
    omega_start : float                  omega at the beginning of the first stroke.
    stroke, travel : ndarray, shape (P,)   Stroke of each point and its distance from the stroke's beginning [m].

    Returns
    -------
    omega : ndarray, shape (P,)
    derivatives : ndarray, shape (4, P)   With respect to rho, sigma, n and omega_start.
    """
    sensitivity = Sensitivity(*tables)
    _, lists = tables
    strokes = direction.size
    # Values first, in sequence and as floats; then all ends of strokes at once.
    begin = inherited_xi(lists, rho, length, direction, omega_start)
    _, slope_0, sigma_0, n_0 = sensitivity(begin)
    _, slope_1, sigma_1, n_1 = sensitivity(begin + rho * length)
    # d(xi0) of each stroke from d(u) at the end of the one before: u0 = -u1, and W(xi0; theta) = u0.
    of_start = np.zeros((strokes, 4))
    change = np.array([0.0, 0.0, 0.0, 1.0]) * direction[0]
    for k in range(strokes):
        of_start[k] = (change - [0.0, sigma_0[k], n_0[k], 0.0]) / max(slope_0[k], 1e-12)
        change = -(slope_1[k] * (of_start[k] + [length[k], 0.0, 0.0, 0.0]) + [0.0, sigma_1[k], n_1[k], 0.0])
    u, slope, by_sigma, by_n = sensitivity(begin[stroke] + rho * travel)
    derivatives = slope * of_start[stroke].T
    derivatives[0] += slope * travel
    derivatives[1] += by_sigma
    derivatives[2] += by_n
    side = direction[stroke]
    return side * u, derivatives * side
