"""Charts drawn by matplotlib: into given axes, or as a figure of a given width on paper; `panels` draws for pages."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import font_manager, rcParams
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize, to_rgba
from matplotlib.figure import Figure as Paper
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator
from matplotlib.transforms import ScaledTranslation

from ..content.chart import Chart, ChartForm, Figure, HeatMap, Role, Trace
from ..content.labels import PLACES, label_places
from ..content.quantities import number
from .palette import LIGHT

MM = 1.0 / 25.4  # in inches
STYLE: Any = {
    # The font that comes with matplotlib: the same bytes on every computer.
    "font.family": "DejaVu Sans",
    "font.size": 7.0,
    "axes.labelsize": 7.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": LIGHT["muted"],
    "axes.labelcolor": LIGHT["text"],
    "axes.formatter.use_mathtext": False,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "xtick.color": LIGHT["text"],
    "ytick.color": LIGHT["text"],
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.fontsize": 6.5,
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "strandspring",
    "text.parse_math": False,
    "text.usetex": False,
}
_AXIS, _LETTER = 20.0, 1.6  # room for the axis beside a name, and of a letter in it [mm]
_STYLES = {ChartForm.LINE: "-", ChartForm.DASHED: "--", ChartForm.DOTTED: ":", ChartForm.MARKED_LINE: "-"}
_TITLE = 10.0  # room for the name of a record between panel and legend [points]
FEW = 3  # records below each other in a chart; more stand side by side
_COLUMNS, _ROWS = 2, 4
_LONGEST_TICK = 30
_MOST_DIVIDED = 10.0**2.8  # ratio of the ends of an axis with ticks between powers of ten
_CELL = 0.94  # of a heat map
_LETTER_SIZE = (0.048, 0.105)  # of a label [inches]
FIRST_ORDER = 3  # above grid and axes


def draw(figure: Figure, axes: Axes, record: int | None = None, *, scale: float = 1.0) -> Axes:
    """Draw a chart into axes.

    Parameters
    ----------
    figure : Chart or HeatMap
    axes : Axes
    record : int or None   Show this record only; all if None.
    scale : float          Of line widths.
    """
    if isinstance(figure, HeatMap):
        draw_heat_map(figure, axes)
        _colour_bar(axes)
    elif len(names := draw_chart(figure, axes, record, scale)) > 1:
        _legend(axes, names)
    return axes


def draw_chart(
    figure: Chart, axes: Axes, record: int | None, scale: float, words: Callable[[str, int], str] | None = None
) -> list[str]:
    """Draw a chart without a legend and return the names for it; artists of trace k have zorder `FIRST_ORDER` + k.

    `words` shortens the names of points and places to so many letters; `printable` if None.
    """
    words = words or printable
    axes.use_sticky_edges = False
    named: dict[str, None] = {}
    for order, trace in enumerate(figure.traces, FIRST_ORDER):
        if record is None or trace.record in (None, record):
            # matplotlib leaves labels with an underscore out of the legend.
            _trace(trace, axes, "_" if trace.name in named else trace.name, scale, order)
            if trace.name:
                named[trace.name] = None
    for axis, way in ((figure.x, "x"), (figure.y, "y")):
        text = axes.set_xlabel(axis.label) if way == "x" else axes.set_ylabel(axis.label)
        text.set_parse_math(False)
        if axis.log:
            _logarithmic(axes, way)
        if axis.limits != (None, None):
            axes.set(**{f"{way}lim": axis.limits})
    if figure.x.names:
        names = [words(name, _LONGEST_TICK) for name in figure.x.names]
        axes.set_xticks(range(1, len(names) + 1), names, rotation=90, parse_math=False)
    elif figure.x.whole:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(True, which="major", color=LIGHT["grid"], lw=0.6)
    axes.set_axisbelow(True)
    if figure.is_drawing:
        axes.set_aspect("equal", adjustable="datalim")
    _label(figure, axes, words)
    return list(named)


def paper_figure(figure: Figure, width: float, names: Mapping[int, str]) -> Paper:
    """A figure for print; a chart of one record at a time gets a panel for each of the records, at most eight.

    Panels have the name of their record, and a legend where it is not that of the first.

    Parameters
    ----------
    figure : Chart or HeatMap
    width : float             [mm]
    names : mapping           Of the records to show, by their places.
    """
    records: list[int | None] = [None]
    if isinstance(figure, Chart) and figure.single:
        records = [place for place in dict.fromkeys(trace.record for trace in figure.traces) if place in names]
    columns = _COLUMNS if len(records) > FEW else 1
    rows, panel = math.ceil(len(records) / columns), width / columns
    if isinstance(figure, HeatMap) or figure.is_drawing:
        height = width
    else:
        height = panel * (0.66 if columns > 1 else 0.34 if panel > 120.0 else 0.62 if panel > 70.0 else 0.85)
    paper = Paper(figsize=(width * MM, height * rows * MM), layout="constrained")
    panels = paper.subplots(rows, columns, squeeze=False).ravel()
    known: list[str] = []
    for axes, record in zip(panels, records, strict=False):
        draw(figure, axes, record)
        if record is None or len(records) == 1:
            continue
        name = printable(names[record], int((panel - _AXIS) / _LETTER))
        axes.set_title(name, loc="left", fontsize=6.5, parse_math=False, pad=3.0)
        if (legend := axes.get_legend()) is not None:
            labels = [text.get_text() for text in legend.get_texts()]
            if labels == known:
                legend.remove()
            known = known or labels
            above = ScaledTranslation(0.0, _TITLE / 72.0, paper.dpi_scale_trans)
            legend.set_bbox_to_anchor((-0.02, 1.0), transform=axes.transAxes + above)
    for axes in panels[len(records) :]:
        axes.set_axis_off()
    return paper


def groups_of_records(figure: Figure, most: int) -> list[list[int]]:
    """The first records of a chart of one record at a time, in groups for `paper_figure`; one empty group else."""
    if not isinstance(figure, Chart) or not figure.single:
        return [[]]
    places = [place for place in dict.fromkeys(trace.record for trace in figure.traces) if place is not None][:most]
    size = len(places) if len(places) <= FEW else _COLUMNS * _ROWS
    return [places[k : k + size] for k in range(0, len(places), max(1, size))] or [[]]


def printable(name: str, longest: int) -> str:
    """A name without characters that the font lacks, cut in the middle to so many at most (20 or more).

    Examples
    --------
    >>> printable("measurement_of_a_long_day_3.csv", 20)
    'measurement…ay_3.csv'
    """
    return shortened("".join(c if ord(c) in _characters() else "\N{REPLACEMENT CHARACTER}" for c in name), longest)


def shortened(name: str, longest: int) -> str:
    """A name cut in the middle to so many letters at most (20 or more)."""
    return name if len(name) <= longest else f"{name[: longest - 9]}…{name[-8:]}"


@functools.cache
def _characters() -> frozenset[int]:
    path = font_manager.findfont("DejaVu Sans")
    return frozenset(font_manager.get_font(path).get_charmap())


def _trace(trace: Trace, axes: Axes, label: str, scale: float, order: float) -> None:
    colour = LIGHT[trace.role.value]
    style: dict[str, Any] = {"color": colour, "label": label, "zorder": order}
    match trace.form:
        case ChartForm.BAND:
            low = trace.y if trace.low is None else trace.low
            axes.fill_between(trace.x, low, trace.y, alpha=0.18, lw=0.0, **style)
        case ChartForm.BARS:
            low = np.zeros_like(trace.y) if trace.low is None else trace.low
            axes.bar(trace.x, trace.y - low, bottom=low, width=trace.bar_width, alpha=0.55, **style)
        case ChartForm.RANGES:
            low = trace.y if trace.low is None else trace.low
            half = 0.5 * (trace.y - low)
            axes.errorbar(
                trace.x, low + half, yerr=half, ls="none", capsize=2.5 * scale, elinewidth=1.2 * scale, **style
            )
        case ChartForm.DOTS:
            # Thousands of dots are no picture for vectors.
            axes.plot(
                trace.x, trace.y, ls="none", marker=".", ms=2.8 * scale, mew=0.0, alpha=0.8, rasterized=True, **style
            )
        case ChartForm.MARKS:
            axes.errorbar(
                trace.x, trace.y, yerr=trace.error, ls="none", marker="o", ms=4.0 * scale, capsize=2.5 * scale,
                elinewidth=0.9 * scale, **style,
            )  # fmt: skip
        case _:
            # Measured lines are seen on both sides of the model's.
            width = 1.2 if trace.form is ChartForm.LINE and trace.role is Role.MEASURED else 0.75
            marks: dict[str, Any] = {"marker": "o", "ms": 2.5 * scale} if trace.form is ChartForm.MARKED_LINE else {}
            x, y = trace.x[: trace.shown], trace.y[: trace.shown]
            axes.plot(x, y, ls=_STYLES[trace.form], lw=width * scale, **marks, **style)


def _label(chart: Chart, axes: Axes, words: Callable[[str, int], str]) -> None:
    """Texts beside their points."""
    scale = axes.figure.dpi_scale_trans.inverted()
    room = axes.bbox.transformed(scale).size / np.array(_LETTER_SIZE)
    for order, places in label_places(chart, *room).items():
        trace = chart.traces[order]
        for x, y, text, place in zip(trace.x.tolist(), trace.y.tolist(), trace.texts, places, strict=True):
            if place:
                across, up = PLACES[place]
                axes.annotate(
                    words(text, len(text) + 20), (x, y), (4.0 * across, (5.0 if not across else 4.0) * up),
                    textcoords="offset points", ha=("center", "left", "right")[across],
                    va=("center", "bottom", "top")[up], fontsize=6.0, color=LIGHT[trace.role.value],
                    parse_math=False, annotation_clip=False,
                )  # fmt: skip


def _logarithmic(axes: Axes, way: str) -> None:
    """Ticks at 1, 2 and 5 where there is room, in plain numbers."""
    (axes.set_xscale if way == "x" else axes.set_yscale)("log")
    axis, (low, high) = (axes.xaxis, axes.get_xlim()) if way == "x" else (axes.yaxis, axes.get_ylim())
    fine = high < _MOST_DIVIDED * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if fine else (1.0,), numticks=15 if fine else 8))
    axis.set_major_formatter(FuncFormatter(lambda value, _: number(value, 6)))
    axis.set_minor_locator(NullLocator())


def _legend(axes: Axes, names: Sequence[str]) -> None:
    """The legend above the axes, never over the data, in as many columns as fit."""
    paper = axes.get_figure()
    inches = axes.get_position().width * (paper.get_figwidth() if isinstance(paper, Paper) else 6.0)
    # A letter is about 0.55 times as wide as high, the handle and the gap are as wide as eight letters.
    letter = 0.55 / 72.0 * font_manager.FontProperties(size=rcParams["legend.fontsize"]).get_size_in_points()
    lengths = [len(name) + 8 for name in names]

    def width(columns: int) -> float:
        rows = math.ceil(len(lengths) / columns)
        return letter * sum(max(lengths[k : k + rows]) for k in range(0, len(lengths), rows))

    columns = next((k for k in range(len(names), 1, -1) if width(k) <= inches), 1)
    legend = axes.legend(
        loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=columns, frameon=False, handlelength=1.8,
        columnspacing=1.4, borderpad=0.2, labelspacing=0.3,
    )  # fmt: skip
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D) and handle.get_marker() == ".":
            handle.set_markersize(5.0)
            handle.set_alpha(1.0)
    for text in legend.get_texts():
        text.set_parse_math(False)


def draw_heat_map(figure: HeatMap, axes: Axes) -> None:
    """Draw the cells of a heat map row by row, blue for negative values and the model's colour for positive ones."""
    size = len(figure.labels)
    values = figure.values.ravel().tolist()
    colours = [to_rgba(LIGHT["blue" if value < 0.0 else "model"], abs(value)) for value in values]
    corners = 0.5 * _CELL * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    middles = np.stack(np.meshgrid(np.arange(size), np.arange(size)), axis=-1).reshape(-1, 1, 2)
    axes.add_collection(PolyCollection(list(middles + corners), facecolors=colours, zorder=FIRST_ORDER))
    font = 6.5 if size <= 12 else 5.0
    axes.set_xticks(np.arange(size), figure.labels, rotation=90, fontsize=font)
    axes.set_yticks(np.arange(size), figure.labels, fontsize=font)
    axes.set(xlim=(-0.5, size - 0.5), ylim=(size - 0.5, -0.5), aspect="equal")
    axes.tick_params(length=0.0)
    axes.spines[:].set_visible(False)


def _colour_bar(axes: Axes) -> None:
    colours = LinearSegmentedColormap.from_list("correlation", [LIGHT["blue"], LIGHT["paper"], LIGHT["model"]])
    shades = ScalarMappable(Normalize(-1.0, 1.0), colours)
    bar = axes.figure.colorbar(shades, ax=axes, shrink=0.7, ticks=[-1.0, -0.5, 0.0, 0.5, 1.0])
    bar.outline.set_visible(False)
