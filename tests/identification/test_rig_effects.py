"""What the rig adds: found where it is, not invented where it is not, and taken out as given."""

from __future__ import annotations

import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from judgement import judge_case
from noise_bound import delay_bound
from rig import Case, Experiment, draw_experiment, draw_spring, elastic_force, simulate
from rig_faults import FAULTS
from strandspring import (
    Identification,
    IdentificationError,
    Outcome,
    Record,
    RecordError,
    RefinedOptions,
    Spring,
    identify,
)
from synthetic import record_of, sine, spring_of

pytestmark = pytest.mark.long


def wrong(*values: Any, why: str) -> Any:
    """A case that the identification before this one got right, and this one does not."""
    return pytest.param(*values, marks=[pytest.mark.xfail(reason=why, strict=False), pytest.mark.slow])


STEPPED = Experiment(amplitudes=(0.4, 0.7, 1.0), cycles=(3, 3, 3), noise=0.002)


def case_of(fault: str, share: float, experiment: Experiment = STEPPED, seed: int = 1) -> Case:
    """Records of a spring with high loops."""
    generator = np.random.default_rng(seed)
    spring = draw_spring(generator, (0.5, 3.0), (0.6, 3.0), (6.0, 20.0), (0.2, 0.4), degrees=(3, 1))
    return simulate(spring, experiment, generator, replace(FAULTS[fault], large=share), "large")


def drawn(fault: str, seed: int, index: int) -> Case:
    """A case of `honesty.py sizes`."""
    generator = np.random.default_rng([seed, zlib.crc32(fault.encode()), index])
    return simulate(draw_spring(generator), draw_experiment(generator), generator, FAULTS[fault], "drawn")


def lag(case: Case, fault: str) -> float:
    return (1.0 if fault == "force lags" else -1.0) * case.magnitude * case.experiment.period


def is_wrong(case: Case, found: Identification) -> bool:
    return judge_case(case, Spring(found.parameters)).wrong


# -- found


SHIFTS = np.array([0.0, 1.0, -0.7])  # of the zeros of three records
SIZES = {
    "force lags": (0.003, "delay", lambda c: lag(c, "force lags"), Outcome.DELAY),
    "force leads": (0.01, "delay", lambda c: lag(c, "force leads"), Outcome.DELAY),
    "force zero": (
        0.05, "force_zero", lambda c: c.magnitude * elastic_force(c.spring) * (SHIFTS - SHIFTS.mean()),
        Outcome.FORCE_ZERO,
    ),
    "linear drift": (0.1, "drift", lambda c: c.magnitude * elastic_force(c.spring), Outcome.DRIFT_REMOVED),
}  # fmt: skip


@pytest.mark.parametrize("fault", SIZES)
def test_the_size_of_an_effect_is_found_and_it_is_no_part_of_the_spring(fault: str) -> None:
    share, name, truth, outcome = SIZES[fault]
    case = case_of(fault, share)
    # Arrays are all called the same: of three zeros two were lost.
    found = identify([replace(record, path="<arrays>") for record in case.records])
    assert set(found.effects) == {name}
    size = found.effects[name]
    size = list(size.values()) if isinstance(size, dict) else size
    # A twentieth, or of a delay 0.3 ms: the noise of 0.2 % leaves a tenth of that.
    floor = 3e-4 if name == "delay" else 0.0
    largest = float(np.abs(truth(case)).max())
    assert size == pytest.approx(truth(case), abs=max(0.05 * largest, min(floor, 0.1 * largest)))
    assert outcome in found.outcomes
    assert not is_wrong(case, found)
    # What is left is noise.
    assert found.fitted_figures["rmse"] < 0.003 * np.std(np.concatenate(case.forces)) < found.rmse


@pytest.mark.parametrize(
    ("share", "noise"),
    [(0.03, 0.01), (0.3, 0.01), wrong(1.0, 0.01, why="not found"), (0.1, 0.0)],
)
def test_a_drift_is_found_whatever_its_size(share: float, noise: float) -> None:
    record = record_of(spring_of(1.0, 1.0), sine(6), noise=noise)
    drift = share * np.ptp(record.force)
    found = identify(replace(record, force=record.force + np.linspace(0.0, drift, len(record))), save_anyway=True)
    assert found.effects == {"drift": pytest.approx(drift, rel=0.02)}


@pytest.mark.parametrize(
    ("fault", "seed", "index"),
    [
        pytest.param("force lags", 0, 11, marks=pytest.mark.slow),  # a richer FE takes over much of it
        pytest.param("force lags", 1, 14, marks=pytest.mark.slow),
        ("force leads", 0, 8),  # straight lines between the samples of this sine are further off than the noise
        # A triangle's velocity jumps where the delay is measured.
        wrong("force leads", 1, 0, why="energy 30 % too large, beyond its range"),
        wrong("force leads", 1, 16, why="sigma takes it over: energy 33 % too large, beyond its range"),
        pytest.param("force leads", 5, 14, marks=pytest.mark.slow),  # the same with an FE of degree 7
        # sigma is large, so that a triangle's reversals look like those of a play.
        wrong("force lags", 0, 12, why="energy 13 % too small, beyond its range"),
        ("force lags", 6, 1),  # as measured the loop runs the wrong way round
        pytest.param("force lags", 5, 4, marks=pytest.mark.slow),  # as measured the branches cross
        ("force leads", 6, 17),  # as measured the force collapses
        # Of one amplitude and hardly any noise, at some 250 samples in a cycle.
        *((fault, shape, 1) for fault in ("force lags", "force leads") for shape in ("sine", "triangle")),
        ("force leads", None, 2),  # a branch may take it over at three amplitudes
    ],
)
def test_a_delay_is_found_or_leaves_the_spring_right_or_is_said(fault: str, seed: Any, index: int) -> None:
    once = Experiment(shape=seed, amplitudes=(1.0,), cycles=(4,), noise=1e-4) if isinstance(seed, str) else None
    case = drawn(fault, seed, index) if isinstance(seed, int) else case_of(fault, 0.01, once or STEPPED, index)
    found = identify(case.records, save_anyway=True)
    delay, bound = lag(case, fault), 4.0 * delay_bound(case, lag(case, fault))
    # A tenth more than the bound's four: the range of delays is searched on few rows.
    is_found = abs(found.effects.get("delay", 0.0) - delay) < bound + 0.1 * abs(delay)
    unrecorded = found.certainty.unrecorded
    truth = judge_case(case, Spring(found.parameters))
    energy = unrecorded.energy / (1.0 + truth.energy)
    holds = unrecorded.low <= energy <= unrecorded.high
    assert is_found or not truth.wrong or Outcome.LACK_OF_FIT in found.outcomes or holds


def test_a_lag_that_turns_loops_of_one_amplitude_round_is_found() -> None:
    case = drawn("force lags", 0, 14)
    found = identify(case.records)
    # The lag of one amplitude is hardly distinct from sigma.
    assert found.effects["delay"] == pytest.approx(lag(case, "force lags"), rel=0.05)
    assert not is_wrong(case, found)


def test_no_delay_explains_swapped_columns() -> None:
    case = drawn("force lags", 0, 2)
    with pytest.raises(IdentificationError) as refused:
        identify([Record(r.force, r.displacement, r.time, r.path) for r in case.records])
    assert refused.value.outcome is Outcome.COLUMNS_SWAPPED


def test_a_lag_that_turns_the_loop_round_is_measured_found_or_given() -> None:
    generator = np.random.default_rng(2)
    spring = draw_spring(generator, (0.8, 1.5), (0.8, 1.5), (8.0, 12.0), (0.02, 0.021), degrees=(2, 1))
    experiment = Experiment(shape="sine", amplitudes=(0.5, 1.0), cycles=(3, 3), noise=0.001)
    case = simulate(spring, experiment, generator, replace(FAULTS["force lags"], large=0.01), "large")
    delay = lag(case, "force lags")
    with pytest.raises(IdentificationError, match="If the force lags, then by more than") as refused:
        identify(case.records, RefinedOptions(delay=0.0))
    least = 1e-3 * float(str(refused.value).split("more than ")[1].split(" ms")[0])
    assert 0.3 * delay < least < delay
    assert identify(case.records).effects["delay"] == pytest.approx(delay, rel=0.01)
    assert not is_wrong(case, identify(case.records, RefinedOptions(delay=delay)))
    # Without times no delay can be sought.
    with pytest.raises(IdentificationError):
        identify([replace(record, time=None) for record in case.records])


# -- not invented


@pytest.mark.parametrize("count", [8, pytest.param(40, marks=pytest.mark.slow)])
def test_clean_records_have_no_effects(count: int) -> None:
    for seed in range(count):
        generator = np.random.default_rng([0, seed])
        case = simulate(draw_spring(generator), draw_experiment(generator), generator)
        found = identify(case.records)
        assert found.effects == {}, seed
        assert {finding.kind for finding in found.findings} <= {
            Outcome.ONE_AMPLITUDE, Outcome.SMALL_LOOPS, Outcome.N_AT_BOUND,
        }, seed  # fmt: skip


@pytest.mark.parametrize(
    ("fault", "size", "named"),
    [
        ("displacement zero", 0.1, Outcome.FORCE_ZERO),  # which looks much like it
        ("warm-up", 0.1, Outcome.LACK_OF_FIT), ("play", 0.02, Outcome.BACKLASH),
        ("wear of stiffness", 0.1, Outcome.STIFFNESS_WEAR),
    ],
)  # fmt: skip
def test_what_no_removal_explains_is_named_and_not_removed_as_something_else(
    fault: str, size: float, named: Outcome
) -> None:
    found = identify(case_of(fault, size).records)
    assert named in found.outcomes
    assert set(found.effects) <= {"force_zero"}


def test_times_that_do_not_rise_count_as_none() -> None:
    (record,) = case_of("force lags", 0.003, replace(STEPPED, samples=400)).records
    time = record.time
    untimed = identify(replace(record, time=None))
    for wrong in (
        time[::-1], np.zeros(time.size), np.repeat(time[::2], 2)[: time.size],
        np.where(np.arange(time.size) > time.size // 2, time - 1.0, time),
    ):  # fmt: skip
        found = identify(replace(record, time=wrong))
        assert (found.parameters, found.effects) == (untimed.parameters, untimed.effects)
        assert any("the time does not rise at" in note for note in found.notes)
        with pytest.raises(RecordError, match="time"):
            identify(replace(record, time=wrong), RefinedOptions(delay=1e-3))


# -- noise and steps of the displacement


@pytest.mark.parametrize("shape", [wrong("sine", why="median errors of n 33 %, of rho 10 %"), "triangle"])
def test_rho_and_n_are_right_in_spite_of_noise_of_the_displacement(shape: Any) -> None:
    fault = replace(FAULTS["displacement noise"], small=0.002)
    errors = []
    for seed in range(4):
        generator = np.random.default_rng([0, seed])  # of tests/benchmarks/honesty.py noise
        spring = draw_spring(generator, (0.3, 3.0), (0.5, 3.0), (6.0, 30.0), friction=(0.2, 0.4))
        case = simulate(spring, draw_experiment(generator, shape=shape), generator, fault, "small")
        found = identify(case.records)
        errors.append([abs(found.parameters.n / spring.n - 1.0), abs(found.parameters.rho / spring.rho - 1.0)])
        assert Outcome.DISPLACEMENT_NOISE in found.outcomes
        assert Outcome.DWELLS not in found.outcomes
    # Noise of the force alone leaves 1 %, and 4 % where n is a third.
    assert np.median(errors, axis=0).max() < 0.05


@pytest.mark.parametrize(
    "repetition", [wrong(2, why="energy 14 % too small"), wrong(8, why="energy 32 % too small"), 21]
)
def test_jitter_does_not_round_the_reversals_of_triangles(repetition: int) -> None:
    name = "sampling jitter"
    generator = np.random.default_rng([0, zlib.crc32(name.encode()), repetition])
    spring = draw_spring(generator)
    case = simulate(spring, draw_experiment(generator, shape="triangle"), generator, FAULTS[name], "large")
    # Rounded reversals give 20 to 37 % more energy.
    assert not is_wrong(case, identify(case.records))


# -- known


# The acceleration where the amplitude changes is known to a quarter of a tenth of the force; noise is 0.2 %.
@pytest.mark.parametrize(
    ("fault", "size", "left"),
    [("moving mass", 0.1, 0.03), ("fixture compliance", 0.15, 0.005), ("force lags", 0.06, 0.005)],
)
def test_what_is_known_comes_out(fault: str, size: float, left: float) -> None:
    case = case_of(fault, size, replace(STEPPED, shape="sine"), seed=3)
    options = case.options or {"delay": lag(case, fault)}
    found = identify(case.records, RefinedOptions(**options))
    assert not is_wrong(case, found)
    assert found.effects.items() >= options.items()
    assert found.spring().model.fit["effects"].items() >= options.items()
    # The prediction is of what was measured, and what was given is not in the spring.
    assert found.fits[0].rms_force == pytest.approx(np.sqrt(np.mean(found.records[0].force ** 2)), rel=0.05)
    assert found.fitted_figures["rmse"] < min(left * np.std(case.records[0].force), 0.7 * found.rmse)
    assert all("with what was removed" in fit.compared for fit in found.fitted)


@pytest.mark.parametrize("options", [{"moving_mass": 1.0}, {"delay": 1e-3}, {"branches": 1}])
def test_times_are_needed(options: dict[str, Any]) -> None:
    (record,) = case_of("moving mass", 0.1).records
    (name,) = options
    with pytest.raises(RecordError, match="time" if name == "branches" else f"`{name}=...`"):
        identify(replace(record, time=None), RefinedOptions(**options))
    steps = np.floor(np.arange(len(record)) / 4.0)
    for time in (record.time[::-1], steps):
        with pytest.raises(RecordError, match="time"):
            identify(replace(record, time=time), RefinedOptions(**options))
    with pytest.raises(RecordError, match="longer than a stroke"):
        identify(record, RefinedOptions(delay=50.0))
