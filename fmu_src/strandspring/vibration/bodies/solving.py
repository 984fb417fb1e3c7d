"""A system of bodies on mounts, and what drives it, as the compiled kernel takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import SpringParameters
from ...kernel.motion import MotionSolver
from ...kernel.structures import rows
from .loads import LoadChannel
from .mounted import BASE, MotionKind, MountedSystem


@dataclass(frozen=True, eq=False)
class SystemArrays:
    """A system as structures of motion.h.

    Attributes
    ----------
    bodies, mounts, axes, points : ndarray   As MotionSolver takes them.
    springs : list of SpringParameters       Of each axis.
    """

    bodies: NDArray[np.void]
    mounts: NDArray[np.void]
    springs: list[SpringParameters]
    axes: NDArray[np.void]
    points: NDArray[np.void]


@lru_cache(maxsize=8)
def solver(system: MountedSystem) -> MotionSolver:
    """The kernel's solver for a system; the last few are kept."""
    parts = arrays(system)
    return MotionSolver(parts.bodies, parts.mounts, parts.springs, parts.axes, parts.points, system.coupled)


def arrays(system: MountedSystem) -> SystemArrays:
    """The system as the kernel takes it."""
    bodies, mounts, points = system.bodies, system.mounts, system.points
    axes = [axis for _, axis in system.axes()]
    counts = [len(mount.axes) for mount in mounts]
    stops = [
        (-np.inf, np.inf, 0.0) if a.stops is None else (a.stops.low, a.stops.high, a.stops.stiffness) for a in axes
    ]
    stop_low, stop_high, stop_stiffness = np.transpose(stops)
    centers = [body.center for body in bodies]
    on_support = [np.zeros(3) if mount.support == BASE else centers[mount.support] for mount in mounts]
    return SystemArrays(
        rows(
            "MotionBody",
            len(bodies),
            mass=[body.mass for body in bodies],
            center=centers,
            translations=[body.translations for body in bodies],
            rotations=[body.rotations for body in bodies],
            inertia=[body.inertia for body in bodies],
            inverse_inertia=[body.inverse_inertia for body in bodies],
            turns=[body.motion is not MotionKind.AXIS for body in bodies],
            is_free=[body.motion is MotionKind.SIX for body in bodies],
        ),
        rows(
            "MotionMount",
            len(mounts),
            place=[np.subtract(mount.place, centers[mount.body]) for mount in mounts],
            support_place=[np.subtract(mount.place, center) for mount, center in zip(mounts, on_support, strict=True)],
            body=[mount.body for mount in mounts],
            support=[mount.support for mount in mounts],
            first=np.cumsum([0, *counts[:-1]]),
            axes=counts,
        ),
        [axis.spring for axis in axes],
        rows(
            "MotionAxis",
            len(axes),
            direction=[axis.direction for axis in axes],
            nominal=[axis.nominal for axis in axes],
            parallel=[axis.parallel for axis in axes],
            series=[axis.series for axis in axes],
            damping=[axis.damping for axis in axes],
            stop_low=stop_low,
            stop_high=stop_high,
            stop_stiffness=stop_stiffness,
        ),
        rows(
            "MotionPoint",
            len(points),
            place=[np.subtract(point.place, centers[point.body]) for point in points],
            body=[point.body for point in points],
        ),
    )


def channel_rows(system: MountedSystem, channels: Sequence[LoadChannel]) -> NDArray[np.void]:
    """The channels as MotionChannel of motion.h, shape (C,)."""
    return rows(
        "MotionChannel",
        len(channels),
        direction=[channel.direction for channel in channels],
        place=[np.subtract(channel.place, system.bodies[channel.body].center) for channel in channels],
        kind=[channel.kind.value for channel in channels],
        body=[channel.body for channel in channels],
    )
