"""`write_record_page`: records to look at before they are identified, and the options that choose a part of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

import numpy as np

from ..errors import Reader
from ..findings import IdentificationError, gathered
from ..identification.refusals import Strokes, cut_all, impossible
from ..identification.samples import Samples
from ..kernel.arrays import FloatArray, IndexArray
from ..loops.cycles import Cycle, find_cycles
from ..loops.strokes import find_strokes
from ..records.record import Record
from ..records.spikes import spikes_of
from .drawing import Chart, dots, line, marks, name_axes, visible
from .page import Block, Gallery, Level, Notice, Page, Section, Table, write_page
from .quantities import MM, NUMBER, DisplayUnit, N, S, number, span

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS = 6000  # of a line
_MARKS = 400  # of a kind
_REASONS = {
    "spikes": ("outliers: correct or delete them", "blue"),
    "clipped": ("clipped forces, left out", "green"),
    "dwells": ("dwells, left out", "purple"),
    "not selected": ("outside the range that was chosen, left out", "faint"),
}


@dataclass(frozen=True, eq=False)
class RecordOverview:
    """What there is in a record.

    Attributes
    ----------
    strokes : int
    cycles : tuple of Cycle   In the order in which `select` counts them; empty if there is no full one.
    left_out : mapping        Indices of samples, ascending, that are left out of a fit, by the reason: "clipped",
                              "dwells", "not selected"; "spikes" are not left out, but should be corrected. Without
                              reasons for which there are none.
    """

    strokes: int
    cycles: tuple[Cycle, ...]
    left_out: Mapping[str, IndexArray]


def overview(record: Record) -> RecordOverview:
    """What there is in a record, for people to choose from."""
    part = Strokes(record)
    left_out: dict[str, IndexArray] = {
        "spikes": np.union1d(*spikes_of(record.displacement, record.force)).astype(np.intp),
        "clipped": np.flatnonzero(part.clipped),
        "dwells": np.flatnonzero(part.resting),
        "not selected": np.flatnonzero([] if record.compared is None else ~record.compared),
    }
    seen = {reason: samples for reason, samples in left_out.items() if samples.size}
    return RecordOverview(find_strokes(record.displacement).count, find_cycles(record), seen)


@dataclass(frozen=True, eq=False)
class _Shown:
    """A record of the page, the first of its samples that would be fitted, and why none would be, if so."""

    place: int
    record: Record
    seen: RecordOverview
    first: int
    refusal: str = ""

    @classmethod
    def from_record(cls, place: int, record: Record, reader: Reader = Reader.FILE) -> _Shown:
        seen = overview(record)
        try:
            (part,) = cut_all([record])
            if (refusal := impossible(part)) is not None:
                raise refusal
        except IdentificationError as refused:
            reason = " ".join(gathered((finding.in_folder for finding in refused.findings), reader))
            text = f"No spring would be identified: {reason}"
            return cls(place, record, seen, 0, text)
        return cls(place, record, seen, int(Samples.of([record], len(record)).rows[0]))

    @property
    def name(self) -> str:
        """File name without folders."""
        return PurePath(self.record.path).name

    def draw(self, axes: Axes, x: FloatArray, y: FloatArray) -> None:
        """Before the first reversal, from there on, and what is left out."""
        at = np.union1d(visible(self.record.displacement, _POINTS // 2), visible(self.record.force, _POINTS // 2))
        if self.first:
            before = at[at <= self.first]
            line(axes, x[before], y[before], "lead-in (not fitted)", "faint", record=self.place)
        after = at[at >= self.first]
        line(axes, x[after], y[after], "measured", "measured", record=self.place)
        for reason, samples in self.seen.left_out.items():
            at = samples[:: max(1, samples.size // _MARKS)]
            dots(axes, x[at], y[at], *_REASONS[reason], record=self.place)

    @property
    def without_cycles(self) -> str:
        """That it has no whole cycle, if so."""
        return f"{self.name} holds no whole cycle; {self.seen.strokes} strokes were found." * (not self.seen.cycles)


def record_warnings(record: Record, reader: Reader) -> Iterator[str]:
    """What the page warns of besides, one sentence each: no spring, no whole cycle, samples left out."""
    shown = _Shown.from_record(0, record, reader)
    if shown.refusal:
        yield shown.refusal
    if shown.without_cycles:
        yield shown.without_cycles
    for reason, samples in shown.seen.left_out.items():
        yield f"{shown.name}: {samples.size} samples: {_REASONS[reason][0]}."


def write_record_page(path: Path, records: Sequence[Record]) -> None:
    """Write a page with loops, strokes and cycles of records; zooming and choosing cycles prints the options to use.

    Parameters
    ----------
    path : Path
    records : sequence of Record   At least one.

    Raises
    ------
    StrandspringError              If the file cannot be written.
    """
    shown = [_Shown.from_record(place, record) for place, record in enumerate(records)]
    refusals = [Notice(Level.POOR, one.refusal) for one in shown if one.refusal]
    timed = all(record.rising_time is not None for record in records)
    counts = [len(one.seen.cycles) for one in shown]
    sections = (
        Section("loops", "Loops", (*refusals, Gallery((_loops(shown),)))),
        Section("path", "Displacement and force along the record", (Gallery(tuple(_along(shown, timed))),)),
        Section("cycles", "Cycles", tuple(_cycles(shown))),
        Section("detected", "What was detected", tuple(_detected(shown))),
    )
    title = shown[0].name if len(shown) == 1 else f"{shown[0].name} and {len(shown) - 1} more"
    # Cycles of a part are not counted as --cycles counts those of the whole record.
    choosable = 0 if any(record.is_cut for record in records) else max(counts)
    page = Page(
        f"Record: {title}", f"{sum(map(len, records))} samples, {sum(counts)} whole cycles", sections,
        {one.place: one.name for one in shown}, choice={"cycles": choosable, "timed": timed},
    )  # fmt: skip
    write_page(path, page)


def _loops(shown: Sequence[_Shown]) -> Chart:
    def draw(axes: Axes, record: int | None) -> None:
        for one in shown if record is None else (shown[record],):
            one.draw(axes, MM.factor * one.record.displacement, one.record.force)
        name_axes(axes, ("displacement", MM), ("force", N))

    low = min(float(one.record.displacement.min()) for one in shown)
    high = max(float(one.record.displacement.max()) for one in shown)
    sentence = (
        f"Force over displacement, {span(low, high, MM)}. Zoom along the displacement to choose a range of it: the "
        "path of the model keeps running through what is left out."
    )
    return Chart("loops", "Force over displacement", sentence, draw, wide=True)


def _along(shown: Sequence[_Shown], timed: bool) -> Iterator[Chart]:
    axis = ("time", S) if timed else ("sample number", NUMBER)
    advice = " Zoom along the time to choose a window." if timed else " Without rising times no window can be chosen."
    for key, unit in (("displacement", MM), ("force", N)):

        def draw(axes: Axes, record: int | None, key: str = key, unit: DisplayUnit = unit) -> None:
            for one in shown if record is None else (shown[record],):
                along = one.record.rising_time if timed else None
                t = np.arange(1.0, len(one.record) + 1.0) if along is None else along
                values = unit.factor * getattr(one.record, key)
                one.draw(axes, t, values)
                if key == "displacement":
                    begins = np.array([cycle.first_sample for cycle in one.seen.cycles][:_MARKS], dtype=np.intp)
                    marks(axes, t[begins], values[begins], "a cycle begins", "model", record=one.place)
            name_axes(axes, axis, (key, unit))

        sentence = f"{key.capitalize()} in the order of measurement.{advice}"
        yield Chart(key, f"{key.capitalize()} over {axis[0]}", sentence, draw, wide=True, records=range(len(shown)))


def _cycles(shown: Sequence[_Shown]) -> Iterator[Block]:
    if any(one.record.is_cut for one in shown):
        yield Notice(
            Level.CARE,
            "Cycles are counted within the part that was selected, so that their numbers are not those of --cycles; "
            "show the whole record to choose cycles.",
        )
    for one in shown:
        record, cycles = one.record, one.seen.cycles
        if one.without_cycles:
            yield Notice(Level.CARE, one.without_cycles)
            continue
        rows = []
        for count, cycle in enumerate(cycles, 1):
            first, last = cycle.first_sample, cycle.last_sample
            x = record.displacement[first : last + 1]
            rows.append(
                (
                    str(count),
                    f"{first + 1} to {last + 1}",
                    "–" if record.time is None else span(record.time[first], record.time[last], S),
                    number(1e3 * cycle.figures.amplitude),
                    span(float(x.min()), float(x.max()), MM),
                    "–" if cycle.frequency is None else number(cycle.frequency),
                )
            )
        header = ("cycle", "samples", "time", "amplitude [mm]", "displacement", "frequency [Hz]")
        yield Table(f"Cycles of {one.name}", header, rows)


def _detected(shown: Sequence[_Shown]) -> Iterator[Block]:
    for one in shown:
        yield f"{one.name}: {' '.join(one.record.notes) or 'Nothing was assumed.'}"
        for reason, samples in one.seen.left_out.items():
            yield Notice(Level.CARE, f"{samples.size} samples: {_REASONS[reason][0]}.")
