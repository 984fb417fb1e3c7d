"""Mounts of other classes: what they add to the spring's force, as columns of a linear problem.

A mount may have more friction mechanisms than one, relax, or have another friction at another amplitude, rate or in
another record. None of that is a fault of the rig, and much of it looks like one. So an effect of the rig is removed
only where no such mount explains the records as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...kernel.arrays import FloatArray
from ..points.sample_points import IndexArray, SamplePoints
from ..search.search import MARGIN
from .corrected import Corrected
from .effect_columns import Rig
from .traces_in_residuals import Tangent

_THRESHOLDS = 0.6 * 0.5 ** np.arange(7)  # of stop operators, shares of half the longest stroke
_TIMES = (0.1, 0.3, 1.0)  # of relaxation, in cycles; a shorter one is a dashpot's
_GROUPED = (
    "friction that differs between amplitudes, rates or records",
    "stiffness that differs between amplitudes, rates or records",
)
_ALIKE = 0.9  # amplitude, or rate, in another one from which they are alike


@dataclass(frozen=True, eq=False)
class Explanation:
    """What another class of mount explains.

    Attributes
    ----------
    mount : str                The class in words.
    misfit : float             rms that it leaves [N].
    price : int                Parameters that it has more.
    is_grouped : bool          It differs between groups of strokes of like amplitude, rate and record.
    """

    mount: str
    misfit: float
    price: int
    is_grouped: bool = False


def explanations(rig: Rig, state: Corrected) -> list[Explanation]:
    """What other mounts leave of the residuals of a spring, by a linear problem in their parameters and the spring's.

    Parameters
    ----------
    rig : Rig
    state : Corrected
    """
    tangent = Tangent(state)
    total = float(state.loops.weight.sum())
    mounts = []
    for mount, columns, price in _mounts(rig, state):
        trace = tangent.beside(columns * tangent.root[:, None])
        trace /= np.maximum(np.sqrt(np.sum(trace**2, axis=0)), 1e-300)
        left = tangent.misfit - trace @ np.linalg.lstsq(trace, tangent.misfit, rcond=1e-6)[0]
        mounts.append(Explanation(mount, float(np.sqrt(left @ left / total)), price, mount in _GROUPED))
    return mounts


def nearest_mount(rig: Rig, state: Corrected) -> str | None:
    """The class of mount that explains the residuals of a spring best, in words; None if none is worth its price.

    The criterion is that of `search`, and must fall by as much as for an effect of the rig.
    """
    criterion = state.criterion
    best = min(explanations(rig, state), key=lambda mount: criterion.value(mount.misfit, mount.price))
    gain = criterion.value(state.fit.misfit, 0) - criterion.value(best.misfit, best.price)
    return best.mount if gain > MARGIN else None


def _mounts(rig: Rig, state: Corrected) -> Iterator[tuple[str, FloatArray, int]]:
    """Classes of mounts in words, with columns of shape (P, C) [m or N] and the number of their parameters."""
    loops, refinement = state.loops, state.fit.refinement
    low, high = loops.reach
    place = (2.0 * loops.displacement - low - high)[:, None] / (high - low)
    stops = stop_operators(loops, np.asarray(0.5 * loops.longest * _THRESHOLDS, np.float64))
    for k in range(_THRESHOLDS.size):
        stop = stops[:, k : k + 1]
        yield "a second friction mechanism", np.hstack([stop, place * stop]), 3
    yield "several friction mechanisms", np.hstack([stops, place * stops]), 2 * _THRESHOLDS.size
    if all(part.record.rising_time is not None and not part.periodic for part in rig.parts):
        relaxing = np.stack([rig.branch(loops, share * rig.period)[0] for share in _TIMES], axis=1)
        for k in range(len(_TIMES)):
            yield "a material that relaxes", relaxing[:, k : k + 1], 2
        both = np.hstack([stops, place * stops, relaxing])
        yield "several friction mechanisms in a material that relaxes", both, both.shape[1]
    group = groups_of_strokes(rig, loops)
    if group.max() > 0:
        in_group = group[:, None] == np.arange(1, group.max() + 1)
        friction = (refinement.omega * refinement.backbone.G)[:, None] * in_group
        elastic = (refinement.backbone.FE - refinement.backbone.FE.mean())[:, None] * in_group
        for name, columns in zip(_GROUPED, (friction, elastic), strict=True):
            yield name, np.asarray(columns), int(group.max())


def groups_of_strokes(rig: Rig, loops: SamplePoints) -> IndexArray:
    """Number of the group of like amplitude, rate and record to which the stroke of each point belongs, shape (P,)."""
    duration = rig.durations(loops)
    keys = [loops.record.tolist(), _classes(loops.length), _classes(duration)]
    numbers: dict[tuple[int, ...], int] = {}
    used = loops.used
    of_stroke = np.zeros(loops.length.size, np.intp)
    for stroke in used.tolist():
        of_stroke[stroke] = numbers.setdefault(tuple(key[stroke] for key in keys), len(numbers))
    return of_stroke[loops.stroke]


def _classes(values: FloatArray) -> list[int]:
    """Numbers of classes of like values, each within _ALIKE of the largest in it."""
    number = np.zeros(values.size, int)
    largest, current = math.inf, -1
    for k in np.argsort(-values, kind="stable").tolist():
        if values[k] < _ALIKE * largest:
            largest, current = float(values[k]), current + 1
        number[k] = current
    return list(number.tolist())


def stop_operators(loops: SamplePoints, thresholds: FloatArray) -> FloatArray:
    """Stop operators: each follows the displacement within +-threshold, shape (P, J); 0 where a record begins [m]."""
    begin = np.zeros((loops.direction.size, thresholds.size))
    held = np.zeros(thresholds.size)
    for k, (side, length) in enumerate(zip(loops.direction.tolist(), loops.length.tolist(), strict=True)):
        if k and loops.record[k] != loops.record[k - 1]:
            held = np.zeros(thresholds.size)
        begin[k] = held
        held = np.clip(held + side * length, -thresholds, thresholds)
    moved = (loops.side * loops.travel)[:, None]
    return np.clip(begin[loops.stroke] + moved, -thresholds, thresholds)
