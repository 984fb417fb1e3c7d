"""Hum on the force: one sinusoid throughout a record, of the mains or of a machine, from the spectrum.

The spectrum of a spring's force falls from harmonic to harmonic, and what a delay, play or damping leaves beside a
spring is spread over many of them. A single line that stands far above all others from half its frequency to twice it
is of neither.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernel.arrays import FloatArray
from ..points.residuals import fft_length
from ..points.steady_part import SteadyRecord
from ..rig.corrected import Corrected
from ..rig.effect_columns import Rig, transferred
from ..rig.traces_in_residuals import EffectTraces, Tangent
from ..search.search import Candidate

_ABOVE = 10.0  # power of the line in that of all others near it
_WIDTH = 2  # lines to either side that belong to one, by the window
_FIRST = 3.0  # harmonic of the test from which lines are looked for; what a spring leaves has lower ones
_WHOLE = 0.1  # distance from a whole number that counts as none
_SHARE = 0.3  # of the variance of the residuals above that harmonic that the line must hold
_LOW = range(3, 13)  # harmonics of which a spring may take over a part
_RIVAL = 0.5  # of what hum explains of the residuals, that no effect of the rig may explain
_MOST = 0.6  # share of the residuals' squares that hum at a low harmonic must explain
_BOTH = 0.25  # share of hum that both must be, the same on loading and unloading and opposite
_SAME = 0.05  # difference between the frequencies of two records that counts as none, share of them
_WORTH = 1e-3  # amplitude that is reported, share of the force's standard deviation


@dataclass(frozen=True)
class Hum:
    """A sinusoid on the force.

    Attributes
    ----------
    frequency : float or None   [Hz]; None without times.
    harmonic : float            Frequency in those of the test [-].
    amplitude : float           [N]
    """

    frequency: float | None
    harmonic: float
    amplitude: float

    @property
    def sentence(self) -> str:
        """Frequency and amplitude, the detail of Outcome.HUM."""
        at = f"{self.harmonic:.4g} times the test's frequency"
        if self.frequency is not None:
            at = f"{self.frequency:.4g} Hz, {at}"
        return f"{self.amplitude:.3g} N at {at}"


def _hum(parts: Sequence[SteadyRecord], residuals: Sequence[FloatArray]) -> Hum | None:
    """The hum on the forces of most records; None if there is none, or the records do not show it.

    Parameters
    ----------
    parts : sequence of SteadyRecord
    residuals : sequence of ndarray   What a spring leaves of each record's force at every sample [N].
    """
    lines = []
    for part, values in zip(parts, residuals, strict=True):
        line = _line(part, values)
        if line is not None and line.amplitude > _WORTH * float(np.std(part.record.force)):
            lines.append(line)
    if not lines or 2 * len(lines) < len(parts):
        return None
    middle = lines[len(lines) // 2]
    alike = [line for line in lines if abs(_rate(line) - _rate(middle)) <= _SAME * _rate(middle)]
    if 2 * len(alike) < len(parts):
        return None
    return Hum(middle.frequency, middle.harmonic, float(np.median([line.amplitude for line in alike])))


def hum_beside(rig: Rig, fit: Candidate) -> Hum | None:
    """The hum that a spring fitted without effects of the rig leaves in the residuals.

    Parameters
    ----------
    rig : Rig
    fit : Candidate   Of points of the rig's records.
    """
    if any(part.periodic for part in rig.parts):
        return None
    loops = rig.with_points(None).loops
    refinement = transferred(fit, loops, coarse=True).refinement
    misfit = refinement.backbone.misfit(loops.force, refinement.omega)
    return _hum(rig.parts, [misfit[points] for _, points in loops.by_record]) or _low_harmonic(rig, fit)


def _low_harmonic(rig: Rig, fit: Candidate) -> Hum | None:
    """Hum at a low harmonic of the test, of which the spring takes over a part: by its trace beside the spring's.

    It must explain the residuals far better than any effect of the rig does, and be neither the same on loading and
    unloading, as what FE lacks is, nor opposite, as what the hysteresis lacks is.
    """
    state = Corrected(fit, rig.loops, {})
    tangent, traces = Tangent(state), EffectTraces(rig, state, rig.effects)
    _, without = traces.solved([])
    before = float(without @ without)
    rivals = [traces.solved([effect])[1] for effect in rig.effects]
    best, left = 0, before
    sizes: FloatArray = np.zeros(2)
    for harmonic in _LOW:
        columns = _waves(rig, harmonic)
        beside = tangent.beside(columns * tangent.root[:, None])
        coefficients = np.asarray(np.linalg.lstsq(beside, without, rcond=1e-8)[0], np.float64)
        after = float(np.sum((without - beside @ coefficients) ** 2))
        if after < left:
            best, left, sizes = harmonic, after, coefficients
    gained = before - left
    if gained < _MOST * before or any(float(r @ r) < left + _RIVAL * gained for r in rivals):
        return None
    period = rig.parts[0].cycle_time
    amplitude = float(np.median(np.hypot(sizes[::2], sizes[1::2])))
    if min(np.hypot.reduce(sizes[::2]), np.hypot.reduce(sizes[1::2])) < _BOTH * np.hypot.reduce(sizes):
        return None
    if amplitude < _WORTH * rig.loops.force_deviation:
        return None
    return Hum(None if period is None else best / period, float(best), amplitude)


def _waves(rig: Rig, harmonic: int) -> FloatArray:
    """Cosine and sine of a harmonic of the test at the points, for each record apart, shape (P, 2 R)."""
    columns = np.zeros((rig.loops.force.size, 2 * len(rig.parts)))
    for k, (part, (_, points)) in enumerate(zip(rig.parts, rig.loops.by_record, strict=True)):
        since_reversal = rig.loops.sample[points] - part.strokes.turning[1]
        angle = 2.0 * np.pi * harmonic * since_reversal / part.strokes.period
        columns[points, 2 * k], columns[points, 2 * k + 1] = np.cos(angle), np.sin(angle)
    return columns


def _rate(line: Hum) -> float:
    return line.harmonic if line.frequency is None else line.frequency


def _line(part: SteadyRecord, residuals: FloatArray) -> Hum | None:
    """The line of one record."""
    size = residuals.size
    if not part.is_even:
        return None
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * (np.arange(size) + 0.5) / size)
    windowed = (residuals - np.average(residuals, weights=window)) * window
    length = fft_length(size)
    power = np.abs(np.fft.rfft(windowed, length)) ** 2
    fundamental = length / part.strokes.period
    first = math.ceil(_FIRST * fundamental)
    if power.size < first + 4 * _WIDTH:
        return None
    top = first + int(np.argmax(power[first:]))
    near = np.r_[max(top // 2, _WIDTH + 1) : max(top - _WIDTH, 1), top + _WIDTH + 1 : min(2 * top, power.size)]
    if not near.size or power[top] < _ABOVE * power[near].max():
        return None
    if power[top - _WIDTH : top + _WIDTH + 1].sum() < _SHARE * power[first:].sum():
        return None
    place = top + _offset(power, top)
    harmonic = place / fundamental
    if harmonic < _LOW.stop and abs(harmonic - round(harmonic)) < _WHOLE:
        return None
    angle = 2.0 * np.pi * place * np.arange(size) / length
    waves = np.stack([np.cos(angle), np.sin(angle)], axis=1) * window[:, None]
    size_of = np.linalg.lstsq(waves, windowed, rcond=None)[0]
    period = part.cycle_time
    return Hum(None if period is None else harmonic / period, harmonic, float(np.hypot(*size_of)))


def _offset(power: FloatArray, top: int) -> float:
    """Where between the lines the peak lies, by a parabola through the logarithms [-0.5, 0.5]."""
    if top + 1 >= power.size:
        return 0.0
    left, middle, right = np.log(np.maximum(power[top - 1 : top + 2], 1e-300))
    return float(np.clip(0.5 * (left - right) / min(left - 2.0 * middle + right, -1e-9), -0.5, 0.5))
