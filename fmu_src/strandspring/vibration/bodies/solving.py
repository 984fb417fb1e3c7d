"""A system of bodies on mounts, and what drives it, as the compiled kernel takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from ...kernel.motion import CHANNEL, POINT, MotionSolver
from .loads import Channel
from .mounted import BASE, Motion, MountAxis, MountedSystem, RigidBody


@dataclass(frozen=True, eq=False)
class SystemArrays:
    """A system as rows of the structures of motion.h.

    Attributes
    ----------
    bodies, mounts, axes, points : ndarray   As MotionSolver takes them.
    springs : list of SpringParameters       Of each axis.
    """

    bodies: FloatArray
    mounts: FloatArray
    springs: list[SpringParameters]
    axes: FloatArray
    points: FloatArray


def solver(system: MountedSystem) -> MotionSolver:
    """The kernel's solver for a system."""
    parts = arrays(system)
    return MotionSolver(parts.bodies, parts.mounts, parts.springs, parts.axes, parts.points)


def arrays(system: MountedSystem) -> SystemArrays:
    """The system as the kernel takes it."""
    centers = np.array([body.center for body in system.bodies])
    bodies = [_body(body) for body in system.bodies]
    mounts, first = [], 0
    for mount in system.mounts:
        place = np.array(mount.place)
        support = place if mount.support == BASE else place - centers[mount.support]
        own = place - centers[mount.body]
        mounts.append(np.concatenate([own, support, [mount.body, mount.support, first, len(mount.axes)]]))
        first += len(mount.axes)
    axes = [axis for _, axis in system.axes()]
    points = [np.append(np.subtract(point.place, centers[point.body]), point.body) for point in system.points]
    return SystemArrays(
        np.array(bodies),
        np.array(mounts),
        [axis.spring for axis in axes],
        np.array([_axis(axis) for axis in axes]),
        np.array(points).reshape(-1, POINT),
    )


def channel_rows(system: MountedSystem, channels: Sequence[Channel]) -> FloatArray:
    """The channels as rows of the kernel, shape (C, 8)."""
    rows = [
        [
            *channel.direction,
            *np.subtract(channel.place, system.bodies[channel.body].center),
            channel.kind.value,
            channel.body,
        ]
        for channel in channels
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, CHANNEL)


def _body(body: RigidBody) -> FloatArray:
    matrices = (body.translations, body.rotations, np.array(body.inertia), body.inverse_inertia)
    return np.concatenate(
        [
            [body.mass],
            body.center,
            *(matrix.ravel() for matrix in matrices),
            [body.motion is not Motion.AXIS, body.motion is Motion.SIX],
        ]
    )


def _axis(axis: MountAxis) -> list[float]:
    stops = (-np.inf, np.inf, 0.0) if axis.stops is None else (axis.stops.low, axis.stops.high, axis.stops.stiffness)
    return [*axis.direction, axis.nominal, axis.parallel, axis.series, axis.damping, *stops]
