"""Samples of a record that say nothing of the spring, and what else is wrong with a record before any fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...loops.left_out import BoolArray, Dwells, clipped_samples, dwells
from ...loops.strokes import Strokes, find_strokes
from ...model.outcomes import Outcome
from ...records.record import Record

_RELAXED = 0.01  # change of force during dwells that counts, share of the force's standard deviation
_SEEN = 4.0  # change of force during dwells that is no noise, in its standard deviations
_GAP = 3.5  # time step that is called a gap, in those usual
_NAMED = 6  # places that a message names


def usable_samples(record: Record, strokes: Strokes) -> tuple[BoolArray, dict[Outcome, str]]:
    """Which samples to fit, and cautions with their details.

    Left out are forces at the end of the sensor's range, all but the first sample of a dwell, and what is not selected.

    Parameters
    ----------
    record : Record
    strokes : Strokes   Of the record.
    """
    details: dict[Outcome, str] = {}
    used = np.ones(len(record), dtype=bool)
    clipped = clipped_samples(record.force)
    if clipped.any():
        used &= ~clipped
        details[Outcome.CLIPPED] = f"{int(clipped.sum())} of {clipped.size} samples"
    rests = dwells(record, strokes)
    used &= ~rests.resting
    if record.compared is not None:
        used &= record.compared
    if _relaxes(rests, record):
        details[Outcome.DWELLS] = f"by {rests.relaxed:.3g} N"
    if record.time is not None:
        steps = np.diff(record.time)
        usual = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
        at = np.flatnonzero(steps > _GAP * usual) if usual > 0.0 else np.empty(0, np.intp)
        # A file of several parts, or one that was sampled at will, has no usual step.
        if 0 < at.size <= 0.02 * steps.size:
            places = [f"{record.time[k]:.6g} to {record.time[k + 1]:.6g} s" for k in at[:_NAMED]]
            details[Outcome.GAPS] = "; ".join(places) + (f" and {at.size - _NAMED} more" if at.size > _NAMED else "")
    return used, details


def dwells_without_relaxation(records: Sequence[Record]) -> tuple[str, ...]:
    """A note on each record whose dwells were left out without a caution, because the force does not relax in them."""
    notes = []
    for record in records:
        rests = dwells(record, find_strokes(record.displacement))
        if rests.within.any() and not _relaxes(rests, record):
            notes.append(
                f"{record.path}: {int(rests.within.sum())} of {len(record)} samples were left out, because the "
                "displacement rests there; the force does not relax meanwhile"
            )
    return tuple(notes)


def _relaxes(rests: Dwells, record: Record) -> bool:
    """Whether the force relaxes in dwells by what counts, and by more than its noise."""
    return rests.relaxed > max(_RELAXED * float(np.std(record.force)), _SEEN * rests.scatter)
