"""Least squares with coefficients that may not be negative, from the normal equations."""

from __future__ import annotations

import numpy as np

from ..kernel.arrays import BoolArray, FloatArray


def nonnegative(G: FloatArray, g: FloatArray, free: BoolArray) -> tuple[FloatArray, BoolArray]:
    """The c >= 0 with the least c*G*c/2 - g*c, by block principal pivoting.

    Every step solves for the coefficients that are not at 0 and exchanges those with a wrong sign; where that does not
    lower their number, only the last of them, which ends (Portugal, Judice and Vicente 1994).

    Parameters
    ----------
    G : ndarray, shape (p, p)             Positive definite.
    g : ndarray, shape (p,)
    free : ndarray of bool, shape (p,)    Coefficients that may be negative.

    Returns
    -------
    c : ndarray, shape (p,)
    inside : ndarray of bool, shape (p,)  Those that are not held at 0.
    """
    inside = np.ones(g.size, bool)
    # Exchanges of the whole set that may leave no fewer wrong signs, before one at a time is exchanged.
    least, patience = g.size + 1, 3
    c = np.zeros(g.size)
    for _ in range(100):
        c = np.zeros(g.size)
        c[inside] = np.linalg.solve(G[inside][:, inside], g[inside])
        gradient = G @ c - g
        small = 1e-10 * float(np.abs(g).max(initial=0.0))
        wrong = (inside & ~free & (c < 0.0)) | (~inside & (gradient < -small))
        count = int(wrong.sum())
        if not count:
            return c, inside
        if count < least:
            least, patience = count, 3
        elif patience:
            patience -= 1
        else:
            wrong[: int(np.flatnonzero(wrong)[-1])] = False
        inside ^= wrong
    return np.where(free, c, np.maximum(c, 0.0)), inside
