"""What the records decide of the energy of small loops, and the energy itself."""

from __future__ import annotations

import re
import zlib
from dataclasses import replace

import numpy as np
import pytest

from judgement import judge_case
from mounts_with_branches import FIRST, SECOND, maxwell, sines
from rig import Experiment, draw_experiment, draw_spring, simulate
from rig_faults import FAULTS
from strandspring import Outcome, Spring, identify
from strandspring.core.branches import MaxwellBranch, Mechanism
from strandspring.identification.certainty.saved_spring import LoopEnergy
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.identification.rig.corrected import Corrected
from strandspring.identification.rig.effect_columns import Effect, Rig, Sizes
from strandspring.identification.search.search import Candidate, search
from strandspring.identification.unrecorded.small_loops import (
    AMPLITUDE,
    loop_energy,
    one_amplitude_doubts,
    rival_springs,
    small_loops,
    undecided_energy,
)
from synthetic import AMPLITUDE as AMPLITUDE_RECORDED
from synthetic import record_of, sine, spring_of


@pytest.mark.parametrize(("n", "sigma"), [(0.3, 3.0), (1.0, 1.0), (4.0, 0.6)])
def test_the_energy_is_the_work_absorbed_in_a_steady_loop(n: float, sigma: float) -> None:
    known = spring_of(n, sigma)
    phase = np.linspace(0.0, 8.0 * np.pi, 40_001)
    half = 0.5 * (known.displacement_max - known.displacement_min)
    work = Spring(known).absorbed_energy(known.displacement_offset + AMPLITUDE * half * np.sin(phase))
    # The elastic part returns what it takes. A small loop that hardly saturates is not quite steady in its third cycle.
    assert loop_energy(known) == pytest.approx(work[-1] - work[30_000], rel=5e-3)


def test_a_second_mechanism_and_branches_take_energy_too() -> None:
    half, period, samples = 0.5 * (FIRST.displacement_max - FIRST.displacement_min), 0.7, 4000
    time, path = sines((AMPLITUDE * half,), 1.0 / period, cycles=8, samples=samples)
    last = slice(-samples - 1, None)
    branch = MaxwellBranch(1500.0, 0.08)
    force = Spring(FIRST).response(path) + Spring(SECOND).response(path) + maxwell(time, path, 1500.0, 0.08)
    spring = replace(FIRST, second=Mechanism((1.0,), 12.0, 3000.0, 0.7, 1.5), branches=(branch,))
    # A small loop that hardly saturates is not quite steady in its eighth cycle.
    assert loop_energy(spring, period) == pytest.approx(np.trapezoid(force[last], path[last]), rel=5e-3)
    alone = np.pi * (AMPLITUDE * half) ** 2 * 1500.0 * 0.718 / (1.0 + 0.718**2)  # 2 pi 0.08/0.7 = 0.718
    assert loop_energy(spring, period) - loop_energy(spring) == pytest.approx(alone, rel=1e-3)


def test_a_well_determined_spring_has_no_caution() -> None:
    for seed in range(3):
        generator = np.random.default_rng(seed)
        spring = draw_spring(generator, (0.5, 2.0), (0.8, 2.0), (8.0, 20.0), (0.2, 0.4))
        case = simulate(spring, Experiment(amplitudes=(0.3, 0.6, 1.0), samples=1500, noise=0.003), generator)
        assert Outcome.SMALL_LOOPS not in identify(case.records).outcomes


def test_few_noisy_samples_of_one_amplitude_leave_it_undecided() -> None:
    found = identify(record_of(spring_of(0.4, 2.0), sine(3, 90), noise=0.03))
    assert Outcome.SMALL_LOOPS in found.outcomes
    assert "30 % of the amplitude" in found.findings[Outcome.SMALL_LOOPS]


def minima(n: float, criterion: float) -> list[Candidate]:
    """A fit, and another one with a worse criterion."""
    loops = Rig.from_parts([find_steady_part(record_of(spring_of(1.0, 1.0), sine(), noise=0.01))], 160).loops
    best = search(loops)[0]
    refinement = replace(best.refinement, hysteresis=replace(best.refinement.hysteresis, n=n))
    return [best, replace(best, refinement=refinement, criterion=best.criterion + criterion)]


def test_another_minimum_that_fits_as_well_is_named() -> None:
    spring = identify(record_of(spring_of(1.0, 1.0), sine(), noise=0.01)).parameters
    assert undecided_energy(spring, {}, rival_springs([minima(8.0, 20.0)]), 0.02) == ""  # fits worse
    assert undecided_energy(spring, {}, rival_springs([minima(spring.n, 1.0)]), 0.02) == ""  # is the same
    text = undecided_energy(spring, {}, rival_springs([minima(8.0, 1.0)]), 0.02)
    assert "; the next one has n 8, " in text
    assert text.startswith(f"at 30 % of the amplitude {loop_energy(spring):.3g} J a cycle, equally good fits ")


def test_energies_of_other_fits_are_a_range_only_where_they_differ() -> None:
    spring = identify(record_of(spring_of(1.0, 1.0), sine(), noise=0.01)).parameters
    best, other = minima(8.0, 1.0)
    alike = replace(other, criterion=other.criterion + 0.1)
    text = undecided_energy(spring, {}, rival_springs([[best, other, alike]]), 0.02).partition(";")[0]
    assert re.fullmatch(r".* a cycle, equally good fits [\d.]+ J", text)
    third = minima(0.2, 1.0)[1]
    text = undecided_energy(spring, {}, rival_springs([[best, other, third]]), 0.02).partition(";")[0]
    assert re.fullmatch(r".* a cycle, equally good fits [\d.]+ to [\d.]+ J", text)


def test_fits_without_small_loops_have_no_energy_and_differ_by_nothing() -> None:
    """Small strokes of these do not reach the knee: what they dissipate is rounding."""
    best = minima(1.0, 0.0)[0]
    amplitude = AMPLITUDE_RECORDED
    hysteresis = replace(best.refinement.hysteresis, rho=1.5 / amplitude, sigma=0.5, n=40.0)
    elastic = replace(best, refinement=replace(best.refinement, hysteresis=hysteresis))
    more = replace(elastic, refinement=replace(best.refinement, hysteresis=replace(hysteresis, n=30.0)))
    spring = spring_of(1.0, 1.0)
    text = undecided_energy(spring, {}, rival_springs([[best, elastic, more]]), 0.02)
    assert f"{loop_energy(spring):.3g} J a cycle, equally good fits no energy; the next" in text
    void = replace(spring, rho=1.5 / amplitude, sigma=0.5, n=40.0)
    assert loop_energy(void) < 1e-6 * loop_energy(spring)
    assert undecided_energy(void, {}, rival_springs([[elastic, more]]), 0.02, misfit=1e-4) == ""


def test_misfit_that_is_large_beside_the_small_loops_is_reported() -> None:
    spring = spring_of(1.0, 1.0)
    half_height = loop_energy(spring) / (2.0 * AMPLITUDE * (spring.displacement_max - spring.displacement_min))
    assert "mean half height of the loops at 30 %" in undecided_energy(spring, {}, [], 0.02, misfit=0.2 * half_height)
    assert undecided_energy(spring, {}, [], 0.02, misfit=0.01 * half_height) == ""
    # Of loops of hardly any height the share says nothing.
    far = undecided_energy(spring, {}, [], 0.02, misfit=1e6 * half_height)
    assert "more than 10 times the mean half height" in far


@pytest.mark.parametrize(
    ("smallest", "advice"),
    [
        (0.0199, "one amplitude does not tell FE from the loop: record loops of about 6 mm too"),
        (0.012, "the smallest loops recorded have 12 mm: record some of about 6 mm too"),
        (0.006, "loops of 6 mm were recorded: record more cycles of them, or with less noise"),
    ],
)
def test_the_advice_depends_on_the_smallest_loops_recorded(smallest: float, advice: str) -> None:
    assert f"; {advice}" in undecided_energy(spring_of(1.0, 1.0), {}, rival_springs([minima(0.2, 1.0)]), smallest)


def test_the_shortest_stroke_is_that_of_the_smallest_loops() -> None:
    path = np.concatenate([sine(2, 200, AMPLITUDE_RECORDED * share) for share in (0.3, 1.0)])
    loops = find_steady_part(record_of(spring_of(1.0, 1.0), path)).loops
    assert loops.shortest == pytest.approx(0.6 * AMPLITUDE_RECORDED, rel=1e-3)
    assert loops.longest == pytest.approx(2.0 * AMPLITUDE_RECORDED, rel=1e-3)
    loops = find_steady_part(record_of(spring_of(1.0, 1.0), sine(3))).loops
    assert loops.shortest == pytest.approx(loops.longest, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "shape"), [(11, "bump stop"), (21, "tanh"), (24, "tanh")])
def test_a_table_does_not_take_over_the_loop_of_a_single_amplitude(seed: int, shape: str) -> None:
    """A table fitted from the minimum of the polynomials alone errs by 23, 35 and 80 % here."""
    generator = np.random.default_rng([0, seed])
    spring = draw_spring(generator)
    experiment = draw_experiment(generator, amplitudes=(1.0,), cycles=(3,))
    case = simulate(spring, experiment, generator, FAULTS[shape], "drawn")
    found = identify(case.records)
    assert found.degrees[0] is None
    assert abs(judge_case(case, found.spring()).energy) < 0.05


@pytest.mark.parametrize(
    ("fault", "seed", "repetition", "reason"),
    [
        (
            "play",
            12,
            2,
            "is little known, since n ended at its bound and sigma ended at its bound",
        ),
        ("viscous damper", 25, 0, "is little known, since sigma is known on one side only"),
        ("low-pass on the force", 11, 0, "there is a trace of a delay: the force lags by"),
    ],
)
def test_what_one_amplitude_does_not_show_leaves_it_undecided(
    fault: str, seed: int, repetition: int, reason: str
) -> None:
    generator = np.random.default_rng([seed, zlib.crc32(fault.encode()), repetition])
    case = simulate(draw_spring(generator), draw_experiment(generator), generator, FAULTS[fault], "drawn")
    found = identify(case.records)
    assert judge_case(case, found.spring()).wrong
    assert reason in found.findings[Outcome.SMALL_LOOPS]


@pytest.mark.parametrize(
    ("fault", "seed", "repetition"),
    [
        ("viscous damper", 8, 0),
        ("low-pass on the force", 7, 2),
        ("force lags", 8, 1),
        ("Stribeck friction", 9, 1),
        ("Maxwell element", 10, 2),
        ("Maxwell element", 35, 2),
    ],
)
def test_an_effect_that_is_hardly_shown_is_taken_out_or_leaves_it_undecided(
    fault: str, seed: int, repetition: int
) -> None:
    generator = np.random.default_rng([seed, zlib.crc32(fault.encode()), repetition])
    case = simulate(draw_spring(generator), draw_experiment(generator), generator, FAULTS[fault], "drawn")
    found = identify(case.records)
    assert Outcome.SMALL_LOOPS in found.outcomes or not judge_case(case, found.spring()).wrong


def test_what_is_much_like_part_of_a_loop_leaves_it_undecided() -> None:
    known = {"n": [1.0, 2.0], "sigma": [1.0, 2.0]}
    size = np.array([1.0])
    rig = Rig.from_parts([find_steady_part(record_of(spring_of(1.0, 1.0), sine(), noise=0.01))], 160)
    plain = Corrected(search(rig.loops)[0], rig.loops, {})

    def doubts(sizes: Sizes) -> list[str]:
        return one_amplitude_doubts(rig, replace(plain, sizes=sizes), [], known)

    (doubt,) = doubts({Effect.DELAY: size, Effect.VISCOSITY: size})
    assert doubt == "at one amplitude a delay and viscous damping can hardly be distinguished from part of the loop"
    (doubt,) = doubts({Effect.CURVED_DRIFT: np.ones(3)})
    assert doubt.startswith("at one amplitude the relaxation that a curved drift may come from can hardly")
    assert doubts({Effect.DRIFT: size}) == []


def test_the_range_of_small_loops_holds_what_no_class_can_leave() -> None:
    """One loop of 2 J at 20 mm: those of 6 mm take 0.06 to 0.36 of it by the powers, and 7 % more or less."""
    spring = replace(spring_of(1.0, 1.0), displacement_min=0.03, displacement_max=0.07)
    own = loop_energy(spring)
    found = small_loops(spring, {}, [LoopEnergy(0.02, 2.0, 2.0, 0.0, 0.0, 0.0)])
    assert found.energy == pytest.approx(own)
    assert found.low == pytest.approx(min(0.93 * 2.0 * 0.3**2.34, own))
    assert found.high == pytest.approx(max(1.07 * 2.0 * 0.3**0.85, own))
    # A second amplitude shows the power; other energies that are possible widen the range.
    two = small_loops(
        spring, {}, [LoopEnergy(0.02, 2.0, 2.0, 0.0, 0.0, 0.0), LoopEnergy(0.01, 0.8, 0.8, 0.0, 0.0, 0.0)]
    )
    power = np.log(2.0 / 0.8) / np.log(2.0)
    assert two.low == pytest.approx(min(0.93 * 0.8 * 0.6 ** (power + 1.3), own))
    assert two.high == pytest.approx(max(1.07 * 0.8 * 0.6 ** (power - 0.2), own))
    assert small_loops(spring, {}, [], [3.0 * own]).high == pytest.approx(3.0 * own)
