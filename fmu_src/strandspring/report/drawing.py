"""Charts as data, how matplotlib draws them, and numbers in units that suit them.

A chart holds its curves in SI units and a column for each axis, which says words, unit and factor; `scaled` chooses the
unit in which values are neither tiny nor huge. Colours have names, of what they stand for; colour-blind people tell
them apart (Okabe and Ito).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..ground.gravity import STANDARD_GRAVITY
from ..ground.result_columns import ResultColumn
from ..kernel.arrays import FloatArray, IndexArray

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
    "care": "#b26a00",
    "poor": "#c0392b",
}
STYLE: Any = {
    # The font that comes with matplotlib: the same bytes on every computer.
    "font.family": "DejaVu Sans",
    "font.size": 7.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": LIGHT["muted"],
    "axes.labelcolor": LIGHT["text"],
    "axes.formatter.useoffset": False,
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
_ALL_POINTS, _POINTS = 40_000, (120, 4000)  # of a chart, and least and most of a curve
_MOST_DIVIDED = 10.0**2.8  # ratio of the ends of an axis with ticks between powers of ten

# Of each SI unit those for people, from small to large, each with its factor and the value [SI] where the next begins.
_SCALES = {
    "N": (("mN", 1e3, 0.1), ("N", 1.0, 1e4), ("kN", 1e-3, math.inf)),
    "m": (("µm", 1e6, 1e-4), ("mm", 1e3, 30.0), ("m", 1.0, math.inf)),
    "m/s": (("mm/s", 1e3, 10.0), ("m/s", 1.0, math.inf)),
    "J": (("µJ", 1e6, 1e-3), ("mJ", 1e3, 1.0), ("J", 1.0, 1e4), ("kJ", 1e-3, math.inf)),
    "N/m": (("N/m", 1.0, 1e3), ("N/mm", 1e-3, 1e7), ("kN/mm", 1e-6, math.inf)),
    "kg": (("g", 1e3, 1.0), ("kg", 1.0, 1e4), ("t", 1e-3, math.inf)),
}
_ORDINARY = (1e-3, 1e6)  # beyond these a power of ten goes to the unit, so that ticks stay short
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
NUMBER, PERCENT = ResultColumn("number", "1", ""), ResultColumn("share", "1", "", shown="%", factor=100.0)
DISPLACEMENT = ResultColumn("displacement", "m", "displacement", shown="mm", factor=1e3)
FORCE = ResultColumn("force", "N", "force", shown="N")
TIME = ResultColumn("time", "s", "time", shown="s")
FREQUENCY = ResultColumn("frequency", "Hz", "frequency", shown="Hz")
ACCELERATION = ResultColumn("acceleration", "m/s^2", "acceleration", shown="g", factor=1.0 / STANDARD_GRAVITY)


def scaled(column: ResultColumn, largest: float) -> ResultColumn:
    """A column in the unit in which values up to `largest` [SI] read best.

    Examples
    --------
    >>> scaled(FORCE, 2.5e5).shown, scaled(FORCE, 2.5e-14).shown
    ('kN', '10⁻¹² mN')
    """
    if column.unit not in _SCALES:
        return column
    name, factor, _ = next(scale for scale in _SCALES[column.unit] if not abs(largest) >= scale[2])
    shown = abs(largest) * factor
    if 0.0 < shown < _ORDINARY[0] or _ORDINARY[1] <= shown < math.inf:
        power = 3 * math.floor(math.log10(shown) / 3.0)
        name, factor = f"10{superscript(power)} {name}", factor * 10.0**-power
    return replace(column, shown=name, factor=factor)


def superscript(exponent: int) -> str:
    """An exponent in raised digits."""
    return str(exponent).translate(_SUPERSCRIPT)


def in_unit(value: float, column: ResultColumn = NUMBER, digits: int = 4) -> str:
    """A value [SI] with so many significant digits and the unit of a column.

    Examples
    --------
    >>> in_unit(0.0278149, DISPLACEMENT, 3), in_unit(0.123, PERCENT, 2), in_unit(1234.5)
    ('27.8 mm', '12 %', '1234')
    """
    return f"{replace(column, digits=digits).text(value)} {column.shown}".rstrip()


def percent(share: float, digits: int = 2) -> str:
    """A share in percent."""
    return in_unit(share, PERCENT, digits)


@dataclass(frozen=True, eq=False)
class Curve:
    """What is drawn of some values, in SI units.

    Its style is "-", "--" or ":" of a line, "." for a dot of each of many samples, "o" or "X" for few large marks, ""
    for their error bars alone, "band" for the room about y.
    """

    x: Any
    y: Any
    name: str  # in the legend
    colour: str  # by its name
    style: str = "-"
    record: int | None = None  # place of the record it is of; on a page it is hidden while another one is chosen
    reach: Any = None  # half the length of error bars, or half the height of a band
    width: float = 0.9  # of a line [points]


@dataclass(frozen=True, eq=False)
class Chart:
    """A chart with one pair of axes."""

    key: str  # unique on a page
    title: str
    sentence: str  # what it shows, in words and numbers
    x: ResultColumn
    y: ResultColumn
    curves: Sequence[Curve]
    form: str = "half"  # "wide" as the page, "half" of that, or "square" and to scale
    is_apart: bool = False  # each record in axes of its own
    log: str = ""  # letters of logarithmic axes
    zero: str = ""  # letters of axes that begin at zero
    places: Sequence[str] = ()  # names of what stands at x = 1, 2 and so on
    texts: Sequence[tuple[float, float, str, str]] = ()  # x, y, words and colour, where there is room

    @property
    def records(self) -> list[int]:
        """Places of the records that it shows."""
        return sorted({curve.record for curve in self.curves if curve.record is not None})

    def named(self, record: int | None = None) -> dict[str, Curve]:
        """A curve for each name in the legend, of one record or of all; empty without two of them."""
        names = {curve.name: curve for curve in self.curves if record is None or curve.record in (None, record)}
        return names if len(names) > 1 else {}


def draw(chart: Chart, axes: Axes, record: int | None = None, *, has_legend: bool = True) -> Axes:
    """A chart in given axes, its legend above them; of one record by its place, or of all if None."""
    from matplotlib import rc_context

    most = int(np.clip(_ALL_POINTS // max(1, len(chart.curves)), *_POINTS))
    with rc_context({"text.parse_math": False}):
        for curve in chart.curves:
            if record is None or curve.record in (None, record):
                _draw_curve(axes, curve, chart, most)
        for letter, axis, column in (("x", axes.xaxis, chart.x), ("y", axes.yaxis, chart.y)):
            name = f"{column.words} [{column.shown}]" if column.shown else column.words
            axis.set_label_text(name, parse_math=False)
            if letter in chart.log:
                _logarithmic(axes, axis, letter)
            elif letter == "y" or not chart.places:
                axes.locator_params(axis=letter, nbins=6)  # type: ignore[arg-type]
            if letter in chart.zero:
                axes.set(**{f"{letter}lim": (0.0, None)})
        if chart.places:
            axes.xaxis.set_tick_params(labelrotation=90.0)
            axes.set_xticks(
                range(1, len(chart.places) + 1), [shortened(name, 30) for name in chart.places], parse_math=False
            )
        if chart.form == "square":
            axes.set_aspect("equal", adjustable="datalim")
            axes.margins(0.12)
        axes.grid(True, which="major", color=LIGHT["grid"], lw=0.6)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        _annotate(axes, [(chart.x.factor * x, chart.y.factor * y, *words) for x, y, *words in chart.texts])
        if has_legend and (kinds := chart.named(record)):
            _add_legend(axes, list(kinds))
    return axes


def _draw_curve(axes: Axes, curve: Curve, chart: Chart, most: int) -> None:
    x, y = chart.x.factor * np.asarray(curve.x, dtype=float), chart.y.factor * np.asarray(curve.y, dtype=float)
    reach = None if curve.reach is None else chart.y.factor * np.asarray(curve.reach, dtype=float)
    gid = None if curve.record is None else f"record-{curve.record}"
    look: dict[str, Any] = {"color": LIGHT[curve.colour], "gid": gid}
    if curve.style == "band" and reach is not None:
        axes.fill_between(x, y - reach, y + reach, alpha=0.18, lw=0.0, label=curve.name, **look)
    elif curve.style in ("-", "--", ":"):
        gap = np.isnan(y)
        at = np.flatnonzero(~(gap & np.roll(gap, 1)))  # of a gap one sample is enough
        if at.size > most:
            at = at[np.union1d(visible(x[at], most // 2), visible(y[at], most // 2))]
        axes.plot(x[at], y[at], curve.style, lw=curve.width, solid_capstyle="butt", label=curve.name, **look)
    elif curve.style == ".":
        at = visible(y, most)
        # Lines of next to no length that end round take little room in a file.
        ends = np.column_stack([x[at], x[at] + 1e-5 * np.ptp(x), np.full(at.size, np.nan)]).ravel()
        (dots,) = axes.plot(ends, np.repeat(y[at], 3), lw=1.8, solid_capstyle="round", alpha=0.8, **look)
        dots.get_path().should_simplify = False
        axes.plot([], [], ".", label=curve.name, **look)
    else:
        bars = axes.errorbar(x, y, yerr=reach, ls="none", marker=curve.style, ms=3.6, elinewidth=1.2,
                             color=LIGHT[curve.colour], label=curve.name)  # fmt: skip
        for artist in bars.get_children():
            artist.set_gid(gid)


def _add_legend(axes: Axes, names: Sequence[str]) -> None:
    handles = {name: handle for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)}
    width = axes.get_position().width * axes.get_figure(root=True).get_figwidth()  # type: ignore[union-attr]
    shown = [shortened(name, 60) for name in names]
    axes.legend(
        [handles[name] for name in names], shown, loc="lower left", bbox_to_anchor=(0.0, 1.0),
        frameon=False, fontsize=6.5, ncols=legend_columns(shown, width, 6.5), handlelength=1.8, columnspacing=1.4,
        borderpad=0.2, labelspacing=0.3,
    )  # fmt: skip


def _logarithmic(axes: Axes, axis: Axis, letter: str) -> None:
    """Ticks at 1, 2 and 5 where there is room, in plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    axes.set(**{f"{letter}scale": "log"})
    low, high = axis.get_view_interval()
    fine = high < _MOST_DIVIDED * low
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if fine else (1.0,), numticks=15 if fine else 8))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}" if 1e-4 < value < 1e5 else _power(value)))
    axis.set_minor_locator(NullLocator())


def _power(value: float) -> str:
    mantissa, exponent = f"{value:.0e}".split("e")
    return f"{'' if mantissa == '1' else f'{mantissa}·'}10{superscript(int(exponent))}"


def _annotate(axes: Axes, texts: Sequence[tuple[Any, ...]]) -> None:
    """Texts with the names of their colours beside their points; those for which no place is free are left out."""
    to_points = axes.transData + axes.get_figure(root=True).dpi_scale_trans.inverted()  # type: ignore[union-attr]
    taken = [(x - 3.0, x + 3.0, y - 3.0, y + 3.0) for x, y in (72.0 * to_points.transform(at[:2]) for at in texts)]
    for (x, y, text, colour), (left, right, below, above) in zip(texts, list(taken), strict=True):
        words, middle, height = shortened(text, 30), 0.5 * (left + right), 0.5 * (below + above)
        for across, up in ((1, 1), (-1, 1), (1, -1), (-1, -1), (0, 1), (0, -1), (1, 0), (-1, 0)):
            begin = middle + 4.0 * across + (-0.5, 0.0, -1.0)[across] * 3.6 * len(words)
            box = (begin, begin + 3.6 * len(words), height + 7.0 * up - 3.0, height + 7.0 * up + 3.0)
            if all(box[1] < a or b < box[0] or box[3] < c or d < box[2] for a, b, c, d in taken):
                taken.append(box)
                axes.annotate(words, (x, y), (4.0 * across, 7.0 * up), textcoords="offset points", va="center",
                              ha=("center", "left", "right")[across], fontsize=6.0, color=LIGHT[colour])  # fmt: skip
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
    length = -(-size // max(1, (most - 2) // 2))
    padded = np.concatenate([values, np.full(-size % length, values[-1])]).reshape(-1, length)
    begin = np.arange(padded.shape[0]) * length
    chosen = np.concatenate([begin + padded.argmin(axis=1), begin + padded.argmax(axis=1), [0, size - 1]])
    return np.unique(np.minimum(chosen, size - 1))
