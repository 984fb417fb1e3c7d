"""What a page or document consists of, apart from its form: sections of text, tables and figures, all plain text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

from .chart import Chart

MOST_ROWS = 400  # of a table


class Level(Enum):
    """How a notice is meant; the value names its colour."""

    GOOD = "good"
    INFORMATION = "information"
    CARE = "care"
    POOR = "poor"


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Notice:
    """A highlighted finding, with what to do."""

    level: Level
    text: str
    advice: str = ""


@dataclass(frozen=True)
class Tile:
    """One figure that is to be seen first."""

    label: str
    value: str
    unit: str
    note: str


@dataclass(frozen=True)
class Tiles:
    """Figures that are to be seen first."""

    tiles: tuple[Tile, ...]


@dataclass(frozen=True)
class PageTable:
    """A table; its first column names a row.

    Parameters
    ----------
    title : str                 Says what it shows, for those who do not see it too.
    header : tuple of str
    rows : tuple of tuples of str
    strong : tuple of int       Rows that begin a group.
    compact : bool              Stays a table on a phone; else each row becomes a small list there.
    levels : tuple of Level     Of each row, as sign and colour of its second cell; empty for none.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    strong: tuple[int, ...] = ()
    compact: bool = False
    levels: tuple[Level, ...] = ()


def first_rows(title: str, header: Sequence[str], rows: Sequence[tuple[str, ...]]) -> Iterator[PageTable | Text]:
    """A table of the first rows, and how many there are besides; nothing without rows."""
    if rows:
        yield PageTable(title, tuple(header), tuple(rows[:MOST_ROWS]))
    if len(rows) > MOST_ROWS:
        yield Text(f"{len(rows) - MOST_ROWS} more rows are left out here.")


@dataclass(frozen=True)
class Facts:
    """Labels with texts; an empty text leaves a line to write on."""

    pairs: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Signatures:
    """Lines for signatures."""

    roles: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Gallery:
    """Figures."""

    figures: tuple[Chart, ...]

    @property
    def columns(self) -> int:
        """Figures side by side, where there is room."""
        return 3 if len(self.figures) == 3 and not any(figure.wide for figure in self.figures) else 2


Block = Text | Notice | Tiles | PageTable | Facts | Signatures | Gallery


@dataclass(frozen=True, eq=False)
class Section:
    """A heading with what belongs to it; on a page folded sections are opened by their heading."""

    key: str
    title: str
    blocks: tuple[Block, ...]
    folded: bool = False


@dataclass(frozen=True, eq=False)
class PageContent:
    """A page or document.

    Parameters
    ----------
    title, subtitle : str
    sections : tuple of Section
    records : dict            Names of the records in the figures by their places, to choose from.
    footer : str
    noun : str                What a record is called where one is chosen.
    first : int or None       Place of the record that is shown first; None for the first of each figure.
    panels : int              So many records are shown in a document by a figure of one record at a time.
    """

    title: str
    subtitle: str
    sections: tuple[Section, ...]
    records: dict[int, str]
    footer: str
    noun: str = "Record"
    first: int | None = None
    panels: int = 3

    @property
    def figures(self) -> tuple[Chart, ...]:
        """All figures in their order."""
        return tuple(
            figure
            for section in self.sections
            for block in section.blocks
            if isinstance(block, Gallery)
            for figure in block.figures
        )
