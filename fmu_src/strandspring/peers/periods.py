"""Whole periods of a periodic record at uniform phases, which the Fourier methods need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import RecordError
from ..identification.points.steady_part import SteadyRecord
from ..kernel.arrays import FloatArray
from ..loops.noise_levels import noise_level
from ..loops.strokes import Strokes, find_strokes
from ..records.record import Record

_REPEATS = 0.02  # rms difference between two periods that is called none, share of the range
_TRANSIENT = 1e-3  # the same for the force of the first period, which may hold a virgin curve, beyond its noise
_MISSING = 0.05  # share of a period that may be missing at the end of the last one: the step that closes it
_FEWEST = 16  # samples per period that make a usable one


@dataclass(frozen=True, eq=False)
class Periods:
    """C periods of K samples at uniform phases, with nothing before, between and after them.

    Attributes
    ----------
    displacement : ndarray, shape (K,)   Mean period, made monotone within each stroke; in the unit given.
    force : ndarray, shape (C, K)        Each period [N].
    """

    displacement: FloatArray
    force: FloatArray

    @property
    def count(self) -> int:
        """Number of periods C."""
        return int(self.force.shape[0])

    @property
    def mean_force(self) -> FloatArray:
        """Mean over the periods, shape (K,) [N]: all harmonics of the period, and nothing between them."""
        return np.asarray(self.force.mean(axis=0))


def whole_periods(displacement: ArrayLike, force: ArrayLike, time: ArrayLike | None = None) -> Periods:
    """Cut the whole periods out of a periodic record and resample them to uniform phases.

    A first period with another force, such as one that starts with a virgin curve, is left out. Samples that already
    lie at uniform phases are returned as they are, apart from the reversals within the displacement's noise.

    Parameters
    ----------
    displacement, force : array_like, shape (K,)   In any unit of length; [N].
    time : array_like, shape (K,), or None         Strictly rising [s]; None if the samples are uniform in time.

    Returns
    -------
    Periods

    Raises
    ------
    RecordError   If the displacement is not periodic, holds no whole period or has fewer than 16 samples in one.
    """
    record = Record(displacement, force, time)  # type: ignore[arg-type]  # which makes arrays of them
    x, r = record.displacement, record.force
    clock = np.arange(x.size, dtype=np.float64) if record.time is None else record.time
    if not (np.diff(clock) > 0.0).all():
        raise RecordError("`time` must rise strictly from sample to sample; leave it out if the samples are uniform.")
    step = float(np.median(np.diff(clock)))
    period = _period(find_strokes(x), x, clock, step)
    count = int((clock[-1] - clock[0] + step) / period + _MISSING)
    size = round(period / step)
    if size < _FEWEST:
        raise RecordError(f"a period must have at least {_FEWEST} samples, got {size}; sample faster.")
    # The last periods, since the first may hold a transient.
    begin = max(clock[0], clock[-1] + step - count * period)
    at = begin + period * np.arange(count * size) / size
    columns = [np.interp(at, clock, values).reshape(count, size) for values in (x, r)]
    moved, forces = columns
    difference = float(np.sqrt(np.mean((moved - moved.mean(axis=0)) ** 2)))
    if difference > _REPEATS * np.ptp(x):
        raise RecordError(
            "the displacement must repeat itself from period to period, but its periods differ by "
            f"{100.0 * difference / np.ptp(x):.3g} % of its range (rms); cut the record to whole periods of one "
            "amplitude (`cycles=...`)."
        )
    if count > 1 and _differs(forces):
        moved, forces = moved[1:], forces[1:]
    return Periods(_monotone(moved.mean(axis=0)), forces)


def one_record(parts: Sequence[SteadyRecord], where: str, method: str) -> Record:
    """The one record of whole periods that a method takes.

    Parameters
    ----------
    parts : sequence of SteadyRecord
    where : str                        Names of the records, for messages.
    method : str                       Its name, likewise.

    Raises
    ------
    RecordError   If there are several, or a range of displacement is selected.
    """
    if len(parts) > 1:
        raise RecordError(f"{where}: {method} takes one periodic record; give one, or use another method.")
    record = parts[0].record
    if record.compared is not None:
        raise RecordError(
            f"{where}: {method} takes whole periods; select no range of displacement, or use another method."
        )
    return record


def _period(strokes: Strokes, x: FloatArray, clock: FloatArray, step: float) -> float:
    """Period in units of the clock: from the mid-level crossings, or the whole record if it closes."""
    if strokes.count < 2:
        raise RecordError(
            f"the displacement must hold at least one whole period, got {strokes.count} stroke(s); record longer."
        )
    smooth = strokes.displacement
    level = 0.5 * (float(smooth.min()) + float(smooth.max()))
    # Upwards or downwards, as there are more: a record may begin on the level.
    above = smooth >= level
    before = max((np.flatnonzero(above[1:] & ~above[:-1]), np.flatnonzero(~above[1:] & above[:-1])), key=len)
    steps = smooth[before + 1] - smooth[before]
    crossings = clock[before] + (level - smooth[before]) / steps * np.diff(clock)[before]
    if crossings.size >= 2:
        period = float(np.polyfit(np.arange(crossings.size), crossings, 1)[0])
        # A rig that samples in step with its motion: less than half a sample off over the whole record.
        whole = round(period / step) * step
        return whole if abs(period - whole) * crossings.size < 0.5 * step else period
    moved = np.abs(np.diff(smooth))
    gap = abs(float(x[-1] - x[0]))
    if gap > 3.0 * float(moved.max()) + 12.0 * noise_level(x):
        raise RecordError(
            f"the displacement must end where it began after one whole period, got a gap of {gap:.4g} at a range of "
            f"{np.ptp(x):.4g}; cut the record to whole periods (`cycles=...`)."
        )
    # The last sample may repeat the first or stop one step short of it.
    repeated = gap < 0.5 * min(float(moved[0]), float(moved[-1]))
    return float(clock[-1] - clock[0]) + (0.0 if repeated else step)


def _differs(force: FloatArray) -> bool:
    """Whether the first period's force is not that of the mean of the others, beyond noise."""
    first, others = force[0], force[1:].mean(axis=0)
    noise = noise_level(first)
    return float(np.sqrt(np.mean((first - others) ** 2))) > _TRANSIENT * float(np.ptp(force)) + 2.0 * noise


def _monotone(period: FloatArray) -> FloatArray:
    """The period without reversals that are noise."""
    top = int(np.argmax(period))
    rolled = np.append(np.roll(period, -top), period[top])
    return np.roll(find_strokes(rolled).displacement[:-1], top)
