"""Mounts of other classes: none is silently wrong, and what they add to a spring's force."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from strandspring import Outcome, RefinedOptions, identify
from strandspring.identification.methods.refined import KEEP
from strandspring.identification.points.sample_points import gather
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.identification.rig.corrected import Corrected
from strandspring.identification.rig.effect_columns import Effect, Rig
from strandspring.identification.rig.other_mounts import stop_operators
from strandspring.identification.search.search import search
from strandspring.identification.unrecorded.wider_class import unrecorded
from strandspring.loops.strokes import find_strokes
from synthetic import MEAN, record_of, sine, spring_of
from zoo_mounts import DRAWS
from zoo_rig import draw_case

sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))

from zoo import judged

CHANGING = ("degrading", "hardening", "pinching")  # from cycle to cycle, which no range of one loop can hold


@pytest.mark.slow
@pytest.mark.parametrize("name", DRAWS)
def test_no_mount_of_another_class_is_silently_wrong(name: str) -> None:
    """Cases of `python tests/benchmarks/zoo.py run`, one to three amplitudes, without and with a fault of the rig."""
    results = [judged(draw_case(name, 0, index)) for index in range(6)]
    springs = [result for result in results if not result.problem]
    assert len(springs) >= 5
    assert not any(result.energy_silent or result.minor_silent for result in springs)
    if name not in CHANGING:
        assert sum(not result.held for result in springs) <= 1


@pytest.mark.parametrize("name", ["maxwell rubber", "fractional rubber", "two mechanisms"])
def test_a_loop_of_one_amplitude_keeps_its_energy(name: str) -> None:
    """What looks like viscous force, a delay or a drift stays in the spring, and the range of small loops is wide."""
    (record,) = draw_case(name, 0, 0).records
    found = identify(record)
    assert not found.effects.keys() & {"viscosity", "delay"}
    (fit,) = found.fits
    assert fit.predicted_energy == pytest.approx(fit.energy, rel=0.05)
    assert found.small_loops.high > 2.0 * found.small_loops.low


def test_a_wider_class_that_does_not_explain_the_records_is_not_the_mounts() -> None:
    """Static and kinetic friction, for which a second mechanism is chosen."""
    found = identify(draw_case("chatter", 0, 4).records)
    assert found.parameters.second is not None
    assert "nested loops" in found.findings[Outcome.OTHER_MOUNT]


def test_stops_follow_the_path_within_their_thresholds() -> None:
    path = np.concatenate([np.linspace(0.0, 3.0, 31), np.linspace(3.0, -1.0, 41)[1:], np.linspace(-1.0, 0.5, 16)[1:]])
    strokes = find_strokes(path, 1e-6)
    loops = gather(strokes, np.zeros(path.size), 0)
    thresholds = np.array([0.25, 1.0])
    expected = np.zeros((path.size, 2))
    for k, moved in enumerate(np.diff(path)):
        expected[k + 1] = np.clip(expected[k] + moved, -thresholds, thresholds)
    np.testing.assert_allclose(stop_operators(loops, thresholds), expected, atol=1e-12)


def test_a_maxwell_element_follows_its_equation() -> None:
    """dr/dt = dx/dt - r/T along straight motion, here in ten thousand small steps."""
    record = record_of(spring_of(1.0, 1.0), sine(3, 300), noise=0.0)
    time = np.cumsum(np.random.default_rng(0).uniform(0.01, 0.2, len(record)))
    record = replace(record, time=time)
    rig = Rig.from_parts([find_steady_part(record)], None)
    constant, deflection = 0.7, 0.0
    expected = [0.0]
    for moved, step in zip(np.diff(record.displacement), np.diff(time), strict=True):
        for _ in range(200):
            deflection += moved / 200 - deflection * step / 200 / constant
        expected.append(deflection)
    found, _ = rig.courses[0].branch(constant)
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())  # of Euler's steps


def test_a_spring_of_the_own_class_is_no_wider_one() -> None:
    """With two amplitudes and little noise nested loops are known to a hundredth of the force."""
    path = np.concatenate([sine(3, 200), MEAN + 0.4 * (sine(3, 200) - MEAN)])
    rig = Rig.from_parts([find_steady_part(record_of(spring_of(1.0, 1.0), path, noise=0.01))], 100)
    wider = unrecorded(Corrected(search(rig.loops, (3, 1))[0], rig.loops, {}))
    assert wider.nested < 0.01
    assert wider.energies[0] < 1.0 < wider.energies[1]


def test_every_effect_can_be_kept() -> None:
    kept = {effect for name, effects in KEEP.items() if name != "all" for effect in effects}
    assert kept == set(KEEP["all"]) == set(Effect)
    assert RefinedOptions(keep=tuple(KEEP)).keep == tuple(KEEP)
