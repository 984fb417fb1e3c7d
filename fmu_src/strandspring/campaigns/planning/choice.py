"""The choice of blocks: one after the other, that which decides most in its time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...core.parameters import SpringParameters
from ...kernel.arrays import FloatArray
from .blocks import RATE, Block, Range, candidates
from .figures import Loops
from .forces import force_along
from .knowledge import Knowledge
from .limits import Limits
from .motion import Leg, Motion, Pace, duration_of

_MOST_CYCLES = 9  # of a block
_MOST_BLOCKS = 10  # of a programme
_WORTH = 0.03  # gain from which a block is worth its time, mean of the logarithms of all intervals
_OTHER_RATE = 1.5  # ratio of durations from which loops have another rate
_LONGEST_DWELL = 0.15  # share of the duration


@dataclass(frozen=True, eq=False)
class Setting:
    """What a programme is chosen in.

    Parameters
    ----------
    limits : Limits
    span : Range
    pace : Pace
    speeds : tuple of float   Further velocities over that of the pace.
    spring : SpringParameters   Any spring of the class.
    """

    limits: Limits
    span: Range
    pace: Pace
    speeds: tuple[float, ...]
    spring: SpringParameters

    @property
    def period(self) -> float:
        """Of the largest loop [s]."""
        return 2.0 * self.pace.leg(self.span.at(-1.0), self.span.at(1.0)).duration

    @property
    def loops(self) -> Loops:
        """Those that knowledge is judged by."""
        return Loops(self.span, self.pace, self.period, self.speeds, self.spring)

    def legs(self, block: Block) -> list[Leg]:
        """The motion of a block."""
        return block.legs(self.span, self.pace)

    def offered(self) -> list[Block]:
        """The blocks to choose from: without those of another rate that the sample rate makes like the others."""
        blocks = candidates(self.period, self.speeds, _LONGEST_DWELL * self.limits.duration)
        return [block for block in blocks if block.kind != RATE or self._differs(block)]

    def _differs(self, block: Block) -> bool:
        usual, other = (
            pace.leg(self.span.at(-block.amplitude), self.span.at(block.amplitude)).duration
            for pace in (self.pace, self.pace.times(block.speed))
        )
        return max(usual, other) >= _OTHER_RATE * min(usual, other)


def chosen_blocks(setting: Setting, known: Sequence[Knowledge]) -> list[Block]:
    """Blocks that decide the figures in the duration, in the order of a programme; the largest loop is among them."""
    choice = _Choice(setting, known)
    first = choice.offered[0]  # the largest loop, after which the memory is that of no test before
    chosen = {first: 1}
    if rate := choice.rate(chosen):  # where one rate was recorded, or none
        chosen[rate] = 1
    needed = set(chosen)
    badness = choice.badness(chosen)
    while True:
        used = choice.duration(chosen)
        best: tuple[float, dict[Block, int], float] | None = None
        for block in choice.offered:
            more = {**chosen, block: chosen.get(block, 0) + 1}
            added = choice.duration(more) - used
            if not choice.is_possible(more) or used + added > setting.limits.duration:
                continue
            left = choice.badness(more)
            if badness - left > _WORTH and (best is None or (badness - left) / added > best[0]):
                best = (badness - left) / added, more, left
        if best is None:
            break
        _, chosen, badness = best
    # Later blocks may show what an earlier one was chosen for: the longest of those that can be spared goes first.
    reached = badness
    while True:
        spared = []
        for block in [block for block in chosen if block not in needed]:
            fewer = {other: count for other, count in chosen.items() if other != block}
            if choice.badness(fewer) - reached <= _WORTH:
                spared.append(fewer)
        if not spared:
            break
        chosen = min(spared, key=choice.duration)
    return sorted((block.times(count) for block, count in chosen.items()), key=Block.order)


class _Choice:
    """Numbers of times that blocks are chosen, and what they leave open."""

    def __init__(self, setting: Setting, known: Sequence[Knowledge]) -> None:
        self.setting, self.known = setting, known
        self.offered = setting.offered()
        self._loops = setting.loops
        self._wanted = np.array([figure.wanted for figure in self._loops.figures])
        self._gradients = [self._loops.gradients(knowledge.spring) for knowledge in known]
        self._gains = {block: _information(setting, known, block) for block in self.offered}

    def is_possible(self, chosen: Mapping[Block, int]) -> bool:
        """Whether there are not too many blocks or cycles, and no dwell twice."""
        return len(chosen) <= _MOST_BLOCKS and all(
            count == 1 or (block.rest == 0.0 and block.times(count).cycles <= _MOST_CYCLES)
            for block, count in chosen.items()
        )

    def rate(self, chosen: Mapping[Block, int]) -> Block | None:
        """The block of another rate that decides most in its time; None without any that fits."""
        before, used = self.badness(chosen), self.duration(chosen)
        gains = {}
        for block in self.offered:
            more = {**chosen, block: 1}
            added = self.duration(more) - used
            if block.kind == RATE and used + added <= self.setting.limits.duration:
                gains[block] = (before - self.badness(more)) / added
        return max(gains, key=gains.__getitem__, default=None)

    def duration(self, chosen: Mapping[Block, int]) -> float:
        """Of the programme [s]."""
        return duration_of([leg for block, count in chosen.items() for leg in self.setting.legs(block.times(count))])

    def badness(self, chosen: Mapping[Block, int]) -> float:
        """Mean logarithm of the intervals after it, of which what is narrower than wanted hardly counts."""
        then = list(self.known)
        for block, count in chosen.items():
            then = [
                knowledge.after(count * wider, count * own)
                for knowledge, (wider, own) in zip(then, self._gains[block], strict=True)
            ]
        intervals = self._loops.intervals(then, self._gradients)
        return float(np.mean(0.5 * np.log1p((intervals / self._wanted) ** 2)))


def _information(setting: Setting, known: Sequence[Knowledge], block: Block) -> list[tuple[FloatArray, FloatArray]]:
    """What a block would show of each spring, after the largest loop."""
    top, bottom, middle = (setting.span.at(share) for share in (1.0, -1.0, 0.0))
    before = [setting.pace.leg(*pair) for pair in ((middle, top), (top, bottom), (bottom, middle))]
    motion = Motion.along([*before, *setting.legs(block)], setting.limits.step)
    points = slice(int(np.searchsorted(motion.leg, len(before))), None)
    return [
        knowledge.gained(motion, force_along(knowledge.spring, motion, setting.span, setting.period), points)
        for knowledge in known
    ]
