"""Static equilibrium of bodies on hysteretic mounts; it depends on where in their loops the springs came to rest.

`omega` of a spring at rest is between -1 and 1, and unknown unless somebody knows how the bodies came there; each
spring has its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from ...kernel.structures import rows
from .mounted import MountedSystem
from .parts import BASE
from .small_motion import Pose


@dataclass(frozen=True, eq=False)
class RestPose:
    """Where the bodies rest.

    Attributes
    ----------
    coordinates : ndarray, shape (B, 7)   Of each body: displacement of its centre of gravity from the nominal pose [m],
                                        unit quaternion.
    omega : ndarray, shape (A,)         Of the springs of each axis.
    displacement : ndarray, shape (A,)  Of one spring of each axis [m].
    force : ndarray, shape (A,)         Of each axis, stops included [N].
    """

    coordinates: FloatArray
    omega: FloatArray
    displacement: FloatArray
    force: FloatArray

    @property
    def displacements(self) -> FloatArray:
        """Of the centres of gravity from the nominal pose, shape (B, 3) [m]."""
        return self.coordinates[:, :3]

    @property
    def rotations(self) -> FloatArray:
        """From each body's frame to the base's, shape (B, 3, 3)."""
        w, x, y, z = self.coordinates[:, 3:].T
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        return np.moveaxis(np.array(rows), 2, 0)

    @property
    def pose(self) -> Pose:
        """About which small motions are taken."""
        return self.displacements, self.rotations


def rest(
    system: MountedSystem,
    share: float = 0.0,
    weightless: bool = False,
    omega: FloatArray | None = None,
) -> RestPose:
    """The pose in which the bodies rest.

    Parameters
    ----------
    system : MountedSystem
    share : float           omega of every spring as a share of saturation in the sense of its static force, -1 to 1.
    weightless : bool       Without gravity, as in a free fall.
    omega : ndarray or None, shape (A,)   Of the springs of each axis, instead of a share; where the
                            friction of the axes of a mount acts together, within a length of 1 in each mount.

    Raises
    ------
    MountedSystemError      If the bodies cannot rest, or a spring rests outside its identified range.
    """
    gravity = np.zeros(3) if weightless else np.array(system.gravity)
    pose = _rest(system, gravity, np.zeros(len(system.axes)), None)
    if omega is None and share != 0.0:
        omega = share * system.solver.senses(pose.force)
    if omega is not None:
        if system.coupled:
            parts = [omega[axes] for axes in system.axis_slices]
            omega = np.concatenate([part / max(float(np.linalg.norm(part)), 1.0) for part in parts])
        pose = _rest(system, gravity, omega, pose.coordinates)
    for axis, mount, displacement in zip(system.axes, system.axis_mounts, pose.displacement.tolist(), strict=True):
        spring = axis.spring
        if not spring.displacement_min <= displacement <= spring.displacement_max:
            raise MountedSystemError(
                f"Mount {mount.name} rests at {1e3 * displacement:.6g} mm of {axis.model or 'a spring'}, outside its "
                f"identified range of {1e3 * spring.displacement_min:.6g} to {1e3 * spring.displacement_max:.6g} mm; "
                "use more or stiffer mounts, another preload, or a record that reaches it."
            )
    return pose


def mount_loads(system: MountedSystem, pose: RestPose) -> FloatArray:
    """Static load of each mount: the force of its body on it in the base's frame, stops included, shape (M, 3) [N]."""
    loads = []
    for mount, axes in zip(system.mounts, system.axis_slices, strict=True):
        load = pose.force[axes] @ np.array([axis.direction for axis in mount.axes])
        loads.append(load if mount.support == BASE else pose.rotations[mount.support] @ load)
    return np.array(loads)


def _rest(system: MountedSystem, gravity: FloatArray, omega: FloatArray, begin: FloatArray | None) -> RestPose:
    coordinates, unbalance, is_found = system.solver.rest(gravity, omega, begin)
    if not is_found:
        raise MountedSystemError(
            f"The bodies of {system.name or 'the system'} cannot rest on their mounts: forces of {unbalance:.3g} N "
            "remain unbalanced in every pose that was tried; use stiffer or more mounts, another preload, or axes in "
            "all directions."
        )
    no_channels, no_steps = rows("MotionChannel", 0), np.empty((0, 0))
    _, at = system.solver.run(no_channels, no_steps, 1.0, gravity, coordinates, omega, np.zeros(3))
    return RestPose(coordinates, omega, at.displacement[0], at.force[0])
