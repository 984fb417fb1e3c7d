"""Loads as averages over time steps: against quadrature of formulas written here, unchanged by half the step; random
vibration has the density asked for, and power spectra the errors that they state.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
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
from strandspring.vibration.signals.spectra import power_spectrum

D, END = 0.011, 0.4
PROFILE = displacement_limited(0.001, 10.0, 5.0, 200.0)
RECOIL = TabulatedPulse(((0.001, 0.0), (0.002, 3.0), (0.002, 5.0), (0.0045, 5.0), (0.01, 0.0)))


def rise(t: float, soft_start: float) -> float:
    return 0.5 * (1.0 - math.cos(math.pi * t / soft_start)) if t < soft_start else 1.0


def swept(first: float, last: float, is_logarithmic: bool) -> tuple[SineSweep, Callable[[float], float], list[float]]:
    """A sweep, its formula, and where that bends."""
    octaves, sweep = math.log(last / first), SineSweep(first, last, END, PROFILE, is_logarithmic)

    def value(t: float) -> float:
        f = first * math.exp(octaves * t / END) if is_logarithmic else first + (last - first) * t / END
        cycles = (f - first) * END / octaves if is_logarithmic else 0.5 * (first + f) * t
        return min(10.0, 0.001 * (2.0 * math.pi * f) ** 2) * math.sin(2.0 * math.pi * cycles)

    bends = sweep.time([f for f, _ in PROFILE.points if 7.0 < f < 180.0])
    return sweep, value, [*sorted(bends.tolist()), END]


# Each signal, its formula within its duration, where that bends, and its integral if it is a pulse.
SIGNALS: list[tuple[Signal, Callable[[float], float], list[float], float | None]] = [
    (HalfSine(-4.0, D), lambda t: -4.0 * math.sin(math.pi * t / D), [D], -8.0 * D / math.pi),
    (VersedSine(4.0, D), lambda t: 2.0 * (1.0 - math.cos(2.0 * math.pi * t / D)), [D], 2.0 * D),
    (StraightPulse(4.0, D, CORNERS["terminal-sawtooth"]), lambda t: 4.0 * t / D, [D], 2.0 * D),
    (StraightPulse(4.0, D, CORNERS["initial-sawtooth"]), lambda t: 4.0 * (1.0 - t / D), [D], 2.0 * D),
    (StraightPulse(4.0, D, CORNERS["rectangle"]), lambda _: 4.0, [D], 4.0 * D),
    (StraightPulse(4.0, D, CORNERS["triangle"]), lambda t: 4.0 * (1.0 - abs(2.0 * t / D - 1.0)), [D / 2.0, D], 2.0 * D),
    (trapezoid(4.0, D, 0.001, 0.002), lambda t: 4.0 * min(1.0, t / 0.001, (D - t) / 0.002), [0.001, 0.009, D],
     4.0 * (D - 0.0015)),
    (RECOIL, lambda t: 0.0 if t < 0.001 else 3e3 * (t - 0.001) if t < 0.002 else min(5.0, 5.0 * (0.01 - t) / 0.0055),
     [0.001, 0.002, 0.0045, 0.01], 0.0015 + 5.0 * 0.0025 + 0.01375),
    (HeldAcceleration(4.0, 0.03, 0.02), lambda t: 4.0 * rise(t, 0.02), [0.02, 0.03], None),
    *((SineDwell(4.0, 97.0, 0.03, soft), lambda t, soft=soft: 4.0 * rise(t, soft) * math.sin(2.0 * math.pi * 97.0 * t),
       [soft, 0.03], None) for soft in (0.0, 1e-7, 0.0133)),
    *((*swept(*ends, shape), None) for ends in ((7.0, 180.0), (180.0, 7.0)) for shape in (True, False)),
]  # fmt: skip
DENSITY = LevelTable(((50.0, 1.0), (100.0, 2.0), (300.0, 1.0)))
RECORD = RecordedSignal(np.array([5.0, 5.001, 5.004, 5.0041, 5.02]), np.array([1.0, 2.0, -1.0, 4.0, 3.0]), is_held=True)


def quadrature(formula: Callable[[float], float], bends: list[float], low: float, high: float) -> float:
    """Mean of a formula that ends at the last bend."""
    cuts = [low, *(bend for bend in bends if low < bend < min(high, bends[-1])), min(high, bends[-1])]
    return sum(quad(formula, a, b, epsabs=1e-15)[0] for a, b in pairwise(cuts) if b > a) / (high - low)


@pytest.mark.parametrize(("signal", "formula", "bends", "area"), SIGNALS, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize("share", [1 / 33, 1 / 7, 1.7])
def test_averages_are_integrals(
    signal: HalfSine, formula: Callable[[float], float], bends: list[float], area: float | None, share: float
) -> None:
    step = share * bends[-1]
    count = int(1.1 / share) + 2
    expected = [quadrature(formula, bends, k * step, (k + 1) * step) for k in range(count)]
    averages = signal.averages(step, count)
    assert averages == pytest.approx(expected, rel=1e-11, abs=1e-11)  # quad's own error
    assert np.all(averages[math.ceil(bends[-1] / step * (1.0 + 1e-12)) :] == 0.0)
    if area is not None:
        assert signal.velocity_change == pytest.approx(area, rel=1e-14)
        times = np.linspace(1e-5, bends[-1] - 1e-5, 37)
        assert signal.at(times) == pytest.approx([formula(t) for t in times], rel=1e-12, abs=1e-12)
        assert signal.at([-1e-9, 1.001 * bends[-1]]).tolist() == [0.0, 0.0]


ALL = [*(signal for signal, *_ in SIGNALS), VelocityStep(0.3), RandomVibration(DENSITY, 0.03, seed=1), RECORD]


@settings(max_examples=80)
@given(signal=st.sampled_from(ALL), step=st.floats(1e-5, 0.1), count=st.integers(1, 400))
def test_halving_the_step_does_not_change_the_signal(signal: Signal, step: float, count: int) -> None:
    """What a run with half the step changes is the error of the integration, not the signal."""
    whole, halves = signal.averages(step, count), signal.averages(step / 2.0, 2 * count)
    # Rounding of times 1e-16*t shifts what a step takes of a jump or slope, in relation to the step.
    assert halves.reshape(-1, 2).mean(axis=1) == pytest.approx(whole, rel=1e-10, abs=1e-9)


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), samples=st.integers(2, 60), step=st.floats(1e-3, 3.0), is_held=st.booleans())
def test_averages_of_records_at_uneven_times(seed: int, samples: int, step: float, is_held: bool) -> None:
    """From the first sample on; after the last they are zero or held."""
    rng = np.random.default_rng(seed)
    time, value = np.cumsum(rng.exponential(0.1, samples)), rng.standard_normal(samples)
    averages, inside = RecordedSignal(time, value, is_held).averages(step, 5), time - time[0]
    for k in range(5):
        low, high = k * step, (k + 1) * step
        cuts = np.unique(
            np.clip(np.append(inside, [low, high]), low, high if is_held else max(min(high, inside[-1]), low))
        )
        area = np.trapezoid(np.interp(cuts, inside, value), cuts)
        assert averages[k] == pytest.approx(area / step if low < inside[-1] or is_held else 0.0, abs=1e-12)


def test_what_signals_state_and_digits_that_they_keep() -> None:
    ends = RecordedSignal(np.array([5.0, 5.5, 6.0]), np.array([1.0, 3.0, 2.0]))
    assert (ends.duration, ends.velocity_change, ends.shortest) == (1.0, 2.25, 1.0)
    assert ends.at([0.0, 0.25, 0.5]) == pytest.approx([1.0, 2.0, 3.0])
    assert RecordedSignal(np.append(np.arange(20.0), 60.0), np.ones(21)).shortest == 10.0
    with pytest.raises(ValueError, match="read-only"):
        ends.value[0] = 2.0
    assert VelocityStep(-0.3).averages(0.001, 3).tolist() == [-300.0, 0.0, 0.0]
    assert VelocityStep(-0.3).shortest == math.inf
    table = LevelTable(((5.0, 1.0), (2000.0, 1.0)))
    assert SineSweep.at_octaves_per_minute(5.0, 2000.0, 1.0, table).duration == pytest.approx(60.0 * math.log2(400.0))
    down = SineSweep.at_hertz_per_second(200.0, 50.0, 3.0, table)
    assert (down.duration, down.is_logarithmic, down.shortest) == (50.0, False, 0.0025)
    # A straight line over three hours, whose integral grows to 1e5; and blocks of steps of quadrature.
    time, middles = np.linspace(0.0, 1e4, 100_001), 0.1 * (np.arange(100_000) + 0.5)
    averages = RecordedSignal(time, 9.80665 + 1e-3 * time).averages(0.1, 100_000)
    assert np.abs(averages - (9.80665 + 1e-3 * middles)).max() < 1e-13  # of up to 20: rounding
    omega, step, count = 2.0 * math.pi * 900.0, 0.0004, 50_000
    averages = smooth_averages(lambda t: np.sin(omega * t), omega, np.array([1.0]), step, count)
    expected = np.sin(omega * step * (np.arange(count) + 0.5)) * np.sinc(900.0 * step)
    assert np.abs(averages - expected).max() < 1e-10  # the phase reaches 1e5 rad: rounding of 1e-16 of it


def test_tables_of_levels() -> None:
    # -3 dB per octave is the slope -1, whose integral is a logarithm.
    table = LevelTable(((20.0, 0.01), (80.0, 0.04), (350.0, 0.04), (700.0, 0.02), (2000.0, 0.001)))
    assert table.at([19.9, 20.0, 40.0, 100.0, 490.0, 2000.0, 2001.0]) == pytest.approx(
        [0.0, 0.01, 0.02, 0.04, 0.04 * 350.0 / 490.0, 0.001, 0.0], rel=1e-13
    )
    area = 0.5 * 60.0 * 0.05 + 0.04 * 270.0 + 14.0 * math.log(2.0)
    assert table.by_band([0.0, 700.0])[0] == pytest.approx(area, rel=1e-13)
    assert table.by_band([10.0, 50.0, 400.0, 700.0]).sum() == pytest.approx(area, rel=1e-13)
    # Level f^-7: the power of high bands is not a difference of large sums.
    edges = np.geomspace(1.0, 1e4, 30)
    steep = LevelTable(((1.0, 1.0), (1e4, 1e-28))).by_band(edges)
    assert steep == pytest.approx(-np.diff(edges**-6.0) / 6.0, rel=1e-12)
    assert PROFILE.points[1][0] == pytest.approx(math.sqrt(10.0 / 0.001) / (2.0 * math.pi))
    assert PROFILE.at([10.0, 100.0]) == pytest.approx([0.001 * (20.0 * math.pi) ** 2, 10.0], rel=1e-13)
    assert len(displacement_limited(0.001, 10.0, 50.0, 200.0).points) == 2


# The shape of MIL-STD-810's general minimum integrity exposure, in (m/s^2)^2/Hz.
EXPOSURE = LevelTable(((20.0, 1.0), (80.0, 4.0), (350.0, 4.0), (2000.0, 0.7)))
SEED = 20_250_615


def test_random_vibration_has_the_density_asked_for() -> None:
    step = 1.0 / 20_000.0
    history = RandomVibration(EXPOSURE, 40.0, SEED).averages(step, 800_000)
    found = power_spectrum(history, step, resolution=5.0)
    inside = (found.frequency >= 40.0) & (found.frequency <= 1990.0)
    f = found.frequency[inside]
    # Averages over a step have the density times sinc(f*h)^2.
    ratio = found.density[inside] / (EXPOSURE.at(f) * np.sinc(f * step) ** 2)
    # Independent lines are two apart with Hann's window. 195 of them: the mean within 4 of its standard errors, the
    # spread within 4 of its own, no line beyond 4.5.
    lines = ratio[::2]
    assert lines.mean() == pytest.approx(1.0, abs=4.0 * found.relative_error / math.sqrt(lines.size))
    assert lines.std() == pytest.approx(found.relative_error, rel=4.0 / math.sqrt(2.0 * lines.size))
    assert np.abs(ratio - 1.0).max() < 4.5 * found.relative_error
    assert found.density[found.frequency > 2020.0].max() < 1e-4
    assert found.root_mean_square == pytest.approx(EXPOSURE.root_mean_square, rel=4.0 * found.root_mean_square_error)
    # Its bandwidth is 1.2 kHz: some 96 000 independent values, whose kurtosis has the error sqrt(24/96000) = 0.016.
    assert (stats.kurtosis(history), stats.skew(history)) == pytest.approx((0.0, 0.0), abs=0.06)
    # The power of 10 lines scatters by 1/sqrt(10); with phases alone drawn it would not.
    narrow = LevelTable(((95.0, 1.0), (105.0, 1.0)))
    powers = [np.mean(RandomVibration(narrow, 1.0, seed).averages(1e-3, 1000) ** 2) for seed in range(400)]
    assert np.std(powers) / np.mean(powers) == pytest.approx(math.sqrt(0.1), rel=4.0 / math.sqrt(800.0))
    assert np.mean(powers) == pytest.approx(10.0 * np.sinc(0.1) ** 2, rel=4.0 * math.sqrt(0.1 / 400.0))


def test_a_seed_gives_the_same_bytes_at_any_step_and_another_seed_another_signal() -> None:
    vibrations = [RandomVibration(EXPOSURE, 1.0, seed) for seed in (SEED, SEED, SEED + 1)]
    first, again, other = (vibration.pieces().averages(1e-4, 10_000) for vibration in vibrations)
    assert first.tobytes() == again.tobytes()
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.1
    fine = vibrations[0].averages(2.5e-5, 40_000).reshape(-1, 4).mean(axis=1)
    assert np.abs(fine - first).max() < 1e-9
    assert vibrations[0].averages(1e-4, 10_100)[10_000:].tolist() == [0.0] * 100
    # Straight lines between samples have the power of the sum of sines up to its highest frequency.
    table, time = LevelTable(((0.5, 1.0), (50.0, 1.0))), np.arange(0.0, 7.98, 1.0 / 2000.0)
    k, period = np.arange(1, 401), 8.0  # 3996 samples are taken from a period of 4000 at 500 Hz
    deviation = np.sqrt(table.by_band((np.arange(1, 402) - 0.5) / period))
    drawn = np.random.default_rng(SEED).standard_normal((402, 2))[1:401]
    phase = 2.0 * np.pi * np.outer(time, k / period)
    expected = np.cos(phase) @ (deviation * drawn[:, 0]) + np.sin(phase) @ (deviation * drawn[:, 1])
    found = RandomVibration(table, 7.99, SEED).at(time)
    assert np.mean((found - expected) ** 2) < 3e-4 * np.mean(expected**2)


def test_stated_errors_of_power_spectra_are_the_scatter() -> None:
    rng = np.random.default_rng(4)
    spectra = [power_spectrum(rng.standard_normal(4000), 0.001, 20.0) for _ in range(200)]
    densities = np.array([spectrum.density[2:-2] for spectrum in spectra])  # the ends have half the lines
    assert densities.mean() == pytest.approx(0.002, rel=0.01)  # 2/1000 for a variance of 1 up to 500 Hz
    # 200 histories of 22 lines give the scatter within some 3 %, their roots within 1/sqrt(2*200) = 5 %.
    assert densities.std() / densities.mean() == pytest.approx(spectra[0].relative_error, rel=0.06)
    roots = np.array([spectrum.root_mean_square for spectrum in spectra])
    assert roots.std() == pytest.approx(spectra[0].root_mean_square_error, rel=0.2)
    for samples, resolution in ((8000, 1.0), (8003, 1.003)):
        history = 3.0 * np.sin(2.0 * np.pi * 100.0 * np.arange(samples) / 1000.0) + 7.0
        spectrum = power_spectrum(history, 0.001, resolution)
        assert spectrum.root_mean_square == pytest.approx(3.0 / math.sqrt(2.0), rel=2e-3)
        assert spectrum.resolution == pytest.approx(resolution, rel=1e-2)


FLAT, TIMES, ONES = LevelTable(((10.0, 1.0), (20.0, 1.0))), np.array([0.0, 1.0, 1.0, 2.0]), np.ones(100)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HalfSine(math.nan, 0.011), "`peak` must be finite"),
        (lambda: HalfSine(1.0, 0.0), r"`duration` must be within \[1e-09, 1e\+07\] s, got 0.0"),
        (lambda: trapezoid(1.0, 0.01, 0.006, 0.006), "together at most its duration of 0.01 s"),
        (lambda: trapezoid(1.0, 0.01, -0.001, 0.006), "must be >= 0"),
        (lambda: HeldAcceleration(4.0, 0.03, 0.04), "rise of a constant acceleration must be at most its duration"),
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
        (lambda: SineSweep.at_octaves_per_minute(10.0, 20.0, -1.0, FLAT), "rate of a sweep must be finite and > 0"),
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
        (lambda: power_spectrum(ONES, 0.001, 5.0), "needs segments of 0.2 s within the history of 0.1 s"),
        (lambda: power_spectrum(ONES, 0.001, math.nan), "The resolution of a power spectrum must be within"),
        (lambda: power_spectrum(ONES, 0.001, 500.0), "each of 8 samples or more"),
        (lambda: power_spectrum(ONES, 0.0, 5.0), "interval between two samples must be within"),
        (lambda: power_spectrum(math.nan * ONES, 0.001, 20.0), "finite and within"),
    ],
)
def test_what_no_signal_can_be_is_refused_in_a_sentence(make: Callable[[], object], message: str) -> None:
    with pytest.raises(MountedSystemError, match=message) as refusal:
        make()
    assert str(refusal.value).endswith(".")
