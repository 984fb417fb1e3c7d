"""Axes for the plots of results, and files of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..files import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
# Without these a file holds a date.
_UNDATED = {".png": None, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


def some_axes(axes: Axes | Sequence[Axes] | None, rows: int, columns: int, size: tuple[float, float]) -> list[Axes]:
    """The axes that are given, or those of a new figure of pyplot, which notebooks show.

    Raises
    ------
    ValueError   If the number of axes given is another.
    """
    if axes is None:
        from matplotlib import pyplot as plt

        figure = plt.figure(figsize=size, layout="constrained")
        return list(figure.subplots(rows, columns, squeeze=False).flat)
    given = list(axes.flat) if hasattr(axes, "flat") else list(axes) if isinstance(axes, Sequence) else [axes]
    if len(given) != rows * columns:
        raise ValueError(f"`axes` must be {rows * columns}, got {len(given)}.")
    return given


def new_figure(size: tuple[float, float]) -> Figure:
    """A figure for a file, which needs no pyplot."""
    from matplotlib.figure import Figure

    return Figure(figsize=size, layout="constrained")


def save_figure(path: Path, figure: Figure) -> None:
    """Write a figure; the format is that of the path's ending, and the same figure gives the same bytes."""
    import matplotlib as mpl

    suffix = path.suffix.lower()
    # Without the salt the names in an SVG are random.
    with mpl.rc_context({"svg.hashsalt": "strandspring"}), replacing(path) as part:
        figure.savefig(part, format=suffix[1:], dpi=120, metadata=_UNDATED[suffix])
