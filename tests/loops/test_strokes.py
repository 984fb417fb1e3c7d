"""Reversals, strokes and noise of measured paths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strandspring import Spring, SpringParameters, read_record
from strandspring.kernel.arrays import FloatArray
from strandspring.loops.strokes import find_strokes, noise_level, path_noise, turning_points

ROOT = Path(__file__).resolve().parents[2]
NOISE = 0.003


def test_a_sine_has_one_stroke_between_neighbouring_extremes() -> None:
    strokes = find_strokes(np.sin(np.linspace(0.0, 6.0 * np.pi, 601)))
    assert strokes.turning.tolist() == [0, 50, 150, 250, 350, 450, 550, 600]
    assert strokes.direction.tolist() == [1, -1, 1, -1, 1, -1, 1]
    assert strokes.length[1:-1] == pytest.approx(2.0, rel=1e-12)  # the extremes are samples
    still = find_strokes(np.full(20, 0.3))
    assert (still.count, still.length.tolist()) == (1, [0.0])
    assert strokes.of_sample[[0, 50, 51, 150, 151, 600]].tolist() == [0, 0, 1, 1, 2, 6]


@pytest.mark.parametrize("noise", [1e-4, 1e-3, 5e-3])
def test_noise_makes_no_strokes(noise: float) -> None:
    rng = np.random.default_rng(7)
    strokes = find_strokes(np.sin(np.linspace(0.0, 20.0 * np.pi, 20_001)) + noise * rng.standard_normal(20_001))
    assert strokes.count == 21
    # An extreme of a noisy top is found within the flat part that the noise hides: 1 - cos = 4*noise.
    expected = np.arange(500, 20_001, 1000)
    assert np.max(np.abs(strokes.turning[1:-1] - expected)) <= 1000 / np.pi * np.arccos(1.0 - 8.0 * noise)


def reversals(path: FloatArray, least: float) -> list[int]:
    """By running extremes: those from which the path went back by the least stroke, but for the one it begins with."""
    low = high = side = 0
    found: list[int] = []
    for k, x in enumerate(path.tolist()):
        low, high = (k if x < path[low] else low), (k if x > path[high] else high)
        if side >= 0 and path[high] - x >= least:
            found, side, low = [*found, high], -1, k
        elif side <= 0 and x - path[low] >= least:
            found, side, high = [*found, low], 1, k
    return found[1:]


@settings(max_examples=500, deadline=None)
@given(st.lists(st.integers(-50, 50), min_size=2, max_size=60), st.integers(1, 60))
def test_turning_points_are_running_extremes(values: list[int], threshold: int) -> None:
    path = np.array(values, dtype=float)
    points = turning_points(path, float(threshold))
    assert (points[0], points[-1]) == (0, path.size - 1)
    # Of equal extremes either may be taken.
    assert path[points[1:-1]].tolist() == path[reversals(path, float(threshold))].tolist()


def test_small_cycles_at_both_ends_of_a_path_remain() -> None:
    """About its start, half a stroke of theirs is below the threshold; all of them used to be swallowed."""
    phase = np.arange(1, 61) * np.pi / 10.0
    path = np.concatenate([[0.0], 4.0 * np.sin(phase), 10.0 * np.sin(phase), 4.0 * np.sin(phase)])
    # But the first and the last quarter, from the start or end of the path to the nearest extreme.
    extremes = np.arange(5, 180, 10)[1:-1]
    assert turning_points(path, 5.0)[1:-1].tolist() == extremes.tolist()
    # Noise of a rest before the motion is no stroke: the start moves on to the extreme before it.
    rng = np.random.default_rng(0)
    rested = np.concatenate([0.1 * rng.standard_normal(50), 10.0 * np.sin(np.arange(200) * np.pi / 50.0)])
    assert turning_points(rested, 1.0).tolist() == [0, 75, 125, 175, 225, 249]
    assert turning_points(np.array([0.0, 1.0, -9.0]), 5.0).tolist() == [0, 2]
    assert turning_points(np.array([0.0, 1.0, 0.9, 1.1, 1.0, 2.0]), 0.0).tolist() == [0, 1, 2, 3, 4, 5]


def test_the_first_cycles_of_a_growing_amplitude_are_strokes() -> None:
    record = read_record(ROOT / "tests/data/degrading/SPC1.csv")
    strokes = find_strokes(record.displacement)
    # After a first one of 3.26 mm come four cycles of 2.44 mm, 3 % of the largest.
    assert strokes.count == 56
    assert strokes.length[2:9] == pytest.approx(4.88e-3, rel=0.01)


def test_the_measured_records_have_the_strokes_one_sees() -> None:
    hinge = read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement")
    assert find_strokes(hinge.displacement).count == 6
    friction = read_record(ROOT / "tests/data/actuator/circle_3bar.csv", displacement=5, force=7)
    # Ten cycles; single samples of its laser jump by up to 0.45 mm.
    assert find_strokes(friction.displacement).count == 20


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
    path = triangle(samples, 6)
    assert path_noise(path) == 0.0


@pytest.mark.parametrize("samples", [13.7, 23.4])
def test_noise_of_a_coarse_triangle_is_that_within_its_strokes(samples: float) -> None:
    rng = np.random.default_rng(5)
    path = triangle(samples, 40)
    path += NOISE * rng.standard_normal(path.size)
    # Of 80 strokes, 3 or more fourth differences each, that overlap: the median scatters by some 8 %.
    assert path_noise(path) == pytest.approx(NOISE, rel=0.25)


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
