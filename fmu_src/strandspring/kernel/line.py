"""Normal equations of the integrated eq. (22), which the two-stage identification scans over n."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .arrays import FloatArray, address, floats, integers
from .library import library

_FLAT = 1e-9  # change of u below which it is called constant between two points


class IntegratedLines:
    """Lines u(s) = u(0) + a*d(s) + b*r(s) along strokes, u(0) of each stroke being free, with

        d = s - integral over u > 0 of u^n ds,    r = integral over u < 0 of (-u)^n ds.

    Between two points u is taken as a straight line and integrated exactly, across zero too.

    Parameters
    ----------
    first : ndarray of int, shape (S,)    First point of each stroke.
    travel : ndarray, shape (P,)          Distance from the beginning of the stroke [m], rising.
    u : ndarray, shape (L, P)             Of each line, within [-1, 1].
    target : ndarray, shape (L, P)        What the line is fitted to: u, or u with its noise beyond 1.
    weight : ndarray, shape (L, P)
    """

    def __init__(
        self, first: NDArray[np.intp], travel: FloatArray, u: FloatArray, target: FloatArray, weight: FloatArray
    ) -> None:
        self._begin = integers(np.append(first, travel.size))
        mean = np.add.reduceat(target * weight, first, axis=1) / np.add.reduceat(weight, first, axis=1)
        centred = target - np.repeat(mean, np.diff(self._begin), axis=1)
        step, change = np.diff(travel, prepend=0.0), np.diff(u, prepend=0.0)
        step[first], change[:, first] = travel[first], 0.0
        per_change = np.divide(step, change, out=np.zeros(u.shape), where=np.abs(change) >= _FLAT)
        self._shared = self._begin, floats(travel), step
        self._columns = floats(u), per_change, floats(weight), centred
        self.squared_target = np.sum(weight * centred**2, axis=1)
        with np.errstate(divide="ignore"):
            self._log = np.log(np.abs(u))

    def sums(self, n: FloatArray) -> FloatArray:
        """Weighted sums of d*d, d*r, r*r, d*target and r*target without each stroke's means, shape (5, L, N).

        Parameters
        ----------
        n : ndarray, shape (L, N)   Tried on each line.
        """
        sums = np.empty((*n.shape, 5))
        begin, travel, step = map(address, self._shared)
        for own_n, log, own_sums, u, *others in zip(floats(n), self._log, sums, *self._columns, strict=True):
            powers = np.multiply.outer(own_n + 1.0, log)
            np.exp(powers, out=powers)
            powers /= own_n[:, None] + 1.0
            library().spring_line_sums(
                self._begin.size - 1,
                begin,
                log.size,
                travel,
                address(u),
                step,
                *map(address, others),
                own_n.size,
                address(own_n),
                address(powers),
                address(own_sums),
            )
        return sums.transpose(2, 0, 1)
