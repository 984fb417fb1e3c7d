"""A table of columns, whatever the file it comes from: a text, or a sheet, which is made one.

So headers, units and damaged cells of sheets are treated as in text files.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordError
from ..ground.quoting import quoted
from .columns import Column, table_columns
from .dialect import Dialect, find_dialect
from .rows import lines_of_rows, read_numbers
from .source import Source

_THREE_AFTER_MARK = re.compile("[1-9][0-9]{0,2}[.,][0-9]{3}")
_UP_TO_999 = re.compile("0|[1-9][0-9]{0,2}")

FloatArray = NDArray[np.float64]


class SourceTable(Protocol):
    """One table of a file: its text, a sheet, a group of channels.

    Attributes
    ----------
    name : str                     Of the sheet or group; "" where the file has but one table.
    columns : sequence of Column   All of them, numbered from 1.
    notes : tuple of str           Sentences about where the table lies.
    row : str                      What messages call a row.
    """

    @property
    def name(self) -> str: ...

    @property
    def columns(self) -> Sequence[Column]: ...

    @property
    def notes(self) -> tuple[str, ...]: ...

    @property
    def row(self) -> str: ...

    def read(
        self, wanted: Collection[Column], optional: Column | None = None
    ) -> tuple[dict[int, FloatArray], list[str]]:
        """Numbers of columns, shape (K,), by column number, as in the file; sentences about what is left out.

        Raises
        ------
        RecordError   If a row is incomplete, unless among the last, or holds no number; of the column `optional` that
            is no more than a reason to leave it out.
        """

    def places(self, rows: Collection[int]) -> list[int]:
        """Numbers by which messages name rows of the table that was read, which count from 0."""


class TextTable:
    """The table in a text, which a sheet of a workbook is made too, so that both are treated alike.

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
        self.dialect: Dialect = find_dialect(source.head, source.path, source.row)
        self.columns = table_columns(self.dialect)

    @property
    def notes(self) -> tuple[str, ...]:
        """How the text is laid out."""
        notes = list(self.source.notes)
        if self.dialect.first_line > 1:
            line = self.dialect.header_line
            header = "no header" if line is None else f"the header in {self.row} {line}"
            notes.append(f"the numbers begin in {self.row} {self.dialect.first_line}, with {header}")
        if self.dialect.decimal == ",":
            notes.append("the decimal mark is a comma")
        return tuple(notes)

    def read(
        self, wanted: Collection[Column], optional: Column | None = None
    ) -> tuple[dict[int, FloatArray], list[str]]:
        """See `SourceTable.read`."""
        for column in wanted:
            self._refuse_thousands(column)
        return read_numbers(self.source, self.dialect, wanted, optional)

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

    def places(self, rows: Collection[int]) -> list[int]:
        """1-based lines of rows."""
        return lines_of_rows(self.source, self.dialect, rows)


@dataclass(frozen=True)
class Sheet:
    """A sheet of a workbook.

    Attributes
    ----------
    name : str
    data : bytes   UTF-8, a line per row, tabs between the cells.
    """

    name: str
    data: bytes


def sheet_tables(sheets: Sequence[Sheet], where: str) -> list[SourceTable]:
    """The sheets that hold numbers.

    Parameters
    ----------
    sheets : sequence of Sheet
    where : str                  The file, for messages.

    Raises
    ------
    RecordError                  If none holds numbers; what is wrong with the first.
    """
    tables: list[SourceTable] = []
    problems = []
    for sheet in sheets:
        try:
            tables.append(TextTable(Source(where, sheet.data, "utf-8", (), "row"), sheet.name))
        except RecordError as problem:
            problems.append(problem)
    if problems and not tables:
        raise problems[0]
    return tables
