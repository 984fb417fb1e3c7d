"""Averages of signals over time steps: against quadrature of formulas written here, and unchanged by half the step."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from strandspring.errors import MountedSystemError
from strandspring.vibration.bodies.loads import Signal
from strandspring.vibration.signals.averaging import smooth_averages
from strandspring.vibration.signals.level_table import LevelTable, displacement_limited
from strandspring.vibration.signals.pulses import (
    CORNERS,
    HalfSine,
    HeldAcceleration,
    StraightPulse,
    TabulatedPulse,
    VelocityStep,
    VersedSine,
    trapezoid,
)
from strandspring.vibration.signals.random_signal import RandomVibration
from strandspring.vibration.signals.recorded_signal import RecordedSignal
from strandspring.vibration.signals.sine_signals import SineDwell, SineSweep

D = 0.011
RECOIL = TabulatedPulse(((0.001, 0.0), (0.002, 3.0), (0.002, 5.0), (0.0045, 5.0), (0.01, 0.0)))
# Each pulse, its formula within its duration, where that bends, and its integral.
PULSES: list[tuple[Signal, Callable[[float], float], list[float], float]] = [
    (HalfSine(-4.0, D), lambda t: -4.0 * math.sin(math.pi * t / D), [D], -8.0 * D / math.pi),
    (VersedSine(4.0, D), lambda t: 2.0 * (1.0 - math.cos(2.0 * math.pi * t / D)), [D], 2.0 * D),
    (StraightPulse(4.0, D, CORNERS["terminal-sawtooth"]), lambda t: 4.0 * t / D, [D], 2.0 * D),
    (StraightPulse(4.0, D, CORNERS["initial-sawtooth"]), lambda t: 4.0 * (1.0 - t / D), [D], 2.0 * D),
    (StraightPulse(4.0, D, CORNERS["rectangle"]), lambda _: 4.0, [D], 4.0 * D),
    (StraightPulse(4.0, D, CORNERS["triangle"]), lambda t: 4.0 * (1.0 - abs(2.0 * t / D - 1.0)), [D / 2.0, D], 2.0 * D),
    (
        trapezoid(4.0, D, 0.001, 0.002),
        lambda t: 4.0 * min(1.0, t / 0.001, (D - t) / 0.002),
        [0.001, 0.009, D],
        4.0 * (D - 0.0015),
    ),
    (
        RECOIL,
        lambda t: 0.0 if t < 0.001 else 3e3 * (t - 0.001) if t < 0.002 else min(5.0, 5.0 * (0.01 - t) / 0.0055),
        [0.001, 0.002, 0.0045, 0.01],
        0.0015 + 5.0 * 0.0025 + 0.01375,
    ),
]
PROFILE = displacement_limited(0.001, 10.0, 5.0, 200.0)
DENSITY = LevelTable(((50.0, 1.0), (100.0, 2.0), (300.0, 1.0)))
RECORD = RecordedSignal(np.array([5.0, 5.001, 5.004, 5.0041, 5.02]), np.array([1.0, 2.0, -1.0, 4.0, 3.0]), is_held=True)
SIGNALS: list[Signal] = [
    *(pulse for pulse, _, _, _ in PULSES),
    VelocityStep(0.3),
    HeldAcceleration(4.0, 0.03, 0.02),
    SineDwell(4.0, 100.0, 0.03),
    SineDwell(4.0, 100.0, 0.03, soft_start=0.013),
    SineSweep(10.0, 200.0, 0.03, PROFILE),
    SineSweep(200.0, 10.0, 0.03, PROFILE, is_logarithmic=False),
    RandomVibration(DENSITY, 0.03, seed=1),
    RECORD,
]


def name(signal: object) -> str:
    return type(signal).__name__


def quadrature(formula: Callable[[float], float], bends: list[float], low: float, high: float) -> float:
    """Mean of a formula that ends at the last bend."""
    cuts = [low, *(bend for bend in bends if low < bend < min(high, bends[-1])), min(high, bends[-1])]
    return sum(quad(formula, a, b, epsabs=1e-15)[0] for a, b in pairwise(cuts) if b > a) / (high - low)


@pytest.mark.parametrize(("pulse", "formula", "bends", "area"), PULSES, ids=name)
@pytest.mark.parametrize("step", [0.0003, 0.0007, 0.004, 0.05])
def test_averages_of_pulses_are_their_integrals(
    pulse: HalfSine, formula: Callable[[float], float], bends: list[float], area: float, step: float
) -> None:
    count = int(0.012 / step) + 2
    expected = [quadrature(formula, bends, k * step, (k + 1) * step) for k in range(count)]
    averages = pulse.averages(step, count)
    assert averages == pytest.approx(expected, rel=1e-12, abs=1e-12)  # rounding, of a peak of 4 or 5
    assert pulse.velocity_change == pytest.approx(area, rel=1e-14)
    assert step * averages.sum() == pytest.approx(area, rel=1e-13)
    assert np.all(averages[math.ceil(bends[-1] / step * (1.0 + 1e-12)) :] == 0.0)
    times = np.linspace(1e-5, bends[-1] - 1e-5, 37)
    assert pulse.at(times) == pytest.approx([formula(t) for t in times], rel=1e-12, abs=1e-12)
    assert pulse.at([-1e-9, 1.001 * bends[-1]]).tolist() == [0.0, 0.0]


@settings(max_examples=200, deadline=None)
@given(signal=st.sampled_from(SIGNALS), step=st.floats(1e-5, 0.1), count=st.integers(1, 400))
def test_halving_the_step_does_not_change_the_signal(signal: Signal, step: float, count: int) -> None:
    """What a run with half the step changes is the error of the integration, not the signal."""
    whole, halves = signal.averages(step, count), signal.averages(step / 2.0, 2 * count)
    # Rounding of times 1e-16*t shifts what a step takes of a jump or slope, in relation to the step.
    assert halves.reshape(-1, 2).mean(axis=1) == pytest.approx(whole, rel=1e-10, abs=1e-9)


@pytest.mark.parametrize("soft_start", [0.0, 1e-7, 0.0133])
@pytest.mark.parametrize("step", [0.0003, 0.0031, 0.05])
def test_averages_of_a_dwell(soft_start: float, step: float) -> None:
    def value(t: float) -> float:
        rise = 0.5 * (1.0 - math.cos(math.pi * t / soft_start)) if t < soft_start else 1.0
        return 4.0 * rise * math.sin(2.0 * math.pi * 97.0 * t)

    dwell, count = SineDwell(4.0, 97.0, 0.03, soft_start), int(0.04 / step) + 1
    expected = [quadrature(value, [soft_start, 0.03], k * step, (k + 1) * step) for k in range(count)]
    assert dwell.averages(step, count) == pytest.approx(expected, rel=1e-11, abs=1e-11)  # quad's own error


@pytest.mark.parametrize(("first", "last"), [(7.0, 180.0), (180.0, 7.0)])
@pytest.mark.parametrize("is_logarithmic", [True, False])
def test_averages_of_a_sweep(first: float, last: float, is_logarithmic: bool) -> None:
    sweep = SineSweep(first, last, 0.4, PROFILE, is_logarithmic)

    def frequency(t: float) -> float:
        return first * (last / first) ** (t / 0.4) if is_logarithmic else first + (last - first) * t / 0.4

    def value(t: float) -> float:
        f = frequency(t)
        octaves = math.log(last / first)
        cycles = (f - first) * 0.4 / octaves if is_logarithmic else 0.5 * (first + f) * t
        return min(10.0, 0.001 * (2.0 * math.pi * f) ** 2) * math.sin(2.0 * math.pi * cycles)

    bends = [*sorted(sweep.time([f for f, _ in PROFILE.points if 7.0 < f < 180.0]).tolist()), 0.4]
    for step in (0.0013, 0.0207):
        count = int(0.4 / step) + 2
        expected = [quadrature(value, bends, k * step, (k + 1) * step) for k in range(count)]
        assert sweep.averages(step, count) == pytest.approx(expected, rel=1e-11, abs=1e-11)  # quad's own error
    times = np.linspace(0.0, 0.4, 9)
    assert sweep.frequency(times) == pytest.approx([frequency(t) for t in times], rel=1e-13)
    assert sweep.time(sweep.frequency(times)) == pytest.approx(times, abs=1e-13)


def test_rates_of_sweeps() -> None:
    table = LevelTable(((5.0, 1.0), (2000.0, 1.0)))
    assert SineSweep.at_octaves_per_minute(5.0, 2000.0, 1.0, table).duration == pytest.approx(60.0 * math.log2(400.0))
    down = SineSweep.at_hertz_per_second(200.0, 50.0, 3.0, table)
    assert (down.duration, down.is_logarithmic, down.shortest) == (50.0, False, 0.0025)
    for rate in (0.0, -1.0, math.nan):
        with pytest.raises(MountedSystemError, match="rate of a sweep must be finite and > 0"):
            SineSweep.at_octaves_per_minute(5.0, 2000.0, rate, table)


def test_the_memory_that_quadrature_takes_changes_nothing() -> None:
    """Steps are taken in blocks of some thousand; a block boundary is like any other step."""
    omega, step, count = 2.0 * math.pi * 900.0, 0.0004, 50_000
    averages = smooth_averages(lambda t: np.sin(omega * t), omega, np.array([1.0]), step, count)
    middles = step * (np.arange(count) + 0.5)
    expected = np.sin(omega * middles) * np.sinc(900.0 * step)
    assert np.abs(averages - expected).max() < 1e-10  # the phase reaches 1e5 rad: rounding of 1e-16 of it


@pytest.mark.parametrize("step", [0.0003, 0.0031, 0.05])
def test_averages_of_a_held_acceleration(step: float) -> None:
    held, count = HeldAcceleration(4.0, 0.03, 0.02), int(0.04 / step) + 1
    expected = [
        quadrature(
            lambda t: 2.0 * (1.0 - math.cos(math.pi * min(t / 0.02, 1.0))), [0.02, 0.03], k * step, (k + 1) * step
        )
        for k in range(count)
    ]
    assert held.averages(step, count) == pytest.approx(expected, rel=1e-12, abs=1e-12)  # rounding
    with pytest.raises(MountedSystemError, match="rise of a constant acceleration must be at most its duration"):
        HeldAcceleration(4.0, 0.03, 0.04)


def test_a_velocity_step_is_within_the_first_step() -> None:
    assert VelocityStep(-0.3).averages(0.001, 3).tolist() == [-300.0, 0.0, 0.0]
    assert VelocityStep(-0.3).shortest == math.inf


def test_a_record_begins_at_its_first_sample_and_is_zero_or_held_after_its_last() -> None:
    time, value = np.array([5.0, 5.5, 6.0]), np.array([1.0, 3.0, 2.0])
    ends, holds = RecordedSignal(time, value), RecordedSignal(time, value, is_held=True)
    assert ends.averages(0.5, 4) == pytest.approx([2.0, 2.5, 0.0, 0.0], rel=1e-14)
    assert holds.averages(0.5, 4) == pytest.approx([2.0, 2.5, 2.0, 2.0], rel=1e-14)
    assert (ends.duration, ends.velocity_change, ends.shortest) == (1.0, 2.25, 1.0)
    assert RecordedSignal(np.append(np.arange(20.0), 60.0), np.ones(21)).shortest == 10.0
    time[:] = value[:] = 0.0
    assert ends.at([0.0, 0.25, 0.5]) == pytest.approx([1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match="read-only"):
        ends.value[0] = 2.0


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10_000), samples=st.integers(2, 60), step=st.floats(1e-3, 3.0))
def test_averages_of_records_at_uneven_times(seed: int, samples: int, step: float) -> None:
    rng = np.random.default_rng(seed)
    time, value = np.cumsum(rng.exponential(0.1, samples)), rng.standard_normal(samples)
    averages = RecordedSignal(time, value).averages(step, 5)
    for k in range(5):
        cuts = np.unique(np.clip(np.append(time - time[0], [k * step, (k + 1) * step]), k * step, (k + 1) * step))
        cuts = cuts[cuts <= time[-1] - time[0]]
        area = np.trapezoid(np.interp(cuts, time - time[0], value), cuts) if cuts.size > 1 else 0.0
        assert averages[k] == pytest.approx(area / step, abs=1e-12)


def test_a_long_record_with_an_offset_loses_no_digits() -> None:
    """A straight line over three hours, whose integral grows to 1e5."""
    time = np.linspace(0.0, 1e4, 100_001)
    averages = RecordedSignal(time, 9.80665 + 1e-3 * time).averages(0.01, 1_000_000)
    middles = 0.01 * (np.arange(1_000_000) + 0.5)
    assert np.abs(averages - (9.80665 + 1e-3 * middles)).max() < 1e-13  # of up to 20: rounding


def test_tables_of_levels() -> None:
    # -3 dB per octave is the slope -1, whose integral is a logarithm.
    table = LevelTable(((20.0, 0.01), (80.0, 0.04), (350.0, 0.04), (700.0, 0.02), (2000.0, 0.001)))
    assert table.at([19.9, 20.0, 40.0, 100.0, 490.0, 2000.0, 2001.0]) == pytest.approx(
        [0.0, 0.01, 0.02, 0.04, 0.04 * 350.0 / 490.0, 0.001, 0.0], rel=1e-13
    )
    edges = [10.0, 20.0, 35.0, 80.0, 400.0, 650.0, 1000.0, 3000.0]
    bends = [20.0, 80.0, 350.0, 700.0, 2000.0]
    for (a, b), found in zip(pairwise(edges), table.by_band(edges), strict=True):
        cuts = [max(a, 20.0), *(bend for bend in bends if a < bend < b and bend > 20.0), min(b, 2000.0)]
        expected = sum(quad(lambda f: float(table.at(f)), low, high)[0] for low, high in pairwise(cuts) if high > low)
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-14)
    area = 0.5 * 60.0 * 0.05 + 0.04 * 270.0 + 14.0 * math.log(2.0)
    assert table.by_band([0.0, 700.0])[0] == pytest.approx(area, rel=1e-13)


def test_steep_tables_lose_no_digits() -> None:
    """The power of high bands is not a difference of large sums."""
    table = LevelTable(((1.0, 1.0), (1e4, 1e-28)))  # level = f^-7
    edges = np.geomspace(1.0, 1e4, 30)
    assert table.by_band(edges) == pytest.approx(-np.diff(edges**-6.0) / 6.0, rel=1e-12)


def test_a_sine_test_limited_by_displacement() -> None:
    crossover = math.sqrt(10.0 / 0.001) / (2.0 * math.pi)
    assert PROFILE.points[1][0] == pytest.approx(crossover)
    assert PROFILE.at(10.0) == pytest.approx(0.001 * (20.0 * math.pi) ** 2, rel=1e-13)
    assert PROFILE.at(100.0) == pytest.approx(10.0, rel=1e-13)
    assert len(displacement_limited(0.001, 10.0, 50.0, 200.0).points) == 2


FLAT = LevelTable(((10.0, 1.0), (20.0, 1.0)))
TIMES = np.array([0.0, 1.0, 1.0, 2.0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HalfSine(math.nan, 0.011), "`peak` must be finite"),
        (lambda: HalfSine(1.0, 0.0), r"`duration` must be within \[1e-09, 1e\+07\] s, got 0.0"),
        (lambda: trapezoid(1.0, 0.01, 0.006, 0.006), "together at most its duration of 0.01 s"),
        (lambda: trapezoid(1.0, 0.01, -0.001, 0.006), "must be >= 0"),
        (lambda: VelocityStep(math.inf), "`velocity_change` must be finite"),
        (lambda: TabulatedPulse(((0.0, 1.0),)), "must have 2 to 1,000,000 points, got 1"),
        (lambda: TabulatedPulse(((0.0, 1.0), (1.0, math.nan))), "times and values of a pulse by a table"),
        (lambda: TabulatedPulse(((0.0, 1.0), (2.0, 1.0), (1.0, 1.0))), "got 1.0 s at point 3"),
        (lambda: TabulatedPulse(((-1.0, 1.0), (2.0, 1.0))), "got -1.0 s at point 1"),
        (lambda: TabulatedPulse(((1.0, 1.0), (1.0, 2.0))), "`duration` must be within"),
        (lambda: SineDwell(1.0, 0.0, 1.0), "The frequency of a sine dwell must be within"),
        (lambda: SineDwell(1.0, 1e4, 9.0).averages(1.0, 9), "takes in 1e\\+04 periods of a sine of up to 10000 Hz"),
        (lambda: SineDwell(1.0, 10.0, 1.0, 2.0), "`soft_start` must be at most 1 s"),
        (lambda: SineDwell(1.0, 10.0, 1.0, -1.0), "`soft_start` must be within"),
        (lambda: SineSweep(10.0, 30.0, 1.0, FLAT), "must cover the sweep from 10 to 30 Hz, but covers 10 to 20 Hz"),
        (lambda: SineSweep(10.0, 10.0, 1.0, FLAT), "use a dwell"),
        (lambda: SineSweep.at_octaves_per_minute(0.0, 10.0, 1.0, FLAT), "The first frequency of a sweep must be"),
        (lambda: RandomVibration(FLAT, 0.05, 1), "from 10 Hz on must last 0.1 s or more, got 0.05 s"),
        (lambda: RandomVibration(FLAT, 1.0, -1), "`seed` must be an integer >= 0, got -1"),
        (lambda: RandomVibration(FLAT, 5e6, 1), "may last 100000 s"),
        (lambda: RecordedSignal(TIMES, TIMES), "sample 3 at 1.0 s follows 1.0 s"),
        (lambda: RecordedSignal(TIMES[:2], TIMES), r"arrays of the shapes \(2,\) and \(4,\)"),
        (lambda: RecordedSignal(TIMES[1:3], np.array([1.0, math.nan])), "values of a record must be finite.*sample 2"),
        (lambda: LevelTable(((1.0, 1.0),)), "two points or more, got 1"),
        (lambda: LevelTable(((1.0, 1.0), (2.0, 0.0))), "level of point 2 of the table"),
        (lambda: LevelTable(((2.0, 1.0), (2.0, 3.0))), "point 2 at 2 Hz follows 2 Hz"),
        (lambda: LevelTable(((math.nan, 1.0), (2.0, 3.0))), "The frequency of point 1 of the table"),
        (lambda: displacement_limited(0.0, 10.0, 5.0, 200.0), "amplitude of displacement must be finite and > 0"),
    ],
)
def test_what_no_signal_can_be_is_refused_in_a_sentence(make: Callable[[], object], message: str) -> None:
    with pytest.raises(MountedSystemError, match=message) as refusal:
        make()
    assert str(refusal.value).endswith(".")
