"""`show`: records on a page, to look at before they are identified."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar

from ..errors import Reader
from ..findings import gathered
from ..ground.options import takes
from ..loops.cycles import Cycle, measured_loops
from ..loops.reading import Reading
from ..records.record import Record
from .common.given import Source, given_records
from .common.result import Result
from .common.table import Table
from .common.text import counted, loop_table


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


class Overview(Result):
    """What was detected in records: strokes, cycles, loops, and samples that are left out.

    Parameters
    ----------
    records : sequence of Record
    reader : Reader   Of `warnings`.
    """

    _stated: ClassVar = {}  # beside each record

    def __init__(self, records: Sequence[Record], reader: Reader = Reader.PYTHON) -> None:
        from ..report.record_page import overview

        self.records = tuple(records)
        self._seen = tuple((record, overview(record, reader), measured_loops([record])) for record in records)
        self.warnings = tuple(warning for _, seen, _ in self._seen for warning in seen.warnings)

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - the table knows
        """A line of each record, and its loops."""
        for record, seen, _ in self._seen:
            left_out = "".join(f", {samples.size} {reason}" for reason, samples in seen.left_out.items())
            yield (
                f"{record.path}: {len(record)} samples, {counted(seen.strokes, 'stroke')}, "
                f"{counted(len(seen.cycles), 'whole cycle')}{left_out}"
            )
        yield loop_table(list(chain.from_iterable(loops for _, _, loops in self._seen)))

    def content(self) -> dict[str, Any]:
        """Of each record what was detected, with its cycles as `cycles` of `Reading` counts them."""
        return {
            "records": [
                {
                    "path": record.path,
                    "samples": len(record),
                    "strokes": seen.strokes,
                    "cycles": [_cycle(*numbered) for numbered in enumerate(seen.cycles, 1)],
                    "loops": loop_table(loops, in_files=True),
                    "left_out": {reason: samples.size for reason, samples in seen.left_out.items()},
                    "notes": tuple(gathered(record.findings, Reader.FILE)),
                }
                for record, seen, loops in self._seen
            ]
        }


def _cycle(number: int, cycle: Cycle) -> dict[str, Any]:
    return {
        "number": number,
        "first_sample": cycle.first_sample,
        "last_sample": cycle.last_sample,
        "amplitude": cycle.figures.amplitude,
        "frequency": cycle.frequency,
    }
