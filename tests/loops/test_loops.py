"""Figures of loops and what loops tell together: closed forms, brute force, rate and overlap of loading paths."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from strandspring import Record, RecordError, Spring, SpringParameters, info
from strandspring.kernel.path import PathSolver
from strandspring.kernel.steady import steady_omega
from strandspring.loops.campaign import (
    OverlapVerdict,
    RateVerdict,
    campaign_verdicts,
    loading_overlap,
    rate_independence,
)
from strandspring.loops.cycles import find_cycles, measured_loops
from strandspring.loops.loop import LoopFigures, steady_loop
from synthetic import AMPLITUDE, MEAN, record_of, sine, spring_of

FIGURES = ("secant_stiffness", "energy_per_cycle", "loss_factor", "mean_force", "min_force", "max_force")


def plain(kappa_omega: float, rho: float, n: float = 1.0) -> SpringParameters:
    """Linear spring of 2000 N/m beside hysteresis with FA = 1."""
    return SpringParameters((5.0, 2000.0), (1.0,), kappa_omega, rho, 1.0, n, 0.05, 0.03, 0.07)


def loop_of(parameters: SpringParameters, amplitude: float, mean: float = MEAN) -> LoopFigures:
    return steady_loop(PathSolver(parameters), mean - amplitude, mean + amplitude).figures


# -- of springs


@pytest.mark.parametrize("way", [1e-3, 0.5, 3.0, 30.0, 3000.0])
def test_exponential_hysteresis_in_closed_form(way: float) -> None:
    # n = sigma = 1: du/dxi = 1 - u everywhere, so w = 1 - (1 + w)*exp(-rho*L) and each stroke integrates by hand.
    stroke, kappa = 0.03, 11.0
    parameters, omega = plain(kappa, way / stroke), math.tanh(0.5 * way)
    # W is tabulated to 1e-12; at way = 1e-3 the difference of two such numbers, 5e-4, is solved for.
    assert steady_omega(parameters, stroke) == pytest.approx(omega, rel=1e-9)
    figures = loop_of(parameters, 0.5 * stroke)
    assert figures.secant_stiffness == pytest.approx(2000.0 + 2.0 * kappa * omega / stroke, rel=1e-11)
    # 2*kappa*(L - (1 + w)*(1 - exp(-rho*L))/rho) = 2*kappa*(L - 2*w/rho), which cancels as rho*L -> 0.
    expected = 2.0 * kappa * stroke * (1.0 - 2.0 * omega / way)
    assert figures.energy_per_cycle == pytest.approx(expected, rel=1e-9, abs=1e-11 * kappa * stroke)


@pytest.mark.parametrize(("n", "sigma", "steady"), [(0.22, 3.0, 2.0), (0.22, 0.5, 0.2), (6.0, 20.0, 4.0)])
def test_the_steady_loop_is_where_many_cycles_end(n: float, sigma: float, steady: float) -> None:
    parameters = spring_of(n, sigma, steady)
    solver = PathSolver(parameters)
    low, high = MEAN - 0.6 * AMPLITUDE, MEAN + 0.9 * AMPLITUDE  # FA = 1 + 10 x + 100 x^2: asymmetric
    omega = steady_omega(parameters, high - low)
    # What 400 cycles leave of the start.
    assert solver.omega(np.tile([low, high], 400), 0.3)[-1] == pytest.approx(omega, abs=1e-9)
    # The last cycle again, finely, its energy and mean by the trapezoidal rule: the bend after a reversal is finest.
    up = low + (high - low) * 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 20_001)))
    path = np.concatenate([up, up[-2::-1]])
    force, figures = solver.force(path, -omega), steady_loop(solver, low, high).figures
    assert figures.energy_per_cycle == pytest.approx(np.trapezoid(force, path), rel=1e-5)  # the cusp of n = 0.22
    middle = np.trapezoid(force, np.concatenate([up, 2.0 * high - up[-2::-1]])) / (2.0 * (high - low))
    assert figures.mean_force == pytest.approx(middle, rel=1e-6)
    assert (figures.force_low, figures.force_high) == pytest.approx((force[-1], force[up.size - 1]), rel=1e-9)
    assert (figures.min_force, figures.max_force) == pytest.approx((force.min(), force.max()), rel=1e-6)


# -- of records


def test_a_loop_drawn_by_hand() -> None:
    # A parallelogram: 1000 N/m, 3 N up at once after the low and down at once after the high turning point.
    x = np.concatenate([np.linspace(-0.01, 0.01, 41), np.linspace(0.01, -0.01, 41)])
    r = 1000.0 * x + np.repeat([3.0, -3.0], 41)
    (loop,) = measured_loops([Record(np.tile(x, 2), np.tile(r, 2), path="hand")])
    figures = loop.figures
    assert (figures.low, figures.high, figures.amplitude) == (-0.01, 0.01, 0.01)
    assert (figures.force_low, figures.force_high) == pytest.approx((-13.0, 13.0))
    assert figures.secant_stiffness == pytest.approx(1300.0)
    assert figures.energy_per_cycle == pytest.approx(6.0 * 0.02)
    assert figures.loss_factor == pytest.approx(0.12 / (2.0 * math.pi * 0.5 * 1300.0 * 0.01**2))
    assert figures.mean_force == pytest.approx(0.0, abs=1e-12)
    assert (figures.min_force, figures.max_force) == pytest.approx((-13.0, 13.0))
    assert (loop.path, loop.cycles, loop.frequency, loop.spread) == ("hand", 1, None, None)
    for path in (np.tile([-1.0, -0.5, 0.0, 0.5, 1.0, 0.5, 0.0, -0.5], 4), np.array([0.0, 0.5, 1.0, 0.5, 0.0])):
        (flat,) = measured_loops([Record(path, 100.0 * path)])
        assert (flat.figures.energy_per_cycle, flat.gap) == (0.0, 0.0)
    # A drift of 1 N over one cycle from trough to trough leaves the loop open by it.
    turns = np.arange(401) / 400 + 0.75
    path = 0.01 * np.sin(2.0 * np.pi * turns)
    (opened,) = measured_loops([Record(path, 1000.0 * path + 3.0 * np.cos(2.0 * np.pi * turns) + turns)])
    assert opened.gap * opened.figures.height == pytest.approx(1.0, rel=1e-9)
    for path in (np.linspace(0.0, 1.0, 50), np.array([0.0, 1.0, 0.2, 0.6, 0.5, 0.5]), np.full(20, 0.3)):
        with pytest.raises(RecordError, match=r"short\.csv: no full cycle"):
            info(Spring(spring_of(1.0, 1.0)), Record(path, path, path="short.csv"))


@pytest.mark.parametrize(
    ("n", "sigma", "cycles", "samples", "noise", "rel"),
    [
        (0.22, 3.0, 6, 6001, 0.0, 2e-4),  # trapezoids and parabolas of 1000 samples a cycle
        (4.0, 8.0, 6, 6001, 0.0, 2e-4),
        # 3 % on a force of at most 120 N: the end of a parabola through 70 samples knows it to 3/sqrt(70)*3.6 N = 1.3 N
        # of a difference of 170 N, 0.8 %, over ten cycles 0.25 %; the trapezoidal sum of each cycle to about 0.3 %.
        (0.5, 1.5, 11, 11_001, 0.03, 0.01),
    ],
)
def test_a_record_has_the_figures_of_its_model(
    n: float, sigma: float, cycles: int, samples: int, noise: float, rel: float
) -> None:
    parameters = spring_of(n, sigma)
    (loop,) = measured_loops([record_of(parameters, sine(cycles, samples), noise, seed=3)])
    expected = loop_of(parameters, AMPLITUDE)
    assert (loop.figures.low, loop.figures.high) == pytest.approx((expected.low, expected.high), rel=1e-12)
    for name in ("secant_stiffness", "energy_per_cycle", *FIGURES[:: 1 if noise == 0.0 else 6]):
        assert getattr(loop.figures, name) == pytest.approx(getattr(expected, name), rel=rel), name
    # The first stroke, which starts from omega = 0 amid the range, and the last are no part of a cycle.
    assert loop.cycles == cycles - 1
    assert loop.spread.energy_per_cycle < (0.02 if noise else 1e-4) * expected.energy_per_cycle
    assert loop.spread.secant_stiffness < 0.02 * expected.secant_stiffness  # two single samples would scatter by 2.5 %


def test_amplitudes_within_three_percent_about_one_mean_are_one_group() -> None:
    parameters = spring_of(1.0, 1.0)
    path = np.concatenate([sine(4, 2001, amplitude)[:-1] for amplitude in (0.020, 0.01025, 0.010, 0.0101)])
    small, large = measured_loops([record_of(parameters, path)])
    assert large.figures.amplitude == pytest.approx(0.020, rel=1e-12)
    assert small.figures.amplitude == pytest.approx(0.0101, rel=0.01)
    assert (small.cycles, large.cycles) == (11, 3)
    expected = loop_of(parameters, small.figures.amplitude).energy_per_cycle
    assert small.figures.energy_per_cycle == pytest.approx(expected, rel=0.01)
    assert small.spread.energy_per_cycle > 0.002 * expected  # 10, 10.1 and 10.25 mm have different energies
    path = np.concatenate([sine(3, 901, 0.008) - 0.01, sine(3, 901, 0.008) + 0.01])
    loops = measured_loops([record_of(parameters, path)])
    assert sorted(round(loop.figures.low, 6) for loop in loops) == [0.032, 0.052]


# -- what loops tell together

FREQUENCIES = (0.13, 0.5, 2.12)  # the paper's range [Hz]
AMPLITUDES = (0.007, 0.013, 0.02)


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


def cycles_of(records: Iterable[Record]) -> list[Any]:
    return [cycle for record in records for cycle in find_cycles(record)]


@pytest.mark.parametrize(("samples", "cycles", "noise"), [(500, 4, 0.03), (60, 4, 0.03), (500, 2, 0.03), (500, 4, 0.0)])
def test_a_rate_independent_spring_is_recognised(samples: int, cycles: int, noise: float) -> None:
    rates = [(k, f, a) for k, f in enumerate(FREQUENCIES) for a in (0.013, 0.02)]
    for seed in range(0, 30, 10):
        comparison = rate_independence(cycles_of(
            measured(spring_of(0.5, 1.5), f, a, samples=samples, cycles=cycles, noise=noise, seed=seed + k, zero=k)
            for k, f, a in rates
        ))  # fmt: skip
        assert comparison.verdict is RateVerdict.INDEPENDENT
        assert comparison.amplitudes == 2
        assert comparison.frequencies == pytest.approx((0.13, 2.12))
        # 2*2*80 values or more make the ratio 1 within 30 %; clean records fall below the least noise assumed.
        assert noise == 0.0 or 0.7 < comparison.relative_to_noise < 1.4
        assert "0.13 to 2.12 Hz" in comparison.sentence


# Against a loop 46 N high; the fastest test moves at up to 0.27 m/s.
@pytest.mark.parametrize(("damper", "verdict"), [(10.0, RateVerdict.LITTLE), (100.0, RateVerdict.DEPENDENT)])
def test_a_damper_beside_the_spring_is_noticed(damper: float, verdict: RateVerdict) -> None:
    records = [measured(spring_of(0.5, 1.5), f, damper=damper, seed=k) for k, f in enumerate(FREQUENCIES)]
    assert rate_independence(cycles_of(records)).verdict is verdict


def test_the_reason_is_given_where_the_rate_is_unknown() -> None:
    parameters = spring_of(0.5, 1.5)
    without = rate_independence(cycles_of(replace(measured(parameters, f), time=None) for f in FREQUENCIES))
    assert without.sentence == RateVerdict.NO_TIMES.value
    # One frequency, the second within what a rig holds; or each amplitude at its own frequency.
    same = rate_independence(cycles_of(measured(parameters, f) for f in (1.0, 1.03)))
    apart = rate_independence(cycles_of(measured(parameters, f, a) for f, a in ((0.5, 0.01), (2.0, 0.02))))
    assert same.verdict is apart.verdict is RateVerdict.ONE_FREQUENCY
    assert rate_independence([]).verdict is RateVerdict.NO_TIMES
    # A first loading says nothing of the rate.
    rate, _ = campaign_verdicts([measured(parameters, f, cycles=c, noise=0.0) for f, c in ((0.13, 4), (1.0, 1))])
    assert rate.verdict is not RateVerdict.DEPENDENT


@pytest.mark.parametrize(("strokes", "verdict"), [(6.0, OverlapVerdict.OVERLAPPING), (0.3, OverlapVerdict.APART)])
def test_saturated_loading_paths_overlap_and_others_do_not(strokes: float, verdict: OverlapVerdict) -> None:
    parameters = spring_of(1.0, 1.0, strokes)
    model = loading_overlap([steady_loop(PathSolver(parameters), MEAN - a, MEAN + a) for a in AMPLITUDES])
    comparison = loading_overlap(cycles_of(measured(parameters, 1.0, a, seed=k) for k, a in enumerate(AMPLITUDES)))
    assert model.verdict is comparison.verdict is verdict
    assert comparison.amplitudes == 2
    # What the noise of 3 % adds to the distance is removed; 12 samples a cell leave 1 % of the loop's height.
    assert comparison.relative_to_height == pytest.approx(model.relative_to_height, abs=0.02)
    assert f"{comparison.distance:.3g} N" in comparison.sentence


def test_the_distance_of_loading_paths_in_closed_form_or_the_reason_why_there_is_none() -> None:
    # n = sigma = 1: omega = 1 - (1 + w)*exp(-rho*s), w = tanh(rho*L/2), on a linear spring with FA = 1.
    rho, kappa = 150.0, 10.0
    solver = PathSolver(SpringParameters((0.0, 1000.0), (1.0,), kappa, rho, 1.0, 1.0, 0.0, -0.02, 0.02))
    comparison = loading_overlap([steady_loop(solver, -a, a) for a in (0.01, 0.02)])
    x = np.linspace(0.0, 0.02 * 0.48, 400)
    small, large = (1.0 - (1.0 + np.tanh(rho * a)) * np.exp(-rho * (x + a)) for a in (0.01, 0.02))
    assert comparison.distance == pytest.approx(kappa * np.sqrt(np.mean((small - large) ** 2)), rel=0.01)  # 40 cells
    assert loading_overlap([]) is None
    assert loading_overlap([steady_loop(solver, -0.01, 0.01)]) is None
    apart = loading_overlap([steady_loop(solver, -0.02, -0.01), steady_loop(solver, 0.0, 0.02)])
    assert apart.sentence == OverlapVerdict.NO_SHARED_RANGE.value
    flat = spring_of(5.0, 0.5, 0.3)  # its loop is 0.06 N high under 3 % of noise on 90 N
    lost = loading_overlap(cycles_of(measured(flat, 1.0, a, seed=k) for k, a in enumerate(AMPLITUDES)))
    assert lost.verdict is OverlapVerdict.LOST_IN_NOISE
