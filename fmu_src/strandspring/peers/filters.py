"""Filters against heavy noise, before the identification (paper section 3.3).

Both choose their cut-off from the record's noise: with the noise power v per coefficient read off
the highest frequencies, a filter of gain g leaves of a coefficient of power P the expected squared error

    (1 - g)^2*(P - v) + g^2*v,

signal lost plus noise kept, and the cut-off is the one with the least sum. A record without noise keeps everything
that stands above its own highest harmonics.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.fft import dct
from scipy.signal import butter, sosfiltfilt

from ..kernel.arrays import FloatArray

_ORDER = 4  # of the Butterworth filter, which runs forth and back
_CUTOFFS = 60  # tried between one half cycle per record and the Nyquist frequency
_FEWEST = 16  # samples


def low_pass(force: FloatArray) -> FloatArray:
    """Zero-phase Butterworth low-pass of order 4, run forth and back, on samples uniform in time.

    At the cut-off a quarter of the power, half of the amplitude, is left.

    Parameters
    ----------
    force : ndarray, shape (K,)   [N], or any other signal.

    Returns
    -------
    ndarray, shape (K,)           [N]

    Raises
    ------
    ValueError                    If there are fewer than 16 samples.
    """
    values = _checked(force)
    cutoff = _cutoff_of_noise(values)
    if cutoff is None:
        return values.copy()
    sections = butter(_ORDER, 2.0 * cutoff, output="sos")
    # The transient at the ends lasts about a period of the cut-off frequency for each order.
    padding = min(values.size - 1, math.ceil(_ORDER / cutoff))
    width = min(values.size, max(2, math.ceil(0.25 / cutoff)))
    head = 2.0 * _end_value(values[:width]) - values[padding:0:-1]
    tail = 2.0 * _end_value(values[: -width - 1 : -1]) - values[-2 : -padding - 2 : -1]
    smooth = sosfiltfilt(sections, np.concatenate([head, values, tail]), padlen=0)
    return np.asarray(smooth[padding : padding + values.size])


def fourier_filter(force: FloatArray, periods: int) -> FloatArray:
    """Ni's non-causal filter: the discrete Fourier series over whole periods without its high harmonics.

    What lies between the harmonics goes as well, so that every period comes out the same.

    Parameters
    ----------
    force : ndarray, shape (K,)   Exactly `periods` whole periods at uniform phases [N].
    periods : int                 Number of periods in it, >= 1.

    Returns
    -------
    ndarray, shape (K,)           [N]

    Raises
    ------
    ValueError                    If there are fewer than 16 samples in a period.
    """
    values = _checked(force)
    if values.size < _FEWEST * periods:
        raise ValueError(
            f"`force` must have at least {_FEWEST} samples per period, got {values.size} for {periods} periods."
        )
    spectrum = np.fft.rfft(values)
    harmonics = _harmonics_of_noise(np.abs(spectrum[::periods]) ** 2)
    kept = np.zeros(spectrum.size)
    kept[: harmonics * periods + 1 : periods] = 1.0
    return np.fft.irfft(spectrum * kept, values.size)


def _end_value(values: FloatArray) -> float:
    """First of the values on their straight line: reflected about the sample itself, its noise would stay."""
    position = np.arange(values.size)
    return float(np.polyval(np.polyfit(position, values, 1), 0.0))


def _harmonics_of_noise(power: FloatArray) -> int:
    """Number of harmonics with the least expected error; ``power[h]`` belongs to harmonic h."""
    noise = _floor(power)
    # A harmonic kept costs v, one dropped costs P - v.
    change = np.cumsum(2.0 * noise - power[1:])
    return int(np.argmin(change)) + 1


def _cutoff_of_noise(values: FloatArray) -> float | None:
    """Cut-off of `low_pass` with the least expected error [cycles per sample]; None if no filter does better."""
    # The cosine transform continues a signal evenly, so that ends of different height make no high frequencies.
    power = dct(values, norm="ortho")[1:] ** 2
    noise = _floor(power)
    frequency = 0.5 * np.arange(1, values.size) / values.size
    signal = power - noise
    best, least = None, noise * power.size
    for cutoff in np.geomspace(frequency[0], 0.45, _CUTOFFS):
        gain = 1.0 / (1.0 + (np.tan(math.pi * frequency) / math.tan(math.pi * cutoff)) ** (2 * _ORDER))
        error = float(np.sum((1.0 - gain) ** 2 * signal + gain**2 * noise))
        if error < least:
            best, least = float(cutoff), error
    return best


def _floor(power: FloatArray) -> float:
    """Noise power per coefficient: the mean of the upper half of the frequencies."""
    return float(np.mean(power[power.size // 2 :]))


def _checked(force: FloatArray) -> FloatArray:
    values = np.asarray(force, dtype=np.float64)
    if values.ndim != 1 or values.size < _FEWEST:
        raise ValueError(f"`force` must have shape (K,) with K >= {_FEWEST}, got shape {values.shape}.")
    if not np.isfinite(values).all():
        raise ValueError("`force` must be finite [N]; remove the samples that are not.")
    return values
