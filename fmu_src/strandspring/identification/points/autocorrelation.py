"""How many independent samples a series of residuals is worth."""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray

_WINDOW = 5.0  # autocorrelation times summed over, beyond which the estimate is noise (Sokal's window)


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
