"""Rigid bodies on hysteretic mounts in time, in the compiled kernel; motion.h derives the method."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from ctypes import Structure, addressof, byref
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..core.parameters import SpringParameters
from .arrays import FloatArray, address, floats
from .branches import added_fields
from .library import library
from .path import Law
from .structures import constants, rows, structures


@dataclass(frozen=True, eq=False)
class MotionFigures:
    """What a run gives, as in MotionRecord of motion.h.

    Attributes
    ----------
    steps : int                           Done; fewer than asked for if the motion diverged.
    of_points : ndarray, shape (P, 18)
    of_axes : ndarray, shape (A, 8)
    of_bodies : ndarray, shape (B, 2)
    of_mounts : ndarray, shape (M,)       [N].
    of_base : ndarray, shape (4,)         [N].
    energies : ndarray, shape (9,)        [J].
    """

    steps: int
    of_points: FloatArray
    of_axes: FloatArray
    of_bodies: FloatArray
    of_mounts: FloatArray
    of_base: FloatArray
    energies: FloatArray


@dataclass(frozen=True, eq=False)
class Histories:
    """Time histories of a run, the first row at its beginning.

    Attributes
    ----------
    time : ndarray, shape (K,)                      [s].
    acceleration, sway : ndarray, shape (K, P, 3)   Of the points, absolute and from the nominal pose [m/s^2], [m].
    after_jump : ndarray, shape (K, P, 3)           The acceleration once a load has jumped there [m/s^2].
    displacement, force : ndarray, shape (K, A)     Of one spring, and of the axis [m], [N].
    """

    time: FloatArray
    acceleration: FloatArray
    after_jump: FloatArray
    sway: FloatArray
    displacement: FloatArray
    force: FloatArray


class MotionSolver:
    """Rest and motion of bodies on mounts; its calls release the interpreter's lock and may run in many threads.

    Parameters
    ----------
    springs : sequence of SpringParameters   Of each axis.
    coupled : bool                           Whether the friction of the axes of each mount acts together.
    bodies : ndarray, shape (B,)             MotionBody of motion.h, as `rows` makes it; likewise the others.
    mounts : ndarray, shape (M,)             MotionMount.
    axes : ndarray, shape (A,)               MotionAxis; their laws are filled in.
    points : ndarray, shape (P,)             MotionPoint.
    """

    def __init__(
        self,
        springs: Sequence[SpringParameters],
        coupled: bool,
        *,
        bodies: NDArray[np.void],
        mounts: NDArray[np.void],
        axes: NDArray[np.void],
        points: NDArray[np.void],
    ) -> None:
        every = {spring: _Spring(spring) for spring in dict.fromkeys(springs)}
        self._springs = tuple(every.values())  # kept alive
        self._axes = axes.copy()
        for name in ("law", "second", "added"):
            self._axes[name] = [getattr(every[spring], name) for spring in springs]
        self._parts = {"body": bodies, "mount": mounts, "axis": self._axes, "point": points}
        self._coupled = coupled
        self.bodies, self.mounts, self.axes, self.points = map(len, self._parts.values())

    @property
    def nominal_pose(self) -> FloatArray:
        """Displacement [m] and unit quaternion of each body in the nominal pose, shape (B, 7)."""
        return np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (self.bodies, 1))

    def senses(self, forces: FloatArray) -> FloatArray:
        """Sense of the static force of each axis, shape (A,): -1, or 1 also where it is 0 up to rounding."""
        sense, first, size = library().motion_sense, address(self._axes), self._axes.itemsize
        return np.array([sense(first + k * size, force) for k, force in enumerate(forces.tolist())])

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
        pose_at_rest, unbalance = np.array(self.nominal_pose if pose is None else pose, dtype=np.float64), np.zeros(1)
        gravity, omega = floats(gravity), floats(omega)
        system, state = self._system(rows("MotionChannel", 0)), _State(self)
        outputs = pose_at_rest, unbalance, np.empty(constants()["MOTION_REST"])
        is_found = library().motion_rest(
            byref(system), address(gravity), address(omega), state.address, *map(address, outputs)
        )
        return pose_at_rest, float(unbalance[0]), bool(is_found)

    def run(
        self,
        channels: NDArray[np.void],
        values: FloatArray,
        step: float,
        gravity: FloatArray,
        pose: FloatArray,
        omega: FloatArray,
        velocity: FloatArray,
        settled: int = 0,
        stride: int | None = None,
        ends_at_turns: bool = True,
    ) -> tuple[MotionFigures, Histories]:
        """Motion from rest in a pose under channel values that are averages over the steps.

        Parameters
        ----------
        channels : ndarray, shape (C,)      MotionChannel of motion.h.
        values : ndarray, shape (C, K)      A step's average of each channel.
        step : float                        [s].
        gravity, velocity : ndarray, shape (3,)   [m/s^2]; of all bodies at the beginning [m/s].
        pose : ndarray, shape (B, 7)        At the beginning.
        omega : ndarray, shape (A,)         Of each axis' springs at the beginning.
        settled : int                       The step from which means are taken.
        stride : int or None                Steps between rows of the histories; None: the beginning only.
        ends_at_turns : bool                Whether steps end early where springs turn or meet stops: without, the error
                                            has jumps.
        """
        system, state = self._begun(channels, (gravity, pose, omega, velocity))
        stride = values.shape[1] + 1 if stride is None else stride
        return self._run(system, state, values, step, settled, stride, ends_at_turns)

    def repeated(
        self,
        channels: NDArray[np.void],
        values: FloatArray,
        step: float,
        gravity: FloatArray,
        pose: FloatArray,
        omega: FloatArray,
        momenta: FloatArray,
        stride: int = 1,
    ) -> Iterator[Histories]:
        """Histories of one period after the other under the same channel values, until the motion diverges.

        Parameters
        ----------
        momenta : ndarray, shape (B, 6)   At the beginning: V and L of motion.h [m/s], [kg m^2/s]; the others as of
                                          `run`.
        """
        system, state = self._begun(channels, (gravity, pose, omega, np.zeros(3)))
        state.set_momenta(momenta)
        done = values.shape[1]
        while done == values.shape[1]:
            figures, histories = self._run(system, state, values, step, 0, stride)
            done = figures.steps
            yield histories

    def _begun(self, channels: NDArray[np.void], beginning: Sequence[FloatArray]) -> tuple[Structure, _State]:
        """The system under its channels, and its state at the beginning: gravity, pose, omega and velocity."""
        arrays = [floats(array) for array in beginning]
        system, state = self._system(channels), _State(self)
        library().motion_begin(byref(system), state.address, *map(address, arrays))
        return system, state

    def _run(
        self,
        system: Structure,
        state: _State,
        values: FloatArray,
        step: float,
        settled: int,
        stride: int,
        ends_at_turns: bool = True,
    ) -> tuple[MotionFigures, Histories]:
        """A run from a state, which goes on."""
        values, row_count = floats(values), values.shape[1] // stride + 1
        figures = {
            "of_points": np.zeros((self.points, constants()["MOTION_OF_POINT"])),
            "of_axes": np.zeros((self.axes, constants()["MOTION_OF_AXIS"])),
            "of_bodies": np.zeros((self.bodies, constants()["MOTION_OF_BODY"])),
            "of_mounts": np.zeros(self.mounts),
            "of_base": np.zeros(constants()["MOTION_OF_BASE"]),
            "energies": np.zeros(constants()["MOTION_ENERGIES"]),
        }
        histories = {
            "accelerations": np.zeros((row_count, self.points, 3)),
            "after_jumps": np.zeros((row_count, self.points, 3)),
            "sway": np.zeros((row_count, self.points, 3)),
            "displacements": np.zeros((row_count, self.axes)),
            "forces": np.zeros((row_count, self.axes)),
        }
        workspace = np.empty(library().motion_workspace(self.bodies, self.mounts, self.axes, self.points))
        arrays = {**figures, **histories, "workspace": workspace}
        record = structures()["MotionRecord"](
            stride=stride,
            settled=settled,
            turns=ends_at_turns * (self.axes + 1),
            **{name: address(array) for name, array in arrays.items()},
        )
        steps = int(
            library().motion_run(byref(system), state.address, values.shape[1], step, address(values), byref(record))
        )
        time = floats(step * stride * np.arange(steps // stride + 1))
        return (
            MotionFigures(steps, **figures),
            Histories(time, *(history[: time.size] for history in histories.values())),
        )

    def _system(self, channels: NDArray[np.void]) -> Structure:
        counts = {"bodies": self.bodies, "mounts": self.mounts, "axes": self.axes, "points": self.points}
        parts = {name: address(part) for name, part in self._parts.items()}
        return structures()["MotionSystem"](
            **counts, channels=len(channels), coupled=self._coupled, **parts, channel=address(channels)
        )


class _Spring:
    """Where the kernel finds the laws of a spring's mechanisms, and what it has beside the paper's; 0 for nothing."""

    def __init__(self, spring: SpringParameters) -> None:
        self._laws = [Law(mechanism, energies=True) for mechanism in spring.mechanisms]
        self._added = None if spring.is_plain else structures()["SpringAdded"](**added_fields(spring))
        self.law, self.second = self._laws[0].address, self._laws[1].address if spring.second is not None else 0
        self.added = addressof(self._added) if self._added is not None else 0


class _State:
    """Memory of a MotionState."""

    def __init__(self, solver: MotionSolver) -> None:
        self._parts = {
            "body": rows("MotionBodyState", solver.bodies),
            "reach": rows("MotionReach", solver.mounts),
            "axis": rows("MotionAxisState", solver.axes),
            "added": rows("SpringAddedMemory", solver.axes),
        }
        self._memory = structures()["MotionState"](**{name: address(part) for name, part in self._parts.items()})

    @property
    def address(self) -> int:
        """Where the kernel finds it; valid while it lives."""
        return addressof(self._memory)

    def set_momenta(self, momenta: FloatArray) -> None:
        """Let the bodies move with V and L, shape (B, 6)."""
        self._parts["body"]["V"], self._parts["body"]["L"] = momenta[:, :3], momenta[:, 3:]
