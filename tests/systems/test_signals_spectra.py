"""Power spectra: their statistical errors, bands and ratios."""

from __future__ import annotations

import math

import numpy as np
import pytest

from strandspring.errors import MountedSystemError
from strandspring.signals.level_table import LevelTable
from strandspring.signals.random_signal import RandomVibration
from strandspring.signals.spectra import expected_largest, power_spectrum, transmissibility_by_band

SEED = 4


def test_stated_errors_are_the_scatter() -> None:
    rng = np.random.default_rng(SEED)
    spectra = [power_spectrum(rng.standard_normal(4000), 0.001, 20.0) for _ in range(200)]
    densities = np.array(
        [spectrum.density[2:-2] for spectrum in spectra]
    )  # without the ends, which have half the lines
    assert densities.mean() == pytest.approx(0.002, rel=0.01)  # 2/1000 for a variance of 1 up to 500 Hz
    # 200 histories of 22 lines give the scatter within some 3 %.
    assert densities.std() / densities.mean() == pytest.approx(spectra[0].relative_error, rel=0.06)
    roots = np.array([spectrum.root_mean_square for spectrum in spectra])
    assert roots.std() == pytest.approx(spectra[0].root_mean_square_error, rel=0.2)  # 1/sqrt(2*200) = 5 %


@pytest.mark.parametrize("samples", [8000, 8003])
@pytest.mark.parametrize("resolution", [1.0, 1.003])
def test_bands_add_up_to_the_whole(samples: int, resolution: float) -> None:
    history = 3.0 * np.sin(2.0 * np.pi * 100.0 * np.arange(samples) / 1000.0) + 7.0
    spectrum = power_spectrum(history, 0.001, resolution)
    assert spectrum.root_mean_square == pytest.approx(3.0 / math.sqrt(2.0), rel=2e-3)
    assert spectrum.resolution == pytest.approx(resolution, rel=1e-2)
    bands = spectrum.root_mean_square_by_band([0.0, 50.0, 99.5, 101.3, 250.0, 500.0])
    assert np.sum(bands**2) == pytest.approx(spectrum.root_mean_square**2, rel=1e-12)
    assert spectrum.root_mean_square_by_band([95.0, 105.0])[0] == pytest.approx(spectrum.root_mean_square, rel=1e-4)
    assert spectrum.crossing_rate == pytest.approx(100.0, rel=0.01)


def test_transmissibility_by_band() -> None:
    rng = np.random.default_rng(SEED)
    base = rng.standard_normal(20_000)
    spectra = [power_spectrum(values, 0.001, 5.0) for values in (base, -0.25 * base, 0.0 * base)]
    edges = [10.0, 50.0, 400.0]
    assert transmissibility_by_band(spectra[0], spectra[1], edges) == pytest.approx([0.25, 0.25], rel=1e-12)
    assert np.isnan(transmissibility_by_band(spectra[2], spectra[0], edges)).all()
    assert (spectra[2].root_mean_square_error, spectra[2].crossing_rate) == (0.0, 0.0)


def test_expected_largest_value() -> None:
    density = LevelTable(((20.0, 1.0), (100.0, 1.0)))
    histories = [RandomVibration(density, 10.0, seed).averages(0.001, 10_000) for seed in range(200)]
    largest = np.mean([np.abs(history).max() for history in histories])
    rate = math.sqrt((100.0**3 - 20.0**3) / (3.0 * 80.0))
    assert power_spectrum(histories[0], 0.001, 2.0).crossing_rate == pytest.approx(rate, rel=0.02)
    # Single values scatter by some 0.3 of 3.9: their mean by 0.6 %. The averages over a step are up to 1.6 % below.
    assert expected_largest(math.sqrt(80.0), rate, 10.0) == pytest.approx(largest, rel=0.03)
    assert expected_largest(2.0, 0.0, 1.0) == expected_largest(2.0, 1.0, 1.5)


@pytest.mark.parametrize(
    ("samples", "interval", "resolution", "message"),
    [
        (np.ones(100), 0.001, 5.0, "needs segments of 0.2 s within the history of 0.1 s"),
        (np.ones(100), 0.001, math.nan, "The resolution of a power spectrum must be within"),
        (np.ones(100), 0.001, 500.0, "each of 8 samples or more"),
        (np.ones(100), 0.0, 5.0, "interval between two samples must be within"),
        (np.full(100, np.nan), 0.001, 20.0, "finite and within"),
    ],
)
def test_what_has_no_spectrum_is_refused(samples: np.ndarray, interval: float, resolution: float, message: str) -> None:
    with pytest.raises(MountedSystemError, match=message):
        power_spectrum(samples, interval, resolution)
