"""What a rig adds to records: a moving mass, a fixture that yields and a delay between the columns.

With the measured displacement x and force R, a force that lags by d, a mass m between load cell and spring and a
fixture of stiffness K between displacement sensor and spring, the spring's own displacement and force are

    x_s(t) = x(t) - R(t + d)/K,    R_s(t) = R(t + d) - m*a(t),

with the acceleration a of x_s. The force stays at the samples at which it was measured: beside the force at t stands
the displacement at t - d.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..errors import RecordError
from ..findings import Finding, Outcome
from ..kernel.arrays import FloatArray
from ..loops.strokes import turning_points
from ..records.record import Record
from .choice import flexible
from .fit import Fit, Problem, SpringClass
from .options import RefinedOptions
from .refusals import Strokes
from .samples import REVERSAL, Samples


def without_rig(record: Record, options: RefinedOptions) -> Record:
    """The record of the spring alone: at each sample its force, and the displacement where that force arose.

    Raises
    ------
    RecordError   If mass, delay or branches need times that the record does not have, or the delay is longer than a
                  stroke.
    """
    lag, time = options.delay or 0.0, record.rising_time
    if options.branches and time is None:
        raise RecordError(
            "{where}: Maxwell branches need times that rise from sample to sample; name the time column with "
            "{to[time]}, or give {to[branches=0]}.",
            where=record.path,
        )
    if lag and abs(lag) >= (stroke := _stroke(record, _times(record, "delay"))):
        raise RecordError(
            "{where}: the given delay of {lag:.6g ms} is longer than a stroke ({stroke:.4g ms}); check the unit of "
            "{to[delay]} and of the time column.",
            where=record.path,
            lag=lag,
            stroke=stroke,
        )
    if options.fixture_stiffness < math.inf:
        force = record.force if time is None else np.interp(time + lag, time, record.force)
        record = replace(record, displacement=record.displacement - force / options.fixture_stiffness)
    if options.moving_mass > 0.0:
        time = _times(record, "moving_mass")
        inertia = np.interp(time - lag, time, options.moving_mass * acceleration(record.displacement, time))
        record = replace(record, force=record.force - inertia)
    return lagging(record, lag)


def _times(record: Record, option: str) -> FloatArray:
    """The times; a RecordError if they do not rise."""
    if record.rising_time is None:
        lacking = "the record has none" if record.time is None else "they do not"
        raise RecordError(
            f"{{where}}: {{to[{option}]}} needs times that rise from sample to sample, and {lacking}; name the time "
            "column with {to[time]}, or go without.",
            where=record.path,
        )
    return record.rising_time


def _stroke(record: Record, time: FloatArray) -> float:
    """Median duration of a stroke [s]."""
    return float(np.median(np.diff(time[Strokes(record).turning])))


def lagging(record: Record, lag: float) -> Record:
    """The record with the displacement at the moments at which its forces arose; those beside it are not compared."""
    if not lag or record.time is None:
        return record
    moment = record.time - lag
    inside = (moment >= record.time[0]) & (moment <= record.time[-1])
    compared = inside if record.compared is None else inside & record.compared
    displacement = np.interp(moment, record.time, record.displacement)
    return replace(record, displacement=displacement, compared=record.compared if compared.all() else compared)


def acceleration(displacement: FloatArray, time: FloatArray) -> FloatArray:
    """Acceleration at each sample, shape (K,) [m/s^2]: second derivatives of quadratics over a part of a stroke."""
    last = displacement.size - 1
    if last < 2:
        return np.zeros(last + 1)  # of two samples there is none
    turning = turning_points(displacement, REVERSAL * float(np.ptp(displacement)))
    # Half the window is 0.04 of a stroke: 0.2 % of a sine is lost.
    half = min(max(2, round(0.04 * float(np.median(np.diff(turning))))), last // 2)
    middle = np.clip(np.arange(last + 1), half, last - half)
    moments, products = np.zeros((5, middle.size)), np.zeros((3, middle.size))
    scale = time[middle + half] - time[middle - half]
    for offset in range(-half, half + 1):
        powers = ((time[middle + offset] - time[middle]) / scale) ** np.arange(5)[:, None]
        moments += powers
        products += powers[:3] * (displacement[middle + offset] - displacement[middle])
    matrices = np.moveaxis(moments[np.add.outer(np.arange(3), np.arange(3))], 2, 0)
    return np.asarray(2.0 * np.linalg.solve(matrices, products.T[:, :, None])[:, 2, 0] / scale**2)


def likely_delay(samples: Samples) -> float:
    """The lag of the force without which a flexible spring leaves nothing but noise [s]; 0 if it does so with it."""
    problem = Problem(samples)
    fit = flexible(problem, SpringClass((3, 10), (5,)))
    if problem.is_noise(fit):
        return 0.0
    lag, is_noise, squares = best_lag(samples, fit, 0.0, 0.02 * samples.cycle_time)
    return lag if is_noise and squares < 0.5 * fit.squares else 0.0


def best_lag(samples: Samples, fit: Fit, lag: float, step: float) -> tuple[float, bool, float]:
    """The lag near another with which a class leaves least, whether that is noise, and the squared misfit."""

    def at(lag: float, q: FloatArray) -> tuple[float, float, Problem, Fit]:
        problem = Problem(samples.on([lagging(record, lag) for record in samples.records]))
        fitted = problem.local(fit.spring_class, q, 4, 1e-3)
        return fitted.squares, lag, problem, fitted

    best = at(lag, fit.q)
    for _ in range(10):
        nearer = min((at(best[1] + side * step, best[3].q) for side in (-1.0, 1.0)), key=lambda trial: trial[0])
        step *= 1.0 if nearer[0] < best[0] else 0.4
        best = min(best, nearer, key=lambda trial: trial[0])
    return best[1], best[2].is_noise(best[3]), best[0]


def unknown_effects(records: Sequence[Record], known: Container[str]) -> Iterator[Finding]:
    """How much a mass or a fixture that was not given would change the stiffness, where it could matter."""
    stiffnesses = [float(np.polynomial.Polynomial.fit(r.displacement, r.force, 1).convert().coef[1]) for r in records]
    share, frequency = 0.0, 0.0
    for record, stiffness in zip(records, stiffnesses, strict=True):
        stroke = 0.0 if record.time is None else _stroke(record, record.time)
        if stroke > 0.0 and stiffness > 0.0:
            share, frequency = max((share, frequency), ((math.pi / stroke) ** 2 / stiffness, 0.5 / stroke))
    worth = 0.005  # of the stiffness
    if "moving_mass" not in known and share > worth:
        yield Finding(Outcome.UNKNOWN_MASS, {"share": share, "frequency": frequency})
    if "fixture_stiffness" not in known and (share := max(stiffnesses) / 1e7) > worth:
        yield Finding(Outcome.UNKNOWN_FIXTURE, {"share": share})
