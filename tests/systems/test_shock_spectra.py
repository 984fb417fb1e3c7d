"""Shock response spectra: textbook values, Smallwood's filter, shocks synthesized from them, and limits by them."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.signal import lfilter

from mounted_examples import UP, elastic, one_mass
from strandspring.api.vibration.simulating import simulate
from strandspring.errors import MountedSystemError
from strandspring.kernel.shock import largest_responses, straight_pieces
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from strandspring.vibration.bodies.parts import MountAxis
from strandspring.vibration.bodies.simulation import simulate_case
from strandspring.vibration.signals.level_table import LevelTable
from strandspring.vibration.signals.pulses import CORNERS, HalfSine, StraightPulse
from strandspring.vibration.signals.shock_spectra import RequiredSpectrum, octave_frequencies, shock_spectrum
from strandspring.vibration.signals.shock_synthesis import synthesized_shock
from strandspring.vibration.verdicts.answers import CaseAnswer, answer_case
from strandspring.vibration.verdicts.draws import Unknowns
from strandspring.vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind, Limits
from tools import tool

pytestmark = pytest.mark.long

N, SEED = 2000, 11
HALF_SINE = np.sin(np.pi * np.arange(N + 1) / N)  # of a duration of 1 s: frequencies are the products f*T
SAWTOOTH = np.arange(N + 1) / N


def smallwood(theta: Any, zeta: Any, m: Any = mpmath.fp) -> tuple[list[Any], list[Any]]:
    """Coefficients of the ramp-invariant filter for the absolute acceleration, as published in 1981."""
    e, b = m.exp(-zeta * theta), theta * m.sqrt(1 - m.mpf(zeta) ** 2)
    c, ratio = e * m.cos(b), e * m.sin(b) / b
    return [1 - ratio, 2 * (ratio - c), e * e - ratio], [1, -2 * c, e * e]


def own_spectrum(samples: np.ndarray, interval: float, frequencies: np.ndarray, zeta: float) -> np.ndarray:
    """The largest responses; what is shaken is still after the samples, for two periods."""
    maxima = []
    for frequency in frequencies.tolist():
        after = np.zeros(math.ceil(2.0 / (frequency * interval)))
        response = lfilter(*smallwood(2.0 * math.pi * frequency * interval, zeta), np.append(samples, after))
        maxima.append(np.abs(response).max())
    return np.array(maxima)


def levels_at(required: RequiredSpectrum, frequencies: np.ndarray) -> np.ndarray:
    """Straight lines on logarithmic scales."""
    return np.exp(np.interp(np.log(frequencies), *np.log(np.array(required.levels.points)).T))


@pytest.mark.parametrize(
    ("samples", "low", "high", "part", "expected"),
    [
        (HALF_SINE, 0.6, 1.0, "maximax", (0.809937, 1.768458)),
        (HALF_SINE, 0.6, 1.0, "residual", (0.683622, 1.715509)),
        (SAWTOOTH, 0.5, 0.8, "maximax", (0.650283, 1.259591)),
    ],
)
def test_textbook_values_of_classical_pulses(
    samples: np.ndarray, low: float, high: float, part: str, expected: tuple[float, float]
) -> None:
    """Without damping; the top is flat: its height is certain to 1e-6, its place to some 1e-4."""
    frequency = np.linspace(low, high, 4001)
    found = shock_spectrum(samples, 1.0 / N, frequency, 0.0)
    spectrum = found.maximax if part == "maximax" else np.abs(found.extrema[2:]).max(axis=0)
    assert (frequency[spectrum.argmax()], spectrum.max()) == pytest.approx(expected, abs=1e-4)
    mirrored = shock_spectrum(-samples, 1.0 / N, frequency, 0.0)
    assert mirrored.extrema[[1, 0, 3, 2]] == pytest.approx(-found.extrema, rel=1e-13)
    # The residual is what follows in a longer record; the cubic between samples errs by 1e-9.
    if samples is HALF_SINE:
        longer = shock_spectrum(np.append(samples, np.zeros(4 * N)), 1.0 / N, frequency[::500], 0.0)
        extremes = found.extrema[[0, 2], ::500].max(axis=0), found.extrema[[1, 3], ::500].min(axis=0)
        assert longer.extrema[:2] == pytest.approx(np.array(extremes), abs=2e-8)


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.5, 0.95])
def test_smallwood_filter_on_the_same_straight_lines(zeta: float) -> None:
    """Of 64 samples on each straight line, so that the largest sample is all but the largest response."""
    x, fine = np.random.default_rng(SEED).standard_normal(300), 64
    # A jump at the beginning is not part of the filter, which is straight from 0 before the first sample.
    x[0] = 0.0
    lines = np.interp(np.arange(299 * fine + 1) / fine, np.arange(300), x)
    theta = 2.0 * np.pi * np.array([0.001, 0.01, 0.03, 0.1])
    found = largest_responses(straight_pieces(x), theta, zeta)
    for row, phase in zip(found, theta, strict=True):
        after = math.ceil(2.0 * math.pi / phase) + 2
        # After the last sample the acceleration is 0 at once; the line down to 0 takes a fine step of it away.
        response = lfilter(*smallwood(phase / fine, zeta), np.append(lines, np.zeros(after * fine)))
        primary, residual = response[: lines.size], response[lines.size :]
        # Fourth derivatives over a step, which the cubic neglects, and second ones over a fine step: of the response
        # or its input, and of the damper's force by the slope of the input.
        level, damper = max(np.abs(x).max(), np.abs(response).max()), 4.0 * zeta
        cubic = (phase**4 + damper * phase**3) / 384.0 * level
        tolerance = cubic + ((phase / fine) ** 2 + damper * phase / fine**2) / 8.0 * level
        ends = [max(primary[-1], residual.max()), min(primary[-1], residual.min())]
        assert row[:2] == pytest.approx([primary.max(), primary.min()], abs=tolerance)
        assert row[2:] == pytest.approx(ends, abs=tolerance + phase / fine * level)


@pytest.mark.parametrize("theta", [1e-9, 1e-6, 1e-3, 0.3])
@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.7])
def test_no_digits_are_lost_where_the_sampling_is_dense(theta: float, zeta: float) -> None:
    """Against Smallwood's filter in 80 digits; its coefficients in doubles would lose all of theirs at 1e-8."""
    x = 1.0 + np.random.default_rng(SEED).random(200)
    x[0] = 0.0
    with mpmath.workdps(80):
        (b0, b1, b2), (_, a1, a2) = smallwood(mpmath.mpf(theta), mpmath.mpf(zeta), mpmath.mp)
        values, responses = [mpmath.mpf(0), *map(mpmath.mpf, x.tolist())], [mpmath.mpf(0)] * 2
        for k in range(2, 201):
            sums = b0 * values[k] + b1 * values[k - 1] + b2 * values[k - 2]
            responses.append(sums - a1 * responses[-1] - a2 * responses[-2])
    # While it rises, the largest response is that at the last sample.
    rising = next((k for k in range(2, 201) if responses[k] <= responses[k - 1]), 202) - 2
    assert rising > 4
    found = largest_responses(straight_pieces(x[:rising]), np.array([theta]), zeta)[0, 0]
    assert found == pytest.approx(float(responses[rising]), rel=1e-13)


def required(*levels: tuple[float, float], quality: float = 10.0) -> RequiredSpectrum:
    return RequiredSpectrum(LevelTable(tuple((f, 9.80665 * a) for f, a in levels)), quality)


FUNCTIONAL = required((10.0, 9.4), (80.0, 75.0), (2000.0, 75.0))
STEEP = required((20.0, 1.0), (100.0, 100.0), (1000.0, 100.0), quality=25.0)


@pytest.mark.parametrize("asked", [STEEP, required((20.0, 20.0), (45.0, 75.0), (860.0, 75.0), (1000.0, 60.0))])
def test_a_synthesized_shock_has_the_spectrum_that_it_states(asked: RequiredSpectrum) -> None:
    """The stated deviations are the least and the largest of all frequencies, the corners of the levels among them."""
    shock = synthesized_shock(asked, 0.2)
    # Ten samples in a period of the last frequency: 64 on each straight line find every peak.
    fine = np.arange(0.0, shock.duration + 0.1, float(shock.time[1]) / 8.0)
    samples, points = np.interp(fine, shock.time, shock.value, right=0.0), [f for f, _ in asked.levels.points]
    frequency = np.unique(np.append(np.geomspace(asked.levels.lowest, asked.levels.highest, 400), points))
    found = own_spectrum(samples, float(fine[1]), frequency, 0.5 / asked.quality)
    deviation = 20.0 * np.log10(found / levels_at(asked, frequency))
    # 80 samples in a period of the last frequency miss 0.01 dB, and 400 frequencies a sharp minimum, where one peak of
    # a response takes over from another, by up to 0.3 dB.
    assert deviation.min() - 0.3 < shock.deviation[0] < deviation.min() + 0.02
    assert deviation.max() - 0.02 < shock.deviation[1] < deviation.max() + 0.1
    assert max(-shock.deviation[0], shock.deviation[1]) < 2.0
    # The base comes to rest where it was: a wavelet leaves nothing, straight lines between samples a little.
    velocity = np.cumsum(shock.value) * shock.time[1]
    displacement = np.cumsum(velocity) * shock.time[1]
    assert abs(velocity[-1]) < 1e-4 * np.abs(velocity).max()
    assert abs(displacement[-1]) < 5e-3 * np.abs(displacement).max()


def test_the_seed_decides_the_record() -> None:
    asked = required((20.0, 50.0), (500.0, 50.0))
    first, other = (synthesized_shock(asked, 0.2, seed).value.tolist() for seed in (0, 1))
    synthesized_shock.cache_clear()
    assert synthesized_shock(asked, 0.2).value.tolist() == first != other
    assert required((1.0, 1.0), (2.0, 1.0), quality=25.0).damping == 0.02
    assert octave_frequencies(10.0, 80.0, 4) == pytest.approx(10.0 * 2.0 ** (np.arange(13) / 4.0))
    assert octave_frequencies(10.0, 90.0, 1).size == 5


FALLS = required((10.0, 1.0), (50.0, 30.0), (200.0, 30.0), (500.0, 5.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: shock_spectrum(HALF_SINE, 0.001, [251.0]), "natural frequency of 251 Hz.*end the spectrum at 250 Hz"),
        (lambda: shock_spectrum([1.0], 0.001, [1.0]), "two samples or more"),
        (lambda: shock_spectrum([1.0, math.nan], 0.001, [1.0]), "finite and within"),
        (lambda: shock_spectrum([0.0, 1.0], math.nan, [1.0]), "interval between two samples"),
        (lambda: shock_spectrum([0.0, 1.0], 0.001, [0.0]), "each >= 1e-06 Hz"),
        (lambda: shock_spectrum([0.0, 1.0], 0.001, []), "needs 1 to 100,000 natural frequencies"),
        (lambda: shock_spectrum([0.0, 1.0], 0.001, [math.inf]), "beyond a quarter of the sampling rate"),
        (lambda: shock_spectrum([0.0, 1.0], 0.001, [1.0], 1.0), r"critical damping within \[0, 1\), got 1.0"),
        (lambda: shock_spectrum([0.0, 1.0], 0.001, [1.0], -0.1), "share of critical damping"),
        (lambda: octave_frequencies(10.0, 10.0), "must rise from > 0"),
        (lambda: octave_frequencies(1.0, 1000.0, 20_000), "at most 100,000 in all"),
        (lambda: synthesized_shock(FUNCTIONAL, 0.1), "from 10 Hz on must last 0.15 s or more, one and a half periods"),
        (lambda: synthesized_shock(FUNCTIONAL, 500.0), "up to 2000 Hz may last .* s, got 500 s; shorten it"),
        # Above the frequencies of a shock its spectrum is the largest acceleration and does not fall.
        (lambda: synthesized_shock(FALLS, 0.2), "deviates .* more than 3 dB; take"),
        *((lambda q=q: required((1.0, 1.0), (2.0, 1.0), quality=q), "quality factor Q of a shock .* must be above 0.5")
          for q in (0.5, math.nan)),
    ],
)  # fmt: skip
def test_what_has_no_spectrum_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(MountedSystemError, match=message):
        make()


# ---- limits ---------------------------------------------------------------------------------------

STIFFNESS, PEAK, DURATION, END = 1.0e4, 150.0, 0.011, 0.5
PULSE = HalfSine(PEAK, DURATION)
FALLING = RequiredSpectrum(LevelTable(((15.0, 260.0), (120.0, 130.0))), 12.0)


def answered(signal: Signal, spectrum: RequiredSpectrum, kind: str = "pulse", draws: int = 16) -> CaseAnswer:
    """Of 1 kg on an elastic spring."""
    case = LoadCase("case", kind, END, (LoadChannel(ChannelKind.BASE_ACCELERATION, signal, UP),))
    limits, system = Limits({FigureKind.SRS: {"mass": 1.0}}, {}, {"mass": spectrum}), elastic(0.0, STIFFNESS)
    return answer_case("mass", one_mass(MountAxis(system, UP, 0.0)), case, limits, Unknowns(draws=draws))


def of_spectrum(answer: CaseAnswer) -> Figure:
    (figure,) = answer.figures_of(FigureKind.SRS)
    return figure


def test_drawn_limits_with_notches_hold_an_own_spectrum() -> None:
    """Each share is within its printed error of the largest of an own spectrum over 800 frequencies and all corners,
    and 100 more about the largest of these.

    At 20 us a largest sample misses up to (2*pi*f*h)^2/8 = 8e-5, and the 100 frequencies (Q*1e-4)^2/2 at a peak; both
    are well below the least printed error, of 1e-3.
    """
    random, interval = np.random.default_rng(52), 2e-5
    time, root, rate = interval * np.arange(round(END / interval) + 1), math.sqrt(STIFFNESS), math.pi / DURATION
    # The mass in closed form; after the pulse it swings freely: two responses, one later by the duration.
    factor = PEAK * root / (root**2 - rate**2)
    during = factor * (root * np.sin(rate * time) - rate * np.sin(root * time))
    after = -factor * rate * (np.sin(root * time) + np.sin(root * (time - DURATION)))
    samples = np.where(time < DURATION, during, after)
    for _ in range(5):
        place, depth, flank = random.uniform(12.0, 150.0), random.uniform(0.1, 0.5), random.choice([1e-4, 0.01, 0.04])
        low, high = random.uniform(100.0, 400.0, 2).tolist()
        corners = ((10.0, low), (place * (1.0 - flank), low), (place, depth * low), (place * (1.0 + flank), high))
        limit = RequiredSpectrum(LevelTable((*corners, (200.0, high))), random.choice([8.0, 12.0, 100.0]))
        figure = of_spectrum(answered(PULSE, limit))
        frequencies, own = np.append(np.geomspace(10.0, 200.0, 800), [f for f, _ in limit.levels.points]), 0.0
        for _ in range(2):
            shares = own_spectrum(samples, interval, frequencies, 0.5 / limit.quality) / levels_at(limit, frequencies)
            own, top = max(own, float(shares.max())), float(frequencies[shares.argmax()])
            frequencies = np.linspace(max(10.0, 0.99 * top), min(200.0, 1.01 * top), 100)
        assert abs(figure.value - own) <= figure.error, (limit, own)
        assert figure.error < 0.01 * own


@pytest.mark.parametrize("step", [1e-3, 5e-4])
def test_a_spectrum_far_above_the_steps_of_the_motion(step: float) -> None:
    """A force that is there at once, on the elastic spring: the acceleration jumps, and oscillators up to 2 kHz answer
    with 1 + exp(-pi*zeta/sqrt(1 - zeta^2)) times the jump, to 1 % as the mass goes on.
    """
    force = LoadChannel(ChannelKind.FORCE, StraightPulse(PEAK, 0.05, CORNERS["rectangle"]), UP)
    limit = RequiredSpectrum(LevelTable(((200.0, 1e3), (2000.0, 100.0))), 10.0)
    case = LoadCase("case", "force", 0.2, (force,), allowed=(("mass", limit),))
    run = simulate_case(one_mass(MountAxis(elastic(0.0, STIFFNESS), UP, 0.0)), case, step=step)
    overshoot = math.exp(-math.pi * 0.05 / math.sqrt(1.0 - 0.05**2))
    assert run.figures.spectra[0] == pytest.approx(PEAK * (1.0 + overshoot) / 100.0, rel=0.01)
    time, root, top = 2e-6 * np.arange(100_001), math.sqrt(STIFFNESS), np.array([1900.0, 2000.0])
    swing = np.cos(root * time) - np.where(time < 0.05, 0.0, np.cos(root * (time - 0.05)))
    own = own_spectrum(PEAK * swing, 2e-6, top, 0.05) / limit.at(top)
    assert abs(run.figures.spectra[0] - own.max()) <= run.errors.spectra[0]


def test_the_notch_of_the_measured_box() -> None:
    """An own spectrum has 21.7 g at the notch of 8 g."""
    file = Path(__file__).parents[3] / "shared" / "data" / "srs_notch" / "notch.toml"
    if not file.exists():
        pytest.skip(f"there is no {file}")
    (case,) = simulate(file, courses=False).answers
    figure = of_spectrum(case)
    assert case.verdict is CaseVerdict.FAILS
    assert figure.value == pytest.approx(21.7 / 8.0, abs=figure.error)


def test_the_verdict_follows_the_spectrum_and_draws_of_it() -> None:
    share = of_spectrum(answered(PULSE, FALLING)).value
    for factor, verdict in ((1.05, CaseVerdict.PASSES), (0.95, CaseVerdict.FAILS)):
        levels = LevelTable(((15.0, 260.0 * factor * share), (120.0, 130.0 * factor * share)))
        assert answered(PULSE, RequiredSpectrum(levels, 12.0)).verdict is verdict
    assert answered(PULSE, FALLING, "sine").figures_of(FigureKind.SRS) == ()
    # Records of a shock by its spectrum differ, each has it within 3 dB, and the range holds other ones.
    asked = RequiredSpectrum(LevelTable(((20.0, 100.0), (200.0, 400.0))))
    shock = synthesized_shock(asked, 0.3)
    answer = answered(shock, FALLING, "srs")
    assert answer.draws == 16
    figure = of_spectrum(answer)
    assert figure.high > 1.02 * figure.low
    for number in range(4):
        other = shock.redrawn(0, number)
        assert not np.array_equal(other.value, shock.value)
        found = shock_spectrum(other.value, float(other.time[1]), asked.frequencies, asked.damping).maximax
        assert np.abs(20.0 * np.log10(found / asked.at(asked.frequencies))).max() <= 3.0
    unseen = of_spectrum(answered(synthesized_shock(asked, 0.3, 1000), FALLING, "srs")).value
    assert figure.low <= unseen <= figure.high


@pytest.mark.parametrize("quality", [5.0, 50.0])
def test_pyyeti_finds_the_same(quality: float) -> None:
    srs = tool("pyyeti.srs").srs
    rng, step = np.random.default_rng(15), 1e-5
    time = step * np.arange(12_000)
    frequencies = octave_frequencies(5.0, 500.0, 6)
    shock = sum(rng.standard_normal() * np.exp(-80.0 * time) * np.sin(2.0 * np.pi * f * time) for f in frequencies[::3])
    found = shock_spectrum(shock, step, frequencies, 0.5 / quality)
    options = {"stype": "absacce", "rolloff": "none", "parallel": "no"}
    primary = found.extrema[:2]
    for peak, ours in (("poss", primary[0]), ("negs", primary[1]), ("abs", np.abs(primary).max(axis=0))):
        theirs = srs(shock, 1.0 / step, frequencies, quality, peak=peak, time="primary", **options)
        # pyyeti takes the largest sample, which misses up to (2*pi*f*h)^2/8 = 1.3e-4 at 500 Hz.
        assert ours == pytest.approx(theirs, rel=1.5e-4)
        # Its coefficients lose up to 1e-6 at 5 Hz, where 2*pi*f*h is 3e-4.
        assert np.all(np.abs(ours) >= np.abs(theirs) * (1.0 - 2e-6))
    theirs = srs(shock, 1.0 / step, frequencies, quality, peak="abs", time="total", **options)
    assert found.maximax == pytest.approx(theirs, rel=1.5e-4)
