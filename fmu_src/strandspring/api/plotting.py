"""Axes for the plots of results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes


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
