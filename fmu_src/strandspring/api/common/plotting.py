"""Axes and files for the plots of results."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import StrandspringError
from ...ground.plotfile import SUFFIXES, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


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


def save_plot(path: str | os.PathLike[str], size: tuple[float, float], fill: Callable[[Figure], Any]) -> None:
    """Write a plot into a file.

    Parameters
    ----------
    path : path-like            Ending in .png, .svg or .pdf.
    size : (float, float)       Width and height [in].
    fill : callable             Draws into the empty figure.

    Raises
    ------
    StrandspringError           If the name ends in something else, or the file cannot be written.
    """
    if Path(path).suffix.lower() not in SUFFIXES:
        raise StrandspringError(f"The plot's name must end in {', '.join(SUFFIXES)}, got {os.fspath(path)!r}.")
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    fill(figure)
    save_figure(Path(path), figure)
