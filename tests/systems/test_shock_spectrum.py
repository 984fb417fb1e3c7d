"""Shock response spectra: textbook values, pyyeti's, and Smallwood's filter in many digits."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from scipy.signal import lfilter

from strandspring.errors import MountedSystemError
from strandspring.kernel.shock import largest_responses, straight_pieces
from strandspring.vibration.signals.pulses import CORNERS, StraightPulse
from strandspring.vibration.signals.shock_spectra import octave_frequencies, shock_spectrum
from tools import tool

N = 2000
HALF_SINE = np.sin(np.pi * np.arange(N + 1) / N)  # of a duration of 1 s: frequencies are the products f*T
SAWTOOTH = np.arange(N + 1) / N
SEED = 11
# Straight lines between the samples cut a half-sine by (pi/N)^2/8 = 3e-7 at most.


def largest(samples: np.ndarray, low: float, high: float, part: str) -> tuple[float, float]:
    """Where a spectrum without damping is largest, and how large."""
    frequency = np.linspace(low, high, 4001)
    of_all = shock_spectrum(samples, 1.0 / N, frequency, 0.0)
    spectrum = of_all.maximax if part == "maximax" else np.abs(of_all.extrema[2:]).max(axis=0)
    return float(frequency[spectrum.argmax()]), float(spectrum.max())


def test_textbook_values_of_classical_pulses() -> None:
    # The top is flat: its height is certain to 1e-6, its place to some 1e-4.
    assert largest(HALF_SINE, 0.6, 1.0, "maximax") == pytest.approx((0.809937, 1.768458), abs=1e-4)
    assert largest(HALF_SINE, 0.6, 1.0, "residual") == pytest.approx((0.683622, 1.715509), abs=1e-4)
    assert largest(SAWTOOTH, 0.5, 0.8, "maximax") == pytest.approx((0.650283, 1.259591), abs=1e-4)
    at = shock_spectrum(HALF_SINE, 1.0 / N, [0.683622, 0.809937, 1.0], 0.0)
    assert at.extrema[0, 1:] == pytest.approx([1.768458, math.sqrt(3.0)], abs=2e-6)
    assert np.abs(at.extrema[2:]).max(axis=0)[[0, 2]] == pytest.approx([1.715509, 4.0 / 3.0], abs=2e-6)
    assert at.extrema[1].tolist() == [0.0, 0.0, 0.0]
    mirrored = shock_spectrum(-HALF_SINE, 1.0 / N, at.frequency, 0.0)
    assert mirrored.extrema[[1, 0, 3, 2]].tolist() == (-at.extrema).tolist()
    assert mirrored.maximax.tolist() == at.maximax.tolist()


def test_limits_of_a_rectangular_pulse() -> None:
    """A sudden acceleration that holds: twice itself, and more with a damper, whose force is there at once."""
    samples = StraightPulse(5.0, 1.0, CORNERS["rectangle"]).at(np.linspace(0.0, 0.9999, 1001))
    spectrum = shock_spectrum(samples, 0.001, [0.5, 3.7, 20.0], 0.0)
    assert spectrum.extrema[0] == pytest.approx([10.0, 10.0, 10.0], rel=1e-4)  # (2*pi*f*h)^4/384 at 20 Hz
    damped = shock_spectrum(samples, 0.001, [3.7], 0.3)
    assert damped.extrema[0, 0] > 5.0 * (1.0 + math.exp(-0.3 * math.pi / math.sqrt(1.0 - 0.09)))


def smallwood(theta: float, zeta: float, context: mpmath.MPContext | None = None) -> tuple[list[float], list[float]]:
    """Coefficients of the ramp-invariant filter for the absolute acceleration, as published in 1981."""
    m = context or mpmath.fp
    e, b = m.exp(-zeta * theta), theta * m.sqrt(1 - m.mpf(zeta) ** 2)
    k, c, s = e * m.cos(b), e * m.cos(b), e * m.sin(b)
    ratio = s / b
    return [1 - ratio, 2 * (ratio - k), e * e - ratio], [1, -2 * c, e * e]


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.5, 0.95])
def test_smallwood_filter_on_the_same_straight_lines(zeta: float) -> None:
    """Of 64 samples on each straight line, so that the largest sample is all but the largest response."""
    x, fine = np.random.default_rng(SEED).standard_normal(300), 64
    lines = np.interp(np.arange(299 * fine + 1) / fine, np.arange(300), x)
    # A jump at the beginning is not part of the filter, which is straight from 0 before the first sample.
    x[0] = lines[0] = 0.0
    lines[: fine + 1] = np.linspace(0.0, x[1], fine + 1)
    theta = 2.0 * np.pi * np.array([0.001, 0.01, 0.03, 0.1])
    found = largest_responses(straight_pieces(x), theta, zeta)
    for row, phase in zip(found, theta, strict=True):
        numerator, denominator = smallwood(phase / fine, zeta)
        after = math.ceil(2.0 * math.pi / phase) + 2
        # After the last sample the acceleration is 0 at once; the line down to 0 takes a fine step of it away.
        response = lfilter(numerator, denominator, np.append(lines, np.zeros(after * fine)))
        primary, residual = response[: lines.size], response[lines.size :]
        # Fourth derivatives over a step, which the cubic neglects, and second ones over a fine step: of the response
        # or its input, and of the damper's force by the slope of the input.
        level, damper = max(np.abs(x).max(), np.abs(response).max()), 4.0 * zeta
        cubic = (phase**4 + damper * phase**3) / 384.0 * level
        tolerance = cubic + ((phase / fine) ** 2 + damper * phase / fine**2) / 8.0 * level
        assert row[:2] == pytest.approx([primary.max(), primary.min()], abs=tolerance)
        assert row[2:] == pytest.approx(
            [max(primary[-1], residual.max()), min(primary[-1], residual.min())],
            abs=tolerance + phase / fine * level,
        )


@pytest.mark.parametrize("theta", [1e-9, 1e-6, 1e-3, 0.3])
@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.7])
def test_no_digits_are_lost_where_the_sampling_is_dense(theta: float, zeta: float) -> None:
    """Against Smallwood's filter in 80 digits; its coefficients in doubles would lose all of theirs at 1e-8."""
    with mpmath.workdps(80):
        x = 1.0 + np.random.default_rng(SEED).random(200)
        x[0] = 0.0
        (b0, b1, b2), (_, a1, a2) = smallwood(mpmath.mpf(theta), mpmath.mpf(zeta), mpmath.mp)
        y, before = mpmath.mpf(0), mpmath.mpf(0)
        responses = [y]
        for i in range(1, 200):
            older = mpmath.mpf(float(x[i - 2])) if i > 1 else 0
            sums = b0 * mpmath.mpf(float(x[i])) + b1 * mpmath.mpf(float(x[i - 1])) + b2 * older
            y, before = sums - a1 * y - a2 * before, y
            responses.append(y)
    # While it rises, the largest response is that at the last sample.
    rising = next((i for i in range(1, 200) if responses[i] <= responses[i - 1]), 202) - 2
    found = largest_responses(straight_pieces(x[:rising]), np.array([theta]), zeta)[0, 0]
    assert rising > 4
    assert found == pytest.approx(float(responses[rising - 1]), rel=1e-13)


@pytest.mark.parametrize("zeta", [0.0, 0.05, 0.6])
def test_residual_is_what_follows_in_a_longer_record(zeta: float) -> None:
    """A pulse that ends at 0, and the same with rest after it."""
    frequency = np.array([0.31, 0.683622, 1.3, 4.0])
    short = shock_spectrum(HALF_SINE, 1.0 / N, frequency, zeta)
    longer = shock_spectrum(np.append(HALF_SINE, np.zeros(4 * N)), 1.0 / N, frequency, zeta)
    scale = np.abs(longer.maximax)
    # The cubic between samples, 1e-9 at 4 Hz.
    assert longer.extrema[0] / scale == pytest.approx(short.extrema[[0, 2]].max(axis=0) / scale, abs=1e-8)
    assert longer.extrema[1] / scale == pytest.approx(short.extrema[[1, 3]].min(axis=0) / scale, abs=1e-8)


@pytest.mark.parametrize("quality", [5.0, 50.0])
def test_pyyeti_finds_the_same(quality: float) -> None:
    srs = tool("pyyeti.srs").srs
    rng, step = np.random.default_rng(SEED), 1e-5
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


def test_frequencies_at_equal_ratios() -> None:
    frequency = octave_frequencies(10.0, 80.0, 4)
    assert frequency == pytest.approx(10.0 * 2.0 ** (np.arange(13) / 4.0))
    assert octave_frequencies(10.0, 90.0, 1).size == 5


def test_too_coarse_samples_are_refused() -> None:
    with pytest.raises(MountedSystemError, match=r"natural frequency of 251 Hz.*end the spectrum at 250 Hz"):
        shock_spectrum(HALF_SINE, 0.001, [251.0])


@pytest.mark.parametrize(
    ("samples", "interval", "frequency", "damping", "message"),
    [
        ([1.0], 0.001, [1.0], 0.05, "two samples or more"),
        ([1.0, math.nan], 0.001, [1.0], 0.05, "finite and within"),
        ([0.0, 1.0], math.nan, [1.0], 0.05, "interval between two samples"),
        ([0.0, 1.0], 0.001, [0.0], 0.05, "each >= 1e-06 Hz"),
        ([0.0, 1.0], 0.001, [], 0.05, "needs 1 to 100,000 natural frequencies"),
        ([0.0, 1.0], 0.001, [math.inf], 0.05, "beyond a quarter of the sampling rate"),
        ([0.0, 1.0], 0.001, [1.0], 1.0, r"share of critical damping within \[0, 1\), got 1.0"),
        ([0.0, 1.0], 0.001, [1.0], -0.1, "share of critical damping"),
    ],
)
def test_what_has_no_spectrum_is_refused(
    samples: list[float], interval: float, frequency: list[float], damping: float, message: str
) -> None:
    with pytest.raises(MountedSystemError, match=message):
        shock_spectrum(samples, interval, frequency, damping)


def test_bounds_of_helpers() -> None:
    with pytest.raises(MountedSystemError, match="must rise from > 0"):
        octave_frequencies(10.0, 10.0)
    with pytest.raises(MountedSystemError, match="at most 100,000 in all"):
        octave_frequencies(1.0, 1000.0, 20_000)
