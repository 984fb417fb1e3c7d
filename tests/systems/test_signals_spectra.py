"""Power spectra: their sum and statistical errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from strandspring.errors import MountedSystemError
from strandspring.vibration.signals.spectra import power_spectrum

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
def test_the_whole_is_that_of_the_history(samples: int, resolution: float) -> None:
    history = 3.0 * np.sin(2.0 * np.pi * 100.0 * np.arange(samples) / 1000.0) + 7.0
    spectrum = power_spectrum(history, 0.001, resolution)
    assert spectrum.root_mean_square == pytest.approx(3.0 / math.sqrt(2.0), rel=2e-3)
    assert spectrum.resolution == pytest.approx(resolution, rel=1e-2)


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
