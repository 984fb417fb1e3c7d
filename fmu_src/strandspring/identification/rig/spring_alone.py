"""What the records would be without the rig: the effects that were found or given removed from every sample."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...loops.strokes import find_strokes
from ..points.sample_points import POINTS_PER_STROKE
from ..points.steady_part import SteadyRecord
from ..search.search import Candidate
from .effect_columns import Rig, Sizes, transferred


def spring_alone(rig: Rig, sizes: Sizes, fit: Candidate) -> tuple[SteadyRecord, ...]:
    """The steady parts of the records as the spring alone gives them, the same samples used.

    Parameters
    ----------
    rig : Rig         Of every sample.
    sizes : dict      Of the effects that were found.
    fit : Candidate   The spring, on which the size of some effects depends.
    """
    loops = rig.corrected(sizes, transferred(fit, rig.placed(sizes)))
    parts = []
    for part, (_, at) in zip(rig.parts, loops.by_record, strict=True):
        record = replace(part.record, displacement=loops.displacement[at], force=loops.force[at])
        strokes = find_strokes(record.displacement)
        # A delay moves the turning points.
        first_used = int(np.argmin(np.abs(strokes.turning[:-1] - part.first_sample)))
        moved = replace(part, record=record, strokes=strokes, first_used=first_used)
        parts.append(replace(moved, loops=moved.loops_with(POINTS_PER_STROKE)))
    return tuple(parts)
