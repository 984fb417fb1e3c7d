"""Samples that say nothing of the spring: clipped forces, dwells; and gaps, which are named by their times."""

from __future__ import annotations

import numpy as np
import pytest

from strandspring import Outcome, Record
from strandspring.identification.points.usable import dwells_without_relaxation, usable_samples
from strandspring.loops.strokes import find_strokes
from synthetic import record_of, sine, spring_of


def usable(record: Record) -> tuple[np.ndarray, dict[Outcome, str]]:
    return usable_samples(record, find_strokes(record.displacement))


def triangle(samples: int, cycles: int = 3) -> np.ndarray:
    phase = np.linspace(0.0, cycles, samples)
    return 0.05 + 0.02 * np.interp(phase % 1.0, [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])


@pytest.mark.parametrize("samples", [300, 1500, 60_000])
@pytest.mark.parametrize("shape", [lambda k: sine(3, k), triangle], ids=["sine", "triangle"])
def test_every_sample_of_a_good_record_is_used(samples: int, shape) -> None:
    record = record_of(spring_of(1.0, 1.0), shape(samples), noise=0.01)
    used, found = usable(record)
    assert used.all()
    assert found == {}


@pytest.mark.parametrize("both", [False, True])
def test_clipped_forces_are_left_out(both: bool) -> None:
    record = record_of(spring_of(1.0, 1.0), sine(), noise=0.01)
    high = np.quantile(record.force, 0.97)
    low = np.quantile(record.force, 0.03) if both else -np.inf
    used, found = usable(Record(record.displacement, record.force.clip(low, high)))
    outside = (record.force >= high) | (record.force <= low)
    assert np.array_equal(used, ~outside)
    assert found == {Outcome.CLIPPED: f"{outside.sum()} of 1500 samples"}


def test_a_coarse_force_is_not_clipped() -> None:
    record = record_of(spring_of(1.0, 1.0), sine(), noise=0.01)
    used, found = usable(Record(record.displacement, np.round(record.force / 2.0) * 2.0))
    assert used.all()
    assert Outcome.CLIPPED not in found


@pytest.mark.parametrize("dense", [1, 30])
def test_dwells_are_left_out_but_for_their_ends(dense: int) -> None:
    record = record_of(spring_of(1.0, 1.0), triangle(600 * dense + 1))
    pause, at = 80 * dense, [250 * dense, 350 * dense]  # reversals
    repeats = np.ones(len(record), dtype=int)
    repeats[at] += pause
    path, force = np.repeat(record.displacement, repeats), np.repeat(record.force, repeats)
    resting = np.concatenate([begin + np.arange(pause + 1) for begin in (at[0], at[1] + pause)])
    relaxed = 3.0 * np.linspace(0.0, 1.0, pause + 1)
    force[resting] -= np.tile(relaxed, 2)
    used, found = usable(Record(path, force))
    # A part of a rest of 0.2 % of the range on either side may go with it, and thinning may shift the ends.
    missed = np.setdiff1d(resting, np.flatnonzero(~used))
    assert missed.size <= 2 * (1 + 2 * dense)
    assert (~used).sum() - resting.size <= 4 * dense
    assert set(found) == {Outcome.DWELLS}


def test_dwells_without_relaxation_go_without_a_caution() -> None:
    record = record_of(spring_of(1.0, 1.0), triangle(601))
    repeats = np.ones(601, dtype=int)
    repeats[[250, 350]] += 80
    used, found = usable(Record(np.repeat(record.displacement, repeats), np.repeat(record.force, repeats)))
    assert not used.all()
    assert found == {}


def test_gaps_are_named_by_their_times() -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    times = 0.01 * np.arange(1500)
    keep = np.ones(1500, dtype=bool)
    keep[400:450] = keep[900:960] = False
    _, found = usable(Record(record.displacement[keep], record.force[keep], times[keep]))
    assert found == {Outcome.GAPS: "3.99 to 4.5 s; 8.99 to 9.6 s"}


def test_irregular_sampling_is_no_gap() -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    times = np.cumsum(np.random.default_rng(0).exponential(0.01, 1500))
    assert Outcome.GAPS not in usable(Record(record.displacement, record.force, times))[1]


def rested(path: np.ndarray, before: int, after: int) -> np.ndarray:
    return np.concatenate([np.full(before, path[0]), path, np.full(after, path[-1])])


@pytest.mark.parametrize("samples", [450, 1500, 30_000])
@pytest.mark.parametrize("shape", [lambda k: sine(3, k), triangle], ids=["sine", "triangle"])
def test_rests_before_and_after_the_test_go_without_a_word(samples: int, shape) -> None:
    """The first motion and the last change the force most of all, but no force relaxes there."""
    path = rested(shape(samples), samples // 6, samples // 8)
    # A start that is ramped up turns within what is called a rest.
    ramp = np.sin(0.5 * np.pi * np.clip((np.arange(path.size) - samples // 6) / (samples / 3), 0.0, 1.0)) ** 4
    for displacement in (path, path[0] + ramp * (path - path[0])):
        record = record_of(spring_of(1.0, 1.0), displacement, noise=0.01)
        rounded = Record(np.round(record.displacement / 1e-6) * 1e-6, record.force)
        assert usable(rounded)[1] == {}
        assert not dwells_without_relaxation([rounded])


@pytest.mark.parametrize(("relaxation", "found"), [(0.0, set()), (0.04, {Outcome.DWELLS})])
def test_relaxation_is_judged_while_the_displacement_rests(relaxation: float, found: set[Outcome]) -> None:
    """The servo arrives late and leaves early: by 0.1 % of the range at either end, where the knee is steepest."""
    phase = np.linspace(0.0, 3.0, 3001)
    path = 0.02 * np.sin(2.0 * np.pi * phase)
    pause, at = 400, [250, 750, 1250, 1750]
    repeats = np.ones(path.size, dtype=int)
    repeats[at] += pause
    record = record_of(spring_of(1.0, 1.0), np.repeat(path, repeats), noise=0.002)
    force = record.force.copy()
    begin = np.array(at) + pause * np.arange(4)
    for k, first in enumerate(begin):
        sense = 1.0 if k % 2 else -1.0
        decay = -np.expm1(-np.arange(pause + 1) / 100.0)
        force[first : first + pause + 1] += sense * relaxation * np.std(force) * decay
    assert set(usable(Record(record.displacement, force))[1]) == found
