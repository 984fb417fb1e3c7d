"""`show`: records on a page, to look at before they are identified."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Reader
from ..findings import gathered
from ..ground.options import takes
from ..loops.reading import Reading
from ..records.record import Record
from .common.given import Source, given_records
from .common.text import counted

if TYPE_CHECKING:
    from ..report.record_page import RecordOverview


@takes(reading=Reading)
def show(
    records: Source | Sequence[Source],
    path: str | os.PathLike[str],
    *,
    reading: Reading,
) -> Path:
    """Draw loops, strokes and cycles of records on a page, which prints the options that choose a part of them.

    Parameters
    ----------
    records : path, Record, DataFrame, or a sequence of these
    path : path-like     The page to write, ending in .html; it opens offline.
    reading : Reading    How files and tables are read, and what of them is used; or its fields as keywords.

    Returns
    -------
    Path                 `path`.

    Raises
    ------
    RecordError          If one of them is not a record.
    StrandspringError    If the page cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import bundled_record, show
    >>> with TemporaryDirectory() as folder:
    ...     page = show(bundled_record(), Path(folder) / "hinge.html", reverse="displacement")
    ...     page.name, "Force over displacement" in page.read_text(encoding="utf-8")
    ('hinge.html', True)
    """
    from ..report.record_page import write_record_page

    target = Path(path)
    write_record_page(target, given_records(records, reading=reading))
    return target


@dataclass(frozen=True)
class Overview:
    """What was detected in records, and the page's warnings."""

    seen: tuple[tuple[Record, RecordOverview], ...]
    warnings: tuple[str, ...]

    @classmethod
    def of(cls, records: Sequence[Record]) -> Overview:
        """Of some records."""
        from ..report.record_page import overview, record_warnings

        seen = tuple((record, overview(record)) for record in records)
        return cls(seen, tuple(warning for record in records for warning in record_warnings(record)))

    def text_lines(self, width: int | None = None) -> list[str]:  # noqa: ARG002 - it has no table
        """In words."""
        return [
            f"{record.path}: {len(record)} samples, {counted(seen.strokes, 'stroke')}, "
            f"{counted(len(seen.cycles), 'whole cycle')}"
            + "".join(f", {samples.size} {reason}" for reason, samples in seen.left_out.items())
            for record, seen in self.seen
        ]

    def as_json(self) -> dict[str, Any]:
        """The same for JSON."""
        return {"records": [_record(*both) for both in self.seen]}


def _record(record: Record, seen: RecordOverview) -> dict[str, Any]:
    """For JSON; cycles are numbered as `cycles` of `Reading` counts them."""
    return {
        "path": record.path,
        "samples": len(record),
        "strokes": seen.strokes,
        "cycles": [
            {
                "number": number,
                "first_sample": cycle.first_sample,
                "last_sample": cycle.last_sample,
                "amplitude": cycle.figures.amplitude,
                "frequency": cycle.frequency,
            }
            for number, cycle in enumerate(seen.cycles, 1)
        ],
        "left_out": {reason: int(samples.size) for reason, samples in seen.left_out.items()},
        "notes": list(gathered(record.findings, Reader.FILE)),
    }
