"""How far residuals are alike: from sample to sample, and from cycle to cycle, as misfit is and noise is not."""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray
from .sample_points import IndexArray, SamplePoints

CELLS = 24  # over the range, on each branch
_WINDOW = 5.0  # autocorrelation times summed over, beyond which the estimate is noise (Sokal's window)
_LONG = 1 << 16  # samples of a series whose length matters to its transform


def autocorrelation_time(series: FloatArray) -> float:
    """Integrated autocorrelation time 1 + 2*(c_1 + c_2 + ...) of a series, in samples; at least 1.

    The mean is not subtracted, since residuals have the expectation 0. The sum ends where the lag exceeds five times
    its value (Sokal, Functional Integration: Basics and Applications, 1997).

    Parameters
    ----------
    series : ndarray, shape (K,)   Residuals in the order of their samples.
    """
    power = float(series @ series)
    if power == 0.0:
        return 1.0
    size = 1 << (2 * series.size - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(series, size)) ** 2
    correlation = np.fft.irfft(spectrum, size)[: series.size] / power
    sums = 2.0 * np.cumsum(correlation) - 1.0
    inside = np.flatnonzero(np.arange(series.size) >= _WINDOW * sums)
    return max(1.0, float(sums[inside[0]] if inside.size else sums[-1]))


def fft_length(samples: int) -> int:
    """Length to which a long series is filled up with zeros, by 1/64 at most, lest its transform takes 20 times as
    long: that of a length with large prime factors does. A short one is left as it is.
    """
    step = 1 << (samples.bit_length() - 7) if samples > _LONG else 1
    return -(-samples // step) * step


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
