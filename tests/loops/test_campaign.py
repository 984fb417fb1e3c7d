"""What loops tell together: the rate, and the overlap of loading paths."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from strandspring import Record, SpringParameters
from strandspring.kernel.path import PathSolver
from strandspring.loops.campaign import (
    OverlapVerdict,
    RateIndependence,
    RateVerdict,
    campaign_verdicts,
    loading_overlap,
    rate_independence,
)
from strandspring.loops.cycles import find_cycles
from strandspring.loops.loop import steady_loop
from synthetic import AMPLITUDE, MEAN, spring_of

FREQUENCIES = (0.13, 0.5, 2.12)  # the paper's range [Hz]


def measured(
    parameters: SpringParameters, frequency: float, amplitude: float = AMPLITUDE, *, samples: int = 500,
    cycles: int = 4, noise: float = 0.03, seed: int = 0, damper: float = 0.0, zero: float = 0.0,
) -> Record:  # fmt: skip
    """A spring, with a viscous damper [N s/m] beside it and a zero [N] of its own if wanted, under a sine."""
    t = np.arange(cycles * samples + 1) / (samples * frequency)
    phase = 2.0 * np.pi * frequency * t
    x = MEAN + amplitude * np.sin(phase)
    force = PathSolver(parameters).force(x) + damper * amplitude * 2.0 * np.pi * frequency * np.cos(phase)
    force = force * (1.0 + noise * np.random.default_rng(seed).standard_normal(force.size))
    return Record(x, force + zero, t)


def verdict_of(records: Iterable[Record]) -> RateIndependence:
    return rate_independence([cycle for record in records for cycle in find_cycles(record)])


@pytest.mark.parametrize(("samples", "cycles", "noise"), [(500, 4, 0.03), (60, 4, 0.03), (500, 2, 0.03), (500, 4, 0.0)])
def test_a_rate_independent_spring_is_recognised(samples: int, cycles: int, noise: float) -> None:
    parameters = spring_of(0.5, 1.5)
    for seed in range(5):
        comparison = verdict_of(
            measured(parameters, f, a, samples=samples, cycles=cycles, noise=noise, seed=10 * seed + k, zero=3.0 * k)
            for k, f in enumerate(FREQUENCIES)
            for a in (0.013, 0.02)
        )
        assert comparison.verdict is RateVerdict.INDEPENDENT
        assert comparison.amplitudes == 2
        assert comparison.frequencies == pytest.approx((0.13, 2.12))
        if noise:
            # 2*2*80 values or more make the ratio 1 within 30 %; clean records fall below the least noise assumed.
            assert 0.7 < comparison.relative_to_noise < 1.4
        assert "0.13 to 2.12 Hz" in comparison.sentence


@pytest.mark.parametrize(
    ("damper", "verdict"), [(10.0, RateVerdict.LITTLE), (100.0, RateVerdict.DEPENDENT)]
)  # against a loop 46 N high; the fastest test moves at up to 0.27 m/s
def test_a_damper_beside_the_spring_is_noticed(damper: float, verdict: RateVerdict) -> None:
    comparison = verdict_of(measured(spring_of(0.5, 1.5), f, damper=damper, seed=k) for k, f in enumerate(FREQUENCIES))
    assert comparison.verdict is verdict


def test_the_difference_is_that_of_the_dampers_forces() -> None:
    frequencies, damper = (0.5, 2.0), 5.0
    parameters = spring_of(1.0, 1.0)
    comparison = verdict_of(measured(parameters, f, damper=damper, noise=0.0) for f in frequencies)
    share = np.linspace(0.2, 0.98, 400)
    speed = 2.0 * np.pi * 1.5 * AMPLITUDE * np.sqrt(1.0 - (2.0 * share - 1.0) ** 2)
    (slow,) = {round(c.figures.height, 9) for c in find_cycles(measured(parameters, 0.5, damper=damper, noise=0.0))[1:]}
    (fast,) = {round(c.figures.height, 9) for c in find_cycles(measured(parameters, 2.0, damper=damper, noise=0.0))[1:]}
    expected = damper * np.sqrt(np.mean(speed**2)) / (0.5 * (slow + fast))
    assert comparison.relative_to_height == pytest.approx(expected, rel=0.01)  # cells of 2 % of the stroke


def test_the_reason_is_given_where_the_rate_is_unknown() -> None:
    parameters = spring_of(0.5, 1.5)
    without = verdict_of(replace(measured(parameters, f), time=None) for f in FREQUENCIES)
    assert without.verdict is RateVerdict.NO_TIMES
    assert without.sentence == RateVerdict.NO_TIMES.value
    # One frequency, the second within what a rig holds; or each amplitude at its own frequency.
    same = verdict_of(measured(parameters, f) for f in (1.0, 1.03))
    apart = verdict_of(measured(parameters, f, a) for f, a in ((0.5, 0.01), (2.0, 0.02)))
    assert same.verdict is apart.verdict is RateVerdict.ONE_FREQUENCY
    assert verdict_of([]).verdict is RateVerdict.NO_TIMES
    # A first loading says nothing of the rate.
    rate, _ = campaign_verdicts([measured(parameters, f, cycles=c, noise=0.0) for f, c in ((0.13, 4), (1.0, 1))])
    assert rate.verdict is not RateVerdict.DEPENDENT


AMPLITUDES = (0.007, 0.013, 0.02)


@pytest.mark.parametrize(
    ("strokes_in_steady", "verdict"), [(6.0, OverlapVerdict.OVERLAPPING), (0.3, OverlapVerdict.APART)]
)
def test_saturated_loading_paths_overlap_and_others_do_not(strokes_in_steady: float, verdict: OverlapVerdict) -> None:
    parameters = spring_of(1.0, 1.0, strokes_in_steady)
    solver = PathSolver(parameters)
    model = loading_overlap([steady_loop(solver, MEAN - a, MEAN + a) for a in AMPLITUDES])
    records = [measured(parameters, 1.0, a, seed=k) for k, a in enumerate(AMPLITUDES)]
    comparison = loading_overlap([cycle for record in records for cycle in find_cycles(record)])
    assert model.verdict is comparison.verdict is verdict
    assert comparison.amplitudes == 2
    # What the noise of 3 % adds to the distance is removed; 12 samples a cell leave 1 % of the loop's height.
    assert comparison.relative_to_height == pytest.approx(model.relative_to_height, abs=0.02)
    assert f"{comparison.distance:.3g} N" in comparison.sentence


def test_the_distance_of_loading_paths_in_closed_form() -> None:
    # n = sigma = 1: omega = 1 - (1 + w)*exp(-rho*s), w = tanh(rho*L/2), on a linear spring with FA = 1.
    rho, kappa = 150.0, 10.0
    solver = PathSolver(SpringParameters((0.0, 1000.0), (1.0,), kappa, rho, 1.0, 1.0, 0.0, -0.02, 0.02))
    comparison = loading_overlap([steady_loop(solver, -a, a) for a in (0.01, 0.02)])
    x = np.linspace(0.0, 0.02 * 0.48, 400)
    small, large = (1.0 - (1.0 + np.tanh(rho * a)) * np.exp(-rho * (x + a)) for a in (0.01, 0.02))
    assert comparison.distance == pytest.approx(kappa * np.sqrt(np.mean((small - large) ** 2)), rel=0.01)  # 40 cells


def test_the_reason_is_given_where_the_overlap_is_unknown() -> None:
    parameters = spring_of(1.0, 1.0)
    solver = PathSolver(parameters)
    assert loading_overlap([]) is None
    assert loading_overlap([steady_loop(solver, MEAN - 0.01, MEAN + 0.01)]) is None
    apart = loading_overlap([steady_loop(solver, 0.03, 0.04), steady_loop(solver, 0.05, 0.07)])
    assert apart.verdict is OverlapVerdict.NO_SHARED_RANGE
    assert apart.sentence == OverlapVerdict.NO_SHARED_RANGE.value
    flat = spring_of(5.0, 0.5, 0.3)  # its loop is 0.06 N high under 3 % of noise on 90 N
    lost = loading_overlap([c for k, a in enumerate(AMPLITUDES) for c in find_cycles(measured(flat, 1.0, a, seed=k))])
    assert lost.verdict is OverlapVerdict.LOST_IN_NOISE
