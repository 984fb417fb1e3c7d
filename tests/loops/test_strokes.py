"""Reversals, strokes and noise of measured paths."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from strandspring import read_record
from strandspring.loops.strokes import find_strokes
from strandspring.loops.turning import turning_points

ROOT = Path(__file__).resolve().parents[2]


def test_a_sine_has_one_stroke_between_neighbouring_extremes() -> None:
    path = np.sin(np.linspace(0.0, 6.0 * np.pi, 601))
    strokes = find_strokes(path)
    assert strokes.turning.tolist() == [0, 50, 150, 250, 350, 450, 550, 600]
    assert strokes.direction.tolist() == [1, -1, 1, -1, 1, -1, 1]
    assert strokes.length[1:-1] == pytest.approx(2.0, rel=1e-12)  # the extremes are samples


@pytest.mark.parametrize("noise", [1e-4, 1e-3, 5e-3])
def test_noise_makes_no_strokes(noise: float) -> None:
    rng = np.random.default_rng(7)
    path = np.sin(np.linspace(0.0, 20.0 * np.pi, 20_001)) + noise * rng.standard_normal(20_001)
    strokes = find_strokes(path)
    assert strokes.count == 21
    # An extreme of a noisy top is found within the flat part that the noise hides: 1 - cos = 4*noise.
    expected = np.arange(500, 20_001, 1000)
    assert np.max(np.abs(strokes.turning[1:-1] - expected)) <= 1000 / np.pi * np.arccos(1.0 - 8.0 * noise)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.integers(-50, 50), min_size=2, max_size=60), st.integers(1, 30))
def test_turning_points_alternate_and_exceed_the_threshold(values: list[int], threshold: int) -> None:
    path = np.array(values, dtype=float)
    points = turning_points(path, float(threshold))
    assert points[0] == 0
    assert points[-1] == path.size - 1
    swings = np.diff(path[points])
    if points.size > 2:
        assert (swings[1:] * swings[:-1] < 0.0).all()
        assert (np.abs(swings) >= threshold).all()
    # No excursion of the threshold or more against the direction is left inside a stroke; the first and the last
    # one begin and end where the path does, not at an extreme, and may hide less than two thresholds.
    for k, (first, last) in enumerate(pairwise(points)):
        piece = path[first : last + 1] * (1.0 if path[last] >= path[first] else -1.0)
        allowed = threshold if 0 < k < points.size - 2 else 2 * threshold
        assert np.max(np.maximum.accumulate(piece) - piece) < allowed


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=80))
def test_the_cleaned_path_is_monotone_within_each_stroke(values: list[float]) -> None:
    strokes = find_strokes(np.array(values), threshold=0.3)
    for k, direction in enumerate(strokes.direction):
        piece = strokes.displacement[strokes.turning[k] : strokes.turning[k + 1] + 1]
        assert (np.diff(piece) * direction >= 0.0).all()
    assert (strokes.travel >= 0.0).all()


def test_without_a_threshold_every_reversal_counts() -> None:
    path = np.array([0.0, 1.0, 0.9, 1.1, 1.0, 2.0])
    assert turning_points(path, 0.0).tolist() == [0, 1, 2, 3, 4, 5]


def test_the_measured_records_have_the_strokes_one_sees() -> None:
    hinge = read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement")
    assert find_strokes(hinge.displacement).count == 6
    friction = read_record(ROOT / "tests/data/actuator/circle_3bar.csv", displacement=5, force=7)
    # Ten cycles; single samples of its laser jump by up to 0.45 mm.
    assert find_strokes(friction.displacement).count == 20


def test_a_still_path_is_one_stroke_of_no_length() -> None:
    strokes = find_strokes(np.full(20, 0.3))
    assert strokes.count == 1
    assert strokes.length.tolist() == [0.0]


@pytest.mark.parametrize(
    ("samples", "corners"), [(9.3, False), (20.7, False), (61.9, False), (20.7, True), (61.9, True)]
)
def test_reversals_between_samples_are_where_the_path_turns(samples: float, corners: bool) -> None:
    """A sine's but for h^2/4 of what lies beyond the samples, h being their distance in phase; a triangle's exactly."""
    phase = 2.0 * np.pi * np.arange(8 * samples) / samples
    x = 2.0 / np.pi * np.arcsin(np.sin(phase)) if corners else np.sin(phase)
    strokes = find_strokes(x)
    found = strokes.turning_between_samples(corners)
    at_samples, turns = (s.turning_displacement[1:-1] * s.direction[:-1] for s in (strokes, found))
    assert (1.0 - at_samples).max() > 1e-4
    share = 1e-12 if corners else (2.0 * np.pi / samples) ** 2
    np.testing.assert_array_less(np.abs(turns - 1.0), share * (1.0 - at_samples) + 1e-13)
    # Each sample is on the stroke during which it was taken.
    strokes_over = np.floor((phase + 0.5 * np.pi) / np.pi).astype(int)
    inner = slice(1, -1)
    np.testing.assert_array_equal(found.of_sample[inner], strokes_over[inner])
    np.testing.assert_allclose(
        found.travel, np.abs(x - found.turning_displacement[found.of_sample]), rtol=0.0, atol=1e-15
    )
