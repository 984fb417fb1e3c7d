"""What the results of all functions have in common: they say what they hold, in a terminal and in a notebook."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import Reader, StrandspringError
from ...findings import CAUTIONS, NOTES, Finding, Severity, gathered, of_severity
from ...ground.plotfile import SUFFIXES, save_figure, some_axes
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
        """The result in words, with cautions and notes on it and on how its records were read."""
        records = (getattr(entry, "record", entry) for entry in getattr(self, "records", ()))
        found = [finding for record in records for finding in record.found]
        cautions = (f"Caution: {sentence}" for sentence in getattr(self, "cautions", ()))
        notes = (f"Note: {sentence}" for sentence in getattr(self, "notes", ()))
        remarks = dict.fromkeys((*cautions, *notes, *said(found, Reader.PYTHON)))
        return "\n".join([*self.text_lines(), *remarks])

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


def said(findings: Iterable[Finding], reader: Reader, brief: bool = False) -> list[str]:
    """Cautions and notes in words for a reader, each with what it is."""
    found = tuple(findings)
    titles = {"Caution": CAUTIONS, "Note": NOTES}.items()
    return [f"{title}: {text}" for title, of in titles for text in gathered(of_severity(found, of), reader, brief)]


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


class ResultWithFindings(PlottedResult):
    """A result with `findings`, of which its cautions and notes are made."""

    @property
    def all_findings(self) -> tuple[Finding, ...]:
        """The findings, and what is beside them."""
        return tuple(getattr(self, "findings", ()))

    @property
    def cautions(self) -> tuple[str, ...]:
        """What limits the worth of the result, in words."""
        return self.sentences(CAUTIONS, Reader.PYTHON)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is good to know, in words."""
        return self.sentences(NOTES, Reader.PYTHON)

    @property
    def findings_json(self) -> dict[str, tuple[str, ...]]:
        """Cautions and notes as they are in JSON."""
        return {"cautions": self.sentences(CAUTIONS, Reader.FILE), "notes": self.sentences(NOTES, Reader.FILE)}

    def sentences(self, severities: Collection[Severity], reader: Reader, brief: bool = False) -> tuple[str, ...]:
        """Findings of some severities in words for a reader, without details if they are to be brief."""
        return tuple(gathered(of_severity(self.all_findings, severities), reader, brief))

    def remarks(self, reader: Reader, brief: bool = False) -> list[str]:
        """Cautions and notes in words for a reader, each with what it is."""
        return said(self.all_findings, reader, brief)
