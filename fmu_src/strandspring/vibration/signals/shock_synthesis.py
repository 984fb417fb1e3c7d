"""An acceleration whose shock response spectrum is one that is asked for, as a sum of wavelets.

A wavelet of N half cycles, N odd and at least 3, is sin(2 pi f (t - d)/N)*sin(2 pi f (t - d)) for N/(2 f) from its
delay d on, and 0 otherwise: it leaves neither velocity nor displacement. One stands at each twelfth of an octave, with
alternating signs and delays drawn in the first third of the record (D. K. Fisher and M. R. Posehn, Digital control
system for a multiple-actuator shaker, Shock and Vibration Bulletin 47, 1977).

Their amplitudes A follow by damped Newton steps. At the time t at which the oscillator i has its largest response y,
the wavelet k has the share R of it, the integral of h(t - s)*w(s) ds with the oscillator's response h to an impulse,
so that the level changes by d(log|y|) = sum of A*R/y * d(log|A|).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray, floats
from .averaging import check_duration
from .recorded_signal import RecordedSignal
from .shock_spectra import RequiredSpectrum, octave_frequencies, table_frequencies

LARGEST_DEVIATION = 3.0  # [dB] of a record that is accepted, as test standards have it
_SAMPLES_PER_PERIOD = 10.0  # of the highest frequency
_LEAST_CYCLES, _MOST_CYCLES = 3, 11  # half cycles of a wavelet
_SPREAD = 0.3  # share of the duration within which wavelets begin
_STEP, _LARGEST_STEP, _DAMPING = 0.5, 0.5, 0.03  # of the Newton steps, as oscillators change the time of their peak
_MOST_ITERATIONS, _PATIENCE = 40, 10  # and how many without a better one
_ENOUGH = 0.08  # deviation of the logarithms, 0.7 dB
_PER_OCTAVE, _MOST_PER_OCTAVE = 12, 48
_MOST_NUMBERS = 20_000_000  # samples of all oscillators
_MOST_KEPT = 16
_REALISATIONS = 8  # that are drawn with one seed


@dataclass(frozen=True, eq=False)
class SynthesizedSignal(RecordedSignal):
    """One of the accelerations that have a shock response spectrum.

    Parameters
    ----------
    required : RequiredSpectrum
    asked_duration : float        [s].
    seed : int
    deviation : tuple of float    Least and largest, of its spectrum from the one asked for at any frequency [dB].
    wavelets : int                Of which it is made; the others are as for `RecordedSignal`.
    """

    required: RequiredSpectrum = field(kw_only=True)
    asked_duration: float = field(kw_only=True)
    seed: int = field(kw_only=True)
    deviation: tuple[float, float] = field(kw_only=True)
    wavelets: int = field(kw_only=True)

    def redrawn(self, seed: int, number: int) -> SynthesizedSignal:
        """Another of them, one of a few of each seed; itself if the spectrum is not met with other delays."""
        drawn = self.seed + 1 + _REALISATIONS * seed + number % _REALISATIONS
        try:
            return synthesized_shock(self.required, self.asked_duration, drawn)
        except MountedSystemError:
            return self


@lru_cache(maxsize=_MOST_KEPT)
def synthesized_shock(required: RequiredSpectrum, duration: float, seed: int = 0) -> SynthesizedSignal:
    """An acceleration with a shock response spectrum.

    Parameters
    ----------
    required : RequiredSpectrum
    duration : float             Of the acceleration [s].
    seed : int                   Of the delays of the wavelets.

    Raises
    ------
    MountedSystemError           If the duration is too short or too long, or the spectrum is not met within 3 dB.
    """
    check_duration(duration, "duration")
    frequency = octave_frequencies(required.levels.lowest, required.levels.highest, _PER_OCTAVE)
    least = 0.5 * _LEAST_CYCLES / float(frequency[0])
    if duration < least:
        raise MountedSystemError(
            f"A shock with a spectrum from {frequency[0]:g} Hz on must last {least:.4g} s or more, one and a half "
            f"periods, got {duration:.4g} s; lengthen it."
        )
    interval = 1.0 / (_SAMPLES_PER_PERIOD * float(frequency[-1]))
    samples = 1 + math.ceil(duration / interval)
    oscillators = _oscillators(required)
    if samples * oscillators.size > _MOST_NUMBERS:
        raise MountedSystemError(
            f"A shock with a spectrum up to {frequency[-1]:g} Hz may last "
            f"{_MOST_NUMBERS / oscillators.size * interval:.3g} s, got {duration:.4g} s; shorten it."
        )
    time = floats(interval * np.arange(samples))
    wavelets = _wavelets(frequency, time, duration, seed)
    acceleration = _matched(required, oscillators, wavelets, required.at(frequency) / _MOST_CYCLES, time)
    lowest, highest = required.deviation(acceleration, interval)
    if max(-lowest, highest) > LARGEST_DEVIATION:
        raise MountedSystemError(
            f"The best synthesized shock deviates from its spectrum by {lowest:+.2g} to {highest:+.2g} dB, more than "
            f"{LARGEST_DEVIATION:g} dB; take another `duration` or `seed`, or a spectrum without steps."
        )
    return SynthesizedSignal(
        time, acceleration, required=required, asked_duration=duration, seed=seed, deviation=(lowest, highest),
        wavelets=frequency.size,
    )  # fmt: skip


def _wavelets(frequency: FloatArray, time: FloatArray, duration: float, seed: int) -> FloatArray:
    """Wavelets of alternating sign, each with an amplitude of about 1, shape (F, K)."""
    fitting = 2.0 * np.floor(frequency * duration - 0.5) + 1.0  # the largest odd number of half cycles
    cycles = np.clip(fitting, _LEAST_CYCLES, _MOST_CYCLES)
    lengths = 0.5 * cycles / frequency
    drawn = _SPREAD * duration * np.random.default_rng(seed).random(frequency.size)
    local = time - np.minimum(drawn, duration - lengths)[:, None]
    phase = 2.0 * np.pi * frequency[:, None] * local
    inside = (local >= 0.0) & (local <= lengths[:, None])
    signs = (-1.0) ** np.arange(frequency.size)
    return floats(signs[:, None] * np.where(inside, np.sin(phase / cycles[:, None]) * np.sin(phase), 0.0))


def _matched(
    required: RequiredSpectrum, oscillators: FloatArray, wavelets: FloatArray, amplitudes: FloatArray, time: FloatArray
) -> FloatArray:
    """The sum of wavelets whose spectrum deviates least, shape (K,), from amplitudes to begin with."""
    levels, interval = required.levels, float(time[1])
    asked = required.at(oscillators)
    whole = floats(interval * np.arange(time.size + math.ceil(0.5 / (levels.lowest * interval))))  # with what follows
    length = next_fast_len(2 * whole.size, real=True)
    impulse_responses = _impulse_responses(oscillators, required.damping, whole)
    transfer = interval * rfft(impulse_responses, length, axis=1)
    best, least, waited = wavelets[0], math.inf, 0
    for _ in range(_MOST_ITERATIONS):
        acceleration = amplitudes @ wavelets
        responses = irfft(rfft(acceleration, length) * transfer, length, axis=1)[:, : whole.size]
        latest = np.argmax(np.abs(responses), axis=1)
        largest = responses[np.arange(oscillators.size), latest]
        missing = np.log(asked / np.abs(largest))
        deviation = float(np.abs(missing).max())
        waited += 1
        if deviation < least:
            best, least, waited = acceleration, deviation, 0
        if waited == _PATIENCE or deviation < _ENOUGH:
            break
        ago = latest[:, None] - np.arange(time.size)
        remembered = np.where(ago >= 0, np.take_along_axis(impulse_responses, np.maximum(ago, 0), axis=1), 0.0)
        shares = interval * (remembered @ wavelets.T) * amplitudes / largest[:, None]
        normal = shares.T @ shares + _DAMPING * np.eye(amplitudes.size)
        change = np.linalg.solve(normal, shares.T @ (_STEP * np.clip(missing, -_LARGEST_STEP, _LARGEST_STEP)))
        amplitudes = amplitudes * (1.0 + np.clip(change, -_LARGEST_STEP, _LARGEST_STEP))
    return floats(best)


def _oscillators(required: RequiredSpectrum) -> FloatArray:
    """Their frequencies, those of the levels among them: neighbours are closer than the width of a resonance."""
    per_octave = min(_MOST_PER_OCTAVE, max(_PER_OCTAVE, math.ceil(1.2 * required.quality)))
    return table_frequencies(required.levels, per_octave)


def _impulse_responses(frequency: FloatArray, damping: float, time: FloatArray) -> FloatArray:
    """Absolute acceleration of oscillators after an impulse of base acceleration, shape (F, K) [1/s]."""
    rate = 2.0 * np.pi * frequency[:, None]
    damped = math.sqrt(1.0 - damping**2)
    swing = (1.0 - 2.0 * damping**2) / damped * np.sin(damped * rate * time)
    swing += 2.0 * damping * np.cos(damped * rate * time)
    return floats(rate * np.exp(-damping * rate * time) * swing)
