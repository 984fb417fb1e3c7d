"""Pulses of base acceleration or force, with their exact averages over time steps.

Each begins at time 0 and is 0 after its duration. `shortest` is the time over which a signal acts once: the duration of
a pulse, half a period of the highest frequency of a vibration, ten sample intervals of a record; a longer time step
blurs it. `velocity_change` is the integral of a pulse: the change of velocity [m/s] by an acceleration, the impulse
[N s] of a force.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray, floats
from .averaging import (
    LARGEST_SIGNAL,
    StraightPieces,
    StraightSignal,
    check_duration,
    check_level,
    smooth_averages,
    step_edges,
)

_MOST_POINTS = 1_000_000


@dataclass(frozen=True)
class Pulse:
    """What the classical pulses have in common.

    Parameters
    ----------
    peak : float         Largest value [m/s^2] or [N]; negative for a pulse in the opposite direction.
    duration : float     [s]

    Raises
    ------
    MountedSystemError   If a value is out of its bounds.
    """

    peak: float
    duration: float

    def __post_init__(self) -> None:
        check_level(self.peak, "peak")
        check_duration(self.duration, "duration")

    @property
    def shortest(self) -> float:
        """The duration [s]."""
        return self.duration


@dataclass(frozen=True)
class HalfSine(Pulse):
    """peak*sin(pi*t/duration)."""

    @property
    def velocity_change(self) -> float:
        """2/pi*peak*duration."""
        return 2.0 / math.pi * self.peak * self.duration

    def at(self, time: ArrayLike) -> FloatArray:
        """Its value at each time [s]."""
        times = floats(time)
        inside = (times >= 0.0) & (times <= self.duration)
        return np.where(inside, self.peak * np.sin(np.pi / self.duration * times), 0.0)

    def averages(self, step: float, count: int) -> FloatArray:
        """Its mean over each of `count` steps, shape (count,).

        The integral from a to b is 2*peak*duration/pi*sin(w*(a + b)/2)*sin(w*(b - a)/2) with w = pi/duration.
        """
        edges = step_edges(step, count)
        within = np.minimum(edges, self.duration) * (0.5 * np.pi / self.duration)
        begin, end = within[:-1], within[1:]
        return floats(self.velocity_change * np.sin(begin + end) * np.sin(end - begin) / np.diff(edges))


@dataclass(frozen=True)
class VersedSine(Pulse):
    """peak*(1 - cos(2*pi*t/duration))/2, also called haversine."""

    @property
    def velocity_change(self) -> float:
        """Half of peak*duration."""
        return 0.5 * self.peak * self.duration

    def at(self, time: ArrayLike) -> FloatArray:
        """Its value at each time [s]."""
        times = floats(time)
        inside = (times >= 0.0) & (times <= self.duration)
        return np.where(inside, self.peak * np.sin(np.pi / self.duration * times) ** 2, 0.0)

    def averages(self, step: float, count: int) -> FloatArray:
        """Its mean over each of `count` steps, shape (count,).

        The integral from a to b is peak/2*(b - a - cos(w*(a + b)/2)*sin(w*(b - a)/2)*2/w) with w = 2*pi/duration.
        """
        edges = step_edges(step, count)
        within = np.minimum(edges, self.duration)
        begin, width, rate = within[:-1], np.diff(within), np.pi / self.duration
        swing = np.cos(rate * (2.0 * begin + width)) * np.sin(rate * width) / rate
        return floats(0.5 * self.peak * (width - swing) / np.diff(edges))


@dataclass(frozen=True)
class HeldAcceleration(Pulse):
    """A constant acceleration after a slow rise, peak*(1 - cos(pi*t/rise))/2, so that bodies follow without vibration.

    Parameters
    ----------
    rise : float         Part of the duration [s].

    Raises
    ------
    MountedSystemError   If it does not fit into the duration.
    """

    rise: float

    def __post_init__(self) -> None:
        super().__post_init__()
        check_duration(self.rise, "rise")
        if not self.rise <= self.duration:
            raise MountedSystemError(
                f"The rise of a constant acceleration must be at most its duration of {self.duration!r} s, got "
                f"{self.rise!r} s."
            )

    @property
    def shortest(self) -> float:
        """The rise [s]."""
        return self.rise

    def at(self, time: ArrayLike) -> FloatArray:
        """Its value at each time [s]."""
        times = floats(time)
        risen = self.peak * np.sin(0.5 * np.pi * np.clip(times / self.rise, 0.0, 1.0)) ** 2
        return np.where(times <= self.duration, risen, 0.0)

    def averages(self, step: float, count: int) -> FloatArray:
        """Its mean over each of `count` steps, shape (count,)."""
        rate = math.pi / max(self.rise, step)
        return smooth_averages(self.at, rate, np.array([self.rise, self.duration]), step, count)


# Time and value of each corner as shares of the duration and the peak.
CORNERS = {
    "terminal-sawtooth": ((0.0, 0.0), (1.0, 1.0)),
    "initial-sawtooth": ((0.0, 1.0), (1.0, 0.0)),
    "rectangle": ((0.0, 1.0), (1.0, 1.0)),
    "triangle": ((0.0, 0.0), (0.5, 1.0), (1.0, 0.0)),
}


@dataclass(frozen=True)
class StraightPulse(Pulse, StraightSignal):
    """A pulse of straight pieces.

    Parameters
    ----------
    corners : tuple of (float, float)   Such as those of `CORNERS`.
    """

    corners: tuple[tuple[float, float], ...]

    @cached_property
    def _pieces(self) -> StraightPieces:
        shares = np.array(self.corners)
        return StraightPieces(self.duration * shares[:, 0], self.peak * shares[:, 1])


def trapezoid(peak: float, duration: float, rise: float, fall: float) -> StraightPulse:
    """A straight rise, the peak held, and a straight fall.

    Parameters
    ----------
    peak, duration : float   See `Pulse`.
    rise, fall : float       Times of the rise and the fall, parts of the duration [s]; 0 for a jump.

    Raises
    ------
    MountedSystemError       If they do not fit into the duration.
    """
    if not (rise >= 0.0 and fall >= 0.0 and rise + fall <= duration * (1.0 + 1e-12)):
        raise MountedSystemError(
            f"The rise and the fall of a trapezoid must be >= 0 and together at most its duration of {duration!r} s, "
            f"got {rise!r} s and {fall!r} s."
        )
    held = rise / duration
    return StraightPulse(peak, duration, ((0.0, 0.0), (held, 1.0), (max(held, 1.0 - fall / duration), 1.0), (1.0, 0.0)))


@dataclass(frozen=True)
class VelocityStep:
    """A sudden change of velocity, as at an impact: an impulse within the first step, whatever its length.

    Parameters
    ----------
    velocity_change : float     [m/s]; for a force its impulse [N s].

    Raises
    ------
    MountedSystemError          If it is not finite or absurdly large.
    """

    velocity_change: float

    def __post_init__(self) -> None:
        check_level(self.velocity_change, "velocity_change")

    @property
    def shortest(self) -> float:
        """Infinite: a step of any length takes it in."""
        return math.inf

    def averages(self, step: float, count: int) -> FloatArray:
        """Its mean over each of `count` steps, shape (count,)."""
        means = np.zeros(count)
        means[:1] = self.velocity_change / step
        return means


@dataclass(frozen=True)
class TabulatedPulse(StraightSignal):
    """A pulse by a table, such as the force of recoil: straight between its points, 0 before and after them.

    Parameters
    ----------
    points : tuple of (float, float)     Times >= 0 that never fall [s], each with its value; two points at one time are
                                         a jump.

    Raises
    ------
    MountedSystemError                   If the points are not of this kind.
    """

    points: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if not 2 <= len(self.points) <= _MOST_POINTS:
            raise MountedSystemError(
                f"A pulse by a table must have 2 to {_MOST_POINTS:,} points, got {len(self.points)}."
            )
        table = np.array(self.points)
        if not np.isfinite(table).all() or np.abs(table).max() > LARGEST_SIGNAL:
            raise MountedSystemError(
                f"The times and values of a pulse by a table must be finite and within +-{LARGEST_SIGNAL:g}."
            )
        falls = np.flatnonzero(np.diff(table[:, 0]) < 0.0)
        if table[0, 0] < 0.0 or falls.size:
            number = int(falls[0]) + 2 if table[0, 0] >= 0.0 else 1
            raise MountedSystemError(
                f"The times of a pulse by a table must be >= 0 and never fall, got {float(table[number - 1, 0])!r} s "
                f"at point {number}; sort the points and let them begin at 0."
            )
        check_duration(float(table[-1, 0] - table[0, 0]), "duration")

    @cached_property
    def _pieces(self) -> StraightPieces:
        table = np.array(self.points)
        return StraightPieces(table[:, 0], table[:, 1])

    @property
    def duration(self) -> float:
        """Where it ends [s]."""
        return float(self.points[-1][0])

    @property
    def peak(self) -> float:
        """Its value of largest magnitude."""
        return max((value for _, value in self.points), key=abs)

    @property
    def shortest(self) -> float:
        """From its first to its last point [s]."""
        return float(self.points[-1][0] - self.points[0][0])
