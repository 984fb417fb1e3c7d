"""Whether the loops of a record run the way a spring's do."""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray
from ...loops.cycles import find_cycles
from ...loops.noise_levels import noise_level
from ...model.outcomes import Outcome
from ...records.record import Record

_NOISE = 4.0  # standard deviations of the work that noise seems to do
_LEAST = 1e-4  # height of a loop that is called none, share of the force range


def backwards(record: Record) -> Outcome | None:
    """Why the measured loops give energy away, in the words of `identify`; None if they do not.

    The energy is that of the full cycles. Without one it is that of the whole path, as far as no elastic force can
    have done the work between its ends.

    Parameters
    ----------
    record : Record

    Returns
    -------
    Outcome or None   FORCE_REVERSED or COLUMNS_SWAPPED.
    """
    x, r = record.displacement, record.force
    steps = np.diff(x)
    span = float(np.ptp(r))
    doubt = _NOISE * noise_level(r) * float(np.linalg.norm(steps)) + _LEAST * span * float(np.abs(steps).sum())
    cycles = find_cycles(record)
    if cycles:
        energy = sum(cycle.figures.energy_per_cycle for cycle in cycles)
    else:
        closing = 0.5 * (r[0] + r[-1]) * (x[0] - x[-1])
        energy = float(0.5 * (r[1:] + r[:-1]) @ steps + closing)
        doubt += span * abs(float(x[-1] - x[0]))
    return wrong_way(record) if energy < -doubt else None


def wrong_way(record: Record) -> Outcome:
    """The reason why the loops of a record run the wrong way round."""
    falling = correlation(record) < 0.0
    return Outcome.FORCE_REVERSED if falling else Outcome.COLUMNS_SWAPPED


def least_lag(record: Record) -> float | None:
    """The lag of the force that makes its loops vanish [s]: a spring's lags by less, unless the loops run backwards.

    A force of stiffness k that lags by d does the work -k d v dx, with the velocity v, on a step dx. None without
    rising times.
    """
    time = record.rising_time
    if time is None:
        return None
    x, r = record.displacement, record.force
    stiffness, offset = np.polyfit(x, r, 1).tolist()
    left = r - stiffness * x - offset
    steps = np.diff(x)
    work = float(0.5 * (left[1:] + left[:-1]) @ steps)
    return float(-work / (stiffness * np.sum(steps**2 / np.diff(time))))


def correlation(record: Record) -> float:
    """Correlation of displacement and force [-]; of the record or what is selected of it, whichever is larger.

    In a narrow range the hysteresis decides on it, and outside the range the force may snap through.
    """
    x, r = record.displacement, record.force
    whole = _correlation(x, r)
    if record.compared is None:
        return whole
    return max(whole, _correlation(x[record.compared], r[record.compared], otherwise=whole))


def _correlation(x: FloatArray, r: FloatArray, otherwise: float = 0.0) -> float:
    """Correlation of two series; another value where one is constant, or they are empty."""
    if x.size == 0 or not (np.ptp(x) and np.ptp(r)):
        return otherwise
    x, r = x - np.mean(x), r - np.mean(r)
    return float(x @ r / np.sqrt((x @ x) * (r @ r)))
