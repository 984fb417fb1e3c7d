"""`write_record_page`: records to look at before they are identified, and the options that choose a part of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path, PurePath

import numpy as np

from .._version import __version__
from ..identification.points.steady_part import find_steady_part
from ..loops.overview import RecordOverview, overview
from ..loops.strokes import IndexArray
from ..model.outcomes import IdentificationError
from ..records.record import Record
from .content.blocks import Block, Gallery, Level, Notice, PageContent, PageTable, Section, Text
from .content.chart import Axis, Chart, ChartForm, Role, Trace
from .content.quantities import NUMBER, DisplayUnit, number, span
from .content.thinning import visible
from .rendering.page import write_page

_MM, _N, _S = DisplayUnit("mm", 1e3), DisplayUnit("N"), DisplayUnit("s")
_POINTS = 6000  # of a line
_MARKS = 400  # of a kind
_ROWS = 200  # of the table of cycles
_REASONS = {
    "spikes": "outliers: correct or delete them",
    "clipped": "clipped forces, left out",
    "dwells": "dwells, left out",
    "not selected": "outside the range that was chosen, left out",
}
_ROLES = {
    "spikes": Role.FIRST, "clipped": Role.SECOND, "dwells": Role.THIRD, "not selected": Role.LEFT_OUT
}  # fmt: skip


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
    seen = [overview(record) for record in records]
    names = {place: PurePath(record.path).name for place, record in enumerate(records)}
    timed = all(record.rising_time is not None for record in records)
    first, refusals = _first_used(records)
    refused = tuple(Notice(Level.POOR, f"No spring would be identified: {_without_folder(text)}") for text in refusals)
    along = Gallery(tuple(_along(records, seen, first, timed)))
    sections = (
        Section("loops", "Loops", (*refused, Gallery((_loops(records, seen, first),)))),
        Section("path", "Displacement and force along the record", (along,)),
        Section("cycles", "Cycles", tuple(_cycles(records, seen, names))),
        Section("detected", "What was detected", tuple(_detected(records, seen, names))),
    )
    subtitle = f"{sum(map(len, records))} samples, {sum(len(seen_record.cycles) for seen_record in seen)} whole cycles"
    title = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
    content = PageContent(f"Record: {title}", subtitle, sections, names, f"strandspring {__version__}")
    # Cycles of a part are not counted as --cycles counts those of the whole record.
    choosable = 0 if any(record.is_cut for record in records) else max(len(seen_record.cycles) for seen_record in seen)
    choice = {"cycles": choosable, "timed": timed}
    write_page(path, content, "record_page.html.j2", "record_page.js", choice)


def _first_used(records: Sequence[Record]) -> tuple[list[int], list[str]]:
    """First sample that would be fitted in each record, and the refusal of those that no spring can have made."""
    first, refusals = [], []
    for record in records:
        try:
            first.append(find_steady_part(record).first_sample)
        except IdentificationError as refusal:
            first.append(0)
            refusals.append(str(refusal))
    return first, refusals


def _pieces(record: Record, first: int) -> Iterator[tuple[str, Role, IndexArray]]:
    """What is drawn of a record: before the steady part, and from there on."""
    at = np.union1d(visible(record.displacement, _POINTS // 2), visible(record.force, _POINTS // 2))
    if first:
        yield "before the steady part, sets the memory only", Role.LEFT_OUT, at[at <= first]
    yield "measured", Role.MEASURED, at[at >= first]


def _without_folder(refusal: str) -> str:
    """A refusal without the folders of the file that it names."""
    where, colon, reason = refusal.partition(": ")
    return f"{PurePath(where).name}{colon}{reason}"


def _left_out(seen_record: RecordOverview) -> Iterator[tuple[str, Role, IndexArray]]:
    for reason, samples in seen_record.left_out.items():
        step = max(1, samples.size // _MARKS)
        yield _REASONS[reason], _ROLES[reason], samples[::step]


def _loops(records: Sequence[Record], seen: Sequence[RecordOverview], first: Sequence[int]) -> Chart:
    traces = []
    for place, (record, seen_record) in enumerate(zip(records, seen, strict=True)):
        x, force = 1e3 * record.displacement, record.force
        for name, role, at in _pieces(record, first[place]):
            traces.append(Trace(name, x[at], force[at], role, record=place))
        for reason, role, samples in _left_out(seen_record):
            traces.append(Trace(reason, x[samples], force[samples], role, ChartForm.DOTS, record=place))
    low = min(float(record.displacement.min()) for record in records)
    high = max(float(record.displacement.max()) for record in records)
    sentence = (
        f"Force over displacement, {span(low, high, _MM)}. Zoom along the displacement to choose a range of it: the "
        "path of the model keeps running through what is left out."
    )
    return Chart("loops", "Force over displacement", Axis("displacement", _MM), Axis("force", _N), tuple(traces),
                 sentence, wide=True)  # fmt: skip


def _along(
    records: Sequence[Record], seen: Sequence[RecordOverview], first: Sequence[int], timed: bool
) -> Iterator[Chart]:
    axis = Axis("time", _S) if timed else Axis("sample number", NUMBER)
    advice = " Zoom along the time to choose a window." if timed else " Without rising times no window can be chosen."
    for key, title, unit in (("displacement", "Displacement", _MM), ("force", "Force", _N)):
        traces = []
        for place, (record, seen_record) in enumerate(zip(records, seen, strict=True)):
            along = record.rising_time if timed else None
            t = np.arange(1.0, len(record) + 1.0) if along is None else along
            values = unit.factor * getattr(record, key)
            for name, role, at in _pieces(record, first[place]):
                traces.append(Trace(name, t[at], values[at], role, record=place))
            if key == "displacement":
                begins = np.array([cycle.first_sample for cycle in seen_record.cycles][:_MARKS], dtype=np.intp)
                traces.append(
                    Trace("a cycle begins", t[begins], values[begins], Role.MODEL, ChartForm.MARKS, record=place)
                )
            for reason, role, samples in _left_out(seen_record):
                traces.append(Trace(reason, t[samples], values[samples], role, ChartForm.DOTS, record=place))
        yield Chart(key, f"{title} over {axis.text}", axis, Axis(key, unit), tuple(traces),
                    f"{title} in the order of measurement.{advice}", wide=True, single=True)  # fmt: skip


def _cycles(records: Sequence[Record], seen: Sequence[RecordOverview], names: dict[int, str]) -> Iterator[Block]:
    if any(record.is_cut for record in records):
        yield Notice(
            Level.CARE,
            "Cycles are counted within the part that was selected, so that their numbers are not those of --cycles; "
            "show the whole record to choose cycles.",
        )
    for place, (record, seen_record) in enumerate(zip(records, seen, strict=True)):
        if not seen_record.cycles:
            yield Notice(
                Level.CARE, f"{names[place]} holds no whole cycle; {seen_record.strokes.count} strokes were found."
            )
            continue
        rows = []
        for count, cycle in enumerate(seen_record.cycles[:_ROWS], 1):
            x = record.displacement[cycle.first_sample : cycle.last_sample + 1]
            rows.append(
                (
                    str(count),
                    f"{cycle.first_sample + 1} to {cycle.last_sample + 1}",
                    "–" if record.time is None else span(record.time[cycle.first_sample],
                                                         record.time[cycle.last_sample], _S),
                    number(1e3 * cycle.figures.amplitude),
                    span(float(x.min()), float(x.max()), _MM),
                    "–" if cycle.frequency is None else number(cycle.frequency),
                )
            )  # fmt: skip
        header = ("cycle", "samples", "time", "amplitude [mm]", "displacement", "frequency [Hz]")
        yield PageTable(f"Cycles of {names[place]}", header, tuple(rows))
        if len(seen_record.cycles) > _ROWS:
            yield Text(f"{len(seen_record.cycles) - _ROWS} more cycles follow.")


def _detected(records: Sequence[Record], seen: Sequence[RecordOverview], names: dict[int, str]) -> Iterator[Block]:
    for place, (record, seen_record) in enumerate(zip(records, seen, strict=True)):
        yield Text(f"{names[place]}: {'; '.join(record.notes) or 'nothing was assumed'}.")
        for reason, samples in seen_record.left_out.items():
            yield Notice(Level.CARE, f"{samples.size} samples: {_REASONS[reason]}.")
