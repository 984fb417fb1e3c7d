"""A rigid body on hysteretic mounts in Exudyn: springs as user functions, their omegas as a first-order ODE.

Everything of rigid bodies is Exudyn's: finite rotations, markers, connectors, loads, the integrator of Lie groups; the
spring is that of the oracles. The frame is that of the base: its acceleration is a load proportional to the mass. Each
mount stands on the base and has axes along z downwards, x and y, in this order.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from oracles import rate_of_omega, spring_force
from strandspring.vibration.bodies.loads import LoadCase
from strandspring.vibration.bodies.mounted import MountedSystem
from tools import tool

FloatArray = NDArray[np.float64]
ORDER, SENSES = [1, 2, 0], np.array([1.0, 1.0, -1.0])  # of the axes of a mount, along x, y and z


def exudyn_acceleration(
    system: MountedSystem, case: LoadCase, step: float, pose: FloatArray, every: int = 1
) -> FloatArray:
    """Acceleration of the points, not relative to the base (K, Q, 3) [m/s^2], by Runge and Kutta's method of fourth
    order, of one body that begins with this displacement and rotation vector, and with omega 0.
    """
    exudyn, items = tool("exudyn"), tool("exudyn.itemInterface")
    (body,), count = system.bodies, len(system.axes)
    mbs: Any = exudyn.SystemContainer().AddSystem()
    center, inertia, zeros = np.array(body.center), np.array(body.inertia), [0.0] * count
    node = mbs.AddNode(items.NodeRigidBodyRotVecLG(
        referenceCoordinates=[*body.center, 0.0, 0.0, 0.0], initialCoordinates=pose.tolist(),
        initialVelocities=[*case.velocity, 0.0, 0.0, 0.0],
    ))  # fmt: skip
    moments = [inertia[i] for i in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))]
    rigid = mbs.AddObject(items.ObjectRigidBody(mass=body.mass, inertia=moments, nodeNumber=node))
    ground = mbs.AddObject(items.ObjectGround())
    hysteresis = mbs.AddNode(items.NodeGenericODE1(
        numberOfODE1Coordinates=count, referenceCoordinates=zeros, initialCoordinates=zeros
    ))  # fmt: skip
    kinds, current = exudyn.OutputVariableType, exudyn.ConfigurationType.Current
    places = [np.array(mount.place) - center for mount in system.mounts]

    def marker(owner: Any, place: FloatArray) -> Any:
        return mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=owner, localPosition=place.tolist()))

    def along(vector: Any) -> list[float]:
        """Of the springs of a mount."""
        return [float(part) for part in (SENSES * vector)[[2, 0, 1]]]

    def omega_rates(mbs: Any, _: float, __: int, omegas: FloatArray) -> list[float]:
        rates: list[float] = []
        for place in places:
            rates += along(mbs.GetObjectOutputBody(rigid, kinds.Velocity, place.tolist(), current))
        rows = zip(system.axes, rates, omegas, strict=True)
        return [rate_of_omega(axis.spring, rate / axis.series, float(omega)) for axis, rate, omega in rows]

    def pull_of(first: int) -> Any:
        def pull(mbs: Any, _: float, __: int, moved: Any, velocity: Any, *___: Any) -> list[float]:
            omegas, pulls = mbs.GetNodeOutput(hysteresis, kinds.Coordinates, current)[first : first + 3], []
            for axis, d, rate, omega in zip(system.axes[first:], along(moved), along(velocity), omegas, strict=False):
                x = axis.nominal + d / axis.series - axis.spring.displacement_offset
                pulls.append(axis.parallel * spring_force(axis.spring, x, float(omega)) + axis.damping * rate)
            return (SENSES * np.array(pulls)[ORDER]).tolist()

        return pull

    def base(t: float) -> FloatArray:
        return sum((c.signal.value(t) * np.array(c.direction) for c in case.channels), np.zeros(3))  # type: ignore[attr-defined]

    def weight(_: Any, t: float, __: Any) -> Any:
        return (body.mass * (np.array(system.gravity) - base(t))).tolist()

    mbs.AddObject(items.ObjectGenericODE1(nodeNumbers=[hysteresis], rhsUserFunction=omega_rates))
    for k, place in enumerate(places):
        ends = [marker(ground, place + center), marker(rigid, place)]
        mbs.AddObject(items.ObjectConnectorCartesianSpringDamper(
            markerNumbers=ends, springForceUserFunction=pull_of(3 * k)
        ))  # fmt: skip
    mbs.AddLoad(items.LoadForceVector(markerNumber=marker(rigid, np.zeros(3)), loadVectorUserFunction=weight))
    sensors = [mbs.AddSensor(items.SensorBody(
        bodyNumber=rigid, storeInternal=True, outputVariableType=kinds.Acceleration,
        localPosition=(np.array(point.place) - center).tolist(),
    )) for point in system.points]  # fmt: skip
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
