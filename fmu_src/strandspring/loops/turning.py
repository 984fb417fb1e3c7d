"""Turning points of a path: where it reverses by more than a threshold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..kernel.arrays import FloatArray


def turning_points(displacement: FloatArray, threshold: float) -> NDArray[np.intp]:
    """First sample, reversals of at least `threshold` [m], last sample.

    The smallest swings are removed until none is below the threshold, as in rainflow counting: within the path both
    ends of a swing, at the start or the end of the path the outer one.
    """
    signs = np.sign(np.diff(displacement))
    moving = np.flatnonzero(signs)
    turns = moving[np.flatnonzero(np.diff(signs[moving])) + 1]
    points = np.concatenate([[0], turns, [displacement.size - 1]])
    while points.size > 2:
        span = np.abs(np.diff(displacement[points]))
        before = np.concatenate([[np.inf], span[:-1]])
        after = np.concatenate([span[1:], [np.inf]])
        # Local minima only, so that no two neighbours are removed at once and the larger swing always remains.
        small = (span < threshold) & (span <= before) & (span < after)
        if not small.any():
            break
        keep = np.ones(points.size, dtype=bool)
        keep[:-1] &= ~small
        keep[1:] &= ~small
        keep[1] |= small[0]
        keep[-2] |= small[-1]
        points = points[keep]
    points[[0, -1]] = 0, displacement.size - 1
    return points
