"""Small motions of the bodies about a pose: exact first and second derivatives of the axes' displacements.

A body moves by a displacement u of its centre of gravity and a rotation exp(theta x), both small, in the base's frame.
With n the direction of an axis as it stands in the pose, r and s the arms of the place P_B about the centres of
gravity of the body B and of the support A, the displacement d of the axis changes by

    dd = n.(u_B - u_A) + (r x n).theta_B - (s x n).theta_A

and to second order by half of

    theta_B.H(n, r).theta_B + theta_A.H(n, s).theta_A + 2*(theta_A x n).(u_B - u_A + theta_B x r),

with H(n, r) = (n r' + r n')/2 - (n.r)*1. A support that is the base does not move.

Rotations are counted by the coordinates e of a free rotation, along which a body without moments turns steadily:
theta = e - J^-1 (e x J e)/2 with the inertia J in the pose. To second order they leave inertia linear,

    J e'' = moments,        half of e.[(w x) J - J (w x)].e/2 with w = J^-1 (r x n)

being added to the second order of d. A body that turns in a plane only needs neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from ...kernel.arrays import FloatArray
from .mounted import MotionKind, MountedSystem

# Displacements of the centres of gravity, shape (B, 3) [m], and rotation matrices, shape (B, 3, 3).
Pose: TypeAlias = tuple[FloatArray, FloatArray]


def nominal_pose(system: MountedSystem) -> Pose:
    """The pose in which the system is described."""
    count = len(system.bodies)
    return np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3)).copy()


def gradients(system: MountedSystem, pose: Pose) -> FloatArray:
    """First derivatives of the axes' displacements by displacement and rotation of each body, shape (M, 6B)."""
    return _Axes.from_pose(system, pose).gradients()


@dataclass(frozen=True, eq=False)
class SmallMotion:
    """Small motions in D free coordinates; B bodies, M axes of mounts in the order of `MountedSystem.axes`.

    Attributes
    ----------
    free : ndarray, shape (6B, D)    Displacement and rotation of each body by the coordinates, which are lengths of the
                                     same mass.
    mass : float                     Of each coordinate, the mean of the bodies' masses [kg].
    along : ndarray, shape (M, D)    Displacement of each axis by the coordinates.
    springs : ndarray, shape (M,)    Displacement of one spring of each axis in the pose [m].
    damping : ndarray, shape (D, D)  Of the viscous dampers [N s/m].
    weight : ndarray, shape (D,)     Of the bodies [N].
    """

    system: MountedSystem
    pose: Pose
    free: FloatArray
    mass: float
    along: FloatArray
    springs: FloatArray
    damping: FloatArray
    weight: FloatArray

    @classmethod
    def about(cls, system: MountedSystem, pose: Pose) -> SmallMotion:
        """Small motions about a pose.

        Parameters
        ----------
        system : MountedSystem
        pose : Pose
        """
        axes = _Axes.from_pose(system, pose)
        free, mass = _free_coordinates(system, pose[1])
        along = axes.gradients() @ free
        gravity = [[*(body.mass * np.array(system.gravity)), 0.0, 0.0, 0.0] for body in system.bodies]
        damping = np.array([axis.damping for _, axis in system.axes()])
        return cls(
            system=system,
            pose=pose,
            free=free,
            mass=mass,
            along=along,
            springs=axes.springs,
            damping=along.T @ (damping[:, None] * along),
            weight=np.ravel(gravity) @ free,
        )

    @cached_property
    def bend(self) -> FloatArray:
        """Second derivatives of the axes' displacements by the coordinates, shape (M, D, D) [1/m]."""
        return self._bend(_Axes.from_pose(self.system, self.pose))

    def geometric(self, forces: FloatArray) -> FloatArray:
        """Stiffness that the forces of the axes give by turning with the bodies and by their arms, shape (D, D) [N/m].

        It is symmetric where the bodies are in equilibrium, and its symmetric part elsewhere.

        Parameters
        ----------
        forces : ndarray, shape (M,)   Of the axes in the pose [N].
        """
        curvatures = _Axes.from_pose(self.system, self.pose).curvatures()
        return np.asarray(self.free.T @ np.tensordot(forces, curvatures, 1) @ self.free)

    def stiffness(self, of_axes: FloatArray, forces: FloatArray) -> FloatArray:
        """Stiffness matrix from the stiffness of each axis [N/m] and its force in the pose [N], shape (D, D) [N/m]."""
        return self.along.T @ (of_axes[:, None] * self.along) + self.geometric(forces)

    def place(self, body: int, place: Sequence[float]) -> FloatArray:
        """Where a body's point, given in the nominal pose [m], is in this one, shape (3,) [m]."""
        return np.asarray(self.pose[0][body] + self.system.bodies[body].center + self._arm(body, place))

    def point(self, body: int, place: Sequence[float]) -> FloatArray:
        """Displacement of a body's point, given in the nominal pose [m], by the coordinates, shape (3, D)."""
        return np.hstack([np.eye(3), -_cross(self._arm(body, place))]) @ self.free[6 * body : 6 * body + 6]

    def point_bend(self, body: int, place: Sequence[float]) -> FloatArray:
        """Second derivatives of `point` by the coordinates, shape (3, D, D) [1/m]."""
        count, arm = len(self.system.bodies), np.tile(self._arm(body, place), (3, 1))
        # As of three axes on the base.
        bodies, supports = np.full(3, body), np.full(3, count)
        return self._bend(_Axes(count, bodies, supports, np.eye(3), arm, np.zeros((3, 3)), np.zeros(3)))

    def rotations(self, coordinates: FloatArray) -> FloatArray:
        """Rotation vectors of the bodies from the pose, shape (B, 3, ...), of coordinates of shape (D, ...) [rad]."""
        turned = np.tensordot(self.free.reshape(-1, 6, len(self.weight))[:, 3:], coordinates, 1)
        for k, inertia in enumerate(self._inertias):
            if inertia is not None:
                momentum = np.tensordot(inertia, turned[k], 1)
                bent = np.cross(turned[k], momentum, axis=0)
                turned[k] -= 0.5 * np.tensordot(np.linalg.inv(inertia), bent, 1)
        return np.asarray(turned)

    def state(self, coordinates: FloatArray, rates: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Pose and momenta of the bodies as the compiled kernel takes them, shapes (B, 7) and (B, 6); see motion.h.

        Parameters
        ----------
        coordinates, rates : ndarray, shape (D,)   [m], [m/s].
        """
        moved, moving = ((self.free @ values).reshape(-1, 6) for values in (coordinates, rates))
        poses, momenta = [], []
        for k, (body, vector) in enumerate(zip(self.system.bodies, self.rotations(coordinates), strict=True)):
            orientation = Rotation.from_rotvec(vector) * Rotation.from_matrix(self.pose[1][k])
            matrix = orientation.as_matrix()
            poses.append([*(self.pose[0][k] + moved[k, :3]), *orientation.as_quat(scalar_first=True)])
            momenta.append([*moving[k, :3], *(matrix @ np.array(body.inertia) @ matrix.T @ moving[k, 3:])])
        return np.array(poses), np.array(momenta)

    def _bend(self, axes: _Axes) -> FloatArray:
        """Second derivatives of the displacements of axes by the coordinates."""
        curvatures, gradients = axes.curvatures(), axes.gradients()
        for k, inertia in enumerate(self._inertias):
            turned = slice(6 * k + 3, 6 * k + 6)
            if inertia is not None:
                bent = _cross(gradients[:, turned] @ np.linalg.inv(inertia)) @ inertia
                curvatures[:, turned, turned] += 0.5 * (bent + bent.swapaxes(1, 2))
        return np.asarray(self.free.T @ curvatures @ self.free)

    @cached_property
    def _inertias(self) -> list[FloatArray | None]:
        """Of each body in the pose; None where its rotation needs no correction."""
        return [
            rotation @ np.array(body.inertia) @ rotation.T if body.motion is MotionKind.SIX else None
            for body, rotation in zip(self.system.bodies, self.pose[1], strict=True)
        ]

    def _arm(self, body: int, place: Sequence[float]) -> FloatArray:
        return np.asarray(self.pose[1][body] @ (np.array(place) - self.system.bodies[body].center))


@dataclass(frozen=True, eq=False)
class _Axes:
    """The axes as they stand in a pose; the base has the number B."""

    bodies: int
    body: NDArray[np.intp]
    support: NDArray[np.intp]
    direction: FloatArray  # n, shape (M, 3)
    arm: FloatArray  # r, shape (M, 3) [m]
    support_arm: FloatArray  # s, shape (M, 3) [m]
    springs: FloatArray

    @classmethod
    def from_pose(cls, system: MountedSystem, pose: Pose) -> _Axes:
        count, axes = len(system.bodies), list(system.axes())
        body = np.array([mount.body for mount, _ in axes])
        support = np.array([mount.support for mount, _ in axes]) % (count + 1)
        place = np.array([mount.place for mount, _ in axes])
        center = np.vstack([[rigid_body.center for rigid_body in system.bodies], np.zeros(3)])
        displacement = np.vstack([pose[0], np.zeros(3)])
        rotation = np.concatenate([pose[1], np.eye(3)[None]])
        arm, body_arm = (
            np.einsum("mij,mj->mi", rotation[bodies], place - center[bodies]) for bodies in (body, support)
        )
        direction = np.einsum("mij,mj->mi", rotation[support], np.array([axis.direction for _, axis in axes]))
        support_arm = center[body] + displacement[body] + arm - center[support] - displacement[support]
        moved = np.einsum("mi,mi->m", direction, support_arm - body_arm)
        nominal, series = np.array([(axis.nominal, axis.series) for _, axis in axes]).T
        return cls(count, body, support, direction, arm, support_arm, nominal + moved / series)

    def gradients(self) -> FloatArray:
        """First derivatives by displacement and rotation of each body, shape (M, 6B)."""
        count = self.body.size
        gradients = np.zeros((count, self.bodies + 1, 6))
        gradients[np.arange(count), self.body] = np.hstack([self.direction, np.cross(self.arm, self.direction)])
        gradients[np.arange(count), self.support] = -np.hstack(
            [self.direction, np.cross(self.support_arm, self.direction)]
        )
        return gradients[:, :-1].reshape(count, -1)

    def curvatures(self) -> FloatArray:
        """Second derivatives by displacement and rotation of each body, shape (M, 6B, 6B)."""
        count, each = self.body.size, np.arange(self.body.size)
        n_r = np.einsum("mi,mi->m", self.direction, self.arm)[:, None, None] * np.eye(3)
        n, r = self.direction[:, :, None], self.arm[:, None, :]
        translation, rotation = 2 * self.body, 2 * self.body + 1
        carried, turned = 2 * self.support, 2 * self.support + 1
        total = np.zeros((count, 2 * self.bodies + 2, 2 * self.bodies + 2, 3, 3))
        for row, column, block in (
            (turned, translation, _cross(self.direction)),
            (turned, carried, -_cross(self.direction)),
            (turned, rotation, n_r - (n * r).swapaxes(1, 2)),
        ):
            total[each, row, column] += block
            total[each, column, row] += block.swapaxes(1, 2)
        total[each, rotation, rotation] += _bending(self.direction, self.arm)
        total[each, turned, turned] += _bending(self.direction, self.support_arm)
        return total[:, :-2, :-2].swapaxes(2, 3).reshape(count, 6 * self.bodies, 6 * self.bodies)


def _free_coordinates(system: MountedSystem, rotations: FloatArray) -> tuple[FloatArray, float]:
    """`SmallMotion.free` and `SmallMotion.mass`."""
    mean = float(np.mean([body.mass for body in system.bodies]))
    blocks = []
    for body, rotation in zip(system.bodies, rotations, strict=True):
        inertia = rotation @ np.array(body.inertia) @ rotation.T
        for projector, of_body in ((body.translations, body.mass * np.eye(3)), (body.rotations, inertia)):
            values, vectors = np.linalg.eigh(projector)
            basis = vectors[:, values > 0.5]
            blocks.append(basis @ np.linalg.inv(np.linalg.cholesky(basis.T @ of_body @ basis)).T * np.sqrt(mean))
    return block_diag(*blocks), mean


def _bending(direction: FloatArray, arm: FloatArray) -> FloatArray:
    """H(n, r) of the module's equations, shape (M, 3, 3) [m]."""
    product = direction[:, :, None] * arm[:, None, :]
    along = np.einsum("mi,mi->m", direction, arm)[:, None, None] * np.eye(3)
    return np.asarray(0.5 * (product + product.swapaxes(1, 2)) - along)


def _cross(vectors: FloatArray) -> FloatArray:
    """Matrices of the products v x, of vectors of shape (..., 3), shape (..., 3, 3)."""
    return np.asarray(np.cross(vectors[..., None, :], np.eye(3)).swapaxes(-1, -2))
