"""The largest step with which velocity Verlet is stable, known before anything is integrated.

The scheme is x' = x + h*v + h^2*a/2, v' = v + h*(a + a')/2, with a' from the force at x' and, in dampers, at the
velocity v + h*a. For a motion z^n of M x'' + C x' + K x = 0 it demands

    z*(z - 1)^2*M + h^2*z^2*K + h/2*(3*z - 1)*(z - 1)*C = 0,

whose roots for one degree of freedom stay within the unit circle as long as h^2*k + 4*h*c < 4*m. With symmetric
matrices each eigenvector gives such an equation, so that the step is stable until h^2*K + 4*h*C - 4*M is singular.
"""

from __future__ import annotations

import math

import numpy as np

from ...kernel.arrays import FloatArray
from .axis_laws import AxisLaws
from .mounted import BASE, MountedSystem
from .small_motion import Pose, SmallMotion, nominal_pose


def largest_stable_step(system: MountedSystem, pose: Pose | None = None, *, tilted: bool = False) -> float:
    """The largest stable step, from upper bounds of the stiffness wherever springs move [s]; infinite if nothing moves.

    Stiffness that comes from the turning of forces is left out: against that of the mounts it is as their stroke to the
    size of the body.

    Parameters
    ----------
    system : MountedSystem
    pose : Pose or None    By default the nominal one.
    tilted : bool          Whether the bodies may turn by any angle from there: each mount then counts with its stiffest
                           axis and strongest damper in all directions.
    """
    motion = SmallMotion.about(system, nominal_pose(system) if pose is None else pose)
    damping = np.array([axis.damping for _, axis in system.axes()])
    matrices = [
        _in_all_directions(motion, of_axes) if tilted else motion.along.T @ (of_axes[:, None] * motion.along)
        for of_axes in (AxisLaws(system).steepest(), damping)
    ]
    return _limit(*(matrix / motion.mass for matrix in matrices))


def _limit(stiffness: FloatArray, damping: FloatArray) -> float:
    """Least h > 0 for which h^2*K + 4*h*C - 4 is singular: 1/h is the largest eigenvalue of mu^2 - mu*C - K/4."""
    count = len(stiffness)
    companion = np.block([[damping, 0.25 * stiffness], [np.eye(count), np.zeros((count, count))]])
    largest = float(np.linalg.eigvals(companion).real.max())
    return 1.0 / largest if largest > 0.0 else math.inf


def _in_all_directions(motion: SmallMotion, of_axes: FloatArray) -> FloatArray:
    """The matrix of the axes' stiffness or damping if each mount had its largest in all directions, shape (D, D)."""
    total, first = np.zeros((motion.along.shape[1],) * 2), 0
    for mount in motion.system.mounts:
        moved = motion.point(mount.body, mount.place)
        if mount.support != BASE:
            moved = moved - motion.point(mount.support, mount.place)
        total += of_axes[first : first + len(mount.axes)].max() * moved.T @ moved
        first += len(mount.axes)
    return total
