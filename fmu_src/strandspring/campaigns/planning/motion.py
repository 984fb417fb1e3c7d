"""How a rig moves: strokes at constant velocity with rounded turns, and dwells, on a grid of samples.

Within a share e of its duration T after its start, and before its end, the velocity of a stroke is a quarter of a sine;
in between it is constant. So velocity is continuous, and so is acceleration at the turns of equal strokes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...kernel.arrays import FloatArray
from .limits import LEAST_SAMPLES, Limits

_RAMP = 0.1  # time of a ramp, share of the time in which the largest stroke is crossed at full velocity
POINTS = 24  # of a leg where its force is computed


@dataclass(frozen=True)
class Leg:
    """A stroke, or a dwell where it ends where it starts.

    Attributes
    ----------
    start, end : float   [m]
    duration : float     [s]
    ramp : float         Share e of the duration, 0 to 0.5.
    """

    start: float
    end: float
    duration: float
    ramp: float = 0.5

    @property
    def velocity(self) -> float:
        """Largest velocity [m/s]."""
        return abs(self.end - self.start) / (self.duration * (1.0 - 2.0 * self.ramp * (1.0 - 2.0 / math.pi)))

    @property
    def acceleration(self) -> float:
        """Largest acceleration [m/s^2]."""
        return 0.5 * math.pi * self.velocity / (self.ramp * self.duration)

    def at(self, time: FloatArray) -> FloatArray:
        """Displacement at times since its start [m]."""
        if self.start == self.end:
            return np.full(time.shape, self.start)
        share, e = time / self.duration, self.ramp
        early = np.minimum(share, 1.0 - share)  # the second half mirrors the first
        ramp = 2.0 * e / math.pi * (1.0 - np.cos(0.5 * math.pi * np.minimum(early, e) / e))
        way = (ramp + np.maximum(early - e, 0.0)) / (1.0 - 2.0 * e * (1.0 - 2.0 / math.pi))
        return np.asarray(self.start + (self.end - self.start) * np.where(share <= 0.5, way, 1.0 - way))


@dataclass(frozen=True)
class Pace:
    """Duration of strokes and dwells at a velocity.

    Parameters
    ----------
    velocity : float   Of long strokes [m/s].
    ramp : float       Time of their ramps [s].
    limits : Limits
    """

    velocity: float
    ramp: float
    limits: Limits

    @classmethod
    def over(cls, width: float, velocity: float, limits: Limits) -> Pace:
        """The pace at which strokes of a width [m] have short ramps."""
        return cls(velocity, _RAMP * width / velocity, limits)

    def times(self, factor: float) -> Pace:
        """The pace at another velocity with the same form of motion."""
        return Pace(self.velocity * factor, self.ramp / factor, self.limits)

    def leg(self, start: float, end: float) -> Leg:
        """A stroke of a whole number of samples, so many that a loop of such strokes is sampled well.

        Strokes too short for full velocity have the same acceleration in the turns.
        """
        length = abs(end - start)
        duration = length / self.velocity + 2.0 * self.ramp * (1.0 - 2.0 / math.pi)
        if duration < 2.0 * self.ramp:
            duration = math.pi * math.sqrt(length * self.ramp / (math.pi * self.velocity))
        samples = max(math.ceil(duration / self.limits.step - 1e-9), LEAST_SAMPLES // 2)
        return Leg(start, end, samples * self.limits.step, min(self.ramp / duration, 0.5))

    def dwell(self, at: float, duration: float) -> Leg:
        """A rest of a whole number of samples."""
        return Leg(at, at, max(round(duration / self.limits.step), 1) * self.limits.step)


@dataclass(frozen=True, eq=False)
class Motion:
    """A path at points that follow its legs, dense where they turn.

    Attributes
    ----------
    displacement, time : ndarray, shape (K,)   [m], [s]
    leg : ndarray, shape (K,)                  Number of the leg that ends at or after the point.
    samples : ndarray, shape (K,)              How many samples of the rig each point stands for.
    """

    displacement: FloatArray
    time: FloatArray
    leg: FloatArray
    samples: FloatArray

    @classmethod
    def along(cls, legs: Sequence[Leg], step: float) -> Motion:
        """The path along legs that are sampled at a step [s]; it begins with the start of the first one."""
        share = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, POINTS + 1)))[1:]
        start, end, duration = (np.array([getattr(leg, name) for leg in legs]) for name in ("start", "end", "duration"))
        moved = start[:, None] + (end - start)[:, None] * share
        begun = np.cumsum(duration) - duration
        times = begun[:, None] + duration[:, None] * share
        counts = duration[:, None] / step * np.diff(share, prepend=0.0)
        return cls(
            np.append(start[0], moved.ravel()),
            np.append(0.0, times.ravel()),
            np.append(0, np.repeat(np.arange(len(legs)), POINTS)),
            np.append(0.0, counts.ravel()),
        )


def duration_of(legs: Sequence[Leg]) -> float:
    """Of some legs [s]."""
    return math.fsum(leg.duration for leg in legs)


def sampled(legs: Sequence[Leg], step: float) -> tuple[FloatArray, FloatArray]:
    """Times [s] and displacements [m] of a programme at steps of time."""
    counts = [round(leg.duration / step) for leg in legs]
    parts = [leg.at(step * np.arange(1.0, count + 1.0)) for leg, count in zip(legs, counts, strict=True)]
    path = np.concatenate([[legs[0].start], *parts])
    return np.asarray(step * np.arange(path.size)), np.asarray(path)
