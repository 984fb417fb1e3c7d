"""What the results of all functions have in common: they say what they hold, in a terminal and in a notebook."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import StrandspringError
from ...ground.plotfile import SUFFIXES, save_figure, some_axes
from ...records.bad_rows import UNREADABLE
from ...records.columns import ASSUMED
from .text import counted

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_REPR_LINES = 6


class Result(ABC):
    """A result in words and as a table; some have `cautions` and `notes`, which are sentences."""

    @abstractmethod
    def text_lines(self, width: int | None = None) -> list[str]:
        """The result in words, without cautions and notes; tables of at most a width."""

    def brief(self, width: int | None = None) -> list[str]:
        """What everybody has to know of it, as the command line prints it without --verbose."""
        return self.text_lines(width)

    @abstractmethod
    def to_frame(self) -> pd.DataFrame:
        """The figures as a table."""

    def summary(self) -> str:
        """The result in words, with cautions, notes, units that were assumed, and lines of files that were left out."""
        cautions = (f"Caution: {s}" for s in (*self._notes_with(UNREADABLE), *getattr(self, "cautions", ())))
        notes = (f"Note: {s}" for s in (*getattr(self, "notes", ()), *self._notes_with(ASSUMED)))
        return "\n".join([*self.text_lines(), *cautions, *notes])

    def _notes_with(self, words: str) -> list[str]:
        """Notes on its records, if it has any, that hold these words."""
        records = (getattr(entry, "record", entry) for entry in getattr(self, "records", ()))
        return [f"{record.path}: {note}" for record in records for note in record.notes if words in note]

    def __repr__(self) -> str:
        lines = self.summary().splitlines()
        more = len(lines) - _REPR_LINES
        return "\n".join([*lines[:_REPR_LINES], *([f"({counted(more, 'more line')}: .summary())"] if more > 0 else [])])

    def _overview(self) -> pd.DataFrame:
        """The table that notebooks show."""
        return self.to_frame()

    def _repr_html_(self) -> str:
        heading = escape(self.summary().splitlines()[0])
        return f"<p><strong>{heading}</strong></p>{self._overview().to_html(escape=True)}"


class PlottedResult(Result):
    """A result with a plot."""

    _grid = (1, 1)  # rows and columns of axes

    @property
    @abstractmethod
    def _size(self) -> tuple[float, float]:
        """Width and height of the plot [inches]."""

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
