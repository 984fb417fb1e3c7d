"""What the results of all functions have in common: one way each into words, JSON, tables, notebooks and files.

The columns of tables are declared once, and text, frame, JSON and CSV are made of them here.
"""

from __future__ import annotations

import math
import os
from abc import abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from html import escape
from itertools import takewhile, zip_longest
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, ClassVar
from unicodedata import combining, east_asian_width

from ...errors import Reader, StrandspringError
from ...findings import CAUTIONS, NOTES, Severity, gathered, of_severity
from ...ground.files import write_csv
from ...ground.plotfile import SUFFIXES, save_figure, some_axes
from ...ground.result_columns import ResultColumn, value
from ...ground.result_columns import texts as texts_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_REPR_LINES = 6
_GAP = "  "  # before each column
_LEAST = 10  # to which text is folded beside other columns


@dataclass(frozen=True, eq=False)
class Table:
    """Rows with declared columns.

    Parameters
    ----------
    columns : sequence of ResultColumn   In files only without `short`, in text only without `words`.
    rows : sequence                      Mappings by the columns' keys, or objects with such attributes, in SI units.
    title : str                          A line before the table, in text.
    details : collection of str          Keys of the columns that brief text leaves out.
    varied : collection of str or None   Keys of the columns that brief text has in the table, not before it, though
                                         all rows hold the same; None for all.
    """

    columns: Sequence[ResultColumn]
    rows: Sequence[Any]
    title: str = ""
    details: Collection[str] = ()
    varied: Collection[str] | None = None

    def lines(self, width: int | None = None, brief: bool = False) -> list[str]:
        """The table as text, folded to a width; nothing without rows or columns for people."""
        shown = [column for column in self.columns if not (brief and column.key in self.details)]
        texts = texts_of(shown, self.rows)
        if not texts:
            return []
        lines = [self.title] if self.title else []
        if brief and self.varied is not None and len(self.rows) > 1:
            same = [column for column, of in texts.items() if column.key not in self.varied and len({*of}) == 1]
            shared = [f"{column.short} {texts.pop(column)[0]} {column.shown}".strip() for column in same]
            lines += [f"Throughout: {', '.join(shared)}"] if shared else []
        # Texts of numbers have a unit.
        left = {c.heading for c in texts if not c.unit and any(isinstance(value(row, c.key), str) for row in self.rows)}
        headings = [column.heading for column in texts]
        return [*lines, *table_lines(headings, zip(*texts.values(), strict=True), left, width)]

    @property
    def _in_files(self) -> list[ResultColumn]:
        return [column for column in self.columns if column.words]

    def as_json(self) -> list[dict[str, Any]]:
        """The rows as objects for JSON, in SI units."""
        return [{column.key: value(row, column.key) for column in self._in_files} for row in self.rows]

    def frame(self) -> pd.DataFrame:
        """The rows in SI units."""
        import pandas as pd

        rows = self.as_json()
        frame = pd.DataFrame(rows, columns=[column.key for column in self._in_files])
        texts = {key for row in rows for key, value in row.items() if isinstance(value, str)}
        # A column of which nothing is known is one of numbers.
        return frame.astype({key: float for key in frame if frame[key].dtype == object and key not in texts})

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the rows in SI units; raises StrandspringError if the file cannot be written."""
        headings = [column.file_heading for column in self._in_files]
        write_csv(Path(path), headings, (list(row.values()) for row in self.as_json()))


class Result:
    """A result that presents itself.

    A class says what it holds in `parts` and `content`, and has `findings`; all renderings are made of these.
    """

    # The findings of some severities that JSON holds, by their keys.
    _stated: ClassVar[Mapping[str, Collection[Severity]]] = {"cautions": CAUTIONS, "notes": NOTES}

    def parts(self, brief: bool) -> Iterable[str | Table]:  # noqa: ARG002 - of classes that have parts
        """Lines and tables in their order; if brief, what everybody has to know. The first table is that of `to_frame`
        and `save_csv`.
        """
        return ()

    def content(self) -> Mapping[str, Any]:
        """What JSON holds besides findings: anything that `in_json` takes, in SI units."""
        return {}

    def text_lines(self, width: int | None = None, brief: bool = False) -> list[str]:
        """The result in words, without cautions and notes; if brief, what everybody has to know."""
        parts = self.parts(brief)
        return [line for part in parts for line in (part.lines(width, brief) if isinstance(part, Table) else [part])]

    def summary(self) -> str:
        """The result in words, with cautions and notes on it and on how its records were read."""
        of_records = [finding for record in getattr(self, "records", ()) for finding in record.found]
        remarks = dict.fromkeys(
            f"{title}: {text}"
            for title, of in {"Caution": CAUTIONS, "Note": NOTES}.items()
            for text in (*self.sentences(of, Reader.PYTHON), *gathered(of_severity(of_records, of), Reader.PYTHON))
        )
        return "\n".join([*self.text_lines(), *remarks])

    def as_json(self) -> dict[str, Any]:
        """The result as an object for JSON, in SI units."""
        severities = self._stated if hasattr(self, "findings") else {}
        stated = {key: self.sentences(of, Reader.FILE) for key, of in severities.items()}
        content: dict[str, Any] = in_json({**self.content(), **stated})
        return content

    @property
    def table(self) -> Table:
        """The first of its tables."""
        return next(part for part in self.parts(brief=False) if isinstance(part, Table))

    def to_frame(self) -> pd.DataFrame:
        """The first of its tables in SI units."""
        return self.table.frame()

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the first of its tables; raises StrandspringError if the file cannot be written."""
        self.table.save_csv(path)

    @property
    def cautions(self) -> tuple[str, ...]:
        """What limits the worth of the result, in words."""
        return self.sentences(CAUTIONS, Reader.PYTHON)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is good to know, in words."""
        return self.sentences(NOTES, Reader.PYTHON)

    def sentences(self, severities: Collection[Severity], reader: Reader, brief: bool = False) -> tuple[str, ...]:
        """Findings of some severities in words for a reader, without details if they are to be brief."""
        found = (*getattr(self, "findings", ()), *getattr(self, "record_findings", ()))
        return tuple(gathered(of_severity(found, severities), reader, brief))

    def __repr__(self) -> str:
        lines = self.summary().splitlines()
        if more := len(lines[_REPR_LINES:]):
            lines[_REPR_LINES:] = [f"({more} more line{'s' * (more > 1)}: .summary())"]
        return "\n".join(lines)

    def _overview(self) -> pd.DataFrame:
        """The table that notebooks show."""
        return self.to_frame()

    def _repr_html_(self) -> str:
        head = takewhile(lambda part: isinstance(part, str), self.parts(brief=True))
        text = "\n".join(map(str, head)) or self.summary().splitlines()[0]
        return f"<pre>{escape(text)}</pre>{self._overview().to_html(escape=True)}"


class PlottedResult(Result):
    """A result with a plot."""

    _grid = (1, 1)  # rows and columns of axes
    _size = (6.4, 4.8)  # width and height of the plot [inches]

    @abstractmethod
    def plot(self, ax: Any = None) -> Any:
        """Draw the plot into axes of matplotlib, those of a new figure if None, and return them."""

    def _axes(self, ax: Axes | Sequence[Axes] | None) -> list[Axes]:
        """The axes that are given, or those of a new figure."""
        return some_axes(ax, *self._grid, self._size)

    def _draw(self, figure: Figure) -> None:
        """Draw the plot into an empty figure."""
        self.plot(figure.subplots(*self._grid))

    def save_plot(self, path: str | os.PathLike[str]) -> None:
        """Draw the plot into a file (.png, .svg or .pdf); the same result gives the same bytes.

        Raises
        ------
        StrandspringError   If the name ends in something else, or the file cannot be written.
        """
        if Path(path).suffix.lower() not in SUFFIXES:
            raise StrandspringError(f"The plot's name must end in {', '.join(SUFFIXES)}, got {os.fspath(path)!r}.")
        from matplotlib.figure import Figure

        figure = Figure(figsize=self._size, layout="constrained")
        self._draw(figure)
        save_figure(Path(path), figure)


def in_json(value: Any) -> Any:
    """What JSON can hold of a value, with null for NaN and infinity.

    Examples
    --------
    >>> import numpy as np
    >>> in_json({"force": np.array([1.0, np.nan]), "path": Path("a.csv")})
    {'force': [1.0, None], 'path': 'a.csv'}
    """
    if isinstance(value, Table):
        return in_json(value.as_json())
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: in_json(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {key: in_json(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [in_json(part) for part in value]
    if isinstance(value, Enum):
        return in_json(value.value)
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):  # of NumPy
        return in_json(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


def records(key: str, names: Iterable[str], **columns: Iterable[Any]) -> list[dict[str, Any]]:
    """What JSON holds of things by their names, with an item of each column for each thing."""
    rows = zip(names, *columns.values(), strict=True)
    return [dict(zip((key, *columns), row, strict=True)) for row in rows]


def picked(of: Any, *names: str) -> dict[str, Any]:
    """Attributes of an object by their names."""
    return {name: getattr(of, name) for name in names}


def table_lines(
    headings: Sequence[str], rows: Iterable[Sequence[str]], left: Collection[str] = (), width: int | None = None
) -> list[str]:
    """A table with the columns `left` aligned to the left and all others to the right.

    Of a table wider than `width`, headings and the widest text are folded. If that does not do, it becomes several, one
    below the other, each with its first column of text, or its first, numbered where it says the same twice.

    Examples
    --------
    >>> table_lines(["name", "N"], [["kappa_omega", "25"], ["rho", "7"]], left=["name"])
    ['  name          N', '  kappa_omega  25', '  rho           7']
    >>> table_lines(["spring", "mass kg", "sag mm"], [["mount", "4", "12"]], left=["spring"], width=14)
    ['  spri  mass', '  ng      kg', '  moun     4', '  t', '', '  spri  sag', '  ng     mm', '  moun   12', '  t']
    """
    columns = [[text.split("\n") for text in column] for column in zip(headings, *rows, strict=True)]
    is_left = [heading in left for heading in headings]
    if width is None or _width_of(columns) <= width:
        return _lines(columns, is_left)
    # Headings are folded to the width of the cells, or of their longest word.
    folded = [
        [wrap(heading, max(1, *map(_width, heading.split()), _width_of([cells]) - len(_GAP))), *cells]
        for heading, (_, *cells) in zip(headings, columns, strict=True)
    ]
    texts = [k for k, at_left in enumerate(is_left) if at_left]
    if texts:
        widest = max(texts, key=lambda k: _width_of([columns[k]]))
        spare = width - _width_of([column for k, column in enumerate(folded) if k != widest]) - len(_GAP)
        if spare >= min(_width_of([columns[widest]]) - len(_GAP), _LEAST):
            folded[widest] = [wrap(" ".join(cell), spare) or [""] for cell in columns[widest]]
            return _lines(folded, is_left)
    label = texts[0] if texts else 0
    heading, *names = map(" ".join, columns[label])
    if len({*names}) < len(names):
        names = [f"{k} {name}" for k, name in enumerate(names, 1)]
    title = [wrap(text, max(1, width // 3)) or [""] for text in (heading, *names)]
    bands: list[list[int]] = []
    for k in (k for k in range(len(columns)) if k != label):
        if not bands or _width_of([title, *(folded[j] for j in (*bands[-1], k))]) > width:
            bands.append([])
        bands[-1].append(k)
    tables = (_lines([title, *(folded[k] for k in band)], [is_left[k] for k in (label, *band)]) for band in bands)
    return [line for table in tables for line in ("", *table)][1:]


def _width_of(columns: Iterable[Sequence[Sequence[str]]]) -> int:
    """Of columns, each after a gap; a column is its heading and its cells, each with its lines."""
    return sum(len(_GAP) + max((_width(line) for cell in of for line in cell), default=0) for of in columns)


def _lines(columns: Sequence[Sequence[list[str]]], is_left: Sequence[bool]) -> list[str]:
    """The lines of a table, whose headings stand at the bottom and whose cells at the top of their row."""
    deepest = max(len(heading) for heading, *_ in columns)
    deep = ([[""] * (deepest - len(heading)) + heading, *cells] for heading, *cells in columns)
    widths = [_width_of([column]) - len(_GAP) for column in columns]
    lines = []
    for row in zip(*deep, strict=True):
        for texts in zip_longest(*row, fillvalue=""):
            line = ""
            for text, width, at_left in zip(texts, widths, is_left, strict=True):
                space = " " * (width - _width(text))
                line += _GAP + (text + space if at_left else space + text)
            lines.append(line.rstrip())
    return lines


def _width(text: str) -> int:
    """Columns of a terminal that a text takes: two for each character of Chinese, Japanese and Korean."""
    return sum(1 + (east_asian_width(c) in "WF") - bool(combining(c)) for c in text)
