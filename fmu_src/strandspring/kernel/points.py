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
    coarse: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """omega at points of S consecutive strokes, and its derivatives.

    Parameters
    ----------
    rho, sigma, n : float                     [1/m], [-], [-].
    omega_start : float                       omega at the beginning of the first stroke.
    direction, length : ndarray, shape (S,)   +1 or -1, alternating; length of each stroke [m].
    stroke, travel : ndarray, shape (P,)      Stroke of each point and its distance from the stroke's beginning [m].
    coarse : bool                             omega to 1e-8 only, the quicker for it where the points are few.

    Returns
    -------
    ndarray, shape (P,)
    ndarray, shape (4, P)                     By rho, sigma, n and omega_start.
    """
    # Bound to a name, or another thread that needs many tables might discard it while the kernel reads it.
    saturation = table(n, sigma, derivatives=True, coarse=coarse)
    omega, derivatives = np.empty((1, travel.size)), np.empty((4, travel.size))
    _at_points(
        saturation.address, np.array([rho]), omega_start, direction, length, stroke, travel, omega, address(derivatives)
    )
    return omega[0], derivatives


class RecordPoints:
    """Points of several records, each of consecutive strokes, for many springs.

    Parameters
    ----------
    first_stroke, first_point : ndarray, shape (R + 1,)   Of each record, and the number of all.
    direction, length : ndarray, shape (S,)               As of `omega_with_derivatives`.
    stroke, travel : ndarray, shape (P,)                  The same; strokes are numbered through all records.
    """

    def __init__(
        self,
        first_stroke: IntArray,
        first_point: IntArray,
        direction: IntArray,
        length: FloatArray,
        stroke: IntArray,
        travel: FloatArray,
    ) -> None:
        self.records, self.strokes, self.count = len(first_stroke) - 1, direction.size, travel.size
        self._arrays = (
            *(integers(column) for column in (first_stroke, first_point, direction)),
            floats(length),
            integers(stroke),
            floats(travel),
        )
        self.addresses = [address(array) for array in self._arrays]

    def omega(
        self, rho: float, sigma: float, n: float, omega_start: FloatArray, coarse: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """omega, shape (P,), and its derivatives by ln(rho), ln(sigma), ln(n) and each omega_start, shape (3 + R, P).

        Parameters
        ----------
        rho, sigma, n : float               [1/m], [-], [-].
        omega_start : ndarray, shape (R,)   omega at the beginning of each record.
        coarse : bool                       omega to 1e-8 only, the quicker for it where the points are few.
        """
        saturation = table(n, sigma, derivatives=True, coarse=coarse)
        found, starts, workspace = (
            np.empty((4 + self.records, self.count)),
            floats(omega_start),
            np.empty(5 * self.strokes),
        )
        begin = address(found)
        library().spring_on_records(
            saturation.address,
            rho,
            sigma,
            address(starts),
            self.records,
            *self.addresses,
            address(workspace),
            begin,
            begin + found.strides[0],
        )
        return found[0], found[1:]


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
    saturation = table(n, sigma, coarse=True)
    omega = np.empty((rho.size, travel.size))
    _at_points(saturation.address, floats(rho), 0.0, direction, length, stroke, travel, omega, None)
    return omega


def _at_points(
    saturation: int,
    rho: FloatArray,
    omega_start: float,
    direction: IntArray,
    length: FloatArray,
    stroke: IntArray,
    travel: FloatArray,
    omega: FloatArray,
    derivatives: int | None,
) -> None:
    """Fill `omega`, one row for each rho, and the derivatives at their address."""
    direction, length, stroke, travel = integers(direction), floats(length), integers(stroke), floats(travel)
    workspace = np.empty(5 * direction.size)
    library().spring_at_points(
        saturation,
        rho.size,
        address(rho),
        omega_start,
        direction.size,
        address(direction),
        address(length),
        travel.size,
        address(stroke),
        address(travel),
        address(workspace),
        address(omega),
        derivatives,
    )
