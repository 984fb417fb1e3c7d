"""Excel workbooks (.xlsx, .xlsb, .xls) and OpenDocument spreadsheets, read by python-calamine.

Every sheet becomes a text with a row per line, so that headers, units and damaged cells are treated as in text files.
"""

from __future__ import annotations

import io
import re
import zipfile
from typing import Any

from ...errors import RecordError
from ..content import ZIP, Content, check_members
from ..source import Source
from ..tables import TextTable

_MOST_CELLS = 50_000_000
_REFERENCE = re.compile(rb'<c r="([A-Z]{1,3})([0-9]{1,7})"')
_BREAKS = re.compile(r"[\t\r\n\v\f\x1c-\x1e\x85\u2028\u2029\0]")
_OVERLAP = 64


def read_tables(content: Content) -> list[TextTable]:
    """The sheets that hold numbers.

    Raises
    ------
    RecordError   If a sheet is too large, or the only sheet holds no table.
    """
    from python_calamine import CalamineWorkbook

    if content.data.startswith(ZIP):
        with zipfile.ZipFile(io.BytesIO(content.data)) as archive:
            check_members(archive, content.path)
            for name in archive.namelist():
                if name.startswith("xl/worksheets/") and name.endswith(".xml"):
                    _check_extent(archive, name, content.path)
    with CalamineWorkbook.from_filelike(io.BytesIO(content.data)) as workbook:
        sheets = {
            name: workbook.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in workbook.sheet_names
        }
    tables, problems = [], []
    for name, rows in sheets.items():
        text = "\n".join("\t".join(map(_cell, row)) for row in rows).rstrip("\t\n")
        if not text:
            continue
        try:
            tables.append(TextTable(Source(content.path, f"{text}\n".encode(), "utf-8", (), "row"), name))
        except RecordError as problem:
            problems.append(problem)
    if problems and not tables:
        raise problems[0]
    return tables


def _cell(value: Any) -> str:
    """A cell as text, numbers with all their digits."""
    return repr(value) if isinstance(value, float) else _BREAKS.sub(" ", str(value))


def _check_extent(archive: zipfile.ZipFile, name: str, where: str) -> None:
    """Refuse a sheet of few cells far apart: all those between them would be made."""
    rows = columns = 0
    rest = b""
    with archive.open(name) as stream:
        while block := stream.read(1024 * 1024):
            text = rest + block
            for letters, number in _REFERENCE.findall(text):
                rows = max(rows, int(number))
                columns = max(columns, sum((c - 64) * 26**k for k, c in enumerate(reversed(letters))))
            rest = text[-_OVERLAP:]
    if rows * columns > _MOST_CELLS:
        raise RecordError(
            f"{where}: a sheet must have at most {_MOST_CELLS} cells, found {rows} rows of {columns} columns; delete "
            "the cells far from the table, or export it as CSV."
        )
