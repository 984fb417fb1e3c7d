"""Excel workbooks and OpenDocument spreadsheets, read by python-calamine; .xls by xlrd, which endures damaged ones."""

from __future__ import annotations

import io
import re
import zipfile
from typing import Any

import xlrd
from python_calamine import CalamineWorkbook

from ...errors import RecordError
from ..content import ZIP, FileContent, check_members

_MOST_CELLS = 50_000_000
_REFERENCE = re.compile(rb'<c r="([A-Z]{1,3})([0-9]{1,7})"')
_MOST_REPEATS = 100_000  # of rows or cells, which LibreOffice writes once where neighbours are equal
_REPEATED_ROW = re.compile(rb'<table:table-row\b[^>]*number-rows-repeated=["\']([0-9]{1,20})["\']')
_REPEATED_CELL = re.compile(rb'<table:table-cell\b[^>]*number-columns-repeated=["\']([0-9]{1,20})["\'][^>]*(?<!/)>')
_FILLED = (b"<text:p", b"office:value")
_BREAKS = re.compile(r"[\t\r\n\v\f\x1c-\x1e\x85\u2028\u2029\0]")
_OVERLAP = 64


def read_tables(content: FileContent) -> dict[str, bytes]:
    """The sheets that are not empty: a line per row in UTF-8, tabs between the cells.

    Raises
    ------
    RecordError   If a sheet is too large.
    """
    sheets = _zipped_sheets(content) if content.data.startswith(ZIP) else _old_sheets(content)
    texts = {name: "\n".join("\t".join(map(_cell, row)) for row in rows) for name, rows in sheets.items()}
    filled = {name: text.rstrip("\t\n") for name, text in texts.items()}
    return {name: f"{text}\n".encode("utf-8", "replace") for name, text in filled.items() if text}


def _zipped_sheets(content: FileContent) -> dict[str, list[list[Any]]]:
    with zipfile.ZipFile(io.BytesIO(content.data)) as archive:
        check_members(archive, content.path)
        for name in archive.namelist():
            if name.startswith("xl/worksheets/") and name.endswith(".xml"):
                _check_extent(archive, name, content.path)
            elif name == "content.xml":
                _check_repeats(archive.read(name), content.path)
    with CalamineWorkbook.from_filelike(io.BytesIO(content.data)) as workbook:
        names = workbook.sheet_names
        return {name: workbook.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in names}


def _old_sheets(content: FileContent) -> dict[str, list[list[Any]]]:
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
            references = _REFERENCE.findall(text)
            rows = max(rows, *(int(number) for _, number in references), 0)
            names = {letters for letters, _ in references}
            columns = max(columns, *(sum((c - 64) * 26**k for k, c in enumerate(reversed(n))) for n in names), 0)
            rest = text[-_OVERLAP:]
    if rows * columns > _MOST_CELLS:
        raise RecordError(
            f"{where}: a sheet must have at most {_MOST_CELLS} cells, found {rows} rows of {columns} columns; delete "
            "the cells far from the table, or export it as CSV."
        )


def _check_repeats(sheets: bytes, where: str) -> None:
    """Refuse an OpenDocument spreadsheet in which a few bytes stand for rows or cells without end."""
    rows = 0
    for match in _REPEATED_ROW.finditer(sheets):
        row = sheets[match.end() : sheets.find(b"</table:table-row>", match.end())]
        rows += int(match[1]) if any(mark in row for mark in _FILLED) else 0
    cells = sum(int(match[1]) for match in _REPEATED_CELL.finditer(sheets))
    if max(rows, cells) > _MOST_REPEATS:
        what, count = ("rows", rows) if rows > cells else ("cells", cells)
        raise RecordError(
            f"{where}: a spreadsheet must repeat at most {_MOST_REPEATS} filled {what}, found {count}; export it as "
            "CSV."
        )
