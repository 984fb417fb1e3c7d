"""What residuals say of the noise in a record: how much of them is white, how alike they are, and how they grow."""

from __future__ import annotations

import numpy as np

from ..kernel.arrays import FloatArray

_WINDOW = 5.0  # autocorrelation times summed over, beyond which the estimate is noise (Sokal's window)
_ROUNDS = 3  # of regressing squared residuals, each weighted by the variances before
_SEEN = 4.0  # standard errors from which noise grows with the force
_LEAST = 0.01  # variance of a row's noise in the mean of all


def white_variance(residuals: FloatArray) -> float:
    """Variance of what differs from row to row, shape (P,): half the mean squared difference of neighbours."""
    return 0.5 * float(np.mean(np.diff(residuals) ** 2))


def autocorrelation_time(residuals: FloatArray) -> float:
    """1 + 2*(c_1 + c_2 + ...) in rows, at least 1, up to where the lag exceeds five times the sum (Sokal 1997)."""
    power = float(residuals @ residuals)
    if power == 0.0:
        return 1.0
    size = 1 << (2 * residuals.size - 1).bit_length()
    correlation = np.fft.irfft(np.abs(np.fft.rfft(residuals, size)) ** 2, size)[: residuals.size] / power
    sums = 2.0 * np.cumsum(correlation) - 1.0
    beyond = np.flatnonzero(np.arange(residuals.size) >= _WINDOW * sums)
    return max(1.0, float(sums[beyond[0]] if beyond.size else sums[-1]))


def growing_variance(force: FloatArray, residuals: FloatArray) -> tuple[float, float]:
    """a^2 and b^2 of residuals whose variance is a^2 + (b*force)^2; b = 0 where it is not seen.

    Squared residuals are regressed on the squared force, each over the variance that the regression before gave.
    """
    squares = residuals**2
    mean = max(float(squares.mean()), 1e-300)
    columns = np.stack([np.ones(force.size), force**2 / max(float(np.mean(force**2)), 1e-300)], axis=1)
    variance = np.full(force.size, mean)
    for _ in range(_ROUNDS):
        H = (columns / variance[:, None] ** 2).T @ columns + 1e-9 / mean**2 * np.eye(2)
        a, b = np.linalg.solve(H, columns.T @ (squares / variance**2)).tolist()
        variance = np.maximum(columns @ [a, b], _LEAST * mean)
    # The variance of a squared residual is 2*variance^2.
    if b < _SEEN * float(np.sqrt(2.0 * np.linalg.inv(H)[1, 1])):
        return mean, 0.0
    return max(a, _LEAST * mean), b / float(np.mean(force**2))
