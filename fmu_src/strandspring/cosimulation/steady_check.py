"""A steady motion from harmonic balance, verified by simulating the built FMU.

The simulation starts on this motion, hysteresis state included. If it is a stable steady motion of the equations, the
last of many periods agrees with it; otherwise the simulation diverges from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..ground.result_columns import figure
from ..vibration.one_mass.curve_points import ResponsePoint
from ..vibration.one_mass.options import Excitation
from ..vibration.one_mass.system import IsolatedMass
from .coupled_motion import simulate
from .fmu_spring import FmuSpring
from .plants import one_mass

PERIODS = 20
_STEPS = 256  # per period; the error of the master is about (2 pi/256)^2/12 of the motion
# Tolerances of agreement.
_AMPLITUDE = 0.005
_DEGREES = 1.0


@dataclass(frozen=True)
class SteadyCheck:
    """Harmonic balance against co-simulation at one frequency: the last period simulated."""

    frequency: float = figure("Hz", "frequency", "frequency", "Hz")
    amplitude: float = figure("m", "amplitude of the mount")  # half its stroke
    # Relative to the amplitude of harmonic balance, and of the phase of the first harmonic from its own.
    difference: float = figure("1", "difference of the amplitude", "amplitude off by", "%", 100.0, 3)
    phase: float = figure("deg", "difference of the phase", "phase off by", "deg", digits=3)

    @property
    def agrees(self) -> bool:
        """Whether they agree within half a per cent and one degree."""
        return abs(self.difference) <= _AMPLITUDE and abs(self.phase) <= _DEGREES


def check_steady(
    fmu: Path, system: IsolatedMass, excitation: Excitation, level: float, point: ResponsePoint
) -> SteadyCheck:
    """Simulate a steady motion with the FMU of the system's spring and compare the last period.

    Parameters
    ----------
    fmu : Path               Of either back end.
    system, excitation, level   As for `frequency_response`.
    point : ResponsePoint    Its result.

    Raises
    ------
    CosimulationError        If a call of the FMU fails.
    """
    angular_frequency = 2.0 * math.pi * point.frequency
    load_amplitude = {
        Excitation.BASE_DISPLACEMENT: system.mass * angular_frequency**2 * level,
        Excitation.BASE_ACCELERATION: -system.mass * level,
        Excitation.FORCE: level,
    }[excitation]
    # In the coordinate of the mount the base is fixed, and the inertia force of its motion is a load.
    plant = one_mass(
        system.mass,
        lambda t: system.static_load + load_amplitude * math.cos(angular_frequency * t),
        damping=system.mount.damping,
        parallel=system.mount.parallel,
        series=system.mount.series,
    )
    with FmuSpring(fmu, parameters={"omega_start": point.start_omega}) as spring:
        spring.warns = False  # where the motion leaves the identified range was found before
        motion = simulate(
            plant,
            [spring],
            PERIODS / point.frequency,
            1.0 / (point.frequency * _STEPS),
            q=[point.start_displacement],
            velocity=[point.start_speed],
        )
    last = motion.q[-_STEPS - 1 : -1, 0]
    amplitude = 0.5 * float(np.ptp(last))
    harmonic = complex(np.exp(-2j * np.pi * np.arange(_STEPS) / _STEPS) @ last)
    # The phase of harmonic balance is relative to the base's displacement, which is opposite to its acceleration.
    base_phase = 180.0 if excitation is Excitation.BASE_ACCELERATION else 0.0
    phase = math.degrees(math.atan2(harmonic.imag, harmonic.real)) - point.relative_phase - base_phase
    return SteadyCheck(point.frequency, amplitude, amplitude / point.amplitude - 1.0, (phase + 180.0) % 360.0 - 180.0)
