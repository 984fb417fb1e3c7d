"""Time integration in the compiled kernel against one tight ODE solver in an inertial frame, and against Exudyn."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import LSODA
from scipy.spatial.transform import Rotation

from exudyn_motion import exudyn_motion
from mounted_examples import (
    COMPRESSION,
    GRAVITY,
    NO_WEIGHT,
    UP,
    FloatArray,
    box,
    elastic,
    hysteretic,
    inclined_box,
    kernel_motion,
    one_mass,
    plane_box,
    three_axes,
    two_stages,
    unit,
)
from reference_motion import Course, ReferenceMotion, half_sine, reference_motion, sine, start_of
from strandspring.core.branches import MaxwellBranch, Mechanism
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import Mount, MountAxis, Point, RigidBody, Stops, Vector
from tools import slow_but

DURATION, EVERY = 0.05, 2e-3
TIMES = np.arange(0.0, DURATION + 0.5 * EVERY, EVERY)


def base(signal: Course, *direction: float) -> LoadChannel:
    return LoadChannel(ChannelKind.BASE_ACCELERATION, signal, unit(*direction))


SHOCK = base(half_sine(15.0 * GRAVITY, 0.011), 1.0, 2.0, 3.0)
ALONG = base(half_sine(20.0 * GRAVITY, 0.008), 0.0, 0.0, 1.0)
TURNING = LoadChannel(ChannelKind.BASE_ANGULAR_VELOCITY, sine(3.0, 7.0), unit(1.0, -2.0, 1.0))
AT_ONCE = LoadChannel(ChannelKind.BASE_ANGULAR_VELOCITY, sine(1.0, 7.0, 0.5 * math.pi), unit(1.0, -2.0, 1.0))
RECOIL = LoadChannel(ChannelKind.FORCE, half_sine(6000.0, 0.006), unit(1.0, 0.0, 0.3), 0, (0.05, 0.02, 0.1))
WEIGHT: Vector = (0.0, 0.0, -GRAVITY)


@dataclass(frozen=True)
class Comparison:
    """A system, what drives it, where omega is at rest, and whether the error falls with the step's square.

    Ends of identified ranges are corners of the force, at which the error depends on where a step falls.
    """

    system: MountedSystem
    channels: tuple[LoadChannel, ...] = ()
    omega: float = 0.0
    velocity: Vector = NO_WEIGHT
    weightless: bool = False
    has_corners: bool = False

    @property
    def case(self) -> LoadCase:
        return LoadCase("case", "pulse", DURATION, self.channels, velocity=self.velocity, weightless=self.weightless)


def alone(axis: MountAxis) -> MountedSystem:
    return one_mass(axis, 1.5, WEIGHT)


def branched() -> MountedSystem:
    """Springs with a second mechanism, branches from dashpots of less than a step to springs, both, or nothing."""
    second = Mechanism((1.0, 5.0), 40.0, 900.0, 0.9, 1.4)
    branches = (MaxwellBranch(4e3, 0.004), MaxwellBranch(1e6, 2e-6), MaxwellBranch(2e3, 5.0))
    kinds = ({"second": second}, {"branches": branches}, {"second": second, "branches": branches[:1]}, {})
    system, mounts = inclined_box(), []
    for kind, mount in zip(kinds, system.mounts, strict=True):
        axes = tuple(replace(axis, spring=replace(axis.spring, **kind)) for axis in mount.axes)
        mounts.append(replace(mount, axes=axes))
    return replace(system, mounts=tuple(mounts))


CASES = {
    "one mass": Comparison(alone(MountAxis(COMPRESSION, UP, 0.002, 2, 3, 5.0)), (ALONG,), 0.7),
    "stops": Comparison(
        alone(MountAxis(COMPRESSION, UP, 0.002, damping=5.0, stops=Stops(-0.010, 0.008, 1e5))), (ALONG,)
    ),
    "beyond the range": Comparison(
        alone(MountAxis(hysteretic(0.6, 60.0, 0.008), UP, 0.002)), (ALONG,), has_corners=True
    ),
    "plane": Comparison(plane_box(), (SHOCK,), 1.0),
    "inclined": Comparison(inclined_box(), (SHOCK,), -1.0),
    "drop": Comparison(inclined_box(), velocity=(1.0, 0.5, -2.0), weightless=True),
    "recoil": Comparison(box(), (RECOIL,)),
    "two stages": Comparison(two_stages(), (SHOCK,)),
    "base turns at once": Comparison(inclined_box(), (AT_ONCE,), has_corners=True),
    "friction acts together": Comparison(replace(inclined_box(), coupled=True), (SHOCK,), 0.5),
    "branches": Comparison(branched(), (SHOCK,), 0.4),
    "second mechanisms act together": Comparison(replace(branched(), coupled=True), (SHOCK,), 0.5),
    "base turns": Comparison(two_stages(), (TURNING, SHOCK, RECOIL), 0.3),
}  # fmt: skip


@cache
def solution(name: str) -> ReferenceMotion:
    one = CASES[name]
    return reference_motion(one.system, one.case, TIMES, omega=one.omega, rtol=1e-8)


def errors(name: str, step: float) -> FloatArray:
    """Of accelerations, displacements of springs, forces and energies absorbed, over the largest of each."""
    one, exact = CASES[name], solution(name)
    motion = kernel_motion(one.system, one.case, step, one.omega, EVERY)
    histories = motion.histories
    axes = one.system.axes
    displacements = [axis.nominal for axis in axes] + exact.stroke / [axis.series for axis in axes]
    corners = [corner for channel in one.channels for corner in channel.signal.corners]
    # A force from outside is known by its averages over steps: at its corners they leave it open.
    smooth = np.abs(TIMES[:, None] - corners).min(axis=1, initial=1.0) > 1e-9
    pairs = (
        (histories.acceleration[smooth], exact.acceleration[smooth]),
        (histories.displacement, displacements),
        (histories.force, exact.force),
        (motion.figures.of_axes[:, 5], exact.absorbed[-1]),
    )
    return np.array([np.abs(found - right).max() / np.abs(right).max() for found, right in pairs])


@pytest.mark.parametrize("name", slow_but(CASES, ("stops", "inclined", "two stages", "friction acts together")))
def test_motion_is_that_of_the_reference(name: str) -> None:
    """Within 1e-4 at 1e-4 s, and four times less at half the step where nothing has corners; accelerations within 1e-3,
    as their parts that follow a load at once are read from averages.
    """
    coarse, fine = errors(name, 1e-4), errors(name, 5e-5)
    assert (coarse < [1e-3, 1e-4, 1e-4, 1e-4]).all()
    assert (fine < [3e-4, 4e-5, 4e-5, 4e-5]).all()
    if not CASES[name].has_corners:
        np.testing.assert_allclose(coarse / fine, 4.0, rtol=0.1)


@pytest.mark.parametrize("name", CASES)
def test_energy_is_balanced(name: str) -> None:
    one = CASES[name]
    assert kernel_motion(one.system, one.case, 1e-4, one.omega).imbalance < (4e-5 if one.has_corners else 1e-5)


@pytest.mark.slow
def test_motion_is_that_of_lsoda() -> None:
    """Of another method of another order, six degrees of freedom on inclined hysteretic mounts under a shock."""
    one = CASES["inclined"]
    exact = reference_motion(one.system, one.case, TIMES, omega=one.omega, rtol=1e-8, method=LSODA)
    found = kernel_motion(one.system, one.case, 2e-5, one.omega, EVERY).histories
    np.testing.assert_allclose(found.acceleration, exact.acceleration, atol=1e-5 * np.abs(exact.acceleration).max())


def test_rest_is_that_of_the_reference() -> None:
    for name in ("inclined", "plane", "two stages"):
        one = CASES[name]
        axes = len(one.system.axes)
        for omega in (-1.0, 0.0, 1.0):
            pose = kernel_motion(one.system, LoadCase("rest", "pulse", 1e-3), 1e-4, omega).pose
            start = start_of(one.system, LoadCase("rest", "pulse", 1e-3), np.full(axes, omega))
            for b, body in enumerate(one.system.bodies):
                moving = start[13 * b : 13 * b + 13]
                np.testing.assert_allclose(pose[b, :3], moving[:3] - body.center, atol=1e-11)
                np.testing.assert_allclose(pose[b, 3:], moving[[9, 6, 7, 8]], atol=1e-10)


def test_body_held_across_its_axis_moves_with_the_base_there() -> None:
    """The absolute acceleration of a body that moves along z is the base's across z."""
    shock = base(half_sine(100.0, 0.01), 3.0, 0.0, 4.0)
    found = kernel_motion(alone(MountAxis(COMPRESSION, UP, 0.0)), LoadCase("c", "pulse", 0.01, (shock,)), 1e-4)
    assert found.figures.of_points[0, 2] == pytest.approx(60.0, rel=1e-3)  # largest |ax|


def test_largest_acceleration_under_a_force_that_ends_at_its_peak() -> None:
    """A terminal sawtooth of force on a mass: the peak is just before the end, where a(T) = (F - k z(T))/m."""
    peak, duration, stiffness = 900.0, 0.01, 3000.0
    sawtooth = Course(
        lambda t: peak * t / duration if t < duration else 0.0,
        lambda t: 0.5 * peak / duration * np.minimum(t, duration) ** 2,
        (duration,),
    )
    system = one_mass(MountAxis(elastic(0.0, stiffness), UP, 0.0), 1.5)
    case = LoadCase("recoil", "force", 0.03, (LoadChannel(ChannelKind.FORCE, sawtooth, UP),))
    circular = math.sqrt(stiffness / 1.5)
    # z = F/(k T) (t - sin(omega t)/omega), whose second derivative is F omega/(k T) sin(omega t).
    expected = peak * circular / (stiffness * duration) * math.sin(circular * duration)
    found = [abs(kernel_motion(system, case, h).figures.of_points[0, 0] - expected) for h in (1e-4, 5e-5)]
    assert found[0] < 1e-4 * expected
    assert found[0] / found[1] == pytest.approx(4.0, rel=0.2)


def test_free_rotation_keeps_momentum_and_energy() -> None:
    """A body without symmetry, far from its only spring, which is too weak to be felt: the momentum from the reaction
    to a force pulse stays, while its angular velocity goes round. Euler's equations in the reference say the same.
    """
    inertia = ((0.25, 0.01, 0.02), (0.01, 0.30, -0.015), (0.02, -0.015, 0.45))
    body = RigidBody("free", 2.0, inertia=inertia)
    mount = Mount("thread", 0, (0.0, 0.0, 0.0), (MountAxis(elastic(0.0, half=100.0), UP, 0.0),))
    system = MountedSystem((body,), (mount,), (Point("p", 0, (0.2, 0.1, 0.3)),), NO_WEIGHT)
    kick = LoadChannel(ChannelKind.FORCE, half_sine(300.0, 0.01), unit(0.0, 1.0, 0.1), 0, (0.3, 0.0, 0.2))
    case = LoadCase("kick", "force", 2.0, (kick,))
    times = np.linspace(0.0, 2.0, 41)
    exact = reference_motion(system, case, times, rtol=1e-11)
    late = times > 0.02
    assert np.ptp(exact.momentum[late, 0], axis=0).max() < 1e-9
    assert np.ptp(exact.kinetic[late, 0]) < 1e-9
    errors = []
    for step in (1e-3, 5e-4):
        found = kernel_motion(system, case, step, every=0.05)
        errors.append(np.abs(found.histories.acceleration[1:] - exact.acceleration[1:]).max())
        assert found.figures.energies[1] == pytest.approx(exact.kinetic[-1, 0], rel=1e-4)
        assert found.imbalance < 1e-7
    assert errors[0] < 1e-3 * np.abs(exact.acceleration).max()
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_motion_is_that_of_exudyn() -> None:
    """Six degrees of freedom on four mounts of three hysteretic springs under a half-sine: Runge and Kutta's method of
    fourth order, which does not stop where springs turn, is within 5e-6 of the reference at 1e-4 s.
    """
    system, case = box(three_axes(2, 1, 8.0)), LoadCase("half-sine", "pulse", 0.06, (SHOCK,))
    state = start_of(system, case, np.zeros(12))
    pose = np.concatenate([state[:3], Rotation.from_quat(state[6:10]).as_rotvec()])
    other = exudyn_motion(system, case, 5e-5, 0.0, pose, every=20)
    acceleration = kernel_motion(system, case, 2e-5, every=1e-3).histories.acceleration
    assert acceleration.shape == other.acceleration.shape
    assert np.abs(other.acceleration).max() > 4.0 * GRAVITY
    np.testing.assert_allclose(acceleration, other.acceleration, atol=1e-5 * np.abs(other.acceleration).max())
