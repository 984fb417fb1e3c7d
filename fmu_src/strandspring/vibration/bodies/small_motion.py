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

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from ...kernel.arrays import FloatArray
from .mounted import MountedSystem
from .parts import BASE, MotionKind

# Displacements of the centres of gravity, shape (B, 3) [m], and rotation matrices, shape (B, 3, 3).
Pose: TypeAlias = tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class SmallMotion:
    """Small motions about a pose in D free coordinates, lengths of the same mass; B bodies, M axes of mounts.

    Parameters
    ----------
    system : MountedSystem
    pose : Pose
    """

    system: MountedSystem
    pose: Pose

    @classmethod
    def about_nominal(cls, system: MountedSystem) -> SmallMotion:
        """Small motions about the pose in which a system is described."""
        count = len(system.bodies)
        return cls(system, (np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))))

    @cached_property
    def gradients(self) -> FloatArray:
        """First derivatives of the axes' displacements by displacement and rotation of each body, shape (M, 6B)."""
        return self._axes.gradients()

    @property
    def springs(self) -> FloatArray:
        """Displacement of one spring of each axis in the pose, shape (M,) [m]."""
        return self._axes.springs

    @property
    def mass(self) -> float:
        """Of each coordinate, the mean of the bodies' masses [kg]."""
        return float(np.mean([body.mass for body in self.system.bodies]))

    @cached_property
    def free(self) -> FloatArray:
        """Displacement and rotation of each body by the coordinates, shape (6B, D)."""
        blocks = []
        for body, rotation in zip(self.system.bodies, self.pose[1], strict=True):
            inertia = rotation @ np.array(body.inertia) @ rotation.T
            for projector, of_body in ((body.translations, body.mass * np.eye(3)), (body.rotations, inertia)):
                values, vectors = np.linalg.eigh(projector)
                basis = vectors[:, values > 0.5]
                factor = np.linalg.inv(np.linalg.cholesky(basis.T @ of_body @ basis)).T
                blocks.append(basis @ factor * np.sqrt(self.mass))
        return np.asarray(block_diag(*blocks))

    @cached_property
    def along(self) -> FloatArray:
        """Displacement of each axis by the coordinates, shape (M, D)."""
        return np.asarray(self.gradients @ self.free)

    @cached_property
    def damping(self) -> FloatArray:
        """Of the viscous dampers, shape (D, D) [N s/m]."""
        return np.asarray(self.along.T @ (self.system.laws.damping[:, None] * self.along))

    @property
    def weight(self) -> FloatArray:
        """Of the bodies, shape (D,) [N]."""
        gravity = [[*(body.mass * np.array(self.system.gravity)), 0.0, 0.0, 0.0] for body in self.system.bodies]
        return np.asarray(np.ravel(gravity) @ self.free)

    @cached_property
    def bend(self) -> FloatArray:
        """Second derivatives of the axes' displacements by the coordinates, shape (M, D, D) [1/m]."""
        return self._bend(self._axes)

    def geometric(self, forces: FloatArray) -> FloatArray:
        """Stiffness that the forces of the axes give by turning with the bodies and by their arms, shape (D, D) [N/m].

        It is symmetric where the bodies are in equilibrium, and its symmetric part elsewhere.

        Parameters
        ----------
        forces : ndarray, shape (M,)   Of the axes in the pose [N].
        """
        return np.asarray(self.free.T @ np.tensordot(forces, self._axes.curvatures(), 1) @ self.free)

    def stiffness(self, of_axes: FloatArray, forces: FloatArray) -> FloatArray:
        """Stiffness matrix from the stiffness of each axis [N/m] and its force in the pose [N], shape (D, D) [N/m]."""
        return self.along.T @ (of_axes[:, None] * self.along) + self.geometric(forces)

    def stable_step(self, *, tilted: bool = False) -> float:
        """The largest step with which velocity Verlet is stable [s]; infinite if nothing moves.

        The scheme is x' = x + h*v + h^2*a/2, v' = v + h*(a + a')/2, with a' from the force at x' and, in dampers, at
        the velocity v + h*a. For a motion z^n of M x'' + C x' + K x = 0 it demands

            z*(z - 1)^2*M + h^2*z^2*K + h/2*(3*z - 1)*(z - 1)*C = 0,

        whose roots for one degree of freedom stay within the unit circle as long as h^2*k + 4*h*c < 4*m. With symmetric
        matrices each eigenvector gives such an equation, so that the step is stable until h^2*K + 4*h*C - 4*M is
        singular: 1/h is the largest eigenvalue of mu^2*M - mu*C - K/4. K is an upper bound wherever springs move,
        without the stiffness that comes from the turning of forces: against that of the mounts it is as their stroke to
        the size of the body.

        Parameters
        ----------
        tilted : bool          Whether the bodies may turn by any angle from the pose: each mount then counts with its
                               stiffest axis and strongest damper in all directions.
        """
        laws, count = self.system.laws, self.free.shape[1]
        stiffness, damping = (
            (self._in_all_directions(of_axes) if tilted else self.along.T @ (of_axes[:, None] * self.along)) / self.mass
            for of_axes in (laws.steepest, laws.damping)
        )
        companion = np.block([[damping, 0.25 * stiffness], [np.eye(count), np.zeros((count, count))]])
        largest = float(np.linalg.eigvals(companion).real.max())
        return 1.0 / largest if largest > 0.0 else math.inf

    def _in_all_directions(self, of_axes: FloatArray) -> FloatArray:
        """The matrix of stiffness or damping if each mount had the largest of its axes in all directions, (D, D)."""
        total = np.zeros((self.free.shape[1], self.free.shape[1]))
        for mount, axes in zip(self.system.mounts, self.system.axis_slices, strict=True):
            moved = self.point(mount.body, mount.place)
            if mount.support != BASE:
                moved = moved - self.point(mount.support, mount.place)
            total += of_axes[axes].max() * moved.T @ moved
        return total

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
        turned = np.tensordot(self.free.reshape(-1, 6, self.free.shape[1])[:, 3:], coordinates, 1)
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
    def _axes(self) -> _Axes:
        return _Axes.from_pose(self.system, self.pose)

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
        count, mounts, laws = len(system.bodies), system.axis_mounts, system.laws
        body = np.array([mount.body for mount in mounts])
        support = np.array([mount.support for mount in mounts]) % (count + 1)
        place = np.array([mount.place for mount in mounts])
        center = np.vstack([[rigid_body.center for rigid_body in system.bodies], np.zeros(3)])
        displacement = np.vstack([pose[0], np.zeros(3)])
        rotation = np.concatenate([pose[1], np.eye(3)[None]])
        arm, body_arm = (
            np.einsum("mij,mj->mi", rotation[bodies], place - center[bodies]) for bodies in (body, support)
        )
        direction = np.einsum("mij,mj->mi", rotation[support], np.array([axis.direction for axis in system.axes]))
        support_arm = center[body] + displacement[body] + arm - center[support] - displacement[support]
        moved = np.einsum("mi,mi->m", direction, support_arm - body_arm)
        return cls(count, body, support, direction, arm, support_arm, laws.nominal + moved / laws.series)

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


def _bending(direction: FloatArray, arm: FloatArray) -> FloatArray:
    """H(n, r) of the module's equations, shape (M, 3, 3) [m]."""
    product = direction[:, :, None] * arm[:, None, :]
    along = np.einsum("mi,mi->m", direction, arm)[:, None, None] * np.eye(3)
    return np.asarray(0.5 * (product + product.swapaxes(1, 2)) - along)


def _cross(vectors: FloatArray) -> FloatArray:
    """Matrices of the products v x, of vectors of shape (..., 3), shape (..., 3, 3)."""
    return np.asarray(np.cross(vectors[..., None, :], np.eye(3)).swapaxes(-1, -2))
