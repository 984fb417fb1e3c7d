"""What shakes a system: channels of base motion and of forces on bodies, as averages over time steps.

An average over a step is taken of the signal itself, so that a discontinuity of a pulse costs no accuracy and a
measured acceleration is never integrated twice.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ...kernel.arrays import FloatArray
from ...kernel.structures import rows
from ..signals.shock_spectra import RequiredSpectrum
from .parts import RigidBody, Vector

_ROUNDING = 1e-12  # of a number of steps


class ChannelKind(Enum):
    """What a channel drives; the value is its number in the compiled kernel."""

    BASE_ACCELERATION = 0  # [m/s^2] of the base along a direction of its frame
    BASE_ANGULAR_VELOCITY = 1  # [rad/s] of the base about a direction of its frame
    FORCE = 2  # [N] on a body, at a place and along a direction that turn with it


class Signal(Protocol):
    """A function of time from 0 on."""

    @property
    def shortest(self) -> float:
        """The time over which it acts once [s]; a longer step blurs it."""
        ...

    def averages(self, step: float, count: int) -> FloatArray:
        """Its mean over each of `count` steps [k*step, (k + 1)*step], shape (count,)."""
        ...


@runtime_checkable
class RandomSignal(Signal, Protocol):
    """A signal of which other realisations can be drawn."""

    def redrawn(self, seed: int, number: int) -> Signal:
        """Another realisation; the same seed and number give the same."""
        ...


@dataclass(frozen=True)
class LoadChannel:
    """One signal and what it drives.

    Parameters
    ----------
    kind : ChannelKind
    signal : Signal
    direction : Vector       A unit vector.
    body : int               On which a force acts.
    place : Vector           Where a force acts, in the nominal pose [m].
    """

    kind: ChannelKind
    signal: Signal
    direction: Vector
    body: int = 0
    place: Vector = (0.0, 0.0, 0.0)


def channel_rows(channels: Sequence[LoadChannel], bodies: Sequence[RigidBody]) -> NDArray[np.void]:
    """The channels as MotionChannel of motion.h, shape (C,)."""
    return rows(
        "MotionChannel",
        len(channels),
        direction=[channel.direction for channel in channels],
        place=[np.subtract(channel.place, bodies[channel.body].center) for channel in channels],
        kind=[channel.kind.value for channel in channels],
        body=[channel.body for channel in channels],
    )


@dataclass(frozen=True)
class LoadCase:
    """A load case, from rest: before time 0 neither the base nor a body moves, but for `velocity`.

    An angular velocity of the base that is not 0 at time 0 begins there, and the bodies follow by their mounts.

    Parameters
    ----------
    name : str
    kind : str                    "pulse", "drop", "acceleration", "srs", "sine", "sweep", "random", "record" or
                                  "force".
    duration : float              Simulated time [s].
    channels : tuple of LoadChannel
    settling : float              From when on root mean squares and spectra are taken [s].
    velocity : Vector             Of the bodies relative to the base at the beginning, as after a drop [m/s].
    weightless : bool             Whether the bodies begin at rest without their weight, as in a free fall.
    allowed : tuple of (str, RequiredSpectrum)   Shock response spectra by the name of the point, of which runs find how
                                  much is taken.
    text : str                    The case in words.
    """

    name: str
    kind: str
    duration: float
    channels: tuple[LoadChannel, ...] = ()
    settling: float = 0.0
    velocity: Vector = (0.0, 0.0, 0.0)
    weightless: bool = False
    allowed: tuple[tuple[str, RequiredSpectrum], ...] = ()
    text: str = ""

    @property
    def has_realisations(self) -> bool:
        """Whether other realisations of it can be drawn."""
        return any(isinstance(channel.signal, RandomSignal) for channel in self.channels)

    @property
    def is_shock(self) -> bool:
        """Whether its shock response spectrum is asked for."""
        return self.kind in ("pulse", "drop", "srs", "record", "force")

    @property
    def is_random(self) -> bool:
        """Whether it is random vibration, and no shock of which only the spectrum is given."""
        return self.has_realisations and self.kind != "srs"

    def redrawn(self, seed: int, number: int) -> LoadCase:
        """Another realisation of its random signals; the same seed and number give the same."""
        channels = [
            replace(channel, signal=channel.signal.redrawn(seed, number))
            if isinstance(channel.signal, RandomSignal)
            else channel
            for channel in self.channels
        ]
        return replace(self, channels=tuple(channels))

    def steps(self, step: float) -> int:
        """How many steps of this length [s] reach its end."""
        return math.ceil(self.duration / step * (1.0 - _ROUNDING))

    def averages(self, step: float, count: int) -> FloatArray:
        """Mean of each channel over each of `count` steps, shape (C, count)."""
        return np.array([channel.signal.averages(step, count) for channel in self.channels]).reshape(-1, count)

    @property
    def load_end(self) -> float:
        """When the last of its signals ends, as far as they tell [s]."""
        ends = [getattr(channel.signal, "duration", self.duration) for channel in self.channels]
        return min(self.duration, max(ends, default=self.duration))
