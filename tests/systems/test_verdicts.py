"""Verdicts on candidates under load cases: what they follow from, ranges of unknowns, and mounts of a catalogue."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mounted_examples import CORNERS, box, unit
from oracles import OracleSpring
from strandspring import SpringParameters, simulate
from strandspring.examples.system_models import SYSTEMS
from strandspring.findings import Outcome
from strandspring.ground.strict_toml import parse_toml
from strandspring.kernel.path import PathSolver
from strandspring.loops.loop import steady_loop
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import MotionKind, Vector, scaled
from strandspring.vibration.bodies.rest import rest
from strandspring.vibration.bodies.simulation import run_case
from strandspring.vibration.description.named_files import FilesOfFolder, HeldFiles
from strandspring.vibration.description.system_file import read_description, system_of_content
from strandspring.vibration.signals.pulses import HalfSine
from strandspring.vibration.verdicts.answers import CaseAnswer, answer_case
from strandspring.vibration.verdicts.draws import ranges, tolerance_factor
from strandspring.vibration.verdicts.figures import CaseFigures
from strandspring.vibration.verdicts.verdicts import Limits

pytestmark = pytest.mark.long


def shaken(signal: Signal, direction: Vector = (1.0, 0.0, 0.0)) -> LoadCase:
    return LoadCase("case", "pulse", 0.3, (LoadChannel(ChannelKind.BASE_ACCELERATION, signal, direction),))


def answered(system: MountedSystem, case: LoadCase) -> tuple[CaseAnswer, bool]:
    """The answer, and whether it says that axes of a mount move together."""
    answer = answer_case("one", system, case, Limits())
    return answer, Outcome.SLIDING_TOGETHER in {finding.kind for finding in answer.findings}


def test_ranges_hold_what_omega_at_rest_and_friction_that_acts_together_leave_open() -> None:
    """Fewer than 5 % of draws of omega by axis are outside, of both systems, with 99 % confidence."""
    # Moving in a plane without turning visibly, so that a shock along x moves the axes along x only.
    heavy = ((1e3, 0.0, 0.0), (0.0, 1e3, 0.0), (0.0, 0.0, 1e3))
    system = replace(box(), bodies=(replace(box().bodies[0], inertia=heavy, motion=MotionKind.PLANE),))
    case = shaken(HalfSine(150.0, 0.011), unit(1.0, 1.0, 0.0))
    assert not answered(system, shaken(HalfSine(150.0, 0.011)))[1]
    answer, is_coupled = answered(system, case)
    known, low, high = (
        CaseFigures(system, case), *([getattr(figure, end) for figure in answer.figures] for end in ("low", "high"))
    )  # fmt: skip
    assert is_coupled
    generator, step, means = np.random.default_rng(3), answer.runs[0].step, []
    for one in (system, replace(system, coupled=True)):
        starts = [rest(one, omega=generator.uniform(-1.0, 1.0, len(one.axes))) for _ in range(60)]
        values = np.array([known.of_run(run_case(one, case, start, step)) for start in starts])
        assert np.mean((values < low) | (values > high), axis=0).max() <= 0.05
        means.append(values.mean(axis=0))
    assert means[1][0] < 0.995 * means[0][0]  # acceleration
    assert means[1][2] > 1.01 * means[0][2]  # sway
    # Odeh and Owen, one-sided factors for 95 % content and 99 % confidence.
    assert tolerance_factor(50, 49, 0.95) == pytest.approx(2.269, abs=2e-3)
    assert tolerance_factor(20, 19, 0.95) == pytest.approx(2.807, abs=2e-2)
    # A range from all combinations is theirs.
    values = np.array([[1.0], [2.0], [4.0]])
    assert [end.item() for end in ranges(values, [False] * 3, True)] == [1.0, 4.0]
    low, high = ranges(values, [False] * 3, False)
    assert low[0] < 1.0 < 4.0 < high[0]
    # Forces that are only rounding have no sign: the pose of a symmetric system would hang on the last digit.
    symmetric = replace(box(), bodies=(replace(box().bodies[0], inertia=((0.2, 0, 0), (0, 0.3, 0), (0, 0, 0.4))),))
    for share in (1.0, -1.0):
        assert (rest(symmetric, share).omega.reshape(len(CORNERS), 3) == share).all(axis=0)[1:].all()


# ---- limits that no case tests --------------------------------------------------------------------

ROUND = {"name": "round", "direction": "-x", "force": {"pulse": "half-sine", "peak": "15 kN", "duration": "4 ms"}}
HARD = ROUND | {"force": {"pulse": "half-sine", "peak": "30 kN", "duration": "4 ms"}}
SINE = {"name": "sine", "direction": "x", "sine": {"frequency": 8, "amplitude": "0.1 g", "duration": "2 s"}}
LEVELS = {"levels": [[5, "1000 g"], [50, "1000 g"]]}


@pytest.mark.parametrize(
    ("case", "limits", "of_case", "overall"),
    [
        (ROUND, ["three_sigma"], "no limits", "not tested"),
        (ROUND, ["rms_acceleration", "srs"], "pass", "not tested"),
        (SINE, ["srs"], "no limits", "not tested"),
        (SINE, ["rms_acceleration", "three_sigma"], "pass", "pass"),
        (ROUND, [], "no limits", "no limits"),
        (HARD, [], "outside", "outside"),
    ],
)
def test_only_limits_that_a_case_tests_are_kept(case: Any, limits: list[str], of_case: str, overall: str) -> None:
    wide = {name: LEVELS if name == "srs" else "1000 g" for name in limits}
    changes = {"case": [case], "units": {"length": "mm"}, "limits": wide}
    file = system_of_content(read_description(SYSTEMS / "gun_cradle.toml") | changes, FilesOfFolder(SYSTEMS))
    found = simulate(file, candidates="five springs", draws=16, workers=1)
    assert found.verdicts().to_numpy().tolist() == [[of_case, overall]]
    content, text = found.as_json(), found.summary()
    assert sorted(content["tested"]) == limits
    left = [kind for kind, names in content["tested"].items() if not names]
    assert ("is not tested" in text) == ("not tested: " in text) == bool(left)


# ---- mounts of a catalogue ------------------------------------------------------------------------

STATED = parse_toml(Path(__file__).with_name("catalogues.toml").read_text(encoding="utf-8"))
CURVES = STATED["curve"] | {"loss_factor": 0.3}, STATED["one_sided"] | {"loop_width": "30 N"}


def spring_of(catalogue: dict[str, Any]) -> SpringParameters:
    """That of one mount along z, which 8 kg compress by their weight."""
    types = {"rope": {"axes": [{"direction": "-z", "catalogue": catalogue}]}}
    file = system_of_content(STATED["body"] | {"mount_type": types}, HeldFiles({}, {}))
    return file.candidates[0][1].axes[0].spring


@pytest.mark.parametrize("row", STATED["loops"], ids=str)
def test_the_loop_at_the_stated_amplitude_is_the_stated_one(row: dict[str, Any]) -> None:
    """By the oracle's force, in the fifth loop; its work by the trapezoidal rule. Friction builds up over a fifth of
    the amplitude unless stated.
    """
    catalogue = STATED[row["of"]] | row["stated"]
    spring = spring_of(catalogue)
    about, amplitude = (1e-3 * float(catalogue.get(key, "0 mm").split()[0]) for key in ("about", "amplitude"))
    stroke = about - amplitude * np.cos(np.linspace(0.0, np.pi, 2001))
    loops = np.concatenate([np.tile(np.append(stroke[:-1], stroke[:0:-1]), 5), stroke[:1]])
    force = OracleSpring(spring.as_dict()).force(loops, 0.0)[-4001:]
    secant = (force[2000] - force[0]) / (2.0 * amplitude)
    loss = np.trapezoid(force, loops[-4001:]) / (math.pi * secant * amplitude**2)
    small = steady_loop(PathSolver(spring), -1e-8, 1e-8).figures.secant_stiffness
    found = {"secant": secant, "loss": loss, "width": force[1000] - force[3000], "small": small}
    for name, expected in row["has"].items():
        assert found[name] == pytest.approx(expected, rel=1e-4 if name == "small" else 1e-5), name
    if "small" not in row["has"]:
        assert (spring.n, spring.sigma, spring.rho) == (1.0, 0.5, pytest.approx(1.0 / (0.2 * amplitude), rel=1e-12))


@pytest.mark.parametrize("catalogue", CURVES, ids=["curve", "one-sided"])
def test_a_static_curve_is_met_and_a_tolerance_scales_forces(catalogue: dict[str, Any]) -> None:
    spring = spring_of(catalogue)
    solver, scaled_one = PathSolver(spring), PathSolver(scaled(spring, 1.1, 0.7))
    points = [("0 mm", "0 N"), *catalogue["curve"]]
    stated = [(1e-3 * float(x.split()[0]), float(force.split()[0])) for x, force in points]
    stated += [(-x, -force) for x, force in stated if "symmetric" in catalogue]
    deflections, forces = np.array(sorted(set(stated))).T
    middle, _, _ = solver.force_with_partials(deflections, np.zeros_like(deflections))
    np.testing.assert_allclose(middle, forces, rtol=1e-12, atol=1e-10)
    places = np.linspace(deflections[0], deflections[-1], 4001)
    assert (np.diff(solver.force_with_partials(places, np.zeros_like(places))[0]) > 0.0).all()
    assert (spring.displacement_min, spring.displacement_max) == (deflections[0], 0.02)
    for omega in (0.0, 1.0):
        elastic_force, force = (solver.force_with_partials(places, np.full(places.size, w))[0] for w in (0.0, omega))
        found = scaled_one.force_with_partials(places, np.full(places.size, omega))[0]
        expected = 1.1 * elastic_force + 0.7 * (force - elastic_force)
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-9)
