"""Bodies on mounts for the tests of `systems`, and their motion by the compiled kernel."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from springs import spring
from strandspring import SpringParameters
from strandspring.kernel.motion import Histories, MotionFigures
from strandspring.vibration.bodies.loads import LoadCase, channel_rows
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import MotionKind, Mount, MountAxis, Point, RigidBody, Stops, Vector

FloatArray = NDArray[np.float64]

GRAVITY = 9.80665  # [m/s^2]
UP: Vector = (0.0, 0.0, 1.0)
NO_WEIGHT: Vector = (0.0, 0.0, 0.0)


def unit(*components: float) -> Vector:
    """The unit vector in a direction."""
    x, y, z = (np.array(components) / math.hypot(*components)).tolist()
    return x, y, z


def vector(*components: float) -> Vector:
    x, y, z = components
    return float(x), float(y), float(z)


def turned(R: FloatArray, v: Vector) -> Vector:
    """A vector rotated."""
    return vector(*(R @ np.array(v)))


def rotated(system: MountedSystem, R: FloatArray) -> MountedSystem:
    """With all places, directions, moments of inertia and weights rotated about the origin."""
    bodies = []
    for body in system.bodies:
        first, second, third = (R @ np.array(body.inertia) @ R.T).tolist()
        inertia = (vector(*first), vector(*second), vector(*third))
        direction = unit(*turned(R, body.direction))
        bodies.append(replace(body, center=turned(R, body.center), inertia=inertia, direction=direction))
    mounts = tuple(
        replace(
            mount, place=turned(R, mount.place),
            axes=tuple(replace(axis, direction=unit(*turned(R, axis.direction))) for axis in mount.axes),
        )
        for mount in system.mounts
    )  # fmt: skip
    points = tuple(replace(point, place=turned(R, point.place)) for point in system.points)
    gravity = turned(R, system.gravity)
    return replace(system, bodies=tuple(bodies), mounts=mounts, points=points, gravity=gravity)


def elastic(*kE: float, half: float = 1.0) -> SpringParameters:
    """A spring with the elastic coefficients kE, and a hysteretic force of 1e-12 N that no test can see."""
    return SpringParameters(kE, (1.0,), 1e-12, 1.0 / half, 1.0, 1.0, 0.0, -half, half)


def hysteretic(n: float, kappa_omega: float, half: float = 0.03, sigma: float = 1.5) -> SpringParameters:
    """A hardening spring with an amplifier, about a displacement of zero."""
    return spring(
        n, sigma, 6.0, (0.0, 6.0, 0.0, 4.0), (0.2, 0.1), kappa_omega, middle=0.0, half=half
    )  # fmt: skip


def one_mass(axis: MountAxis, mass: float = 1.0, gravity: Vector = NO_WEIGHT) -> MountedSystem:
    """A mass on one spring that acts and moves along z."""
    body = RigidBody("mass", mass, motion=MotionKind.AXIS, direction=UP)
    return MountedSystem(
        (body,), (Mount("mount", 0, (0.0, 0.0, 0.0), (axis,)),), (Point("mass", 0, (0.0, 0.0, 0.0)),), gravity
    )


ASYMMETRIC = ((0.25, 0.01, 0.02), (0.01, 0.30, -0.015), (0.02, -0.015, 0.35))
CORNERS = ((0.15, 0.10, -0.12), (0.15, -0.10, -0.12), (-0.15, 0.10, -0.12), (-0.15, -0.10, -0.12))
COMPRESSION, SHEAR, ROLL = hysteretic(0.6, 60.0), hysteretic(0.4, 30.0), hysteretic(1.2, 30.0)


def three_axes(parallel: int = 1, series: int = 1, damping: float = 0.0) -> tuple[MountAxis, MountAxis, MountAxis]:
    """The axes of a mount that stands under a body."""
    of_all = MountAxis(COMPRESSION, (0.0, 0.0, -1.0), 0.0, parallel, series, damping)
    return (
        of_all,
        replace(of_all, spring=SHEAR, direction=(1.0, 0.0, 0.0)),
        replace(of_all, spring=ROLL, direction=(0.0, 1.0, 0.0)),
    )


def box(axes: tuple[MountAxis, ...] | None = None) -> MountedSystem:
    """20 kg without a plane of symmetry, on four mounts below its centre of gravity."""
    body = RigidBody("box", 20.0, inertia=ASYMMETRIC)
    mounts = (Mount(f"corner {i}", 0, place, axes or three_axes()) for i, place in enumerate(CORNERS))
    return MountedSystem(
        (body,), tuple(mounts), (Point("board", 0, (0.1, 0.02, 0.05)), Point("lid", 0, (-0.1, 0.0, 0.2)))
    )


def inclined_box() -> MountedSystem:
    """The box off the centre on mounts that lean against each other, of two springs in series or side by side."""
    leaning = []
    for i, place in enumerate(CORNERS):
        down = np.array(unit(0.5 * np.sign(place[0]), 0.3 * np.sign(place[1]), -1.0))
        across = np.cross(down, UP) / np.linalg.norm(np.cross(down, UP))
        axes = three_axes(1 + i % 2, 2 - i % 2, damping=10.0)
        directions = (down, across, np.cross(down, across))
        turned = tuple(replace(a, direction=unit(*d), nominal=0.001 * i) for a, d in zip(axes, directions, strict=True))
        leaning.append(Mount(f"corner {i}", 0, (place[0] + 0.01, place[1], place[2]), turned))
    return replace(box(), mounts=tuple(leaning))


def plane_box() -> MountedSystem:
    """The box in the plane of x and z, on a soft and a stiff mount, with stops under the second."""
    stops = Stops(-0.006, 0.006, 2e5)
    soft, stiff = three_axes()[:2], three_axes(2)[:2]
    axes = (replace(stiff[0], stops=stops), stiff[1])
    body = RigidBody("box", 20.0, inertia=ASYMMETRIC, motion=MotionKind.PLANE, direction=(0.0, 1.0, 0.0))
    mounts = (Mount("soft", 0, (-0.15, 0.0, -0.12), soft), Mount("stiff", 0, (0.15, 0.0, -0.12), axes))
    return MountedSystem((body,), mounts, box().points)


def two_stages() -> MountedSystem:
    """A box on four mounts that stand on a frame, which stands on four stiffer ones."""
    frame = RigidBody("frame", 30.0, (0.0, 0.02, -0.25), ((0.6, 0.0, 0.0), (0.0, 0.9, 0.0), (0.0, 0.0, 1.2)))
    lower = tuple(
        Mount(f"foot {i}", 1, (1.4 * x, 1.6 * y, -0.3), three_axes(3, damping=20.0))
        for i, (x, y, _) in enumerate(CORNERS)
    )
    upper = tuple(replace(mount, support=1) for mount in box().mounts)
    points = (*box().points, Point("corner of the frame", 1, (0.3, 0.2, -0.25)))
    return MountedSystem((*box().bodies, frame), (*upper, *lower), points)


@dataclass(frozen=True, eq=False)
class KernelMotion:
    """What the kernel found, and the energy that is missing over what was exchanged."""

    figures: MotionFigures
    histories: Histories
    pose: FloatArray
    imbalance: float


def kernel_motion(
    system: MountedSystem, case: LoadCase, step: float, omega: ArrayLike = 0.0, every: float | None = None
) -> KernelMotion:
    """Rest with these omegas, and the motion from there; histories each `every` seconds, or at all steps."""
    kernel, axes = system.solver, len(system.axes)
    omegas = np.broadcast_to(np.asarray(omega, dtype=np.float64), axes).copy()
    gravity = np.array(system.gravity)
    at_rest = np.zeros(3) if case.weightless else gravity
    pose, unbalance, is_found = kernel.rest(at_rest, omegas)
    assert is_found, unbalance
    count = round(case.duration / step)
    figures, histories = kernel.run(
        channel_rows(case.channels, system.bodies), case.averages(step, count), step, gravity, pose, omegas,
        np.array(case.velocity), round(case.settling / step), 1 if every is None else round(every / step),
    )  # fmt: skip
    assert figures.steps == count
    before, after, absorbed, damped, in_stops, *works, exchanged = figures.energies.tolist()
    scale = exchanged + before + abs(works[0])
    return KernelMotion(
        figures, histories, pose, abs(after - before + absorbed + damped + in_stops - sum(works)) / scale
    )
