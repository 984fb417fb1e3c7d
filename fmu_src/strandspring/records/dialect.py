"""Detection of how a text file is written: separator, decimal mark, first row of numbers, header, unit row.

Only the head of the file is examined. Of all pairs of separator and decimal mark the one wins with which the largest
share of cells are numbers; `csv.Sniffer` knows neither decimal marks nor lines before the table. Rows that look wrong
inside the table are not skipped here: they stay in the table, where the reader refuses them with their line number.
"""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

from ..errors import RecordError
from ..ground.quoting import quoted
from .units import kind_of_unit, words

# Best guess first: on equal evidence the earlier one wins. None stands for runs of blanks. A comma as both
# separator and decimal mark works where every cell is quoted.
_GUESSES = (
    ("\t", "."), (";", "."), (",", "."), (None, "."), ("\t", ","), (";", ","), (None, ","), (",", ","),
)  # fmt: skip
_NUMBER = {
    ".": re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"),
    ",": re.compile(r"[+-]?(?:[0-9]+|[0-9]*,[0-9]+)(?:[eE][+-]?[0-9]+)?"),
}
# Spellings of not-a-number and infinity.
NOT_A_NUMBER = words(
    """nan -nan na n/a #n/a #na <na> null none inf +inf -inf infinity +infinity -infinity
    1.#qnan -1.#ind"""
)
_RULE = re.compile(r"[-=_*.]{2,}")  # a line drawn under the header
_STARTS_QUOTED = re.compile(r"""(?:^|[\s,;])\"""")
_JUDGED_LINES = 200
_QUOTED_LINE_LENGTH = 100_000  # the csv module refuses fields longer than 131072 characters


@dataclass(frozen=True)
class Dialect:
    """Format of the numbers of a file.

    Attributes
    ----------
    separator : str or None        Cell separator, None for runs of blanks.
    decimal : str                  Decimal mark, "." or ",".
    width : int                    Number of columns.
    raw_width : int                Number of cells per row, empty ones after the last column included.
    numeric : tuple of bool        Which columns hold numbers in the head.
    first_line : int               1-based line of the first row of numbers.
    header : tuple of str          Names of the columns; empty without.
    header_line : int or None      1-based line of the header.
    units : tuple of str           Cells of the row of units; empty without.
    has_quotes : bool              Whether cells are in double quotes.
    rows : tuple of tuple of str   Cells of the first rows, for messages.
    """

    separator: str | None
    decimal: str
    width: int
    raw_width: int
    numeric: tuple[bool, ...]
    first_line: int = 1
    header: tuple[str, ...] = ()
    header_line: int | None = None
    units: tuple[str, ...] = ()
    has_quotes: bool = False
    rows: tuple[tuple[str, ...], ...] = ()

    @property
    def least_width(self) -> int:
        """Least number of cells in a row: where blanks separate them, one that is missing moves the others."""
        last = max(column for column, numeric in enumerate(self.numeric, 1) if numeric)
        return last if self.separator is None else 0

    def is_full(self, cells: Sequence[str]) -> bool:
        """Whether each numeric column holds a number."""
        return self.fits(cells) and all(
            is_number(cell, self.decimal) for cell, numeric in zip(cells, self.numeric, strict=False) if numeric
        )

    def fits(self, cells: Sequence[str]) -> bool:
        """Whether the number of cells is that of the table; separators at the end may be missing."""
        return len(cells) == self.raw_width or _width(cells) == self.width

    def named_cells(self, line: str) -> tuple[str, ...]:
        """Cells of a header or unit row, one per column; () if their number is not that of the table."""
        line = line.lstrip("#%").strip(" ") if line[:1] in ("#", "%") else line
        candidates = [split_cells(line, self.separator)]
        if self.separator is None:
            # Single blanks do not separate in "Force [kN]", nor where two blanks separate the names.
            candidates += [re.sub(r"\s{1,9}(?=[\[(])", "", line).split(), re.split(r"\s{2,}|\t", line.strip())]
        for cells in candidates:
            if self.fits(cells):
                return (*cells, *[""] * self.width)[: self.width]
        return ()


class _Cells(Sequence[list[str]]):
    """Cells of lines, which are cut when they are first asked for: few of them are."""

    def __init__(self, lines: Sequence[str], separator: str | None) -> None:
        self._lines, self._separator = lines, separator
        self._known: dict[int, list[str]] = {}

    def __len__(self) -> int:
        return len(self._lines)

    def __getitem__(self, k: Any) -> Any:
        if k not in self._known:
            self._known[k] = split_cells(self._lines[k], self._separator)
        return self._known[k]


def find_dialect(lines: Sequence[str], path: str, row: str, advice: str | None) -> Dialect:
    """Detect the dialect of a file.

    Parameters
    ----------
    lines : sequence of str   First lines of the file, without line ends.
    path : str                Name of the file for messages.
    row : str                 What messages call a line.
    advice : str or None      What to do about a damaged row at the top, a template of it; None to keep it in the table.

    Raises
    ------
    RecordError               If no two columns of numbers are found.
    """
    separator, decimal = _best_guess([line for line in lines if line.strip()][-_JUDGED_LINES:])
    table = _Cells(lines, separator)
    from_end = (cells for cells in reversed(table) if _count_numbers(cells, decimal) >= 2)
    judged = list(islice(from_end, _JUDGED_LINES))[::-1]
    if not judged:
        raise RecordError(_no_numbers(lines, path, row))
    width = Counter(_width(cells) for cells in judged).most_common(1)[0][0]
    raw_width = max(width, Counter(len(cells) for cells in judged).most_common(1)[0][0])
    regular = [cells for cells in judged if _width(cells) == width]
    numeric = tuple(
        2 * sum(is_number(cells[column], decimal) for cells in regular) > len(regular) for column in range(width)
    )
    if sum(numeric) < 2:
        raise RecordError(_no_numbers(lines, path, row))
    shape = Dialect(separator, decimal, width, raw_width, numeric)
    # If no row is full, the first one is refused like any damaged row.
    first = next((i for i, cells in enumerate(table) if shape.is_full(cells)), None)
    first = table.index(regular[0]) if first is None else first
    damaged, header, units = _above(lines, table, first, shape)
    if advice is not None:
        _refuse_text(table, damaged, shape, f"{path}, {row}", advice)
    first = min([first, *damaged])
    return replace(
        shape,
        first_line=first + 1,
        header=() if header is None else shape.named_cells(lines[header]),
        header_line=None if header is None else header + 1,
        units=() if units is None else shape.named_cells(lines[units]),
        has_quotes=any(_STARTS_QUOTED.search(line) for line in lines[first:]),
        rows=tuple(
            tuple(cells) for k in range(first, min(first + _JUDGED_LINES, len(table))) if any(cells := table[k])
        ),
    )


def split_cells(line: str, separator: str | None, has_quotes: bool = True) -> list[str]:
    """Cut a line into its cells, without blanks around them and, where quotes count, without quotes.

    Blanks are space and tab; the others of Unicode count as text.
    """
    if separator is None:
        line = line.replace('"', " ") if has_quotes else line
        return [cell for cell in re.split("[ \t]+", line) if cell]
    cells = line.split(separator)
    if has_quotes and '"' in line and len(line) <= _QUOTED_LINE_LENGTH:
        cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip(" \t") for cell in cells]


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number, NaN and infinity included."""
    return _NUMBER[decimal].fullmatch(cell) is not None or cell.casefold() in NOT_A_NUMBER


def _best_guess(lines: Sequence[str]) -> tuple[str | None, str]:
    best: tuple[str | None, str] = _GUESSES[0]
    best_score = 0.0
    for separator, decimal in _GUESSES:
        if separator is not None and not any(separator in line for line in lines):
            continue
        score = 0.0
        for line in lines:
            cells = split_cells(line, separator)
            numbers = _count_numbers(cells, decimal)
            if numbers >= 2:
                score += numbers / sum(map(bool, cells))
        if score > best_score:
            best, best_score = (separator, decimal), score
    return best


def _count_numbers(cells: Sequence[str], decimal: str) -> int:
    """Number of cells that are numbers with digits; "NA" and "none" may be words."""
    return sum(_NUMBER[decimal].fullmatch(cell) is not None for cell in cells)


def _width(cells: Sequence[str]) -> int:
    """Number of cells up to the last that is not empty."""
    return max((i for i, cell in enumerate(cells, 1) if cell), default=0)


def _above(
    lines: Sequence[str], table: Sequence[Sequence[str]], first: int, shape: Dialect
) -> tuple[list[int], int | None, int | None]:
    """Search upwards from the first full row: indices of damaged rows, of the header and of the row of units.

    Rows with numbers between the header and the first full row belong to the table, where the reader
    refuses them: a damaged first row must not be mistaken for a header or skipped.
    """
    header: int | None = None
    units: int | None = None
    damaged: list[int] = []
    for i in range(first - 1, -1, -1):
        cells = [cell for cell in table[i] if cell]
        if not cells or all(_RULE.fullmatch(cell) for cell in cells):
            continue
        names = shape.named_cells(lines[i])
        numbers = _count_numbers(cells, shape.decimal)
        if numbers and (names or numbers == len(cells)):
            damaged.append(i)
        elif not names:
            break
        elif units is None and not damaged and _is_unit_row(names):
            units = i
        else:
            header = i
            break
    if header is None and damaged:
        # "Time;3" is a header though it holds a number; "Err;3.5" is a damaged row.
        top = [cell for cell in table[damaged[-1]] if cell]
        digits = [cell for cell in top if is_number(cell, shape.decimal)]
        if len(digits) < len(top) and all(cell.isdigit() for cell in digits):
            header = damaged.pop()
    return damaged[::-1], header, units


def _refuse_text(
    table: Sequence[Sequence[str]], damaged: Sequence[int], shape: Dialect, where: str, advice: str
) -> None:
    """Refuse lines of text and numbers just above the table: they may be settings or damaged samples."""
    for i in damaged:
        for column, (cell, numeric) in enumerate(zip(table[i], shape.numeric, strict=False), 1):
            if numeric and re.search(r"\w", cell) and not is_number(cell, shape.decimal):
                sentence = f"{{where}}: must hold a number like the rows below, found the text {{text}}; {advice}."
                raise RecordError(sentence, where=f"{where} {i + 1}, column {column}", text=quoted(cell))


def _is_unit_row(cells: Sequence[str]) -> bool:
    kinds = {cell: kind_of_unit(cell) for cell in cells if cell}
    all_known = all(kind is not None or cell[0] in "[(" for cell, kind in kinds.items())
    return all_known and not {"displacement", "force"}.isdisjoint(kinds.values())


def _no_numbers(lines: Sequence[str], path: str, row: str) -> str:
    texts = [line.strip() for line in lines if line.strip()]
    if texts and texts[0].startswith("{"):
        return (
            f"{path}: is not a record but JSON; give a table of displacement and force, or, if it is a model, use it "
            "with `strandspring info`, predict, isolate or build."
        )
    return (
        f"{path}: must hold at least two columns of numbers, found none in the first {len(texts)} {row}s, "
        f"which begin with {quoted(next(iter(texts), ''))}; separate the columns by tabs, semicolons, commas or blanks."
    )
