"""Isolated outliers: damaged readings far outside all other samples."""

from __future__ import annotations

import numpy as np

from ..kernel.arrays import BoolArray, FloatArray, IndexArray

_MOST = 6  # spikes at either end of the range; more of them are not spikes
_LEAST_SAMPLES = 60  # for each of them
_LONGEST = 3  # samples in a row
_BEYOND = 0.5  # distance from the range of the other samples, share of that range
_JUMP = 5.0  # distance from both neighbours, in steps that 95 % of the samples do not exceed
_LOOKED_AT = 4096  # samples of the quick check


def find_spikes(values: FloatArray) -> IndexArray:
    """Isolated outliers: beyond the range of all others by half of it, and far from both neighbours.

    Spikes are at most three in a row and a few in all. Records with few samples per cycle have none, since their
    neighbours are far apart everywhere; the first and last sample never are spikes.

    Parameters
    ----------
    values : ndarray, shape (K,)   Displacement or force.

    Returns
    -------
    ndarray of int                 Ascending indices; mostly empty.
    """
    sample = values[:: max(1, values.size // _LOOKED_AT)]
    none = np.empty(0, dtype=np.intp)
    if not _beyond(np.array([values.min(), values.max()]), *_trimmed_range(sample)).any():
        return none
    suspects = np.flatnonzero(_beyond(values, *_trimmed_range(values)))
    if suspects.size == 0 or suspects.size > 2 * _MOST:
        return none
    step = float(np.quantile(np.abs(np.diff(values)), 0.95))
    consecutive = np.split(suspects, np.flatnonzero(np.diff(suspects) > 1) + 1)
    runs = [run for run in consecutive if _is_isolated(values, run, step)]
    if not runs:
        return none
    spikes = np.concatenate(runs)
    rest = np.delete(values, spikes)
    return spikes[_beyond(values[spikes], float(rest.min()), float(rest.max()))]


def spikes_of(displacement: FloatArray, force: FloatArray) -> tuple[IndexArray, IndexArray]:
    """Spikes of displacement and of force; a sample at which both deviate is a short stroke, not a spike."""
    of_displacement, of_force = find_spikes(displacement), find_spikes(force)
    return np.setdiff1d(of_displacement, of_force), np.setdiff1d(of_force, of_displacement)


def _trimmed_range(values: FloatArray) -> tuple[float, float]:
    """Minimum and maximum without the few at either end that may be spikes."""
    cut = min(_MOST, values.size // _LEAST_SAMPLES)
    middle = np.partition(values, (cut, values.size - 1 - cut))
    return float(middle[cut]), float(middle[values.size - 1 - cut])


def _beyond(values: FloatArray, low: float, high: float) -> BoolArray:
    # Halved first, because the range may overflow.
    margin = _BEYOND * high - _BEYOND * low
    return np.asarray((values > high + margin) | (values < low - margin))


def _is_isolated(values: FloatArray, run: IndexArray, step: float) -> bool:
    """Whether a run is short and far from the samples before and after it, compared with the steps of the record."""
    before, after = int(run[0]) - 1, int(run[-1]) + 1
    if run.size > _LONGEST or before < 0 or after >= values.size:
        return False
    reach = values[run][:, None] - values[[before, after]]
    one_way = bool((reach > 0.0).all() or (reach < 0.0).all())
    return one_way and float(np.abs(reach).min()) > _JUMP * step
