"""The mounts of the zoo are what they claim, and its integration of a spring agrees with the closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rig import draw_spring
from spring_oracle import OracleSpring
from strandspring import Spring
from tools import slow_but
from zoo_mounts import CALIBRATED, DRAWS, MaxwellRubber, draw_mount, plays
from zoo_rig import RIG_FAULTS, draw_case, draw_programme, recorded

RATE_DEPENDENT = ("maxwell rubber", "fractional rubber", "chatter")


@pytest.mark.parametrize("name", DRAWS)
def test_mounts_dissipate_as_drawn(name: str) -> None:
    for seed in range(4):
        generator = np.random.default_rng(seed)
        mount = draw_mount(name, generator, 0.5)
        phase = np.linspace(0.0, 3.0, 3 * CALIBRATED + 1)
        path = mount.centre + mount.amplitude * np.sin(2.0 * np.pi * phase)
        force = mount.force(path, 2.0 * phase)
        cycle = slice(-CALIBRATED - 1, None)
        energy = np.trapezoid(force[cycle], path[cycle])
        # The half height of the loop over the force's range; what is not elastic may widen the range.
        assert 0.02 < energy / (4.0 * mount.amplitude) / np.ptp(force) < 0.5
        assert 1e-3 <= mount.amplitude <= 50e-3


@pytest.mark.parametrize("name", [name for name in DRAWS if name not in RATE_DEPENDENT])
def test_others_do_not_depend_on_the_rate(name: str) -> None:
    mount = draw_mount(name, np.random.default_rng(3), 0.5)
    phase = np.linspace(0.0, 2.0, 801)
    path = mount.centre + mount.amplitude * np.sin(2.0 * np.pi * phase)
    np.testing.assert_array_equal(mount.force(path, phase), mount.force(path, 100.0 * phase))


def test_plays_follow_at_their_radius() -> None:
    path = np.array([0.0, 0.3, 1.0, 0.9, 0.2, -1.0, -0.9])
    np.testing.assert_allclose(plays(path, np.array([0.25]))[:, 0], [0.0, 0.05, 0.75, 0.75, 0.45, -0.75, -0.75])


def test_a_maxwell_branch_has_the_loss_of_the_textbook() -> None:
    stiffness, relaxation = 2.0, 0.3
    mount = MaxwellRubber(half_way=0.1, rubbing=0.0, branches=((stiffness, relaxation),))
    time = np.linspace(0.0, 10.0, 20_001)
    path = np.sin(2.0 * np.pi * time)
    force = mount.force(path, time)
    turned = 2.0 * np.pi * relaxation
    energy = np.trapezoid(force[-2001:], path[-2001:])
    assert energy == pytest.approx(np.pi * stiffness * turned / (1.0 + turned**2), rel=1e-5)  # trapezoids


@pytest.mark.parametrize("fault", ["", *RIG_FAULTS])
def test_the_truth_goes_along_with_the_samples(fault: str) -> None:
    generator = np.random.default_rng(5)
    mount = draw_mount("iwan", generator, 0.5)
    experiment = replace(draw_programme(generator, 3, 0.5), separate=False)
    case = recorded("iwan", mount, experiment, generator, fault)
    for record, (path, force, cycle) in zip(case.records, case.clean, strict=True):
        assert len(record) == path.size
        # Small faults: what is recorded is near to what is true.
        assert np.std(record.displacement - path) < 0.02 * np.std(path)
        assert np.std(record.force - force) < 0.1 * case.scale
        assert np.all(np.diff(cycle) >= 0.0)


def test_cases_repeat() -> None:
    first, again = (draw_case("maxwell rubber", 1, 4) for _ in range(2))
    np.testing.assert_array_equal(first.records[0].force, again.records[0].force)
    assert first.fault == again.fault != ""


@pytest.mark.parametrize("seed", slow_but(range(8), range(3)))
def test_the_oracle_agrees_with_the_closed_form(seed: int) -> None:
    generator = np.random.default_rng([7, seed])
    parameters = draw_spring(generator)
    amplitude = 0.5 * (parameters.displacement_max - parameters.displacement_min)
    phase = np.linspace(0.0, 6.0 * np.pi, 900)
    # Minor loops and rests, beyond the range, with a sensor's noise.
    path = amplitude * (0.7 * np.sin(phase) + 0.5 * np.sin(4.6 * phase)).clip(-1.05, 1.0)
    path += parameters.displacement_offset + 0.002 * amplitude * generator.standard_normal(path.size)
    path[100:120] = path[100]
    start = generator.uniform(-1.0, 1.0)
    expected = Spring(parameters).response(path, start)
    force = OracleSpring(parameters.as_dict()).force(path, start)
    np.testing.assert_allclose(force, expected, rtol=0.0, atol=2e-6 * parameters.kappa_omega)  # the solver's
