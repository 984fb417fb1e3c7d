"""A planned programme within the limits of its rig, whatever the spring and the rig."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from branched_springs import SECOND
from springs import springs
from strandspring import Spring, SpringParameters, StrandspringError, plan
from strandspring.campaigns.planning.limits import Limits
from strandspring.campaigns.planning.motion import Leg, Motion, Pace, sampled
from strandspring.core.branches import MaxwellBranch


@st.composite
def wider_springs(draw: st.DrawFn) -> SpringParameters:
    """Any spring, with or without a second mechanism and up to two Maxwell branches of its size."""
    spring = draw(springs())
    half = 0.5 * (spring.displacement_max - spring.displacement_min)
    size = spring.kappa_omega * 10.0 ** draw(st.floats(-1.0, 0.5))
    constants = draw(st.lists(st.floats(-2.0, 2.0), max_size=2))
    second = replace(SECOND, kA=(1.0,), kappa_omega=size, rho=SECOND.rho * 0.02 / half)
    return replace(
        spring,
        second=second if draw(st.booleans()) else None,
        branches=tuple(MaxwellBranch(size / half, 10.0**constant) for constant in constants),
    )


@st.composite
def rigs(draw: st.DrawFn, spring: SpringParameters) -> dict[str, float]:
    """Limits of a rig that has to do with the size of the spring."""
    width = spring.displacement_max - spring.displacement_min
    low = spring.displacement_min + width * draw(st.floats(-0.2, 0.3))
    high = spring.displacement_max - width * draw(st.floats(-0.2, 0.3))
    return {
        "stroke": (low, high),
        "velocity": width * 10.0 ** draw(st.floats(-1.0, 1.5)),
        "duration": 10.0 ** draw(st.floats(0.5, 2.5)),
        "sample_rate": 10.0 ** draw(st.floats(1.0, 3.0)),
    }


@settings(max_examples=15)
@given(st.data())
def test_a_programme_keeps_to_all_limits(data: st.DataObject) -> None:
    spring = data.draw(wider_springs())
    rig = data.draw(rigs(spring))
    share = data.draw(st.floats(0.3, 3.0))
    solver = Spring(spring)
    whole = np.linspace(spring.displacement_min, spring.displacement_max, 201)
    there_and_back = np.concatenate([whole, whole[::-1]])
    force_limit = share * float(np.max(np.abs(solver.response(there_and_back, time=np.arange(there_and_back.size)))))
    try:
        test = plan(solver, force_limit=force_limit, **rig)
    except StrandspringError:
        assume(False)
        return
    time, displacement = test.program()
    low, high = rig["stroke"]
    slack = 1e-9 * (high - low)
    assert displacement.min() >= max(low, spring.displacement_min) - slack
    assert displacement.max() <= min(high, spring.displacement_max) + slack
    assert time[-1] <= rig["duration"] * (1.0 + 1e-9)
    assert np.diff(time) == pytest.approx(1.0 / rig["sample_rate"], rel=1e-6)
    # Mean velocities between samples are at most the largest one.
    velocity = np.diff(displacement) * rig["sample_rate"]
    rounding = np.finfo(np.float64).eps * np.abs(displacement).max() * rig["sample_rate"]
    assert np.abs(velocity).max() <= rig["velocity"] * (1.0 + 1e-6) + rounding
    assert np.abs(velocity).max() <= max(block.velocity for block in test.blocks) * (1.0 + 1e-6) + rounding
    # No jump of the velocity: between samples it changes by what the largest acceleration makes of it.
    most = test.as_json()["acceleration"] / rig["sample_rate"]
    assert np.abs(np.diff([0.0, *velocity, 0.0])).max() <= most * (1.0 + 1e-6) + 2.0 * rounding
    assert displacement[0] == pytest.approx(displacement[-1], abs=slack)
    assert displacement[0] == pytest.approx(0.5 * (displacement.min() + displacement.max()), abs=1e3 * slack)
    for begin, end in pairwise(_reversals(displacement)):
        assert end - begin >= 50  # 100 samples in a loop
    force = solver.response(displacement, time=time)
    assert np.abs(force).max() <= force_limit
    # What is printed holds the force of the spring along the programme.
    assert test.plan.force[0] <= force.min() + 1e-6 * force_limit
    assert test.plan.force[1] >= force.max() - 1e-6 * force_limit


def _reversals(path: np.ndarray) -> list[int]:
    """Samples at which the path turns."""
    moving = np.flatnonzero(np.diff(path))
    side = np.sign(np.diff(path)[moving])
    return [0, *(moving[1:][side[1:] != side[:-1]]).tolist(), path.size - 1]


@given(
    share=st.floats(1e-4, 1.0), velocity=st.floats(1e-3, 10.0), width=st.floats(1e-3, 1.0), rate=st.floats(10.0, 1e4)
)
def test_a_stroke_moves_as_it_says(share: float, velocity: float, width: float, rate: float) -> None:
    length = share * width
    leg = Pace.over(width, velocity, Limits(velocity, sample_rate=rate)).leg(0.0, length)
    time = np.linspace(0.0, leg.duration, 20_001)
    path = leg.at(time)
    assert path[0] == pytest.approx(0.0, abs=1e-12 * length)
    assert path[-1] == pytest.approx(length, rel=1e-12)
    assert np.all(np.diff(path) >= -1e-12 * length)
    speed = np.diff(path) / np.diff(time)
    assert speed.max() == pytest.approx(leg.velocity, rel=1e-6)  # differences over 1/20000 of the stroke
    assert leg.velocity <= velocity * (1.0 + 1e-12)
    acceleration = np.abs(np.diff(speed)) / np.diff(time)[1:]
    # Of a ramp of a tenth of the stroke or more, 2000 steps; rounded positions err by 2e-16*length/step^2.
    assert acceleration.max() == pytest.approx(leg.acceleration, rel=0.01)
    assert speed[[0, -1]] == pytest.approx(0.0, abs=2e-3 * leg.velocity)


def test_a_motion_goes_through_the_samples_of_its_legs() -> None:
    legs = [Leg(0.0, 0.01, 1.0, 0.2), Leg(0.01, 0.01, 0.5), Leg(0.01, -0.02, 3.0, 0.1)]
    motion = Motion.along(legs, 0.01)
    time, path = sampled(legs, 0.01)
    assert time.size == path.size == 451
    ends = [0.0, 1.0, 1.5, 4.5]
    assert np.interp(ends, time, path) == pytest.approx([0.0, 0.01, 0.01, -0.02])
    assert np.interp(ends, motion.time, motion.displacement) == pytest.approx([0.0, 0.01, 0.01, -0.02])
    assert motion.samples.sum() == pytest.approx(450.0)


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ({"velocity": 0.0}, "`velocity` must be > 0"),
        ({"velocity": float("nan")}, "`velocity` must be > 0"),
        ({"velocity": 0.1, "duration": -1.0}, "`duration` must be > 0"),
        ({"velocity": 0.1, "sample_rate": float("inf")}, "`sample_rate` must be > 0"),
        ({"velocity": 0.1, "force": 0.0}, "`force_limit` must be > 0"),
        ({"velocity": 0.1, "stroke": (0.02, -0.02)}, "`stroke` must be a lower and an upper end"),
        ({"velocity": 0.1, "stroke": (-1e12, 0.0)}, "`stroke` must be within"),
    ],
)
def test_impossible_limits_are_refused(limit: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Limits(**limit)
