"""Moving average along strokes, the paper's first remedy against noise (section 3.3)."""

from __future__ import annotations

import numpy as np

from ..kernel.arrays import FloatArray
from ..loops.strokes import noise_level
from .loops import Loops

# Smooth until the noise is below this share of the loop's half height...
_WANTED_NOISE = 0.01
# ...but never over more than this share of a stroke, where the loop's own shape would suffer.
_LARGEST_SHARE = 0.05


def moving_average(loops: Loops, values: FloatArray, half_width: int) -> FloatArray:
    """Weighted mean over 2*half_width + 1 neighbours; the window shrinks symmetrically at the ends of a stroke.

    Parameters
    ----------
    loops : Loops                     Gives the stroke and weight of each point.
    values : ndarray, shape (P,)
    half_width : int                  0 leaves the values as they are.
    """
    if half_width == 0:
        return values
    first = np.flatnonzero(np.diff(loops.stroke, prepend=-1))
    sizes = np.diff(np.append(first, loops.stroke.size))
    position = np.arange(values.size)
    begin = np.repeat(first, sizes)
    end = begin + np.repeat(sizes, sizes) - 1
    reach = np.minimum(half_width, np.minimum(position - begin, end - position))
    sums = np.concatenate([[0.0], np.cumsum(values * loops.weight)])
    weights = np.concatenate([[0.0], np.cumsum(loops.weight)])
    low, high = position - reach, position + reach + 1
    return np.asarray((sums[high] - sums[low]) / (weights[high] - weights[low]))


def automatic_half_width(loops: Loops, omega: FloatArray) -> int:
    """Half width that brings the noise of `omega` below 1 % of its half height, which is 1."""
    wanted = (noise_level(omega) / _WANTED_NOISE) ** 2
    points_per_stroke = omega.size / max(1, np.unique(loops.stroke).size)
    return int(min(0.5 * wanted, 0.5 * _LARGEST_SHARE * points_per_stroke))
