"""A page that opens offline: what it consists of, and `write_page`.

It holds everything: text, styles, figures as SVG, and a script that lets records be chosen and figures be read and
zoomed. Its content security policy lets it load nothing else and run no other script.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from .._version import __version__
from ..ground.files import write_text
from ..ground.result_columns import ResultColumn, texts
from . import check_report_path
from .drawing import LIGHT, STYLE, Chart, printed

_SIZES = {"wide": (8.8, 2.75), "half": (4.3, 2.3), "square": (4.3, 4.3)}  # of figures [inches]
_LEFT, _RIGHT, _BELOW, _ABOVE, _LETTER = 46.0, 12.0, 28.0, 6.0, 3.8  # room about axes, and of a letter [points]
_SWATCHES = {"-": "2px solid {}", ":": "2px dotted {}", "band": "8px solid {}; opacity: 0.4", "--": "2px dashed {}"}
_MARKS = "6px dotted {}"  # other swatches of legends
_SVG = '<svg class="plot" role="img" aria-labelledby="title-{}" viewBox="0 0 {:g} {:g}" data-scales="{}">{}</svg>'


class Level(Enum):
    """How it is meant; the value names its colour."""

    GOOD = "green"
    INFORMATION = "blue"
    CARE = "care"
    POOR = "poor"


class Notice(NamedTuple):
    """A highlighted finding."""

    level: Level
    text: str


class Tile(NamedTuple):
    """One figure that is to be seen first."""

    label: str
    value: str
    unit: str
    note: str


class Table(NamedTuple):
    """A table; its first column names a row."""

    title: str
    columns: Sequence[ResultColumn]
    rows: Sequence[Any]


class Source(NamedTuple):
    """The text of a file as it is."""

    text: str


def plain(title: str, headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Table:
    """A table of texts; an empty one is a line to write on."""
    columns = [ResultColumn(heading, "", heading, heading) for heading in headings]
    return Table(title, columns, [dict(zip(headings, row, strict=True)) for row in rows])


Parts = Iterable[Any]  # of a result: lines, and whatever has the attributes of a `Table`


@dataclass(frozen=True, eq=False)
class Section:
    """A heading with what belongs to it; folded ones are opened by it, empty ones left out.

    Its blocks are texts, each a paragraph, and instances of the classes above and of `Chart`.
    """

    title: str
    blocks: Sequence[Any]
    is_folded: bool = False

    @property
    def groups(self) -> Iterator[tuple[str, list[Any]]]:
        """Blocks that follow each other, by the name of their kind."""
        return ((kind.__name__, list(blocks)) for kind, blocks in groupby(self.blocks, type))


@dataclass(frozen=True, eq=False)
class Page:
    """A page."""

    title: str
    subtitle: str
    sections: Sequence[Section]
    records: Mapping[int, str]  # their names by their places, to choose from
    noun: str = "Record"
    first: int | None = None  # of the records, shown first; None for all
    cycles: int = 0  # that can be chosen
    options: Mapping[str, str] = field(default_factory=dict)  # that choose what is zoomed into, by charts
    levels: Mapping[str, Level] = field(default_factory=dict)  # of cells of tables with such a text
    files: Mapping[str, str] = field(default_factory=dict)  # names for paths
    footer: str = f"strandspring {__version__}"

    def said(self, text: str) -> str:
        """A text without folders."""
        for path in sorted(self.files, key=len, reverse=True):
            text = text.replace(path, self.files[path])
        return text


def write_page(path: str | Path, page: Page) -> None:
    """Write a page as one file; raises StrandspringError if its ending is wrong or it cannot be written."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    check_report_path(path)
    environment = Environment(
        loader=PackageLoader("strandspring", "report/assets"), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    papers: dict[Any, Any] = {}
    environment.filters.update(
        said=page.said,
        printed=lambda text: printed(page.said(text)),
        panels=lambda chart: _panels(chart, papers),
        cells=lambda table: [*zip(*texts(table.columns, table.rows).values(), strict=True)],
        headings=lambda table: [column.heading for column in texts(table.columns, table.rows)],
        sha256=lambda script: base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
    )
    write_text(Path(path), environment.get_template("page.html.j2").render(page=page))


def _panels(chart: Chart, papers: dict[Any, Any]) -> Iterator[tuple[int | None, str, dict[str, str]]]:
    """Of each panel the place of its record, if it has one, its SVG, and the looks of its legend.

    Axes of one kind are used again, as making them takes longer than all the rest.
    """
    from markupsafe import Markup
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    width, height = (72.0 * inches for inches in _SIZES[chart.form])
    below = max([_BELOW, *(8.0 + _LETTER * min(len(name), 30) for name in chart.places)])
    room = (_LEFT / width, below / height, 1.0 - (_LEFT + _RIGHT) / width, 1.0 - (below + _ABOVE) / height)
    kind = (room, chart.log, *chart.places)
    records = sorted({curve.record for curve in chart.curves if curve.record is not None})
    for record in records if chart.is_apart else [None]:
        look: Any = {"svg.hashsalt": f"{chart.key}-{record}", "svg.fonttype": "none", "path.simplify_threshold": 0.3}
        with rc_context({**STYLE, **look}), io.StringIO() as file:
            if kind not in papers:
                figure = Figure(_SIZES[chart.form], dpi=72, facecolor="none")
                papers[kind] = figure, figure.add_axes(room, facecolor="none")
            figure, axes = papers[kind]
            for artist in (*axes.lines, *axes.collections, *axes.texts):
                artist.remove()
            axes.relim()
            axes.autoscale(True)
            chart.draw(axes, record, has_legend=False)
            figure.savefig(file, format="svg", metadata=dict.fromkeys(("Date", "Creator", "Format", "Type")))
            content = inline(file.getvalue())
        (left, bottom), (right, top) = axes.bbox.get_points().tolist()
        box = [round(end, 1) for end in (left, right, height - top, height - bottom)]
        ends = [float(f"{end:.7g}") for end in (*axes.get_xlim(), *axes.get_ylim())]
        # Where the axes are, their ends, which are logarithmic, and their units, for the pointer.
        scales = json.dumps([box, ends, ["x" in chart.log, "y" in chart.log], [chart.x.shown, chart.y.shown]])
        # matplotlib has escaped the texts.
        svg = Markup(_SVG).format(chart.key, width, height, scales, Markup(content))  # noqa: S704
        named = chart.named(record).items()
        looks = {name: _SWATCHES.get(of.style, _MARKS).format(LIGHT[of.colour]) for name, of in named}
        yield record, svg, looks if len(looks) > 1 else {}


def inline(svg: str) -> str:
    """The content of an SVG for a page: no names but those of clips, and fewer digits; texts stay."""

    def cleaned(tag: re.Match[str]) -> str:
        words = re.sub(r' id="record-(\d+)"', r' data-record="\1"', tag[0])
        words = re.sub(r' id="(?![a-z][\da-f]{10}")[^"]*"|font-family: [^;"]*;? ?', "", words)
        return re.sub(r"(\.\d\d)\d+", r"\1", words)

    return re.sub(r"<[^>]*>", cleaned, re.sub(r"(?s)\A.*?(?=<g)|</svg>", "", svg))
