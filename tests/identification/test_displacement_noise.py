"""Noise of the displacement hardly moves n and rho, and is told where it is large."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rig import draw_experiment, draw_spring, simulate
from rig_faults import FAULTS
from strandspring import Outcome, identify


@pytest.mark.parametrize("shape", ["sine", "triangle"])
def test_rho_and_n_are_right_in_spite_of_it(shape: str) -> None:
    fault = replace(FAULTS["displacement noise"], small=0.002)
    errors = []
    for seed in range(8):
        generator = np.random.default_rng([0, seed])  # of tests/benchmarks/honesty.py noise
        spring = draw_spring(generator, (0.3, 3.0), (0.5, 3.0), (6.0, 30.0), friction=(0.2, 0.4))
        found = identify(simulate(spring, draw_experiment(generator, shape=shape), generator, fault, "small").records)
        errors.append([abs(found.parameters.n / spring.n - 1.0), abs(found.parameters.rho / spring.rho - 1.0)])
        assert Outcome.DISPLACEMENT_NOISE in found.outcomes
        assert Outcome.DWELLS not in found.outcomes
    # Noise of the force alone leaves 1 %, and 4 % where n is a third; raw paths have 10 %.
    assert np.median(errors, axis=0).max() < 0.03
    assert np.sum(np.max(errors, axis=1) < 0.05) >= 6


def test_records_without_it_say_nothing_of_it() -> None:
    generator = np.random.default_rng(3)
    found = identify(simulate(draw_spring(generator), draw_experiment(generator), generator).records)
    assert Outcome.DISPLACEMENT_NOISE not in found.outcomes
