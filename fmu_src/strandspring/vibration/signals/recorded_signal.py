"""A measured base motion or force, with its exact averages over time steps."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from .averaging import LARGEST_SIGNAL, StraightPieces, StraightSignal

_INTERVALS = 10.0
_EVEN = 0.01  # share by which intervals differ whose times are rounded


@dataclass(frozen=True, eq=False)
class RecordedSignal(StraightSignal):
    """A record: straight between its samples, from time 0 at its first one. The arrays are copied and read-only.

    Parameters
    ----------
    time : ndarray, shape (K,)     Rising [s], K >= 2; intervals need not be equal.
    value : ndarray, shape (K,)    [m/s^2], [rad/s] or [N].
    is_held : bool                 Whether its last value holds after the last sample; it is 0 there otherwise.

    Raises
    ------
    MountedSystemError             If the arrays are not of this kind.
    """

    time: FloatArray
    value: FloatArray
    is_held: bool = False

    def __post_init__(self) -> None:
        for name in ("time", "value"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if self.time.ndim != 1 or self.time.shape != self.value.shape or self.time.size < 2:
            raise MountedSystemError(
                f"A record must have two samples or more, each of one time and one value, got arrays of the shapes "
                f"{self.time.shape} and {self.value.shape}."
            )
        for name, array in (("time", self.time), ("value", self.value)):
            faults = np.flatnonzero(~(np.abs(array) <= LARGEST_SIGNAL))
            if faults.size:
                raise MountedSystemError(
                    f"The {name}s of a record must be finite and within +-{LARGEST_SIGNAL:g}, got "
                    f"{float(array[faults[0]])!r} at sample {faults[0] + 1}; leave such samples out."
                )
        faults = np.flatnonzero(~(np.diff(self.time) > 0.0))
        if faults.size:
            number = int(faults[0])
            raise MountedSystemError(
                f"The times of a record must rise, but sample {number + 2} at {float(self.time[number + 1])!r} s "
                f"follows {float(self.time[number])!r} s; leave repeated samples out."
            )

    @cached_property
    def _pieces(self) -> StraightPieces:
        return StraightPieces(self.time - self.time[0], self.value, float(self.value[-1]) if self.is_held else 0.0)

    @property
    def duration(self) -> float:
        """From the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def shortest(self) -> float:
        """Ten intervals of its samples, the median of intervals that differ, or its duration if that is less [s].

        A tenth of it, one interval, resolves all that was recorded.
        """
        intervals = np.diff(self.time)
        is_even = float(np.ptp(intervals)) <= _EVEN * float(intervals.mean())
        return min(_INTERVALS * float(intervals.mean() if is_even else np.median(intervals)), self.duration)
