"""Comparison of several loops: whether the rate matters, and whether the loading paths overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ..kernel.arrays import FloatArray
from ..records.record import Record
from .cycles import Cycle, by_rate, find_cycles
from .loop import Loop, group_by_amplitude, mean_figures

_CELLS = 40  # on each branch compared
_END = 0.02  # share of the stroke before a reversal left out, where the branches end
_BEYOND_NOISE = 2.0  # difference that counts as real, in units of the noise


class RateVerdict(Enum):
    """Whether the force depends on the frequency; the value is the sentence for the user."""

    INDEPENDENT = "The force does not depend on the frequency beyond the noise."
    LITTLE = "The loops of different frequencies differ beyond the noise, but little against the height of the loop."
    DEPENDENT = (
        "The force depends on the frequency, unless specimen or force sensor drifted between the cycles compared: a "
        "rate-independent model describes their mean; repeat one frequency to check, or identify each frequency alone."
    )
    NO_TIMES = "Whether the force depends on the frequency is unknown, because no cycle has times; give a time column."
    ONE_FREQUENCY = (
        "Whether the force depends on the frequency is unknown, because no amplitude was measured at two "
        "frequencies; repeat one amplitude at another frequency."
    )


@dataclass(frozen=True)
class RateIndependence:
    """Comparison of loops of like amplitude at different frequencies.

    Attributes
    ----------
    verdict : RateVerdict
    frequencies : (float, float) or None   Least and greatest frequency compared [Hz]; None if unknown.
    amplitudes : int                       Number of amplitudes at which frequencies were compared.
    relative_to_noise : float or None      rms difference between mean loops of two frequencies over what the scatter of
                                           cycles and the noise of the force make of it [-].
    relative_to_height : float or None     The same difference over the mean distance of the branches [-].
    """

    verdict: RateVerdict
    frequencies: tuple[float, float] | None = None
    amplitudes: int = 0
    relative_to_noise: float | None = None
    relative_to_height: float | None = None

    @property
    def sentence(self) -> str:
        """The verdict with its figures."""
        if self.frequencies is None or self.relative_to_noise is None or self.relative_to_height is None:
            return self.verdict.value
        low, high = self.frequencies
        return (
            f"{self.verdict.value} From {low:.3g} to {high:.3g} Hz the rms difference is {self.relative_to_noise:.2g} "
            f"times the noise and {100 * self.relative_to_height:.2g} % of the loop's height."
        )


def rate_independence(cycles: Sequence[Cycle]) -> RateIndependence:
    """Whether the force depends on the frequency beyond noise, from cycles of one spring.

    At each amplitude the mean loops of the frequencies are compared by analysis of variance, without a constant
    offset of the force, which a drifting sensor makes, and without the first fifth after each reversal, where small
    differences between the turning points would count. Several amplitudes are pooled by their mean squares.
    """
    timed = [cycle for cycle in cycles if cycle.frequency is not None]
    if not timed:
        return RateIndependence(RateVerdict.NO_TIMES)
    compared, ends = [], []
    for group in group_by_amplitude(timed):
        rates = by_rate(group)
        if len(rates) > 1:
            compared.append(_rate_difference(rates))
            ends += [cycle.frequency for cycle in (rates[0][0], rates[-1][-1]) if cycle.frequency is not None]
    if not compared:
        return RateIndependence(RateVerdict.ONE_FREQUENCY)
    to_noise, to_height = np.sqrt(np.mean(np.square(compared), axis=0)).tolist()
    beyond = RateVerdict.LITTLE if to_height <= 0.05 else RateVerdict.DEPENDENT
    verdict = beyond if to_noise > _BEYOND_NOISE else RateVerdict.INDEPENDENT
    return RateIndependence(verdict, (min(ends), max(ends)), len(compared), to_noise, to_height)


def _rate_difference(rates: Sequence[Sequence[Cycle]]) -> tuple[float, float]:
    """rms difference between the mean loops of rates, relative to its noise and to the loop height."""
    cycles = [cycle for group in rates for cycle in group]
    sizes = np.array(list(map(len, rates)))
    of_class = np.repeat(np.arange(sizes.size), sizes)
    low = max(cycle.figures.low for cycle in cycles)
    high = min(cycle.figures.high for cycle in cycles)
    shares = np.linspace(0.2, 1.0 - _END, _CELLS)  # unequal turning points show right after a reversal
    rows, sampling = [], []
    for cycle in cycles:
        loading, up = cycle.loading.profile(low + (high - low) * shares)
        unloading, down = cycle.unloading.profile(high - (high - low) * shares[::-1])
        rows.append(np.concatenate([loading, unloading]))
        sampling.append(cycle.noise**2 * np.mean(1.0 / np.concatenate([up, down])))
    profiles = np.stack(rows) - np.mean(rows, axis=1, keepdims=True)
    means = np.stack([profiles[of_class == k].mean(axis=0) for k in range(sizes.size)])
    between = float(np.mean(np.var(means, axis=0, ddof=1)))
    freedom = max(len(cycles) - sizes.size, 1)  # single cycles do not scatter about themselves
    scatter = np.mean(np.sum((profiles - means[of_class]) ** 2, axis=0)) / freedom
    height = float(np.mean([abs(cycle.figures.height) for cycle in cycles]))
    # No rig repeats better than to a thousandth.
    variance = max(float(scatter), float(np.mean(sampling)), (1e-3 * height) ** 2, 1e-300)
    expected = variance * float(np.mean(1.0 / sizes))
    return float(np.sqrt(between / expected)), float(np.sqrt(2.0 * between)) / max(height, 1e-300)


class OverlapVerdict(Enum):
    """Whether loading paths of different amplitudes overlap; the value is the sentence for the user."""

    OVERLAPPING = "The loading paths of different amplitudes overlap."
    APART = (
        "The loading paths of different amplitudes do not overlap: the hysteresis does not saturate within the smaller "
        "strokes, or the spring changed between them."
    )
    LOST_IN_NOISE = (
        "Whether the loading paths of different amplitudes overlap is unknown, because the loops are no higher "
        "than the noise; record more cycles."
    )
    NO_SHARED_RANGE = (
        "Whether the loading paths of different amplitudes overlap is unknown, because no two of them share enough "
        "of their range; record larger and smaller amplitudes about one mean."
    )


@dataclass(frozen=True)
class Overlap:
    """Distance of the smaller loops' loading paths from that of the largest loop.

    Attributes
    ----------
    verdict : OverlapVerdict
    amplitudes : int                     Number of smaller amplitudes compared.
    distance : float or None             rms distance beyond noise [N]; None if unknown.
    relative_to_height : float or None   The same over the mean distance of the largest loop's branches [-].
    """

    verdict: OverlapVerdict
    amplitudes: int = 0
    distance: float | None = None
    relative_to_height: float | None = None

    @property
    def sentence(self) -> str:
        """The verdict with its figures."""
        if self.distance is None or self.relative_to_height is None:
            return self.verdict.value
        return (
            f"{self.verdict.value} In the second half of the smaller strokes they lie {self.distance:.3g} N (rms) from "
            f"the largest one's, {100 * self.relative_to_height:.2g} % of its loop's height."
        )


def loading_overlap(loops: Sequence[Loop]) -> Overlap | None:
    """The paper's hardening overlap: do loading paths of different amplitudes run together once under way?

    Compared is where each smaller loop has travelled half its stroke and the largest one as far; what the noise of the
    force makes of the distance is removed. None if no amplitude is below nine tenths of the largest.
    """
    *others, largest = group_by_amplitude(loops) or [[]]
    smaller = [group for group in others if group[0].figures.amplitude <= 0.9 * largest[0].figures.amplitude]
    if not smaller:
        return None
    compared = []
    for group in smaller:
        members = [loop.figures for loop in (*group, *largest)]
        stroke = float(np.mean([loop.figures.stroke for loop in group]))
        begin = max(figures.low for figures in members) + 0.5 * stroke
        end = min(figures.high for figures in members) - _END * stroke
        if end - begin >= 0.1 * stroke:
            cells = np.linspace(begin, end, _CELLS)
            (first, own), (second, other) = _loading(group, cells), _loading(largest, cells)
            compared.append([float(np.mean((first - second) ** 2)), own + other])
    if not compared:
        return Overlap(OverlapVerdict.NO_SHARED_RANGE)
    square, noise = np.mean(compared, axis=0).tolist()
    height = abs(mean_figures(largest).height)
    if height <= _BEYOND_NOISE * np.sqrt(noise):
        return Overlap(OverlapVerdict.LOST_IN_NOISE)
    distance = float(np.sqrt(max(square - noise, 0.0)))
    verdict = OverlapVerdict.OVERLAPPING if distance <= 0.1 * height else OverlapVerdict.APART
    return Overlap(verdict, len(compared), distance, distance / height)


def _loading(loops: Sequence[Loop], cells: FloatArray) -> tuple[FloatArray, float]:
    """Mean loading path on cells of displacement [N], and the mean variance that noise gives it [N^2]."""
    forces, counts = zip(*(loop.loading.profile(cells) for loop in loops), strict=True)
    variances = [loop.noise**2 * np.mean(1.0 / count) for loop, count in zip(loops, counts, strict=True)]
    return np.asarray(np.mean(forces, axis=0)), float(np.mean(variances)) / len(loops)


def campaign_verdicts(
    records: Sequence[Record], model_loops: Sequence[Loop] = ()
) -> tuple[RateIndependence | None, Overlap | None]:
    """Rate dependence and overlap from the cycles of a test campaign.

    The first is None where nobody would ask: no records, or one of one amplitude. The loading paths of the model's
    loops are compared if the records hold no closed loop.
    """
    # A first loading differs from a steady loop, whatever its frequency and amplitude.
    cycles = [cycle for record in records for cycle in find_cycles(record) if cycle.gap == 0.0]
    rate = rate_independence(cycles) if records else None
    if rate is not None and rate.frequencies is None and len(records) == 1 and len(group_by_amplitude(cycles)) < 2:
        rate = None
    return rate, loading_overlap(cycles or list(model_loops))
