"""Notes on an identification: what is good to know of its records, but no reason for caution."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..model.outcomes import SETTLED_BY_A_TEST
from ..records.record import Record
from .identified_model import IdentifiedModel
from .methods.refined import RefinedOptions
from .points.unit_check import implausible_sizes
from .points.usable import dwells_without_relaxation
from .rig.known_rig import KnownRig, unknown_effects


def notes_on(identification: IdentifiedModel) -> tuple[str, ...]:
    """The notes as sentences."""
    records = identification.records
    known = KnownRig.from_effects(identification.effects, identification.options)
    seeks_effects = identification.method == RefinedOptions.name
    return (
        *implausible_sizes(identification.steady_parts),
        *unknown_effects(records, known),
        *dwells_without_relaxation(records),
        *(times_that_do_not_rise(records) if seeks_effects else ()),
        *_next_test(identification),
    )


def _next_test(identification: IdentifiedModel) -> tuple[str, ...]:
    """A note with the cautions that another test would settle; none without any, or for a spring of a wider class."""
    if not identification.parameters.is_plain:
        return ()
    settled = [outcome.name.lower() for outcome in identification.outcomes if outcome in SETTLED_BY_A_TEST]
    return (f"`plan()` chooses the test that would settle {', '.join(settled)}.",) if settled else ()


def times_that_do_not_rise(records: Sequence[Record]) -> tuple[str, ...]:
    """A note on each record whose times repeat or fall back, so that no effect of the velocity is sought."""
    notes = []
    for record in records:
        if record.time is not None and record.rising_time is None:
            count = int(np.sum(np.diff(record.time) <= 0.0))
            notes.append(
                f"{record.path}: the time does not rise at {count} of {len(record) - 1} steps, so that neither a delay "
                "between the columns nor a viscous force was sought; check `time=...`, or record times with more digits"
            )
    return tuple(notes)
