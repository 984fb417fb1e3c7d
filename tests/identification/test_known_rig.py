"""What is known of a rig is removed as given: moving mass, fixture stiffness, delay."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from judgement import judge_case
from rig import Case, Experiment, draw_experiment, draw_spring, simulate
from rig_faults import FAULTS
from strandspring import IdentificationError, Outcome, Record, RecordError, RefinedOptions, ScanOptions, identify
from strandspring.identification.points.acceleration import acceleration
from strandspring.identification.rig.known_rig import KnownRig, unknown_effects

SINE = Experiment(noise=0.002)


def case_of(fault: str, size: Any = "large", seed: int = 0, experiment: Experiment | None = None) -> Case:
    generator = np.random.default_rng([seed, 17])
    spring = draw_spring(generator, n=(0.5, 3.0), sigma=(0.8, 3.0), saturations=(6.0, 20.0), friction=(0.1, 0.4))
    return simulate(spring, experiment or draw_experiment(generator), generator, FAULTS[fault], size)


@pytest.mark.parametrize("size", ["small", "large"])
@pytest.mark.parametrize("fault", ["moving mass", "fixture compliance"])
def test_known_effects_come_out(fault: str, size: str) -> None:
    for seed in range(2):
        case = case_of(fault, size, seed)
        found = identify(case.records, RefinedOptions(**case.options))
        assert not judge_case(case, found.spring()).wrong, seed
        assert found.fitted_figures["rnl"] > 0.98  # noise of 0.5 %
        assert found.effects.items() >= case.options.items()
        assert found.spring().model.fit["effects"].items() >= case.options.items()
        assert all("with what was removed" in fit.compared for fit in found.fitted)


def test_the_prediction_is_of_what_was_measured() -> None:
    case = case_of("moving mass", experiment=SINE)
    without = identify(case.records, RefinedOptions(degrees=(4, 2)))
    found = identify(case.records, RefinedOptions(degrees=(4, 2), **case.options))
    assert found.fits[0].rms_force == without.fits[0].rms_force
    # The noise of 0.2 % of the force's standard deviation, and the mean force adds to the rms force.
    assert found.fitted_figures["rmse"] < 0.004 * found.fits[0].rms_force
    # What was given is not in the spring.
    assert found.rmse > 0.02 * found.fits[0].rms_force


@pytest.mark.slow
def test_a_given_delay_equals_the_found_one() -> None:
    case = case_of("force lags", experiment=SINE)
    delay = case.magnitude * case.experiment.period
    found = identify(case.records)
    given = identify(case.records, RefinedOptions(delay=delay))
    assert found.effects["delay"] == pytest.approx(delay, rel=0.1)
    assert given.effects == {"delay": delay}
    assert given.rnl == pytest.approx(found.rnl, abs=1e-3)
    assert not judge_case(case, given.spring()).wrong
    assert given.parameters.kappa_omega == pytest.approx(found.parameters.kappa_omega, rel=0.05)


def test_a_delay_that_turns_the_loop_round_is_taken_out_when_given() -> None:
    fault = replace(FAULTS["force lags"], large=0.06)
    generator = np.random.default_rng(5)
    spring = draw_spring(generator, n=(0.5, 3.0), sigma=(0.8, 3.0), saturations=(6.0, 20.0), friction=(0.05, 0.1))
    case = simulate(spring, SINE, generator, fault, "large")
    with pytest.raises(IdentificationError, match=r"`delay=\.\.\.`"):
        identify(case.records)
    delay = case.magnitude * case.experiment.period
    assert not judge_case(case, identify(case.records, RefinedOptions(delay=delay)).spring()).wrong


@pytest.mark.slow
def test_a_delay_of_zero_is_not_sought() -> None:
    case = case_of("force lags", experiment=SINE)
    assert "delay" in identify(case.records).effects
    assert identify(case.records, RefinedOptions(delay=0.0)).effects["delay"] == 0.0


def test_acceleration_of_a_noisy_sine_and_of_a_triangle() -> None:
    time = np.linspace(0.0, 4.0, 801)
    sine = np.sin(2.0 * np.pi * time)
    noisy = sine + 1e-3 * np.random.default_rng(2).standard_normal(time.size)
    scale = (2.0 * np.pi) ** 2
    # Window of a tenth of the period: 2 % each from its length and from the noise.
    error = acceleration(Record(noisy, sine, time)) / scale + sine
    assert np.sqrt(np.mean(error**2)) < 0.05
    triangle = np.interp(time % 1.0, [0.0, 0.25, 0.75, 1.0], [0.0, 1.0, -1.0, 0.0])
    assert np.abs(acceleration(Record(triangle, sine, time))).max() < 1e-6 * scale


@pytest.mark.parametrize(
    ("options", "word"),
    [({"moving_mass": 1.0}, "`moving_mass=...`"), ({"delay": 1e-3}, "`delay=...`")],
)
def test_times_are_needed(options: dict[str, float], word: str) -> None:
    record = case_of("moving mass", experiment=SINE).records[0]
    with pytest.raises(RecordError, match=word):
        identify(replace(record, time=None), RefinedOptions(**options))
    with pytest.raises(RecordError, match="time"):
        identify(replace(record, time=record.time[::-1]), RefinedOptions(**options))


def test_a_delay_longer_than_a_stroke_is_refused() -> None:
    record = case_of("moving mass", experiment=SINE).records[0]
    with pytest.raises(RecordError, match="longer than a stroke"):
        identify(record, RefinedOptions(delay=5.0))


@pytest.mark.parametrize(
    "options",
    [
        {"moving_mass": -1.0}, {"moving_mass": np.nan}, {"moving_mass": np.inf}, {"fixture_stiffness": 0.0},
        {"fixture_stiffness": np.nan}, {"fixture_stiffness": -1.0}, {"delay": np.nan}, {"delay": np.inf},
    ],
)  # fmt: skip
def test_impossible_values_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(options))):
        RefinedOptions(**options)


def test_notes_say_how_large_effects_would_be() -> None:
    time = np.linspace(0.0, 3.0, 1201)
    displacement = 0.01 * np.sin(2.0 * np.pi * 2.0 * time)
    # 1 kg has the dynamic stiffness (4 pi)^2 = 158 N/m; the fixture of 1e7 N/m is far stiffer.
    record = Record(displacement, 5000.0 * displacement, time)
    (note,) = unknown_effects([record], KnownRig())
    assert note == "1 kg between load cell and spring would change the stiffness by 3.2 % at 2 Hz (`moving_mass=...`)."
    assert unknown_effects([record], KnownRig(moving_mass=0.5)) == ()
    assert unknown_effects([replace(record, time=None)], KnownRig()) == ()
    stiff = Record(displacement, 2e5 * displacement, time)
    (note,) = unknown_effects([stiff], KnownRig())
    assert note == "A fixture of 10 kN/mm would change the stiffness by 2 % (`fixture_stiffness=...`)."
    assert unknown_effects([stiff], KnownRig(fixture_stiffness=1e8)) == ()


def test_a_lag_that_turns_the_loop_round_is_measured_and_can_be_given() -> None:
    generator = np.random.default_rng(2)
    spring = draw_spring(generator, (0.8, 1.5), (0.8, 1.5), (8.0, 12.0), (0.02, 0.021), degrees=(2, 1))
    experiment = Experiment(shape="sine", amplitudes=(0.5, 1.0), cycles=(3, 3), noise=0.001)
    case = simulate(spring, experiment, generator, replace(FAULTS["force lags"], large=0.01), "large")
    with pytest.raises(IdentificationError, match="If the force lags, then by more than") as refused:
        identify(case.records, ScanOptions())
    assert refused.value.outcome is Outcome.COLUMNS_SWAPPED
    delay = case.magnitude * experiment.period
    least = 1e-3 * float(str(refused.value).split("more than ")[1].split(" ms")[0])
    assert 0.3 * delay < least < delay
    assert not judge_case(case, identify(case.records, RefinedOptions(delay=delay)).spring()).wrong
    # The refined method finds it.
    assert identify(case.records).effects["delay"] == pytest.approx(delay, rel=0.01)


@pytest.mark.parametrize(
    "given", [{"moving_mass": True}, {"moving_mass": "1"}, {"delay": [0.1]}, {"seed": 1.5}, {"bootstrap": True}]
)
def test_what_is_no_number_is_refused(given: dict[str, Any]) -> None:
    (name,) = given
    with pytest.raises(TypeError, match=f"`{name}` must be"):
        RefinedOptions(**given)
