"""Figures as panels of a page: what matplotlib draws, as paths of SVG whose colours are those of the page.

The paths fill the area between the axes, which a page stretches to the room that it has; lines keep their widths, and
texts stand beside it in the font of the page. A chart of one record at a time has a panel for each record.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

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
from ..content.chart import Axis, Chart, Figure, HeatMap, Trace
from ..content.quantities import NUMBER, number
from .drawing import FIRST_ORDER, STYLE, draw_chart, draw_heat_map, shortened
from .palette import LIGHT

# In inches, with letters as high as on paper: as many ticks and labels as fit on a phone.
_SIZE, _SQUARE = (2.4, 2.0), (2.4, 2.4)
_UNITS = 1250  # of the paths, an inch: a third of a pixel where a panel is as wide as a page
_SCALE = 2.0  # of line widths and distances [CSS pixels a point]
_COLOURS = {colour: name for name, colour in reversed(LIGHT.items())}
_ANCHORS = {"left": "start", "center": "middle", "right": "end"}
_DOWN = {"bottom": 0.0, "center": 4.0, "top": 9.0}  # from a text's place to its base line [CSS pixels]


@dataclass(frozen=True)
class Shape:
    """A path; `form` is "line", "fill" or "dots", `width` and `dash` are in CSS pixels, `text` says what it is."""

    form: str
    colour: str
    opacity: float
    width: float
    dash: str
    path: str
    text: str


@dataclass(frozen=True)
class Piece:
    """A trace, or a cycle of it; details are seen only while their cycle is chosen."""

    name: str
    record: int | None
    cycle: str
    is_detail: bool
    shapes: tuple[Shape, ...]


@dataclass(frozen=True)
class PanelAxis:
    """An axis, its ends, and its ticks with their places in percent from the left or the top."""

    axis: Axis
    ends: tuple[float, float]
    ticks: tuple[tuple[float, str], ...]

    @property
    def letters(self) -> int:
        """Of its longest tick."""
        return max((len(text) for _, text in self.ticks), default=0)


@dataclass(frozen=True)
class Label:
    """A text beside a point: place of the point in percent from the left and the top, and the way to the text."""

    x: float
    y: float
    text: str
    colour: str
    anchor: str
    shift: tuple[float, float]


@dataclass(frozen=True)
class Panel:
    """One drawing of a figure.

    Attributes
    ----------
    record : int or None     Place of its record, if other panels show other records.
    size : (int, int)        Of the area between the axes, in units of the paths.
    x, y : PanelAxis
    legend : tuple of (name, colour, form)
    pieces : tuple of Piece
    labels : tuple of Label
    is_fixed : bool          Whether zooming makes no sense.
    """

    record: int | None
    size: tuple[int, int]
    x: PanelAxis
    y: PanelAxis
    legend: tuple[tuple[str, str, str], ...]
    pieces: tuple[Piece, ...]
    labels: tuple[Label, ...]
    is_fixed: bool


def panels_of(figure: Figure) -> list[Panel]:
    """The panels of a figure, in the order of its records."""
    records: list[int | None] = []
    if isinstance(figure, Chart) and figure.single:
        records = list(dict.fromkeys(trace.record for trace in figure.traces if trace.record is not None))
    # The threshold is in units of the paths.
    with rc_context({**STYLE, "path.simplify_threshold": 1.0}):
        return [_panel(figure, record) for record in (records if len(records) > 1 else [None])]


def _panel(figure: Figure, record: int | None) -> Panel:
    is_square = isinstance(figure, HeatMap) or figure.is_drawing
    axes = Paper(_SQUARE if is_square else _SIZE, dpi=_UNITS).add_axes((0.0, 0.0, 1.0, 1.0))
    canvas = _Canvas(axes.bbox.height)
    if isinstance(figure, HeatMap):
        draw_heat_map(figure, axes)
        x = y = Axis("", NUMBER, names=figure.labels)
        texts = [f"{one}, {other}: {number(value, 3)}" for one, values in zip(figure.labels, figure.values, strict=True)
                 for other, value in zip(figure.labels, values.tolist(), strict=True)]  # fmt: skip
        shapes = canvas.shapes_of(_artists(axes), texts)
        legend = [("negative", "blue", "bars"), ("positive", "model", "bars")]
        pieces = [
            Piece(name, None, "", False, tuple(shape for shape in shapes if shape.colour == colour))
            for name, colour, _ in legend
        ]
    else:
        x, y = figure.x, figure.y
        parts = [part for trace in figure.traces if record in (None, trace.record) for part in _parts(trace)]
        traces = tuple(trace for trace, _, _ in parts)
        draw_chart(replace(figure, traces=traces), axes, None, _SCALE, shortened)
        axes.autoscale_view()  # else both wait for a drawing of the whole
        axes.apply_aspect()
        artists = _artists(axes)
        pieces = [
            Piece(trace.name, trace.record, cycle, is_detail,
                  canvas.shapes_of([own for own in artists if int(own.zorder) == order], trace.texts))
            for order, (trace, cycle, is_detail) in enumerate(parts, FIRST_ORDER)
        ]  # fmt: skip
        named: dict[str, Trace] = {}
        for trace in traces:
            named.setdefault(trace.name, trace)
        legend = [(name, of.role.value, of.form.value.replace(" ", "-")) for name, of in named.items() if name]
    return Panel(
        record, (round(axes.bbox.width), round(axes.bbox.height)), _axis(axes, x, "x"), _axis(axes, y, "y"),
        tuple(legend if len(legend) > 1 else ()), tuple(pieces), tuple(_labels(axes)), bool(is_square or x.names),
    )  # fmt: skip


def _parts(trace: Trace) -> Iterator[tuple[Trace, str, bool]]:
    """What a trace is drawn from, the cycle that each part is, and whether it is seen only with its cycle."""
    if not trace.cycles or trace.whole is not None:
        yield replace(trace, x=trace.x[: trace.shown], y=trace.y[: trace.shown]) if trace.cycles else trace, "", False
    for label, start, stop in trace.cycles:
        yield replace(trace, x=trace.x[start:stop], y=trace.y[start:stop]), label, trace.whole is not None


def _artists(axes: Axes) -> list[Artist]:
    return sorted([*axes.collections, *axes.patches, *axes.lines], key=lambda artist: artist.zorder)


def _axis(axes: Axes, axis: Axis, way: str) -> PanelAxis:
    drawn, (low, high) = (axes.xaxis, axes.get_xlim()) if way == "x" else (axes.yaxis, axes.get_ylim())
    places = [place for place in drawn.get_majorticklocs().tolist() if min(low, high) <= place <= max(low, high)]
    texts = drawn.get_major_formatter().format_ticks(places)
    if axis.names:
        texts = [shortened(text, 30) for text in texts]
    points = np.array([(place, axes.get_ylim()[0]) if way == "x" else (axes.get_xlim()[0], place) for place in places])
    shares = axes.transAxes.inverted().transform(axes.transData.transform(points.reshape(-1, 2)))
    percents = 100.0 * (shares[:, 0] if way == "x" else 1.0 - shares[:, 1])
    ticks = zip(percents.round(2).tolist(), texts, strict=True)
    return PanelAxis(axis, (float(low), float(high)), tuple((place, text) for place, text in ticks if text))


def _labels(axes: Axes) -> Iterator[Label]:
    for text in axes.texts:
        if not isinstance(text, Annotation):
            continue
        x, y = 100.0 * axes.transAxes.inverted().transform(axes.transData.transform(text.xy))
        right, up = text.xyann
        shift = (_SCALE * right, _DOWN[text.get_verticalalignment()] - _SCALE * up)
        yield Label(round(x, 2), round(100.0 - y, 2), text.get_text(), _COLOURS[to_hex(text.get_color())],
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

    def draw_path(
        self, gc: GraphicsContextBase, path: Outline, transform: Transform, rgbFace: Any = None
    ) -> None:  # fmt: skip
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
        outline, points = np.asarray(marker_path.codes), np.asarray(path.vertices)
        if len(np.asarray(marker_path.vertices)) == 2:
            return  # ends of error bars would be stretched with the paths
        if Outline.CURVE4 not in outline:
            super().draw_markers(gc, marker_path, marker_trans, path, trans, rgbFace)
            return
        # A line without length and with round ends is a dot, however the paths are stretched.
        width = marker_path.get_extents(marker_trans).width * 72.0 / _UNITS + gc.get_linewidth()
        points = self._rounded(trans.transform(points[np.isfinite(points).all(axis=1)]))
        if self._texts:
            for x, y in points.tolist():
                self._add("dots", rgbFace, f"M{x} {y}h0", width)
        elif points.size:
            points = np.unique(points, axis=0)
            moves = np.diff(points, axis=0, prepend=[[0, 0]]).tolist()
            self._add("dots", rgbFace, "".join(f"m{x} {y}h0" for x, y in moves).replace(" -", "-"), width)

    def _add(self, form: str, colour: Any, path: str, width: float = 0.0, dash: str = "") -> None:
        text = self._texts.pop() if self._texts else ""
        opacity = float(colour[3]) if len(colour) > 3 else 1.0
        self._shapes.append(
            Shape(form, _COLOURS[to_hex(colour[:3])], round(opacity, 3), round(width, 2), dash, path, text)
        )

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
