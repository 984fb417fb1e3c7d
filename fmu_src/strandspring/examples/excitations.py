"""What shakes the systems: displacement [m], speed [m/s] and acceleration [m/s^2] of a base at a time [s]."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

GRAVITY = 9.80665  # m/s^2


@dataclass(frozen=True)
class Still:
    """A base that does not move."""

    def displacement(self, _: float) -> float:
        return 0.0

    speed = acceleration = displacement


@dataclass(frozen=True)
class Sine:
    """amplitude*sin(2 pi frequency t) [m], [Hz]."""

    amplitude: float
    frequency: float

    @property
    def _circular(self) -> float:
        return 2.0 * math.pi * self.frequency

    def displacement(self, t: float) -> float:
        return self.amplitude * math.sin(self._circular * t)

    def speed(self, t: float) -> float:
        return self.amplitude * self._circular * math.cos(self._circular * t)

    def acceleration(self, t: float) -> float:
        return -self.amplitude * self._circular**2 * math.sin(self._circular * t)


@dataclass(frozen=True)
class Sweep:
    """A sine of constant amplitude [m] whose frequency goes linearly from `low` to `high` [Hz] in `duration` [s]."""

    amplitude: float
    low: float
    high: float
    duration: float

    def _phase(self, t: float) -> tuple[float, float, float]:
        rate = 2.0 * math.pi * (self.high - self.low) / self.duration
        begin = 2.0 * math.pi * self.low
        return begin * t + 0.5 * rate * t * t, begin + rate * t, rate

    def frequency(self, t: float) -> float:
        return self._phase(t)[1] / (2.0 * math.pi)

    def displacement(self, t: float) -> float:
        return self.amplitude * math.sin(self._phase(t)[0])

    def speed(self, t: float) -> float:
        phase, circular, _ = self._phase(t)
        return self.amplitude * circular * math.cos(phase)

    def acceleration(self, t: float) -> float:
        phase, circular, rate = self._phase(t)
        return self.amplitude * (rate * math.cos(phase) - circular**2 * math.sin(phase))


@dataclass(frozen=True)
class HalfSine:
    """A shock pulse of MIL-STD-810 kind: half a sine of acceleration, `peak` [m/s^2] for `duration` [s] from t = 0."""

    peak: float
    duration: float

    def acceleration(self, t: float) -> float:
        return self.peak * math.sin(math.pi * t / self.duration) if 0.0 < t < self.duration else 0.0

    @property
    def change_of_speed(self) -> float:
        return 2.0 * self.peak * self.duration / math.pi


class BandLimitedRandom:
    """Random vibration of constant acceleration density within a band: a sum of sines at random phases.

    Parameters
    ----------
    density : float      Of the acceleration, one-sided [(m/s^2)^2/Hz].
    low, high : float    Band [Hz].
    lines : int          Sines.
    seed : int           Of the phases.
    """

    def __init__(self, density: float, low: float, high: float, lines: int, seed: int) -> None:
        width = (high - low) / lines
        self._circular = 2.0 * np.pi * (low + width * (np.arange(lines) + 0.5))
        self._phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, lines)
        self._amplitude = np.full(lines, math.sqrt(2.0 * density * width))

    def displacement(self, t: float) -> float:
        return -float(np.sum(self._amplitude / self._circular**2 * np.sin(self._circular * t + self._phase)))

    def speed(self, t: float) -> float:
        return -float(np.sum(self._amplitude / self._circular * np.cos(self._circular * t + self._phase)))

    def acceleration(self, t: float) -> float:
        return float(np.sum(self._amplitude * np.sin(self._circular * t + self._phase)))
