"""What a saved spring may be wrong by: a single force on recorded paths, loops that were not recorded, what it misses.

Loops that were not recorded are judged by rivals: all classes that were tried whose held-out errors are those of the
best fit within their standard error or 1 %. They agree along the records, and where they do not agree nothing is known.
Of records of one amplitude they say too little: there only a spring of one friction mechanism that leaves nothing but
noise is taken at its word, and the energy of small loops may else grow with the amplitude as that of mounts does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..kernel.arrays import BoolArray, FloatArray
from ..loops.strokes import noise_level
from ..model.joint import LEVEL, NORMAL_95, ForceInterval
from ..records.record import Record
from .bases import fraction
from .choice import NO_WORSE, Choice, difference
from .figures import autocorrelation_time, growing_variance, white_variance
from .fit import NOISE_ONLY, Fit, Linear, Problem
from .samples import Samples

AMPLITUDE = 0.3  # of small loops, share of half the range: those that a further test is advised to record
BEYOND = 1.2  # where the force beyond the range is judged, in halves of it
# Of the energy over the amplitude: friction that slides has 1, a dashpot 2, joints that slip in part 2 to 3 (Segalman,
# J. Appl. Mech. 72, 2005). Chosen on drawn mounts of other classes, of which 38 in 39 are held.
POWERS = (1.0, 2.8)
_STEPS = 60  # of a stroke: energies are right to 0.2 %
Spread = Callable[[Callable[[Fit, Linear], FloatArray]], FloatArray]
_PLACES = {
    "turns": "after turns", "ends": "at the ends of the range", "cycles": "from cycle to cycle",
    "speed": "with the speed", "record": "in one record",
}  # fmt: skip


def force_interval(choice: Choice, force_error: float, time: float) -> ForceInterval:
    """95 % interval of a measured force, of the largest standard error of the fit [N] and the autocorrelation time of
    its residuals, by blocks of strokes that were held out: the first ones among the folds.

    What lies beyond the range that is left is not held against the fit.
    """
    problem, fit = choice.problem, choice.best.fit
    x, block = problem.samples.x, np.full(problem.samples.rows.size, -1)
    left_out = np.zeros(x.size)
    for k, (fold, residuals) in enumerate(zip(problem.samples.folds, choice.best.held_out, strict=True)):
        if (block[fold] >= 0).any():
            break
        within = fold & (x >= x[~fold].min()) & (x <= x[~fold].max())
        left_out[within] = (residuals / problem.roots)[within] * problem.deviation
        block[within] = k
    used = block >= 0
    force = problem.samples.r + problem.linear(fit.spring_class, fit.q).residuals / problem.roots * problem.deviation
    additive, relative = growing_variance(force[used], left_out[used])
    scale = np.sqrt(additive + relative * force**2)
    ratio, block = np.abs(left_out[used]) / scale[used], block[used]
    wider = student_95(ratio.size / time) / NORMAL_95
    held = [
        np.mean(ratio[block == k] <= wider * np.quantile(ratio[block != k], LEVEL)) * np.mean(block == k)
        for k in np.unique(block)
        if (block != k).any()
    ]
    factor = wider * float(np.quantile(ratio, LEVEL))
    return ForceInterval(
        factor, math.sqrt(additive), math.sqrt(relative), force_error, factor * float(np.sqrt(np.mean(scale**2))),
        float(sum(held)) if held else None, 0.5 * len(problem.samples.strokes),
    )  # fmt: skip


@dataclass(frozen=True)
class Unrecorded:
    """What loops may do that were not recorded, by all fits that predict held-out strokes as well."""

    amplitude: float  # of small loops about mid-range [m]
    energy: float  # of theirs a cycle [J]
    low: float  # of its range [J]
    high: float
    beyond: list[list[float]]  # x, force, low and high beyond either end of the range [m], [N]
    one_amplitude: bool  # whether all recorded loops are of about one amplitude, which leave small ones open
    by_powers: bool  # whether the range is that of what mounts do, as the spring is not settled

    @property
    def numbers(self) -> dict[str, Any]:
        """Those of a finding: the energy of small loops and its range."""
        others = f"powers of {POWERS[0]:g} to {POWERS[1]:g} of the recorded amplitude"
        return {
            "amplitude": self.amplitude,
            "energy": self.energy,
            "energies": ((self.low, self.high),),
            "others": others if self.by_powers else "all springs that predict as well",
        }

    @classmethod
    def of(cls, choice: Choice, problem: Problem, lack: LackOfFit, spread: Spread) -> Unrecorded:
        """By a choice, the problem to which its best was fitted in the end, the misfit, which may be part of small
        loops, and the root of the covariance of what a function makes of the fit.
        """
        fit, few, path = choice.best.fit, choice.problem, _Path(problem)
        force = path.force(fit, problem.linear(fit.spring_class, fit.q), problem)
        errors = spread(lambda moved, solved: path.force(moved, solved, problem))
        worse = [(judged.fit, *difference(judged, choice.best)) for judged in choice.seen]
        rivals = [other for other, mean, error in worse if mean <= max(error, NO_WORSE)]
        ties = [path.force(rival, few.linear(rival.spring_class, rival.q), few) for rival in rivals]
        amplitude, energy = AMPLITUDE * problem.half, float(path.small @ force)
        unsure = NORMAL_95 * float(np.linalg.norm(path.small @ errors)) + 4.0 * amplitude * lack.missed * few.deviation
        unsure += 0.002 * abs(energy)  # of the path's steps
        energies = [energy, *(float(path.small @ other) for other in ties)]
        low, high = min(energies) - unsure, max(energies) + unsure
        c, one_amplitude = fit.spring_class, has_one_amplitude(problem.samples)
        is_simple = not c.branches and c.mechanisms == 1 and c.amplifiers[0] <= 3
        by_powers = one_amplitude and not (is_simple and few.is_noise(fit))
        if by_powers:
            full = float(path.full @ force)
            low, high = min(low, full * AMPLITUDE ** POWERS[1]), max(high, full * AMPLITUDE ** POWERS[0])
        sure = NORMAL_95 * np.linalg.norm(errors, axis=1)
        forces = np.array([force - sure, force + sure, *ties])
        beyond = np.stack([path.x, force, forces.min(axis=0), forces.max(axis=0)], axis=1)[path.ends]
        return cls(amplitude, energy, max(low, 0.0), high, beyond.tolist(), one_amplitude, by_powers)


class _Path:
    """A path that was not recorded: small loops, a full one, and beyond either end; sines of the records' duration."""

    def __init__(self, problem: Problem) -> None:
        turns = [0.0, *[AMPLITUDE, -AMPLITUDE] * 10, 1.0, -1.0, 1.0, BEYOND, -BEYOND]
        share = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, _STEPS + 1) / _STEPS)
        y = np.concatenate([[0.0], *(a + (b - a) * share for a, b in pairwise(turns))])
        low, high = problem.frame.low, problem.frame.high
        self.x = 0.5 * (low + high) + problem.half * y
        time = np.arange(0.0, y.size) * (0.5 * problem.samples.cycle_time / _STEPS)
        record = Record(self.x, np.zeros(y.size), time if problem.samples.is_timed else None)
        self.unrecorded = Problem(Samples((record,), np.arange(y.size), (low, high)))
        # What a force is multiplied by for the energy of the last small loop and of the full one.
        self.small, self.full = (self._work(turn * _STEPS) for turn in (20, 23))
        self.ends = [y.size - 1 - _STEPS, y.size - 1]

    def _work(self, end: int) -> FloatArray:
        way = np.zeros(self.x.size)
        way[end - 2 * _STEPS : end] = 0.5 * np.diff(self.x[end - 2 * _STEPS : end + 1])
        return way + np.roll(way, 1)

    def force(self, fit: Fit, solved: Linear, problem: Problem) -> FloatArray:
        """The force of a fit to a problem [N]."""
        bare = replace(fit.spring_class, zeros=False, drift=False)
        A = self.unrecorded.columns(bare, fit.q, problem.frame)
        coefficients = solved.coefficients[: A.shape[1]] * problem.deviation
        coefficients[1 : solved.terms] -= solved.fall
        return np.asarray(solved.base + A @ coefficients)


def has_one_amplitude(samples: Samples) -> bool:
    """Whether all strokes but those that begin or end a record are about as long: up to 1.5 times the median, and four
    of five from 0.7 of the longest on.
    """
    length = np.concatenate([np.abs(np.diff(samples.displacement[turning]))[1:-1] for turning in samples.turning])
    if not length.size:
        return True
    return bool(length.max() < 1.5 * np.median(length) and np.quantile(length, 0.2) > 0.7 * length.max())


@dataclass(frozen=True)
class LackOfFit:
    """What a spring misses.

    Attributes
    ----------
    missed : float                  rms misfit that is not noise, share of the force's deviation.
    not_noise : float               Its share of the squared misfit.
    autocorrelation_time : float    Of the residuals [rows].
    places : dict of str to float   How far the squared misfit lies in one place, 0 where it is even, 1 where all of it
                                    is there: at turns, at the ends of the range, in one record; and the share of it
                                    that goes with the speed, and with the shape of the loop from cycle to cycle.
    """

    missed: float
    not_noise: float
    autocorrelation_time: float
    places: dict[str, float]

    @classmethod
    def of(cls, problem: Problem, fit: Fit) -> LackOfFit:
        """That of a fit."""
        samples = problem.samples
        # With their weights: outliers are no misfit of the spring.
        residuals = problem.linear(fit.spring_class, fit.q).residuals
        squares, noise = residuals**2, min(white_variance(residuals), _white_noise(samples) / problem.deviation**2)
        mean = max(float(squares.mean()), 1e-300)
        y = fraction(samples.x, problem.frame.low, problem.frame.high)
        stroke = samples.stroke_of_row
        begin, end = samples.displacement[samples.strokes[stroke]].T
        travel = np.abs(samples.x - begin) / np.maximum(np.abs(end - begin), 1e-300)
        place = stroke / max(int(stroke.max()), 1) - 0.5
        places = {
            "turns": _concentrated(squares, travel < 0.15),
            "ends": _concentrated(squares, np.abs(y) > 0.8),
            "cycles": _explained(residuals, place, place * y, place * np.sign(end - begin)),
        }
        if samples.is_timed:
            times = [(r.displacement, r.time) for r in samples.records if r.time is not None]
            speed = np.concatenate([np.gradient(*both) for both in times])[samples.rows]
            places["speed"] = _explained(residuals, speed, speed * np.abs(speed))
        if len(samples.records) > 1:
            of_row = samples.record_of_row
            places["record"] = max(_concentrated(squares, of_row == k) for k in np.unique(of_row))
        not_noise = max(1.0 - noise / mean, 0.0)
        return cls(math.sqrt(mean * not_noise), not_noise, autocorrelation_time(residuals), places)

    @property
    def is_structured(self) -> bool:
        """Whether more than noise is left; of white residuals, neighbours correlate by less than a third."""
        return self.not_noise > NOISE_ONLY and self.autocorrelation_time > 2.0

    @property
    def numbers(self) -> dict[str, Any]:
        """Those of a finding: how much is missed, and where."""
        return {"missed": self.missed, **self.places, "mostly": tuple(_PLACES[name] for name in self.where)}

    @property
    def where(self) -> list[str]:
        """The places in which a quarter of the misfit lies or more, the first one first."""
        return sorted((name for name, share in self.places.items() if share > 0.25), key=lambda n: -self.places[n])


def _white_noise(samples: Samples) -> float:
    """Mean variance of white noise at the rows, by the samples beside them [N^2]."""
    variances = []
    for record, turning, begin in zip(samples.records, samples.turning, samples.begins, strict=False):
        # A median over all is that of the usual force, and noise may grow with it.
        differences = np.abs(np.diff(record.force, 4))[np.argsort(np.abs(record.force[2:-2]))]
        growth = np.mean([np.median(part) ** 2 for part in np.array_split(differences, 4)])
        level = noise_level(record.force, turning[1:-1] - begin)
        variances.append(level**2 * float(growth) / max(float(np.median(differences)) ** 2, 1e-300))
    return float(np.average(variances, weights=np.bincount(samples.record_of_row, minlength=len(variances))))


def _concentrated(squares: FloatArray, there: BoolArray) -> float:
    """Share of some squares that lies there beside an even one: 0 to 1."""
    rows, share = float(there.mean()), float(squares[there].sum()) / max(float(squares.sum()), 1e-300)
    return max(share - rows, 0.0) / (1.0 - rows) if rows < 1.0 else 0.0


def _explained(residuals: FloatArray, *columns: FloatArray) -> float:
    """Share of the squared residuals that columns explain."""
    A = np.stack(columns, axis=1)
    A /= np.maximum(np.abs(A).max(axis=0), 1e-300)
    left = residuals - A @ np.linalg.lstsq(A, residuals, rcond=1e-8)[0]
    return 1.0 - float(left @ left) / max(float(residuals @ residuals), 1e-300)


def student_95(nu: float) -> float:
    """97.5 % quantile of Student's distribution of 4 degrees of freedom or more (Abramowitz and Stegun 26.7.5)."""
    z, nu = NORMAL_95, max(nu, 4.0)
    return z + (z**3 + z) / (4.0 * nu) + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * nu**2)
