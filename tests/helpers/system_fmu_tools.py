"""Systems of bodies on mounts, and their FMUs, for the tests of the FMI layer of systems."""

from __future__ import annotations

import functools
import itertools
from dataclasses import replace

import numpy as np

from native_tools import OK, Library, Native, Native3, unpacked
from springs import TABLE
from strandspring import SpringParameters
from strandspring.core.branches import MaxwellBranch, Mechanism
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.system.system_variables import ForceInput, SystemFmuOptions
from strandspring.vibration.bodies.mounted import MountedSystem
from strandspring.vibration.bodies.parts import MotionKind, Mount, MountAxis, Point, RigidBody, Stops

VERTICAL = SpringParameters((0.0, 20_000.0, 0.0, 1e7), (1.0, 2.0), 30.0, 700.0, 0.8, 0.7, 0.0, -0.03, 0.03)
SHEAR = SpringParameters((0.0, 9000.0, 0.0, 2e7), (1.0,), 20.0, 800.0, 1.0, 1.0, 0.0, -0.03, 0.03)
UP, ACROSS, ALONG = (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)

BOX = MountedSystem(
    (RigidBody("box", 20.0, (0.0, 0.0, 0.0), ((0.25, 0.01, 0.0), (0.01, 0.3, 0.0), (0.0, 0.0, 0.35))),),
    tuple(
        Mount(
            f"corner {k}", 0, (x, y, -0.12),
            (MountAxis(VERTICAL, UP, 0.002), MountAxis(SHEAR, ACROSS, 0.0), MountAxis(SHEAR, ALONG, 0.0, damping=5.0)),
        )
        for k, (x, y) in enumerate(itertools.product((-0.15, 0.15), (-0.1, 0.1)), start=1)
    ),
    (Point("circuit board", 0, (0.1, 0.0, 0.05)), Point("c.g.", 0, (0.0, 0.0, 0.0))),
    name="Electronics box",
)  # fmt: skip
BOX_OPTIONS = SystemFmuOptions(1e-4, 1e-3, forces=(ForceInput("recoil", 0, (0.0, 0.1, 0.0), (1.0, 0.0, 0.0)),))

# The box with a second mechanism in its vertical springs, and branches in all.
BRANCHED = BOX.with_springs(
    lambda spring: replace(
        spring,
        second=Mechanism((1.0, 5.0), 12.0, 900.0, 0.9, 1.4) if spring == VERTICAL else None,
        branches=(MaxwellBranch(4e3, 0.004), MaxwellBranch(2e4, 2e-5)),
    )
)

# Two bodies that move along z alone, the upper one in a plane, on springs in series, a table and stops.
STAGES = MountedSystem(
    (
        RigidBody("lower", 30.0, motion=MotionKind.AXIS),
        RigidBody("upper", 8.0, (0.0, 0.0, 0.3), ((0.1, 0.0, 0.0), (0.0, 0.12, 0.0), (0.0, 0.0, 0.1)), MotionKind.PLANE,
                  (0.0, 1.0, 0.0)),
    ),
    (
        Mount("foot", 0, (0.0, 0.0, 0.0), (MountAxis(TABLE, UP, 0.048, parallel=8, series=2),)),
        Mount("left", 1, (-0.1, 0.0, 0.25), (MountAxis(VERTICAL, UP, 0.001), MountAxis(SHEAR, ACROSS, 0.0)), 0),
        Mount("right", 1, (0.1, 0.0, 0.25),
              (MountAxis(VERTICAL, UP, 0.001, stops=Stops(-0.01, np.inf, 1e5)), MountAxis(SHEAR, ACROSS, 0.0)), 0),
    ),
    (Point("top", 1, (0.0, 0.0, 0.4)),),
    name="2 stages",
)  # fmt: skip
STAGES_OPTIONS = SystemFmuOptions(2e-4, 1e-3, omega_start=-1.0)


@functools.cache
def system_library(system: MountedSystem, options: SystemFmuOptions) -> Library:
    """The FMU of a system, built and unpacked once in a session."""
    from strandspring.fmu.system.system_native import build_system_fmu

    return unpacked(lambda folder: build_system_fmu(system, folder, options, chosen_platforms("host")))


class NativeSystem(Native):
    """One instance of the FMU of a system."""

    input = "base_acceleration_x"

    def outputs(self) -> list[float]:
        """All of them, in the order of the description."""
        groups = ("acceleration_", "sway_", "force_", "displacement_", "tilt_", "reaction_", "absorbed_energy")
        return self.get(*(name for name in self.library.references if name.startswith(groups)))

    def run(self, inputs: np.ndarray, size: float) -> np.ndarray:
        """Outputs at the beginning, where the first inputs hold already, and after each step of inputs (C, K)."""
        names = [name for name in self.library.references if name.startswith(("base_acceleration_", "load_"))]
        assert self.set(**dict(zip(names, inputs[:, 0].tolist(), strict=True))) == OK
        rows = [self.outputs()]
        for k, values in enumerate(inputs.T.tolist()):
            assert self.set(**dict(zip(names, values, strict=True))) == OK
            assert self.go(k * size, size) == OK, self.said
            rows.append(self.outputs())
        return np.array(rows)


class NativeSystem3(NativeSystem, Native3):
    """The same of FMI 3.0."""


def shock(system: MountedSystem, options: SystemFmuOptions, bases: int, steps: int, peak: float) -> np.ndarray:
    """Inputs of a half-sine pulse of each acceleration in the first half, and of constant forces."""
    pulse = peak * np.sin(np.clip(np.linspace(0.0, 2.0 * np.pi, steps), 0.0, np.pi))
    forces = [np.full(steps, 0.3 * 9.81 * system.bodies[force.body].mass) for force in options.forces]
    return np.array([*(pulse * (1.0 + 0.2 * k) for k in range(bases)), *forces])
