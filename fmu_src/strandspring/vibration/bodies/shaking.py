"""What shakes a system sinusoidally: its base along a direction or about an axis, or a force on a body."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from ..one_mass.options import Excitation
from .parts import Vector, direction_name
from .small_motion import SmallMotion

_ROUNDING = 1e-13  # of the parts of a sum


@dataclass(frozen=True)
class Shaking:
    """A sinusoidal excitation.

    Parameters
    ----------
    kind : Excitation
    direction : Vector        Of the motion or axis, or of a force that turns with its body, in the nominal pose; a unit
                              vector.
    about : Vector or None    A place of the axis about which the base turns [m]; None where it moves along `direction`.
                              Levels are then angles [rad] or angular accelerations [rad/s^2].
    body : int                On which a force acts.
    place : Vector            Where a force acts, in the nominal pose [m].

    Raises
    ------
    MountedSystemError        If the direction is not of unit length, or a force is to turn.
    """

    kind: Excitation
    direction: Vector
    about: Vector | None = None
    body: int = 0
    place: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        length = math.hypot(*self.direction)
        if not abs(length - 1.0) <= 1e-9:
            raise MountedSystemError(f"The direction of an excitation must be a unit vector, got length {length!r}.")
        if self.about is not None and self.kind is Excitation.FORCE:
            raise MountedSystemError("A force acts along a direction, not about an axis; give a place and a direction.")

    @property
    def name(self) -> str:
        """How people name it."""
        along = direction_name(self.direction) or "({:.2g}, {:.2g}, {:.2g})".format(*self.direction)
        if self.about is None:
            return f"{self.kind.value} along {along}"
        turning = "base rotation" if self.kind is Excitation.BASE_DISPLACEMENT else "angular base acceleration"
        return f"{turning} about {along}"

    @property
    def unit(self) -> str:
        """SI unit of its level."""
        return self.kind.unit if self.about is None else self.kind.unit.replace("m", "rad")

    def level_text(self, level: float) -> str:
        """A level in the unit that people read."""
        if self.about is None:
            return self.kind.level_text(level)
        is_angle = self.kind is Excitation.BASE_DISPLACEMENT
        return f"{math.degrees(level):.4g} deg" if is_angle else f"{level:.4g} {self.unit}"

    def base_motion(self, motion: SmallMotion, body: int, place: Vector) -> FloatArray:
        """Displacement of a body's place by a unit of the base's motion if the body went with it, shape (3,)."""
        if self.kind is Excitation.FORCE:
            return np.zeros(3)
        if self.about is None:
            return np.array(self.direction)
        return np.cross(self.direction, motion.place(body, place) - self.about)

    def forcing(self, motion: SmallMotion) -> tuple[FloatArray, FloatArray]:
        """Forces on the coordinates that a unit of it exerts [N], each of shape (D,).

        Those of a force, or of gravity in the frame of a base that has turned; and those of inertia, by the square of
        Omega, that the base's displacement or rotation causes.
        """
        direction = np.array(self.direction)
        if self.kind is Excitation.FORCE:
            turned_with = motion.pose[1][self.body] @ direction
            return _projected(turned_with, motion.point(self.body, self.place)), np.zeros(motion.along.shape[1])
        steady, inertial = [], []
        for k, (body, rotation) in enumerate(zip(motion.system.bodies, motion.pose[1], strict=True)):
            turned, moment = np.zeros(3), np.zeros(3)
            if self.about is not None:
                turned = -body.mass * np.cross(direction, motion.system.gravity)
                moment = rotation @ np.array(body.inertia) @ rotation.T @ direction
            inertial += [body.mass * self.base_motion(motion, k, body.center), moment]
            steady += [turned, np.zeros(3)]
        by_turning, by_inertia = (_projected(np.concatenate(parts), motion.free) for parts in (steady, inertial))
        return by_turning, by_inertia


def _projected(vector: FloatArray, free: FloatArray) -> FloatArray:
    """A force on the bodies as one on the coordinates; what is left where its parts cancel is 0."""
    projection, parts = vector @ free, np.abs(vector) @ np.abs(free)
    return np.where(np.abs(projection) > _ROUNDING * parts, projection, 0.0)
