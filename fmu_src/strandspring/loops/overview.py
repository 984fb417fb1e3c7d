"""What there is in a record, for people to choose from: strokes, cycles, and which samples are left out and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..records.record import Record
from ..records.spikes import spikes_of
from .cycles import Cycle, find_cycles
from .left_out import clipped_samples, dwells
from .strokes import IndexArray, Strokes, find_strokes


@dataclass(frozen=True, eq=False)
class RecordOverview:
    """What there is in a record.

    Attributes
    ----------
    strokes : Strokes
    cycles : tuple of Cycle   In the order in which `select` counts them; empty if there is no full one.
    left_out : mapping        Indices of samples, ascending, that are left out of a fit, by the reason: "clipped",
                              "dwells", "not selected"; "spikes" are not left out, but should be corrected. Without
                              reasons for which there are none.
    """

    strokes: Strokes
    cycles: tuple[Cycle, ...]
    left_out: Mapping[str, IndexArray]


def overview(record: Record) -> RecordOverview:
    """What there is in a record.

    Parameters
    ----------
    record : Record

    Examples
    --------
    >>> import numpy as np
    >>> from strandspring import Record
    >>> from strandspring.loops.overview import overview
    >>> path = 1e-3 * np.sin(np.linspace(0.0, 6.0 * np.pi, 601))
    >>> seen = overview(Record(path, 1e4 * path))
    >>> seen.strokes.count, len(seen.cycles), round(seen.cycles[0].figures.amplitude, 6)
    (7, 2, 0.001)
    """
    strokes = find_strokes(record.displacement)
    left_out: dict[str, IndexArray] = {
        "spikes": np.union1d(*spikes_of(record.displacement, record.force)).astype(np.intp),
        "clipped": np.flatnonzero(clipped_samples(record.force)),
        "dwells": np.flatnonzero(dwells(record, strokes).resting),
        "not selected": np.flatnonzero([] if record.compared is None else ~record.compared),
    }
    seen = {reason: samples for reason, samples in left_out.items() if samples.size}
    return RecordOverview(strokes, find_cycles(record), seen)
