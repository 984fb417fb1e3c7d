"""Noise of the displacement hardly moves n and rho, and is told where it is large."""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np
import pytest

from judgement import judge_case
from noise_bound import bound
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
    assert np.sum(np.max(errors, axis=1) < 0.05) >= 7


@pytest.mark.parametrize("repetition", [2, 8, 21])
def test_jitter_does_not_round_the_reversals_of_triangles(repetition: int) -> None:
    name = "sampling jitter"
    generator = np.random.default_rng([0, zlib.crc32(name.encode()), repetition])
    spring = draw_spring(generator)
    case = simulate(spring, draw_experiment(generator, shape="triangle"), generator, FAULTS[name], "large")
    # Rounded reversals give 20 to 37 % more energy.
    assert not judge_case(case, identify(case.records).spring()).wrong


@pytest.mark.slow
def test_the_errors_are_those_of_the_bound() -> None:
    """The covariance of n and rho with noise of the displacement, against the least possible without it."""
    fault = replace(FAULTS["displacement noise"], small=0.002)
    squares = []
    for seed in range(24):
        generator = np.random.default_rng([0, 5])
        spring = draw_spring(generator, (0.3, 3.0), (0.5, 3.0), (6.0, 30.0), friction=(0.2, 0.4))
        experiment = draw_experiment(generator, shape="triangle")
        case = simulate(spring, experiment, np.random.default_rng(seed), fault, "small")
        found = identify(case.records).parameters
        error = np.log([found.n / spring.n, found.rho / spring.rho])
        squares.append(float(error @ np.linalg.solve(bound(case, 0.0), error)))
    # The mean for two parameters is 2, and with 24 draws its standard deviation 0.4.
    assert 1.0 < np.mean(squares) < 4.0


def test_records_without_it_say_nothing_of_it() -> None:
    generator = np.random.default_rng(3)
    found = identify(simulate(draw_spring(generator), draw_experiment(generator), generator).records)
    assert Outcome.DISPLACEMENT_NOISE not in found.outcomes
