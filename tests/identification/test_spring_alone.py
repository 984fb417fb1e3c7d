"""The records without the effects of the rig: what the spring alone would have given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rig import Experiment, draw_spring, simulate
from rig_faults import FAULTS
from strandspring import RefinedOptions, Spring, identify

STEPPED = Experiment(amplitudes=(0.4, 0.7, 1.0), cycles=(3, 3, 3), noise=0.002)


@pytest.mark.parametrize(
    ("fault", "share"),
    [("force lags", 0.01), ("viscous damper", 0.5), ("play", 0.02), ("linear drift", 0.1), ("wear of friction", 0.3)],
)
def test_effects_that_were_found_are_taken_out_of_every_sample(fault: str, share: float) -> None:
    generator = np.random.default_rng(1)
    spring = draw_spring(generator, (0.5, 3.0), (0.6, 3.0), (6.0, 20.0), (0.2, 0.4), degrees=(3, 1))
    case = simulate(spring, STEPPED, generator, replace(FAULTS[fault], large=share), "large")
    # The truth is the spring before it wore.
    found = identify(case.records, RefinedOptions(state="first"))
    assert found.effects
    errors = []
    for record, part in zip(
        (*found.records, *(p.record for p in found.steady_parts)), found.steady_parts * 2, strict=True
    ):
        used = slice(part.first_sample, None)
        errors.append(np.std((record.force - Spring(spring).response(record.displacement))[used]))
    before, after = errors
    # What is left is noise, and what the size of the effect errs by.
    assert after < 0.006 * np.std(case.forces[0])
    assert before > 3.0 * after


def test_a_known_delay_is_taken_out_too() -> None:
    generator = np.random.default_rng(1)
    spring = draw_spring(generator, (0.5, 3.0), (0.6, 3.0), (6.0, 20.0), (0.2, 0.4), degrees=(3, 1))
    case = simulate(spring, STEPPED, generator, replace(FAULTS["force lags"], large=0.01), "large")
    delay = case.magnitude * case.experiment.period
    (part,) = identify(case.records, RefinedOptions(delay=delay)).steady_parts
    error = (part.record.force - Spring(spring).response(part.record.displacement))[part.used]
    assert np.std(error[part.first_sample :]) < 0.006 * np.std(case.forces[0])


def test_without_effects_they_are_the_records() -> None:
    generator = np.random.default_rng(1)
    case = simulate(draw_spring(generator), STEPPED, generator)
    found = identify(case.records)
    assert not found.effects
    assert [part.record for part in found.steady_parts] == list(case.records)
