"""Moving average along strokes, the paper's first remedy against noise (section 3.3)."""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray
from ...loops.noise_levels import noise_level
from .sample_points import SamplePoints

# Smooth until the noise is below this share of the loop's half height...
_WANTED_NOISE = 0.01
# ...but never over more than this share of a stroke, where the loop's own shape would suffer.
_LARGEST_SHARE = 0.05


def moving_average(loops: SamplePoints, values: FloatArray, half_width: int) -> FloatArray:
    """Weighted mean over 2*half_width + 1 neighbours; the window shrinks symmetrically at the ends of a stroke.

    Parameters
    ----------
    loops : SamplePoints              Gives the stroke and weight of each point.
    values : ndarray, shape (P,)
    half_width : int                  0 leaves the values as they are.
    """
    if half_width == 0:
        return values
    position = np.arange(loops.stroke.size)
    begin, end = (np.repeat(ends, np.diff(loops.bounds)) for ends in (loops.bounds[:-1], loops.bounds[1:] - 1))
    reach = np.minimum(half_width, np.minimum(position - begin, end - position))
    low, high = position - reach, position + reach + 1
    sums, weights = (np.append(0.0, np.cumsum(column)) for column in (values * loops.weight, loops.weight))
    return np.asarray((sums[high] - sums[low]) / (weights[high] - weights[low]))


def automatic_half_width(loops: SamplePoints, omega: FloatArray) -> int:
    """Half width that brings the noise of `omega` below 1 % of its half height, which is 1."""
    wanted = (noise_level(omega) / _WANTED_NOISE) ** 2
    points_per_stroke = omega.size / (loops.bounds.size - 1)
    return int(min(0.5 * wanted, 0.5 * _LARGEST_SHARE * points_per_stroke))
