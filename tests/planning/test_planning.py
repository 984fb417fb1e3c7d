"""What `plan` knows and chooses: within the limits of its rig, and whether the test decides what it promised."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from branched_springs import BRANCHED
from springs import EXAMPLES, springs
from strandspring import Record, Spring, StrandspringError, identify, plan
from strandspring.campaigns.planning.blocks import Range
from strandspring.campaigns.planning.forces import _THRESHOLDS, force_along
from strandspring.campaigns.planning.knowledge import Knowledge, Noise
from strandspring.campaigns.planning.motion import Leg, Motion
from strandspring.core.branches import MaxwellBranch
from strandspring.model.joint import JointCovariance
from synthetic import AMPLITUDE, MEAN, spring_of

pytestmark = pytest.mark.long

RIG: dict[str, Any] = {"velocity": 0.3, "duration": 40.0, "sample_rate": 200.0}
TRUE = spring_of(1.0, 1.2, strokes_in_steady=4.0)
SPAN = Range(0.05, 0.02)  # of the springs of EXAMPLES


# -- what is known


def motion(*shares: float) -> Motion:
    return Motion.along([Leg(SPAN.at(a), SPAN.at(b), 1.0, 0.2) for a, b in pairwise(shares)], 0.01)


@pytest.mark.parametrize("name", ["stranded_wire", "table", "both"])
def test_columns_are_derivatives_of_the_force_and_stops(name: str) -> None:
    spring, path = (EXAMPLES | BRANCHED)[name], motion(0.0, 0.9, -0.7, 0.3, -0.2, 0.8)
    force = force_along(spring, path, SPAN, 4.0)
    assert force.value == pytest.approx(Spring(spring).response(path.displacement, time=path.time), rel=1e-12)
    elastic = [0.02**-k for k in range(len(spring.kE))] or [1.0] * len(spring.FE_forces)
    of_second = [0.1 * 0.02**-k for k in range(1, len(spring.second.kA))] + [0.1] * 4 if spring.second else []
    further = [*of_second, *[0.1, 0.1] * len(spring.branches)]
    sizes = [*elastic, *further, *[0.1 * 0.02**-k for k in range(1, len(spring.kA))], *[0.1] * 4]
    count = force.own.shape[1]
    joint = JointCovariance(tuple(tuple(float(j == k) * sizes[k] for j in range(k + 1)) for k in range(count)))
    for k in range(count):
        step = 1e-4 * np.eye(count)[k]
        moved = [Spring(joint.moved(spring, (side * step).tolist())) for side in (1.0, -1.0)]
        ends = [end.response(path.displacement, time=path.time) for end in moved]
        difference = (ends[0] - ends[1]) / (2e-4 * sizes[k])
        # Differences of steps of 1e-5 of a logarithm: rounding of 1e-11 of the force, which is 100 times some columns.
        assert force.own[:, k] == pytest.approx(difference, rel=1e-5, abs=1e-6 * np.abs(force.own[:, k]).max())
    for k, share in enumerate(_THRESHOLDS):
        state = 0.0
        for step, column in zip(np.diff(path.displacement) / (SPAN.half * share), force.wider[1:, k], strict=True):
            state = min(max(state + step, -1.0), 1.0)
            assert column == pytest.approx(state, abs=1e-12)


def test_information_narrows_as_the_formula_says() -> None:
    spring, path, noise = (
        EXAMPLES["exponential"],
        motion(0.0, 1.0, -1.0, 0.0),
        Noise(0.5, relative=0.01, correlated=3.0),
    )
    force = force_along(spring, path, SPAN, 4.0)
    root = np.diag([1.0, 100.0, 1e3, 1e5, *[0.1 / 0.02**k for k in (1, 2, 3)], 0.3, 0.3, 0.3, 0.3])
    known = Knowledge.before(spring, noise, root, force, path, is_recorded=False, rates=True)
    after = known.after(*known.gained(path, force))
    _, deviations = after.deviations(np.zeros((1, len(known.root))), np.eye(len(root))[-4:])
    weights = noise.weights(path, force, is_own=True)
    weighted = weights[:, None] * force.own
    covariance = np.linalg.inv(np.linalg.inv(root @ root) + weighted.T @ weighted)
    assert deviations == pytest.approx(np.sqrt(np.diag(covariance))[-4:], rel=1e-6)
    # Points stand for samples: at most one independent one each, of three that are alike.
    independent = np.sum(weights**2 * (0.25 + (0.01 * force.value) ** 2))
    assert independent == pytest.approx(np.minimum(path.samples / 3.0, 1.0).sum())


# -- within the limits


@settings(max_examples=12)
@given(springs(), st.data())
def test_a_programme_keeps_to_all_limits(spring: Any, data: st.DataObject) -> None:
    low, high = spring.displacement_min, spring.displacement_max
    width, size = high - low, spring.kappa_omega / (high - low)
    constants = data.draw(st.lists(st.floats(-2.0, 2.0), max_size=2))
    spring = replace(spring, branches=tuple(MaxwellBranch(size, 10.0**constant) for constant in constants))
    stroke = low + width * data.draw(st.floats(-0.2, 0.3)), high - width * data.draw(st.floats(-0.2, 0.3))
    velocity, duration = width * 10.0 ** data.draw(st.floats(-1.0, 1.5)), 10.0 ** data.draw(st.floats(0.5, 2.5))
    rate, there = 10.0 ** data.draw(st.floats(1.0, 3.0)), np.linspace(low, high, 201)
    forces = Spring(spring).response(np.r_[there, there[::-1]], time=np.arange(402.0))
    limit = data.draw(st.floats(0.3, 3.0)) * float(np.abs(forces).max())
    try:
        test = plan(
            Spring(spring), stroke=stroke, velocity=velocity, duration=duration, sample_rate=rate, force_limit=limit
        )
    except StrandspringError:
        assume(False)
    time, path = test.program()
    slack, rounding = 1e-9 * (stroke[1] - stroke[0]), np.finfo(np.float64).eps * np.abs(path).max() * rate
    assert max(stroke[0], low) - slack <= path.min() <= path.max() <= min(stroke[1], high) + slack
    assert time[-1] <= duration * (1.0 + 1e-9)
    assert np.diff(time) == pytest.approx(1.0 / rate, rel=1e-6)
    # Mean velocities between samples are at most the largest one, which changes by the largest acceleration.
    speed = np.diff(path) * rate
    assert np.abs(speed).max() <= min(velocity, max(b.velocity for b in test.blocks)) * (1.0 + 1e-6) + rounding
    most = test.as_json()["acceleration"] / rate
    assert np.abs(np.diff([0.0, *speed, 0.0])).max() <= most * (1.0 + 1e-6) + 2.0 * rounding
    assert path[0] == pytest.approx(path[-1], abs=slack)
    assert path[0] == pytest.approx(0.5 * (path.min() + path.max()), abs=1e3 * slack)
    moving = np.flatnonzero(np.diff(path))
    turns = moving[1:][np.diff(np.sign(np.diff(path)[moving])) != 0]
    assert np.diff([0, *turns, path.size - 1]).min() >= 50  # 100 samples in a loop
    force = Spring(spring).response(path, time=time)
    assert np.abs(force).max() <= limit
    # What is printed holds the force of the spring along the programme.
    assert test.force[0] - 1e-6 * limit <= force.min() <= force.max() <= test.force[1] + 1e-6 * limit


# -- what is chosen


def sines(amplitude: float, frequency: float, seed: int) -> Record:
    time = np.arange(round(4.0 / frequency * 200.0)) / 200.0
    return recorded(MEAN + amplitude * np.sin(2.0 * np.pi * frequency * time), time, seed)


def recorded(path: np.ndarray, time: np.ndarray, seed: int) -> Record:
    force = Spring(TRUE).response(path)
    return Record(path, force + 0.3 * np.random.default_rng(seed).standard_normal(force.size), time, f"{seed}.csv")


@pytest.fixture(scope="module")
def first() -> Record:
    return sines(AMPLITUDE, 1.0, 1)


def test_one_amplitude_calls_for_small_loops_and_another_rate_and_decides_as_promised(first: Record) -> None:
    test = plan(first, **RIG)
    assert any(block.amplitude <= 0.5 * AMPLITUDE for block in test.blocks)
    assert any(block.block.kind in ("rate", "dwell") for block in test.blocks)
    assert test.blocks[0].amplitude == pytest.approx(AMPLITUDE, rel=0.02)
    decided = {f.of: (b, a) for f, b, a in zip(test.figures, test.before, test.after, strict=True)}
    assert decided["10 % loops"][0] > 0.2
    assert decided["10 % loops"][1] < 0.1
    assert np.all(test.after <= test.before * (1.0 + 1e-9))
    # As identified from both records, by an identification that knows of no plan.
    time, path = test.program()
    found = identify([first, recorded(path, time, 3)])
    for name in ("kappa_omega", "rho", "sigma", "n"):
        promised, value = decided[name][1], getattr(found.parameters, name)
        # The plan counts some 24 independent samples in a stroke, and fewer unknowns than the identification.
        assert 0.25 < promised / (1.96 * found.uncertainty[name] / value) < 4.0
        assert abs(value / getattr(TRUE, name) - 1.0) < 2.0 * promised  # 4 standard deviations
    rates = plan([first, sines(AMPLITUDE, 0.2, 2)], **RIG)
    assert {block.block.kind for block in rates.blocks} <= {"loops", "minor loops"}
    assert rates.speeds == ()


def test_limits_narrow_the_range_and_parts_of_a_spring_are_decided() -> None:
    free = plan(Spring(TRUE), **RIG)
    held = plan(Spring(TRUE), force_limit=0.7 * max(map(abs, free.force)), **RIG)
    assert np.ptp(held.program().displacement) < 0.95 * np.ptp(free.program().displacement)
    assert "force limit" in " ".join(held.notes)
    beyond = plan(Spring(TRUE), stroke=(MEAN - 2.0 * AMPLITUDE, MEAN + 0.5 * AMPLITUDE), **RIG)
    assert "stays within the range" in " ".join(beyond.notes)
    assert "assumed" in plan(Spring(TRUE)).notes[0]
    # Of branches and a second mechanism the test decides, too.
    known = plan(Spring(BRANCHED["both"]), velocity=0.2, duration=200.0)
    decided = {f.of: a / b for f, b, a in zip(known.figures, known.before, known.after, strict=True)}
    assert max(decided[name] for name in ("second.kappa_omega", "branches[1].stiffness")) < 0.4
