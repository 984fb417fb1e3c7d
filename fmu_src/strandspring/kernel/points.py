"""omega at points of given strokes, with exact derivatives, for those who fit springs to records.

u = W(xi; n, sigma) is the inverse of the integrals S and T of `core.saturation`, whose integrands depend on n and sigma
at a fixed u. With I(u) the integral and I_theta(u) its derivative at fixed u, xi = I(u) gives

    dW/dtheta = -W'(xi) * I_theta(u),        W'(xi) = du/dxi.

On a stroke xi = xi0 + rho*s, and xi0 = W^-1(u0) inherits its derivatives from the end of the stroke before,
u0 = -u(end).
"""

from __future__ import annotations

import numpy as np

from .arrays import FloatArray, IntArray, address, floats, integers
from .library import library
from .saturation_table import table


def omega_with_derivatives(
    rho: float,
    sigma: float,
    n: float,
    omega_start: float,
    direction: IntArray,
    length: FloatArray,
    stroke: IntArray,
    travel: FloatArray,
    derivatives: bool = True,
    coarse: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """omega at points of S consecutive strokes, and its derivatives.

    Parameters
    ----------
    rho, sigma, n : float                     [1/m], [-], [-].
    omega_start : float                       omega at the beginning of the first stroke.
    direction, length : ndarray, shape (S,)   +1 or -1, alternating; length of each stroke [m].
    stroke, travel : ndarray, shape (P,)      Stroke of each point and its distance from the stroke's beginning [m].
    derivatives : bool                        Whether they are wanted.
    coarse : bool                             omega to 1e-8 only, the quicker for it where the points are few.

    Returns
    -------
    ndarray, shape (P,)
    ndarray, shape (4, P)                     By rho, sigma, n and omega_start; no rows if they are not wanted.
    """
    direction, length, stroke, travel = integers(direction), floats(length), integers(stroke), floats(travel)
    omega = np.empty(travel.size)
    partials = np.empty((4 if derivatives else 0, travel.size))
    # Bound to a name, or another thread that needs many tables might discard it while the kernel reads it.
    saturation = table(n, sigma, derivatives, coarse=coarse)
    workspace = np.empty(5 * direction.size)
    library().spring_at_points(
        saturation.address,
        rho,
        omega_start,
        direction.size,
        address(direction),
        address(length),
        travel.size,
        address(stroke),
        address(travel),
        address(workspace),
        address(omega),
        address(partials) if derivatives else None,
    )
    return omega, partials


def omega_by_rate(
    rho: FloatArray,
    sigma: float,
    n: float,
    direction: IntArray,
    length: FloatArray,
    stroke: IntArray,
    travel: FloatArray,
) -> FloatArray:
    """omega to 1e-8 for each rho, from omega = 0; arguments as of `omega_with_derivatives`.

    Returns
    -------
    ndarray, shape (rho.size, P)
    """
    rho, direction, length = floats(rho), integers(direction), floats(length)
    stroke, travel = integers(stroke), floats(travel)
    omega = np.empty((rho.size, travel.size))
    saturation = table(n, sigma, coarse=True)
    workspace = np.empty(5 * direction.size)
    library().spring_at_points_by_rate(
        saturation.address,
        rho.size,
        address(rho),
        direction.size,
        address(direction),
        address(length),
        travel.size,
        address(stroke),
        address(travel),
        address(workspace),
        address(omega),
    )
    return omega
