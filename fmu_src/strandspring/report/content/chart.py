"""Charts as data, drawn by matplotlib (`drawing`) on paper and on pages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from ...kernel.arrays import FloatArray, IndexArray
from .quantities import DisplayUnit


class Role(Enum):
    """What a trace stands for, the same in all charts; the value is the name of its colour, see `palette`.

    What the model extrapolates is dashed.
    """

    MEASURED = "measured"
    MODEL = "model"
    PREDICTION = "prediction"
    LEFT_OUT = "faint"
    FIRST = "blue"
    SECOND = "green"
    THIRD = "purple"
    REFERENCE = "muted"
    LIMIT = "poor"
    LOAD = "care"


class ChartForm(Enum):
    """How a trace is drawn."""

    LINE = "line"
    DASHED = "dash"
    DOTTED = "dot"
    DOTS = "dots"  # one for each sample
    MARKS = "marks"  # few and large, with error bars if there are errors
    CROSSES = "crosses"  # likewise, of what is not as it should be
    RANGES = "ranges"  # from `low` to `y` at each place
    MARKED_LINE = "marked line"
    BARS = "bars"  # from `low` or 0 to `y`
    BAND = "band"  # between `low` and `y`
    CELLS = "cells"  # squares about the points, each as opaque as `low`


@dataclass(frozen=True)
class Axis:
    """An axis.

    Parameters
    ----------
    text : str                What it shows.
    unit : DisplayUnit
    log : bool
    limits : (float or None, float or None)   Ends in display units; None where the data decide.
    whole : bool              Whether it counts, so that ticks are whole numbers.
    names : tuple of str      Of what stands at 1, 2 and so on, in place of numbers.
    """

    text: str
    unit: DisplayUnit
    log: bool = False
    limits: tuple[float | None, float | None] = (None, None)
    whole: bool = False
    names: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """What it shows, with the unit if it has one."""
        return f"{self.text} [{self.unit.name}]" if self.unit.name else self.text


@dataclass(frozen=True, eq=False)
class Trace:
    """One line, cloud or band, in display units.

    Parameters
    ----------
    name : str                            For the legend; traces of one name share an entry.
    x, y : ndarray, shape (P,)            NaN interrupts a line.
    role : Role
    form : ChartForm
    low : ndarray, shape (P,), or None    Lower edge of a band, lower ends of bars and ranges, or opacity of cells.
    error : ndarray, shape (P,), or None  Half-length of error bars.
    record : int or None                  Place of the record that it belongs to; None for all.
    cycles : tuple of (label, start, stop)   Which points belong to a cycle, where cycles can be chosen.
    texts : tuple of str                  What each point is, where it has a name: beside the points where there is
                                          room, see `labels`; and on a page under the pointer.
    width : float or None                 Of bars; None if they touch each other.
    whole : int or None                   So many points draw the whole line, and those after them its cycles in detail;
                                          None if all points draw the line.
    """

    name: str
    x: FloatArray
    y: FloatArray
    role: Role
    form: ChartForm = ChartForm.LINE
    low: FloatArray | None = None
    error: FloatArray | None = None
    record: int | None = None
    cycles: tuple[tuple[str, int, int], ...] = ()
    whole: int | None = None
    texts: tuple[str, ...] = ()
    width: float | None = None

    @property
    def labelled(self) -> bool:
        """Whether its texts stand beside its points."""
        return bool(self.texts) and self.form not in (ChartForm.BARS, ChartForm.CELLS)

    @property
    def bar_width(self) -> float:
        """Of each of its bars."""
        return float(self.x[1] - self.x[0]) if self.width is None else self.width

    @property
    def shown(self) -> int:
        """Number of points that are drawn while no cycle is chosen."""
        return self.x.size if self.whole is None else self.whole


@dataclass(frozen=True, eq=False)
class Chart:
    """A chart with one pair of axes.

    Parameters
    ----------
    key : str             Identifier, unique on a page.
    title : str
    x, y : Axis
    traces : tuple of Trace
    sentence : str        What it shows, in words and numbers; the alternative text too.
    wide : bool           Whether it takes the whole width of the page.
    single : bool         Whether it shows one record at a time.
    is_drawing : bool     Whether it is a drawing or a matrix, with the same scale along both axes.
    """

    key: str
    title: str
    x: Axis
    y: Axis
    traces: tuple[Trace, ...]
    sentence: str
    wide: bool = False
    single: bool = False
    is_drawing: bool = False


def joined(pieces: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray, list[tuple[int, int]]]:
    """Several lines as one that is interrupted between them, and where each lies."""
    if not pieces:
        return np.empty(0), np.empty(0), []
    gap = np.array([np.nan])
    x = np.concatenate([part for values, _ in pieces for part in (values, gap)])[:-1]
    y = np.concatenate([part for _, values in pieces for part in (values, gap)])[:-1]
    ends = np.cumsum([values.size + 1 for values, _ in pieces]).tolist()
    return x, y, [(end - 1 - values.size, end - 1) for end, (values, _) in zip(ends, pieces, strict=True)]


def evenly(count: int, most: int) -> list[int]:
    """Places of at most so many of `count` things, evenly chosen, with both ends."""
    return sorted({round(place) for place in np.linspace(0, count - 1, min(count, most)).tolist()})


def visible(values: FloatArray, most: int) -> IndexArray:
    """Places of at most about `most` samples that draw the same line: the least and greatest of each short piece.

    Parameters
    ----------
    values : ndarray, shape (K,)
    most : int                     At least 4.

    Returns
    -------
    ndarray of int, ascending, with both ends.

    Examples
    --------
    >>> import numpy as np
    >>> visible(np.array([0.0, 0, 0, 9, 0, 0, 0, 0, 0, -5, 0, 0]), 6).tolist()
    [0, 3, 6, 9, 11]
    """
    size = values.size
    if size <= most:
        return np.arange(size)
    pieces = max(1, (most - 2) // 2)
    length = -(-size // pieces)
    padded = np.concatenate([values, np.full(-size % length, values[-1])]).reshape(-1, length)
    begin = np.arange(padded.shape[0]) * length
    chosen = np.concatenate([begin + padded.argmin(axis=1), begin + padded.argmax(axis=1), [0, size - 1]])
    return np.unique(np.minimum(chosen, size - 1))
