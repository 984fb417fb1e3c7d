"""Springs as FMUs in mechanical systems, run by FMPy alone: native and Python-backed, against one ODE of the whole.

Each system is a few lines: masses, what is attached to them, and how they begin. `co_simulated` is all that a simulator
needs, here a leapfrog master: the velocity is known half a step after the position, so that each step moves the masses,
hands every spring its displacement, and reads its force. It is of second order; the largest error at steps of 0.25 ms
is stated beside each system, in units of the motion's range.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave

from oracles import Reference, monolithic
from strandspring import Spring, SpringParameters
from strandspring.cosimulation import Attachment, Plant
from strandspring.examples import recoil, rigid_platform

# Carries about 5 kg at 50 mm of compression, at 11 Hz.
MOUNT = SpringParameters(
    kE=(50.0, 2.0e4, 1.0e5, 2.0e7), kA=(1.0, 10.0, 100.0), kappa_omega=15.0, rho=400.0, sigma=1.0, n=0.5,
    displacement_offset=0.05, displacement_min=0.02, displacement_max=0.08,
)  # fmt: skip
# Loaded both ways.
BUMPER = SpringParameters(
    kE=(0.0, 1.2e4, 4.0e4, 1.0e6), kA=(1.0, 4.0), kappa_omega=60.0, rho=150.0, sigma=1.5, n=0.7,
    displacement_offset=0.0, displacement_min=-0.06, displacement_max=0.08,
)  # fmt: skip


def still(_: float) -> float:
    return 0.0


@dataclass(frozen=True, eq=False)
class System:
    """Masses on springs, and the error that is allowed at a step of 0.25 ms.

    Parameters
    ----------
    plant : Plant                    Masses, loads, and how each spring is attached to them.
    springs : tuple                  Of the attachments.
    stop : float                     [s].
    error : float                    Of positions and forces, in units of their ranges; twice what was measured.
    speed : tuple of float           Velocities at the start [m/s].
    base_velocities : tuple          Of the bases of the springs, for the ODE.
    """

    plant: Plant
    springs: tuple[SpringParameters, ...]
    stop: float
    error: float
    speed: tuple[float, ...] = (0.0,)
    base_velocities: tuple[Callable[[float], float], ...] | None = None


def one_mass() -> System:
    """5 kg on a mount, released under a load."""
    plant = Plant([[5.0]], [Attachment([1.0], 0.05)], lambda _: [90.0])
    return System(plant, (MOUNT,), stop=0.4, error=1.7e-4)


def two_springs_and_a_mass() -> System:
    """25 kg thrown between two springs, one before and one behind it; q stretches one and compresses the other."""
    plant = Plant([[25.0]], [Attachment([1.0]), Attachment([-1.0])])
    return System(plant, (BUMPER, BUMPER), stop=0.4, error=4e-5, speed=(1.5,))


def isolator() -> System:
    """A box on four mounts in heave, pitch and roll on ground that waves, released under its weight."""
    corners = rigid_platform.CORNERS

    def velocity(corner: rigid_platform.Corner) -> Callable[[float], float]:
        omega = rigid_platform.FREQUENCY
        return lambda t: corner.share * rigid_platform.WAVE * omega * math.cos(omega * (t - corner.lag))

    return System(
        rigid_platform.plant(), tuple(corner.spring for corner in corners), stop=0.4, error=8e-5, speed=(0.0, 0.0, 0.0),
        base_velocities=tuple(map(velocity, corners)),
    )  # fmt: skip


def recoil_of_a_gun() -> System:
    """The recoiling parts between two of the paper's springs, of which one is compressed by what relaxes the other."""
    return System(recoil.plant(), (recoil.SPRING,) * 2, 0.4, error=9e-5, speed=(recoil.IMPULSE / recoil.MASS,))


SYSTEMS = (one_mass, two_springs_and_a_mass, isolator, recoil_of_a_gun)


@cache
def expected(system: Callable[[], System]) -> tuple[System, Reference]:
    """The system, and its motion by one ODE of masses and springs, every millisecond."""
    made = system()
    times = np.linspace(0.0, made.stop, round(made.stop / 1e-3) + 1)
    motion = monolithic(
        made.plant, made.springs, times, base_velocities=made.base_velocities, velocity=made.speed
    )  # fmt: skip
    assert motion.reversals >= 4 * len(made.springs)  # the springs do run through loops
    return made, motion


@cache
def fmu(spring: SpringParameters, backend: str) -> Path:
    """Built once, and unpacked."""
    folder = Path(_FOLDER.name, f"{backend}{abs(hash(spring))}")
    built = Spring(spring, "spring").build_fmu(folder, backend=backend, zero=0.0, platforms=_PLATFORMS[backend])
    return Path(fmpy.extract(str(built), unzipdir=str(folder / "unpacked")))


_FOLDER = TemporaryDirectory(prefix="strandspring-systems-", ignore_cleanup_errors=True)
_PLATFORMS = {"native": "host", "python": None}


class SpringFmu:
    """One instance of a spring: a displacement in, a force out."""

    def __init__(self, folder: Path, start: float) -> None:
        description = fmpy.read_model_description(str(folder))
        references = {v.name: v.valueReference for v in description.modelVariables}
        self.input, self.output = [references["displacement"]], [references["force"]]
        self.slave = FMU2Slave(
            guid=description.guid, unzipDirectory=str(folder), instanceName="spring",
            modelIdentifier=description.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.setReal(self.input, [start])
        self.slave.exitInitializationMode()

    def force(self) -> float:
        return float(self.slave.getReal(self.output)[0])

    def step(self, time: float, step: float, displacement: float) -> float:
        self.slave.setReal(self.input, [displacement])
        self.slave.doStep(time, step)
        return self.force()

    def close(self) -> None:
        self.slave.terminate()
        self.slave.freeInstance()


def co_simulated(system: System, backend: str, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and forces of the springs at every step by a leapfrog of masses and FMUs."""
    plant, steps = system.plant, round(system.stop / step)
    with ExitStack() as stack:

        def begun(spring: SpringParameters, start: float) -> SpringFmu:
            made = SpringFmu(fmu(spring, backend), start)
            stack.callback(made.close)
            return made

        q = np.zeros(plant.coordinates)
        springs = [begun(*each) for each in zip(system.springs, plant.displacements(0.0, q).tolist(), strict=True)]
        force = np.array([spring.force() for spring in springs])
        velocity = np.array(system.speed)
        positions, forces = [q], [force]
        for k in range(steps):
            acceleration = np.linalg.solve(plant.M, plant.load_at(k * step) + plant.generalized_force(force))
            velocity = velocity + (0.5 if k == 0 else 1.0) * step * acceleration
            q = q + step * velocity
            displacements = plant.displacements((k + 1) * step, q).tolist()
            force = np.array([s.step(k * step, step, x) for s, x in zip(springs, displacements, strict=True)])
            positions.append(q)
            forces.append(force)
    return np.array(positions), np.array(forces)


@pytest.mark.parametrize("backend", ["native", pytest.param("python", marks=pytest.mark.long)])
@pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: system.__name__)
def test_masses_on_fmus_move_as_the_ode_says(system: Callable[[], System], backend: str) -> None:
    made, reference = expected(system)
    errors = []
    for step in (5e-4, 2.5e-4) if backend == "native" else (5e-4,):
        every = round(1e-3 / step)
        position, force = (values[::every] for values in co_simulated(made, backend, step))
        pairs = ((position, reference.q), (force, reference.force))
        errors.append(max(float(np.max(np.abs(one - other) / np.ptp(other, axis=0))) for one, other in pairs))
    print(system.__name__, backend, errors)
    # Of second order: four times as large at twice the step.
    assert errors[-1] < made.error * (1.0 if backend == "native" else 4.0)
    if backend == "native":
        assert errors[0] > 2.0 * errors[1]
