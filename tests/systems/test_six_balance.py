"""Harmonic balance of bodies on mounts: against one axis, in turned coordinates, and against motion in time."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from springs import MOUNT
from strandspring import SpringParameters
from strandspring.core.branches import MaxwellBranch, Mechanism
from strandspring.errors import MountedSystemError
from strandspring.vibration.bodies.loads import ChannelKind, LoadChannel, channel_rows
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import MotionKind, Mount, MountAxis, Point, RigidBody, Stops
from strandspring.vibration.bodies.shaken_system import ShakenSystem
from strandspring.vibration.bodies.shaking import Shaking
from strandspring.vibration.bodies.six_response import system_response
from strandspring.vibration.bodies.small_motion import Pose, SmallMotion
from strandspring.vibration.one_mass.continuation import follow
from strandspring.vibration.one_mass.harmonic_balance import linear_motion, mass_balance
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass, static_equilibrium

INERTIA = ((0.25, 0.02, 0.0), (0.02, 0.30, -0.01), (0.0, -0.01, 0.35))
STRAIGHT = SpringParameters((0.0, 9000.0), (1.0,), 20.0, 500.0, 1.0, 1.0, 0.0, -0.03, 0.03)


def inclined(seed: int = 3) -> MountedSystem:
    """A box on four inclined mounts that are not alike, under its weight."""
    rng = np.random.default_rng(seed)
    mounts = []
    for k, (sx, sy) in enumerate([(-1, -1), (-1, 1), (1, -1), (1, 1)]):
        directions = Rotation.random(random_state=rng).as_matrix()
        axes = tuple(
            MountAxis(STRAIGHT, tuple(n), 0.001 * k, parallel=1 + (k + i) % 2, damping=15.0)
            for i, n in enumerate(directions)
        )
        mounts.append(Mount(f"corner {k}", 0, (0.15 * sx, 0.1 * sy, -0.12 + 0.01 * k), axes))
    points = (Point("board", 0, (0.1, 0.0, 0.15)),)
    return MountedSystem((RigidBody("box", 20.0, (0.01, 0.0, 0.0), INERTIA),), tuple(mounts), points)


def two_stages() -> MountedSystem:
    """A mass in a plane on a stage that moves along an axis."""
    stage = RigidBody("stage", 8.0, motion=MotionKind.AXIS)
    engine = RigidBody("engine", 5.0, (0.0, 0.0, 0.1), INERTIA, MotionKind.PLANE, (0.0, 1.0, 0.0))
    up, across = MountAxis(STRAIGHT, (0.0, 0.0, 1.0), 0.0), MountAxis(STRAIGHT, (1.0, 0.0, 0.0), 0.0, damping=5.0)
    mounts = (
        Mount("below", 0, (0.0, 0.0, 0.0), (replace(up, parallel=3, damping=20.0),)),
        Mount("left", 1, (-0.1, 0.0, 0.05), (up, across), 0),
        Mount("right", 1, (0.1, 0.0, 0.05), (replace(up, parallel=2), across), 0),
    )
    return MountedSystem((stage, engine), mounts, (Point("top", 1, (0.0, 0.0, 0.3)),))


def branched() -> MountedSystem:
    """The inclined box with a second mechanism and branches in all of its springs."""
    branches = (MaxwellBranch(2e3, 0.01), MaxwellBranch(1e6, 2e-6))
    spring = replace(STRAIGHT, second=Mechanism((1.0, 5.0), 8.0, 1500.0, 0.9, 1.4), branches=branches)
    return inclined().with_springs(lambda _: spring)


def against_a_stop() -> MountedSystem:
    """A mass along one axis that meets a stop."""
    axis = MountAxis(STRAIGHT, (0.0, 0.0, 1.0), 0.0, damping=15.0, stops=Stops(-0.002, 0.02, 4e4))
    mass = RigidBody("mass", 2.5, motion=MotionKind.AXIS)
    foot = Mount("foot", 0, (0.0, 0.0, 0.0), (axis,))
    return MountedSystem((mass,), (foot,), (Point("top", 0, (0.0, 0.0, 0.3)),))


def rest(system: MountedSystem) -> tuple[Pose, np.ndarray]:
    """Static equilibrium with omega = 0, also as the kernel takes it."""
    omega = np.zeros(len(system.axes))
    pose, _, is_found = system.solver.rest(np.array(system.gravity), omega)
    assert is_found
    rotations = Rotation.from_quat(pose[:, 3:], scalar_first=True).as_matrix()
    return (pose[:, :3], rotations), pose


@pytest.mark.parametrize("damping", [0.0, 20.0])
@pytest.mark.parametrize(
    ("kind", "level"),
    [(Excitation.BASE_DISPLACEMENT, 5e-4), (Excitation.BASE_ACCELERATION, 1.0), (Excitation.FORCE, 5.0)],
)
def test_one_axis_is_an_isolated_mass(kind: Excitation, level: float, damping: float) -> None:
    mass = IsolatedMass(MOUNT, 5.0, 50.0, parallel=3, series=2, damping=damping)
    equilibrium = static_equilibrium(mass)
    axis = MountAxis(MOUNT, (0.0, 0.0, -1.0), 0.05, parallel=3, series=2, damping=damping)
    body = RigidBody("mass", 5.0, motion=MotionKind.AXIS)
    system = MountedSystem((body,), (Mount("foot", 0, (0.0, 0.0, 0.0), (axis,)),), gravity=(0.0, 0.0, -10.0))
    pose = (np.array([[0.0, 0.0, -2.0 * (equilibrium.displacement - 0.05)]]), np.eye(3)[None])
    band = np.geomspace(2.0, 40.0, 40)
    shaking = Shaking(kind, (0.0, 0.0, -1.0))
    one = frequency_response(mass, kind, level, band, samples=128)
    found = system_response(SmallMotion(system, pose), shaking, level, band)
    wanted = one.column("requested") > 0.0
    # Both stop where the equations are solved to 1e-10 of their largest term; a resonance magnifies that.
    tolerance = 3e-7
    of_force = kind is Excitation.FORCE
    ratio = -(found.base_force / found.level if of_force else found.gain[:, 0])[found.requested, 2]
    expected = one.column("transmissibility") * np.exp(1j * np.radians(one.column("phase")))
    assert ratio == pytest.approx(expected[wanted], rel=tolerance)
    assert np.abs(found.base_force[found.requested, 2]) == pytest.approx(one.column("force")[wanted], rel=tolerance)
    for name, values, within in (
        ("min", found.low[:, 0], tolerance),
        ("max", found.high[:, 0], tolerance),
        # The parabola's largest value against the largest of 128 samples, of a harmonic k off by (k*pi/128)^2/2.
        ("acceleration", found.acceleration[:, 0, 2], 4e-3),
    ):
        assert values[found.requested] == pytest.approx(one.column(name)[wanted], rel=within), name
    (resonance,) = found.resonances
    if not of_force:
        assert resonance.frequency == pytest.approx(one.resonance.frequency, rel=2e-3)  # spacing of the points there
        assert resonance.gain == pytest.approx(one.resonance.transmissibility, rel=1e-4)
        assert resonance.isolation_frequency == pytest.approx(one.resonance.isolation_frequency, rel=1e-3)

    # One more step of Newton's method leaves rounding.
    shaken = ShakenSystem(SmallMotion(system, pose), shaking, level)
    of_mass = mass_balance(mass, equilibrium, kind, level, samples=128)
    motions = []
    for balance, start in (
        (of_mass, partial(linear_motion, of_mass, np.array([equilibrium.stiffness]), np.zeros(1))),
        (shaken.balance, shaken.linear_motion),
    ):
        polished = []
        for motion in follow(balance, start, 2.0 * np.pi * band):
            if motion.wanted:
                here = balance.at(motion.z, motion.omega)
                polished.append(motion.z - np.linalg.solve(here.jacobian, here.residual))
        motions.append(np.array(polished)[:, 1:])
    sign = shaken.motion.along[0, 0]
    sizes = np.linalg.norm(motions[0], axis=1)
    assert np.linalg.norm(sign * motions[1] - motions[0], axis=1) / sizes == pytest.approx(0.0, abs=1e-8)


def turned(system: MountedSystem, rotation: Rotation) -> MountedSystem:
    """The same system in other coordinates."""

    def turn(vector: tuple[float, float, float]) -> tuple[float, float, float]:
        return tuple(rotation.apply(vector))  # type: ignore[return-value]

    matrix = rotation.as_matrix()
    bodies = tuple(
        replace(body, center=turn(body.center), inertia=tuple(map(tuple, matrix @ body.inertia @ matrix.T)))
        for body in system.bodies
    )
    mounts = tuple(
        replace(
            mount,
            place=turn(mount.place),
            axes=tuple(replace(axis, direction=turn(axis.direction)) for axis in mount.axes),
        )
        for mount in system.mounts
    )
    points = tuple(replace(point, place=turn(point.place)) for point in system.points)
    return MountedSystem(bodies, mounts, points, turn(system.gravity))


@pytest.mark.parametrize("about", [None, (0.3, 0.0, -0.2)])
def test_other_coordinates_change_nothing(about: tuple[float, float, float] | None) -> None:
    system, rotation = inclined(), Rotation.from_rotvec([0.5, -1.1, 0.7])
    (displacement, orientation), _ = rest(system)
    matrix = rotation.as_matrix()
    pose = (rotation.apply(displacement), matrix @ orientation @ matrix.T)
    direction, band, level = np.array([0.6, 0.0, 0.8]), np.geomspace(5.0, 20.0, 8), 3e-4
    shaking = Shaking(Excitation.BASE_DISPLACEMENT, tuple(direction), about)
    one = system_response(SmallMotion(system, (displacement, orientation)), shaking, level, band)
    there = None if about is None else tuple(rotation.apply(about))
    other_shaking = Shaking(Excitation.BASE_DISPLACEMENT, tuple(rotation.apply(direction)), there)
    other = system_response(SmallMotion(turned(system, rotation), pose), other_shaking, level, band)
    gain = one.gain[one.requested] @ matrix.T
    assert other.gain[other.requested] == pytest.approx(gain, rel=1e-6, abs=1e-7 * np.abs(gain).max())  # Newton's 1e-9
    assert other.low[other.requested] == pytest.approx(one.low[one.requested], abs=1e-9)


def in_time(
    system: MountedSystem, pose: np.ndarray, channel: LoadChannel, level: float, frequency: float, periods: int
) -> np.ndarray:
    """First harmonic of the points' accelerations after so many periods under level*cos or, of rates, -level*sin."""
    per_period, kept = 2000, 4
    angles = 2.0 * np.pi * np.arange(per_period * periods + 1) / per_period
    of_rate = channel.kind is ChannelKind.BASE_ANGULAR_VELOCITY
    integral = np.cos(angles) if of_rate else np.sin(angles)
    values = level * np.diff(integral)[None] * per_period / (2.0 * np.pi)
    count = len(system.axes)
    figures, histories = system.solver.run(
        channel_rows([channel], system.bodies),
        values,
        1.0 / frequency / per_period,
        np.array(system.gravity),
        pose,
        np.zeros(count),
        np.zeros(3),
        stride=1,
    )
    assert figures.steps == values.shape[1]
    last = histories.acceleration[-kept * per_period :]
    return np.einsum("tpk,t->pk", last, np.exp(-1j * angles[-kept * per_period :])) * 2.0 / len(last)


class _Unused:
    """The channels of these tests are driven by their averages."""

    def averages(self, step: float, count: int) -> np.ndarray:
        raise NotImplementedError


@pytest.mark.parametrize("frequency", [8.0, 13.0])
@pytest.mark.parametrize("case", ["acceleration", "rotation", "force", "stages", "stops", "branches"])
def test_motion_in_time(case: str, frequency: float) -> None:
    """Bodies with finite rotations, from rest until steady, in the compiled integrator."""
    direction = (0.0, 0.0, 1.0) if case == "stops" else (0.6, 0.0, 0.8)
    system = {"stages": two_stages, "stops": against_a_stop, "branches": branched}.get(case, inclined)()
    pose, quaternions = rest(system)
    circular = 2.0 * np.pi * frequency
    level = {"rotation": 1e-3, "force": 25.0}.get(case, 1.5)
    place = (0.05, -0.1, 0.1)
    if case == "rotation":
        shaking = Shaking(Excitation.BASE_DISPLACEMENT, direction, (0.0, 0.0, 0.0))
        channel, amplitude = LoadChannel(ChannelKind.BASE_ANGULAR_VELOCITY, _Unused(), direction), level * circular
    elif case == "force":
        shaking = Shaking(Excitation.FORCE, direction, place=place)
        channel, amplitude = LoadChannel(ChannelKind.FORCE, _Unused(), direction, place=place), level
    else:
        shaking = Shaking(Excitation.BASE_ACCELERATION, direction)
        channel, amplitude = LoadChannel(ChannelKind.BASE_ACCELERATION, _Unused(), direction), level
    found = system_response(SmallMotion(system, pose), shaking, level, [0.99 * frequency, frequency, 1.01 * frequency])
    at = int(np.flatnonzero(np.isclose(found.frequency, frequency))[0])
    # Acceleration over displacement is -Omega^2, and the base's acceleration is what excites.
    expected = level * found.gain[at, -1] * (-(circular**2) if case in ("rotation", "force") else 1.0)
    acceleration = in_time(system, quaternions, channel, amplitude, frequency, 120)[-1]
    if case == "stops":
        assert found.low[at].min() < -0.002
    assert np.abs(acceleration - expected).max() < 2e-4 * np.abs(expected).max()


def test_what_stands_still_keeps_its_tangent_stiffness() -> None:
    """A box that is symmetric moves along x and about y only, and its springs along y not at all."""
    axes = tuple(MountAxis(STRAIGHT, tuple(n), 0.0) for n in np.eye(3))
    places = [(0.15 * sx, 0.1 * sy, -0.12) for sx in (-1, 1) for sy in (-1, 1)]
    mounts = tuple(Mount(f"corner {k}", 0, place, axes) for k, place in enumerate(places))
    body = RigidBody("box", 20.0, inertia=((0.25, 0.0, 0.0), (0.0, 0.30, 0.0), (0.0, 0.0, 0.35)))
    system = MountedSystem((body,), mounts, gravity=(0.0, 0.0, 0.0))
    shaking = Shaking(Excitation.BASE_DISPLACEMENT, (1.0, 0.0, 0.0))
    found = system_response(SmallMotion.about_nominal(system), shaking, 3e-4, np.geomspace(3.0, 40.0, 40))
    assert np.abs(found.gain[:, 0, 0]).max() > 5.0
    assert np.abs(found.gain[:, 0, 1]).max() < 1e-8  # rounding; Newton's tolerance is 1e-9
    assert [(one.point, one.direction) for one in found.resonances] == [("box", "x")]


@pytest.mark.parametrize(
    ("level", "direction", "message"),
    [
        (0.01, (0.6, 0.0, 0.8), r"the springs of corner \d .* move from .* use a lower level"),
        (0.0, (1.0, 0.0, 0.0), r"`level` must be finite and > 0 \[m\], got 0.0"),
    ],
)
def test_refusals(level: float, direction: tuple[float, float, float], message: str) -> None:
    system = inclined()
    pose, _ = rest(system)
    shaking = Shaking(Excitation.BASE_DISPLACEMENT, direction)
    with pytest.raises(MountedSystemError, match=message):
        system_response(SmallMotion(system, pose), shaking, level, np.geomspace(3.0, 40.0, 40))


def test_an_excitation_that_moves_nothing() -> None:
    system = against_a_stop()
    pose, _ = rest(system)
    shaking = Shaking(Excitation.BASE_DISPLACEMENT, (1.0, 0.0, 0.0))
    with pytest.raises(MountedSystemError, match="base displacement along x moves nothing, because no body is free"):
        system_response(SmallMotion(system, pose), shaking, 1e-3, [3.0, 4.0])
    guided = RigidBody("mass", 2.5, motion=MotionKind.AXIS, direction=(0.6, 0.0, 0.8))
    motion = SmallMotion(replace(system, bodies=(guided,)), pose)
    with pytest.raises(MountedSystemError, match=r"along \(0.8, 0, -0.6\) moves nothing"):
        system_response(motion, replace(shaking, direction=(0.8, 0.0, -0.6)), 1e-3, [3.0, 4.0])
    with pytest.raises(MountedSystemError, match="must be a unit vector, got length 2"):
        Shaking(Excitation.FORCE, (0.0, 2.0, 0.0))
    with pytest.raises(MountedSystemError, match="not about an axis"):
        Shaking(Excitation.FORCE, (0.0, 1.0, 0.0), (0.0, 0.0, 0.0))
