"""What a test rig adds to the force of a spring, as a function of sizes that can be fitted.

Each effect changes the force by its size times a column: the derivative of the force by that size. Delay, play and the
zero of the displacement move the points along the path instead, which is done exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from ..kernel.arrays import FloatArray
from .loops import Loops, join
from .projection import Problem
from .search import Candidate
from .steady_part import SteadyRecord


class Effect(Enum):
    """Effects of a rig; the value is the name in the model file."""

    DELAY = "delay"
    VISCOSITY = "viscosity"
    PLAY = "play"
    FORCE_ZERO = "force_zero"
    DISPLACEMENT_ZERO = "displacement_zero"
    DRIFT = "drift"
    CURVED_DRIFT = "curved_drift"
    FRICTION_WEAR = "friction_wear"
    STIFFNESS_WEAR = "stiffness_wear"


Sizes = dict[Effect, FloatArray]

_TIMED = (Effect.DELAY, Effect.VISCOSITY)
_BETWEEN_RECORDS = (Effect.FORCE_ZERO, Effect.DISPLACEMENT_ZERO)
_MOVING = (Effect.DELAY, Effect.PLAY, Effect.DISPLACEMENT_ZERO)
_VELOCITY_WINDOW = 7  # samples over which the velocity is taken


@dataclass(frozen=True, eq=False)
class Rig:
    """Points of the records of a test with what the effects of its rig depend on.

    Attributes
    ----------
    loops : Loops                          As measured, but for a known delay.
    parts : tuple of SteadyRecord
    elapsed, cycle : ndarray, shape (P,)   Share of the test that is over, 0 to 1: in time, or in samples where a
                                           record has no times; and in cycles.
    velocity : ndarray, shape (P,)         [m/s]; 0 without rising times.
    delay : float or None                  By which the force lags as far as it is known; the points allow for it [s].
    """

    loops: Loops
    parts: tuple[SteadyRecord, ...]
    elapsed: FloatArray
    cycle: FloatArray
    velocity: FloatArray
    delay: float | None = None

    @classmethod
    def from_parts(cls, parts: Sequence[SteadyRecord], points: int | None, delay: float | None = None) -> Rig:
        """The rig of some records: their steady parts, averaged over so many points of a stroke, or every sample."""
        each = (part.all_samples() if points is None else part.loops_with(points) for part in parts)
        loops = join(list(each))
        elapsed, velocity = np.empty(loops.force.size), np.zeros(loops.force.size)
        timed = all(part.record.rising_time is not None for part in parts)
        begun = 0.0
        for part, (_, at) in zip(parts, loops.by_record(), strict=True):
            time = _time(part)
            index = np.arange(time.size)
            # Seconds and sample numbers do not add up: where one record has no times, samples count in all.
            clock = time - time[0] if timed else index
            elapsed[at] = begun + np.interp(loops.sample[at], index, clock)
            begun += float(clock[-1])
            if part.record.rising_time is not None:
                moment = np.interp(loops.sample[at], index, time) - (delay or 0.0)
                velocity[at] = np.interp(np.interp(moment, time, index), index, _velocity(part))
        rig = cls(loops, tuple(parts), elapsed / begun, _cycles_over(loops), velocity, delay)
        return replace(rig, loops=rig._earlier(delay)) if delay else rig

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Those that the records can show."""
        if any(part.periodic for part in self.parts):
            return ()
        impossible: tuple[Effect, ...] = ()
        if any(part.record.rising_time is None for part in self.parts):
            impossible += _TIMED
        if self.delay is not None:
            impossible += (Effect.DELAY,)
        if len(self.parts) == 1:
            impossible += _BETWEEN_RECORDS
        return tuple(effect for effect in Effect if effect not in impossible)

    def plain_columns(self, effect: Effect, loops: Loops) -> FloatArray:
        """Derivatives of the force by the sizes of an effect that does not depend on the spring, shape (P, sizes)."""
        match effect:
            case Effect.VISCOSITY:
                return self.velocity[:, None]
            case Effect.DRIFT:
                return self.elapsed[:, None]
            case Effect.CURVED_DRIFT:
                return np.asarray(self.elapsed[:, None] ** np.arange(1, 4))
            case _:
                others = np.arange(1, len(self.parts))
                return np.asarray(loops.record[loops.stroke][:, None] == others, np.float64)

    def columns(self, effect: Effect, fit: Candidate, loops: Loops) -> FloatArray:
        """Derivatives of the force by the sizes of any effect, shape (P, sizes)."""
        h, backbone, omega = fit.refinement.hysteresis, fit.refinement.backbone, fit.refinement.omega
        if effect is Effect.FRICTION_WEAR:
            return np.asarray((self.cycle * omega * backbone.G)[:, None])
        if effect is Effect.STIFFNESS_WEAR:
            return np.asarray((self.cycle * (backbone.FE - np.mean(backbone.FE)))[:, None])
        if effect not in _MOVING:
            return self.plain_columns(effect, loops)
        of_elastic, of_amplified = fit.basis.slopes(loops.displacement, backbone.elastic, backbone.amplified)
        slope = of_elastic + omega * of_amplified
        if effect is Effect.DISPLACEMENT_ZERO:
            return np.asarray(-slope[:, None] * self.plain_columns(Effect.FORCE_ZERO, loops))
        u = loops.side * omega
        growth = backbone.G * h.rho * (1.0 - np.where(u >= 0.0, 1.0, 1.0 - 2.0 * h.sigma) * np.abs(u) ** h.n)
        if effect is Effect.PLAY:
            return np.asarray(-(loops.side * (0.5 * slope + growth))[:, None])
        return np.asarray(-((slope + growth) * self.velocity)[:, None])

    def placed(self, sizes: Sizes) -> Loops:
        """The points where the spring itself was when their force arose."""
        loops = self.loops
        if Effect.DELAY in sizes:
            loops = self._earlier(float(sizes[Effect.DELAY][0]))
        if Effect.PLAY in sizes:
            play = float(sizes[Effect.PLAY][0])
            start = loops.start + 0.5 * play * loops.direction
            travel = np.maximum(loops.travel - play, 0.0)
            at = np.asarray(start[loops.stroke] + loops.side * travel, np.float64)
            length = np.maximum(loops.length - play, 1e-6 * loops.length)
            loops = replace(loops, displacement=at, travel=travel, start=start, length=length)
        if Effect.DISPLACEMENT_ZERO in sizes:
            zeros = np.append(0.0, sizes[Effect.DISPLACEMENT_ZERO])[loops.record]
            shifted = loops.displacement - zeros[loops.stroke]
            loops = replace(loops, displacement=shifted, start=loops.start - zeros)
        return loops

    def added(self, sizes: Sizes, fit: Candidate | None, loops: Loops) -> FloatArray:
        """Force that the other effects add at the points, shape (P,) [N].

        Parameters
        ----------
        sizes : dict
        fit : Candidate or None   Needed for effects that depend on the spring.
        loops : Loops             As placed.
        """
        force = np.zeros(loops.force.size)
        for effect, size in sizes.items():
            if effect not in _MOVING:
                columns = self.plain_columns(effect, loops) if fit is None else self.columns(effect, fit, loops)
                force += columns @ size
        return force

    def corrected(self, sizes: Sizes, fit: Candidate | None) -> Loops:
        """The points as a rig without these effects would have measured them; arguments as of `added`."""
        loops = self.placed(sizes)
        return replace(loops, force=loops.force - self.added(sizes, fit, loops))

    def predicted(self, sizes: Sizes, fit: Candidate) -> tuple[Candidate, FloatArray]:
        """A fit of other points of the same records at these points, and the force that the rig measures there [N]."""
        loops = self.placed(sizes)
        fit = transferred(fit, loops)
        return fit, fit.refinement.backbone.force(fit.refinement.omega) + self.added(sizes, fit, loops)

    def _earlier(self, delay: float) -> Loops:
        """The points with the displacement that held a delay earlier, exactly on the measured path."""
        loops = self.loops
        x, stroke, travel = loops.displacement.copy(), loops.stroke.copy(), loops.travel.copy()
        for part, (of_record, at) in zip(self.parts, loops.by_record(), strict=True):
            time, strokes = _time(part), part.strokes
            index = np.arange(time.size)
            moment = np.interp(loops.sample[at], index, time) - delay
            place = np.interp(moment, time, index)
            of_sample = strokes.of_sample[np.ceil(place).astype(np.intp)]
            x[at] = np.interp(place, index, strokes.displacement)
            travel[at] = np.abs(x[at] - strokes.turning_displacement[of_sample])
            stroke[at] = of_record.start + of_sample
        return replace(loops, displacement=x, stroke=stroke, travel=travel)


def transferred(fit: Candidate, loops: Loops) -> Candidate:
    """A fit at other points of the same records."""
    refinement = Problem(loops, fit.basis, fit.refinement.hysteresis).at(fit.refinement)
    return replace(fit, refinement=refinement)


def _cycles_over(loops: Loops) -> FloatArray:
    """Share of the cycles that are over at each point; the ends of a record may be parts of a stroke only."""
    share = np.ones(loops.length.size)
    for strokes, _ in loops.by_record():
        length = loops.length[strokes]
        if length.size > 1:
            share[strokes.start] = min(1.0, float(length[0] / length[1]))
            share[strokes.stop - 1] = min(1.0, float(length[-1] / length[-2]))
    over = np.cumsum(share) - share
    return np.asarray(
        (over[loops.stroke] + share[loops.stroke] * loops.travel / loops.length[loops.stroke]) / share.sum()
    )


def _time(part: SteadyRecord) -> FloatArray:
    """Times of the samples [s]; their numbers where no times rise."""
    time = part.record.rising_time
    return np.arange(len(part.record), dtype=np.float64) if time is None else time


def _velocity(part: SteadyRecord) -> FloatArray:
    """Velocity at each sample [m/s], by the difference over a few samples of the path."""
    time = _time(part)
    index = np.arange(time.size)
    half = _VELOCITY_WINDOW // 2
    before, after = np.maximum(index - half, 0), np.minimum(index + half, time.size - 1)
    path = part.strokes.displacement
    return np.asarray((path[after] - path[before]) / np.maximum(time[after] - time[before], 1e-300))
