"""Power spectral densities of histories by Welch's method, with their statistical errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray, floats
from .averaging import LARGEST_SIGNAL, check_interval
from .level_table import check_frequency


@dataclass(frozen=True, eq=False)
class PowerSpectrum:
    """One-sided power spectral density of a history.

    Parameters
    ----------
    frequency : ndarray, shape (F,)    Multiples of the resolution from 0 on [Hz].
    density : ndarray, shape (F,)      [unit^2/Hz]
    averages : float                   Independent averages it is worth, fewer than the segments as these overlap.
    duration : float                   Of the history [s].
    """

    frequency: FloatArray
    density: FloatArray
    averages: float
    duration: float

    @property
    def resolution(self) -> float:
        """Distance of two frequencies [Hz]."""
        return float(self.frequency[1])

    @property
    def relative_error(self) -> float:
        """Standard error of the density at one frequency, as a share of it: 1/sqrt(averages)."""
        return 1.0 / math.sqrt(self.averages)

    @property
    def root_mean_square(self) -> float:
        """Of the history without its mean."""
        return math.sqrt(float(np.sum(self.density)) * self.resolution)

    @property
    def root_mean_square_error(self) -> float:
        """Standard error of the root mean square of a Gaussian history of this duration T, as a share of it.

        1/(2*sqrt(B*T)) with the bandwidth B = (integral of G)^2/(integral of G^2).
        """
        squares = float(np.sum(self.density**2))
        if squares == 0.0:
            return 0.0
        bandwidth = float(np.sum(self.density)) ** 2 / squares * self.resolution
        return 0.5 / math.sqrt(bandwidth * self.duration)


def power_spectrum(samples: ArrayLike, interval: float, resolution: float) -> PowerSpectrum:
    """Welch's estimate: segments of 1/resolution, Hann's window, an overlap of one half, the mean of each removed.

    Parameters
    ----------
    samples : array_like, shape (K,)    A stationary history.
    interval : float                    Between two samples [s].
    resolution : float                  Distance of two frequencies [Hz].

    Raises
    ------
    MountedSystemError                  If the history is shorter than a segment or has values that are not finite.
    """
    history = floats(samples)
    check_interval(interval)
    check_frequency(resolution, "the resolution of a power spectrum")
    if history.ndim != 1 or not np.all(np.abs(history) <= LARGEST_SIGNAL):
        raise MountedSystemError(
            f"A power spectrum needs a history of values in a row, finite and within +-{LARGEST_SIGNAL:g}."
        )
    length = 1.0 / (resolution * interval)
    if not 8.0 <= length <= history.size * (1.0 + 1e-9):
        raise MountedSystemError(
            f"A power spectrum with a resolution of {resolution:g} Hz needs segments of {1.0 / resolution:g} s within "
            f"the history of {history.size * interval:g} s, each of 8 samples or more; take another resolution."
        )
    from scipy.signal import welch  # slow to import, and only this needs it
    from scipy.signal.windows import hann

    segment = min(round(length), history.size)
    overlap = segment // 2
    frequency, density = welch(history, 1.0 / interval, "hann", segment, overlap, detrend="constant")
    segments = (history.size - overlap) // (segment - overlap)
    window = hann(segment, sym=False)
    shift = segment - overlap
    correlation = float(window[:overlap] @ window[shift : shift + overlap] / (window @ window)) ** 2
    averages = segments / (1.0 + 2.0 * (segments - 1) / segments * correlation)
    return PowerSpectrum(floats(frequency), floats(density), averages, history.size * interval)
