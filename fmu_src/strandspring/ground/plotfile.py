"""Files of plots: the same figure gives the same bytes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from .files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
# Without these a file holds a date.
_UNDATED = {".png": None, ".svg": {"Date": None}, ".pdf": {"CreationDate": None}}


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
