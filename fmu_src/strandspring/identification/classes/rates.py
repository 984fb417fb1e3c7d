"""Whether records tell a force that depends on the rate from one that depends on the path alone.

Loops of one amplitude and one rate do not: whatever a Maxwell branch does there, some friction does as well. They do
where the same stroke was driven at two rates, where the displacement rests within the test, where amplitudes and rates
vary independently of each other, and, for branches that relax over cycles, where the loops still change.
"""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray
from ...loops.left_out import dwells
from ..points.sample_points import ONE_AMPLITUDE, SamplePoints
from ..points.steady_part import SteadyRecord
from ..rig.effect_columns import Rig

_TWO_RATES = 1.25  # ratio of the times that strokes of one length take for their middle half
_INDEPENDENT = 1.5  # ratio of durations, and of speeds, that makes a path irregular
_TAIL = 0.1  # share of the strokes at either end that do not count
_SLOW = 1.0  # time constant in cycles from which loops that change show it
_CHANGES = 0.15  # share of a branch's force that differs between the cycles, from which they do
_CELLS = 12


def is_timed(rig: Rig) -> bool:
    """Whether every record has rising times and is not a single period."""
    return all(part.record.rising_time is not None and not part.periodic for part in rig.parts)


def shows_rate(rig: Rig) -> bool:
    """Whether strokes were driven at several rates, or the displacement rests within the test."""
    if any(dwells(part.record, part.strokes).within.any() for part in rig.parts):
        return True
    length, middle, duration = (np.concatenate(rows) for rows in zip(*map(_of_strokes, rig.parts), strict=True))
    if length.size < 2:
        return False
    order = np.argsort(-length, kind="stable")
    while order.size:
        alike = order[length[order] >= ONE_AMPLITUDE * length[order[0]]]
        if _spread(middle[alike]) >= _TWO_RATES:
            return True
        order = order[alike.size :]
    return min(_spread(duration), _spread(length / duration)) >= _INDEPENDENT


def _of_strokes(part: SteadyRecord) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Length [m] of the whole strokes that are used, times of their middle half and of all [s], shape (S,)."""
    strokes = part.strokes
    time = np.asarray(part.record.rising_time, np.float64)
    inner = range(max(part.first_used, 1), strokes.count - 1)
    rows = []
    for k in inner:
        samples = slice(strokes.turning[k], strokes.turning[k + 1] + 1)
        travel = np.abs(strokes.displacement[samples] - strokes.displacement[samples.start])
        enter, leave = np.interp([0.25, 0.75], travel / max(travel[-1], 1e-300), time[samples])
        rows.append((strokes.length[k], leave - enter, time[samples.stop - 1] - time[samples.start]))
    length, middle, duration = np.array(rows).reshape(-1, 3).T
    return length, np.maximum(middle, 1e-300), np.maximum(duration, 1e-300)


def _spread(values: FloatArray) -> float:
    """Ratio of large to small values, those at the ends of the distribution left out."""
    ordered = np.sort(values)
    cut = int(_TAIL * values.size)
    return float(ordered[-1 - cut] / ordered[cut])


def changes_over_cycles(rig: Rig, loops: SamplePoints, deflection: FloatArray, time: float) -> bool:
    """Whether a slow branch's force differs between cycles by more than another shape of the loop would.

    Parameters
    ----------
    rig : Rig
    loops : SamplePoints
    deflection : ndarray, shape (P,)   Of the branch's spring [m].
    time : float                       Its time constant [s].
    """
    if time < _SLOW * rig.period:
        return False
    low, high = loops.reach
    place = np.clip((loops.displacement - low) / (high - low), 0.0, 1.0) * _CELLS
    hats = np.maximum(1.0 - np.abs(place[:, None] - np.arange(_CELLS + 1)), 0.0)
    root = np.sqrt(loops.weight)
    sided = np.hstack([hats, loops.side[:, None] * hats])
    left = [
        root * deflection - columns @ np.linalg.lstsq(columns, root * deflection, rcond=1e-10)[0]
        for columns in (root[:, None] * hats, root[:, None] * sided)
    ]
    whole, changing = (float(np.linalg.norm(residuals)) for residuals in left)
    return changing > _CHANGES * whole
