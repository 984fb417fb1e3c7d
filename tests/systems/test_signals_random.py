"""Random vibration: the density asked for, Gaussian, and the same whatever the time step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from strandspring.vibration.signals.level_table import LevelTable
from strandspring.vibration.signals.random_signal import RandomVibration
from strandspring.vibration.signals.spectra import power_spectrum

# The shape of MIL-STD-810's general minimum integrity exposure, in (m/s^2)^2/Hz.
EXPOSURE = LevelTable(((20.0, 1.0), (80.0, 4.0), (350.0, 4.0), (2000.0, 0.7)))
SEED = 20_250_615


def test_the_density_is_the_one_asked_for() -> None:
    vibration, step = RandomVibration(EXPOSURE, 100.0, SEED), 1.0 / 50_000.0
    history = vibration.averages(step, 5_000_000)
    found = power_spectrum(history, step, resolution=5.0)
    inside = (found.frequency >= 40.0) & (found.frequency <= 1990.0)
    f = found.frequency[inside]
    # Averages over a step have the density times sinc(f*h)^2.
    ratio = found.density[inside] / (EXPOSURE.at(f) * np.sinc(f * step) ** 2)
    assert found.relative_error == pytest.approx(0.0325, abs=5e-4)  # 999 segments with an overlap of a half
    # Independent lines are two apart with Hann's window. 195 of them: the mean within 4 of its standard errors, the
    # spread within 4 of its own, no line beyond 4.5.
    lines = ratio[::2]
    assert lines.mean() == pytest.approx(1.0, abs=4.0 * found.relative_error / math.sqrt(lines.size))
    assert lines.std() == pytest.approx(found.relative_error, rel=4.0 / math.sqrt(2.0 * lines.size))
    assert np.abs(ratio - 1.0).max() < 4.5 * found.relative_error
    # Nothing below and above.
    assert found.density[(found.frequency > 2020.0) & (found.frequency < 15_000.0)].max() < 1e-4
    assert found.root_mean_square == pytest.approx(EXPOSURE.root_mean_square, rel=4.0 * found.root_mean_square_error)
    assert found.root_mean_square_error < 2e-3


def test_straight_lines_between_samples_change_nothing_up_to_the_highest_frequency() -> None:
    """Against the sum of sines itself; the difference is what the lines add above, the images of each term."""
    table = LevelTable(((0.5, 1.0), (50.0, 1.0)))
    vibration = RandomVibration(table, 7.99, SEED)
    period = 4000 / 500.0  # 3996 samples are taken from a period of 4000
    k = np.arange(1, 401)
    variance = table.by_band((np.arange(1, 402) - 0.5) / period)
    drawn = np.random.default_rng(SEED).standard_normal((402, 2))[1:401]
    time = np.arange(0.0, 7.98, 1.0 / 8000.0)
    phase = 2.0 * np.pi * np.outer(time, k / period)
    expected = np.cos(phase) @ (np.sqrt(variance) * drawn[:, 0]) + np.sin(phase) @ (np.sqrt(variance) * drawn[:, 1])
    found = vibration.at(time)
    assert np.mean((found - expected) ** 2) < 3e-4 * np.mean(expected**2)
    # Up to 50 Hz the power is the same within 0.5 %; most of the rest is leakage of the cut period.
    window = np.hanning(time.size)
    powers = [np.abs(np.fft.rfft(window * values)) ** 2 for values in (found, expected)]
    frequency = np.fft.rfftfreq(time.size, 1.0 / 8000.0)
    for low in range(0, 50, 10):
        band = (frequency >= low) & (frequency < low + 10)
        assert powers[0][band].sum() == pytest.approx(powers[1][band].sum(), rel=5e-4)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_another_signal() -> None:
    vibrations = [RandomVibration(EXPOSURE, 1.0, seed) for seed in (SEED, SEED, SEED + 1)]
    first, again, other = (vibration.pieces().averages(1e-4, 10_000) for vibration in vibrations)
    assert first.tobytes() == again.tobytes()
    assert abs(np.corrcoef(first, other)[0, 1]) < 0.1
    fine = vibrations[0].averages(2.5e-5, 40_000).reshape(-1, 4).mean(axis=1)
    assert np.abs(fine - first).max() < 1e-9
    assert vibrations[0].averages(1e-4, 10_100)[10_000:].tolist() == [0.0] * 100


def test_values_and_powers_are_those_of_a_gaussian_process() -> None:
    history = RandomVibration(EXPOSURE, 60.0, SEED).averages(1e-4, 600_000)
    # Its bandwidth is 1.2 kHz: some 140 000 independent values, whose kurtosis has the error sqrt(24/140000) = 0.013.
    assert stats.kurtosis(history) == pytest.approx(0.0, abs=0.05)
    assert stats.skew(history) == pytest.approx(0.0, abs=0.03)
    # The power of 10 lines scatters by 1/sqrt(10); with phases alone drawn it would not.
    narrow = LevelTable(((95.0, 1.0), (105.0, 1.0)))
    powers = [np.mean(RandomVibration(narrow, 1.0, seed).averages(1e-3, 1000) ** 2) for seed in range(400)]
    assert np.std(powers) / np.mean(powers) == pytest.approx(math.sqrt(0.1), rel=4.0 / math.sqrt(800.0))
    assert np.mean(powers) == pytest.approx(10.0 * np.sinc(0.1) ** 2, rel=4.0 * math.sqrt(0.1 / 400.0))
