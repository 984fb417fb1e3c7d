"""What the paper's method and Ni's need: whole periods of a record at uniform phases, and springs of polynomials."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..core.parameters import SpringParameters
from ..errors import RecordError
from ..identification.samples import Samples
from ..identification.spring import possible_spring
from ..kernel.arrays import FloatArray
from ..loops.strokes import FEWEST_SAMPLES, LEAST_STROKE, NOISE_SPAN, find_strokes, noise_level
from ..records.record import Record


class Hysteresis(NamedTuple):
    """rho [1/m], sigma, n of eq. (11)."""

    rho: float
    sigma: float
    n: float


def polynomial_spring(
    where: str, within: tuple[float, float], offset: float, unit: float, FE: FloatArray, G: FloatArray, h: Hysteresis
) -> SpringParameters:
    """The spring of FE and G [N] by powers of the displacement from an offset in some unit [m]."""
    return possible_spring(
        where, kE=(FE / unit ** np.arange(FE.size)).tolist(), kA=(G / G[0] / unit ** np.arange(G.size)).tolist(),
        kappa_omega=float(G[0]), **h._asdict(), displacement_offset=offset, displacement_min=within[0],
        displacement_max=within[1],
    )  # fmt: skip


def one_record(samples: Samples, where: str, method: str) -> Record:
    """The one record of whole periods that a method takes, or RecordError with its name and that of the method."""
    record, *others = samples.measured
    if others:
        raise RecordError(f"{where}: {method} takes one periodic record; give one, or use another method.")
    if record.compared is not None:
        raise RecordError(f"{where}: {method} takes whole periods; select no range, or use another method.")
    return record


def whole_periods(record: Record) -> tuple[FloatArray, FloatArray]:
    """Cut the whole periods out of a periodic record and resample them to uniform phases.

    A first period with another force, such as one that starts with a virgin curve, is left out. Samples that already
    lie at uniform phases are returned as they are, apart from the reversals within the displacement's noise.

    Parameters
    ----------
    record : Record   Its time must rise strictly; without time, the samples are uniform in it.

    Returns
    -------
    displacement : ndarray, shape (K,)   Mean of the C periods, made monotone within each stroke [m].
    force : ndarray, shape (C, K)        Each period [N].

    Raises
    ------
    RecordError   If the displacement is not periodic, holds no whole period or has fewer than 16 samples in one.
    """
    x, r = record.displacement, record.force
    clock = np.arange(x.size, dtype=np.float64) if record.time is None else record.time
    if not (np.diff(clock) > 0.0).all():
        raise RecordError(
            f"{record.path}: `time` must rise strictly from sample to sample; leave it out if the samples are uniform."
        )
    step = float(np.median(np.diff(clock)))
    period = _period(record, clock, step)
    count = int((clock[-1] - clock[0] + step) / period + 0.05)  # the step that closes the last one may be missing
    size = round(period / step)
    if size < FEWEST_SAMPLES:
        raise RecordError(
            f"{record.path}: a period must have at least {FEWEST_SAMPLES} samples, got {size}; sample faster."
        )
    # The last periods, since the first may hold a transient.
    at = max(clock[0], clock[-1] + step - count * period) + period * np.arange(count * size) / size
    moved, forces = (np.interp(at, clock, values).reshape(count, size) for values in (x, r))
    difference = float(np.sqrt(np.mean((moved - moved.mean(axis=0)) ** 2)) / np.ptp(x))
    if difference > LEAST_STROKE:
        sentence = (
            "{where}: the periods of the displacement differ by {apart:.3g %} of its range (rms); cut the record to "
            "whole periods of one amplitude ({to[cycles]})."
        )
        raise RecordError(sentence, where=record.path, apart=difference)
    first, others = forces[0], forces[1:].mean(axis=0) if count > 1 else forces[0]
    # It holds a virgin curve where it differs beyond noise and rounding.
    if np.sqrt(np.mean((first - others) ** 2)) > 1e-3 * np.ptp(first) + 2.0 * noise_level(first):
        moved, forces = moved[1:], forces[1:]
    return _monotone(moved.mean(axis=0)), forces


def _period(record: Record, clock: FloatArray, step: float) -> float:
    """Period in units of the clock: from the crossings of the middle, or the whole record if it closes."""
    x, turns = record.displacement, find_strokes(record.displacement).turning
    if turns.size < 3:
        raise RecordError(
            f"{record.path}: the displacement must hold at least one whole period, got {turns.size - 1} stroke(s); "
            "record longer."
        )
    level = 0.5 * float(x.min() + x.max())
    before = np.flatnonzero(np.diff(x >= level))
    # One to a stroke, as noise crosses more often; upwards or downwards, as there are more: a record may begin there.
    _, once = np.unique(np.searchsorted(turns, before, side="right"), return_index=True)
    before = before[once]
    upwards = x[before + 1] >= level
    before = max(before[upwards], before[~upwards], key=len)
    crossings = clock[before] + (level - x[before]) / (x[before + 1] - x[before]) * np.diff(clock)[before]
    if crossings.size >= 2:
        period = float(np.polyfit(np.arange(crossings.size), crossings, 1)[0])
        # A rig that samples in step with its motion: less than half a sample off over the whole record.
        whole = round(period / step) * step
        return whole if abs(period - whole) * crossings.size < 0.5 * step else period
    moved, gap = np.abs(np.diff(x)), abs(float(x[-1] - x[0]))
    if gap > 3.0 * float(moved.max()) + NOISE_SPAN * noise_level(x):
        sentence = (
            "{where}: after one whole period the displacement misses where it began by {gap:.3g %} of its range; cut "
            "the record to whole periods ({to[cycles]})."
        )
        raise RecordError(sentence, where=record.path, gap=gap / np.ptp(x))
    # The last sample may repeat the first or stop one step short of it.
    return float(clock[-1] - clock[0]) + (0.0 if gap < 0.5 * min(float(moved[0]), float(moved[-1])) else step)


def _monotone(period: FloatArray) -> FloatArray:
    """The period without reversals that are noise."""
    top = int(np.argmax(period))
    x = np.append(np.roll(period, -top), period[top])
    turns = find_strokes(x).turning
    for begin, end in zip(turns[:-1], turns[1:] + 1, strict=True):
        side = np.sign(x[end - 1] - x[begin])
        x[begin:end] = side * np.sort(side * x[begin:end])
    return np.roll(x[:-1], top)
