"""A page that opens offline: what it consists of, all plain text, tables and charts, and `write_page`.

A page holds everything: text, styles, figures as SVG of matplotlib, and a script that lets records be chosen and
figures be read and zoomed. Its content security policy lets it load nothing else and run no other script.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from .._version import __version__
from ..ground.files import write_text
from ..ground.result_columns import ResultColumn
from ..ground.result_columns import texts as texts_of
from . import check_report_path
from .drawing import LIGHT, STYLE, Chart, draw, superscript

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST_ROWS = 400  # of a table
_SIZES = {"wide": (8.8, 2.75), "half": (4.3, 2.3), "square": (4.3, 4.3)}  # of figures [inches]
_LEFT, _RIGHT, _BELOW, _ABOVE, _LETTER = 46.0, 12.0, 28.0, 6.0, 3.8  # room about axes, and of a letter [points]
_SWATCHES = {"--": "2px dashed {}", ":": "2px dotted {}", "-": "2px solid {}", "band": "8px solid {}; opacity: 0.4"}
_MARKS = "6px dotted {}"  # other swatches of legends
_SVG = '<svg class="plot" role="img" aria-labelledby="title-{}" viewBox="0 0 {:g} {:g}" data-scales="{}">{}</svg>'
_NONE: Mapping[str, Any] = {}
_EXPONENT = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?)e([+-]\d{2,3})\b")
_MINUS = re.compile(r"(?<![\w.)-])-(?=\.?\d)")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:[µmk]?[NJm]|k?N/m{1,2}|mm/s|m/s|k?g|t|s|Hz|%)(?![\w/]))")


class Level(Enum):
    """How a notice is meant; the value names its colour."""

    GOOD = "green"
    INFORMATION = "blue"
    CARE = "care"
    POOR = "poor"


@dataclass(frozen=True)
class Notice:
    """A highlighted finding, with what to do."""

    level: Level
    text: str
    advice: str = ""


class Tile(NamedTuple):
    """One figure that is to be seen first."""

    label: str
    value: str
    unit: str
    note: str


@dataclass(frozen=True)
class Tiles:
    """Figures that are to be seen first."""

    tiles: Sequence[Tile]


class DeclaredTable(Protocol):
    """A table of a result."""

    @property
    def title(self) -> str: ...
    @property
    def columns(self) -> Sequence[ResultColumn]: ...
    @property
    def rows(self) -> Sequence[Any]: ...


@dataclass(frozen=True)
class Table:
    """A table of texts; its first column names a row, and cells with a key of `levels` have its sign."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    levels: Mapping[str, Level] = field(default_factory=dict)

    @classmethod
    def of(cls, title: str, texts: Mapping[ResultColumn, Sequence[str]], levels: Mapping[str, Level] = _NONE) -> Table:
        """A table of the texts of columns."""
        return cls(title, [column.heading for column in texts], list(zip(*texts.values(), strict=True)), levels)

    @property
    def shown(self) -> Sequence[Sequence[str]]:
        """The first rows."""
        return self.rows[:_MOST_ROWS]


@dataclass(frozen=True)
class Facts:
    """Labels with texts; an empty text leaves a line to write on."""

    pairs: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Source:
    """The text of a file as it is."""

    text: str


@dataclass(frozen=True, eq=False)
class Gallery:
    """Figures."""

    charts: Sequence[Chart]


Parts = Iterable[str | DeclaredTable]
Block = str | Notice | Tiles | Table | Facts | Source | Gallery  # a string is a paragraph


@dataclass(frozen=True, eq=False)
class Section:
    """A heading with what belongs to it; folded sections are opened by their heading, empty ones left out."""

    key: str
    title: str
    blocks: Sequence[Block]
    is_folded: bool = False


@dataclass(frozen=True, eq=False)
class Page:
    """A page."""

    title: str
    subtitle: str
    sections: Sequence[Section]
    records: Mapping[int, str]  # names of the records in the figures by their places, to choose from
    noun: str = "Record"
    first: int | None = None  # place of the record shown first; None for all, or the first where each is apart
    cycles: int = 0  # that can be chosen, of records that are not identified yet
    options: Mapping[str, str] = field(default_factory=dict)  # what choose what is zoomed into, by keys of charts
    footer: str = f"strandspring {__version__}"


def blocks_of(parts: Parts, said: Callable[[str], str] = str, levels: Mapping[str, Level] = _NONE) -> Iterator[Block]:
    """Lines and tables of a result; `said` changes their texts."""
    for part in parts:
        if isinstance(part, str):
            yield said(part.strip())
        elif texts := texts_of(part.columns, part.rows):
            cells = {column: list(map(said, of)) for column, of in texts.items()}
            yield Table.of(part.title.removesuffix(":"), cells, levels)


def write_page(path: str | Path, page: Page) -> None:
    """Write a page as one HTML file; raises StrandspringError if its ending does not suit or it cannot be written."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    check_report_path(path)
    environment = Environment(
        loader=PackageLoader("strandspring", "report/assets"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {
        "printed": printed,
        "panels": partial(_panels, papers={}),
        "sha256": lambda script: base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
    }
    write_text(Path(path), environment.get_template("page.html.j2").render(page=page))


def printed(text: str) -> str:
    """A text in the notation of print, in which no line ends between a number and its unit.

    Examples
    --------
    >>> printed("from -2.93e-07 to 1.1e+03 J, +- 4 %").replace("\\xa0", "_")
    'from −2.93×10⁻⁷ to 1.1×10³ J, ±4_%'
    """
    words = _EXPONENT.sub(lambda match: f"{match[1]}×10{superscript(int(match[2]))}", text)
    words = _MINUS.sub("\N{MINUS SIGN}", words).replace("+- ", "±").replace("+-", "±")
    return _BEFORE_UNIT.sub("\N{NO-BREAK SPACE}", words)


def _panels(chart: Chart, papers: dict[Any, tuple[Figure, Axes]]) -> Iterator[tuple[int | None, str, dict[str, str]]]:
    """Of each panel the place of its record if each has its own, its SVG, and the looks of what is in the legend.

    Axes of one kind are used again, as making them takes longer than all the rest.
    """
    from markupsafe import Markup
    from matplotlib import rc_context
    from matplotlib.figure import Figure as Paper

    kind = (chart.form, chart.log, tuple(chart.places))
    for record in chart.records if chart.is_apart else (None,):
        look: Any = {"svg.hashsalt": f"{chart.key}-{record}", "svg.fonttype": "none", "path.simplify_threshold": 0.3}
        with rc_context({**STYLE, **look}):
            if kind not in papers:
                figure = Paper(_SIZES[chart.form], dpi=72, facecolor="none")
                width, height = figure.bbox.size
                below = max([_BELOW, *(8.0 + _LETTER * min(len(name), 30) for name in chart.places)])
                room = (1.0 - (_LEFT + _RIGHT) / width, 1.0 - (below + _ABOVE) / height)
                papers[kind] = figure, figure.add_axes((_LEFT / width, below / height, *room), facecolor="none")
            figure, axes = papers[kind]
            for artist in (*axes.lines, *axes.collections, *axes.texts):
                artist.remove()
            axes.containers.clear()
            axes.relim()
            axes.autoscale(True)
            draw(chart, axes, record, has_legend=False)
            file = io.StringIO()
            figure.savefig(file, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
        width, height = figure.bbox.size
        (left, bottom), (right, top) = axes.bbox.get_points().tolist()
        box = [round(end, 1) for end in (left, right, height - top, height - bottom)]
        ends = [float(f"{end:.7g}") for end in (*axes.get_xlim(), *axes.get_ylim())]
        # Where the axes are, their ends, which are logarithmic, and their units, for the pointer.
        scales = json.dumps([box, ends, ["x" in chart.log, "y" in chart.log], [chart.x.shown, chart.y.shown]])
        # matplotlib has escaped the texts.
        svg = Markup(_SVG).format(chart.key, width, height, scales, Markup(inline(file.getvalue())))  # noqa: S704
        named = chart.named(record).items()
        yield record, svg, {name: _SWATCHES.get(of.style, _MARKS).format(LIGHT[of.colour]) for name, of in named}


def inline(svg: str) -> str:
    """The content of an SVG of matplotlib for a page: no names but those of clips, and fewer digits; texts stay."""

    def cleaned(tag: re.Match[str]) -> str:
        words = re.sub(r' id="record-(\d+)"', r' data-record="\1"', tag[0])
        words = re.sub(r' id="(?![a-z][\da-f]{10}")[^"]*"|font-family: [^;"]*;? ?', "", words)
        return re.sub(r"(\.\d\d)\d+", r"\1", words)

    return re.sub(r"<[^>]*>", cleaned, re.sub(r"(?s)\A.*?(?=<g)|</svg>", "", svg))
