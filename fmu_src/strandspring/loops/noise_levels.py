"""White noise of sampled signals, from what their differences over a few samples cannot be of the signal itself."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..kernel.arrays import FloatArray
from .turning import turning_points

Samples = Sequence[int] | NDArray[np.intp]

# A reversal must exceed this fraction of the displacement range: sensors jump, and so small a loop dissipates almost
# nothing.
_RANGE_FACTOR = 0.02
# Noise below this fraction of the displacement range is left as it is: the loops are known far worse.
_NEGLIGIBLE = 1e-4
# What estimates from higher differences are to that from the fourth ones at least, if it is noise that they are of;
# of a smooth path with 12 samples per cycle it is less.
_WHITE = 0.7
_FEW = 0.1  # share of differences that hardly moves their median
_ENOUGH = 9  # differences from which noise is estimated


def noise_level(values: FloatArray, turns: Samples = ()) -> float:
    """Standard deviation of white noise on a signal, from the median of its fourth differences.

    The fourth difference of white noise of variance s^2 has variance 70*s^2; that of a sine with 20 samples per cycle
    is 0.1 % of its amplitude. If many reach across bends, those that do not are used, or third or second differences,
    more of which do not, if the estimate from these is less. `turns` are samples at or next to which the signal bends
    sharply, such as reversals.
    """
    if values.size < _ENOUGH:
        return 0.0
    level = _level_of(np.diff(values, 4), 4)
    for order in (4, 3, 2) if len(_across(turns, 4, values.size)) else ():
        within = np.delete(np.diff(values, order), _across(turns, order, values.size))
        if within.size >= _ENOUGH:
            return min(level, _level_of(within, order))
    return level


def _across(turns: Samples, order: int, samples: int) -> NDArray[np.intp]:
    """Which differences of an order reach across a bend, before or after its sample; none if they are few."""
    places = (np.asarray(turns, np.intp)[:, None] - np.arange(order + 1)).ravel()
    reaches = np.zeros(samples - order, np.bool_)
    reaches[places[(places >= 0) & (places < reaches.size)]] = True
    found = np.flatnonzero(reaches)
    return found if found.size > _FEW * (samples - order) else found[:0]


def _level_of(differences: FloatArray, order: int) -> float:
    """Standard deviation of white noise from the median of its differences of an order."""
    return float(np.median(np.abs(differences))) / (0.6745 * math.sqrt(math.comb(2 * order, order)))


def is_white_noise(displacement: FloatArray, level: float) -> bool:
    """Whether the noise level of a path [m] is not negligible, and not of a path that bends from sample to sample."""
    if level <= _NEGLIGIBLE * float(np.ptp(displacement)):
        return False
    return _level_of(np.diff(displacement, 6), 6) >= _WHITE * level


def path_noise_level(displacement: FloatArray) -> float:
    """`noise_level` of a path, whose reversals are found by the way [m]."""
    noise = noise_level(displacement)
    if noise <= _NEGLIGIBLE * float(np.ptp(displacement)):
        return noise
    return noise_level(displacement, turning_points(displacement, least_reversal(displacement))[1:-1])


def least_reversal(displacement: FloatArray) -> float:
    """Smallest change of displacement that counts as a stroke of a path without noise [m]."""
    return _RANGE_FACTOR * float(np.ptp(displacement))
