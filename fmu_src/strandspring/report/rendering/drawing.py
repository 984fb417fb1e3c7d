"""Charts drawn by matplotlib: into given axes, or as a figure of a given width on paper; `panels` draws for pages."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib import font_manager, rcParams
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure as Paper
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator
from matplotlib.transforms import ScaledTranslation

from ...kernel.arrays import FloatArray
from ..content.chart import Chart, ChartForm, Role, Trace
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
_CELL = 0.47 * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])  # corners about a point
_LETTER_SIZE = (0.048, 0.105)  # of a label [inches]
FIRST_ORDER = 3  # above grid and axes
# Where the middle of a text is from its point: sideways in halves of its length, upwards in lines.
_PLACES = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))
_BESIDE, _ABOVE = 1.2, 1.0  # from a point to the near end of its text [columns], or to its middle [lines]
_MARK, _DOT = (1.0, 0.5), (0.2, 0.1)  # half of a mark, and of a piece of a line [columns, lines]
_DRAWN = (ChartForm.LINE, ChartForm.DASHED, ChartForm.DOTTED)
_Place = tuple[int, int]
_Box = tuple[float, float, float, float]  # left, right, bottom, top


def draw(chart: Chart, axes: Axes, record: int | None = None, *, scale: float = 1.0) -> Axes:
    """Draw a chart into axes.

    Parameters
    ----------
    chart : Chart
    axes : Axes
    record : int or None   Show this record only; all if None.
    scale : float          Of line widths.
    """
    traces = tuple(trace for trace in chart.traces if record is None or trace.record in (None, record))
    draw_bare(replace(chart, traces=traces), axes, scale, printable)
    if len(names := dict.fromkeys(trace.name for trace in traces if trace.name)) > 1:
        _legend(axes, list(names))
    return axes


def paper_figure(figure: Chart, width: float, names: Mapping[int, str]) -> Paper:
    """A figure for print; a chart of one record at a time gets a panel for each of the records, at most eight.

    Panels have the name of their record, and a legend where it is not that of the first.

    Parameters
    ----------
    figure : Chart
    width : float             [mm]
    names : mapping           Of the records to show, by their places.
    """
    records: list[int | None] = [None]
    if figure.single:
        records = [place for place in dict.fromkeys(trace.record for trace in figure.traces) if place in names]
    columns = _COLUMNS if len(records) > FEW else 1
    rows, panel = math.ceil(len(records) / columns), width / columns
    if figure.is_drawing:
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


def groups_of_records(figure: Chart, most: int) -> list[list[int]]:
    """The first records of a chart of one record at a time, in groups for `paper_figure`; one empty group else."""
    if not figure.single:
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


def draw_bare(chart: Chart, axes: Axes, scale: float, words: Callable[[str, int], str]) -> None:
    """Draw a chart without a legend; artists of trace k have zorder `FIRST_ORDER` + k.

    `words` makes names of points and places fit into so many letters.
    """
    axes.use_sticky_edges = False
    named: set[str] = set()
    for order, trace in enumerate(chart.traces, FIRST_ORDER):
        # matplotlib leaves labels with an underscore out of the legend.
        _trace(trace, axes, "_" if trace.name in named else trace.name, scale, order)
        named.add(trace.name)
    for axis, way in ((chart.x, "x"), (chart.y, "y")):
        text = axes.set_xlabel(axis.label) if way == "x" else axes.set_ylabel(axis.label)
        text.set_parse_math(False)
        if axis.log:
            _logarithmic(axes, way)
        if axis.limits != (None, None):
            axes.set(**{f"{way}lim": axis.limits})
        drawn = axes.xaxis if way == "x" else axes.yaxis
        if axis.names:
            names = [words(name, _LONGEST_TICK) for name in axis.names]
            drawn.set_ticks(range(1, len(names) + 1), names, rotation=90 if way == "x" else 0, parse_math=False,
                            fontsize=6.5 if len(names) <= 12 else 5.0)  # fmt: skip
        elif axis.whole:
            drawn.set_major_locator(MaxNLocator(integer=True))
    axes.grid(True, which="major", color=LIGHT["grid"], lw=0.6)
    axes.set_axisbelow(True)
    if chart.is_drawing:
        axes.set_aspect("equal", adjustable="box" if chart.y.names else "datalim")
    _label(chart, axes, words)


def _trace(trace: Trace, axes: Axes, label: str, scale: float, order: float) -> None:
    colour = LIGHT[trace.role.value]
    style: dict[str, Any] = {"color": colour, "label": label, "zorder": order}
    low = np.zeros_like(trace.y) if trace.low is None else trace.low
    match trace.form:
        case ChartForm.BAND:
            axes.fill_between(trace.x, low, trace.y, alpha=0.18, lw=0.0, **style)
        case ChartForm.BARS:
            axes.bar(trace.x, trace.y - low, bottom=low, width=trace.bar_width, alpha=0.55, **style)
        case ChartForm.RANGES:
            half, line = 0.5 * (trace.y - low), 1.2 * scale
            axes.errorbar(trace.x, low + half, yerr=half, ls="none", capsize=2.5 * scale, elinewidth=line, **style)
        case ChartForm.CELLS:
            cells = np.column_stack([trace.x, trace.y])[:, None] + _CELL
            axes.add_collection(PolyCollection(list(cells), fc=colour, alpha=low, label=label, zorder=order))
        case ChartForm.DOTS:
            # Thousands of dots are no picture for vectors.
            dots: dict[str, Any] = {"marker": ".", "ms": 2.8 * scale, "mew": 0.0, "alpha": 0.8}
            axes.plot(trace.x, trace.y, ls="none", rasterized=True, **dots, **style)
        case ChartForm.MARKS | ChartForm.CROSSES:
            marker = "o" if trace.form is ChartForm.MARKS else "X"
            axes.errorbar(
                trace.x, trace.y, yerr=trace.error, ls="none", marker=marker, ms=4.0 * scale, capsize=2.5 * scale,
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
    room = axes.bbox.transformed(axes.figure.dpi_scale_trans.inverted()).size / np.array(_LETTER_SIZE)
    for order, places in label_places(chart, *room).items():
        trace = chart.traces[order]
        for x, y, text, place in zip(trace.x.tolist(), trace.y.tolist(), trace.texts, places, strict=True):
            if place is not None:
                across, up = place
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


def legend_columns(names: Sequence[str], width: float, points: float, handle: int = 8) -> int:
    """As many as fit into a width [inches], in letters of a height [points]; `handle` and gap are as many letters."""
    # A letter is about 0.55 times as wide as high.
    lengths = [0.55 / 72.0 * points * (len(name) + handle) for name in names]
    of = (sum(float(part.max()) for part in np.array_split(lengths, k)) for k in range(len(names), 1, -1))
    return next((len(names) - k for k, needed in enumerate(of) if needed <= width), 1)


def _legend(axes: Axes, names: Sequence[str]) -> None:
    """The legend above the axes, never over the data, in as many columns as fit."""
    paper = axes.get_figure()
    inches = axes.get_position().width * (paper.get_figwidth() if isinstance(paper, Paper) else 6.0)
    points = font_manager.FontProperties(size=rcParams["legend.fontsize"]).get_size_in_points()
    legend = axes.legend(
        loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=legend_columns(names, inches, points), frameon=False,
        handlelength=1.8, columnspacing=1.4, borderpad=0.2, labelspacing=0.3,
    )  # fmt: skip
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D) and handle.get_marker() == ".":
            handle.set_markersize(5.0)
            handle.set_alpha(1.0)
    for text in legend.get_texts():
        text.set_parse_math(False)


def label_places(chart: Chart, columns: float, lines: float) -> dict[int, list[_Place | None]]:
    """Places of the texts of each trace with labels, by its index, to the right and up; None where there is no room.

    Parameters
    ----------
    chart : Chart
    columns, lines : float    How many letters fit across the chart, and how many lines of text.
    """
    labelled = {index: trace for index, trace in enumerate(chart.traces) if trace.labelled}
    if not labelled:
        return {}
    marks = {
        index: _scaled(chart, trace, columns, lines)
        for index, trace in enumerate(chart.traces)
        if trace.labelled or trace.form is ChartForm.MARKS
    }
    for index, trace in enumerate(chart.traces):
        if trace.form in _DRAWN:
            marks.setdefault(index, _along(_scaled(chart, trace, columns, lines)))
    taken: list[_Box] = [
        (x - width, x + width, y - height, y + height)
        for index, places in marks.items()
        for width, height in (_DOT if chart.traces[index].form in _DRAWN else _MARK,)
        for x, y in places
    ]
    found: dict[int, list[_Place | None]] = {}
    for index, trace in labelled.items():
        found[index] = []
        for (x, y), text in zip(marks[index], trace.texts, strict=True):
            free = (
                (place, box)
                for place, box in ((place, _box_of(x, y, len(text), place)) for place in _PLACES)
                if box[0] >= 0.0 and box[1] <= columns and box[2] >= 0.0 and box[3] <= lines
                and not any(_overlap(box, other) for other in taken)
            )  # fmt: skip
            place, box = next(free, (None, None))
            found[index].append(place)
            if box is not None:
                taken.append(box)
    return found


def _box_of(x: float, y: float, length: int, place: _Place) -> _Box:
    across, up = place
    middle, height = x + across * (0.5 * length + _BESIDE), y + up * _ABOVE
    return (middle - 0.5 * length, middle + 0.5 * length, height - 0.5, height + 0.5)


def _along(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Points along the lines through points, about half a column apart; NaN interrupts a line."""
    return [
        (a + share * (c - a), b + share * (d - b))
        for (a, b), (c, d) in itertools.pairwise(points)
        if math.isfinite(a + b + c + d)
        for share in np.linspace(0.0, 1.0, 2 + int(2.0 * max(abs(c - a), 2.0 * abs(d - b)))).tolist()
    ]


def _overlap(one: _Box, other: _Box) -> bool:
    return one[0] < other[1] and other[0] < one[1] and one[2] < other[3] and other[2] < one[3]


def _scaled(chart: Chart, trace: Trace, columns: float, lines: float) -> list[tuple[float, float]]:
    """The points of a trace in columns and lines from the lower left corner of the chart."""
    (left, right), (bottom, top) = (_ends(chart, way) for way in "xy")
    across, up = columns / (right - left), lines / (top - bottom)
    if chart.is_drawing:
        # A column is about half as wide as a line is high; what is left of the room is at both sides.
        across = min(across, 2.0 * up)
        up = 0.5 * across
    x = 0.5 * columns + across * (trace.x - 0.5 * (left + right))
    y = 0.5 * lines + up * (trace.y - 0.5 * (bottom + top))
    return list(zip(x.tolist(), y.tolist(), strict=True))


def _ends(chart: Chart, way: str) -> tuple[float, float]:
    """Of an axis of a chart, with a margin; `way` is x or y."""
    axis = chart.x if way == "x" else chart.y
    values: FloatArray = np.concatenate([getattr(trace, way) for trace in chart.traces])
    low, high = axis.limits
    low = float(np.nanmin(values)) if low is None else low
    high = float(np.nanmax(values)) if high is None else high
    margin = 0.05 * (high - low) or 0.5 * math.fabs(high) or 1.0
    return low - margin, high + margin
