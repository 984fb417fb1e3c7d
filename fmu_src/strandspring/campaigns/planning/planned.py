"""`planned`: the programme within the limits of a rig that decides most of what is open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from ...errors import StrandspringError
from ...findings import Finding, Outcome
from ...ground.result_columns import figure
from ...kernel.arrays import FloatArray
from .blocks import RATE, Block, Range
from .choice import Setting, chosen_blocks
from .figures import Figure
from .forces import force_along
from .knowledge import Knowledge
from .limits import Limits
from .motion import Leg, Motion, Pace, duration_of, sampled
from .prior import Prior

_BASE = 1.0 / 3.0  # velocity of most blocks where none was recorded, share of the largest
_SLOW, _FAST = 0.2, 3.0  # further velocities over that
_FASTER = 1.5  # ratio from which a faster rate is worth it
_ERRORS = 2.0  # standard deviations of the force that a force limit allows for
_PLACES = 65  # at which the force is compared with its limit
_LEAST_SPAN = 0.2  # share of the range that a force limit must leave
_FORCE = "force limit"  # by which a range is narrowed
_SMALLER, _ROUNDS = 0.9, 6  # by which the range is narrowed where a programme exceeds it, and how often
_MOST_SAMPLES = 5_000_000


@dataclass(frozen=True, eq=False)
class PlannedBlock:
    """A block of a programme with what it decides."""

    block: Block = figure("", "", "block")  # noqa: RUF009 - it is a field
    amplitude: float = figure("m", "amplitude", "+-", "mm", 1e3, 3)
    centre: float = figure("m", "centre", "at", "mm", 1e3)
    velocity: float = figure("m/s", "mean velocity")  # the largest one
    frequency: float = figure("Hz", "frequency")  # of the loops, if it has any; else 0
    begin: float = figure("s", "begin")
    duration: float = figure("s", "duration", "time", "s", digits=3)
    decides: str = figure("", "what it decides most", "decides most")  # name of the figure
    before: float = figure("1", "half of the 95 % interval before, over the value", "now", "%", 100.0, 2)
    after: float = figure("1", "half of the 95 % interval after, over the value", "then", "%", 100.0, 2)


@dataclass(frozen=True, eq=False)
class Planned:
    """A programme.

    Attributes
    ----------
    name : str                      What it is for.
    limits : Limits
    blocks : tuple of PlannedBlock
    legs : tuple of Leg
    speeds : tuple of float         Velocities of slow and fast loops over that of the others.
    figures : tuple of Figure
    before, after : ndarray, shape (F,)   Halves of the 95 % intervals of the figures, shares of their values.
    force : (float, float)          Least and greatest force by the model, its uncertainty included [N].
    findings : tuple of Finding     What the limits leave, or leave out.
    """

    name: str
    limits: Limits
    blocks: tuple[PlannedBlock, ...]
    legs: tuple[Leg, ...]
    speeds: tuple[float, ...]
    figures: tuple[Figure, ...]
    before: FloatArray
    after: FloatArray
    force: tuple[float, float]
    findings: tuple[Finding, ...]

    @property
    def duration(self) -> float:
        """Of the programme [s]."""
        return duration_of(self.legs)

    @property
    def path(self) -> tuple[FloatArray, FloatArray]:
        """Times [s] and displacements [m], at the sample rate."""
        return sampled(self.legs, self.limits.step)


def planned(prior: Prior, limits: Limits) -> Planned:
    """The programme for what a prior leaves open.

    Parameters
    ----------
    prior : Prior
    limits : Limits

    Raises
    ------
    StrandspringError   If there is no programme within the limits.
    """
    setting, known, findings = prepared(prior, limits)
    for _ in range(_ROUNDS):
        plan = _judged(prior, setting, known, chosen_blocks(setting, known), findings)
        if limits.force_limit is None or max(map(abs, plan.force)) <= limits.force_limit:
            return plan
        # Small or fast loops may show more force than the loops that the range was found by.
        held = Range(setting.span.middle, _SMALLER * setting.span.half)
        others = (finding for finding in findings if finding.numbers.get("limit") != _FORCE)
        findings = [*others, _narrowed(_FORCE, held)]
        setting = _setting(prior, limits, held)
        known = _known(prior, setting)
    raise StrandspringError(
        "The force of every programme may exceed {force:.4g} N by the model's uncertainty; give a larger "
        "{to[force_limit]}.",
        force=limits.force_limit,
    )


def prepared(prior: Prior, limits: Limits) -> tuple[Setting, list[Knowledge], list[Finding]]:
    """What a programme is chosen in, what is known before it, and what the limits leave; raises as `planned`."""
    span, findings = _within_stroke(prior, limits)
    setting = _setting(prior, limits, span)
    known = _known(prior, setting)
    if limits.force_limit is not None:
        held = _within_force(known, setting, limits.force_limit)
        if held != span:
            findings.append(_narrowed(_FORCE, held))
            setting = _setting(prior, limits, held)
            known = _known(prior, setting)
    duration = duration_of(setting.legs(setting.offered()[0]))
    if duration > limits.duration:
        raise StrandspringError(
            "The largest loops take {loops:.3g} s, and the programme may take {most:.3g} s; give a longer "
            "{to[duration]}, a smaller {to[stroke]}, or a higher {to[velocity]} or {to[sample_rate]}.",
            loops=duration,
            most=limits.duration,
        )
    if limits.duration * limits.sample_rate > _MOST_SAMPLES:
        raise StrandspringError(
            "The programme may have {samples:.3g} samples, more than {most}; give a shorter {to[duration]} or a lower "
            "{to[sample_rate]}.",
            samples=limits.duration * limits.sample_rate,
            most=_MOST_SAMPLES,
        )
    return setting, known, findings


def _within_stroke(prior: Prior, limits: Limits) -> tuple[Range, list[Finding]]:
    """The range that the springs are known in and the rig reaches."""
    spring = prior.springs[0]
    low, high = spring.displacement_min, spring.displacement_max
    if limits.stroke is None:
        return _range(low, high), []
    within = max(low, limits.stroke[0]), min(high, limits.stroke[1])
    if within[1] - within[0] < _LEAST_SPAN * (high - low):
        raise StrandspringError(
            "The stroke {stroke:.4g mm} of the rig holds too little of the model's range {range:.4g mm}; give another "
            "{to[stroke]}.",
            stroke=[limits.stroke],
            range=[(low, high)],
        )
    findings = [_narrowed("stroke", _range(*within))] if within != (low, high) else []
    if limits.stroke[0] < low or limits.stroke[1] > high:
        findings.append(Finding(Outcome.WITHIN_MODEL))
    return _range(*within), findings


def _within_force(known: Sequence[Knowledge], setting: Setting, limit: float) -> Range:
    """The widest range about the middle in which no spring exceeds a force [N], its uncertainty included."""
    legs = [
        setting.pace.leg(*pair) for pair in pairwise(setting.span.at(share) for share in (0.0, 1.0, -1.0, 1.0, 0.0))
    ]
    motion = Motion.along(legs, setting.limits.step)
    low, high = _force_ends(known, setting, motion)
    forces = np.maximum(np.abs(low), np.abs(high))
    beyond = motion.displacement[forces > limit]
    middle, half = setting.span.middle, setting.span.half
    if not beyond.size:
        return setting.span
    above, below = beyond[beyond >= middle], beyond[beyond < middle]
    gap = 2.0 * half / _PLACES  # between the points, at most
    top = min([middle + half, *(above - gap)])
    bottom = max([middle - half, *(below + gap)])
    if top - bottom < _LEAST_SPAN * 2.0 * half:
        raise StrandspringError(
            "The force may reach {force:.4g} N in the range, its uncertainty included, and hardly any of it stays "
            "below {limit:.4g} N; give a larger {to[force_limit]}.",
            force=float(forces.max()),
            limit=limit,
        )
    return _range(float(bottom), float(top))


def _force_ends(known: Sequence[Knowledge], setting: Setting, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Least and greatest force at each point by all springs, with their uncertainty before the test [N]."""
    ends = []
    for knowledge in known:
        force = force_along(knowledge.spring, motion, setting.span, setting.period)
        error = _ERRORS * knowledge.force_deviation(force)
        ends.append((force.value - error, force.value + error))
    lows, highs = zip(*ends, strict=True)
    return np.min(lows, axis=0), np.max(highs, axis=0)


def _setting(prior: Prior, limits: Limits, span: Range) -> Setting:
    most = limits.fastest
    velocity = min(prior.velocity or _BASE * most, most)
    pace = Pace.over(2.0 * span.half, velocity, limits)
    fast = min(_FAST, most / velocity)
    speeds = (_SLOW, *((fast,) if fast >= _FASTER else ()))
    spring = prior.springs[0]
    return Setting(limits, span, pace, () if prior.rates and not spring.branches else speeds, spring)


def _known(prior: Prior, setting: Setting) -> list[Knowledge]:
    """What is known of each spring, in which loops about the middle stand for those recorded."""
    whole = _range(prior.springs[0].displacement_min, prior.springs[0].displacement_max)
    turns = [whole.middle]
    for amplitude in prior.amplitudes or (whole.half,):
        turns += [whole.middle + amplitude, whole.middle - amplitude] * 3
    legs = [setting.pace.leg(*pair) for pair in pairwise(turns)]
    motion = Motion.along(legs, setting.limits.step)
    return [
        Knowledge.before(
            spring, prior.noise, root, force_along(spring, motion, setting.span, setting.period), motion,
            bool(prior.amplitudes), prior.rates,
        )
        for spring, root in zip(prior.springs, prior.roots, strict=True)
    ]  # fmt: skip


def _judged(
    prior: Prior, setting: Setting, known: Sequence[Knowledge], blocks: Sequence[Block], findings: Sequence[Finding]
) -> Planned:
    """The programme of some blocks, with what each of them decides after those before it."""
    if setting.speeds and not any(block.kind == RATE for block in blocks):
        findings = [*findings, Finding(Outcome.ONE_RATE)]
    by_block = [setting.legs(block) for block in blocks]
    legs = [leg for part in by_block for leg in part]
    motion = Motion.along(legs, setting.limits.step)
    ends = list(accumulate(len(part) for part in by_block))
    loops = setting.loops
    gradients = [loops.gradients(knowledge.spring) for knowledge in known]
    forces = [force_along(knowledge.spring, motion, setting.span, setting.period) for knowledge in known]
    intervals = [loops.intervals(known, gradients)]
    now = list(known)
    for begin, end in pairwise([0, *ends]):
        first, last = np.searchsorted(motion.leg, [begin, end])
        points = slice(int(first), int(last))
        now = [
            knowledge.after(*knowledge.gained(motion, force, points))
            for knowledge, force in zip(now, forces, strict=True)
        ]
        intervals.append(loops.intervals(now, gradients))
    begun = 0.0
    described = []
    for block, part, (before, after) in zip(blocks, by_block, pairwise(intervals), strict=True):
        most = int(np.argmax(np.log(before / after)))
        described.append(_described(block, part, setting, begun, loops.figures[most], before[most], after[most]))
        begun += described[-1].duration
    low, high = _force_ends(known, setting, motion)
    return Planned(
        prior.name, setting.limits, tuple(described), tuple(legs), setting.speeds, loops.figures,
        intervals[0], intervals[-1], (float(low.min()), float(high.max())), tuple(findings),
    )  # fmt: skip


def _described(
    block: Block, legs: Sequence[Leg], setting: Setting, begin: float, figure: Figure, before: float, after: float
) -> PlannedBlock:
    loop = [leg for leg in legs if np.isclose(abs(leg.end - leg.start), 2.0 * block.amplitude * setting.span.half)]
    return PlannedBlock(
        block, block.amplitude * setting.span.half, setting.span.at(block.centre), max(leg.velocity for leg in legs),
        0.0 if block.rest else 0.5 / loop[-1].duration, begin, duration_of(legs), figure.name, float(before),
        float(after),
    )  # fmt: skip


def _range(low: float, high: float) -> Range:
    return Range(0.5 * (low + high), 0.5 * (high - low))


def _narrowed(by: str, span: Range) -> Finding:
    return Finding(Outcome.NARROWED, {"limit": by, "range": ((span.at(-1.0), span.at(1.0)),)})
