"""The noise of a displacement is removed without rounding its reversals off."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from strandspring.loops.strokes import find_strokes

NOISE = 2e-3
CYCLES = 9


def path(shape: str, samples: int) -> NDArray[np.float64]:
    """Cycles of amplitude 1 whose reversals are samples."""
    phase = 2.0 * np.pi * CYCLES * np.arange(samples * CYCLES + 1) / (samples * CYCLES)
    return np.asarray(np.sin(phase) if shape == "sine" else 2.0 / np.pi * np.arcsin(np.sin(phase)))


def noisy(values: NDArray[np.float64], seed: int = 0) -> NDArray[np.float64]:
    return np.asarray(values + NOISE * np.random.default_rng(seed).standard_normal(values.size))


@pytest.mark.parametrize("samples", [100, 400, 4000, 40_000])
@pytest.mark.parametrize("shape", ["sine", "triangle"])
def test_the_smoothed_path_is_near_the_exact_one(shape: str, samples: int) -> None:
    exact = path(shape, samples)
    strokes = find_strokes(noisy(exact))
    assert strokes.count == 2 * CYCLES + 1
    assert np.sqrt(np.mean((strokes.displacement - exact) ** 2)) < 0.4 * NOISE
    # Raw extremes lie 0.5 (triangle of 100 samples) to 4 standard deviations outside.
    beyond = strokes.turning_displacement[1:-1] * strokes.direction[:-1] - 1.0
    assert abs(np.mean(beyond)) < 0.3 * NOISE


def test_a_path_without_noise_is_unchanged() -> None:
    for exact in (path("sine", 100), path("triangle", 100), path("sine", 24)):
        assert find_strokes(exact).noise == 0.0
        assert find_strokes(exact).displacement == pytest.approx(exact, abs=1e-15)


def test_dwells_gaps_and_changes_of_speed_are_not_smoothed_over() -> None:
    exact = path("triangle", 100)
    dwelling = np.insert(exact, np.full(20, 225), exact[225])
    lost = np.delete(exact, np.arange(240, 250))
    growing = np.concatenate([0.5 * exact[:200], exact[200:]])
    for values in (dwelling, lost, growing):
        error = find_strokes(noisy(values)).displacement - values
        assert np.sqrt(np.mean(error**2)) < 0.5 * NOISE
        assert np.max(np.abs(error)) < 3.0 * NOISE


def test_slopes_that_change_between_reversals_are_not_smoothed_over() -> None:
    exact = path("triangle", 100)
    growing = np.concatenate([0.4 * exact[:300], 0.7 * exact[300:600], exact[600:]])
    errors = [find_strokes(noisy(growing, seed)).displacement - growing for seed in range(6)]
    assert np.sqrt(np.mean(np.square(errors))) < 0.3 * NOISE


def test_sharp_reversals_that_noise_hides_one_by_one_are_found_together() -> None:
    exact = path("triangle", 56)
    noise = 0.6 * 4.0 / 56  # of a step, as where the moments of sampling jitter
    for seed in range(6):
        strokes = find_strokes(exact + noise * np.random.default_rng(seed).standard_normal(exact.size))
        assert strokes.count == 2 * CYCLES + 1
        beyond = strokes.turning_displacement[1:-1] * strokes.direction[:-1] - 1.0
        assert abs(np.mean(beyond)) < 0.5 * noise


def test_coarse_steps_of_the_displacement_are_smoothed() -> None:
    exact = path("sine", 100)
    strokes = find_strokes(np.round(exact / 0.02) * 0.02)
    # The errors repeat from cycle to cycle and are not quite white.
    assert np.sqrt(np.mean((strokes.displacement - exact) ** 2)) < 0.8 * 0.02 / np.sqrt(12.0)


def test_jumps_of_the_sensor_do_not_spread() -> None:
    exact = path("sine", 200)
    values = noisy(exact)
    values[[320, 700, 1130]] += [0.3, -0.4, 0.5]
    error = find_strokes(values).displacement - exact
    assert np.max(np.abs(error)) < 3.0 * NOISE
