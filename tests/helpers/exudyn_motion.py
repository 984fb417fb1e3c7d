"""A rigid body on hysteretic mounts in Exudyn: springs as user functions, their omegas as a first-order ODE.

Everything of rigid bodies is Exudyn's: finite rotations, markers, connectors, loads, the integrator of Lie groups. Of
the spring there is the paper's force (eq. 10) and its rate of omega (eq. 11), written for plain numbers. The frame is
that of the base: a base acceleration is a load proportional to the mass. Mounts have three axes along x, y and z of
the base, in any order and sense, and stand on the base.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from strandspring.vibration.bodies.loads import LoadCase
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import MountAxis
from tools import tool

FloatArray = NDArray[np.float64]


class _Axis:
    """One axis of a mount: which coordinate it is along, in which sense, and where its omega stands."""

    def __init__(self, axis: MountAxis, number: int) -> None:
        (self.coordinate,) = np.flatnonzero(axis.direction).tolist()
        self.axis, self.sense, self.number = axis, axis.direction[self.coordinate], number

    def force(self, moved: FloatArray, velocity: FloatArray, omegas: FloatArray) -> float:
        p, axis = self.axis.spring, self.axis
        x = axis.nominal + self.sense * float(moved[self.coordinate]) / axis.series
        assert p.displacement_min <= x <= p.displacement_max, "Exudyn's springs end with the identified range"
        elastic, amplifier = (
            sum(c * (x - p.displacement_offset) ** i for i, c in enumerate(cs)) for cs in (p.kE, p.kA)
        )
        pull = axis.parallel * (elastic + p.kappa_omega * float(omegas[self.number]) * amplifier)
        return float(self.sense * (pull + axis.damping * self.sense * float(velocity[self.coordinate])))

    def omega_rate(self, velocity: FloatArray, omegas: FloatArray) -> float:
        p, omega = self.axis.spring, float(omegas[self.number])
        x_rate = self.sense * float(velocity[self.coordinate]) / self.axis.series
        signs = math.copysign(1.0, x_rate) * math.copysign(1.0, omega)
        return float(p.rho * x_rate * (1.0 - (p.sigma * signs - p.sigma + 1.0) * abs(omega) ** p.n))


def exudyn_acceleration(
    system: MountedSystem, case: LoadCase, step: float, pose: FloatArray, every: int = 1
) -> FloatArray:
    """Acceleration of the points, not relative to the base (K, Q, 3) [m/s^2], by Runge and Kutta's method of fourth
    order, of one body that begins with this displacement and rotation vector, and with omega 0.
    """
    exudyn, items = tool("exudyn"), tool("exudyn.itemInterface")
    (body,) = system.bodies
    container = exudyn.SystemContainer()
    mbs: Any = container.AddSystem()
    center, inertia = np.array(body.center), np.array(body.inertia)
    node = mbs.AddNode(
        items.NodeRigidBodyRotVecLG(
            referenceCoordinates=[*body.center, 0.0, 0.0, 0.0],
            initialCoordinates=pose.tolist(),
            initialVelocities=[*case.velocity, 0.0, 0.0, 0.0],
        )
    )
    moments = [inertia[i] for i in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))]
    rigid = mbs.AddObject(items.ObjectRigidBody(mass=body.mass, inertia=moments, nodeNumber=node))
    ground = mbs.AddObject(items.ObjectGround())

    def marker(owner: Any, place: FloatArray) -> Any:
        return mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=owner, localPosition=place.tolist()))

    mounts, count = [], 0
    for mount in system.mounts:
        axes = sorted((_Axis(axis, count + k) for k, axis in enumerate(mount.axes)), key=lambda one: one.coordinate)
        mounts.append((axes, np.array(mount.place) - center))
        count += len(axes)
    zeros = [0.0] * count
    hysteresis = mbs.AddNode(
        items.NodeGenericODE1(numberOfODE1Coordinates=count, referenceCoordinates=zeros, initialCoordinates=zeros)
    )
    kinds, current = exudyn.OutputVariableType, exudyn.ConfigurationType.Current

    def omega_rates(mbs: Any, _: float, __: int, omegas: FloatArray) -> list[float]:
        rates = [0.0] * count
        for axes, place in mounts:
            velocity = mbs.GetObjectOutputBody(rigid, kinds.Velocity, place.tolist(), current)
            for one in axes:
                rates[one.number] = one.omega_rate(velocity, omegas)
        return rates

    mbs.AddObject(items.ObjectGenericODE1(nodeNumbers=[hysteresis], rhsUserFunction=omega_rates))

    def pull_of(axes: list[_Axis]) -> Callable[..., list[float]]:
        def pull(mbs: Any, _: float, __: int, moved: FloatArray, velocity: FloatArray, *___: Any) -> list[float]:
            omegas = mbs.GetNodeOutput(hysteresis, kinds.Coordinates, current)
            return [one.force(moved, velocity, omegas) for one in axes]

        return pull

    spring = items.ObjectConnectorCartesianSpringDamper
    for axes, place in mounts:
        ends = [marker(ground, place + center), marker(rigid, place)]
        mbs.AddObject(spring(markerNumbers=ends, springForceUserFunction=pull_of(axes)))

    def base(t: float) -> FloatArray:
        return sum((c.signal.value(t) * np.array(c.direction) for c in case.channels), np.zeros(3))  # type: ignore[attr-defined]

    def weight(_: Any, t: float, __: Any) -> Any:
        return (body.mass * (np.array(system.gravity) - base(t))).tolist()

    mbs.AddLoad(items.LoadForceVector(markerNumber=marker(rigid, np.zeros(3)), loadVectorUserFunction=weight))
    sensors = [
        mbs.AddSensor(
            items.SensorBody(
                bodyNumber=rigid, storeInternal=True, outputVariableType=kinds.Acceleration,
                localPosition=(np.array(point.place) - center).tolist(),
            )
        )
        for point in system.points
    ]  # fmt: skip
    mbs.Assemble()
    settings: Any = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(case.duration / step)
    settings.timeIntegration.endTime = case.duration
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.explicit.computeEndOfStepAccelerations = True
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = every * step
    mbs.SolveDynamic(settings, solverType=exudyn.DynamicSolverType.RK44)
    points = [np.array(mbs.GetSensorStoredData(sensor)) for sensor in sensors]
    of_base = np.array([base(t) for t in points[0][:, 0].tolist()])
    return np.stack([point[:, 1:] + of_base for point in points], axis=1)
