"""Normal equations of the integrated eq. (22), which the two-stage identification scans over n."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .arrays import FloatArray, address, floats, integers
from .library import library

_FLAT = 1e-9  # change of u below which it is called constant between two points


class IntegratedLine:
    """u(s) = u(0) + a*d(s) + b*r(s) on strokes, u(0) of each being free, with

        d = s - integral over u > 0 of u^n ds,    r = integral over u < 0 of (-u)^n ds.

    Between two points u is taken as a straight line and integrated exactly, across zero too.

    Parameters
    ----------
    first : ndarray of int, shape (S,)   First point of each stroke.
    travel : ndarray, shape (P,)         Distance from the beginning of the stroke [m], rising.
    u : ndarray, shape (P,)              Within [-1, 1].
    target : ndarray, shape (P,)         What the line is fitted to: u, or u with its noise beyond 1.
    weight : ndarray, shape (P,)
    """

    def __init__(
        self, first: NDArray[np.intp], travel: FloatArray, u: FloatArray, target: FloatArray, weight: FloatArray
    ) -> None:
        self._begin = integers(np.append(first, u.size))
        mean = np.add.reduceat(target * weight, first) / np.add.reduceat(weight, first)
        centred = target - np.repeat(mean, np.diff(self._begin))
        step, change = np.diff(travel, prepend=0.0), np.diff(u, prepend=0.0)
        step[first], change[first] = travel[first], 0.0
        flat = np.abs(change) < _FLAT
        per_change = np.where(flat, 0.0, step / np.where(flat, 1.0, change))
        self._columns = tuple(floats(column) for column in (travel, u, step, per_change, weight, centred))
        self.squared_target = float(weight @ centred**2)
        with np.errstate(divide="ignore"):
            self._log = np.log(np.abs(u))

    def sums(self, n: FloatArray) -> FloatArray:
        """Weighted sums of d*d, d*r, r*r, d*target and r*target without each stroke's means, shape (5, n)."""
        n = floats(n)
        powers = np.exp((n[:, None] + 1.0) * self._log) / (n[:, None] + 1.0)
        sums = np.empty((n.size, 5))
        library().spring_line_sums(
            self._begin.size - 1,
            address(self._begin),
            self._log.size,
            *map(address, self._columns),
            n.size,
            address(n),
            address(powers),
            address(sums),
        )
        return sums.T
