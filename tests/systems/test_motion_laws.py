"""What holds for the motion of any bodies on any mounts, for systems and loads that hypothesis draws."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from mounted_examples import (
    COMPRESSION,
    GRAVITY,
    ROLL,
    SHEAR,
    UP,
    FloatArray,
    KernelMotion,
    kernel_motion,
    two_stages,
    unit,
)
from strandspring import SpringParameters
from strandspring.vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel, Signal
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import MotionKind, Mount, MountAxis, RigidBody, Stops, Vector
from strandspring.vibration.signals.pulses import CORNERS, HalfSine, StraightPulse

SAWTOOTH = CORNERS["terminal-sawtooth"]
LAW = settings(deadline=None, max_examples=40, phases=[Phase.generate])
STEP, DURATION = 1e-4, 0.04
SHARE = st.floats(-1.0, 1.0)


@dataclass(frozen=True)
class Drawn:
    """A system, a load case and omega of all springs at rest."""

    system: MountedSystem
    case: LoadCase
    omega: float

    def motion(self) -> KernelMotion:
        return kernel_motion(self.system, self.case, STEP, self.omega)


def vector(*components: float) -> Vector:
    x, y, z = components
    return float(x), float(y), float(z)


def turned(R: FloatArray, v: Vector) -> Vector:
    return vector(*(R @ np.array(v)))


def rotations() -> st.SearchStrategy[FloatArray]:
    return st.tuples(*[st.floats(-3.0, 3.0)] * 3).map(lambda v: Rotation.from_rotvec(v).as_matrix())


def directions() -> st.SearchStrategy[Vector]:
    return rotations().map(lambda R: unit(*R[:, 0]))


@st.composite
def mount_axes(draw: st.DrawFn, springs: tuple[SpringParameters, ...]) -> tuple[MountAxis, ...]:
    """Three axes that lean any way."""
    parallel, series = draw(st.integers(1, 3)), draw(st.integers(1, 2))
    damping = draw(st.sampled_from([0.0, 15.0]))
    stops = draw(st.sampled_from([None, Stops(-0.009, 0.007, 5e4)]))
    columns = draw(rotations()).T
    return tuple(
        MountAxis(spring, unit(*column), 0.0, parallel, series, damping, stops)
        for spring, column in zip(springs, columns, strict=True)
    )


@st.composite
def cases(draw: st.DrawFn) -> LoadCase:
    """A shock of the base, which may turn, a recoil, and a throw."""
    peak = GRAVITY * draw(st.floats(2.0, 20.0))
    shock: Signal = draw(st.sampled_from([HalfSine(peak, 0.011), StraightPulse(peak, 0.008, SAWTOOTH)]))
    channels = [LoadChannel(ChannelKind.BASE_ACCELERATION, shock, draw(directions()))]
    if draw(st.booleans()):
        channels.append(LoadChannel(ChannelKind.BASE_ANGULAR_VELOCITY, HalfSine(2.0, 0.03), draw(directions())))
    if draw(st.booleans()):
        channels.append(
            LoadChannel(
                ChannelKind.FORCE,
                StraightPulse(3000.0, 0.006, SAWTOOTH),
                draw(directions()),
                0,
                (0.05, 0.02, 0.1),
            )
        )
    velocity = vector(*(draw(st.sampled_from([0.0, 0.7])) * np.array(draw(directions()))))
    return LoadCase("drawn", "pulse", DURATION, tuple(channels), velocity=velocity)


@st.composite
def drawn(draw: st.DrawFn) -> Drawn:
    """A body on four mounts, on the base or on a frame that stands on four more."""
    system = two_stages()
    upper = tuple(
        replace(
            mount,
            place=vector(*(mount.place + 0.05 * np.array(draw(directions())))),
            axes=draw(mount_axes((COMPRESSION, SHEAR, ROLL))),
        )
        for mount in system.mounts[:4]
    )
    if draw(st.booleans()):
        system = replace(system, mounts=(*upper, *system.mounts[4:]))
    else:
        on_base = tuple(replace(mount, support=-1) for mount in upper)
        system = replace(system, bodies=system.bodies[:1], mounts=on_base, points=system.points[:2])
    return Drawn(system, draw(cases()), draw(SHARE))


def assert_same(found: FloatArray | None, expected: FloatArray | None, within: float) -> None:
    """Within a share of the largest."""
    assert found is not None
    assert expected is not None
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=within * np.abs(expected).max())


# ---- symmetries ----------------------------------------------------------------------------------


def rotated(one: Drawn, R: FloatArray) -> Drawn:
    """With all places, directions, moments of inertia, weights and loads rotated about the origin."""
    system, case = one.system, one.case

    def of_axis(axis: MountAxis) -> MountAxis:
        return replace(axis, direction=unit(*turned(R, axis.direction)))

    bodies = []
    for body in system.bodies:
        first, second, third = (R @ np.array(body.inertia) @ R.T).tolist()
        inertia = (vector(*first), vector(*second), vector(*third))
        bodies.append(replace(body, center=turned(R, body.center), inertia=inertia))
    mounts = tuple(
        replace(mount, place=turned(R, mount.place), axes=tuple(map(of_axis, mount.axes))) for mount in system.mounts
    )
    points = tuple(replace(point, place=turned(R, point.place)) for point in system.points)
    channels = tuple(
        replace(channel, direction=unit(*turned(R, channel.direction)), place=turned(R, channel.place))
        for channel in case.channels
    )
    return Drawn(
        replace(system, bodies=tuple(bodies), mounts=mounts, points=points, gravity=turned(R, system.gravity)),
        replace(case, channels=channels, velocity=turned(R, case.velocity)),
        one.omega,
    )


@LAW
@given(drawn(), rotations())
def test_all_rotated_moves_as_before(one: Drawn, R: FloatArray) -> None:
    before, after = one.motion(), rotated(one, R).motion()
    assert_same(after.histories.acceleration, before.histories.acceleration @ R.T, 1e-8)
    assert_same(after.histories.sway, before.histories.sway @ R.T, 1e-8)
    assert_same(after.histories.force, before.histories.force, 1e-8)
    for name in ("of_axes", "of_bodies", "energies"):
        assert_same(getattr(after.figures, name), getattr(before.figures, name), 1e-8)


def halved(axis: MountAxis) -> MountAxis:
    """With half the force at the same displacement."""
    spring = axis.spring
    half = replace(spring, kE=tuple(0.5 * k for k in spring.kE), kappa_omega=0.5 * spring.kappa_omega)
    stops = None if axis.stops is None else replace(axis.stops, stiffness=0.5 * axis.stops.stiffness)
    return replace(axis, spring=half, damping=0.5 * axis.damping, stops=stops)


def unturned(case: LoadCase) -> LoadCase:
    """Without a base that turns."""
    kept = tuple(channel for channel in case.channels if channel.kind is not ChannelKind.BASE_ANGULAR_VELOCITY)
    return replace(case, channels=kept)


@LAW
@given(drawn())
def test_mounts_cut_in_two_change_nothing(one: Drawn) -> None:
    """But for a base that turns, with which a step is cut at turns as often as there are axes."""
    one = replace(one, case=unturned(one.case))
    cut = []
    for mount in one.system.mounts:
        halves = tuple(map(halved, mount.axes))
        cut += [replace(mount, axes=halves), replace(mount, axes=halves)]
    found = replace(one, system=replace(one.system, mounts=tuple(cut))).motion()
    whole = one.motion()
    assert_same(found.histories.acceleration, whole.histories.acceleration, 1e-9)
    assert_same(found.figures.of_points, whole.figures.of_points, 1e-9)
    assert_same(found.figures.energies, whole.figures.energies, 1e-9)


@dataclass(frozen=True)
class Later:
    """A signal that begins some steps later."""

    signal: Signal
    steps: int

    @property
    def shortest(self) -> float:
        return self.signal.shortest

    def averages(self, step: float, count: int) -> FloatArray:
        return np.concatenate([np.zeros(self.steps), self.signal.averages(step, count - self.steps)])


@LAW
@given(drawn(), st.integers(1, 200))
def test_later_loads_move_later(one: Drawn, steps: int) -> None:
    """But for a base that turns, whose velocity at the edges of steps is found from averages over several."""
    case = replace(unturned(one.case), velocity=(0.0, 0.0, 0.0))
    channels = tuple(replace(channel, signal=Later(channel.signal, steps)) for channel in case.channels)
    late = replace(case, duration=case.duration + steps * STEP, channels=channels)
    at_once, later = replace(one, case=case).motion(), replace(one, case=late).motion()
    assert_same(later.histories.displacement[steps:], at_once.histories.displacement, 1e-9)
    assert_same(later.histories.sway[steps:], at_once.histories.sway, 1e-9)
    # Rounding decides which points a parabola goes through.
    assert_same(later.figures.of_axes, at_once.figures.of_axes, 1e-6)


@LAW
@given(drawn())
def test_without_loads_all_stays_at_rest(one: Drawn) -> None:
    """To the rounding of weights: a part in 1e10 of the acceleration of gravity, and of a metre."""
    found = replace(one, case=LoadCase("none", "pulse", 0.2)).motion().figures
    assert found.of_points[:, 0].max() < 1e-9
    assert found.of_points[:, 5].max() < 1e-12
    assert found.of_bodies[:, 0].max() < 1e-7  # the cosine of half of it rounds


# ---- energy --------------------------------------------------------------------------------------


def plain(spring: SpringParameters) -> SpringParameters:
    """Without an amplifier, for which the energy stored is known."""
    return replace(spring, kA=(1.0,))


def stored(spring: SpringParameters, displacement: float, force: float) -> float:
    """Energy of one spring that can be had back: the integral of FE, and on unloading from omega that of
    kappa*omega dx, dx = d omega/(rho (1 + (2 sigma - 1)|omega|^n)), by paper eq. (11).
    """
    elastic = Polynomial(spring.kE)
    x = displacement - spring.displacement_offset
    omega = abs(force - float(elastic(x))) / spring.kappa_omega

    def unloading(u: float) -> float:
        return u / (1.0 + (2.0 * spring.sigma - 1.0) * u**spring.n)

    return float(elastic.integ()(x)) + spring.kappa_omega / spring.rho * quad(unloading, 0.0, omega)[0]


@LAW
@given(drawn())
def test_springs_create_no_energy(one: Drawn) -> None:
    """What the springs of an axis absorb is at least the growth of what they can give back; the balance closes."""

    def bare(axis: MountAxis) -> MountAxis:
        return replace(axis, damping=0.0, stops=None)

    mounts = tuple(replace(mount, axes=tuple(map(bare, mount.axes))) for mount in one.system.mounts)
    system = replace(one.system, mounts=mounts).with_springs(plain)
    motion = kernel_motion(system, one.case, STEP, one.omega)
    absorbed, histories = motion.figures.of_axes[:, 5], motion.histories
    for number, axis in enumerate(system.axes):
        before, after = (
            stored(axis.spring, histories.displacement[k, number], histories.force[k, number] / axis.parallel)
            for k in (0, -1)
        )
        growth = axis.parallel * axis.series * (after - before)
        assert absorbed[number] >= growth - 1e-9 * abs(absorbed).max()
    # Of second order: stiffer systems are drawn than those held to 1e-5 at STEP.
    assert kernel_motion(system, one.case, 0.5 * STEP, one.omega).imbalance < 2e-5


# ---- bodies that are held ------------------------------------------------------------------------


def mirrored(mount: Mount, *normals: Vector) -> list[Mount]:
    """The mount and its images in planes through the origin."""
    mounts = [mount]
    for normal in normals:
        mirror = np.eye(3) - 2.0 * np.outer(normal, normal)
        for one in tuple(mounts):
            axes = tuple(replace(axis, direction=turned(mirror, axis.direction)) for axis in one.axes)
            mounts.append(replace(one, place=turned(mirror, one.place), axes=axes))
    return mounts


def held_and_free(one: Drawn, body: RigidBody, normals: tuple[Vector, ...], load: Vector) -> list[KernelMotion]:
    """The motion of a body that is held, and of the same that is free, on mounts with planes of symmetry."""
    mounts = tuple(
        image for mount in one.system.mounts[1:3] for image in mirrored(replace(mount, body=0, support=-1), *normals)
    )
    shock = replace(one.case.channels[0], direction=load)
    case = LoadCase("symmetric", "pulse", DURATION, (shock,))
    return [
        Drawn(MountedSystem((each,), mounts, one.system.points[:1]), case, one.omega).motion()
        for each in (body, replace(body, motion=MotionKind.SIX))
    ]


Y = (0.0, 1.0, 0.0)


@LAW
@given(drawn(), st.floats(-1.0, 1.0))
def test_body_in_a_plane_of_symmetry_stays_there(one: Drawn, slope: float) -> None:
    inertia = ((0.25, 0.0, 0.02), (0.0, 0.30, 0.0), (0.02, 0.0, 0.35))
    body = RigidBody("box", 20.0, inertia=inertia, motion=MotionKind.PLANE, direction=Y)
    held, free = held_and_free(one, body, (Y,), unit(1.0, 0.0, slope))
    assert_same(held.histories.acceleration, free.histories.acceleration, 1e-8)
    assert_same(held.figures.of_axes, free.figures.of_axes, 1e-8)
    assert_same(held.figures.energies, free.figures.energies, 1e-8)


@LAW
@given(drawn())
def test_body_on_an_axis_of_symmetry_stays_there(one: Drawn) -> None:
    body = RigidBody(
        "box",
        20.0,
        inertia=((0.25, 0.0, 0.0), (0.0, 0.30, 0.0), (0.0, 0.0, 0.35)),
        motion=MotionKind.AXIS,
        direction=UP,
    )
    held, free = held_and_free(one, body, (Y, (1.0, 0.0, 0.0)), UP)
    assert_same(held.histories.acceleration, free.histories.acceleration, 1e-8)
    assert_same(held.figures.of_axes, free.figures.of_axes, 1e-8)
    assert_same(held.figures.energies, free.figures.energies, 1e-8)
