"""A page that opens offline: what it consists of, all plain text and charts, and `write_page`.

A page holds everything: text, styles, figures as SVG of matplotlib in the colours of the page, and a script that lets
records be chosen and figures be read and zoomed. Its content security policy lets it load nothing else and run no other
script.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._version import __version__
from ..ground.files import write_text
from . import check_report_path
from .drawing import DARK, LIGHT, STYLE, Chart, Paper, named
from .quantities import bound

_MOST_ROWS = 400  # of a table
_SIZES = {"wide": (8.8, 2.75), "half": (4.3, 2.3), "square": (4.3, 4.3)}  # of figures [inches]
_NAMES = {colour: name for name, colour in LIGHT.items()}
_TAG = re.compile(r"<[^/][^>]*>")
_LAYOUT = re.compile(r"\A.*?(?=<g)|<defs>\s*<style.*?</defs>|</svg>|\n\s*(?=<)", re.DOTALL)
_IDENTIFIER = re.compile('(?<=["#])[a-z][0-9a-f]{10}(?=["\\)])')
_LINES = ("", "None", None)  # markers of lines
_ZERO = re.compile(r" (?=-)|(?<![\d.])0(?=\.)")
# Within tags, each with what takes its place: what matplotlib names by itself or repeats, and digits that are not seen.
_CLEANED = tuple(
    (re.compile(pattern), text)
    for pattern, text in (
        (r' id="record-(\d+)"', r' data-record="\1"'),
        (r' id="[a-z\d.]+_\d+"| font-family: [^;"]*;| transform="rotate\(-0 [^"]*"', ""),
        (r"font-size: 6.5px; |fill: none; |; fill: var\(-{2}text\)|; stroke-linecap: square", ""),
        (r"(\.\d\d)\d+", r"\1"),
    )
)


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


@dataclass(frozen=True)
class Table:
    """A table; its first column names a row.

    Parameters
    ----------
    title : str                    Says what it shows, for those who do not see it too.
    header : sequence of str
    rows : sequence of tuples of str
    strong : sequence of int       Rows that begin a group.
    levels : sequence of Level     Of each row, as sign and colour of its second cell; empty for none.
    """

    title: str
    header: Sequence[str]
    rows: Sequence[tuple[str, ...]]
    strong: Sequence[int] = ()
    levels: Sequence[Level] = ()

    @property
    def shown(self) -> Sequence[tuple[str, ...]]:
        """The first rows."""
        return self.rows[:_MOST_ROWS]


@dataclass(frozen=True)
class Facts:
    """Labels with texts; an empty text leaves a line to write on."""

    pairs: Sequence[tuple[str, str]]


@dataclass(frozen=True, eq=False)
class Gallery:
    """Figures."""

    charts: Sequence[Chart]


Block = str | Notice | Tiles | Table | Facts | Gallery  # a string is a paragraph


@dataclass(frozen=True, eq=False)
class Section:
    """A heading with what belongs to it; folded sections are opened by their heading."""

    key: str
    title: str
    blocks: Sequence[Block]
    is_folded: bool = False


@dataclass(frozen=True, eq=False)
class Page:
    """A page.

    Parameters
    ----------
    title, subtitle : str
    sections : sequence of Section
    records : dict            Names of the records in the figures by their places, to choose from.
    noun : str                What a record is called where one is chosen.
    first : int or None       Place of the record that is shown first; None for all, or the first where each is apart.
    choice : dict or None     Of records that are not identified yet: "cycles", how many can be chosen, and "timed".
    """

    title: str
    subtitle: str
    sections: Sequence[Section]
    records: dict[int, str]
    noun: str = "Record"
    first: int | None = None
    choice: dict[str, Any] | None = None
    footer: str = f"strandspring {__version__}"


def write_page(path: str | Path, page: Page) -> None:
    """Write a page as one HTML file.

    Raises
    ------
    StrandspringError       If the ending does not suit, or the file cannot be written.
    """
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    check_report_path(path)
    environment = Environment(
        loader=PackageLoader("strandspring", "report/assets"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    environment.filters |= {"bound": bound, "drawings": partial(_drawings, papers={})}
    script = resources.files("strandspring").joinpath("report/assets/page.js").read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    data = {"noun": page.noun, "records": page.records, "first": page.first, "choice": page.choice}
    text = environment.get_template("page.html.j2").render(
        page=page,
        colours=(LIGHT, DARK),
        # A file of the package, JSON that cannot end its element, and a hash.
        data=Markup(script_json(data)),  # noqa: S704
        script=Markup(script),  # noqa: S704
        script_hash=Markup(f"'sha256-{digest}'"),  # noqa: S704
    )
    write_text(Path(path), text)


def script_json(value: Any) -> str:
    """JSON that may stand in a script element: nothing in it can end the element.

    Examples
    --------
    >>> script_json("</script>")
    '"\\\\u003c/script\\\\u003e"'
    """
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


class Drawing(NamedTuple):
    """A chart on a page: place of its record where each has its own, SVG, and a name with its swatch for each kind."""

    record: int | None
    svg: Any
    legend: list[tuple[str, str]]


def _drawings(chart: Chart, papers: dict[str, Paper]) -> Iterator[Drawing]:
    """The drawings of a chart, one for each record that is drawn apart; papers are kept by the kinds of sizes."""
    from markupsafe import Markup, escape
    from matplotlib import rc_context

    size = "square" if chart.is_square else "wide" if chart.wide else "half"
    with rc_context({**STYLE, "svg.fonttype": "none", "svg.hashsalt": chart.key, "path.simplify_threshold": 0.3}):
        if size not in papers:
            papers[size] = Paper(_SIZES[size])
        figure, axes = papers[size].figure, papers[size].axes
        width, height = figure.bbox.size
        for record in chart.records or (None,):
            papers[size].draw(chart, record)
            file = io.StringIO()
            figure.savefig(file, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
            (left, bottom), (right, top) = axes.bbox.get_points().tolist()
            box = [round(end, 1) for end in (left, right, height - top, height - bottom)]
            log = [axes.get_xscale() == "log", axes.get_yscale() == "log"]
            units = [(re.findall(r"\[(.*)\]$", name) or [""])[0] for name in (axes.get_xlabel(), axes.get_ylabel())]
            ends = [float(f"{end:.7g}") for end in (*axes.get_xlim(), *axes.get_ylim())]
            scales = str(escape(json.dumps([box, ends, log, units]))) if axes.get_xlabel() else ""
            head = f'<svg class="plot" role="img" aria-labelledby="title-{chart.key}" '
            head += f"viewBox=\"0 0 {width:g} {height:g}\" data-scales='{scales.replace('&#34;', chr(34))}'>"
            content = inline(file.getvalue(), f"{chart.key}-{record or 0}")
            svg = Markup(f"{head}{content}</svg>")  # noqa: S704
            yield Drawing(record, svg, [(name, _swatch(handle)) for name, handle in named(axes).items()])


def _swatch(handle: Any) -> str:
    """How a kind of lines, marks or areas looks in a legend, in CSS."""
    from matplotlib.colors import to_hex

    first = handle[0] if isinstance(handle, tuple) else handle
    if hasattr(first, "get_linestyle") and hasattr(first, "get_color"):
        colour, style = to_hex(first.get_color()), first.get_linestyle() if first.get_marker() in _LINES else "marks"
        kind = {"--": "2px dashed", ":": "2px dotted", "marks": "6px dotted"}.get(style, "2px solid")
    else:
        colour, kind = to_hex(tuple(np.ravel(first.get_facecolor())[:3])), "8px solid"
    return f"border-top: {kind} var(--{_NAMES[colour]}){'; opacity: 0.4' if kind[0] == '8' else ''}"


def inline(svg: str, key: str) -> str:
    """The content of an SVG of matplotlib for a page: identifiers that begin with a key, in the colours of the page.

    Texts stay as they are; matplotlib has escaped them.
    """
    names: dict[str, str] = {}

    def cleaned(tag: re.Match[str]) -> str:
        text = re.sub("#[0-9a-f]{6}", lambda colour: f"var(--{_NAMES.get(colour[0], 'text')})", tag[0])
        text = _IDENTIFIER.sub(lambda name: names.setdefault(name[0], f"{key}-{len(names)}"), text)
        for pattern, instead in _CLEANED:
            text = pattern.sub(instead, text)
        return re.sub(' d="([MLz\\d\\s.-]+)"', _moves, text)

    return _TAG.sub(cleaned, _LAYOUT.sub("", svg))


def _moves(path: re.Match[str]) -> str:
    """A polyline by its moves in tenths of a point, where matplotlib writes every place with six digits."""
    codes, numbers = re.findall("[ML]", path[1]), re.findall(r"-?[\d.]+", path[1])
    places = np.rint(10.0 * np.array(numbers, dtype=float)).astype(int).reshape(-1, 2)
    moves = np.diff(places, axis=0, prepend=[[0, 0]]).tolist()
    words = [
        "h0" if not (x or y) else f"{code.lower()}{x / 10:g} {y / 10:g}"
        for code, (x, y) in zip(codes, moves, strict=True)
    ]
    end = "z" if "z" in path[1] else ""
    return f' d="{_ZERO.sub("", "".join(words))}{end}"'
