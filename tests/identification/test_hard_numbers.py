"""Records of hard numbers that once ended in a traceback or a warning; `fuzz/targets/identify.py` makes more."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from strandspring import (
    IdentificationError,
    Outcome,
    Record,
    RecordError,
    RefinedOptions,
    ScanOptions,
    TwoStageOptions,
    identify,
)
from strandspring.errors import ModelError
from strandspring.identification.certainty.intervals import around
from strandspring.identification.certainty.prediction_interval import _halves, prediction_error
from strandspring.identification.points.direction import correlation
from strandspring.identification.points.sample_points import SamplePoints
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.identification.rig.effect_columns import Effect, Rig
from strandspring.model.joint import JointCovariance, joint_names
from synthetic import AMPLITUDE, MEAN, record_of, sine, spring_of


def refused(record: Record, options: Any = None) -> IdentificationError:
    with pytest.raises(IdentificationError) as refusal:
        identify(record, options=options)
    return refusal.value


@pytest.mark.parametrize(
    "path",
    [
        np.tile([-1.0, -1 / 3, 1 / 3, 1.0, 1 / 3, -1 / 3], 4),
        np.tile([-1.0, -1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0], 2),
        np.tile([-1.0, 1.0], 20),
        np.random.default_rng(0).normal(size=100),
    ],
    ids=["six samples a cycle", "each sample twice", "turning points", "noise"],
)
def test_a_path_that_is_taken_for_noise_is_refused(path: np.ndarray) -> None:
    refusal = refused(Record(path, 2.0 * path))
    assert refusal.outcome is Outcome.UNDERSAMPLED
    assert "sample at least 12 times per cycle" in str(refusal)


@pytest.mark.parametrize("path", [np.ones(30), np.linspace(0.0, 1.0, 30)], ids=["constant", "monotone"])
def test_a_path_without_a_cycle_is_refused(path: np.ndarray) -> None:
    assert refused(Record(path, 2.0 * path)).outcome is Outcome.TOO_FEW_STROKES


def coarse_record(strokes: int, samples: int) -> Record:
    """A triangle of so many strokes and samples in each."""
    corners = np.resize([-1.0, 1.0], strokes + 1)
    path = MEAN + AMPLITUDE * np.interp(
        np.linspace(0.0, strokes, strokes * samples + 1), np.arange(strokes + 1), corners
    )
    return record_of(spring_of(1.0, 1.0), path, 0.01)


@pytest.mark.parametrize(("strokes", "samples"), [(3, 7), (3, 8), (4, 5)])
def test_degrees_are_chosen_among_those_that_the_points_decide(strokes: int, samples: int) -> None:
    result = identify(coarse_record(strokes, samples))
    assert result.rnl > 0.9


def dry_friction(samples: int, stiffness: float, friction: float) -> Record:
    """It switches between two samples: what a search starts from saturates far beyond its bounds."""
    phase = np.linspace(0.0, 20.0, samples)
    return Record(0.004 * np.sin(phase), stiffness * np.sin(phase) + friction * np.sign(np.cos(phase)))


@pytest.mark.parametrize("samples", [200, 700, 1500, 2000])
@pytest.mark.parametrize(("stiffness", "friction"), [(10.0, 0.5), (1e4, 5e3), (1.0, 20.0)])
def test_dry_friction_without_noise_is_found(samples: int, stiffness: float, friction: float) -> None:
    found = identify(dry_friction(samples, stiffness, friction))
    # It is missed altogether in the sample after each of the 6 reversals, and in no other.
    assert found.rmse <= 2.0 * friction * np.sqrt(6.0 / samples)


def test_a_refusal_says_that_forces_at_the_end_of_a_range_were_left_out() -> None:
    assert "(<arrays>: 700 samples)" in str(refused(dry_friction(700, 0.0, 0.5)))  # all of them
    record = record_of(spring_of(1.0, 1.0), sine())
    peak = np.abs(record.force).max()
    clipped = replace(record, force=record.force.clip(-peak, -0.7 * peak))
    refusal = str(refused(clipped))
    assert refusal.endswith(f"({record.path}: {np.sum(clipped.force == -0.7 * peak)} samples)")
    assert "The force stays at an extreme, as at the end of a sensor's range" in refusal


@pytest.mark.parametrize("method", [ScanOptions(), ScanOptions(degrees=(1, 0)), TwoStageOptions(degrees=(1, 0))])
def test_as_many_parameters_as_points_are_refused(method: Any) -> None:
    path = MEAN + AMPLITUDE / 3.0 * np.array([0.0, 3.0, -2.0, 2.0, -3.0, 0.0, 3.0, -2.0])
    refusal = refused(record_of(spring_of(1.0, 1.0), path), method)
    assert refusal.outcome is Outcome.TOO_FEW_SAMPLES
    assert "Found 6 samples after the first stroke; 8 are needed at least" in str(refusal)


def test_the_zero_of_the_displacement_shifts_within_the_displacements() -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    rig = Rig.from_parts([find_steady_part(record)] * 2, 100)
    shifts = [rig.is_possible({Effect.DISPLACEMENT_ZERO: np.array([shift * AMPLITUDE])}) for shift in (-1.9, 1.9, 2.1)]
    assert shifts == [True, True, False]


def test_records_of_very_different_forces_do_not_drive_a_size_to_absurdity() -> None:
    spring = spring_of(1.0, 1.0)
    path = MEAN + AMPLITUDE * np.interp(np.linspace(0, 4, 241), np.arange(5), [-1.0, 1.0, -1.0, 1.0, -1.0])
    weak = record_of(spring, path, 0.01)
    strong = coarse_record(3, 13)
    shifted = replace(strong, displacement=1e-5 * strong.displacement)
    records = [replace(shifted, path="a"), replace(weak, force=0.01 * weak.force, path="b")]
    # A line follows them better than any spring does.
    assert identify(records, save_anyway=True).rmse < 100.0


@pytest.mark.parametrize(
    ("length", "force", "shift", "names"),
    [
        (1e-14, 1.0, 0.0, "displacement_min"),
        (1.0, 1e-20, 0.0, "kappa_omega"),
        (1.0, 1e20, 0.0, "kappa_omega"),
        (1.0, 1.0, 1e14, "displacement_offset"),
    ],
)
def test_a_spring_beyond_the_limits_is_refused_in_words(length: float, force: float, shift: float, names: str) -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    refusal = refused(
        Record(length * record.displacement + shift * np.ptp(record.displacement), force * record.force),
        RefinedOptions(degrees=(1, 0)),
    )
    assert refusal.outcome is Outcome.BEYOND_LIMITS
    assert names in str(refusal)
    assert "check the units of displacement and force" in str(refusal)


@pytest.mark.parametrize("unit", [1e300, 1e-300])
def test_times_that_no_clock_gives_are_refused(unit: float) -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    with pytest.raises(RecordError, match="`time` must be within"):
        replace(record, time=unit * np.arange(len(record)))


def test_times_that_are_nearly_equal_do_not_rise() -> None:
    times = np.array([0.0, 1e-20, 1.0, 2.0])
    assert Record(times, times, times).rising_time is None
    assert Record(times, times, np.arange(4.0)).rising_time is not None


def test_acceleration_takes_three_times_in_each_window() -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    times = np.floor(np.arange(len(record)) / 4.0)
    with pytest.raises(RecordError, match="does not rise over 5 samples"):
        identify(replace(record, time=times), options=RefinedOptions(moving_mass=1.0))


def test_a_constant_force_has_no_correlation() -> None:
    assert correlation(Record([0.0, 1.0, 2.0], [3.0, 3.0, 3.0])) == 0.0


def joint_of(p: Any, deviations: list[float]) -> dict[str, Any]:
    names = joint_names(p.elastic_name, len(p.kE), len(p.kA) - 1)
    return {"joint": {"parameters": names, "root": [[0.0] * k + [deviations[k]] for k in range(len(names))]}}


def test_the_interval_of_an_amplifier_near_zero_takes_smaller_steps() -> None:
    p = replace(
        spring_of(1.0, 1.0), kE=(0.0, 1000.0), kA=(1.0, -99.99), displacement_offset=0.0, displacement_min=-0.01,
        displacement_max=0.01,
    )  # fmt: skip
    path = np.linspace(-0.01, 0.01, 9)
    small, large = (
        prediction_error(
            p, JointCovariance.from_uncertainty(p, joint_of(p, [0.0, 0.0, error, 0.0, 0.0, 0.0, 0.0])), path, 0.0
        )
        for error in (0.1, 5.0)
    )
    assert large == pytest.approx(50.0 * small, rel=1e-6)  # linear, whatever the step
    with pytest.raises(ModelError, match="is not possible: at 1e-06 standard deviations"):
        prediction_error(
            p, JointCovariance.from_uncertainty(p, joint_of(p, [0.0, 0.0, 1e9, 0.0, 0.0, 0.0, 0.0])), path, 0.0
        )


@pytest.mark.parametrize("place", [0, 2, 3])
def test_absurd_standard_deviations_are_refused(place: int) -> None:
    p = replace(spring_of(1.0, 1.0), kE=(0.0, 1000.0), kA=(1.0, 0.0))
    deviations = [0.1] * 7
    deviations[place] = 1e200
    with pytest.raises(ModelError, match="standard deviations of at most 1e"):
        JointCovariance.from_uncertainty(p, joint_of(p, deviations))


def test_a_constant_selection_does_not_hide_a_reversed_force() -> None:
    path = np.tile([0.0, 1.0, 2.0, 1.0], 5)
    record = Record(path, -path, compared=path == 1.0)
    assert correlation(record) == pytest.approx(-1.0)


def test_no_correlation_is_beyond_1() -> None:
    phase = np.linspace(0.0, 8.0 * np.pi, 32)
    path = MEAN + AMPLITUDE * np.sin(phase) * phase / phase[-1]
    for n in (1.0, 3.0, 8.0):
        correlation = identify(record_of(spring_of(n, 1.0, 200.0), path, 0.01)).uncertainty["correlation"]
        assert max(map(abs, correlation.values())) == pytest.approx(1.0, abs=1e-9)
        assert max(map(abs, correlation.values())) <= 1.0


def test_an_interval_of_absurd_reach_is_open() -> None:
    assert around(2.0, 0.5) == pytest.approx((2.0 * np.exp(-0.5), 2.0 * np.exp(0.5)))
    assert around(2.0, 1000.0) == (None, None)


@pytest.mark.parametrize("gone", [0, 1, 2])
def test_cycles_are_counted_where_nothing_of_a_record_is_left(gone: int) -> None:
    # Two cycles of one stroke more in each of three records; of one, all points were left out.
    record, strokes = np.repeat([0, 1, 2], 5), np.arange(15)
    stroke = np.repeat(strokes, 2)
    points, rows = np.zeros(stroke.size), np.ones(strokes.size)
    loops = SamplePoints(
        points, points, points, points, stroke, points, rows.astype(np.int64), rows, rows, record
    ).only(record[stroke] != gone)  # fmt: skip
    assert loops.cycles().tolist() == [0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3]
    half, count = _halves(loops)
    assert count == 4
    assert half.tolist() == 2 * (4 * [0] + 6 * [1])
