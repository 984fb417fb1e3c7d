"""What a test rig adds to a spring's force: found by its trace in the residuals, and taken out.

Each effect has a size s that changes the predicted force by s times a column: the derivative of the force by that size
at the fit. An effect enters if a linear least-squares problem in its size, FE, FA, rho, sigma and n lowers the
criterion of `search` by more than a margin; where several would, the one that lowers it most. Sizes are then found by
Gauss-Newton steps: the points are corrected by the sizes, the spring is fitted to them anew, and what is left of each
size follows from the linear problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from ..kernel.arrays import FloatArray
from .autocorrelation import autocorrelation_time
from .loops import Loops, join
from .search import Candidate, force_floor, information, refined
from .steady_part import SteadyRecord


class Effect(Enum):
    """Effects of a rig; the value names the size with its unit."""

    DELAY = "delay of the force [s]"
    VISCOSITY = "viscous damping in parallel [N s/m]"
    FORCE_ZERO = "zero of the force, each record against the first [N]"
    DISPLACEMENT_ZERO = "zero of the displacement, each record against the first [m]"
    DRIFT = "drift of the force from the first sample to the last [N]"
    CURVED_DRIFT = "drift of the force, powers of the elapsed share of the test [N]"
    FRICTION_WEAR = "change of the hysteretic force from the first cycle to the last [-]"
    STIFFNESS_WEAR = "change of the elastic force from the first cycle to the last [-]"


Sizes = dict[Effect, FloatArray]

_MARGIN = 12.0  # by which an effect must lower the criterion beyond its price
_WORTH = 0.03  # share of the misfit that an effect must explain
_ROUNDS = 12  # of Gauss-Newton steps
_SETTLED = 0.01  # change of a size at which they end, share of it
_VELOCITY_WINDOW = 7  # samples over which the velocity is taken


@dataclass(frozen=True, eq=False)
class Rig:
    """Points of the records of a test with what the effects of its rig depend on.

    Attributes
    ----------
    loops : Loops                          As measured.
    parts : tuple of SteadyRecord
    elapsed, cycle : ndarray, shape (P,)   Share of the test that is over, in samples or time and in cycles, 0 to 1.
    velocity : ndarray, shape (P,)         [m/s]; 0 without times.
    """

    loops: Loops
    parts: tuple[SteadyRecord, ...]
    elapsed: FloatArray
    cycle: FloatArray
    velocity: FloatArray

    @classmethod
    def from_parts(cls, parts: Sequence[SteadyRecord], points: int) -> Rig:
        """The rig of some records, a stroke being averaged over at most so many points."""
        loops = join([part.loops_with(points) for part in parts])
        elapsed, velocity = np.empty(loops.force.size), np.zeros(loops.force.size)
        begun = 0.0
        for part, (_, at) in zip(parts, loops.by_record(), strict=True):
            time = _time(part)
            index = np.arange(time.size)
            elapsed[at] = begun + np.interp(loops.sample[at], index, time - time[0])
            begun += float(time[-1] - time[0])
            if part.record.time is not None:
                velocity[at] = np.interp(loops.sample[at], index, _velocity(part))
        strokes = loops.stroke + loops.travel / loops.length[loops.stroke]
        return cls(loops, tuple(parts), elapsed / begun, strokes / loops.length.size, velocity)

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Those that the records can show."""
        if any(part.periodic for part in self.parts):
            return ()
        timed = all(part.record.time is not None for part in self.parts)
        several = len(self.parts) > 1
        return tuple(
            effect
            for effect in Effect
            if (timed or effect not in (Effect.DELAY, Effect.VISCOSITY))
            and (several or effect not in (Effect.FORCE_ZERO, Effect.DISPLACEMENT_ZERO))
        )

    def columns(self, effect: Effect, fit: Candidate, loops: Loops) -> FloatArray:
        """Derivatives of the predicted force by the sizes of an effect, shape (P, number of sizes)."""
        h, backbone, omega = fit.refinement.hysteresis, fit.refinement.backbone, fit.refinement.omega
        others = np.arange(1, len(self.parts))
        of_record = (loops.record[loops.stroke][:, None] == others).astype(np.float64)
        if effect in (Effect.DELAY, Effect.DISPLACEMENT_ZERO):
            slope = fit.basis.slopes(loops.displacement, backbone.elastic, backbone.amplified)
            elastic = slope[0] + omega * slope[1]
            if effect is Effect.DISPLACEMENT_ZERO:
                return np.asarray(-elastic[:, None] * of_record)
            u = loops.side * omega
            growth = 1.0 - np.where(u >= 0.0, 1.0, 1.0 - 2.0 * h.sigma) * np.abs(u) ** h.n
            return np.asarray(-((elastic + backbone.G * h.rho * growth) * self.velocity)[:, None])
        match effect:
            case Effect.VISCOSITY:
                return self.velocity[:, None]
            case Effect.FORCE_ZERO:
                return of_record
            case Effect.DRIFT:
                return self.elapsed[:, None]
            case Effect.CURVED_DRIFT:
                return np.asarray(self.elapsed[:, None] ** np.arange(1, 4))
            case Effect.FRICTION_WEAR:
                return np.asarray((self.cycle * omega * backbone.G)[:, None])
            case _:
                return np.asarray((self.cycle * (backbone.FE - np.mean(backbone.FE)))[:, None])

    def corrected(self, sizes: Sizes, fit: Candidate) -> Loops:
        """The points as a rig without these effects would have measured them."""
        loops = self.loops
        if Effect.DELAY in sizes:
            loops = self._at(float(sizes[Effect.DELAY][0]))
        force = loops.force.copy()
        for effect, size in sizes.items():
            if effect not in (Effect.DELAY, Effect.DISPLACEMENT_ZERO):
                force -= self.columns(effect, fit, loops) @ size
        loops = replace(loops, force=force)
        if Effect.DISPLACEMENT_ZERO in sizes:
            zeros = np.append(0.0, sizes[Effect.DISPLACEMENT_ZERO])[loops.record]
            shifted = loops.displacement - zeros[loops.stroke]
            loops = replace(loops, displacement=shifted, start=loops.start - zeros)
        return loops

    def _at(self, delay: float) -> Loops:
        """The points with the displacement that held when their force arose, exactly on the measured path."""
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


def find_effects(rig: Rig, fit: Candidate) -> tuple[Sizes, Candidate]:
    """The effects that pay for themselves with their sizes, and the spring fitted without them.

    Parameters
    ----------
    rig : Rig
    fit : Candidate   Of the points as measured.
    """
    sizes: Sizes = {}
    loops = rig.loops
    open_to = list(rig.effects)
    for _ in range(_ROUNDS):
        step, entered = _step(rig, fit, loops, sizes, open_to)
        if not step:
            break
        before = sizes
        sizes = {effect: before.get(effect, 0.0) + change for effect, change in step.items()}
        loops = rig.corrected(sizes, fit)
        again = refined(loops, fit.basis, fit.refinement.hysteresis)
        if again is None:
            return before, fit
        fit = again
        if not entered and all(
            np.abs(change).max() <= _SETTLED * np.abs(sizes[effect]).max() for effect, change in step.items()
        ):
            break
    return sizes, fit


def _step(
    rig: Rig, fit: Candidate, loops: Loops, sizes: Sizes, open_to: list[Effect]
) -> tuple[Sizes, bool]:
    """Changes of the sizes by the linear problem, and whether an effect enters with it."""
    columns = fit.basis.columns(loops.displacement)
    refinement = fit.refinement
    root = np.sqrt(loops.weight)
    yielding = (refinement.derivatives * refinement.backbone.G).T
    model = np.hstack([columns.elastic, refinement.omega[:, None] * columns.amplifier, yielding])
    model /= np.maximum(np.abs(model).max(axis=0), 1e-300)
    q, _ = np.linalg.qr(model * root[:, None])
    misfit = root * refinement.backbone.misfit(loops.force, refinement.omega)

    def beside(values: FloatArray) -> FloatArray:
        return np.asarray(values - q @ (q.T @ values))

    left = beside(misfit)
    traces = {effect: beside(rig.columns(effect, fit, loops) * root[:, None]) for effect in [*sizes, *open_to]}

    def solved(effects: Sequence[Effect]) -> tuple[Sizes, FloatArray]:
        if not effects:
            return {}, left
        matrix = np.hstack([traces[effect] for effect in effects])
        solution = np.linalg.lstsq(matrix, left, rcond=1e-10)[0]
        ends = np.cumsum([traces[effect].shape[1] for effect in effects])[:-1]
        return dict(zip(effects, np.split(solution, ends), strict=True)), left - matrix @ solution

    floor = force_floor(loops)
    present = list(sizes)
    now, without = solved(present)
    best, chosen, gain = now, None, 0.0
    for effect in open_to:
        if effect in sizes or (effect is Effect.DRIFT and Effect.CURVED_DRIFT in sizes):
            continue
        others = [e for e in present if not (effect is Effect.CURVED_DRIFT and e is Effect.DRIFT)]
        step, residuals = solved([*others, effect])
        independent = residuals.size / autocorrelation_time(residuals)
        price = (len(np.concatenate(list(step.values()))) - sum(map(len, now.values())))
        won = information(without @ without / loops.weight.sum(), 0, independent, floor) - information(
            residuals @ residuals / loops.weight.sum(), price, independent, floor
        )
        if won > max(gain, _MARGIN) and residuals @ residuals < (1.0 - _WORTH) ** 2 * (without @ without):
            best, chosen, gain = step, effect, won
    return best, chosen is not None


def _time(part: SteadyRecord) -> FloatArray:
    """Times of the samples [s]; their numbers without a time column."""
    record = part.record
    return np.arange(len(record), dtype=np.float64) if record.time is None else record.time


def _velocity(part: SteadyRecord) -> FloatArray:
    """Velocity at each sample [m/s], by the difference over a few samples of the path."""
    time = _time(part)
    index = np.arange(time.size)
    half = _VELOCITY_WINDOW // 2
    before, after = np.maximum(index - half, 0), np.minimum(index + half, time.size - 1)
    path = part.strokes.displacement
    return np.asarray((path[after] - path[before]) / np.maximum(time[after] - time[before], 1e-300))
