"""Rigid bodies on hysteretic mounts in time, in the compiled kernel; motion.h derives the method.

The structures of motion.h are filled from arrays: every number in them has eight bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import SpringParameters
from .arrays import FloatArray, address, floats
from .library import library
from .path import Law

# Numbers of each structure of motion.h.
BODY, MOUNT, AXIS, POINT, CHANNEL = 42, 10, 10, 4, 8
_BODY_STATE, _REACH, _AXIS_STATE, _STATE = 31, 9, 13, 22
_SYSTEM, _RECORD = 10, 11
OF_POINT, OF_AXIS, OF_BODY, ENERGIES = 18, 8, 2, 9


@dataclass(frozen=True, eq=False)
class MotionFigures:
    """What a run gives, as in MotionRecord of motion.h.

    Attributes
    ----------
    steps : int                           Done; fewer than asked for if the motion diverged.
    of_points : ndarray, shape (P, 18)
    of_axes : ndarray, shape (A, 8)
    of_bodies : ndarray, shape (B, 2)
    energies : ndarray, shape (9,)        [J].
    """

    steps: int
    of_points: FloatArray
    of_axes: FloatArray
    of_bodies: FloatArray
    energies: FloatArray


@dataclass(frozen=True, eq=False)
class Histories:
    """Time histories of a run, the first row at its beginning.

    Attributes
    ----------
    time : ndarray, shape (K,)                      [s].
    acceleration, sway : ndarray, shape (K, P, 3)   Of the points, absolute and from the nominal pose [m/s^2], [m].
    displacement, force : ndarray, shape (K, A)     Of one spring, and of the axis [m], [N].
    """

    time: FloatArray
    acceleration: FloatArray
    sway: FloatArray
    displacement: FloatArray
    force: FloatArray


class MotionSolver:
    """Rest and motion of bodies on mounts; its calls release the interpreter's lock and may run in many threads.

    Parameters
    ----------
    bodies : array_like, shape (B, 42)    MotionBody of motion.h.
    mounts : array_like, shape (M, 10)    MotionMount.
    springs : sequence of SpringParameters   Of each axis.
    axes : array_like, shape (A, 10)      MotionAxis without its law.
    points : array_like, shape (P, 4)     MotionPoint.
    """

    def __init__(
        self,
        bodies: FloatArray,
        mounts: FloatArray,
        springs: Sequence[SpringParameters],
        axes: FloatArray,
        points: FloatArray,
    ) -> None:
        laws = {spring: Law(spring, energies=True) for spring in dict.fromkeys(springs)}
        self._laws = tuple(laws.values())  # kept alive
        self._bodies, self._mounts, self._points = floats(bodies), floats(mounts), floats(points)
        self._axes = np.zeros((len(springs), 1 + AXIS))
        self._axes.view(np.uint64)[:, 0] = [laws[spring].address for spring in springs]
        self._axes[:, 1:] = axes
        self.bodies, self.mounts, self.axes, self.points = map(
            len, (self._bodies, self._mounts, self._axes, self._points)
        )

    @property
    def nominal_pose(self) -> FloatArray:
        """Displacement [m] and unit quaternion of each body in the nominal pose, shape (B, 7)."""
        return np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (self.bodies, 1))

    def senses(self, forces: FloatArray) -> FloatArray:
        """Sense of the static force of each axis, shape (A,): -1, or 1 also where it is 0 up to rounding."""
        sense, axes = library().motion_sense, self._axes
        return np.array([sense(address(axis), force) for axis, force in zip(axes, forces.tolist(), strict=True)])

    def rest(
        self, gravity: FloatArray, omega: FloatArray, pose: FloatArray | None = None
    ) -> tuple[FloatArray, float, bool]:
        """The pose in which the bodies rest while each axis has its omega.

        Parameters
        ----------
        gravity : ndarray, shape (3,)    [m/s^2].
        omega : ndarray, shape (A,)
        pose : ndarray or None, shape (B, 7)   Where to begin: displacement of the centre of gravity [m], unit
                                         quaternion; by default in the nominal pose.

        Returns
        -------
        ndarray, shape (B, 7)            The pose.
        float                            The unbalance that remains [N].
        bool                             Whether it was found.
        """
        found, unbalance = np.array(self.nominal_pose if pose is None else pose, dtype=np.float64), np.zeros(1)
        gravity, omega = floats(gravity), floats(omega)
        none = np.empty((0, CHANNEL))
        system, state = self._system(none), _State(self)
        is_found = library().motion_rest(
            address(system), address(gravity), address(omega), state.address, address(found), address(unbalance)
        )
        return found, float(unbalance[0]), bool(is_found)

    def run(
        self,
        channels: FloatArray,
        values: FloatArray,
        step: float,
        gravity: FloatArray,
        pose: FloatArray,
        omega: FloatArray,
        velocity: FloatArray,
        settled: int = 0,
    ) -> MotionFigures:
        """Motion from rest in a pose under channel values that are averages over the steps.

        Parameters
        ----------
        channels : ndarray, shape (C, 8)    MotionChannel of motion.h.
        values : ndarray, shape (C, K)      A step's average of each channel.
        step : float                        [s].
        gravity, velocity : ndarray, shape (3,)   [m/s^2]; of all bodies at the beginning [m/s].
        pose : ndarray, shape (B, 7)        At the beginning.
        omega : ndarray, shape (A,)         Of each axis' springs at the beginning.
        settled : int                       The step from which means are taken.
        """
        return self._run(channels, values, step, (gravity, pose, omega, velocity), settled)

    def run_with_histories(
        self,
        channels: FloatArray,
        values: FloatArray,
        step: float,
        gravity: FloatArray,
        pose: FloatArray,
        omega: FloatArray,
        velocity: FloatArray,
        settled: int = 0,
        stride: int = 1,
    ) -> tuple[MotionFigures, Histories]:
        """The same motion as `run` with its histories, of which a row is kept every `stride` steps."""
        rows = values.shape[1] // stride + 1
        shapes = ((rows, self.points, 3), (rows, self.points, 3), (rows, self.axes), (rows, self.axes))
        histories = [np.zeros(shape) for shape in shapes]
        figures = self._run(channels, values, step, (gravity, pose, omega, velocity), settled, stride, histories)
        time = floats(step * stride * np.arange(figures.steps // stride + 1))
        return figures, Histories(time, *(history[: time.size] for history in histories))

    def _run(
        self,
        channels: FloatArray,
        values: FloatArray,
        step: float,
        beginning: Sequence[FloatArray],
        settled: int,
        stride: int = 1,
        histories: Sequence[FloatArray] = (),
    ) -> MotionFigures:
        """A run from gravity, pose, omega and velocity, which fills the histories."""
        channels, values = floats(channels), floats(values)
        arrays = [floats(array) for array in beginning]
        system, state = self._system(channels), _State(self)
        library().motion_begin(address(system), state.address, *map(address, arrays))
        figures = [np.zeros((self.points, OF_POINT)), np.zeros((self.axes, OF_AXIS)), np.zeros((self.bodies, OF_BODY))]
        energies = np.zeros(ENERGIES)
        record = np.zeros(_RECORD, dtype=np.uint64)
        record[:4] = [*map(address, figures), address(energies)]
        record[4 : 4 + len(histories)] = [address(history) for history in histories]
        workspace = np.empty(library().motion_workspace(self.bodies, self.axes, self.points))
        record[8:] = address(workspace), stride, settled
        steps = library().motion_run(
            address(system), state.address, values.shape[1], step, address(values), address(record)
        )
        of_points, of_axes, of_bodies = figures
        return MotionFigures(int(steps), of_points, of_axes, of_bodies, energies)

    def _system(self, channels: FloatArray) -> NDArray[np.uint64]:
        system = np.zeros(_SYSTEM, dtype=np.uint64)
        parts = (self._bodies, self._mounts, self._axes, self._points, channels)
        system[:5] = [len(part) for part in parts]
        system[5:] = [address(part) for part in parts]
        return system


class _State:
    """Memory of a MotionState."""

    def __init__(self, solver: MotionSolver) -> None:
        self._parts = [
            np.zeros((solver.bodies, _BODY_STATE)),
            np.zeros((solver.mounts, _REACH)),
            np.zeros((solver.axes, _AXIS_STATE)),
        ]
        self._memory = np.zeros(_STATE)
        self._memory.view(np.uint64)[-3:] = [address(part) for part in self._parts]

    @property
    def address(self) -> int:
        """Where the kernel finds it; valid while it lives."""
        return address(self._memory)
