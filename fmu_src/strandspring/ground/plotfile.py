"""Axes of plots, and their files: the same figure gives the same bytes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from .files import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
# Without these a file holds a date.
_UNDATED = {".png": None, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


def some_axes(
    ax: Axes | Sequence[Axes] | None, rows: int = 1, columns: int = 1, size: tuple[float, float] = (6.4, 4.8)
) -> list[Axes]:
    """The axes that are given, or those of a new figure of pyplot of a size [inches], which notebooks show.

    Raises
    ------
    ValueError   If the number of axes given is another.
    """
    if ax is None:
        from matplotlib import pyplot as plt

        figure = plt.figure(figsize=size, layout="constrained")
        return list(figure.subplots(rows, columns, squeeze=False).flat)
    given = list(ax.flat) if hasattr(ax, "flat") else list(ax) if isinstance(ax, Sequence) else [ax]
    if len(given) != rows * columns:
        raise ValueError(f"`ax` must be {rows * columns} axes of matplotlib, got {len(given)}.")
    return given


def save_figure(path: Path, figure: Figure, dpi: int = 120) -> None:
    """Write a figure of matplotlib.

    Parameters
    ----------
    path : Path   Ending in one of `SUFFIXES`, which says the format.
    figure : Figure
    dpi : int     Dots per inch of what is not drawn by lines.

    Raises
    ------
    StrandspringError   If the file cannot be written.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from matplotlib.figure import Figure
    >>> with TemporaryDirectory() as folder:
    ...     save_figure(Path(folder) / "empty.svg", Figure())
    ...     [path.name for path in Path(folder).iterdir()]
    ['empty.svg']
    """
    import matplotlib as mpl

    suffix = path.suffix.lower()
    # Without the salt the names in an SVG are random.
    with mpl.rc_context({"svg.hashsalt": "strandspring"}), replacing(path) as part:
        figure.savefig(part, format=suffix[1:], dpi=dpi, metadata=_UNDATED[suffix])
