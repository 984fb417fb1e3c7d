"""The table in a text, which a sheet of a workbook is made too, so that both are treated alike.

It is read row by row, so that a bad row is named by its line; a large one in parts until something unusual comes.
"""

from __future__ import annotations

import io
import math
import re
from array import array
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from datetime import date
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from ..findings import Finding, Outcome
from ..ground.quoting import quoted
from .bad_rows import MAX_DROPPED_ROWS, BadRow, ReadRows, most_bad
from .columns import Column
from .dialect import Dialect, find_dialect, is_number, split_cells
from .record import FloatArray
from .source import Source
from .tables import Table

_TRUNCATED_NUMBER = re.compile(r"[+-]?[0-9]*(?:[.,][0-9]*)?(?:[eE][+-]?)?\ufffd?")
_THREE_AFTER_MARK = re.compile("[1-9][0-9]{0,2}[.,][0-9]{3}")
_WITH_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}(?:[.,'\s][0-9]{3})+(?:[.,][0-9]+)?")
_THOUSANDS_IN_CELLS = re.compile(r"(?:^|,)[+-]?[1-9][0-9]{0,2}(?:,[0-9]{3})+(?:\.[0-9]+)?(?:,|$)")
_UP_TO_999 = re.compile("0|[1-9][0-9]{0,2}")
_LEAST, _PART = 1 << 20, 1 << 22  # of a text that is worth it, and of a part [B]
_DAY = 86400.0  # [s]
_TIME = re.compile(
    r"(?:(?P<year>\d{4})[-/.](?P<month>\d{1,2})[-/.](?P<day>\d{1,2})[ T]|(?P<days>\d{1,6}) days?, ?)?"
    r"(?:(?P<hours>\d{1,6}):)?(?P<minutes>[0-5]?\d):(?P<seconds>[0-5]?\d(?P<decimals>[.,]\d{1,9})?)"
    r"(?: ?(?P<half>[AaPp])\.?[Mm]\.?)?Z?"
)
# Days since midnight or since the year 1, seconds since, and whether there is a date; apart, or digits would be lost.
Moment = tuple[int, float, bool]


class TextTable(Table):
    """The table in a text.

    Parameters
    ----------
    source : Source
    name : str        Of the sheet; "" for a text file.
    skip_bad_lines : bool or None   Whether rows that cannot be read are left out; None where nobody could ask for it.

    Raises
    ------
    RecordError       If no two columns of numbers are found.
    """

    def __init__(self, source: Source, name: str = "", skip_bad_lines: bool | None = None) -> None:
        self.source = source
        self.name = name
        self.row = source.row
        self._skips = bool(skip_bad_lines)
        self._left_out: set[int] = set()  # lines
        offer = "" if skip_bad_lines is None else f", or leave out such {source.row}s with {{to[skip_bad_lines=True]}}"
        self._advice = f"correct or delete the {source.row}{offer}"
        advice = None if self._skips else self._advice
        self.dialect = dialect = find_dialect(source.head, source.path, source.row, advice)
        self.columns = [_column(dialect, k, self._skips) for k in range(dialect.width)]
        self.findings = source.findings
        if dialect.first_line > 1:
            kind = Outcome.NO_HEADER if dialect.header_line is None else Outcome.HEADER
            numbers = {"row": self.row, "first": dialect.first_line, "header": dialect.header_line}
            self.findings += (Finding(kind, numbers),)
        if dialect.decimal == ",":
            self.findings += (Finding(Outcome.DECIMAL_COMMA),)

    def read(
        self, wanted: Collection[Column], optional: Column | None = None
    ) -> tuple[dict[int, FloatArray], list[Finding]]:
        """See `Table.read`."""
        for column in wanted:
            self._refuse_thousands(column)
        columns = list(wanted)
        findings: list[Finding] = []
        rows = self._read_rows(columns)
        if rows.refused is not None and optional is not None:
            faulty = next((bad for bad in rows.bad if bad.column == optional.number), None)
            if faulty is not None:
                columns.remove(optional)
                numbers = {"column": str(optional), "problem": f"{self.row} {faulty.line}, {faulty.message}"}
                findings.append(Finding(Outcome.TIME_LEFT_OUT, numbers))
                rows = self._read_rows(columns)
        if rows.refused is not None:
            raise self._refusal(rows.refused)
        findings += rows.findings(self.row, self._place)
        self._left_out = {bad.line for bad in rows.bad}
        arrays = {column.number: rows.values[:, i].copy() for i, column in enumerate(_numeric(columns))}
        for column in _clocks(columns):
            moments, wrong = self._moments(column, rows.values.shape[0])
            if not wrong:
                arrays[column.number] = elapsed(moments)
            elif column is optional:
                problem = f"{self.row} {wrong[0].line}, {wrong[0].message}"
                findings.append(Finding(Outcome.TIME_LEFT_OUT, {"column": str(column), "problem": problem}))
            else:
                raise self._refusal(wrong[0])
        return arrays, findings

    def places(self, rows: Collection[int]) -> list[int]:
        """1-based lines of rows."""
        lines = islice(self._kept_rows(), max(rows, default=-1) + 1)
        return [line for row, (line, _) in enumerate(lines) if row in rows]

    def _place(self, bad: BadRow) -> str:
        column = "" if bad.column is None else f", {self.columns[bad.column - 1]}"
        return f"{self.row} {bad.line}{column}"

    def _refusal(self, bad: BadRow) -> RecordError:
        """Why a bad row is not left out, and what to do."""
        advice = self._advice
        if self._skips:
            advice = f"more than a tenth of the {self.row}s cannot be read; correct the file"
        if self._skips and bad.has_thousands:
            advice = f"such {self.row}s hold the largest numbers and are not left out; write these without the mark"
        where, sentence = f"{self.source.path}, {self._place(bad)}", f"{{where}}: {{problem}}; {advice}."
        return RecordError(sentence, where=where, problem=bad.message)

    def _read_rows(self, columns: Sequence[Column]) -> ReadRows:
        """The rows of columns, clocks aside."""
        data, begin = self.source.data, self._begin
        known = _open_quotes(data[begin:], self.dialect) if self.dialect.has_quotes else {}
        if self._skips:
            self._left_out = set()
            for column in _clocks(columns):
                known |= {bad.line: bad for bad in self._moments(column)[1]}
        return _read_rows(data, begin, self.dialect, _numeric(columns), known, skips=self._skips)

    def _kept_rows(self) -> Iterator[tuple[int, bytes]]:
        rows = _rows(self.source.data, self.dialect, self.dialect.first_line, self._begin)
        return ((line, text) for line, text in rows if line not in self._left_out)

    @property
    def _begin(self) -> int:
        """Where the first row of numbers begins [B]."""
        offset = 0
        for _ in range(self.dialect.first_line - 1):
            offset = self.source.data.index(b"\n", offset) + 1
        return offset

    def _refuse_thousands(self, column: Column) -> None:
        """Refuse numbers such as 1.250 and 750 in one column: without zeros at the end, the mark is of thousands."""
        cells = [cell.lstrip("+-") for cell in column.cells if is_number(cell, self.dialect.decimal)]
        marked = [cell for cell in cells if self.dialect.decimal in cell]
        whole = [cell for cell in cells if self.dialect.decimal not in cell]
        by_thousands = all(map(_THREE_AFTER_MARK.fullmatch, marked)) and all(map(_UP_TO_999.fullmatch, whole))
        if marked and whole and by_thousands:
            raise RecordError(
                f"{self.source.path}, {column}: {quoted(marked[0])} and {quoted(whole[0])} look like numbers with a "
                "mark between thousands; write them without it, or all with the same number of decimals."
            )

    def _moments(self, column: Column, count: int | None = None) -> tuple[list[Moment], list[BadRow]]:
        """Times of the first rows, and the rows whose cell holds none."""
        moments: list[Moment] = []
        wrong: list[BadRow] = []
        most = most_bad(self.source.data.count(b"\n")) if self._skips else 0
        for line, text in islice(self._kept_rows(), count):
            cells = _cells(text, self.dialect)
            cell = cells[column.number - 1] if column.number <= len(cells) else ""
            moment = moment_of(cell)
            if moment is None or (moments and moment[2] is not moments[0][2]):
                message = f"must hold a time like the rows above, found {quoted(cell)}"
                wrong.append(BadRow(line, column.number, message, is_incomplete=True))
                if len(wrong) > most:
                    break
            else:
                moments.append(moment)
        return moments, wrong


def _clocks(columns: Sequence[Column]) -> list[Column]:
    return [column for column in columns if column.is_clock]


def _numeric(columns: Sequence[Column]) -> list[Column]:
    return [column for column in columns if not column.is_clock]


def _column(dialect: Dialect, k: int, skips: bool) -> Column:
    """Column k from 0; a row of units takes precedence over the header."""
    cells = tuple(row[k] for row in dialect.rows if k < len(row))
    name = dialect.header[k] if dialect.header else ""
    unit = dialect.units[k] if dialect.units else None
    times = [cell for cell in cells if not skips or moment_of(cell) is not None]
    clock = not dialect.numeric[k] and is_clock(times) and len(cells) - len(times) <= most_bad(len(cells))
    return Column.from_header(k + 1, name, unit, cells=cells, numeric=dialect.numeric[k], is_clock=clock)


def _read_rows(
    data: bytes, begin: int, dialect: Dialect, wanted: Sequence[Column], known: Mapping[int, BadRow], *, skips: bool
) -> ReadRows:
    """Numbers of the wanted columns, up to the first bad row unless such rows are left out.

    Parameters
    ----------
    begin : int       Where the first row of numbers begins [B].
    known : mapping   Bad rows, by line, that are known before they are read.
    skips : bool      Whether bad rows are left out.
    """
    most = most_bad(data.count(b"\n")) if skips else MAX_DROPPED_ROWS
    separator = None if dialect.separator is None else dialect.separator.encode()
    mark = dialect.decimal.encode()
    plain = b"0123456789+-eE \t\n" + mark  # what numbers consist of
    places = [column.number - 1 for column in wanted]
    least, most_cells = dialect.least_width, dialect.raw_width
    is_plain = not (dialect.has_quotes or b"\v" in data or b"\f" in data)
    values, count = array("d"), 0
    bad: list[BadRow] = []
    at_end, above_end = 0, -1  # the last bad rows in succession begin at this one, below so many good ones
    row: list[float] | BadRow
    for part, size in () if known else plain_parts(data, begin, dialect, places):
        values.frombytes(part.tobytes())
        count, begin = count + len(part), begin + size
    for line, text in _rows(data, dialect, dialect.first_line + count, begin):
        try:
            # What `_read_row` gives, in a quarter of its time, where nothing in the row is unusual.
            cells = text.split(separator)
            numbers = [cells[k] for k in places]
            if not (is_plain and least <= len(cells) <= most_cells) or b"".join(numbers).translate(None, plain):
                raise ValueError
            row = [float(number.replace(mark, b".")) for number in numbers]
            if math.inf in row or -math.inf in row:
                raise ValueError
        except (IndexError, ValueError):
            row = _read_row(_cells(text, dialect), line, dialect, wanted, is_cut=not text.endswith(b"\n"))
        if line in known:
            row = known[line]
        if isinstance(row, BadRow):
            if count != above_end:
                at_end, above_end = len(bad), count
            bad.append(row)
        elif bad and not skips:
            return ReadRows(np.empty((0, len(wanted))), bad)
        else:
            values.extend(row)
            count += 1
        if len(bad) > most:
            return ReadRows(np.empty((0, len(wanted))), bad, skips=skips)
    dropped = bad[at_end:] if above_end == count else []
    if len(dropped) > MAX_DROPPED_ROWS or not all(row.is_incomplete for row in dropped):
        dropped = []
    read = np.frombuffer(values).reshape(count, len(wanted))
    return ReadRows(read, bad[: len(bad) - len(dropped)], dropped, skips)


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
) -> list[float] | BadRow:
    """The wanted numbers of a row, or what is wrong with it."""
    if any(cells[dialect.raw_width :]):
        has_thousands = dialect.separator == "," and _THOUSANDS_IN_CELLS.search(",".join(cells)) is not None
        hint = " (is a comma between thousands?)" if has_thousands else ""
        message = f"must have {dialect.raw_width} cells, found {len(cells)}{hint}"
        return BadRow(line, None, message, is_incomplete=False, has_thousands=has_thousands)
    if len(cells) < dialect.least_width:
        return BadRow(line, None, f"must have {dialect.width} cells, found {len(cells)}", is_incomplete=True)
    wanted_cells = [cells[column.number - 1] if column.number <= len(cells) else "" for column in wanted]
    values = []
    for column, cell in zip(wanted, wanted_cells, strict=True):
        number = column.number
        if not cell:
            what = "an empty cell" if number <= len(cells) else f"only {len(cells)} of {dialect.width} cells"
            return BadRow(line, number, f"must hold a number, found {what}", True)
        if not is_number(cell, dialect.decimal):
            is_incomplete = not all(wanted_cells) or (is_cut and _TRUNCATED_NUMBER.fullmatch(cell) is not None)
            has_thousands = _WITH_THOUSANDS.fullmatch(cell) is not None
            marked = " without marks between thousands" if has_thousands else ""
            message = f"must hold a number{marked}, found the text {quoted(cell)}"
            return BadRow(line, number, message, is_incomplete, has_thousands)
        value = _value(cell, dialect.decimal)
        if not math.isfinite(value):
            message = f"must hold a finite number, found {quoted(cell)}"
            return BadRow(line, number, message, "inf" not in cell.casefold())
        values.append(value)
    return values


def _value(cell: str, decimal: str) -> float:
    try:
        return float(cell.replace(decimal, "."))
    except ValueError:  # "NA" and the like
        return math.nan


def _open_quotes(body: bytes, dialect: Dialect) -> dict[int, BadRow]:
    """Rows with an open quote, which would silently swallow all rows up to the next one, by line."""
    rows = {}
    for line, text in enumerate(io.BytesIO(body), dialect.first_line):
        if (count := text.count(b'"')) % 2:
            found = f"{count} of them in {quoted(text.decode('utf-8', 'replace').strip())}"
            rows[line] = BadRow(line, None, f"must close each quotation mark, found {found}", is_incomplete=False)
    return rows


def plain_parts(data: bytes, begin: int, dialect: Dialect, places: Sequence[int]) -> Iterator[tuple[FloatArray, int]]:
    """Numbers of the cells at some places of rows from an offset on, shape (K, places), and the bytes of these rows.

    A part ends the iteration unless each of its rows has as many cells as most rows of the table, of the characters of
    numbers, and those at the places are finite numbers: so a number here is that of the row reader, to the bit.
    """
    if len(data) < _LEAST or dialect.separator is None or dialect.has_quotes:
        return
    characters = b"0123456789+-eE \n" + (dialect.decimal + dialect.separator).encode()
    mark = ord(dialect.separator)
    while end := data.rfind(b"\n", begin, begin + _PART) + 1:
        part = data[begin:end]
        codes = np.frombuffer(part, dtype=np.uint8)
        ends = np.flatnonzero(codes == ord("\n"))
        cells = 1 + np.diff(np.searchsorted(np.flatnonzero(codes == mark), ends), prepend=0)
        if part.translate(None, characters) or np.any(cells != dialect.raw_width):
            return
        try:
            # A decimal comma is not the separator.
            lines = io.BytesIO(part if dialect.decimal == "." else part.replace(b",", b"."))
            values = np.loadtxt(lines, comments=None, delimiter=dialect.separator, usecols=places, ndmin=2)
        except ValueError:
            return
        if len(values) != ends.size or not np.isfinite(values).all():
            return
        yield values, end - begin
        begin = end


def is_clock(cells: Iterable[str]) -> bool:
    """Whether there are cells, all of them times such as "10:00:08.5", or all with a date, "2024-05-17 10:00:08"."""
    moments = [moment_of(cell) for cell in cells]
    return {None if moment is None else moment[2] for moment in moments} in ({False}, {True})


def moment_of(cell: str) -> Moment | None:
    """The moment that a cell holds; None if it is no time: "10:05" may be hours and minutes or minutes and seconds.

    Examples
    --------
    >>> moment_of("10:00:08,5"), moment_of("1:05.25"), moment_of("0001-01-02 00:00:01"), moment_of("10:05")
    ((0, 36008.5, False), (0, 65.25, False), (2, 1.0, True), None)
    """
    match = _TIME.fullmatch(cell)
    if match is None or not (match["hours"] or match["decimals"]):
        return None
    hours = int(match["hours"] or 0)
    if match["half"]:
        if not 1 <= hours <= 12:
            return None
        hours = hours % 12 + (12 if match["half"] in "Pp" else 0)
    days = int(match["days"] or 0)
    if match["year"]:
        try:
            days = date(int(match["year"]), int(match["month"]), int(match["day"])).toordinal()
        except ValueError:
            return None
    seconds = float(match["seconds"].replace(",", "."))
    return days, hours * 3600.0 + int(match["minutes"]) * 60.0 + seconds, match["year"] is not None


def elapsed(moments: Iterable[Moment]) -> NDArray[np.float64]:
    """Seconds since midnight, or since the first time if there are dates, shape (K,); without dates, midnight may pass.

    Examples
    --------
    >>> elapsed([(0, 86399.0, False), (0, 1.0, False)]).tolist()
    [86399.0, 86401.0]
    """
    days, seconds, dated = map(np.array, zip(*moments, strict=True))
    if dated.any():
        return np.asarray((days - days[0]) * _DAY + (seconds - seconds[0]))
    values = days * _DAY + seconds
    midnights = np.cumsum(np.concatenate([[0.0], np.diff(values) < -0.5 * _DAY]))
    return np.asarray(values + _DAY * midnights)
