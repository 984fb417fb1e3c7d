"""The numbers of a table: read by Pandas, and where Pandas stumbles, the line that is to blame."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from .columns import Column
from .dialect import Dialect, is_number, split_cells
from .source import Source
from .units import quoted

# A rig stopped while writing leaves an incomplete row, with buffering a few.
MAX_DROPPED_ROWS = 3
# Looking for a bad row, what Pandas can read in one go is passed over.
_BLOCK_BYTES = 1024 * 1024
_NUMBER_CUT_SHORT = re.compile(r"[+-]?[0-9]*(?:[.,][0-9]*)?(?:[eE][+-]?)?\ufffd?")


@dataclass(frozen=True)
class _BadRow:
    """A row that cannot be used."""

    line: int  # 1-based in the file
    offset: int  # of its first byte
    column: int | None  # 1-based, None where the row as a whole is wrong
    message: str
    is_incomplete: bool  # may be dropped at the end of the file


def read_numbers(
    source: Source, dialect: Dialect, columns: Collection[Column], optional: Column | None = None
) -> tuple[dict[int, NDArray[np.float64]], list[str]]:
    """Read columns of numbers.

    Parameters
    ----------
    source, dialect : Source, Dialect    The file and how it is written.
    columns : collection of Column       Those to read.
    optional : Column or None            One of them that is left out if it holds something else.

    Returns
    -------
    (dict, list of str)                  Arrays of shape (K,) by column number, as in the file; sentences
                                         about rows and columns that are left out.

    Raises
    ------
    RecordError                          If a row is incomplete, unless among the last, or holds no number.
    """
    start = _offset_of_line(source.data, dialect.first_line)
    body = source.data[start:]
    if dialect.has_quotes:
        _refuse_open_quotes(body, dialect, source.path)
    wanted = list(columns)
    notes: list[str] = []
    while True:
        numbers = [column.number for column in wanted]
        values = _parsed(body, dialect, numbers)
        if values is not None:
            return values, notes
        first, dropped = _bad_rows(body, dialect, wanted)
        if first is None:
            raise RecordError(
                f"{source.path}: the numbers from line {dialect.first_line} on cannot be read; "
                "export the record as plain CSV."
            )
        if dropped:
            body = body[: first.offset]
            notes.append(
                f"{dropped} incomplete row{'s' if dropped > 1 else ''} at the end of the file "
                f"(from line {first.line}) left out"
            )
        elif optional is not None and first.column == optional.number:
            wanted.remove(optional)
            notes.append(f"{optional} is left out: line {first.line}, {first.message}")
            optional = None
        else:
            place = "" if first.column is None else f", {next(c for c in wanted if c.number == first.column)}"
            raise RecordError(f"{source.path}, line {first.line}{place}: {first.message}; correct or delete the line.")


def lines_of_rows(source: Source, dialect: Dialect, rows: Collection[int]) -> list[int]:
    """1-based lines in the file of rows of the table, which count from 0 and pass over blank lines."""
    wanted = set(rows)
    start = _offset_of_line(source.data, dialect.first_line)
    every = _rows(source.data, dialect, dialect.first_line, start)
    return [line for row, (line, _, _) in enumerate(islice(every, max(wanted, default=-1) + 1)) if row in wanted]


def _parsed(body: bytes, dialect: Dialect, numbers: Sequence[int]) -> dict[int, NDArray[np.float64]] | None:
    """Read columns, or None if a cell is no finite number or a row is wider than the table."""
    import pandas as pd  # slow to import, and not needed to import this package

    # Pandas takes the width of the table from its first row and then passes over surplus cells. A row put
    # before the table makes room for one more column, whose cells must stay empty.
    surplus = dialect.raw_width
    filler = (dialect.separator or " ").join(["0"] * (surplus + 1)).encode() + b"\n"
    try:
        frame = pd.read_csv(
            io.BytesIO(filler + body),
            sep=dialect.separator or r"\s+",
            decimal=dialect.decimal,
            header=None,
            names=list(range(surplus + 1)),
            usecols=[*(number - 1 for number in numbers), surplus],
            index_col=False,
            dtype=np.float64,
            quoting=csv.QUOTE_MINIMAL if dialect.has_quotes else csv.QUOTE_NONE,
            skipinitialspace=True,
            engine="c",
            encoding_errors="replace",
        )
    except ValueError:
        return None
    if not np.isnan(frame[surplus].to_numpy()[1:]).all():
        return None
    values = {number: np.array(frame[number - 1].to_numpy()[1:]) for number in numbers}
    return values if all(np.isfinite(array).all() for array in values.values()) else None


def _bad_rows(body: bytes, dialect: Dialect, wanted: Sequence[Column]) -> tuple[_BadRow | None, int]:
    """First bad row, and how many rows may be dropped: those from it on, if they are few and incomplete."""
    bad: list[_BadRow] = []
    for row in _judged_rows(body, dialect, wanted):
        if row is not None:
            bad.append(row)
        if bad and (row is None or len(bad) > MAX_DROPPED_ROWS):
            return bad[0], 0
    if not bad:
        return None, 0
    return bad[0], len(bad) if all(row.is_incomplete for row in bad) else 0


def _judged_rows(body: bytes, dialect: Dialect, wanted: Sequence[Column]) -> Iterator[_BadRow | None]:
    """Yield None for each good row, else what is bad, from the first block on that Pandas cannot read."""
    numbers = [column.number for column in wanted]
    offset, line = 0, dialect.first_line
    while (end := body.find(b"\n", offset + _BLOCK_BYTES) + 1) and _parsed(body[offset:end], dialect, numbers):
        line += body.count(b"\n", offset, end)
        offset = end
    for number, start, text in _rows(body, dialect, line, offset):
        decoded = text.decode("utf-8", "replace").rstrip("\n")
        cells = split_cells(decoded, dialect.separator, dialect.has_quotes)
        yield _judged(cells, number, start, dialect, wanted, is_cut=not text.endswith(b"\n"))


def _rows(body: bytes, dialect: Dialect, line: int, offset: int) -> Iterator[tuple[int, int, bytes]]:
    """Line, offset and text of each row from an offset on, which is that of the given line."""
    # A line of tabs alone is a row of empty cells where tabs separate cells, as Pandas sees it.
    blanks = b" \n" if dialect.separator == "\t" else b" \t\n"
    stream = io.BytesIO(body)
    stream.seek(offset)
    for text in stream:
        if text.strip(blanks):
            yield line, offset, text
        offset += len(text)
        line += 1


def _judged(
    cells: Sequence[str], line: int, offset: int, dialect: Dialect, wanted: Sequence[Column], *, is_cut: bool
) -> _BadRow | None:
    if any(cells[dialect.raw_width :]):
        message = f"must have {dialect.raw_width} cells, found {len(cells)}"
        return _BadRow(line, offset, None, message, False)
    found = [cells[column.number - 1] if column.number <= len(cells) else "" for column in wanted]
    is_short = not all(found)
    for column, cell in zip(wanted, found, strict=True):
        number = column.number
        if not cell:
            what = "an empty cell" if number <= len(cells) else f"only {len(cells)} of {dialect.width} cells"
            return _BadRow(line, offset, number, f"must hold a number, found {what}", True)
        if not is_number(cell, dialect.decimal):
            cut = is_cut and _NUMBER_CUT_SHORT.fullmatch(cell) is not None
            message = f"must hold a number, found the text {quoted(cell)}"
            return _BadRow(line, offset, number, message, is_short or cut)
        if not _is_finite(cell, dialect.decimal):
            message = f"must hold a finite number, found {quoted(cell)}"
            return _BadRow(line, offset, number, message, "inf" not in cell.casefold())
    return None


def _is_finite(cell: str, decimal: str) -> bool:
    try:
        return bool(np.isfinite(float(cell.replace(decimal, "."))))
    except ValueError:  # "NA" and the like
        return False


def _refuse_open_quotes(body: bytes, dialect: Dialect, path: str) -> None:
    """A quote left open would swallow all rows up to the next one without a word."""
    for line, text in enumerate(io.BytesIO(body), dialect.first_line):
        if (count := text.count(b'"')) % 2:
            raise RecordError(
                f"{path}, line {line}: must close each quotation mark, found {count} of them "
                f"in {quoted(text.decode('utf-8', 'replace').strip())}; correct or delete the line."
            )


def _offset_of_line(data: bytes, line: int) -> int:
    offset = 0
    for _ in range(line - 1):
        offset = data.index(b"\n", offset) + 1
    return offset
