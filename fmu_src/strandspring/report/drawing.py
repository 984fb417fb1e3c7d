"""Charts: each draws itself into axes of matplotlib, in the colours and with the few kinds of lines of all charts.

Colours have names, of what they stand for; `LIGHT` is drawn, and on a dark page `DARK` takes its place. Colour-blind
people tell them apart (Okabe and Ito).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..kernel.arrays import FloatArray, IndexArray
from .quantities import DisplayUnit, number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

LIGHT = {
    "measured": "#3b424c",
    "model": "#d55e00",
    "prediction": "#3f9fd8",
    "blue": "#0072b2",
    "green": "#00805d",
    "purple": "#9b4f96",
    "faint": "#bcc3cc",
    "muted": "#6b7480",
    "text": "#1d2229",
    "grid": "#e6e9ed",
    "paper": "#ffffff",
    "page": "#f4f6f8",
    "line": "#d5dae0",
    "care": "#b26a00",
    "poor": "#c0392b",
}
DARK = {
    "measured": "#d3d8e0",
    "model": "#ff8a3d",
    "prediction": "#8ccbf5",
    "blue": "#5ab4ee",
    "green": "#3fc79a",
    "purple": "#d79bd2",
    "faint": "#59626e",
    "muted": "#98a2af",
    "text": "#e6e9ee",
    "grid": "#2b323b",
    "paper": "#1a1f26",
    "page": "#12161b",
    "line": "#38414c",
    "care": "#f0ad4e",
    "poor": "#ff7b6b",
}
STYLE: Any = {
    # The font that comes with matplotlib: the same bytes on every computer.
    "font.family": "DejaVu Sans",
    "font.size": 7.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": LIGHT["muted"],
    "axes.labelcolor": LIGHT["text"],
    "axes.formatter.use_mathtext": False,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "text.color": LIGHT["text"],
    "xtick.labelsize": 6.5,
    "ytick.labelsize": 6.5,
    "xtick.color": LIGHT["text"],
    "ytick.color": LIGHT["text"],
    "xtick.bottom": False,
    "ytick.left": False,
    "legend.fontsize": 6.5,
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "strandspring",
    "text.parse_math": False,
    "text.usetex": False,
}
_LETTER = 4.1  # width of a digit at an axis [points]
_MOST_DIVIDED = 10.0**2.8  # ratio of the ends of an axis with ticks between powers of ten


@dataclass(frozen=True, eq=False)
class Chart:
    """A chart with one pair of axes.

    Parameters
    ----------
    key : str             Identifier, unique on a page.
    title : str
    sentence : str        What it shows, in words and numbers; the alternative text too.
    draw : callable       Of (axes, record): draws it into axes, of one record by its place, or of all if None.
    wide : bool           Whether it takes the whole width of the page.
    records : sequence of int   Places of records that are drawn apart, each in axes of its own; empty if all share one.
    is_square : bool      Whether it is a drawing or a matrix, as high as wide.
    """

    key: str
    title: str
    sentence: str
    draw: Callable[..., None]
    wide: bool = False
    records: Sequence[int] = ()
    is_square: bool = False


def line(
    axes: Axes, x: Any, y: Any, name: str, colour: str, style: str = "-", *, record: int | None = None, **look: Any
) -> None:
    """A line of a colour by its name; on a page it is hidden while another record is chosen."""
    axes.plot(x, y, ls=style, **{"lw": 0.9, **look}, color=LIGHT[colour], label=name, gid=_identifier(record))


def dots(axes: Axes, x: FloatArray, y: FloatArray, name: str, colour: str, *, record: int | None = None) -> None:
    """A dot for each of many samples: lines without length that end round, which take little room in a file."""
    gap = np.full(x.size, np.nan)
    # Next to nothing long, as raster images have no dot where a line has no length at all.
    xs, ys = np.column_stack([x, x + 1e-5 * np.ptp(x), gap]).ravel(), np.column_stack([y, y, gap]).ravel()
    look: dict[str, Any] = {"color": LIGHT[colour], "alpha": 0.8, "gid": _identifier(record)}
    (drawn,) = axes.plot(xs, ys, lw=1.8, solid_capstyle="round", **look)
    drawn.get_path().should_simplify = False
    axes.plot([], [], ".", label=name, **look)


def marks(
    axes: Axes, x: Any, y: Any, name: str, colour: str, marker: str = "o", *, error: Any = None,
    record: int | None = None,
) -> None:  # fmt: skip
    """Few and large marks, with error bars if there are errors; the marker "" leaves these alone."""
    bars = axes.errorbar(x, y, yerr=error, ls="none", marker=marker, ms=3.6, elinewidth=1.2,
                         color=LIGHT[colour], label=name)  # fmt: skip
    for artist in bars.get_children():
        artist.set_gid(_identifier(record))


def band(axes: Axes, x: Any, low: Any, high: Any, name: str, colour: str) -> None:
    """The room between two lines."""
    axes.fill_between(x, low, high, alpha=0.18, lw=0.0, color=LIGHT[colour], label=name)


def bars(
    axes: Axes, x: FloatArray, low: Any, high: Any, name: str, colour: str, width: float, *, opacity: float = 0.55,
    record: int | None = None,
) -> None:  # fmt: skip
    """Bars of a width about x, from their lower to their upper ends, as one outline."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    left, right = x - 0.5 * width, x + 0.5 * width
    low, high = np.broadcast_to(low, x.shape), np.broadcast_to(high, x.shape)
    corners = np.stack([left, low, left, high, right, high, right, low, left, low], axis=1).reshape(-1, 2)
    outline = Path(corners, [Path.MOVETO, *[Path.LINETO] * 3, Path.CLOSEPOLY] * x.size)
    axes.add_patch(PathPatch(outline, lw=0.0, color=LIGHT[colour], alpha=opacity, label=name, gid=_identifier(record)))
    axes.autoscale_view()


def _identifier(record: int | None) -> str | None:
    return None if record is None else f"record-{record}"


def name_axes(axes: Axes, x: tuple[str, DisplayUnit], y: tuple[str, DisplayUnit], log: str = "") -> None:
    """What the axes show with their units, and a grid; after all has been drawn.

    `log` has the letters of logarithmic axes. Numbers of cycles are whole.
    """
    for letter, axis, (text, unit) in (("x", axes.xaxis, x), ("y", axes.yaxis, y)):
        axis.set_label_text(f"{text} [{unit.name}]" if unit.name else text, parse_math=False)
        if letter in log:
            _logarithmic(axes, axis, letter)
        elif text:
            axes.locator_params(axis=letter, nbins=6, integer=text == "cycle")  # type: ignore[arg-type]
    axes.grid(True, which="major", color=LIGHT["grid"], lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def named(axes: Axes) -> dict[str, Any]:
    """One artist, or a container of them, for each name in axes; empty without two of them."""
    handles, names = axes.get_legend_handles_labels()
    kinds = dict(zip(names, handles, strict=True))
    return kinds if len(kinds) > 1 else {}


def draw(chart: Chart, axes: Axes, record: int | None = None) -> Axes:
    """A chart in given axes, its legend above them; of one record by its place, or of all if None."""
    chart.draw(axes, record)
    kinds = {shortened(name, 60): handle for name, handle in named(axes).items()}
    if kinds:
        width = axes.get_position().width * axes.get_figure(root=True).get_figwidth()  # type: ignore[union-attr]
        legend = axes.legend(
            kinds.values(), kinds, loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, fontsize=6.5,
            ncols=legend_columns([*kinds], width, 6.5), handlelength=1.8, columnspacing=1.4, borderpad=0.2,
            labelspacing=0.3,
        )  # fmt: skip
        for text in legend.get_texts():
            text.set_parse_math(False)
    return axes


def name_places(axes: Axes, way: str, names: Sequence[str], size: float = 6.5) -> None:
    """Names of what stands at 1, 2 and so on, in place of numbers."""
    axis = axes.xaxis if way == "x" else axes.yaxis
    axis.set_tick_params(labelrotation=90.0 if way == "x" else 0.0, labelsize=size)
    axis.set_ticks(range(1, len(names) + 1), [shortened(name, 30) for name in names], parse_math=False)


def _logarithmic(axes: Axes, axis: Axis, letter: str) -> None:
    """Ticks at 1, 2 and 5 where there is room, in plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axes.set(**{f"{letter}scale": "log"})
    low, high = axis.get_view_interval()
    fine = high < _MOST_DIVIDED * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if fine else (1.0,), numticks=15 if fine else 8))
    axis.set_major_formatter(FuncFormatter(lambda value, _: number(value, 6)))
    axis.set_minor_locator(NullLocator())


def annotate(axes: Axes, texts: Mapping[tuple[float, float], tuple[str, str]]) -> None:
    """Texts with the names of their colours beside their points; those for which no place is free are left out."""
    to_points = axes.transData + axes.get_figure(root=True).dpi_scale_trans.inverted()  # type: ignore[union-attr]
    places = {place: 72.0 * to_points.transform(place) for place in texts}
    taken = [(x - 3.0, x + 3.0, y - 3.0, y + 3.0) for x, y in places.values()]
    for place, (text, colour) in texts.items():
        words = shortened(text, 30)
        x, y = places[place]
        for across, up in ((1, 1), (-1, 1), (1, -1), (-1, -1), (0, 1), (0, -1), (1, 0), (-1, 0)):
            left = x + 4.0 * across + (-0.5, 0.0, -1.0)[across] * 3.6 * len(words)
            box = (left, left + 3.6 * len(words), y + 7.0 * up - 3.0, y + 7.0 * up + 3.0)
            if all(box[1] < a or b < box[0] or box[3] < c or d < box[2] for a, b, c, d in taken):
                taken.append(box)
                axes.annotate(words, place, (4.0 * across, 7.0 * up), textcoords="offset points", va="center",
                              ha=("center", "left", "right")[across], fontsize=6.0, color=LIGHT[colour],
                              parse_math=False)  # fmt: skip
                break


def legend_columns(names: Sequence[str], width: float, points: float, handle: int = 8) -> int:
    """As many as fit into a width [inches], in letters of a height [points]; `handle` and gap are as many letters."""
    # A letter is about 0.6 times as wide as high.
    lengths = [0.6 / 72.0 * points * (len(name) + handle) for name in names]
    of = (sum(max(lengths[k::columns]) for k in range(columns)) for columns in range(len(names), 1, -1))
    return next((len(names) - k for k, needed in enumerate(of) if needed <= width), 1)


def shortened(name: str, longest: int) -> str:
    """A name without characters that the font lacks, cut in the middle to so many letters at most (20 or more).

    Examples
    --------
    >>> shortened("measurement_of_a_long_day_3.csv", 20)
    'measurement…ay_3.csv'
    """
    name = "".join(c if ord(c) in _characters() else "\N{REPLACEMENT CHARACTER}" for c in name)
    return name if len(name) <= longest else f"{name[: longest - 9]}…{name[-8:]}"


@functools.cache
def _characters() -> frozenset[int]:
    from matplotlib import font_manager

    return frozenset(font_manager.get_font(font_manager.findfont("DejaVu Sans")).get_charmap())


class Paper:
    """A figure of a size [inches] that charts are drawn into one after the other, without their legends.

    Axes are made once, and their ticks are texts and one line: matplotlib's own take longer than all the rest.
    """

    def __init__(self, size: tuple[float, float]) -> None:
        from matplotlib.figure import Figure

        self.figure = Figure(size, dpi=72)
        self.axes = self.figure.add_axes((0.1, 0.1, 0.8, 0.8))
        for patch in (self.figure.patch, self.axes.patch):
            patch.set_visible(False)

    def draw(self, chart: Chart, record: int | None = None) -> None:
        """A chart instead of the last one, with as large axes as its texts leave room."""
        axes, (width, height) = self.axes, self.figure.bbox.size
        for artist in (*axes.lines, *axes.collections, *axes.patches, *axes.texts):
            artist.remove()
        axes.containers.clear()
        axes.set(xscale="linear", yscale="linear", aspect="auto")
        axes.tick_params(labelrotation=0.0, labelsize=6.5)
        axes.relim()
        axes.autoscale(True)
        chart.draw(axes, record)
        ticks = [_ticks(axis) for axis in (axes.xaxis, axes.yaxis)]
        across, up = (max(map(len, texts), default=0) for _, texts in ticks)
        is_turned = bool(axes.xaxis.get_tick_params().get("rotation"))
        left, below = 8.0 + _LETTER * up, 8.0 + (_LETTER * across if is_turned else 7.0)
        left, below = left + 10.0 * bool(axes.get_ylabel()), below + 10.0 * bool(axes.get_xlabel())
        right = 4.0 + 0.5 * _LETTER * across * (not is_turned)
        above = 4.0
        axes.set_position((left / width, below / height, 1.0 - (left + right) / width, 1.0 - (below + above) / height))
        for way, marked in zip((0, 1), ticks, strict=True):
            self._rule(way, *marked)
        size: dict[str, Any] = {"fontsize": 7.0, "parse_math": False}
        half = (left / width + 1.0 - right / width) / 2.0
        axes.text(half, 2.0 / height, axes.get_xlabel(), transform=self.figure.transFigure, ha="center", **size)
        half = (below / height + 1.0 - above / height) / 2.0
        axes.text(8.0 / width, half, axes.get_ylabel(), transform=self.figure.transFigure, rotation=90.0, va="center",
                  ha="right", **size)  # fmt: skip

    def _rule(self, way: int, places: Sequence[float], texts: Sequence[str]) -> None:
        """Texts at an axis, 0 for x and 1 for y, and the lines of its grid."""
        from matplotlib.lines import Line2D

        axes = self.axes
        axis, transform = ((axes.xaxis, axes.get_xaxis_transform()), (axes.yaxis, axes.get_yaxis_transform()))[way]
        axis.set_visible(False)
        style = axis.get_tick_params()
        look = {"fontsize": style["labelsize"], "rotation": style.get("rotation", 0.0), "parse_math": False}
        ends = (0.0, -4.0 / axes.bbox.size[1 - way])
        for place, text in zip(places, texts, strict=True):
            at = (place, ends[1]) if way == 0 else (ends[1], place)
            axes.text(*at, text, transform=transform, ha=("center", "right")[way], va=("top", "center")[way], **look)
        along, across = np.repeat(places, 3), np.tile([0.0, 1.0, np.nan], len(places))
        lines = Line2D(*((along, across), (across, along))[way], lw=0.6, color=LIGHT["grid"], transform=transform)
        axes.add_artist(lines).set_zorder(0.5)


def _ticks(axis: Axis) -> tuple[list[float], list[str]]:
    """The places that are marked at an axis, and their texts."""
    low, high = sorted(axis.get_view_interval())
    places = [place for place in axis.get_majorticklocs().tolist() if low <= place <= high]
    return places, axis.get_major_formatter().format_ticks(places)


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
