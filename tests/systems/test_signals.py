"""Loads as averages over time steps, and their spectra: against quadrature of formulas, Smallwood's filter and pyyeti;
random vibration has the density asked for, synthesized shocks the spectrum that they state.
"""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mounted_examples import UP, FloatArray, elastic, one_mass
from strandspring.errors import MountedSystemError
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel
from strandspring.vibration.bodies.parts import MountAxis
from strandspring.vibration.signals import pulses, sine_signals
from strandspring.vibration.signals.level_table import LevelTable, displacement_limited
from strandspring.vibration.signals.pulses import HalfSine
from strandspring.vibration.signals.random_signal import RandomVibration
from strandspring.vibration.signals.recorded_signal import RecordedSignal
from strandspring.vibration.signals.shock_spectra import RequiredSpectrum, octave_frequencies, shock_spectrum
from strandspring.vibration.signals.shock_synthesis import synthesized_shock
from strandspring.vibration.signals.spectra import power_spectrum
from strandspring.vibration.verdicts.answers import answer_case
from strandspring.vibration.verdicts.draws import Unknowns
from strandspring.vibration.verdicts.verdicts import FigureKind, Limits
from tools import tool

pytestmark = pytest.mark.long

D = 0.011
PROFILE = displacement_limited(0.001, 10.0, 5.0, 200.0)
ROWS = Path(__file__).with_name("signals.txt").read_text(encoding="utf-8").splitlines()[1:]


def rise(t: float, soft_start: float) -> float:
    return 0.5 * (1.0 - math.cos(math.pi * t / soft_start)) if t < soft_start else 1.0


def swept(t: float, first: float, last: float, is_logarithmic: bool) -> float:
    """A sweep of 0.4 s."""
    octaves, share = math.log(last / first), t / 0.4
    f = first * math.exp(octaves * share) if is_logarithmic else first + (last - first) * share
    cycles = (f - first) * 0.4 / octaves if is_logarithmic else 0.5 * (first + f) * t
    return min(10.0, 0.001 * (2.0 * math.pi * f) ** 2) * math.sin(2.0 * math.pi * cycles)


def bends(first: float, last: float, is_logarithmic: bool) -> list[float]:
    """Times of the corners of PROFILE."""
    places = np.array([f for f, _ in PROFILE.points if 7.0 < f < 180.0])
    ways = np.log(places / first) / math.log(last / first), (places - first) / (last - first)
    return sorted((0.4 * ways[0 if is_logarithmic else 1]).tolist())


RECOIL = ((0.001, 0.0), (0.002, 3.0), (0.002, 5.0), (0.0045, 5.0), (0.01, 0.0))
NAMES = {
    **vars(math), **vars(pulses), **vars(sine_signals), "D": D, "PROFILE": PROFILE, "RECOIL": RECOIL, "rise": rise,
    "swept": swept, "bends": bends,
}  # fmt: skip


@pytest.mark.parametrize("row", ROWS)
def test_averages_are_integrals(row: str) -> None:
    from scipy.integrate import quad

    made, text, places, of_pulse = row.split(" | ")
    signal, bends, area = (eval(each, NAMES) for each in (made, f"[{places}]", of_pulse))  # noqa: S307

    def formula(t: float) -> float:
        return float(eval(compiled, NAMES, {"t": t}))  # noqa: S307

    def mean(low: float, high: float) -> float:
        """Of a formula that ends at the last bend."""
        cuts = [low, *(bend for bend in bends if low < bend < min(high, bends[-1])), min(high, bends[-1])]
        return sum(quad(formula, a, b, epsabs=1e-15)[0] for a, b in pairwise(cuts) if b > a) / (high - low)

    compiled = compile(text, "formula", "eval")
    for share in (1 / 33, 1 / 7, 1.7):
        step, count = share * bends[-1], int(1.1 / share) + 2
        averages = signal.averages(step, count)
        expected = [mean(k * step, (k + 1) * step) for k in range(count)]
        assert averages == pytest.approx(expected, rel=1e-11, abs=1e-11)  # quad's own error
        assert np.all(averages[math.ceil(bends[-1] / step * (1.0 + 1e-12)) :] == 0.0)
    if area is not None:
        assert signal.velocity_change == pytest.approx(area, rel=1e-14)
        times = np.linspace(1e-5, bends[-1] - 1e-5, 37)
        assert signal.at(times) == pytest.approx([formula(t) for t in times], rel=1e-12, abs=1e-12)
        assert signal.at([-1e-9, 1.001 * bends[-1]]).tolist() == [0.0, 0.0]


@settings(max_examples=30)
@given(seed=st.integers(0, 10_000), samples=st.integers(2, 60), step=st.floats(1e-3, 3.0), is_held=st.booleans())
def test_averages_of_records_at_uneven_times(seed: int, samples: int, step: float, is_held: bool) -> None:
    """From the first sample on; after the last they are zero or held."""
    rng = np.random.default_rng(seed)
    time, value = np.cumsum(rng.exponential(0.1, samples)), rng.standard_normal(samples)
    averages, inside = RecordedSignal(time, value, is_held).averages(step, 5), time - time[0]
    for k in range(5):
        low, high = k * step, (k + 1) * step
        end = high if is_held else max(min(high, inside[-1]), low)
        cuts = np.unique(np.clip(np.append(inside, [low, high]), low, end))
        area = np.trapezoid(np.interp(cuts, inside, value), cuts)
        assert averages[k] == pytest.approx(area / step if low < inside[-1] or is_held else 0.0, abs=1e-12)


# The shape of MIL-STD-810's general minimum integrity exposure, in (m/s^2)^2/Hz.
EXPOSURE = LevelTable(((20.0, 1.0), (80.0, 4.0), (350.0, 4.0), (2000.0, 0.7)))


def test_a_level_falls_as_a_power_between_points() -> None:
    """-3 dB per octave is the slope -1, whose integral is a logarithm; of f^-7 high bands are no rounding."""
    table = LevelTable(((20.0, 0.01), (80.0, 0.04), (350.0, 0.04), (700.0, 0.02)))
    area = 0.5 * 60.0 * 0.05 + 0.04 * 270.0 + 14.0 * math.log(2.0)
    assert table.by_band([10.0, 50.0, 400.0, 700.0]).sum() == pytest.approx(area, rel=1e-13)
    edges = np.geomspace(1.0, 1e4, 30)
    steep = LevelTable(((1.0, 1.0), (1e4, 1e-28))).by_band(edges)
    assert steep == pytest.approx(-np.diff(edges**-6.0) / 6.0, rel=1e-12)


def test_random_vibration_has_the_density_asked_for() -> None:
    step = 1.0 / 20_000.0
    history = RandomVibration(EXPOSURE, 40.0, 20_250_615).averages(step, 800_000)
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
    assert found.root_mean_square == pytest.approx(EXPOSURE.root_mean_square, rel=4.0 * found.root_mean_square_error)
    # Its bandwidth is 1.2 kHz: some 96 000 independent values, whose kurtosis has the error sqrt(24/96000) = 0.016.
    normal = (history - history.mean()) / history.std()
    assert (np.mean(normal**4) - 3.0, np.mean(normal**3)) == pytest.approx((0.0, 0.0), abs=0.06)
    # The power of 10 lines scatters by 1/sqrt(10); with phases alone drawn it would not.
    narrow = LevelTable(((95.0, 1.0), (105.0, 1.0)))
    powers = [np.mean(RandomVibration(narrow, 1.0, seed).averages(1e-3, 1000) ** 2) for seed in range(400)]
    assert np.std(powers) / np.mean(powers) == pytest.approx(math.sqrt(0.1), rel=4.0 / math.sqrt(800.0))


# ---- shock response spectra -----------------------------------------------------------------------

N = 2000
HALF_SINE = np.sin(np.pi * np.arange(N + 1) / N)  # of a duration of 1 s: frequencies are the products f*T


def own_spectrum(samples: FloatArray, interval: float, frequencies: FloatArray, zeta: float) -> FloatArray:
    """The largest responses by Smallwood's ramp-invariant filter for the absolute acceleration, as published in 1981;
    what is shaken is still after the samples, for two periods.
    """
    from scipy.signal import lfilter

    maxima = []
    for frequency in frequencies.tolist():
        theta, still = 2.0 * math.pi * frequency * interval, np.zeros(math.ceil(2.0 / (frequency * interval)))
        e, b = math.exp(-zeta * theta), theta * math.sqrt(1.0 - zeta**2)
        c, s = e * math.cos(b), e * math.sin(b) / b
        response = lfilter([1.0 - s, 2.0 * (s - c), e * e - s], [1.0, -2.0 * c, e * e], np.append(samples, still))
        maxima.append(np.abs(response).max())
    return np.array(maxima)


RISING = np.arange(N + 1) / N


@pytest.mark.parametrize(
    ("samples", "low", "high", "residual", "expected"),
    [
        (HALF_SINE, 0.6, 1.0, False, (0.809937, 1.768458)),
        (HALF_SINE, 0.6, 1.0, True, (0.683622, 1.715509)),
        (RISING, 0.5, 0.8, False, (0.650283, 1.259591)),
    ],
)
def test_textbook_values_of_classical_pulses(
    samples: FloatArray, low: float, high: float, residual: bool, expected: tuple[float, float]
) -> None:
    """Without damping; the top is flat: its height is certain to 1e-6, its place to some 1e-4."""
    frequency = np.linspace(low, high, 4001)
    found = shock_spectrum(samples, 1.0 / N, frequency, 0.0)
    spectrum = np.abs(found.extrema[2:]).max(axis=0) if residual else found.maximax
    assert (frequency[spectrum.argmax()], spectrum.max()) == pytest.approx(expected, abs=1e-4)
    with pytest.raises(MountedSystemError, match=r"natural frequency of 501 Hz.*end the spectrum at 500 Hz"):
        shock_spectrum(samples, 1.0 / N, [501.0])


ASKED = [(25.0, ((20.0, 1.0), (100.0, 100.0), (1000.0, 100.0))),
         (10.0, ((20.0, 20.0), (45.0, 75.0), (860.0, 75.0), (1000.0, 60.0)))]  # fmt: skip


@pytest.mark.parametrize(("quality", "levels"), ASKED)
def test_a_synthesized_shock_has_the_spectrum_that_it_states(quality: float, levels: Any) -> None:
    """The stated deviations are the least and the largest of all frequencies, the corners of the levels among them."""
    asked = RequiredSpectrum(LevelTable(tuple((f, 9.80665 * a) for f, a in levels)), quality)
    shock = synthesized_shock(asked, 0.2)
    # Ten samples in a period of the last frequency: 64 on each straight line find every peak.
    fine = np.arange(0.0, shock.duration + 0.1, float(shock.time[1]) / 8.0)
    samples, points = np.interp(fine, shock.time, shock.value, right=0.0), np.array(asked.levels.points).T
    frequency = np.unique(np.append(np.geomspace(asked.levels.lowest, asked.levels.highest, 400), points[0]))
    found = own_spectrum(samples, float(fine[1]), frequency, 0.5 / asked.quality)
    deviation = 20.0 * np.log10(found / np.exp(np.interp(np.log(frequency), *np.log(points))))
    # 80 samples in a period of the last frequency miss 0.01 dB, and 400 frequencies a sharp minimum, where one peak of
    # a response takes over from another, by up to 0.3 dB.
    assert deviation.min() - 0.3 < shock.deviation[0] < deviation.min() + 0.02
    assert deviation.max() - 0.02 < shock.deviation[1] < deviation.max() + 0.1
    assert max(-shock.deviation[0], shock.deviation[1]) < 2.0
    # The base comes to rest where it was: a wavelet leaves nothing, straight lines between samples a little.
    moved = shock.value
    for share in (1e-4, 5e-3):
        moved = np.cumsum(moved) * shock.time[1]
        assert abs(moved[-1]) < share * np.abs(moved).max()
    other = shock.redrawn(0, 1)
    within = shock_spectrum(other.value, float(other.time[1]), asked.frequencies, asked.damping).maximax
    assert np.abs(20.0 * np.log10(within / asked.at(asked.frequencies))).max() <= 3.0


def test_pyyeti_finds_the_same() -> None:
    srs, quality = tool("pyyeti.srs").srs, 50.0
    rng, step = np.random.default_rng(15), 1e-5
    time = step * np.arange(12_000)
    frequencies = octave_frequencies(5.0, 500.0, 6)
    shock = sum(rng.standard_normal() * np.exp(-80.0 * time) * np.sin(2.0 * np.pi * f * time) for f in frequencies[::3])
    found = shock_spectrum(shock, step, frequencies, 0.5 / quality)
    low, high = np.abs(found.extrema[:2])
    for ours, peak, part in ((low, "poss", "primary"), (high, "negs", "primary"), (found.maximax, "abs", "total")):
        options = {"stype": "absacce", "rolloff": "none", "parallel": "no", "peak": peak, "time": part}
        # pyyeti takes the largest sample, which misses up to (2*pi*f*h)^2/8 = 1.3e-4 at 500 Hz.
        assert ours == pytest.approx(np.abs(srs(shock, 1.0 / step, frequencies, quality, **options)), rel=1.5e-4)


def test_shares_of_a_limit_do_not_depend_on_the_size_of_both() -> None:
    acceleration = np.random.default_rng(3).standard_normal((4000, 2)).cumsum(axis=0) * (1.0, 0.9)
    corners = ((10.0, 100.0), (60.0, 40.0), (200.0, 400.0))
    shares = [
        RequiredSpectrum(LevelTable(tuple((f, c * level) for f, level in corners)), 12.0).share(
            *[c * acceleration] * 2, 1e-4
        )
        for c in (1.0, 1e-5)
    ]
    assert shares[0] == pytest.approx(shares[1], rel=1e-9)


def test_a_pulse_has_a_million_points_at_most() -> None:
    many = ((0.0, 1.0),) * 999_999 + ((1.0, 1.0),)
    assert pulses.TabulatedPulse(many).shortest > 0.0
    with pytest.raises(MountedSystemError, match="2 to 1,000,000 points, got 1000001"):
        pulses.TabulatedPulse((*many, (1.0, 1.0)))


STIFFNESS, PEAK = 1.0e4, 150.0


def test_drawn_limits_with_notches_hold_an_own_spectrum() -> None:
    """Of 1 kg on an elastic spring: each share is within its printed error of the largest of an own spectrum over 800
    frequencies and all corners, and 100 more about the largest of these.

    At 20 us a largest sample misses up to (2*pi*f*h)^2/8 = 8e-5, and the 100 frequencies (Q*1e-4)^2/2 at a peak; both
    are well below the least printed error, of 1e-3.
    """
    random, interval, end = np.random.default_rng(52), 2e-5, 0.5
    time, root, rate = interval * np.arange(round(end / interval) + 1), math.sqrt(STIFFNESS), math.pi / D
    # The mass in closed form; after the pulse it swings freely: two responses, one later by the duration.
    factor = PEAK * root / (root**2 - rate**2)
    during = factor * (root * np.sin(rate * time) - rate * np.sin(root * time))
    after = -factor * rate * (np.sin(root * time) + np.sin(root * (time - D)))
    samples = np.where(time < D, during, after)
    system = one_mass(MountAxis(elastic(0.0, STIFFNESS), UP, 0.0))
    case = LoadCase("case", "pulse", end, (LoadChannel(ChannelKind.BASE_ACCELERATION, HalfSine(PEAK, D), UP),))
    for _ in range(5):
        place, depth, flank = random.uniform(12.0, 150.0), random.uniform(0.1, 0.5), random.choice([1e-4, 0.01, 0.04])
        low, high = random.uniform(100.0, 400.0, 2).tolist()
        corners = ((10.0, low), (place * (1.0 - flank), low), (place, depth * low), (place * (1.0 + flank), high))
        limit = RequiredSpectrum(LevelTable((*corners, (200.0, high))), random.choice([8.0, 12.0, 100.0]))
        limits = Limits({FigureKind.SRS: {"mass": 1.0}}, {}, {"mass": limit})
        (figure,) = answer_case("mass", system, case, limits, Unknowns(draws=16)).figures_of(FigureKind.SRS)
        points = np.array(limit.levels.points).T
        frequencies, own = np.append(np.geomspace(10.0, 200.0, 800), points[0]), 0.0
        for _ in range(2):
            levels = np.exp(np.interp(np.log(frequencies), *np.log(points)))
            shares = own_spectrum(samples, interval, frequencies, 0.5 / limit.quality) / levels
            own, top = max(own, float(shares.max())), float(frequencies[shares.argmax()])
            frequencies = np.linspace(max(10.0, 0.99 * top), min(200.0, 1.01 * top), 100)
        assert abs(figure.value - own) <= figure.error, (limit, own)
        assert figure.error < 0.01 * own
