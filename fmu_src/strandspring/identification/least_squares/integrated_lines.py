"""Normal equations of the integrated eq. (22), which the two-stage identification scans over n."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import FloatArray

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
        self._first, self._lengths, self._travel = first, np.diff(first, append=travel.size), travel
        weights = np.add.reduceat(weight, first, axis=1)
        mean = np.add.reduceat(target * weight, first, axis=1) / weights
        centred = target - np.repeat(mean, self._lengths, axis=1)
        self.squared_target = np.sum(weight * centred**2, axis=1)
        step, change = np.diff(travel, prepend=0.0), np.diff(u, prepend=0.0)
        step[first], change[:, first] = travel[first], 0.0
        changes = np.abs(change) >= _FLAT
        per_change = np.divide(step, change, out=np.zeros(u.shape), where=changes)
        flat = np.divide(step, np.abs(u), out=np.zeros(u.shape), where=~changes & (u != 0.0))
        with np.errstate(divide="ignore"):
            log = np.log(np.abs(u))
        self._lines = log, u, per_change, flat, weight, 1.0 / weights, centred

    def sums(self, n: FloatArray) -> FloatArray:
        """Weighted sums of d*d, d*r, r*r, d*target and r*target without each stroke's means, shape (5, L, N).

        Parameters
        ----------
        n : ndarray, shape (L, N)   Tried on each line.
        """
        sums = np.empty((5, *n.shape))
        first = self._first
        for k, (exponent, log, u, per_change, flat, weight, per_weights, target) in enumerate(
            zip(n[:, :, None] + 1.0, *self._lines, strict=True)
        ):
            powers = np.exp(exponent * log) / exponent
            terms = np.empty((2, *powers.shape))  # d and r
            for term, side in zip(terms, (1.0, -1.0), strict=True):
                is_here = side * u > 0.0
                level = np.flatnonzero(is_here & (flat > 0.0))
                rises = powers * (side * per_change * is_here)
                rises[:, 1:] -= powers[:, :-1] * (side * per_change[1:] * is_here[:-1])
                rises[:, level] += exponent * flat[level] * powers[:, level]
                # Each stroke begins at 0.
                rises[:, first[1:]] -= np.add.reduceat(rises, first, axis=1)[:, :-1]
                np.cumsum(rises, axis=1, out=term)
            np.subtract(self._travel, terms[0], out=terms[0])
            weighted = weight * terms
            of_strokes = np.add.reduceat(weighted, first, axis=2)
            for row, (a, b) in enumerate(((0, 0), (0, 1), (1, 1))):
                means = np.einsum("ns,ns,s->n", of_strokes[a], of_strokes[b], per_weights)
                sums[row, k] = np.einsum("np,np->n", weighted[a], terms[b]) - means
            sums[3:, k] = weighted @ target
        return sums
