"""Tables as lines of text, in full width or folded for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from textwrap import wrap

_GAP = "  "  # between columns


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Parameters
    ----------
    heading : str
    is_left : bool               Whether the cells are aligned to the left, instead of to the right.
    cells : tuple of str         Several lines in a cell are separated by \\n.
    """

    heading: str
    is_left: bool
    cells: tuple[str, ...]

    @property
    def width(self) -> int:
        """Characters of the widest line, the heading's included."""
        return max(cell_width(line) for text in (self.heading, *self.cells) for line in text.split("\n"))

    def folded(self) -> Column:
        """With the words of the heading one below the other where it is wider than the cells."""
        words = self.heading.split() or [""]
        width = max(map(cell_width, (*words, *self.cells)))
        return replace(self, heading="\n".join(wrap(self.heading, width)) if width else "")

    def folded_to(self, width: int) -> Column:
        """With all text folded at a width."""
        heading, *cells = ("\n".join(wrap(text, width)) for text in (self.heading, *self.cells))
        return replace(self, heading=heading, cells=tuple(cells))


def cell_width(text: str) -> int:
    """Columns of a terminal that a text takes: two for each character of Chinese, Japanese and Korean."""
    from rich.cells import cell_len  # rich is imported only to draw something

    return cell_len(text)


def table_lines(columns: Sequence[Column]) -> list[str]:
    """The lines of a table, headings first.

    Examples
    --------
    >>> table_lines([Column("mass kg", False, ("4", "5.5")), Column("source", True, ("a", "b.csv"))])
    ['mass kg  source', '      4  a', '    5.5  b.csv']
    """
    widths = [column.width for column in columns]
    headings = [column.heading.split("\n") for column in columns]
    rows = [[cell.split("\n") for cell in row] for row in zip(*(column.cells for column in columns), strict=True)]
    deepest = max(map(len, headings))
    blocks = [[[""] * (deepest - len(heading)) + heading for heading in headings], *rows]
    lines = []
    for block in blocks:
        for number in range(max(map(len, block))):
            parts = [cell[number] if number < len(cell) else "" for cell in block]
            lines.append(_GAP.join(map(_padded, parts, columns, widths)).rstrip())
    return lines


def narrow_table_lines(columns: Sequence[Column], width: int) -> list[str]:
    """The lines of a table folded into several, one below the other, none wider than `width` if its cells allow that.

    Each begins with the first column that is aligned to the left, or the first of all.

    Examples
    --------
    >>> columns = [Column("spring", True, ("mount",)), Column("mass kg", False, ("4",))]
    >>> narrow_table_lines([*columns, Column("sag mm", False, ("12",))], 12)
    ['spri  mass', 'ng      kg', 'moun     4', 't', '', 'spri  sag', 'ng     mm', 'moun   12', 't']
    """
    label = next((column for column in columns if column.is_left), columns[0])
    title = label.folded_to(max(1, width // 3))
    bands: list[list[Column]] = []
    for column in (column.folded() for column in columns if column is not label):
        if not bands or sum(one.width + len(_GAP) for one in (*bands[-1], column)) - len(_GAP) > width:
            bands.append([title])
        bands[-1].append(column)
    return _separated(map(table_lines, bands))


def _separated(tables: Iterable[list[str]]) -> list[str]:
    """The lines of tables with an empty one between two."""
    return [line for table in tables for line in ("", *table)][1:]


def _padded(text: str, column: Column, width: int) -> str:
    space = " " * (width - cell_width(text))
    return text + space if column.is_left else space + text
