"""The simulated rig: its records are the spring's, its faults change them, its judge can tell right from wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from judgement import judge, judge_case
from rig import Case, Experiment, Truth, draw_experiment, draw_spring, simulate, strokes_of
from rig_faults import FAULTS
from strandspring import Spring
from strandspring.core.parameters import problems

SILENT = Experiment(noise=0.0)


def case_of(fault: str | None, size: str = "large", experiment: Experiment = SILENT, seed: int = 4) -> Case:
    generator = np.random.default_rng(seed)
    spring = draw_spring(generator)
    if fault is None:
        return simulate(spring, experiment, generator)
    return simulate(spring, experiment, generator, FAULTS[fault], size)


def test_drawn_springs_are_possible_monotone_and_within_their_ranges() -> None:
    for seed in range(200):
        p = draw_spring(np.random.default_rng(seed))
        assert problems(p) == []
        x = np.linspace(p.displacement_min, p.displacement_max, 101)
        assert np.all(np.diff(Spring(replace(p, kappa_omega=1e-15)).response(x)) > 0.0)
        assert 0.1 <= p.n <= 12.0
        assert 0.5 <= p.sigma <= 10.0
        assert 3.99 <= p.rho * 0.5 * (p.displacement_max - p.displacement_min) <= 60.01


@pytest.mark.parametrize("shape", ["sine", "triangle"])
@pytest.mark.parametrize("separate", [False, True])
def test_without_a_fault_the_record_is_the_springs_response(shape: str, separate: bool) -> None:
    case = case_of(None, experiment=replace(SILENT, shape=shape, separate=separate))
    assert len(case.records) == (3 if separate else 1)
    assert sum(map(len, case.records)) == pytest.approx(1000, rel=0.05)
    for record in case.records:
        # The reversals are sampled, so that the samples are the whole path.
        expected = Spring(case.spring).response(record.displacement)
        assert record.force == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.ptp(expected))
        assert np.all(np.diff(record.time) > 0.0)


def test_noise_has_the_size_and_the_correlation_that_were_asked_for() -> None:
    case = case_of(None, experiment=Experiment(noise=0.02, correlation=0.9, samples=20_000))
    noise = case.records[0].force - case.forces[0]
    # 20 000 samples with an autocorrelation time of 19 leave some 1000 independent ones: 2 % each.
    assert np.std(noise) == pytest.approx(0.02 * np.std(case.forces[0]), rel=0.1)
    assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(0.9, abs=0.02)


@pytest.mark.parametrize("name", FAULTS)
def test_faults_change_the_records_and_the_same_seed_gives_the_same_ones(name: str) -> None:
    for size in ("small", "large", "drawn"):
        case, again = case_of(name, size), case_of(name, size)
        for one, other in zip(case.records, again.records, strict=True):
            assert np.array_equal(one.displacement, other.displacement)
            assert np.array_equal(one.force, other.force)
        faultless = all(
            np.allclose(Spring(case.spring).response(record.displacement), record.force, rtol=1e-9)
            and np.allclose(np.diff(record.time), record.time[1] - record.time[0])
            for record in case.records
        )
        # A single amplitude is no fault of the samples.
        assert faultless == (name == "single amplitude"), size


def test_there_are_the_faults_that_were_asked_for() -> None:
    assert len(FAULTS) >= 28


def test_lag_is_a_shift_in_time() -> None:
    case = case_of("force lags")
    record = case.records[0]
    delay = case.magnitude * case.experiment.period
    later = np.interp(record.time + delay, record.time, record.force)
    inner = record.time < record.time[-1] - 2.0 * delay
    # What interpolation between the samples leaves.
    assert np.std((later - case.forces[0])[inner]) < 0.01 * np.std(case.forces[0])
    assert np.std((record.force - case.forces[0])[inner]) > 0.02 * np.std(case.forces[0])


def test_play_follows_by_half_the_gap_and_dwells_rest() -> None:
    case = case_of("play")
    assert np.ptp(case.records[0].displacement - case.paths[0]) == pytest.approx(case.magnitude * case.amplitude)
    record = case_of("dwells").records[0]
    assert np.mean(np.diff(record.displacement) == 0.0) > 0.3


def test_given_options_undo_what_no_record_shows() -> None:
    case = case_of("moving mass")
    record = case.records[0]
    turned = (2.0 * np.pi * case.experiment.frequency) ** 2
    inertia = -case.options["moving_mass"] * turned * (record.displacement - case.centre)
    assert record.force - inertia == pytest.approx(case.forces[0], abs=1e-9 * np.ptp(record.force))
    case = case_of("fixture compliance")
    record = case.records[0]
    own = record.displacement - record.force / case.options["fixture_stiffness"]
    assert own == pytest.approx(case.paths[0], abs=1e-12)


def test_the_truth_is_right_and_neither_offset_nor_the_records_coordinates_make_it_wrong() -> None:
    for name in (None, "displacement zero", "kink", "tanh"):
        case = case_of(name)
        judgement = judge_case(case, case.truths[-1])
        assert not judgement.wrong
        assert judgement.excess == 0.0
    spring = case_of(None).spring
    offset = replace(spring, kE=(spring.kE[0] + 1e3, *spring.kE[1:]))
    assert not judge(Truth(spring), Spring(offset), 0.5 * (spring.x_max - spring.x_min), case.centre).wrong


@pytest.mark.parametrize(("factor", "wrong"), [(0.92, False), (0.88, True), (1.12, True)])
def test_the_energy_of_small_loops_decides(factor: float, wrong: bool) -> None:
    case = case_of(None)
    judgement = judge_case(case, Spring(replace(case.spring, kappa_omega=factor * case.spring.kappa_omega)))
    assert judgement.energy == pytest.approx(factor - 1.0, rel=1e-6)
    assert judgement.wrong is wrong


def test_the_force_on_minor_loops_decides() -> None:
    case = case_of(None)
    stiffer = Spring(replace(case.spring, kE=(case.spring.kE[0], *(1.1 * k for k in case.spring.kE[1:]))))
    judgement = judge_case(case, stiffer)
    assert judgement.wrong
    assert abs(judgement.energy) < 1e-6
    assert 0.05 < judgement.force < 0.1


def test_strokes_end_where_the_path_turns() -> None:
    assert strokes_of(np.array([0.0, 1.0, 2.0, 2.0, 1.0, 0.0, 1.0])).tolist() == [0, 3, 5, 6]


def test_drawn_experiments_keep_what_is_fixed() -> None:
    drawn = [draw_experiment(np.random.default_rng(seed), shape="sine") for seed in range(50)]
    assert {e.shape for e in drawn} == {"sine"}
    assert all(0.1 <= e.frequency <= 2.0 and len(e.cycles) == len(e.amplitudes) for e in drawn)
    assert {len(e.amplitudes) for e in drawn} == {1, 2, 3, 4}
