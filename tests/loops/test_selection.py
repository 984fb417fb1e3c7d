"""Choosing part of a record: what is left, what the notes say, and what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from springs import MOUNT
from strandspring import Record, Spring, select
from strandspring.errors import RecordError
from strandspring.loops.cycles import find_cycles, measured_loops

MIDDLE, AMPLITUDE = 0.05, 0.025
TIME = np.linspace(0.0, 10.0, 4001)
PATH = MIDDLE + AMPLITUDE * np.sin(2.0 * np.pi * TIME)


RECORD = Record(PATH, Spring(MOUNT).response(PATH), TIME, "rig.csv", notes=("as read",))  # ten cycles of 1 Hz


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
    assert part.notes[0] == "as read"
    assert part.notes[1:] == (f"cycles 2 to 5 of 9 selected, samples {first + 1} to {last + 1} of 4001, as given",)
    assert len(select(RECORD, cycles=(None, 2))) == len(select(RECORD, cycles=(8, None))) == 2 * 400 + 1
    assert select(RECORD, cycles=(3, 3)).notes[-1].startswith("cycle 3 of 9 selected")
    for kind in (float, np.int64):
        np.testing.assert_array_equal(select(RECORD, cycles=(kind(2), kind(5))).force, part.force)


def test_a_window_of_time_cuts_what_cycles_leave() -> None:
    part = select(RECORD, time=(2.5, 5.0))
    assert (part.time[0], part.time[-1]) == (2.5, 5.0)
    assert part.notes[-1] == "time from 2.5 s to 5 s selected, samples 1001 to 2001 of 4001, as given"
    both, cycles = select(RECORD, cycles=(1, 2), time=(1.5, None)).time, select(RECORD, cycles=(1, 2)).time
    assert (both[0], both[-1]) == (1.5, cycles[-1])


def test_a_range_of_displacement_keeps_the_path() -> None:
    part = select(RECORD, displacement=(0.04, None))
    np.testing.assert_array_equal(part.displacement, RECORD.displacement)
    np.testing.assert_array_equal(part.compared, RECORD.displacement >= 0.04)
    assert "displacement from 40 mm to its end selected" in part.notes[-1]
    twice = select(part, displacement=(None, 0.06), time=(0.0, 5.0))
    np.testing.assert_array_equal(twice.compared, (twice.displacement >= 0.04) & (twice.displacement <= 0.06))


def test_loops_are_those_inside_the_range() -> None:
    time = np.linspace(0.0, 12.0, 4801)
    path = MIDDLE + np.where(time < 6.0, 0.01, 0.025) * np.sin(2.0 * np.pi * time)
    record = Record(path, Spring(MOUNT).response(path), time)
    assert len(measured_loops(record)) == 2
    (loop,) = measured_loops(select(record, displacement=(0.035, 0.065)))
    assert loop.figures.amplitude == pytest.approx(0.01, rel=1e-3)
    with pytest.raises(RecordError, match=r"no full cycle .* lies within the selected displacements"):
        measured_loops(select(record, displacement=(0.045, 0.055)))


LINE = np.linspace(0.0, 1.0, 50)


@pytest.mark.parametrize(
    ("record", "selection", "expected"),
    [
        (RECORD, {"cycles": (7, 12)}, "cycle 12 cannot be selected, since the record has 9; select among 1 to 9."),
        (RECORD, {"cycles": (12, None)}, "cycle 12 cannot be selected, since the record has 9"),
        (RECORD, {"time": (20.0, None)}, "must hold at least 16 samples, found 0; the record goes from 0 to 10 s."),
        (RECORD, {"displacement": (1.0, 2.0)}, "at least 16 samples, found 0; the record goes from 25 to 75 mm."),
        (RECORD, {"displacement": (0.0499, 0.0501)}, "over at least 2 % of the record's range"),
        (RECORD, {"cycles": (0, 3)}, "must be whole numbers from 1 on"),
        (RECORD, {"cycles": (3, 2)}, "the first is not above the second"),
        (RECORD, {"cycles": (1j, None)}, "`cycles` must be two finite numbers"),
        (RECORD, {"time": (float("nan"), 2.0)}, "`time` must be two finite numbers"),
        (RECORD, {"time": (10**400, None)}, "`time` must be two finite numbers"),
        (RECORD, {"time": ("a", None)}, "`time` must be two finite numbers"),
        (RECORD, {"time": 3.0}, "`time` must be a pair of first and last [s]"),
        (RECORD, {"displacement": (np.array([1.0, 2.0]), None)}, "`displacement` must be two finite numbers"),
        (Record(PATH, PATH), {"time": (0.0, 5.0)}, "the record has none"),
        (Record(PATH, PATH, -TIME), {"time": (0.0, 5.0)}, "do not fall back"),
        (Record(LINE, LINE), {"cycles": (1, 1)}, "has no full cycle"),
    ],
)
def test_what_leaves_nothing_usable_is_refused(record: Record, selection: dict[str, Any], expected: str) -> None:
    with pytest.raises(RecordError) as caught:
        select(record, **selection)
    assert expected in str(caught.value)
    assert len(str(caught.value)) < 200
