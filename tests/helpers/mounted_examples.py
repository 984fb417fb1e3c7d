"""Bodies on mounts for the tests of `systems`, and their motion by the compiled kernel."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

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


def elastic(*kE: float, half: float = 1.0) -> SpringParameters:
    """A spring with the elastic coefficients kE, and a hysteretic force of 1e-12 N that no test can see."""
    return SpringParameters(kE, (1.0,), 1e-12, 1.0 / half, 1.0, 1.0, 0.0, -half, half)


def hysteretic(n: float, kappa_omega: float, half: float = 0.03) -> SpringParameters:
    """A hardening spring with an amplifier, about a displacement of zero."""
    return spring(n, 1.5, 6.0, (0.0, 6.0, 0.0, 4.0), (0.2, 0.1), kappa_omega, middle=0.0, half=half)


def one_mass(axis: MountAxis, mass: float = 1.0, gravity: Vector = NO_WEIGHT) -> MountedSystem:
    """A mass on one spring that acts and moves along z."""
    body = RigidBody("mass", mass, motion=MotionKind.AXIS, direction=UP)
    return MountedSystem((body,), (Mount("mount", 0, NO_WEIGHT, (axis,)),), (Point("mass", 0, NO_WEIGHT),), gravity)


ASYMMETRIC = ((0.25, 0.01, 0.02), (0.01, 0.30, -0.015), (0.02, -0.015, 0.35))
CORNERS = ((0.15, 0.10, -0.12), (0.15, -0.10, -0.12), (-0.15, 0.10, -0.12), (-0.15, -0.10, -0.12))
COMPRESSION, SHEAR, ROLL = hysteretic(0.6, 60.0), hysteretic(0.4, 30.0), hysteretic(1.2, 30.0)


def three_axes(parallel: int = 1, series: int = 1, damping: float = 0.0) -> tuple[MountAxis, ...]:
    """The axes of a mount that stands under a body."""
    ways = {(0.0, 0.0, -1.0): COMPRESSION, (1.0, 0.0, 0.0): SHEAR, (0.0, 1.0, 0.0): ROLL}
    return tuple(MountAxis(one, way, 0.0, parallel, series, damping) for way, one in ways.items())


def box(axes: tuple[MountAxis, ...] | None = None) -> MountedSystem:
    """20 kg without a plane of symmetry, on four mounts below its centre of gravity."""
    mounts = (Mount(f"corner {i}", 0, place, axes or three_axes()) for i, place in enumerate(CORNERS))
    points = Point("board", 0, (0.1, 0.02, 0.05)), Point("lid", 0, (-0.1, 0.0, 0.2))
    return MountedSystem((RigidBody("box", 20.0, inertia=ASYMMETRIC),), tuple(mounts), points)


def inclined_box() -> MountedSystem:
    """The box off the centre on mounts that lean against each other, of two springs in series or side by side."""
    leaning = []
    for i, (x, y, z) in enumerate(CORNERS):
        down = np.array(unit(0.5 * np.sign(x), 0.3 * np.sign(y), -1.0))
        across = np.cross(down, UP) / np.linalg.norm(np.cross(down, UP))
        pairs = zip(three_axes(1 + i % 2, 2 - i % 2, 10.0), (down, across, np.cross(down, across)), strict=True)
        axes = tuple(replace(axis, direction=unit(*d), nominal=0.001 * i) for axis, d in pairs)
        leaning.append(Mount(f"corner {i}", 0, (x + 0.01, y, z), axes))
    return replace(box(), mounts=tuple(leaning))


def plane_box() -> MountedSystem:
    """The box in the plane of x and z, on a soft and a stiff mount, with stops under the second."""
    down, across, _ = three_axes(2)
    body = RigidBody("box", 20.0, inertia=ASYMMETRIC, motion=MotionKind.PLANE, direction=(0.0, 1.0, 0.0))
    stiff = Mount("stiff", 0, (0.15, 0.0, -0.12), (replace(down, stops=Stops(-0.006, 0.006, 2e5)), across))
    return MountedSystem((body,), (Mount("soft", 0, (-0.15, 0.0, -0.12), three_axes()[:2]), stiff), box().points)


def two_stages() -> MountedSystem:
    """A box on four mounts that stand on a frame, which stands on four stiffer ones."""
    frame = RigidBody("frame", 30.0, (0.0, 0.02, -0.25), ((0.6, 0.0, 0.0), (0.0, 0.9, 0.0), (0.0, 0.0, 1.2)))
    feet = ((f"foot {i}", (1.4 * x, 1.6 * y, -0.3)) for i, (x, y, _) in enumerate(CORNERS))
    lower = tuple(Mount(name, 1, place, three_axes(3, damping=20.0)) for name, place in feet)
    upper = tuple(replace(mount, support=1) for mount in box().mounts)
    points = (*box().points, Point("corner of the frame", 1, (0.3, 0.2, -0.25)))
    return MountedSystem((*box().bodies, frame), (*upper, *lower), points)


class KernelMotion(NamedTuple):
    """What the kernel found, and the energy that is missing over what was exchanged."""

    figures: MotionFigures
    histories: Histories
    pose: FloatArray
    imbalance: float


def kernel_motion(
    system: MountedSystem, case: LoadCase, step: float, omega: ArrayLike = 0.0, every: float | None = None
) -> KernelMotion:
    """Rest with these omegas, and the motion from there; histories each `every` seconds, or at all steps."""
    kernel, gravity = system.solver, np.array(system.gravity)
    omegas = np.broadcast_to(np.asarray(omega, dtype=np.float64), len(system.axes)).copy()
    pose, unbalance, is_found = kernel.rest((not case.weightless) * gravity, omegas)
    assert is_found, unbalance
    count = round(case.duration / step)
    figures, histories = kernel.run(
        channel_rows(case.channels, system.bodies), case.averages(step, count), step, gravity, pose, omegas,
        np.array(case.velocity), round(case.settling / step), 1 if every is None else round(every / step),
    )  # fmt: skip
    assert figures.steps == count
    before, after, absorbed, damped, in_stops, *works, exchanged = figures.energies.tolist()
    missing = after - before + absorbed + damped + in_stops - sum(works)
    return KernelMotion(figures, histories, pose, abs(missing) / (exchanged + before + abs(works[0])))
