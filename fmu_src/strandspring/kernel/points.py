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


class RecordPoints:
    """Points of several records, each of consecutive strokes, for many springs.

    Parameters
    ----------
    first_stroke, first_point : ndarray, shape (R + 1,)   Of each record, and the number of all.
    direction, length : ndarray, shape (S,)   +1 or -1, alternating; length of each stroke [m].
    stroke, travel : ndarray, shape (P,)      Stroke of each point, numbered through all records, and its distance from
                                              the stroke's beginning [m].
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
        self._arrays = {
            "first_stroke": integers(first_stroke),
            "first_point": integers(first_point),
            "direction": integers(direction),
            "length": floats(length),
            "stroke": integers(stroke),
            "travel": floats(travel),
        }
        self._addresses = {name: address(array) for name, array in self._arrays.items()}

    def omega(
        self, rho: float, sigma: float, n: float, omega_start: FloatArray, coarse: bool = False
    ) -> tuple[FloatArray, FloatArray]:
        """omega, shape (P,), and its derivatives by ln(rho), ln(sigma), ln(n) and the record's omega_start, (4, P).

        Parameters
        ----------
        rho, sigma, n : float               [1/m], [-], [-].
        omega_start : ndarray, shape (R,)   omega at the beginning of each record.
        coarse : bool                       omega to 1e-8 only, the quicker for it where the points are few.
        """
        # Bound to a name, or another thread that needs many tables might discard it while the kernel reads it.
        saturation = table(n, sigma, derivatives=True, coarse=coarse)
        rows = np.empty((5, self.count))
        derivatives = rows[1:]
        self._fill(saturation.address, np.array([rho]), floats(omega_start), rows, address(derivatives))
        return rows[0], derivatives

    def omega_by_rate(self, rho: FloatArray, sigma: float, n: float) -> FloatArray:
        """omega to 1e-8 for each rho, each record beginning with omega = 0, shape (rho.size, P)."""
        saturation = table(n, sigma, coarse=True)
        omega = np.empty((rho.size, self.count))
        self._fill(saturation.address, floats(rho), np.zeros(self.records), omega, None)
        return omega

    def _fill(
        self, saturation: int, rho: FloatArray, omega_start: FloatArray, omega: FloatArray, derivatives: int | None
    ) -> None:
        workspace = np.empty(5 * self.strokes)
        library().spring_on_records(
            saturation,
            rho.size,
            address(rho),
            address(omega_start),
            self.records,
            *self._addresses.values(),
            address(workspace),
            address(omega),
            derivatives,
        )
