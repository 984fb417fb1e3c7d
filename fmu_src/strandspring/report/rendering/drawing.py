"""Charts drawn by matplotlib: into given axes, or as a figure of a given width on paper."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import font_manager, rcParams
from matplotlib.axes import Axes
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
_LETTER_SIZE = (0.048, 0.105)  # of a label [inches]


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
        _heat_map(figure, axes)
        return axes
    named: dict[str, None] = {}
    for order, trace in enumerate(figure.traces):
        if record is None or trace.record in (None, record):
            # matplotlib leaves labels with an underscore out of the legend.
            _trace(trace, axes, "_" if trace.name in named else trace.name, scale, 2.0 + 0.001 * order)
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
        names = [printable(name, _LONGEST_TICK) for name in figure.x.names]
        axes.set_xticks(range(1, len(names) + 1), names, rotation=90, parse_math=False)
    elif figure.x.whole:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(True, which="major", color=LIGHT["grid"], lw=0.6)
    axes.set_axisbelow(True)
    if figure.is_drawing:
        axes.set_aspect("equal", adjustable="datalim")
    _label(figure, axes)
    if len(named) > 1:
        _legend(axes, list(named))
    return axes


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
    text = "".join(c if ord(c) in _characters() else "\N{REPLACEMENT CHARACTER}" for c in name)
    return text if len(text) <= longest else f"{text[: longest - 9]}…{text[-8:]}"


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


def _label(chart: Chart, axes: Axes) -> None:
    """Texts beside their points."""
    paper = axes.get_figure()
    width, height = paper.get_size_inches() if isinstance(paper, Paper) else (6.0, 4.0)
    room = ((width - _AXIS * MM) / _LETTER_SIZE[0], (height - 0.5 * _AXIS * MM) / _LETTER_SIZE[1])
    for order, places in label_places(chart, *room).items():
        trace = chart.traces[order]
        for x, y, text, place in zip(trace.x.tolist(), trace.y.tolist(), trace.texts, places, strict=True):
            if place:
                across, up = PLACES[place]
                axes.annotate(
                    printable(text, len(text) + 20), (x, y), (4.0 * across, (5.0 if not across else 4.0) * up),
                    textcoords="offset points", ha=("center", "left", "right")[across],
                    va=("center", "bottom", "top")[up], fontsize=6.0, color=LIGHT[trace.role.value],
                    parse_math=False, annotation_clip=False,
                )  # fmt: skip


def _logarithmic(axes: Axes, way: str) -> None:
    """Ticks at 1, 2 and 5, in plain numbers."""
    (axes.set_xscale if way == "x" else axes.set_yscale)("log")
    axis = axes.xaxis if way == "x" else axes.yaxis
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=15))
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


def _heat_map(figure: HeatMap, axes: Axes) -> None:
    from matplotlib.colors import LinearSegmentedColormap

    colours = LinearSegmentedColormap.from_list("correlation", [LIGHT["blue"], LIGHT["paper"], LIGHT["model"]])
    size = len(figure.labels)
    image = axes.imshow(figure.values, vmin=-1.0, vmax=1.0, cmap=colours, interpolation="nearest")
    font = 6.5 if size <= 12 else 5.0
    places = np.arange(size)
    axes.set_xticks(places, figure.labels, rotation=90, fontsize=font)
    axes.set_yticks(places, figure.labels, fontsize=font)
    axes.tick_params(length=0.0)
    axes.spines[:].set_visible(False)
    paper = axes.get_figure()
    if paper is not None:
        bar = paper.colorbar(image, ax=axes, shrink=0.7, ticks=[-1.0, -0.5, 0.0, 0.5, 1.0])
        bar.outline.set_visible(False)
