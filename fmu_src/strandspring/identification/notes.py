"""Notes on an identification: what is good to know of its records, but no reason for caution."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..records.record import Record
from .identified import IdentifiedModel
from .refined import RefinedOptions
from .refusals import Strokes
from .rig import KnownRig, unknown_effects

# What rigs measure, and springs carry [m], [N], [N/m]. Sensors and fixtures yield by the first displacement, no rig
# reaches the second, and the forces are those of load cells. A softer spring sags by 10 m under 1 kg, and no frame of a
# rig is stiffer than the last.
_USUAL = {"amplitude": (1e-6, 0.5, "m"), "force amplitude": (1e-3, 1e7, "N"), "stiffness": (1.0, 1e9, "N/m")}
_UNITS = (
    ("m read as mm", 1000.0, 1.0), ("mm read as m", 0.001, 1.0), ("kN read as N", 1.0, 1000.0),
    ("N read as kN", 1.0, 0.001),
)  # fmt: skip


def notes_on(identification: IdentifiedModel) -> tuple[str, ...]:
    """The notes as sentences."""
    records = identification.records
    known = KnownRig.from_effects(identification.effects, identification.options)
    seeks_effects = identification.method == RefinedOptions.name
    return (
        *_implausible_sizes(records),
        *unknown_effects(records, known),
        *_rests(records),
        *(_times_that_do_not_rise(records) if seeks_effects else ()),
        *_next_test(identification),
    )


def _next_test(identification: IdentifiedModel) -> Iterator[str]:
    """A note with the findings that another test would settle; none without any, or for a spring of a wider class."""
    settled = [outcome.name.lower() for outcome in identification.outcomes if outcome.is_settled_by_a_test]
    if settled and identification.parameters.is_plain:
        yield f"`plan()` chooses the test that would settle {', '.join(settled)}."


def _implausible_sizes(records: Sequence[Record]) -> Iterator[str]:
    """A note on sizes that no rig measures, with the mistake in a unit that would explain them."""
    amplitude = 0.5 * max(float(np.ptp(record.displacement)) for record in records)
    force = 0.5 * max(float(np.ptp(record.force)) for record in records)

    def unusual(amplitude: float, force: float) -> Iterator[str]:
        sizes = (amplitude, force, force / amplitude)
        for (name, (low, high, unit)), value in zip(_USUAL.items(), sizes, strict=True):
            if not low <= value <= high:
                yield f"{name} {value:.3g} {unit}, usual are {low:g} to {high:g}"

    if texts := "; ".join(unusual(amplitude, force)):
        causes = [name for name, of_x, of_r in _UNITS if not list(unusual(of_x * amplitude, of_r * force))]
        cause = f"; {' or '.join(causes)} would explain it" if causes else ""
        yield f"Check the units of displacement and force: {texts}{cause}."


def _rests(records: Sequence[Record]) -> Iterator[str]:
    """A note on each record whose displacement rests: what is left out there."""
    for record in records:
        if count := sum(end - first for first, end in Strokes(record).dwells):
            yield f"{record.path}: {count} of {len(record)} samples were left out, because the displacement rests there"


def _times_that_do_not_rise(records: Sequence[Record]) -> Iterator[str]:
    """A note on each record whose times repeat or fall back, so that no effect of the velocity is sought."""
    for record in records:
        if record.time is not None and record.rising_time is None:
            count = int(np.sum(np.diff(record.time) <= 0.0))
            yield (
                f"{record.path}: the time does not rise at {count} of {len(record) - 1} steps, so that neither a delay "
                "between the columns nor a viscous force was sought; check `time=...`, or record times with more digits"
            )
