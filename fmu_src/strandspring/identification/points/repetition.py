"""How much of the residuals comes back in every cycle, as misfit of the model does and noise does not."""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray
from .sample_points import IndexArray, SamplePoints

CELLS = 24  # over the range, on each branch


def repetition(loops: SamplePoints, residuals: FloatArray) -> float:
    """Factor on the variance of coefficients: what comes back in every cycle does not average out over cycles.

    It is 1 for noise and the number of cycles where all of them have the same residuals.
    """
    return 1.0 + float(loops.cycles().max()) * repeated_share(loops, residuals)


def branch_cells(loops: SamplePoints) -> IndexArray:
    """Cell of each point: CELLS over the range on unloading, then as many on loading."""
    low, high = loops.reach
    place = np.clip(((loops.displacement - low) / (high - low) * CELLS).astype(np.intp), 0, CELLS - 1)
    return np.asarray(place + CELLS * (loops.side > 0), np.intp)


def repeated_share(loops: SamplePoints, residuals: FloatArray) -> float:
    """Correlation between the residuals of different cycles at the same place and in the same direction.

    Parameters
    ----------
    loops : SamplePoints
    residuals : ndarray, shape (P,)

    Returns
    -------
    float   From 0 to 1; 0 with one cycle.
    """
    cycle = loops.cycles()
    cells = branch_cells(loops)
    shape = (int(cycle.max()) + 1, 2 * CELLS)
    flat = cycle * shape[1] + cells
    count = np.bincount(flat, minlength=shape[0] * shape[1]).reshape(shape)
    total = np.bincount(flat, weights=residuals, minlength=shape[0] * shape[1]).reshape(shape)
    mean = total / np.maximum(count, 1)
    times = (count > 0).sum(axis=0)
    squares = (mean**2).sum(axis=0)
    # Of n cycles in a cell, the products of different ones against what they would be if all were alike.
    alike = float(np.maximum(times - 1, 0) @ squares)
    return max(0.0, float(np.sum(mean.sum(axis=0) ** 2 - squares)) / alike) if alike > 0.0 else 0.0
