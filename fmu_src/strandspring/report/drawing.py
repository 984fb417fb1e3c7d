"""Charts as data, how matplotlib draws them, and numbers in units that suit them.

A chart holds its curves in SI units, and a column for each axis; `scaled` chooses the unit in which values are neither
tiny nor huge. Colours have names, and colour-blind people tell them apart (Okabe and Ito).
"""

from __future__ import annotations

import functools
import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..ground.gravity import STANDARD_GRAVITY
from ..ground.result_columns import ResultColumn
from ..kernel.arrays import BoolArray, FloatArray, IndexArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
    "font.size": 6.5,
    "axes.linewidth": 0.6,
    "axes.edgecolor": LIGHT["muted"],
    "axes.formatter.useoffset": False,
    "xtick.bottom": False,
    "ytick.left": False,
    "pdf.fonttype": 42,
    "svg.hashsalt": "strandspring",
    "text.parse_math": False,
    "text.usetex": False,
}
COLOURS = ("blue", "green", "purple", "care", "model", "prediction", "text")
_DASHES = ("-", "--", "-.", ":")  # the last is for what is unstable
_ALL_POINTS, _POINTS = 40_000, (120, 4000)  # of a chart, and least and most of a curve

# Units for people from small to large, with factors and the values [SI] where the next ones begin.
_SCALES = {
    "N": (("mN", 1e3, 0.1), ("N", 1.0, 1e4), ("kN", 1e-3, math.inf)),
    "m": (("µm", 1e6, 1e-4), ("mm", 1e3, 30.0), ("m", 1.0, math.inf)),
    "J": (("µJ", 1e6, 1e-3), ("mJ", 1e3, 1.0), ("J", 1.0, 1e4), ("kJ", 1e-3, math.inf)),
    "N/m": (("N/m", 1.0, 1e3), ("N/mm", 1e-3, 1e7), ("kN/mm", 1e-6, math.inf)),
    "kg": (("g", 1e3, 1.0), ("kg", 1.0, 1e4), ("t", 1e-3, math.inf)),
}
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_EXPONENT = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)e([+-]\d{2,3})\b")
_MINUS = re.compile(r"(?<![\w.)-])-(?=\.?\d)")
NUMBER, PERCENT = ResultColumn("number", "1", ""), ResultColumn("share", "1", "", shown="%", factor=100.0)
DISPLACEMENT = ResultColumn("displacement", "m", "displacement", shown="mm", factor=1e3)
FORCE = ResultColumn("force", "N", "force", shown="N")
TIME = ResultColumn("time", "s", "time", shown="s")
SAMPLE = ResultColumn("sample", "1", "sample number")
FREQUENCY = ResultColumn("frequency", "Hz", "frequency", shown="Hz")
ACCELERATION = ResultColumn("acceleration", "m/s^2", "acceleration", shown="g", factor=1.0 / STANDARD_GRAVITY)


def scaled(column: ResultColumn, largest: float) -> ResultColumn:
    """A column in the unit in which values up to `largest` [SI] read best.

    Examples
    --------
    >>> scaled(FORCE, 2.5e5).shown, scaled(FORCE, 0.02).shown
    ('kN', 'mN')
    """
    if column.unit not in _SCALES:
        return column
    name, factor, _ = next(scale for scale in _SCALES[column.unit] if not abs(largest) >= scale[2])
    return replace(column, shown=name, factor=factor)


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


def printed(text: str) -> str:
    """A text in the notation of print.

    Examples
    --------
    >>> printed("from -2.93e-07 to 1.1e+03 J, +- 4 %")
    'from −2.93×10⁻⁷ to 1.1×10³ J, ±4 %'
    """
    words = _EXPONENT.sub(lambda match: f"{match[1]}×10{str(int(match[2])).translate(_SUPERSCRIPT)}", text)
    return _MINUS.sub("\N{MINUS SIGN}", words).replace("+- ", "±").replace("+-", "±")


@dataclass(frozen=True, eq=False)
class Curve:
    """What is drawn of some values, in SI units.

    Its style is "-", "--", "-." or ":" of a line, "." for a dot of each of many samples, "o", "X" or "_" for few large
    marks, "" for their error bars alone, "band" for the room about y.
    """

    x: Any
    y: Any
    name: str  # in the legend, if any
    colour: str  # by its name
    style: str = "-"
    record: int | None = None  # its place; on a page it is hidden while another one is chosen
    reach: Any = None  # half the length of error bars, or half the height of a band
    width: float = 0.9  # of a line or of error bars [points]


@dataclass(frozen=True, eq=False)
class Chart:
    """A chart with one pair of axes."""

    key: str  # unique on a page
    title: str
    sentence: str  # what it shows, in words and numbers
    x: ResultColumn
    y: ResultColumn
    curves: Sequence[Curve]
    form: str = "wide"  # "wide" as the page, "half" of that, or "square" and to scale
    is_apart: bool = False  # each record in axes of its own
    log: str = ""  # letters of logarithmic axes
    zero: str = ""  # letters of axes that begin at zero
    places: Sequence[str] = ()  # names of what stands at x = 1, 2 and so on
    texts: Sequence[tuple[float, float, str, str]] = ()  # x, y, words and colour, where there is room

    def shown(self, record: int | None) -> list[Curve]:
        """The curves of one record and of none, or all if None."""
        return [curve for curve in self.curves if record is None or curve.record in (None, record)]

    def named(self, record: int | None = None) -> dict[str, Curve]:
        """The first curve of each name in the legend, of one record or of all."""
        return dict(reversed({curve.name: curve for curve in reversed(self.shown(record)) if curve.name}.items()))

    def draw(self, axes: Axes, record: int | None = None, *, has_legend: bool = True) -> Axes:
        """Draw it in given axes, its legend above them; of one record by its place, or of all if None."""
        from matplotlib import rc_context
        from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

        names = self.named(record)
        most = int(np.clip(_ALL_POINTS // max(1, len(self.curves)), *_POINTS))
        with rc_context({"text.parse_math": False}):
            for curve in self.shown(record):
                is_first = names.get(curve.name) is curve
                _draw_curve(axes, curve, self, most, shortened(curve.name, 60) if is_first else "")
            for letter, axis, column in (("x", axes.xaxis, self.x), ("y", axes.yaxis, self.y)):
                name = f"{column.words} [{column.shown}]" if column.shown else column.words
                axis.set_label_text(name, parse_math=False)
                if letter in self.log:
                    axes.set(**{f"{letter}scale": "log"})
                    low, high = axis.get_view_interval()
                    powers = LogLocator(subs=(1.0, 2.0, 5.0) if high < 3e3 * low else (1.0,), numticks=8)
                    axis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]) if high < 2.5 * low else powers)
                    axis.set_major_formatter(lambda value, _: printed(f"{value:g}"))
                    axis.set_minor_locator(NullLocator())
                elif letter == "y" or not self.places:
                    axes.locator_params(axis=letter, nbins=6)  # type: ignore[arg-type]
                if letter in self.zero:
                    axes.set(**{f"{letter}lim": (0.0, None)})
            if self.places:
                places = [shortened(name, 30) for name in self.places]
                axes.set_xticks(range(1, len(places) + 1), places, rotation=90.0, parse_math=False)
            if self.form == "square":
                axes.set_aspect("equal", adjustable="datalim")
                axes.margins(0.12)
            axes.grid(True, which="major", color=LIGHT["grid"], lw=0.6)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
            _annotate(axes, [(self.x.factor * x, self.y.factor * y, *words) for x, y, *words in self.texts])
            if has_legend and len(names) > 1:
                columns = 2 if max(map(len, names)) < 30 else 1
                axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, fontsize=6.5, ncols=columns)
        return axes


def _draw_curve(axes: Axes, curve: Curve, chart: Chart, most: int, label: str) -> None:
    x, y = chart.x.factor * np.asarray(curve.x, dtype=float), chart.y.factor * np.asarray(curve.y, dtype=float)
    reach = None if curve.reach is None else chart.y.factor * np.asarray(curve.reach, dtype=float)
    gid = None if curve.record is None else f"record-{curve.record}"
    look: dict[str, Any] = {"color": LIGHT[curve.colour], "gid": gid}
    if curve.style == "band" and reach is not None:
        axes.fill_between(x, y - reach, y + reach, alpha=0.18, lw=0.0, label=label, **look)
    elif curve.style in _DASHES:
        gap = np.isnan(y)
        at = np.flatnonzero(~(gap & np.roll(gap, 1)))  # of a gap one sample is enough
        if at.size > most:
            at = at[np.union1d(visible(x[at], most // 2), visible(y[at], most // 2))]
        axes.plot(x[at], y[at], curve.style, lw=curve.width, solid_capstyle="butt", label=label, **look)
    elif curve.style == ".":
        at = visible(y, most)
        # Lines of next to no length that end round take little room in a file.
        ends = np.column_stack([x[at], x[at] + 1e-5 * np.ptp(x), np.full(at.size, np.nan)]).ravel()
        (dots,) = axes.plot(ends, np.repeat(y[at], 3), lw=1.8, solid_capstyle="round", alpha=0.8, **look)
        dots.get_path().should_simplify = False
        axes.plot([], [], ".", label=label, **look)
    else:
        size = 15.0 if curve.style == "_" else 3.6
        bars = axes.errorbar(x, y, reach, ls="none", marker=curve.style, ms=size, elinewidth=curve.width, label=label,
                             color=LIGHT[curve.colour])  # fmt: skip
        for artist in bars.get_children():
            artist.set_gid(gid)


def _annotate(axes: Axes, texts: Sequence[tuple[Any, ...]]) -> None:
    """Texts with names of colours beside their points; those for which no place is free are left out."""
    from matplotlib.transforms import Bbox

    axes.apply_aspect()
    places = [axes.transData.transform(at[:2]) for at in texts]
    taken = [Bbox.from_bounds(left - 3.0, below - 3.0, 6.0, 6.0) for left, below in places]
    for x, y, text, colour in texts:
        for across, up in itertools.product((1, -1, 0), repeat=2):
            words = axes.annotate(
                shortened(text, 30), (x, y), (4.0 * across, 7.0 * up), textcoords="offset points", va="center",
                ha=("center", "left", "right")[across], fontsize=6.0, color=LIGHT[colour],
            )  # fmt: skip
            box = words.get_window_extent()
            if not box.count_overlaps(taken):
                taken.append(box)
                break
            words.remove()


def shortened(name: str, longest: int) -> str:
    """A name without characters that the font lacks, cut in the middle to so many letters (20 or more).

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
    """Ascending places of about `most` samples that draw the same line: least and greatest of each short piece.

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


class Steady(NamedTuple):
    """Steady motions over frequency, in the order of their curve.

    Attributes
    ----------
    frequency, values : ndarray, shape (P,)
    is_stable : ndarray of bool, shape (P,)   Not between two folds.
    group, variant : str                      What its colour and its dashes stand for, in words.
    """

    frequency: FloatArray
    values: FloatArray
    is_stable: BoolArray
    group: str
    variant: str = ""


def steady_curves(motions: Sequence[Steady], record: int | None = None) -> list[Curve]:
    """Lines of motions, dotted where they are unstable."""
    from ..vibration.one_mass.response import with_neighbours

    groups, variants = ([*dict.fromkeys(of)] for of in zip(*(motion[3:] for motion in motions), strict=True))
    curves = []
    for x, y, is_stable, group, variant in motions:
        rounds, colour = divmod(groups.index(group), len(COLOURS))
        style = _DASHES[(variants.index(variant) + rounds) % (len(_DASHES) - 1)]
        name = ", ".join(filter(None, (group, variant)))
        curves.append(Curve(x, np.where(is_stable, y, np.nan), name, COLOURS[colour], style, record))
        if not is_stable.all():
            dotted = np.where(with_neighbours(~is_stable), y, np.nan)
            curves.append(Curve(x, dotted, "unstable", COLOURS[colour], _DASHES[-1], record))
    return curves


def steady_chart(label: str, motions: Sequence[Steady], title: str = "", level: float | None = None) -> Chart:
    """Motions over frequency, named by a label, and a level across."""
    curves = steady_curves(motions)
    if level is not None:
        ends = [end(float(end(motion.frequency)) for motion in motions) for end in (min, max)]
        curves.append(Curve(ends, [level, level], "", "faint"))
    return Chart("steady", title, "", FREQUENCY, ResultColumn("value", "", label), curves, log="xy")


def draw_panels(figure: Figure, charts: Sequence[Chart], title: str) -> list[Axes]:
    """Draw charts of the same curves into two rows of a figure, with one legend."""
    columns = len(charts) // 2
    axes = list(figure.subplots(2, columns, sharex="col", sharey="row", squeeze=False).flat)
    for one, chart in zip(axes, charts, strict=True):
        chart.draw(one, has_legend=False).set_title(chart.title)
        one.label_outer()
    figure.suptitle(title)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=columns + 1, frameon=False)
    return axes
