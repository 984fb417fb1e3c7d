"""What the results of all functions have in common: one way each into words, JSON, tables, notebooks and files."""

from __future__ import annotations

import math
import os
from abc import abstractmethod
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from html import escape
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from ...errors import Reader, StrandspringError
from ...findings import CAUTIONS, NOTES, Severity, gathered, of_severity
from ...ground.plotfile import SUFFIXES, save_figure, some_axes
from .table import Table
from .text import counted

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_REPR_LINES = 6


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
        """The result in words, without cautions and notes; if brief, what everybody has to know, as the command line
        prints it without --verbose. Tables have at most a width.
        """
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
        stated = {key: self.sentences(severities, Reader.FILE) for key, severities in self._stated.items()}
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
        more = len(lines) - _REPR_LINES
        return "\n".join([*lines[:_REPR_LINES], *([f"({counted(more, 'more line')}: .summary())"] if more > 0 else [])])

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
    """What JSON can hold of a value: fields of dataclasses, rows of tables, items of arrays, values of members, text of
    paths, and null for NaN and infinity.

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
