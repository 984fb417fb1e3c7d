"""Notes on the records of an identification: what was left out or not sought, and no reason for caution."""

from __future__ import annotations

import numpy as np

from strandspring import Outcome, Record, TwoStageOptions, identify
from strandspring.identification.notes import notes_on
from synthetic import record_of, sine, spring_of


def with_rests() -> Record:
    record = record_of(spring_of(1.0, 1.0), sine(3, 601))
    repeats = np.ones(601, dtype=int)
    repeats[[250, 350]] += 80
    return Record(np.repeat(record.displacement, repeats), np.repeat(record.force, repeats), path="rests.csv")


def test_samples_of_dwells_that_were_left_out_without_a_caution_are_noted() -> None:
    found = identify(with_rests(), TwoStageOptions((3, 1)))
    assert Outcome.DWELLS not in found.outcomes
    (note,) = (note for note in notes_on(found) if "rests" in note and "left out" in note)
    assert note.startswith("rests.csv: 1")
    assert note.endswith("does not relax meanwhile")
    without = identify(record_of(spring_of(1.0, 1.0), sine(3, 601)), TwoStageOptions((3, 1)))
    assert not any("left out" in note for note in notes_on(without))


def test_times_that_repeat_are_noted_where_effects_of_the_velocity_are_sought() -> None:
    record = record_of(spring_of(1.0, 1.0), sine(3, 300))
    times = np.linspace(0.0, 3.0, 300)
    coarse = Record(record.displacement, record.force, np.round(times, 1), "coarse.csv")
    (note,) = (note for note in notes_on(identify(coarse)) if "time" in note)
    assert note.startswith("coarse.csv: the time does not rise at 269 of 299 steps")
    for other in (record, Record(record.displacement, record.force, times)):
        assert not any("does not rise" in note for note in notes_on(identify(other)))
    assert not any("does not rise" in note for note in notes_on(identify(coarse, TwoStageOptions((3, 1)))))
