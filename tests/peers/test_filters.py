"""Zero-phase low-pass and Fourier filter on the paper's simulated experiment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from strandspring.peers import two_stage_options as filters_module
from strandspring.peers.ni import PAPER_NI, sine_period, with_noise
from strandspring.peers.two_stage_options import fourier_filter, low_pass

FloatArray = np.ndarray
Filter = Callable[[FloatArray], FloatArray]
FILTERS: dict[str, Filter] = {"low pass": low_pass, "fourier": lambda force: fourier_filter(force, 1)}
filters = pytest.mark.parametrize("smooth", FILTERS.values(), ids=FILTERS)
experiments = pytest.mark.parametrize(("amplitude", "n"), [(5.0, 0.222), (5.45, 1.0)])


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def response(amplitude: float, n: float) -> FloatArray:
    return replace(PAPER_NI, n=n).steady_force(sine_period(amplitude, 1000))


@filters
@experiments
def test_noise_is_lowered_by_more_than_three(smooth: Filter, amplitude: float, n: float) -> None:
    clean = response(amplitude, n)
    gains = []
    for seed in range(20):
        noisy = with_noise(clean, 0.03, seed)
        gains.append(rms(noisy - clean) / rms(smooth(noisy) - clean))
    # Measured: 7.4 N fall to 1.2-1.7 N in the median, and to 2.3 N at worst.
    assert np.median(gains) > 4.0
    assert min(gains) > 3.0


@filters
@experiments
def test_a_clean_signal_is_left_alone(smooth: Filter, amplitude: float, n: float) -> None:
    clean = response(amplitude, n)
    assert rms(smooth(clean) - clean) < 1e-4 * rms(clean)  # measured: 2.5e-5


def test_a_clean_cut_whose_ends_differ_is_left_alone() -> None:
    cut = response(5.0, 0.222)[70:870]
    assert rms(low_pass(cut) - cut) < 1e-3 * rms(cut)


@filters
def test_neither_filter_shifts_the_phase(smooth: Filter) -> None:
    clean = response(5.0, 0.222)
    noisy = with_noise(clean, 0.03, 1)
    spectrum = np.fft.rfft(smooth(noisy))[1] / np.fft.rfft(noisy)[1]
    assert abs(np.angle(spectrum)) < 1e-3  # rad, of the fundamental


def test_more_periods_leave_less_noise() -> None:
    clean = response(5.0, 0.222)
    noisy = with_noise(np.tile(clean, 9), 0.03, 2)
    filtered = fourier_filter(noisy, 9)
    np.testing.assert_allclose(filtered[:1000], filtered[-1000:], atol=1e-9)
    assert rms(filtered[:1000] - clean) < rms(fourier_filter(noisy[:1000], 1) - clean)


def test_the_cut_off_holds(monkeypatch: pytest.MonkeyPatch) -> None:
    phase = 2.0 * np.pi * np.arange(1200) / 1200
    low, high = np.sin(3.0 * phase), np.sin(40.0 * phase)
    for periods, harmonics in ((1, 10), (3, 1)):
        monkeypatch.setattr(filters_module, "_harmonics_of_noise", lambda _, kept=harmonics: kept)
        np.testing.assert_allclose(fourier_filter(low + high, periods), low, atol=1e-12)
    monkeypatch.setattr(filters_module, "_cutoff_of_noise", lambda _: 40.0 / 1200)
    half = low_pass(high)[300:900] / high[300:900]
    np.testing.assert_allclose(half[np.abs(high[300:900]) > 0.5], 0.5, rtol=0.02)  # the ends still ring a little


def test_a_long_noisy_constant_becomes_nearly_constant() -> None:
    noise = np.random.default_rng(0).standard_normal(4096)
    assert rms(low_pass(10.0 + noise) - 10.0) < 0.2


def test_wrong_use_is_refused() -> None:
    signal = np.ones(100)
    with pytest.raises(ValueError, match="shape"):
        low_pass(np.ones(5))
    with pytest.raises(ValueError, match="finite"):
        low_pass(np.full(100, np.nan))
    with pytest.raises(ValueError, match="16 samples per period"):
        fourier_filter(signal, 10)
