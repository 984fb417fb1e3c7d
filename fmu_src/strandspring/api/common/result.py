"""What the results of all functions have in common: they say what they hold, in a terminal and in a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from html import escape
from typing import TYPE_CHECKING

from .text import counted

if TYPE_CHECKING:
    import pandas as pd

_REPR_LINES = 6


class Result(ABC):
    """A result in words and as a table; some have `cautions` and `notes`, which are sentences."""

    @abstractmethod
    def lines(self, width: int | None = None) -> list[str]:
        """The result in words, without cautions and notes, as the command line prints it; tables of at most a width."""

    @abstractmethod
    def to_frame(self) -> pd.DataFrame:
        """The figures as a table."""

    def summary(self) -> str:
        """The result in words, with cautions and notes."""
        cautions = (f"Caution: {sentence}" for sentence in getattr(self, "cautions", ()))
        notes = (f"Note: {sentence}" for sentence in getattr(self, "notes", ()))
        return "\n".join([*self.lines(), *cautions, *notes])

    def __repr__(self) -> str:
        lines = self.summary().splitlines()
        more = len(lines) - _REPR_LINES
        return "\n".join([*lines[:_REPR_LINES], *([f"({counted(more, 'more line')}: .summary())"] if more > 0 else [])])

    def _repr_html_(self) -> str:
        heading = escape(self.summary().splitlines()[0])
        return f"<p><strong>{heading}</strong></p>{self.to_frame().to_html(escape=True)}"
