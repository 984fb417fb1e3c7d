"""Reversals, strokes and noise of measured paths, and the parts of records that are selected."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from springs import MOUNT
from strandspring import Finding, Outcome, Record, Spring, SpringParameters, info, select
from strandspring.errors import RecordError
from strandspring.kernel.arrays import FloatArray
from strandspring.loops.cycles import find_cycles, measured_loops
from strandspring.loops.strokes import find_strokes, noise_level, path_noise, turning_points

ROOT = Path(__file__).resolve().parents[2]
NOISE = 0.003


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


@settings(max_examples=100)
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


@pytest.mark.parametrize("samples", [9.1, 13.7, 23.4])
def test_noise_is_that_within_strokes_and_not_of_corners(samples: float) -> None:
    phase, draw = np.arange(0.13, samples * 40) / samples, np.random.default_rng(5)
    path = 2.0 / np.pi * np.arcsin(np.sin(2.0 * np.pi * phase))  # not sampled at its reversals
    assert path_noise(path) == 0.0
    if samples > 10.0:
        # Of 80 strokes, 3 or more fourth differences each, that overlap: the median scatters by some 8 %.
        assert path_noise(path + NOISE * draw.standard_normal(path.size)) == pytest.approx(NOISE, rel=0.25)
    if samples > 20.0:
        force = Spring(SpringParameters((0.0, 100.0), (1.0,), 30.0, 3.0, 0.7, 1.5, 0.0, -1.0, 1.0)).response(path)
        noise = NOISE * float(np.std(force))
        noisy = force + noise * draw.standard_normal(path.size)
        # The bends at reversals look like noise unless differences across them are left out.
        assert noise_level(noisy) > 1.6 * noise
        assert noise_level(noisy, find_strokes(path).turning[1:-1]) == pytest.approx(noise, rel=0.25)


MIDDLE, AMPLITUDE = 0.05, 0.025
TIME = np.linspace(0.0, 10.0, 4001)
PATH = MIDDLE + AMPLITUDE * np.sin(2.0 * np.pi * TIME)


# Ten cycles of 1 Hz.
RECORD = Record(PATH, 1e4 * PATH + 9.0 * np.cos(2.0 * np.pi * TIME), TIME, "rig.csv", None, (Finding(Outcome.NO_TIME),))


def test_cycles_are_cut_out_whole() -> None:
    cycles = find_cycles(RECORD)
    assert len(cycles) == 9
    part = select(RECORD, cycles=(2, 5))
    first, last = cycles[1].first_sample, cycles[4].last_sample
    for name in ("displacement", "force", "time"):
        np.testing.assert_array_equal(getattr(part, name), getattr(RECORD, name)[first : last + 1])
    assert (part.is_cut, RECORD.is_cut, part.first_sample) == (True, False, first)
    # From turning point to turning point, both included.
    assert len(part) == 4 * 400 + 1
    assert part.findings[0] == RECORD.findings[0]
    assert part.notes[1:] == (f"Selected, as given: cycles 2 to 5 of 9. (samples {first + 1} to {last + 1} of 4001)",)
    assert len(select(RECORD, cycles=(None, 2))) == len(select(RECORD, cycles=(8, None))) == 2 * 400 + 1
    assert select(RECORD, cycles=(3, 3)).notes[-1].startswith("Selected, as given: cycle 3 of 9.")
    for kind in (float, np.int64):
        np.testing.assert_array_equal(select(RECORD, cycles=(kind(2), kind(5))).force, part.force)


def test_windows_cut_what_cycles_leave_and_ranges_keep_the_path() -> None:
    part = select(RECORD, displacement=(0.04, None))
    np.testing.assert_array_equal(part.displacement, RECORD.displacement)
    np.testing.assert_array_equal(part.compared, RECORD.displacement >= 0.04)
    assert "Selected, as given: displacement from 40 mm to its end;" in part.notes[-1]
    twice = select(part, displacement=(None, 0.06), time=(2.5, 5.0))
    np.testing.assert_array_equal(twice.compared, (twice.displacement >= 0.04) & (twice.displacement <= 0.06))
    assert twice.time is not None
    assert (twice.time[0], twice.time[-1]) == (2.5, 5.0)
    both, cycles = select(RECORD, cycles=(1, 2), time=(1.5, None)).time, select(RECORD, cycles=(1, 2)).time
    assert (both[0], both[-1]) == (1.5, cycles[-1])
    # Loops are those inside the range.
    path = MIDDLE + np.where(TIME < 5.0, 0.01, 0.025) * np.sin(2.0 * np.pi * TIME)
    record = Record(path, Spring(MOUNT).response(path), TIME)
    (loop,) = measured_loops([select(record, displacement=(0.035, 0.065))])
    assert loop.figures.amplitude == pytest.approx(0.01, rel=1e-3)
    with pytest.raises(RecordError, match=r"no full cycle .* lies within the selected displacements"):
        info(Spring(MOUNT), select(record, displacement=(0.045, 0.055)))
