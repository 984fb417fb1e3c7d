"""Excitations: displacement [m], velocity [m/s] and acceleration [m/s^2] of a base at a time [s]."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..ground.gravity import STANDARD_GRAVITY

GRAVITY = STANDARD_GRAVITY  # m/s^2


@dataclass(frozen=True)
class Sine:
    """amplitude*sin(2 pi frequency t) [m], [Hz]."""

    amplitude: float
    frequency: float

    @property
    def _angular_frequency(self) -> float:
        return 2.0 * math.pi * self.frequency

    def displacement(self, t: float) -> float:
        return self.amplitude * math.sin(self._angular_frequency * t)

    def velocity(self, t: float) -> float:
        return self.amplitude * self._angular_frequency * math.cos(self._angular_frequency * t)

    def acceleration(self, t: float) -> float:
        return -self.amplitude * self._angular_frequency**2 * math.sin(self._angular_frequency * t)


@dataclass(frozen=True)
class Sweep:
    """A sine of constant amplitude [m] whose frequency rises linearly from `low` to `high` [Hz] in `duration` [s]."""

    amplitude: float
    low: float
    high: float
    duration: float

    def _phase(self, t: float) -> tuple[float, float, float]:
        """Phase [rad] with its first and second derivative."""
        rate = 2.0 * math.pi * (self.high - self.low) / self.duration
        start = 2.0 * math.pi * self.low
        return start * t + 0.5 * rate * t * t, start + rate * t, rate

    def displacement(self, t: float) -> float:
        return self.amplitude * math.sin(self._phase(t)[0])

    def velocity(self, t: float) -> float:
        phase, angular_frequency, _ = self._phase(t)
        return self.amplitude * angular_frequency * math.cos(phase)

    def acceleration(self, t: float) -> float:
        phase, angular_frequency, rate = self._phase(t)
        return self.amplitude * (rate * math.cos(phase) - angular_frequency**2 * math.sin(phase))


@dataclass(frozen=True)
class HalfSine:
    """A shock pulse as in MIL-STD-810: half a sine of acceleration, `peak` [m/s^2] for `duration` [s] from t = 0."""

    peak: float
    duration: float

    def acceleration(self, t: float) -> float:
        return self.peak * math.sin(math.pi * t / self.duration) if 0.0 < t < self.duration else 0.0

    @property
    def velocity_change(self) -> float:
        """Area of the pulse [m/s]."""
        return 2.0 * self.peak * self.duration / math.pi


class BandLimitedRandom:
    """Random vibration of constant acceleration density within a band: a sum of sines with random phases.

    Parameters
    ----------
    density : float      One-sided spectral density of the acceleration [(m/s^2)^2/Hz].
    low, high : float    Band [Hz].
    lines : int          Number of sines.
    seed : int           Of the random phases.
    """

    def __init__(self, density: float, low: float, high: float, lines: int, seed: int) -> None:
        width = (high - low) / lines
        self._angular_frequency = 2.0 * np.pi * (low + width * (np.arange(lines) + 0.5))
        self._phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, lines)
        self._amplitude = np.full(lines, math.sqrt(2.0 * density * width))

    def displacement(self, t: float) -> float:
        return -float(
            np.sum(self._amplitude / self._angular_frequency**2 * np.sin(self._angular_frequency * t + self._phase))
        )

    def velocity(self, t: float) -> float:
        return -float(
            np.sum(self._amplitude / self._angular_frequency * np.cos(self._angular_frequency * t + self._phase))
        )

    def acceleration(self, t: float) -> float:
        return float(np.sum(self._amplitude * np.sin(self._angular_frequency * t + self._phase)))
