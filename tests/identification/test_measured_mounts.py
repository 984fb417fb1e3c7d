"""Measured mounts are of a wider class than the model: nothing that they do may be removed as a fault of the rig."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from strandspring import (
    Identification,
    IdentificationError,
    Outcome,
    Record,
    RefinedOptions,
    bundled_record,
    identify,
    read_record,
)
from strandspring.loops.strokes import find_strokes
from synthetic import record_of, sine, spring_of

DATA = Path(__file__).parents[1] / "data"


def measured(name: str) -> Record:
    if name == "hinge":
        return read_record(bundled_record(), reverse="displacement")
    if name == "column":
        return read_record(DATA / "degrading/SPC1.csv")
    if name == "damper":
        return read_record(DATA / "mr_damper/ensaio1.mat")  # Tout, dist, forc
    record = read_record(DATA / "actuator/circle_3bar.csv", time=1, displacement=5, force=7)
    return replace(record, time=1e-3 * record.time)  # milliseconds


@cache
def identified(name: str) -> Identification:
    """By default."""
    return identify(measured(name))


NAMES = ("hinge", "actuator", "damper", "column")


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_removed(name: str) -> None:
    found = identified(name)
    assert not found.effects
    (loop,) = {round(fit.predicted_energy / fit.energy, 2) for fit in found.fitted}
    assert loop == pytest.approx(1.0, abs=0.03)


def test_a_jittering_sensor_is_named_with_its_size() -> None:
    """The paper's spring takes reversals of the last digit for motion, a slower second mechanism and a branch less."""
    plain = identify(measured("actuator"), RefinedOptions(mechanisms=1, branches=0))
    assert "21 % of its standard deviation" in plain.findings[Outcome.JITTER]
    assert "energy -7 %" in plain.findings[Outcome.LOOP_ENERGY]
    (alone,), (fitted,) = plain.fits, plain.fitted
    assert alone.rnl < 0.991 < 0.997 < fitted.rnl
    wider = identified("actuator")
    assert wider.rmse < 0.5 * plain.rmse


def test_the_actuator_has_two_mechanisms_and_a_branch() -> None:
    """Which predict cycles that were left out a fifth better; its two directions were driven at different speeds."""
    found = identified("actuator")
    assert found.parameters.second is not None
    assert len(found.parameters.branches) == 1
    assert found.wider is not None
    plain, chosen = found.wider.choice.tried[0], found.wider.choice.chosen
    assert chosen.held_out < 0.85 * plain.held_out
    assert chosen.held_out < 0.04 * found.wider.spread


def test_the_damper_at_one_rate_is_told_what_a_branch_would_do() -> None:
    found = identified("damper")
    assert not found.parameters.branches
    assert "would be 4 %, and is 5.5 %" in found.findings[Outcome.RATE_OPEN]


def test_a_degrading_column_is_a_mean_with_its_errors_by_amplitude() -> None:
    found = identified("column")
    assert found.rnl > 0.8
    assert {Outcome.LOOP_ENERGY, Outcome.OTHER_MOUNT, Outcome.LACK_OF_FIT} <= set(found.outcomes)
    assert len(found.recorded) > 5


@pytest.mark.parametrize("name", ["hinge", "actuator", pytest.param("damper", marks=pytest.mark.slow)])
def test_times_and_removals_do_no_harm_to_strokes_held_out(name: str) -> None:
    """The saved spring, run along the whole record, judged on the last quarter of its strokes."""
    record = measured(name)
    turning = find_strokes(record.displacement).turning
    end = int(turning[-1 - max(1, round(0.25 * (turning.size - 1)))]) + 1

    def part(of: Record) -> Record:
        time = None if of.time is None else of.time[:end]
        return replace(of, displacement=of.displacement[:end], force=of.force[:end], time=time)

    def error(found: Identification) -> float:
        force = found.spring().response(record.displacement, found.fits[0].omega_start, record.rising_time)
        return float(np.std((force - record.force)[end:]))

    with_time = error(identify(part(record)))
    assert with_time <= 1.1 * error(identify(part(replace(record, time=None))))
    assert with_time <= 1.05 * error(identify(part(record), RefinedOptions(keep=("all",))))


def test_a_spring_that_is_worse_than_a_line_is_refused_unless_asked_for() -> None:
    """A sensor that drifts by three times its range, and the spring of the first moment."""
    record = record_of(spring_of(1.0, 1.0), sine(6), noise=0.01)
    drift = np.linspace(0.0, 3.0 * np.ptp(record.force), len(record))
    drifting = replace(record, force=record.force + drift)
    first = RefinedOptions(state="first")
    with pytest.raises(IdentificationError, match="worse than a straight line") as refused:
        identify(drifting, first)
    assert refused.value.outcome is Outcome.WORSE_THAN_LINE
    found = identify(drifting, first, save_anyway=True)
    assert {Outcome.WORSE_THAN_LINE, Outcome.SPRING_ALONE} <= set(found.outcomes)
    assert found.rnl < found.fitted[0].rnl
    # That of the mean moment is as good as one can be without the drift.
    assert identify(drifting).rnl > found.rnl


@pytest.mark.parametrize(("keep", "left"), [((), {"drift"}), (("drift",), set()), (("all",), set())])
def test_what_is_kept_is_not_removed(keep: tuple[str, ...], left: set[str]) -> None:
    record = record_of(spring_of(1.0, 1.0), sine(6), noise=0.01)
    drift = np.linspace(0.0, 0.3 * np.ptp(record.force), len(record))
    found = identify(replace(record, force=record.force + drift), RefinedOptions(keep=keep))
    assert set(found.effects) == left


@pytest.mark.parametrize("options", [{"keep": ("lag",)}, {"keep": "delay"}, {"state": "worn"}])
def test_wrong_names_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(options))):
        RefinedOptions(**options)
