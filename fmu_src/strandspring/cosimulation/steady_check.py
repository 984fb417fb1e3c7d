"""A steady motion found by harmonic balance, checked by simulating the built FMU.

The simulation starts on the motion that was found, memory included. If it is a steady motion of the equations, and a
stable one, the last of many periods is the motion that was found; otherwise the simulation has gone elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..isolation.points import ResponsePoint
from ..isolation.system import Excitation, IsolatedMass
from .plants import one_mass
from .simulation import simulate
from .unit import spring_unit

PERIODS = 20
_STEPS = 256  # per period; the master's error is some (2 pi/256)^2/12 of the motion
# Marks of agreement.
_AMPLITUDE = 0.005
_DEGREES = 1.0


@dataclass(frozen=True)
class SteadyCheck:
    """Harmonic balance against co-simulation at one frequency.

    Attributes
    ----------
    frequency : float     [Hz]
    amplitude : float     Half the stroke of the mount in the last period simulated [m].
    difference : float    Of that from the balance's, over the balance's [-].
    phase : float         Of the first harmonic of the mount's motion, less the balance's [degrees].
    """

    frequency: float
    amplitude: float
    difference: float
    phase: float

    @property
    def agrees(self) -> bool:
        """Within half a per cent and one degree."""
        return abs(self.difference) <= _AMPLITUDE and abs(self.phase) <= _DEGREES


def check_steady(
    fmu: Path, system: IsolatedMass, excitation: Excitation, level: float, point: ResponsePoint, periods: int = PERIODS
) -> SteadyCheck:
    """Simulate periods of a steady motion with the FMU of the system's spring.

    Parameters
    ----------
    fmu : Path               Of either back end.
    system, excitation, level   As for `frequency_response`.
    point : ResponsePoint    From it.
    periods : int            To simulate; the last is compared.

    Raises
    ------
    CosimulationError        If the FMU refuses a call.
    """
    circular = 2.0 * math.pi * point.frequency
    strength = {
        Excitation.BASE_DISPLACEMENT: system.mass * circular**2 * level,
        Excitation.BASE_ACCELERATION: -system.mass * level,
        Excitation.FORCE: level,
    }[excitation]
    # In the coordinate of the mount the base rests, and its inertia is a load.
    plant = one_mass(
        system.mass,
        lambda t: system.static_load + strength * math.cos(circular * t),
        damping=system.damping,
        parallel=system.parallel,
        series=system.series,
    )
    with spring_unit(fmu, start={"omega_start": point.start_omega}) as spring:
        motion = simulate(
            plant,
            [spring],
            periods / point.frequency,
            1.0 / (point.frequency * _STEPS),
            q=[point.start_displacement],
            speed=[point.start_speed],
        )
    last = motion.q[-_STEPS - 1 : -1, 0]
    amplitude = 0.5 * float(np.ptp(last))
    harmonic = complex(np.exp(-2j * np.pi * np.arange(_STEPS) / _STEPS) @ last)
    # The phase of the balance is that of the motion over the base's, which for an acceleration points the other way.
    turned = 180.0 if excitation is Excitation.BASE_ACCELERATION else 0.0
    off = math.degrees(math.atan2(harmonic.imag, harmonic.real)) - point.relative_phase - turned
    return SteadyCheck(point.frequency, amplitude, amplitude / point.amplitude - 1.0, (off + 180.0) % 360.0 - 180.0)
