"""Choosing part of a record: what is left, what the notes say, what is refused, and what is identified from it."""

from __future__ import annotations

import numpy as np
import pytest

from springs import MOUNT
from strandspring import (
    IdentificationError,
    NiOptions,
    Outcome,
    PaperOptions,
    Record,
    Spring,
    TwoStageOptions,
    identify,
    select,
)
from strandspring.errors import RecordError
from strandspring.identification.certainty.figures import predict_record
from strandspring.kernel.path import PathSolver
from strandspring.loops.cycles import find_cycles, measured_loops
from strandspring.loops.overview import overview

MIDDLE, AMPLITUDE = 0.05, 0.025
TIME = np.linspace(0.0, 10.0, 4001)
PATH = MIDDLE + AMPLITUDE * np.sin(2.0 * np.pi * TIME)
NOISE = 0.2  # [N]


def made(*, snap: bool = False) -> Record:
    """Ten cycles of 1 Hz; with `snap` the force collapses beyond 20 mm from the middle."""
    force = Spring(MOUNT).response(PATH) + np.random.default_rng(3).normal(0.0, NOISE, PATH.size)
    beyond = np.maximum(PATH - MIDDLE - 0.02, 0.0) / 0.005
    return Record(PATH, force - 2000.0 * beyond * snap, TIME, "rig.csv", notes=("as read",))


def test_cycles_are_cut_out_whole() -> None:
    record = made()
    cycles = find_cycles(record)
    assert len(cycles) == 9
    part = select(record, cycles=(2, 5))
    first, last = cycles[1].first_sample, cycles[4].last_sample
    for name in ("displacement", "force", "time"):
        np.testing.assert_array_equal(getattr(part, name), getattr(record, name)[first : last + 1])
    assert part.is_cut
    assert not record.is_cut
    # From turning point to turning point, both included.
    assert len(part) == 4 * 400 + 1
    assert part.notes == (
        "as read",
        f"cycles 2 to 5 of 9 selected, samples {first + 1} to {last + 1} of 4001, as given",
    )
    assert len(select(record, cycles=(None, 2))) == 2 * 400 + 1
    assert len(select(record, cycles=(8, None))) == 2 * 400 + 1
    assert select(record, cycles=(3, 3)).notes[-1].startswith("cycle 3 of 9 selected")


def test_a_window_of_time_cuts_what_cycles_leave() -> None:
    record = made()
    part = select(record, time=(2.5, 5.0))
    assert part.time is not None
    assert (part.time[0], part.time[-1]) == (2.5, 5.0)
    assert part.notes[-1] == "time from 2.5 s to 5 s selected, samples 1001 to 2001 of 4001, as given"
    both = select(record, cycles=(1, 2), time=(1.5, None))
    assert both.time is not None
    assert (both.time[0], both.time[-1]) == (1.5, select(record, cycles=(1, 2)).time[-1])  # type: ignore[index]


def test_a_range_of_displacement_keeps_the_path() -> None:
    record = made()
    part = select(record, displacement=(0.04, None))
    np.testing.assert_array_equal(part.displacement, record.displacement)
    np.testing.assert_array_equal(part.compared, record.displacement >= 0.04)
    assert "displacement from 40 mm to its end selected" in part.notes[-1]
    twice = select(part, displacement=(None, 0.06), time=(0.0, 5.0))
    np.testing.assert_array_equal(twice.compared, (twice.displacement >= 0.04) & (twice.displacement <= 0.06))


@pytest.mark.parametrize("method", [None, TwoStageOptions()])
def test_a_snap_outside_the_range_is_left_out(method: TwoStageOptions | None) -> None:
    record = made(snap=True)
    with pytest.raises(IdentificationError) as caught:
        identify(record, method)
    assert caught.value.outcome is Outcome.SNAP_THROUGH
    assert "`displacement_range=...`" in str(caught.value)
    identification = identify(select(record, displacement=(0.03, 0.069)), method)
    spring, fit = identification.parameters, identification.fits[0]
    step = np.abs(np.diff(PATH)).max()
    assert 0.03 <= spring.displacement_min <= 0.03 + step
    assert 0.069 - step <= spring.displacement_max <= 0.069
    within = (PATH >= 0.03) & (PATH <= 0.069)
    assert fit.samples == np.count_nonzero(within[fit.first_sample :])
    assert fit.compared.endswith("within the selected displacements")
    # The noise, and what a method of two stages misses.
    assert fit.rmse < (1.05 if method is None else 3.0) * NOISE
    # Against the force without noise, once the first cycle's memory is gone.
    error = (Spring(spring).response(PATH) - Spring(MOUNT).response(PATH))[within & (TIME > 1.0)]
    assert np.sqrt(np.mean(error**2)) < (0.3 if method is None else 3.0) * NOISE


def test_a_prediction_compares_the_range_only() -> None:
    record = made(snap=True)
    solver = PathSolver(MOUNT)
    assert predict_record(solver, record).rmse > 100.0 * NOISE
    fit = predict_record(solver, select(record, displacement=(None, 0.069)))
    assert fit.rmse < 1.05 * NOISE
    assert fit.predicted.size == len(record)


def test_loops_are_those_inside_the_range() -> None:
    time = np.linspace(0.0, 12.0, 4801)
    path = MIDDLE + np.where(time < 6.0, 0.01, 0.025) * np.sin(2.0 * np.pi * time)
    record = Record(path, Spring(MOUNT).response(path), time)
    assert len(measured_loops(record)) == 2
    (loop,) = measured_loops(select(record, displacement=(0.035, 0.065)))
    assert loop.figures.amplitude == pytest.approx(0.01, rel=1e-3)
    with pytest.raises(RecordError, match=r"no full cycle .* lies within the selected displacements"):
        measured_loops(select(record, displacement=(0.045, 0.055)))


def test_what_leaves_nothing_usable_is_refused_with_what_there_is() -> None:
    record = made()
    cases: list[tuple[dict[str, tuple[float | None, float | None]], str]] = [
        ({"cycles": (7, 12)}, "cycle 12 cannot be selected, since the record has 9; select among 1 to 9."),
        ({"cycles": (12, None)}, "cycle 12 cannot be selected, since the record has 9; select among 1 to 9."),
        ({"time": (20.0, None)}, "must hold at least 16 samples, found 0; the record goes from 0 to 10 s."),
        ({"displacement": (1.0, 2.0)}, "must hold at least 16 samples, found 0; the record goes from 25 to 75 mm."),
        ({"displacement": (0.0499, 0.0501)}, "over at least 2 % of the record's range"),
        ({"cycles": (0, 3)}, "must be whole numbers from 1 on"),
        ({"cycles": (3, 2)}, "the first is not above the second"),
        ({"time": (float("nan"), 2.0)}, "must be two finite numbers"),
    ]
    for selection, expected in cases:
        with pytest.raises(RecordError) as caught:
            select(record, **selection)  # type: ignore[arg-type]
        assert expected in str(caught.value)
    plain = Record(PATH, record.force)
    with pytest.raises(RecordError, match="the record has none"):
        select(plain, time=(0.0, 5.0))
    with pytest.raises(RecordError, match="do not fall back"):
        select(Record(PATH, record.force, -TIME), time=(0.0, 5.0))
    with pytest.raises(RecordError, match="has no full cycle"):
        select(Record(np.linspace(0.0, 1.0, 50), np.linspace(0.0, 1.0, 50)), cycles=(1, 1))
    with pytest.raises(RecordError, match="takes whole periods"):
        identify(select(record, displacement=(0.03, 0.07)), NiOptions())
    with pytest.raises(RecordError, match="takes whole periods"):
        identify(select(record, displacement=(0.03, 0.07)), PaperOptions())


def test_all_but_one_branch_is_too_little() -> None:
    record = made()
    rising = np.gradient(PATH) > 0.1 * np.gradient(PATH).max()
    with pytest.raises(IdentificationError) as caught:
        identify(Record(PATH, record.force, TIME, compared=rising))
    assert caught.value.outcome is Outcome.TOO_LITTLE_LEFT


def test_the_selection_travels_into_the_model_file() -> None:
    model = identify(select(made(), cycles=(2, 5))).spring().model
    assert "cycles 2 to 5 of 9 selected" in model.provenance["records"][0]["notes"][-1]


# ------------------------------------------------------------------------------------------ overview


def test_an_overview_tells_cycles_and_what_is_left_out() -> None:
    record = made()
    force = record.force.copy()
    force[1000] += 5000.0
    seen = overview(Record(record.displacement, np.minimum(force, 1e4), record.time, "rig.csv"))
    assert len(seen.cycles) == 9
    for number, cycle in enumerate(seen.cycles, 1):
        assert cycle.figures.amplitude == pytest.approx(AMPLITUDE, rel=1e-3)
        assert cycle.frequency == pytest.approx(1.0, rel=1e-2)
        part = select(record, cycles=(number, number))
        np.testing.assert_array_equal(part.force, record.force[cycle.first_sample : cycle.last_sample + 1])
    assert seen.strokes.count == 21
    assert {reason: samples.tolist() for reason, samples in seen.left_out.items()} == {"spikes": [1000]}


def test_an_overview_tells_dwells_clipping_and_selection() -> None:
    time = np.arange(0.0, 12.0, 0.0025)
    phase = np.interp(time, [0.0, 4.25, 6.25, 12.0], [0.0, 4.25, 4.25, 10.0])
    path = MIDDLE + AMPLITUDE * np.sin(2.0 * np.pi * phase)
    force = np.minimum(Spring(MOUNT).response(path), 700.0)
    record = select(Record(path, force, time), displacement=(None, 0.07))
    reasons = overview(record).left_out
    assert set(reasons) == {"clipped", "dwells", "not selected"}
    np.testing.assert_array_equal(reasons["clipped"], np.flatnonzero(force == 700.0))
    assert time[reasons["dwells"][0]] == pytest.approx(4.25, abs=0.1)
    np.testing.assert_array_equal(reasons["not selected"], np.flatnonzero(path > 0.07))


def test_parts_of_one_record_must_not_overlap() -> None:
    record = made()
    first, second, last = (select(record, cycles=cycles) for cycles in ((1, 3), (3, 5), (4, 6)))
    shared = find_cycles(record)[2]
    count = shared.last_sample + 1 - shared.first_sample
    with pytest.raises(
        RecordError, match=rf"rig.csv: shares {count} samples with the part of rig.csv that is given too"
    ):
        identify([first, second], TwoStageOptions())
    # Cycles that follow each other share the turning point between them.
    assert identify([first, last], TwoStageOptions()).spring()
    # So do ranges of displacement, whose samples to fit are compared only.
    ranges = [select(record, displacement=ends) for ends in ((None, 0.05), (0.045, None))]
    with pytest.raises(RecordError, match="select parts that do not overlap"):
        identify(ranges, TwoStageOptions())


@pytest.mark.parametrize(
    ("given", "part"),
    [
        ({"time": (10**400, None)}, "`time` must be two finite numbers"),
        ({"time": ("a", None)}, "`time` must be two finite numbers"),
        ({"cycles": (1j, None)}, "`cycles` must be two finite numbers"),
        ({"displacement": (np.array([1.0, 2.0]), None)}, "`displacement` must be two finite numbers"),
    ],
)
def test_ends_that_are_no_numbers_are_refused(given: dict[str, tuple[object, object]], part: str) -> None:
    with pytest.raises(RecordError) as caught:
        select(made(), **given)
    assert part in str(caught.value)
    assert len(str(caught.value)) < 200


def test_whole_numbers_of_any_type_count_cycles() -> None:
    expected = select(made(), cycles=(2, 3))
    for kind in (float, np.int64):
        np.testing.assert_array_equal(select(made(), cycles=(kind(2), kind(3))).force, expected.force)
