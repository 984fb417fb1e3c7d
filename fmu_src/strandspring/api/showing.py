"""`show`: records on a page, to look at before they are identified."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from ..records.given import Source, given_records


def show(
    records: Source | Sequence[Source],
    path: str | os.PathLike[str],
    *,
    displacement: str | int | None = None,
    force: str | int | None = None,
    time: str | int | None = None,
    units: Mapping[str, str] | None = None,
    reverse: Literal["displacement", "force"] | None = None,
) -> Path:
    """Draw loops, strokes and cycles of records on a page, which prints the options that choose a part of them.

    Parameters
    ----------
    records : path, Record, DataFrame, or a sequence of these
    path : path-like     The page to write, ending in .html; it opens offline.
    displacement, force, time, units, reverse   How files and tables are read, as for `identify`.

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
    write_record_page(target, given_records(records, force, time, displacement, units, reverse))
    return target
