"""Synthesized shocks: their spectrum by Smallwood's filter as it was published, and what they leave to the base."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lfilter

from strandspring.errors import MountedSystemError
from strandspring.ground.gravity import STANDARD_GRAVITY
from strandspring.vibration.signals.level_table import LevelTable
from strandspring.vibration.signals.shock_spectra import RequiredSpectrum
from strandspring.vibration.signals.shock_synthesis import SynthesizedSignal, synthesized_shock


def required(*levels: tuple[float, float], quality: float = 10.0) -> RequiredSpectrum:
    return RequiredSpectrum(LevelTable(tuple((f, a * STANDARD_GRAVITY) for f, a in levels)), quality)


FUNCTIONAL = required((10.0, 9.4), (80.0, 75.0), (2000.0, 75.0))
STEEP = required((20.0, 1.0), (100.0, 100.0), (1000.0, 100.0), quality=25.0)
CORNERED = required((20.0, 20.0), (45.0, 75.0), (860.0, 75.0), (1000.0, 60.0))


def smallwood(samples: np.ndarray, interval: float, frequency: float, zeta: float) -> float:
    """Largest absolute acceleration of an oscillator by the ramp-invariant filter of 1981."""
    theta = 2.0 * math.pi * frequency * interval
    decay, turn = math.exp(-zeta * theta), theta * math.sqrt(1.0 - zeta**2)
    c, ratio = decay * math.cos(turn), decay * math.sin(turn) / turn
    numerator = [1.0 - ratio, 2.0 * (ratio - c), decay * decay - ratio]
    return float(np.abs(lfilter(numerator, [1.0, -2.0 * c, decay * decay], samples)).max())


@pytest.mark.parametrize("asked", [FUNCTIONAL, STEEP, CORNERED], ids=["Q = 10", "Q = 25", "corners"])
def test_the_record_has_the_spectrum_that_it_states(asked: RequiredSpectrum) -> None:
    """The stated deviations are the least and the largest of all frequencies, the corners of the levels among them."""
    shock = synthesized_shock(asked, 0.2)
    # Ten samples in a period of the last frequency: 64 on each straight line find every peak.
    fine = np.arange(0.0, shock.duration + 0.1, float(shock.time[1]) / 8.0)
    samples = np.interp(fine, shock.time, shock.value, right=0.0)
    points = np.array(asked.levels.points)
    frequency = np.unique(np.append(np.geomspace(asked.levels.lowest, asked.levels.highest, 400), points[:, 0]))
    levels = np.exp(np.interp(np.log(frequency), *np.log(points).T))
    found = [smallwood(samples, fine[1], f, 0.5 / asked.quality) for f in frequency.tolist()]
    deviation = 20.0 * np.log10(np.array(found) / levels)
    # 80 samples in a period of the last frequency miss 0.01 dB, and 400 frequencies a sharp minimum, where one peak of
    # a response takes over from another, by up to 0.3 dB.
    assert deviation.min() - 0.3 < shock.deviation[0] < deviation.min() + 0.02
    assert deviation.max() - 0.02 < shock.deviation[1] < deviation.max() + 0.1
    assert max(-shock.deviation[0], shock.deviation[1]) < 2.0


def test_the_base_comes_to_rest_where_it_was() -> None:
    shock = synthesized_shock(FUNCTIONAL, 0.2)
    velocity = np.cumsum(shock.value) * shock.time[1]
    displacement = np.cumsum(velocity) * shock.time[1]
    # A wavelet leaves nothing; straight lines between ten samples in a period of the last frequency a little.
    assert abs(velocity[-1]) < 1e-4 * np.abs(velocity).max()
    assert abs(displacement[-1]) < 1e-3 * np.abs(displacement).max()


def test_the_seed_decides_the_record() -> None:
    def values(shock: SynthesizedSignal) -> list[float]:
        return shock.value.tolist()

    asked = required((20.0, 50.0), (500.0, 50.0))
    first, other = synthesized_shock(asked, 0.2), synthesized_shock(asked, 0.2, seed=1)
    synthesized_shock.cache_clear()
    assert values(synthesized_shock(asked, 0.2)) == values(first)
    assert values(first) != values(other)


@pytest.mark.parametrize(
    ("asked", "duration", "refusal"),
    [
        (FUNCTIONAL, 0.1, "from 10 Hz on must last 0.15 s or more, one and a half periods, got 0.1 s; lengthen it"),
        (FUNCTIONAL, 500.0, r"a spectrum up to 2000 Hz may last .* s, got 500 s; shorten it"),
        # Above the frequencies of a shock its spectrum is the largest acceleration and does not fall.
        (required((10.0, 1.0), (50.0, 30.0), (200.0, 30.0), (500.0, 5.0)), 0.2, r"deviates .* more than 3 dB; take"),
    ],
)
def test_what_cannot_be_synthesized(asked: RequiredSpectrum, duration: float, refusal: str) -> None:
    with pytest.raises(MountedSystemError, match=refusal):
        synthesized_shock(asked, duration)


def test_quality_is_damping() -> None:
    assert required((1.0, 1.0), (2.0, 1.0), quality=25.0).damping == 0.02
    for quality in (0.5, math.nan):
        with pytest.raises(MountedSystemError, match=r"quality factor Q of a shock .* must be above 0.5"):
            required((1.0, 1.0), (2.0, 1.0), quality=quality)
