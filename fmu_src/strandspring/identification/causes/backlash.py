"""A gap about zero force (backlash, pinching): within strokes the force rests near one level, then rises again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...kernel.arrays import FloatArray
from ..points.steady_part import SteadyRecord

_CELLS = 50  # of a stroke
_FLAT = 0.15  # slope in a gap, share of the stroke's mean slope
_STEEP = 0.7  # steepest slope near it on either side, in that, at least
_NEAR = 8  # cells
_LEAST = 0.06  # length of a gap that is reported, share of the stroke
_FULL = 0.9  # share of the longest stroke from which a stroke is judged
_LEVEL = 0.25  # distance of the gaps' forces of loading and unloading, share of the force's range


def backlash(parts: Sequence[SteadyRecord]) -> str:
    """The gap that most full strokes show at about one force, in both directions, in words; empty without.

    Parameters
    ----------
    parts : sequence of SteadyRecord
    """
    longest = max(float(part.strokes.length.max()) for part in parts)
    span = max(float(np.ptp(part.record.force)) for part in parts)
    gaps: dict[int, list[tuple[float, float]]] = {1: [], -1: []}
    judged = 0
    for part in parts:
        strokes = part.strokes
        for k in range(part.first_used, strokes.count):
            piece = slice(int(strokes.turning[k]), int(strokes.turning[k + 1]) + 1)
            if strokes.length[k] < _FULL * longest or piece.stop - piece.start < 2 * _CELLS:
                continue
            judged += 1
            gap = _gap(strokes.travel[piece][1:], part.record.force[piece][1:])
            if gap is not None:
                gaps[int(strokes.direction[k])].append(gap)
    both = gaps[1] + gaps[-1]
    if not gaps[1] or not gaps[-1] or 2 * len(both) <= judged:
        return ""
    levels = [float(np.median([force for _, force in gaps[side]])) for side in (1, -1)]
    if abs(levels[0] - levels[1]) > _LEVEL * span:
        return ""
    return f"{1e3 * np.median([width for width, _ in both]):.3g} mm at {np.mean(levels):.3g} N"


def _gap(travel: FloatArray, force: FloatArray) -> tuple[float, float] | None:
    """Width [m] and force [N] of the longest part of a stroke where the force rests, with steeper parts about it."""
    if travel[-1] == 0.0:
        return None
    cell = np.minimum((travel / travel[-1] * _CELLS).astype(np.intp), _CELLS - 1)
    count = np.bincount(cell, minlength=_CELLS)
    if count.min() == 0:
        return None
    mean = np.bincount(cell, weights=force, minlength=_CELLS) / count
    total = float(mean[-1] - mean[0]) / (_CELLS - 1)
    if total == 0.0:
        return None
    slope = np.diff(mean) / total
    smooth = np.convolve(slope, np.ones(3) / 3.0, mode="same")
    flat = np.diff(np.concatenate([[False], smooth < _FLAT, [False]]).astype(np.int8))
    begins, ends = np.flatnonzero(flat == 1), np.flatnonzero(flat == -1)
    inner = [
        (b, e) for b, e in zip(begins, ends, strict=True)
        if b > 1 and e < slope.size - 1
        and min(smooth[max(b - _NEAR, 0) : b].max(), smooth[e : e + _NEAR].max()) > _STEEP
    ]  # fmt: skip
    if not inner:
        return None
    begin, end = max(inner, key=lambda run: run[1] - run[0])
    if end - begin < _LEAST * _CELLS:
        return None
    return float(travel[-1]) * (end - begin) / _CELLS, float(mean[begin : end + 1].mean())
