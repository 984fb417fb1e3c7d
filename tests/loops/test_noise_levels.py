"""The noise of sampled signals."""

from __future__ import annotations

import numpy as np
import pytest

from strandspring import Spring, SpringParameters
from strandspring.kernel.arrays import FloatArray
from strandspring.loops.noise_levels import noise_level
from strandspring.loops.strokes import find_strokes

NOISE = 0.003


def triangle(samples: float, cycles: int) -> FloatArray:
    """Sampled so many times in a cycle of amplitude 1, not at its reversals."""
    phase = np.arange(0.13, samples * cycles) / samples
    return np.asarray(2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * phase)))


def test_noise_level_of_white_noise_on_a_slow_signal() -> None:
    rng = np.random.default_rng(1)
    signal = np.sin(np.linspace(0.0, 10.0, 10_000))
    # The median of 1e4 correlated fourth differences scatters by 2 %.
    assert noise_level(signal + 1e-3 * rng.standard_normal(10_000)) == pytest.approx(1e-3, rel=0.06)
    assert noise_level(signal) < 1e-9


@pytest.mark.parametrize("samples", [9.1, 13.7, 23.4])
def test_corners_of_a_coarse_triangle_are_no_noise(samples: float) -> None:
    assert find_strokes(triangle(samples, 6)).noise == 0.0


@pytest.mark.parametrize("samples", [13.7, 23.4])
def test_noise_of_a_coarse_triangle_is_that_within_its_strokes(samples: float) -> None:
    rng = np.random.default_rng(5)
    path = triangle(samples, 40)
    found = find_strokes(path + NOISE * rng.standard_normal(path.size)).noise
    # Of 80 strokes, 3 or more fourth differences each, that overlap: the median scatters by some 8 %.
    assert found == pytest.approx(NOISE, rel=0.25)


def test_noise_of_a_force_on_a_coarse_triangle() -> None:
    rng = np.random.default_rng(2)
    path = triangle(24.3, 40)
    force = Spring(SpringParameters((0.0, 100.0), (1.0,), 30.0, 3.0, 0.7, 1.5, 0.0, -1.0, 1.0)).response(path)
    noise = NOISE * float(np.std(force))
    noisy = force + noise * rng.standard_normal(path.size)
    reversals = find_strokes(path).turning[1:-1]
    # The bends at its reversals look like noise unless differences across them are left out; it still bends after them.
    assert noise_level(noisy) > 1.6 * noise
    assert noise_level(noisy, reversals) == pytest.approx(noise, rel=0.25)
