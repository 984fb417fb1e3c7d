"""Charts as panels of a page: what matplotlib draws, as paths of SVG whose colours are those of the page.

The paths fill the area between the axes, which a page stretches to the room that it has; lines keep their widths, and
texts stand beside it in the font of the page. A chart of one record at a time has a panel for each record.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import GraphicsContextBase, RendererBase
from matplotlib.colors import to_hex
from matplotlib.figure import Figure as Paper
from matplotlib.path import Path as Outline
from matplotlib.text import Annotation
from matplotlib.transforms import Transform

from ...kernel.arrays import FloatArray
from ..content.chart import Axis, Chart, Trace
from .drawing import FIRST_ORDER, STYLE, draw_bare, shortened
from .palette import LIGHT

# In inches, with letters as high as on paper: as many ticks and labels as fit on a phone.
_SIZE, _SQUARE = (2.4, 2.0), (2.4, 2.4)
_UNITS = 1250  # of the paths, an inch: a third of a pixel where a panel is as wide as a page
_SCALE = 2.0  # of line widths and distances [CSS pixels a point]
_COLOURS = {colour: name for name, colour in reversed(LIGHT.items())}
_ANCHORS = {"left": "start", "center": "middle", "right": "end"}
_DOWN = {"bottom": 0.0, "center": 4.0, "top": 9.0}  # from a text's place to its base line [CSS pixels]


class Shape(NamedTuple):
    """A path; `form` is "line", "fill" or "dots", `width` and `dash` are in CSS pixels, `text` says what it is."""

    form: str
    colour: str
    opacity: float
    width: float
    dash: str
    path: str
    text: str


class Piece(NamedTuple):
    """A trace, or a cycle of it; details are seen only while their cycle is chosen."""

    trace: Trace
    cycle: str
    is_detail: bool
    shapes: tuple[Shape, ...] = ()


class PanelAxis(NamedTuple):
    """An axis, its ends, and its ticks with their places in percent from the left or the top."""

    axis: Axis
    ends: tuple[float, float]
    ticks: tuple[tuple[float, str], ...]


class Label(NamedTuple):
    """A text beside a point: place of the point in percent from the left and the top, and the way to the text."""

    x: float
    y: float
    text: str
    colour: str
    anchor: str
    shift: tuple[float, float]


@dataclass(frozen=True)
class Panel:
    """One drawing of a chart.

    Attributes
    ----------
    record : int or None     Place of its record, if other panels show other records.
    size : (int, int)        Of the area between the axes, in units of the paths.
    x, y : PanelAxis
    pieces : tuple of Piece
    labels : tuple of Label
    """

    record: int | None
    size: tuple[int, int]
    x: PanelAxis
    y: PanelAxis
    pieces: tuple[Piece, ...]
    labels: tuple[Label, ...]

    @property
    def legend(self) -> dict[str, Trace]:
        """The first trace of each name; empty without two of them."""
        named: dict[str, Trace] = {}
        for piece in self.pieces:
            named.setdefault(piece.trace.name, piece.trace)
        named.pop("", None)
        return named if len(named) > 1 else {}


def panels_of(chart: Chart) -> list[Panel]:
    """The panels of a chart, in the order of its records."""
    records = dict.fromkeys(trace.record for trace in chart.traces if trace.record is not None) if chart.single else {}
    # The threshold is in units of the paths.
    with rc_context({**STYLE, "path.simplify_threshold": 1.0}):
        return [_panel(chart, record) for record in (records if len(records) > 1 else [None])]


def _panel(chart: Chart, record: int | None) -> Panel:
    axes = Paper(_SQUARE if chart.is_drawing else _SIZE, dpi=_UNITS).add_axes((0.0, 0.0, 1.0, 1.0))
    pieces = [piece for trace in chart.traces if record in (None, trace.record) for piece in _pieces(trace)]
    draw_bare(replace(chart, traces=tuple(piece.trace for piece in pieces)), axes, _SCALE, shortened)
    axes.autoscale_view()  # else both wait for a drawing of the whole
    axes.apply_aspect()
    artists = sorted([*axes.collections, *axes.patches, *axes.lines], key=lambda artist: artist.zorder)
    width, height = axes.bbox.size
    canvas = _Canvas(height)
    drawn = [
        piece._replace(shapes=canvas.shapes_of([own for own in artists if int(own.zorder) == order], piece.trace.texts))
        for order, piece in enumerate(pieces, FIRST_ORDER)
    ]
    return Panel(record, (round(width), round(height)), _axis(axes, chart.x, 0), _axis(axes, chart.y, 1), tuple(drawn),
                 tuple(_labels(axes)))  # fmt: skip


def _pieces(trace: Trace) -> Iterator[Piece]:
    """What a trace is drawn from, without shapes."""
    if not trace.cycles:
        yield Piece(trace, "", False)
    elif trace.whole is not None:
        yield Piece(replace(trace, x=trace.x[: trace.whole], y=trace.y[: trace.whole]), "", False)
    for label, start, stop in trace.cycles:
        part = replace(trace, x=trace.x[start:stop], y=trace.y[start:stop], whole=None)
        yield Piece(part, label, trace.whole is not None)


def _axis(axes: Axes, axis: Axis, way: int) -> PanelAxis:
    drawn, ends = ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim()))[way]
    values = [value for value in drawn.get_majorticklocs().tolist() if min(ends) <= value <= max(ends)]
    points = np.full((len(values), 2), (axes.get_xlim()[0], axes.get_ylim()[0]))
    points[:, way] = values
    places = _percent(axes, points)[:, way].tolist()
    ticks = zip(places, drawn.get_major_formatter().format_ticks(values), strict=True)
    return PanelAxis(axis, (float(ends[0]), float(ends[1])), tuple(ticks))


def _percent(axes: Axes, points: Any) -> FloatArray:
    """Places of points from the left and the top, shape (K, 2)."""
    shares = axes.transAxes.inverted().transform(axes.transData.transform(points))
    return np.round(100.0 * np.abs((0.0, 1.0) - shares), 2)


def _labels(axes: Axes) -> Iterator[Label]:
    for text in axes.texts:
        if isinstance(text, Annotation):
            ((x, y),), (right, up) = _percent(axes, [text.xy]).tolist(), text.xyann
            shift = (_SCALE * right, _DOWN[text.get_verticalalignment()] - _SCALE * up)
            yield Label(x, y, text.get_text(), _COLOURS[to_hex(text.get_color())],
                        _ANCHORS[text.get_horizontalalignment()], shift)  # fmt: skip


class _Canvas(RendererBase):
    """Turns what artists of matplotlib draw into shapes."""

    def __init__(self, height: float) -> None:
        super().__init__()
        self._height = height
        self._shapes: list[Shape] = []
        self._texts: list[str] = []

    def shapes_of(self, artists: Sequence[Artist], texts: Sequence[str]) -> tuple[Shape, ...]:
        """What artists draw; one text for each shape or point, or none."""
        self._shapes, self._texts = [], list(texts)[::-1]
        for artist in artists:
            artist.draw(self)
        return tuple(shape for shape in self._shapes if shape.path)

    def points_to_pixels(self, points: Any) -> Any:
        return points * _UNITS / 72.0

    def draw_path(self, gc: GraphicsContextBase, path: Outline, transform: Transform, rgbFace: Any = None) -> None:
        outline = self._outline(path, transform)
        if rgbFace is not None:
            self._add("fill", rgbFace, outline)
        if gc.get_linewidth() > 0.0:
            _, dashes = gc.get_dashes()
            dash = "" if dashes is None else " ".join(f"{length:.3g}" for length in np.ravel(dashes).tolist())
            self._add("line", gc.get_rgb(), outline, gc.get_linewidth(), dash)

    def draw_markers(
        self, gc: GraphicsContextBase, marker_path: Outline, marker_trans: Transform, path: Outline, trans: Transform,
        rgbFace: Any = None,
    ) -> None:  # fmt: skip
        if len(np.asarray(marker_path.vertices)) == 2:
            return  # ends of error bars would be stretched with the paths
        if Outline.CURVE4 not in np.asarray(marker_path.codes):
            super().draw_markers(gc, marker_path, marker_trans, path, trans, rgbFace)
            return
        # A line without length and with round ends is a dot, however the paths are stretched.
        width = marker_path.get_extents(marker_trans).width * 72.0 / _UNITS + gc.get_linewidth()
        vertices = np.asarray(path.vertices)
        points = self._rounded(trans.transform(vertices[np.isfinite(vertices).all(axis=1)]))
        if self._texts:
            for x, y in points.tolist():
                self._add("dots", rgbFace, f"M{x} {y}h0", width)
        elif points.size:
            moves = np.diff(np.unique(points, axis=0), axis=0, prepend=[[0, 0]]).tolist()
            self._add("dots", rgbFace, "".join(f"m{x} {y}h0" for x, y in moves).replace(" -", "-"), width)

    def _add(self, form: str, colour: Any, path: str, width: float = 0.0, dash: str = "") -> None:
        text = self._texts.pop() if self._texts else ""
        opacity = float(colour[3]) if len(colour) > 3 else 1.0
        name = _COLOURS[to_hex(colour[:3])]
        self._shapes.append(Shape(form, name, round(opacity, 3), round(width, 2), dash, path, text))

    def _rounded(self, points: FloatArray) -> Any:
        return np.rint(points * (1.0, -1.0) + (0.0, self._height)).astype(int)

    def _outline(self, path: Outline, transform: Transform) -> str:
        """Relative moves in whole units, without those that are not seen."""
        clean = path.cleaned(transform, remove_nans=True, simplify=path.should_simplify)
        points, codes = self._rounded(np.asarray(clean.vertices)), np.asarray(clean.codes)
        begins = np.flatnonzero(codes == Outline.MOVETO)
        words = []
        for begin, end in zip(begins, [*begins[1:], len(points)], strict=True):
            own = points[begin:end][np.isin(codes[begin:end], (Outline.MOVETO, Outline.LINETO))]
            moves = np.diff(own, axis=0)
            moves = moves[moves.any(axis=1)].ravel().tolist()
            words.append(f"M{own[0, 0]} {own[0, 1]}l{' '.join(map(str, moves)) or '0 0'}".replace(" -", "-"))
            if Outline.CLOSEPOLY in codes[begin:end]:
                words.append("z")
        return "".join(words)
