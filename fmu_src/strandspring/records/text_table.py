"""The table in a text, which a sheet of a workbook is made too, so that both are treated alike.

It is read row by row, so that a bad row is named by its line.
"""

from __future__ import annotations

import io
import math
import re
from array import array
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from ..errors import RecordError
from ..ground.quoting import quoted
from .clock import Moment, elapsed, is_clock, moment_of
from .columns import Column
from .dialect import Dialect, find_dialect, is_number, split_cells
from .record import FloatArray
from .source import Source
from .tables import Table

# A rig stopped while writing leaves an incomplete row or, with buffering, a few.
MAX_DROPPED_ROWS = 3
_TRUNCATED_NUMBER = re.compile(r"[+-]?[0-9]*(?:[.,][0-9]*)?(?:[eE][+-]?)?\ufffd?")
_THREE_AFTER_MARK = re.compile("[1-9][0-9]{0,2}[.,][0-9]{3}")
_WITH_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[.,'\s][0-9]{3})+(?:[.,][0-9]+)?")
_UP_TO_999 = re.compile("0|[1-9][0-9]{0,2}")


@dataclass(frozen=True)
class _BadRow:
    """A row that cannot be used."""

    line: int  # 1-based in the file
    column: int | None  # 1-based, None where the row as a whole is wrong
    message: str
    is_incomplete: bool  # may be dropped at the end of the file


class TextTable(Table):
    """The table in a text.

    Parameters
    ----------
    source : Source
    name : str        Of the sheet; "" for a text file.

    Raises
    ------
    RecordError       If no two columns of numbers are found.
    """

    def __init__(self, source: Source, name: str = "") -> None:
        self.source = source
        self.name = name
        self.row = source.row
        self.dialect = dialect = find_dialect(source.head, source.path, source.row)
        self.columns = [_column(dialect, k) for k in range(dialect.width)]
        self.notes = source.notes
        if dialect.first_line > 1:
            line = dialect.header_line
            header = "no header" if line is None else f"the header in {self.row} {line}"
            self.notes += (f"the numbers begin in {self.row} {dialect.first_line}, with {header}",)
        if dialect.decimal == ",":
            self.notes += ("the decimal mark is a comma",)

    def read(
        self, wanted: Collection[Column], optional: Column | None = None
    ) -> tuple[dict[int, FloatArray], list[str]]:
        """See `Table.read`."""
        for column in wanted:
            self._refuse_thousands(column)
        body = self.source.data[self._begin :]
        if self.dialect.has_quotes:
            _refuse_open_quotes(body, self.dialect, self.source.path)
        clocks = [column for column in wanted if column.is_clock]
        read = [column for column in wanted if not column.is_clock]
        notes: list[str] = []
        values, bad, dropped = _read_rows(body, self.dialect, read)
        if bad is not None and not dropped and optional is not None and bad.column == optional.number:
            read.remove(optional)
            notes.append(f"{optional} is left out: {self.row} {bad.line}, {bad.message}")
            values, bad, dropped = _read_rows(body, self.dialect, read)
        if bad is not None and not dropped:
            place = "" if bad.column is None else f", {self.columns[bad.column - 1]}"
            raise RecordError(
                f"{self.source.path}, {self.row} {bad.line}{place}: {bad.message}; correct or delete the {self.row}."
            )
        if bad is not None:
            rows = f"{dropped} incomplete row{'s' if dropped > 1 else ''}"
            notes.append(f"{rows} at the end of the file (from {self.row} {bad.line}) left out")
        numbers = {column.number: values[:, i] for i, column in enumerate(read)}
        for column in clocks:
            try:
                numbers[column.number] = self._read_clock(column, values.shape[0])
            except RecordError as problem:
                if column is not optional:
                    raise
                notes.append(f"{column} is left out: {problem}")
        return numbers, notes

    def places(self, rows: Collection[int]) -> list[int]:
        """1-based lines of rows."""
        lines = islice(
            _rows(self.source.data, self.dialect, self.dialect.first_line, self._begin), max(rows, default=-1) + 1
        )
        return [line for row, (line, _) in enumerate(lines) if row in rows]

    @property
    def _begin(self) -> int:
        """Where the first row of numbers begins [B]."""
        offset = 0
        for _ in range(self.dialect.first_line - 1):
            offset = self.source.data.index(b"\n", offset) + 1
        return offset

    def _refuse_thousands(self, column: Column) -> None:
        """Refuse numbers such as 1.250 and 750 in one column: without zeros at the end, the mark is of thousands."""
        cells = [cell.lstrip("+-") for cell in column.cells if cell]
        marked = [cell for cell in cells if self.dialect.decimal in cell]
        whole = [cell for cell in cells if self.dialect.decimal not in cell]
        by_thousands = all(map(_THREE_AFTER_MARK.fullmatch, marked)) and all(map(_UP_TO_999.fullmatch, whole))
        if marked and whole and by_thousands:
            raise RecordError(
                f"{self.source.path}, {column}: {quoted(marked[0])} and {quoted(whole[0])} look like numbers with a "
                "mark between thousands; write them without it, or all with the same number of decimals."
            )

    def _read_clock(self, column: Column, count: int) -> FloatArray:
        """Times of the first rows as seconds, shape (K,); raises RecordError if a cell holds none."""
        moments: list[Moment] = []
        for line, text in islice(_rows(self.source.data, self.dialect, self.dialect.first_line, self._begin), count):
            cells = _cells(text, self.dialect)
            cell = cells[column.number - 1] if column.number <= len(cells) else ""
            moment = moment_of(cell)
            if moment is None or (moments and moment[2] is not moments[0][2]):
                raise RecordError(
                    f"{self.source.path}, {self.row} {line}, {column}: must hold a time like the rows above, found "
                    f"{quoted(cell)}; correct or delete the {self.row}."
                )
            moments.append(moment)
        return elapsed(moments)


def _column(dialect: Dialect, k: int) -> Column:
    """Column k from 0; a row of units takes precedence over the header."""
    cells = tuple(row[k] for row in dialect.rows if k < len(row))
    name = dialect.header[k] if dialect.header else ""
    unit = dialect.units[k] if dialect.units else None
    clock = not dialect.numeric[k] and is_clock(cells)
    return Column.from_header(k + 1, name, unit, cells=cells, numeric=dialect.numeric[k], is_clock=clock)


def _read_rows(body: bytes, dialect: Dialect, wanted: Sequence[Column]) -> tuple[FloatArray, _BadRow | None, int]:
    """Numbers of the wanted columns up to the first bad row.

    Returns
    -------
    ndarray, shape (K, columns)
    _BadRow or None               The first bad row.
    int                           Bad rows that may be dropped: those at the end, if they are few and incomplete.
    """
    separator = None if dialect.separator is None else dialect.separator.encode()
    mark = dialect.decimal.encode()
    plain = b"0123456789+-eE \t\n" + mark  # what numbers consist of
    places = [column.number - 1 for column in wanted]
    is_plain = not (dialect.has_quotes or b"\v" in body or b"\f" in body)
    values, count = array("d"), 0
    bad: list[_BadRow] = []
    row: list[float] | _BadRow
    for line, text in _rows(body, dialect, dialect.first_line, 0):
        try:
            # What `_read_row` gives, in a quarter of its time, where nothing in the row is unusual.
            cells = text.split(separator)
            numbers = [cells[k] for k in places]
            if not is_plain or len(cells) > dialect.raw_width or b"".join(numbers).translate(None, plain):
                raise ValueError
            row = [float(number.replace(mark, b".")) for number in numbers]
            if math.inf in row or -math.inf in row:
                raise ValueError
        except (IndexError, ValueError):
            row = _read_row(_cells(text, dialect), line, dialect, wanted, is_cut=not text.endswith(b"\n"))
        if isinstance(row, _BadRow):
            bad.append(row)
        elif not bad:
            values.extend(row)
            count += 1
        if bad and (row is not bad[-1] or len(bad) > MAX_DROPPED_ROWS):
            return np.empty((0, len(wanted))), bad[0], 0
    dropped = len(bad) if all(row.is_incomplete for row in bad) else 0
    return np.array(values).reshape(count, len(wanted)), bad[0] if bad else None, dropped


def _rows(data: bytes, dialect: Dialect, line: int, offset: int) -> Iterator[tuple[int, bytes]]:
    """Line and text of each row from an offset on, which is that of the given line."""
    # A line of tabs alone is a row of empty cells where tabs separate cells.
    blanks = b" \n" if dialect.separator == "\t" else b" \t\n"
    stream = io.BytesIO(data)
    stream.seek(offset)
    return ((number, text) for number, text in enumerate(stream, line) if text.strip(blanks))


def _cells(text: bytes, dialect: Dialect) -> list[str]:
    return split_cells(text.decode("utf-8", "replace").rstrip("\n"), dialect.separator, dialect.has_quotes)


def _read_row(
    cells: Sequence[str], line: int, dialect: Dialect, wanted: Sequence[Column], *, is_cut: bool
) -> list[float] | _BadRow:
    """The wanted numbers of a row, or what is wrong with it."""
    if any(cells[dialect.raw_width :]):
        return _BadRow(line, None, f"must have {dialect.raw_width} cells, found {len(cells)}", False)
    wanted_cells = [cells[column.number - 1] if column.number <= len(cells) else "" for column in wanted]
    values = []
    for column, cell in zip(wanted, wanted_cells, strict=True):
        number = column.number
        if not cell:
            what = "an empty cell" if number <= len(cells) else f"only {len(cells)} of {dialect.width} cells"
            return _BadRow(line, number, f"must hold a number, found {what}", True)
        if not is_number(cell, dialect.decimal):
            is_incomplete = not all(wanted_cells) or (is_cut and _TRUNCATED_NUMBER.fullmatch(cell) is not None)
            marked = " without marks between thousands" if _WITH_THOUSANDS.fullmatch(cell) else ""
            return _BadRow(line, number, f"must hold a number{marked}, found the text {quoted(cell)}", is_incomplete)
        value = _value(cell, dialect.decimal)
        if not math.isfinite(value):
            message = f"must hold a finite number, found {quoted(cell)}"
            return _BadRow(line, number, message, "inf" not in cell.casefold())
        values.append(value)
    return values


def _value(cell: str, decimal: str) -> float:
    try:
        return float(cell.replace(decimal, "."))
    except ValueError:  # "NA" and the like
        return math.nan


def _refuse_open_quotes(body: bytes, dialect: Dialect, path: str) -> None:
    """Refuse an open quote, which would silently swallow all rows up to the next one."""
    for line, text in enumerate(io.BytesIO(body), dialect.first_line):
        if (count := text.count(b'"')) % 2:
            raise RecordError(
                f"{path}, line {line}: must close each quotation mark, found {count} of them "
                f"in {quoted(text.decode('utf-8', 'replace').strip())}; correct or delete the line."
            )
