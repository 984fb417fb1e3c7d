"""A rigid body on hysteretic mounts in Exudyn: springs as user functions, their omegas as a first-order ODE.

Everything of rigid bodies is Exudyn's: finite rotations, markers, connectors, loads, the integrator of Lie groups. Of
the spring there is the paper's force (eq. 10) and its rate of omega (eq. 11), written for plain numbers. The frame is
that of the base: a base acceleration is a load proportional to the mass. Mounts have three axes along x, y and z of
the base, in any order and sense, and stand on the base.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strandspring.vibration.bodies.loads import ChannelKind, LoadCase
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import BASE, MotionKind, Mount, MountAxis, RigidBody
from tools import tool

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ExudynMotion:
    """At K times: place of the centre of gravity relative to the nominal pose (K, 3) [m], orientation (K, 3, 3), and
    acceleration of the points, not relative to the base (K, Q, 3) [m/s^2].
    """

    time: FloatArray
    displacement: FloatArray
    orientation: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True)
class _Axis:
    """One axis of a mount: which coordinate it is along, in which sense, and where its omega stands."""

    axis: MountAxis
    coordinate: int
    sense: float
    number: int

    def force(self, displacement: float, rate: float, omega: float) -> float:
        p, x = self.axis.spring, self.position(displacement)
        assert p.displacement_min <= x <= p.displacement_max, "Exudyn's springs end with the identified range"
        x -= p.displacement_offset
        elastic, amplifier = (sum(c * x**i for i, c in enumerate(cs)) for cs in (p.kE, p.kA))
        pull = self.axis.parallel * (elastic + p.kappa_omega * omega * amplifier)
        return self.sense * (pull + self.axis.damping * self.sense * rate)

    def position(self, displacement: float) -> float:
        return self.axis.nominal + self.sense * displacement / self.axis.series

    def omega_rate(self, rate: float, omega: float) -> float:
        p, x_rate = self.axis.spring, self.sense * rate / self.axis.series
        signs = math.copysign(1.0, x_rate) * math.copysign(1.0, omega)
        return p.rho * x_rate * (1.0 - (p.sigma * signs - p.sigma + 1.0) * abs(omega) ** p.n)


def _axes_of(mounts: tuple[Mount, ...]) -> list[list[_Axis]]:
    """By mount and, within it, by coordinate."""
    found, number = [], 0
    for mount in mounts:
        axes = []
        for axis in mount.axes:
            (coordinate,) = np.flatnonzero(axis.direction).tolist()
            axes.append(_Axis(axis, coordinate, axis.direction[coordinate], number))
            number += 1
        found.append(sorted(axes, key=lambda one: one.coordinate))
    return found


def exudyn_motion(
    system: MountedSystem, case: LoadCase, step: float, omega: float, pose: FloatArray, every: int = 1
) -> ExudynMotion:
    """Integrate by Runge and Kutta's method of fourth order.

    Parameters
    ----------
    system : MountedSystem     Of one body in six degrees of freedom.
    case : LoadCase            With base accelerations of class `Course`.
    omega : float              Of all axes at the beginning.
    pose : ndarray, (6,)       Displacement and rotation vector of the body at the beginning.
    every : int                Steps from one result to the next.
    """
    exudyn, items = tool("exudyn"), tool("exudyn.itemInterface")

    (body,) = system.bodies
    assert body.motion is MotionKind.SIX
    assert all(mount.support == BASE and len(mount.axes) == 3 for mount in system.mounts)
    assert all(channel.kind is ChannelKind.BASE_ACCELERATION for channel in case.channels)
    container = exudyn.SystemContainer()
    mbs: Any = container.AddSystem()
    center = np.array(body.center)
    rigid = _rigid_body(mbs, body, pose, case)
    ground = mbs.AddObject(items.ObjectGround())

    def marker(owner: Any, place: FloatArray) -> Any:
        return mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=owner, localPosition=place.tolist()))

    mounts = _axes_of(system.mounts)
    count = 3 * len(mounts)
    hysteresis = mbs.AddNode(
        items.NodeGenericODE1(
            numberOfODE1Coordinates=count, referenceCoordinates=[0.0] * count, initialCoordinates=[omega] * count
        )
    )
    places = [np.array(mount.place) - center for mount in system.mounts]

    def omega_rates(mbs: Any, _: float, __: int, omegas: FloatArray) -> list[float]:
        rates = [0.0] * count
        for axes, place in zip(mounts, places, strict=True):
            velocity = mbs.GetObjectOutputBody(
                rigid, exudyn.OutputVariableType.Velocity, place.tolist(), exudyn.ConfigurationType.Current
            )
            for one in axes:
                rates[one.number] = one.omega_rate(float(velocity[one.coordinate]), float(omegas[one.number]))
        return rates

    mbs.AddObject(items.ObjectGenericODE1(nodeNumbers=[hysteresis], rhsUserFunction=omega_rates))

    def pull_of(axes: list[_Axis]) -> Callable[..., list[float]]:
        def pull(mbs: Any, _: float, __: int, moved: FloatArray, velocity: FloatArray, *___: Any) -> list[float]:
            omegas = mbs.GetNodeOutput(
                hysteresis, exudyn.OutputVariableType.Coordinates, exudyn.ConfigurationType.Current
            )
            return [
                one.force(float(moved[one.coordinate]), float(velocity[one.coordinate]), float(omegas[one.number]))
                for one in axes
            ]

        return pull

    for axes, mount, place in zip(mounts, system.mounts, places, strict=True):
        ends = [marker(ground, np.array(mount.place)), marker(rigid, place)]
        mbs.AddObject(
            items.ObjectConnectorCartesianSpringDamper(markerNumbers=ends, springForceUserFunction=pull_of(axes))
        )

    def base(t: float) -> FloatArray:
        return sum((c.signal.value(t) * np.array(c.direction) for c in case.channels), np.zeros(3))

    def weight(_: Any, t: float, __: Any) -> list[float]:
        return (body.mass * (np.array(system.gravity) - base(t))).tolist()

    mbs.AddLoad(items.LoadForceVector(markerNumber=marker(rigid, np.zeros(3)), loadVectorUserFunction=weight))
    kinds = exudyn.OutputVariableType
    sensors = [
        mbs.AddSensor(items.SensorBody(bodyNumber=rigid, storeInternal=True, outputVariableType=kind, localPosition=at))
        for kind, at in (
            (kinds.Displacement, [0.0, 0.0, 0.0]),
            (kinds.RotationMatrix, [0.0, 0.0, 0.0]),
            *((kinds.Acceleration, (np.array(point.place) - center).tolist()) for point in system.points),
        )
    ]
    mbs.Assemble()
    _solve(mbs, case.duration, step, every)
    moved, turned, *points = (np.array(mbs.GetSensorStoredData(sensor)) for sensor in sensors)
    of_base = np.array([base(t) for t in moved[:, 0].tolist()])
    return ExudynMotion(
        moved[:, 0],
        moved[:, 1:],
        turned[:, 1:].reshape(-1, 3, 3),
        np.stack([point[:, 1:] + of_base for point in points], axis=1),
    )


def _rigid_body(mbs: Any, body: RigidBody, pose: FloatArray, case: LoadCase) -> Any:
    items, inertia = tool("exudyn.itemInterface"), np.array(body.inertia)
    node = mbs.AddNode(
        items.NodeRigidBodyRotVecLG(
            referenceCoordinates=[*body.center, 0.0, 0.0, 0.0],
            initialCoordinates=pose.tolist(),
            initialVelocities=[*case.velocity, 0.0, 0.0, 0.0],
        )
    )
    moments = [inertia[i] for i in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))]
    return mbs.AddObject(items.ObjectRigidBody(mass=body.mass, inertia=moments, nodeNumber=node))


def _solve(mbs: Any, duration: float, step: float, every: int) -> None:
    exudyn = tool("exudyn")
    settings: Any = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(duration / step)
    settings.timeIntegration.endTime = duration
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.explicit.computeEndOfStepAccelerations = True
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = every * step
    mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)
