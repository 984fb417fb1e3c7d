"""The points of a response curve: what the Fourier coefficients of steady motions say to a designer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...ground.result_columns import figure
from ...kernel.arrays import FloatArray
from ...kernel.balance import BalancedSystem
from .continuation import SteadyMotion
from .harmonic_balance import (
    ComplexArray,
    accelerations,
    displacement_limits,
    first_harmonics,
    largest_of_period,
    stacked,
)
from .options import Excitation
from .system import IsolatedMass, StaticEquilibrium


@dataclass(frozen=True)
class ResponsePoint:
    """The steady motion at one frequency."""

    frequency: float = figure("Hz", "frequency")
    # First harmonic of the absolute motion over that of the base; where a force excites, of the force on the base over
    # that force. Its phase is negative where it lags, within [-180, 180).
    transmissibility: float = figure("1", "transmissibility")
    phase: float = figure("deg", "phase")
    # First harmonic of the relative motion over that of the base, or over the exciting force [m/N].
    relative: float = figure("1", "relative motion over base motion")
    relative_phase: float = figure("deg", "relative phase")
    amplitude: float = figure("m", "amplitude of the mount")  # half its stroke, all harmonics
    mean: float = figure("m", "mean displacement of a spring")
    min: float = figure("m", "lowest displacement of a spring")
    max: float = figure("m", "highest displacement of a spring")
    force: float = figure("N", "force on the base")  # first harmonic
    acceleration: float = figure("m/s^2", "acceleration")  # largest of the mass, not relative to the base
    # At the crest of the excitation: a simulation that begins there is steady at once.
    start_displacement: float = figure("m", "displacement of the mount at the crest")
    start_speed: float = figure("m/s", "speed of the mount at the crest")
    start_omega: float = figure("1", "omega at the crest")
    stable: bool = figure("", "stable")  # not between two folds of the curve, where no steady motion stays
    requested: bool = figure("", "requested frequency")  # the others are steps along the curve
    extrapolating: bool = figure("", "outside the identified range")


@dataclass(frozen=True, eq=False)
class ExcitedMass:
    """A mass under one level of excitation.

    Parameters
    ----------
    system : IsolatedMass
    equilibrium : StaticEquilibrium
    excitation : Excitation
    level : float              Amplitude [m], [m/s^2] or [N], > 0.
    balance : BalancedSystem   Of all these.
    """

    system: IsolatedMass
    equilibrium: StaticEquilibrium
    excitation: Excitation
    level: float
    balance: BalancedSystem

    def transmissibility(self, motions: Sequence[SteadyMotion]) -> FloatArray:
        """Transmissibility at each motion, shape (P,) [-]."""
        omega, z = stacked(self.balance, motions)
        return np.abs(self._ratio(omega, first_harmonics(z[:, 0])))

    def columns(self, motions: Sequence[SteadyMotion]) -> dict[str, NDArray[Any]]:
        """The attributes of `ResponsePoint` over all motions, each of shape (P,)."""
        system, basis = self.system, self.balance.basis
        omega, z = stacked(self.balance, motions)
        of_mount = z[:, 0] + 0.0
        of_mount[:, 0] += system.mount.series * self.equilibrium.displacement
        figures = np.array([motion.motion.figures[0] for motion in motions])
        low, high, start_omega = figures[:, :3].T
        base, first = self.excitation.base_amplitude(self.level, omega), first_harmonics(of_mount)
        absolute = accelerations(self.balance, motions)[:, 0] - np.outer(omega**2 * base, basis.functions[1])
        ratio = self._ratio(omega, first)
        relative = first / (self.level if self.excitation is Excitation.FORCE else base)
        ends = np.array([[system.spring.displacement_min], [system.spring.displacement_max]])
        within_low, within_high = displacement_limits(ends[0], ends[1], extrapolate=False)
        rates = basis.order[basis.harmonics + 1 :] * of_mount[:, basis.harmonics + 1 :]
        return {
            "frequency": omega / (2.0 * np.pi),
            "transmissibility": np.abs(ratio),
            "phase": _degrees(ratio),
            "relative": np.abs(relative),
            "relative_phase": _degrees(relative),
            "amplitude": 0.5 * system.mount.series * (high - low),
            "mean": of_mount[:, 0] / system.mount.series,
            "min": low,
            "max": high,
            "force": np.abs(self._force(omega, first)),
            "acceleration": largest_of_period(np.abs(absolute)),
            "start_displacement": of_mount[:, : basis.harmonics + 1].sum(axis=1),
            "start_speed": omega * rates.sum(axis=1),
            "start_omega": start_omega,
            "stable": np.array([motion.rising for motion in motions]),
            "requested": np.array([motion.wanted for motion in motions]),
            "extrapolating": (low < within_low) | (high > within_high),
        }

    def _force(self, omega: FloatArray, first: ComplexArray) -> ComplexArray:
        """First harmonic of the force on the base, from the mass's own balance, shape (P,) [N]."""
        inertia = -self.system.mass * omega**2 * (first + self.excitation.base_amplitude(self.level, omega))
        return np.asarray((self.level if self.excitation is Excitation.FORCE else 0.0) - inertia)

    def _ratio(self, omega: FloatArray, first: ComplexArray) -> ComplexArray:
        """Transmissibility with its phase, shape (P,) [-]; see `ResponsePoint`."""
        if self.excitation is Excitation.FORCE:
            return self._force(omega, first) / self.level
        base = self.excitation.base_amplitude(self.level, omega)
        return (first + base) / base


def _degrees(values: ComplexArray) -> FloatArray:
    """Phase within [-180, 180)."""
    angle = np.degrees(np.angle(values))
    return np.where(angle >= 180.0, angle - 360.0, angle)
