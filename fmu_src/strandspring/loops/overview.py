"""What there is in a record, for people to choose from: strokes, cycles, and which samples are left out and why."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..records.record import Record
from ..records.spikes import spikes_of
from .cycles import find_cycles
from .left_out import clipped_samples, dwells
from .strokes import find_strokes


@dataclass(frozen=True)
class StrokeOverview:
    """One stroke.

    Attributes
    ----------
    direction : int                   +1 loading, -1 unloading.
    first_sample, last_sample : int   Indices; the last one is the first one of the next stroke.
    length : float                    [m].
    """

    direction: int
    first_sample: int
    last_sample: int
    length: float


@dataclass(frozen=True)
class CycleOverview:
    """One cycle, numbered as `select` counts them.

    Attributes
    ----------
    number : int                      From 1.
    first_sample, last_sample : int   Indices; the last one is the first one of the next cycle in a series.
    amplitude : float                 [m].
    frequency : float or None         [Hz]; None without increasing times.
    """

    number: int
    first_sample: int
    last_sample: int
    amplitude: float
    frequency: float | None


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Samples that are left out of a fit, or better were.

    Attributes
    ----------
    reason : str              "clipped", "dwells", "not selected"; "spikes" are not left out, but should be corrected.
    samples : ndarray of int  Indices, ascending.
    """

    reason: str
    samples: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class RecordOverview:
    """What there is in a record.

    Attributes
    ----------
    path : str
    samples : int
    strokes : tuple of StrokeOverview
    cycles : tuple of CycleOverview    Empty if there is no full one.
    left_out : tuple of LeftOut        Without those that are empty.
    notes : tuple of str               How it was read: columns, units, what was selected.
    """

    path: str
    samples: int
    strokes: tuple[StrokeOverview, ...]
    cycles: tuple[CycleOverview, ...]
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]


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
    >>> len(seen.strokes), [cycle.number for cycle in seen.cycles], round(seen.cycles[0].amplitude, 6)
    (7, [1, 2], 0.001)
    """
    strokes = find_strokes(record.displacement)
    ends = zip(strokes.direction.tolist(), pairwise(strokes.turning.tolist()), strokes.length.tolist(), strict=True)
    spikes = np.union1d(*spikes_of(record.displacement, record.force)).astype(np.intp)
    masks = {
        "clipped": clipped_samples(record.force),
        "dwells": dwells(record, strokes).resting,
        "not selected": np.zeros(len(record), dtype=bool) if record.compared is None else ~record.compared,
    }
    left_out = [LeftOut("spikes", spikes), *(LeftOut(why, np.flatnonzero(mask)) for why, mask in masks.items())]
    return RecordOverview(
        path=record.path,
        samples=len(record),
        strokes=tuple(StrokeOverview(side, first, last, length) for side, (first, last), length in ends),
        cycles=tuple(
            CycleOverview(number, cycle.first_sample, cycle.last_sample, cycle.figures.amplitude, cycle.frequency)
            for number, cycle in enumerate(find_cycles(record), 1)
        ),
        left_out=tuple(part for part in left_out if part.samples.size),
        notes=record.notes,
    )
