"""Sheets of a workbook as text, so that headers, units and damaged cells are treated as in text files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...errors import RecordError
from ..source import Source
from ..tables import Table, TextTable


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


def sheet_tables(sheets: Sequence[Sheet], where: str) -> list[Table]:
    """The sheets that hold numbers.

    Parameters
    ----------
    sheets : sequence of Sheet
    where : str                  The file, for messages.

    Raises
    ------
    RecordError                  If none holds numbers; what is wrong with the first.
    """
    tables: list[Table] = []
    problems = []
    for sheet in sheets:
        try:
            tables.append(TextTable(Source(where, sheet.data, "utf-8", (), "row"), sheet.name))
        except RecordError as problem:
            problems.append(problem)
    if problems and not tables:
        raise problems[0]
    return tables
