"""`write_record_page`: records to look at before they are identified, with options that choose of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path, PurePath

import numpy as np

from ..errors import Reader
from ..findings import Finding, IdentificationError, Outcome, gathered
from ..ground.result_columns import ResultColumn
from ..identification.refusals import Strokes, cut_all, impossible
from ..identification.samples import Samples
from ..kernel.arrays import IndexArray
from ..loops.cycles import find_cycles
from ..loops.strokes import find_strokes
from ..records.record import Record
from ..records.spikes import spikes_of
from .drawing import DISPLACEMENT, FORCE, SAMPLE, TIME, Chart, Curve
from .page import Level, Notice, Page, Section, Table, write_page

_MARKS = 400  # of a kind
_REASONS = {
    "spikes": ("outliers: correct or delete them", "blue", Outcome.SPIKES),
    "clipped": ("clipped forces, left out", "green", Outcome.CLIPPED),
    "dwells": ("dwells, left out", "purple", Outcome.RESTS_LEFT_OUT),
    "not selected": ("outside the range that was chosen, left out", "faint", None),
}
_CYCLES = (
    ResultColumn("number", "", "", "cycle"),
    ResultColumn("samples", "1", "", "samples", digits=12),
    ResultColumn("time", "s", "", "time", "s"),
    ResultColumn("amplitude", "m", "", "amplitude", "mm", 1e3),
    ResultColumn("displacement", "m", "", "displacement", "mm", 1e3),
    ResultColumn("frequency", "Hz", "", "frequency", "Hz"),
)


class RecordOverview:
    """What there is in a record, for people to choose from.

    Attributes
    ----------
    name : str                    File name without folders.
    strokes : int
    cycles : tuple of Cycle       In the order in which `select` counts them.
    left_out : mapping            Ascending indices of samples by why they are left out of a fit; "spikes" are not, but
                                  should be corrected.
    first : int                   Of the samples that would be fitted.
    refusals : tuple of Finding   Why no spring would be identified; none if one would.
    """

    def __init__(self, record: Record) -> None:
        self.record, self.name = record, PurePath(record.path).name
        self.strokes, self.cycles = find_strokes(record.displacement).count, find_cycles(record)
        part = Strokes(record)
        left_out: dict[str, IndexArray] = {
            "spikes": np.union1d(*spikes_of(record.displacement, record.force)).astype(np.intp),
            "clipped": np.flatnonzero(part.clipped),
            "dwells": np.flatnonzero(part.resting),
            "not selected": np.flatnonzero([] if record.compared is None else ~record.compared),
        }
        self.left_out = {reason: samples for reason, samples in left_out.items() if samples.size}
        self.first, self.refusals = 0, tuple[Finding, ...]()
        try:
            (part,) = cut_all([record])
            if (reason := impossible(part)) is not None:
                raise reason
            self.first = int(Samples.of([record], len(record)).rows[0])
        except IdentificationError as refused:
            place = f"No spring would be identified: {self.name}"
            self.refusals = tuple(replace(finding, where=place) for finding in refused.findings)

    @property
    def findings(self) -> Iterator[Finding]:
        """No whole cycle, and samples left out."""
        if not self.cycles:
            yield Finding(Outcome.NO_WHOLE_CYCLE, {"strokes": self.strokes}, self.name)
        for reason, samples in self.left_out.items():
            if kind := _REASONS[reason][2]:
                yield Finding(kind, {"count": samples.size, "samples": len(self.record)}, self.name)

    def curves(self, place: int, x: ResultColumn, y: ResultColumn) -> Iterator[Curve]:
        """Before the first reversal, from there on, what is left out, and over time where cycles begin."""
        over, of = np.arange(1.0, len(self.record) + 1.0), getattr(self.record, y.key)
        if x is not SAMPLE:
            over = getattr(self.record, "rising_time" if x is TIME else x.key)
        if self.first:
            before = slice(self.first + 1)
            yield Curve(over[before], of[before], "lead-in (not fitted)", "faint", record=place)
        yield Curve(over[self.first :], of[self.first :], "measured", "measured", record=place)
        for reason, samples in self.left_out.items():
            at = samples[:: max(1, samples.size // _MARKS)]
            yield Curve(over[at], of[at], *_REASONS[reason][:2], ".", place)
        begins = [cycle.first_sample for cycle in self.cycles][:_MARKS]
        if begins and x is not DISPLACEMENT:
            yield Curve(over[begins], of[begins], "a cycle begins", "model", "o", place)


def write_record_page(path: Path, records: Sequence[Record]) -> None:
    """Write a page with loops, strokes and cycles; zooming and choosing cycles prints options. Raises StrandspringError
    if its ending is wrong or it cannot be written.
    """
    shown = [RecordOverview(record) for record in records]
    is_timed = all(record.rising_time is not None for record in records)
    detected: list[str | Notice] = []
    for one in shown:
        detected.append(f"{one.name}: {' '.join(one.record.notes) or 'Nothing was assumed.'}")
        detected += [Notice(Level.CARE, text) for text in gathered(one.findings, Reader.FILE)]
    counts = [len(one.cycles) for one in shown]
    sections = (
        Section("Loops and strokes", [*_loops(shown, TIME if is_timed else SAMPLE)]),
        Section("Cycles", [*_cycles(shown)]),
        Section("What was detected", detected),
    )
    title = shown[0].name if len(shown) == 1 else f"{shown[0].name} and {len(shown) - 1} more"
    page = Page(
        f"Record: {title}", f"{sum(map(len, records))} samples, {sum(counts)} whole cycles", sections,
        {place: one.name for place, one in enumerate(shown)},
        # Cycles of a part are not counted as --cycles counts those of the whole record.
        cycles=0 if any(record.is_cut for record in records) else max(counts),
        options={"loops": "--displacement-range", **dict.fromkeys(("displacement", "force")[: 2 * is_timed], "--time")},
    )  # fmt: skip
    write_page(path, page)


def _loops(shown: Sequence[RecordOverview], axis: ResultColumn) -> Iterator[Notice | Chart]:
    """Why no spring would be identified, force over displacement, and both along the record."""
    yield from (Notice(Level.POOR, text) for one in shown for text in gathered(one.refusals, Reader.FILE))
    window = "Zoom along the time to choose a window." if axis is TIME else ""
    part = "Zoom along the displacement to choose a range."
    for x, y, advice in ((DISPLACEMENT, FORCE, part), (axis, DISPLACEMENT, window), (axis, FORCE, window)):
        curves = [curve for place, one in enumerate(shown) for curve in one.curves(place, x, y)]
        title, key = f"{y.words.capitalize()} over {x.words}", y.key if x is axis else "loops"
        yield Chart(key, title, f"{title}. {advice}", x, y, curves, is_apart=x is axis)


def _cycles(shown: Sequence[RecordOverview]) -> Iterator[Notice | Table]:
    if any(one.record.is_cut for one in shown):
        yield Notice(Level.CARE, "Cycles of the part that was selected do not have the numbers of --cycles.")
    for one in shown:
        rows = []
        for count, cycle in enumerate(one.cycles, 1):
            ends = [cycle.first_sample, cycle.last_sample]
            x, time = one.record.displacement[ends[0] : ends[1] + 1], one.record.time
            rows.append({
                "number": str(count),
                "samples": (ends[0] + 1, ends[1] + 1),
                "time": None if time is None else tuple(time[ends].tolist()),
                "amplitude": cycle.figures.amplitude,
                "displacement": (float(x.min()), float(x.max())),
                "frequency": cycle.frequency,
            })  # fmt: skip
        if rows:
            yield Table(f"Cycles of {one.name}", _CYCLES, rows)
