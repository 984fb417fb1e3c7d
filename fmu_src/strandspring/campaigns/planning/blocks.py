"""The blocks that a programme is chosen from: loops of several sizes, places and rates, and dwells."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

from .motion import Leg, Pace

LOOP, MINOR, RATE, DWELL = "loops", "minor loops", "rate", "dwell"
KINDS = (LOOP, MINOR, RATE, DWELL)  # in the order of a programme
_AMPLITUDES = (1.0, 0.8, 0.6, 0.45, 0.3, 0.2, 0.1)
_MINOR = ((0.6, 0.3), (0.6, 0.1), (-0.6, 0.3), (-0.6, 0.1), (0.3, 0.6), (-0.3, 0.6))  # centre, amplitude
_RATES = (1.0, 0.6, 0.3)  # amplitudes
_DWELLS = (1.0, 4.0)  # periods of the largest loop
_CYCLES = 3


@dataclass(frozen=True)
class Range:
    """Where a programme may go: middle and half width [m]."""

    middle: float
    half: float

    def at(self, share: float) -> float:
        """A displacement at a share of the half width, -1 to 1 [m]."""
        return self.middle + self.half * share


@dataclass(frozen=True)
class Block:
    """Part of a programme, which begins and ends in the middle of the range, at rest.

    Attributes
    ----------
    kind : str           Of `KINDS`.
    centre, amplitude : float   Shares of half the range.
    cycles : int
    speed : float        Velocity over that of the other blocks.
    rest : float         Duration of dwells at the upper and the lower end [s].
    """

    kind: str
    amplitude: float
    centre: float = 0.0
    cycles: int = _CYCLES
    speed: float = 1.0
    rest: float = 0.0

    @property
    def is_beside_usual(self) -> bool:
        """Whether as many loops of the usual velocity come before those of another rate; the largest ones are there."""
        return self.kind == RATE and self.amplitude < 1.0

    def legs(self, span: Range, pace: Pace) -> list[Leg]:
        """The motion."""
        ends = [span.at(self.centre + side * self.amplitude) for side in (1.0, -1.0)]
        own = pace.times(self.speed)
        if self.kind == DWELL:
            to_top, to_bottom, back = (pace.leg(*pair) for pair in pairwise([span.middle, *ends, span.middle]))
            rests = [pace.dwell(end, self.rest) for end in ends]
            return [to_top, rests[0], to_bottom, rests[1], back]
        before = [span.middle]
        if self.kind == MINOR:
            # Over the far end, so that the loops lie inside the largest one.
            far = 1.0 if self.centre > 0.0 else -1.0
            before.append(span.at(far))
            ends = ends if far < 0.0 else ends[::-1]
        lead_in = [pace.leg(*pair) for pair in pairwise(before)]
        turns = [before[-1], *ends * self.cycles]
        if self.kind == MINOR:
            turns.append(ends[0])
        loops = [*pairwise(turns), (turns[-1], span.middle)]
        if self.is_beside_usual:
            lead_in = [pace.leg(*pair) for pair in loops]
        return [*lead_in, *(own.leg(*pair) for pair in loops)]

    def times(self, count: int) -> Block:
        """The block with so many times its cycles."""
        return replace(self, cycles=count * self.cycles)

    def order(self) -> tuple[float, ...]:
        """Where it comes in a programme: large loops before small ones, which they hold."""
        return KINDS.index(self.kind), -self.amplitude, -self.centre, self.speed, self.rest


def candidates(period: float, speeds: tuple[float, ...], longest: float) -> Iterator[Block]:
    """All blocks.

    Parameters
    ----------
    period : float            Of the largest loop [s].
    speeds : tuple of float   Further velocities over that of the other blocks.
    longest : float           Dwell [s].
    """
    for amplitude in _AMPLITUDES:
        yield Block(LOOP, amplitude)
    for centre, amplitude in _MINOR:
        yield Block(MINOR, amplitude, centre)
    for speed in speeds:
        for amplitude in _RATES:
            yield Block(RATE, amplitude, speed=speed)
    for periods in _DWELLS:
        if periods * period <= longest:
            yield Block(DWELL, 1.0, cycles=1, rest=periods * period)
