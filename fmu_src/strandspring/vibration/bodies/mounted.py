"""A system of rigid bodies on hysteretic mounts, with what follows from its description: the laws of its axes, and the
compiled kernel's solver.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import SpringParameters
from ...errors import MountedSystemError
from ...ground.gravity import STANDARD_GRAVITY
from ...kernel.motion import MotionSolver
from ...kernel.structures import rows
from .axis_laws import AxisLaws
from .parts import BASE, MotionKind, Mount, MountAxis, Point, RigidBody, Vector

MOST_BODIES, MOST_AXES, MOST_POINTS = 8, 600, 64


@dataclass(frozen=True)
class MountedSystem:
    """Rigid bodies on mounts.

    Parameters
    ----------
    bodies : tuple of RigidBody
    mounts : tuple of Mount
    points : tuple of Point
    gravity : Vector             [m/s^2].
    name : str
    coupled : bool               Whether the friction of the axes of each mount acts together (Park, Wen and Ang 1986),
                                 or that of each axis for itself.

    Raises
    ------
    MountedSystemError           If the parts do not fit together, or there are too many.
    """

    bodies: tuple[RigidBody, ...]
    mounts: tuple[Mount, ...]
    points: tuple[Point, ...] = ()
    gravity: Vector = (0.0, 0.0, -STANDARD_GRAVITY)
    name: str = ""
    coupled: bool = False

    def __post_init__(self) -> None:
        for what, count, least, most in (
            ("bodies", len(self.bodies), 1, MOST_BODIES),
            ("axes of mounts", len(self.axes), 1, MOST_AXES),
            ("points", len(self.points), 0, MOST_POINTS),
        ):
            if not least <= count <= most:
                raise MountedSystemError(f"A system must have {least} to {most} {what}, got {count}.")
        if not all(abs(g) <= 1e4 for g in self.gravity):
            raise MountedSystemError(f"`gravity` must be finite and within +-1e4 [m/s^2], got {self.gravity!r}.")
        numbers = range(len(self.bodies))
        parts: tuple[Mount | Point, ...] = (*self.mounts, *self.points)
        for part in parts:
            if part.body not in numbers:
                raise MountedSystemError(f"{part.name} must belong to one of the bodies, got number {part.body}.")
        for mount in self.mounts:
            if mount.support not in (BASE, *numbers) or mount.support == mount.body:
                raise MountedSystemError(f"Mount {mount.name} must stand on the base or on another body.")

    @cached_property
    def axes(self) -> tuple[MountAxis, ...]:
        """Those of all mounts, one mount after the other: A in number, and the order of all arrays over axes."""
        return tuple(axis for mount in self.mounts for axis in mount.axes)

    @cached_property
    def axis_mounts(self) -> tuple[Mount, ...]:
        """The mount of each axis."""
        return tuple(mount for mount in self.mounts for _ in mount.axes)

    @cached_property
    def axis_slices(self) -> tuple[slice, ...]:
        """Where the axes of each mount are among all."""
        ends = np.cumsum([len(mount.axes) for mount in self.mounts]).tolist()
        return tuple(slice(end - len(mount.axes), end) for mount, end in zip(self.mounts, ends, strict=True))

    @cached_property
    def axis_names(self) -> tuple[str, ...]:
        """For people: of each axis the name of its mount, where that has several followed by that of the axis."""
        return tuple(name for mount in self.mounts for name in mount.axis_names)

    @cached_property
    def laws(self) -> AxisLaws:
        """What its axes answer."""
        return AxisLaws(self.axes, self.axis_names)

    @property
    def solver(self) -> MotionSolver:
        """The kernel's solver for it; those of the last few systems are kept."""
        return _solver(self)

    @property
    def kernel_rows(self) -> dict[str, NDArray[np.void]]:
        """Its bodies, mounts, axes and points as MotionSolver takes them."""
        centers = [body.center for body in self.bodies]
        on_support = [np.zeros(3) if mount.support == BASE else centers[mount.support] for mount in self.mounts]
        laws = self.laws
        return {
            "bodies": rows(
                "MotionBody",
                len(self.bodies),
                mass=[body.mass for body in self.bodies],
                center=centers,
                translations=[body.translations for body in self.bodies],
                rotations=[body.rotations for body in self.bodies],
                inertia=[body.inertia for body in self.bodies],
                inverse_inertia=[body.inverse_inertia for body in self.bodies],
                turns=[body.motion is not MotionKind.AXIS for body in self.bodies],
                is_free=[body.motion is MotionKind.SIX for body in self.bodies],
            ),
            "mounts": rows(
                "MotionMount",
                len(self.mounts),
                place=[np.subtract(mount.place, centers[mount.body]) for mount in self.mounts],
                support_place=[np.subtract(mount.place, at) for mount, at in zip(self.mounts, on_support, strict=True)],
                body=[mount.body for mount in self.mounts],
                support=[mount.support for mount in self.mounts],
                first=[axes.start for axes in self.axis_slices],
                axes=[len(mount.axes) for mount in self.mounts],
            ),
            "axes": rows(
                "MotionAxis",
                len(self.axes),
                direction=[axis.direction for axis in self.axes],
                nominal=laws.nominal,
                parallel=laws.parallel,
                series=laws.series,
                damping=laws.damping,
                stop_low=laws.stop_low,
                stop_high=laws.stop_high,
                stop_stiffness=laws.stop_stiffness,
            ),
            "points": rows(
                "MotionPoint",
                len(self.points),
                place=[np.subtract(point.place, centers[point.body]) for point in self.points],
                body=[point.body for point in self.points],
            ),
        }

    def with_springs(self, change: Callable[[SpringParameters], SpringParameters]) -> MountedSystem:
        """The system with each spring replaced; a spring that several axes share is changed once."""
        changed = {spring: change(spring) for spring in dict.fromkeys(axis.spring for axis in self.axes)}
        mounts = (
            replace(mount, axes=tuple(replace(axis, spring=changed[axis.spring]) for axis in mount.axes))
            for mount in self.mounts
        )
        return replace(self, mounts=tuple(mounts))


@lru_cache(maxsize=8)
def _solver(system: MountedSystem) -> MotionSolver:
    springs = [axis.spring for axis in system.axes]
    return MotionSolver(springs, system.coupled, **system.kernel_rows)
