"""Excel workbooks and OpenDocument spreadsheets, read by python-calamine; .xls by xlrd, which endures damaged ones.

Every sheet becomes a text with a row per line, so that headers, units and damaged cells are treated as in text files.
"""

from __future__ import annotations

import io
import re
import zipfile
from collections.abc import Sequence
from typing import Any

from ...errors import RecordError
from ..content import ZIP, Content, check_members
from ..source import Source
from ..tables import TextTable
from .apart import Sheet

_MOST_CELLS = 50_000_000
_REFERENCE = re.compile(rb'<c r="([A-Z]{1,3})([0-9]{1,7})"')
_BREAKS = re.compile(r"[\t\r\n\v\f\x1c-\x1e\x85\u2028\u2029\0]")
_OVERLAP = 64


def read_tables(content: Content) -> list[Sheet]:
    """The sheets that are not empty.

    Raises
    ------
    RecordError   If a sheet is too large.
    """
    sheets = _zipped_sheets(content) if content.data.startswith(ZIP) else _old_sheets(content)
    texts = {name: "\n".join("\t".join(map(_cell, row)) for row in rows) for name, rows in sheets.items()}
    filled = {name: text.rstrip("\t\n") for name, text in texts.items()}
    return [Sheet(name, f"{text}\n".encode("utf-8", "replace")) for name, text in filled.items() if text]


def tables_of_sheets(sheets: Sequence[Sheet], where: str) -> list[TextTable]:
    """The sheets that hold numbers.

    Raises
    ------
    RecordError   If none does.
    """
    tables, problems = [], []
    for sheet in sheets:
        try:
            tables.append(TextTable(Source(where, sheet.data, "utf-8", (), "row"), sheet.name))
        except RecordError as problem:
            problems.append(problem)
    if problems and not tables:
        raise problems[0]
    return tables


def _zipped_sheets(content: Content) -> dict[str, list[list[Any]]]:
    from python_calamine import CalamineWorkbook

    with zipfile.ZipFile(io.BytesIO(content.data)) as archive:
        check_members(archive, content.path)
        for name in archive.namelist():
            if name.startswith("xl/worksheets/") and name.endswith(".xml"):
                _check_extent(archive, name, content.path)
    with CalamineWorkbook.from_filelike(io.BytesIO(content.data)) as workbook:
        names = workbook.sheet_names
        return {name: workbook.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in names}


def _old_sheets(content: Content) -> dict[str, list[list[Any]]]:
    import xlrd

    workbook = xlrd.open_workbook(file_contents=content.data, logfile=io.StringIO())

    def value(cell: Any) -> Any:
        # Dates would be numbers of days.
        return xlrd.xldate_as_datetime(cell.value, workbook.datemode) if cell.ctype == xlrd.XL_CELL_DATE else cell.value

    return {sheet.name: [list(map(value, sheet.row(k))) for k in range(sheet.nrows)] for sheet in workbook.sheets()}


def _cell(value: Any) -> str:
    """A cell as text, numbers with all their digits; quotation marks, which mean inches, as apostrophes."""
    return repr(value) if isinstance(value, float) else _BREAKS.sub(" ", str(value)).replace('"', "''")


def _check_extent(archive: zipfile.ZipFile, name: str, where: str) -> None:
    """Refuse a sheet of few cells far apart: all those between them would be made."""
    rows = columns = 0
    rest = b""
    with archive.open(name) as stream:
        while block := stream.read(1024 * 1024):
            text = rest + block
            found = _REFERENCE.findall(text)
            rows = max(rows, *(int(number) for _, number in found), 0)
            names = {letters for letters, _ in found}
            columns = max(columns, *(sum((c - 64) * 26**k for k, c in enumerate(reversed(n))) for n in names), 0)
            rest = text[-_OVERLAP:]
    if rows * columns > _MOST_CELLS:
        raise RecordError(
            f"{where}: a sheet must have at most {_MOST_CELLS} cells, found {rows} rows of {columns} columns; delete "
            "the cells far from the table, or export it as CSV."
        )
