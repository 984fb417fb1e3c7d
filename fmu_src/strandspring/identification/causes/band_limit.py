"""A low-pass filter that records went through before they were saved, from the spectrum of their forces.

At a reversal the slope of a spring's force jumps. The power of its harmonics falls by 12 dB per octave where the
displacement turns at a corner and by 18 dB where it turns as a sine does, down to a floor of white noise. A
second-order filter that is run forward and backward adds another 24 dB per octave and removes the floor, as no spring
does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...kernel.arrays import FloatArray
from ...loops.strokes import Strokes
from ..points.residuals import fft_length
from ..points.steady_part import SteadyRecord

_LOWEST = 6.0  # harmonic above which polynomials of the elastic force add little
_BANDS = 3  # in an octave
_STEEP = 34.0  # fall of the power within an octave that no spring and no white noise shows [dB]
_BEGUN = 24.0  # fall from which the filter has begun [dB]
_BEFORE = 1.4  # a filter's cutoff is above the lower end of the octave in which it has begun, about
_WORTH = 1e-3  # blurred share of a stroke that is reported
_DECIDED = 10.0  # a loop is known if its stroke is so many times what is blurred
_HEARD = 1e-11  # power of a sine's window elsewhere, share of its line's
# Blackman and Harris: all side lobes are below -92 dB.
_WINDOW = (0.35875, -0.48829, 0.14128, -0.01168)


@dataclass(frozen=True)
class BandLimit:
    """The band limit of some records.

    Attributes
    ----------
    harmonic : float             Cutoff in frequencies of the test [-].
    frequency : float or None    Cutoff [Hz]; None without times.
    blurred : float              Share of a stroke that is travelled in half a period of the cutoff after a reversal.
    is_common : bool             Whether the displacement may have gone through the filter too: the force alone, if its
                                 displacement has no such limit.
    """

    harmonic: float
    frequency: float | None
    blurred: float
    is_common: bool

    @property
    def smallest_loop(self) -> float:
        """Amplitude of the smallest loop that the records tell of, share of the recorded one."""
        return min(1.0, _DECIDED * self.blurred)

    @property
    def sentence(self) -> str:
        """Cutoff and consequence, the detail of Outcome.BAND_LIMITED."""
        cutoff = f"{self.harmonic:.2g} times the test's frequency"
        if self.frequency is not None:
            cutoff = f"{self.frequency:.2g} Hz, {cutoff}"
        return f"cutoff about {cutoff}; loops below {100.0 * self.smallest_loop:.2g} % of the amplitude are not decided"


def band_limit(parts: Sequence[SteadyRecord]) -> BandLimit | None:
    """The low-pass filter that most of the records went through; None if they did not, or do not show it.

    Parameters
    ----------
    parts : sequence of SteadyRecord   Of one test.
    """
    judged = [part for part in parts if part.is_even]
    cutoffs = [cutoff for part in judged if (cutoff := _cutoff(part.record.force, part.strokes)) is not None]
    if 2 * len(cutoffs) <= len(judged):
        return None
    harmonic = float(np.median(cutoffs))
    blurred = max(_blurred(part, harmonic) for part in judged)
    if blurred < _WORTH:
        return None
    periods = [period for part in judged if (period := part.cycle_time) is not None]
    frequency = harmonic / float(np.median(periods)) if periods else None
    return BandLimit(harmonic, frequency, blurred, not all(_has_white_displacement(part, harmonic) for part in judged))


def _cutoff(values: FloatArray, strokes: Strokes) -> float | None:
    """Harmonic at which a signal's power falls steeply, None if it does not."""
    harmonic, power = _octave_bands(values, strokes)
    if power.size <= _BANDS:
        return None
    fall = 10.0 * np.log10(power[:-_BANDS] / power[_BANDS:])
    if fall.max() < _STEEP:
        return None
    return float(_BEFORE * harmonic[np.argmax(fall > _BEGUN)])


def _octave_bands(values: FloatArray, strokes: Strokes) -> tuple[FloatArray, FloatArray]:
    """Middles [harmonics] and mean powers of bands of a third of an octave, each of shape (B,)."""
    angle = 2.0 * np.pi * (np.arange(values.size) + 0.5) / values.size
    window = sum(weight * np.cos(k * angle) for k, weight in enumerate(_WINDOW))
    level = values - np.linspace(values[0], values[-1], values.size)
    length = fft_length(values.size)
    power = np.abs(np.fft.rfft((level - level.mean()) * window, length)) ** 2
    fundamental = length / strokes.period  # the number of its line
    # The last line is the Nyquist frequency; anti-aliasing filters act just below.
    count = max(0, math.floor(_BANDS * math.log2(max(power.size / (_LOWEST * fundamental), 1e-3))))
    edges = _LOWEST * fundamental * 2.0 ** (np.arange(count + 1) / _BANDS)
    bands = [power[int(a) : max(int(b), int(a) + 1)].mean() for a, b in pairwise(edges)]
    least = np.finfo(float).eps ** 2 * float(power.max(initial=0.0))
    return edges[:-1] / fundamental * 2.0 ** (0.5 / _BANDS), np.maximum(bands, max(least, 1e-300))


def _has_white_displacement(part: SteadyRecord, harmonic: float) -> bool:
    """Whether the displacement has noise or corners above a cutoff that has none of it in the force."""
    middles, power = _octave_bands(part.record.displacement, part.strokes)
    above, below = power[middles > 2.0 * harmonic], power[middles < harmonic]
    if not (above.size and below.size):
        return False
    # A sine without noise has nothing at either.
    heard = _HEARD * (0.5 * float(np.ptp(part.record.displacement)) * len(part.record)) ** 2
    return bool(above.max() > max(0.1 * below.min(), heard))


def _blurred(part: SteadyRecord, harmonic: float) -> float:
    """Share of a stroke that is travelled, in the median, so long after a reversal as half a period of the cutoff."""
    shares = []
    strokes = part.strokes
    for k in range(1, strokes.count - 1):
        begin, end = int(strokes.turning[k]), int(strokes.turning[k + 1])
        place = begin + (end - begin) / harmonic
        shares.append(float(np.interp(place, np.arange(len(part.record)), strokes.travel)) / float(strokes.length[k]))
    return float(np.median(shares)) if shares else 0.0
