"""Figures of pages: paths, ticks and texts against the numbers that they are drawn from."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from strandspring.report.content.chart import Axis, Chart, ChartForm, Role, Trace
from strandspring.report.content.quantities import MM, NUMBER
from strandspring.report.rendering.palette import DARK, LIGHT
from strandspring.report.rendering.panels import Panel, panels_of

X = np.linspace(-3.0, 5.0, 60)
LINE = Trace("measured", X, np.sin(X), Role.MEASURED)


def chart(*traces: Trace, **options: object) -> Chart:
    """A chart with linear axes unless others are given."""
    chosen = {"x": Axis("x", MM), "y": Axis("y", NUMBER), **options}
    return Chart("key", "Title", traces=traces, sentence="Words.", **chosen)  # type: ignore[arg-type]


def only(figure: Chart) -> Panel:
    (panel,) = panels_of(figure)
    return panel


def polylines(panel: Panel, path: str) -> list[NDArray[np.float64]]:
    """The points of a path in the units of the axes; each of the lines has shape (K, 2)."""
    lines = []
    for move in re.findall(r"[Mm]([^Mmz]*)", path):
        numbers = np.array(re.findall(r"-?\d+", move.replace("h0", "")), dtype=float).reshape(-1, 2)
        lines.append(np.cumsum(numbers, axis=0))
    shares = [line / panel.size * (1.0, -1.0) + (0.0, 1.0) for line in lines]
    values = []
    for share in shares:
        columns = []
        for axis, part in zip((panel.x, panel.y), share.T, strict=True):
            low, high = axis.ends
            columns.append(low * (high / low) ** part if axis.axis.log else low + (high - low) * part)
        values.append(np.column_stack(columns))
    return values


def unit(panel: Panel) -> NDArray[np.float64]:
    """One unit of the paths, in those of linear axes."""
    return np.array([np.ptp(axis.ends) / size for axis, size in zip((panel.x, panel.y), panel.size, strict=True)])


def test_a_line_is_where_its_points_are() -> None:
    y = LINE.y.copy()
    y[20] = np.nan
    panel = only(chart(replace(LINE, y=y)))
    (piece,) = panel.pieces
    (shape,) = piece.shapes
    lines = polylines(panel, shape.path)
    assert [len(line) for line in lines] == [20, 39]
    drawn, given = np.concatenate(lines), np.column_stack([X, y])[np.isfinite(y)]
    assert np.abs((drawn - given) / unit(panel)).max() <= 0.5 + 1e-9  # rounded to whole units


def test_logarithmic_axes_have_ticks_where_they_belong() -> None:
    x, y = np.geomspace(0.3, 80.0, 50), np.geomspace(1e-7, 1e3, 50)
    axes = {"x": Axis("f", NUMBER, log=True), "y": Axis("g", NUMBER, log=True)}
    panel = only(chart(Trace("a", x, y, Role.FIRST), **axes))
    (line,) = polylines(panel, panel.pieces[0].shapes[0].path)
    np.testing.assert_allclose(line, np.column_stack([x, y]), rtol=0.01)  # half of a unit of ten decades by 2500
    low, high = panel.x.ends
    assert [text for _, text in panel.x.ticks] == ["0.5", "1", "2", "5", "10", "20", "50", "100"]
    for place, text in panel.x.ticks:
        assert place == pytest.approx(100.0 * np.log(float(text) / low) / np.log(high / low), abs=0.01)
    assert 3 <= len(panel.y.ticks) <= 9  # of ten decades


def test_many_samples_are_thinned_to_what_is_seen() -> None:
    rng = np.random.default_rng(5)
    x = np.linspace(0.0, 1.0, 200_000)
    y = np.sin(30.0 * x) + 0.2 * rng.standard_normal(x.size)
    panel = only(chart(Trace("noisy", x, y, Role.MODEL)))
    (shape,) = panel.pieces[0].shapes
    assert len(shape.path) < 60_000  # some three points in each of 3000 columns
    (line,) = polylines(panel, shape.path)
    across, up = unit(panel)
    for k in range(0, 3000, 7):
        # Whatever lies in a column is drawn in it or in its neighbours, up to the threshold and rounding.
        left = panel.x.ends[0] + k * across
        inside = y[(x >= left) & (x < left + across)]
        near = line[(line[:, 0] >= left - 2.0 * across) & (line[:, 0] <= left + 3.0 * across), 1]
        if inside.size:
            assert near.min() - 2.0 * up <= inside.min()
            assert inside.max() <= near.max() + 2.0 * up


def test_dots_and_marks_are_round_and_named() -> None:
    dots = Trace("dots", X, LINE.y, Role.FIRST, ChartForm.DOTS)
    marks = Trace("marks", X[::20], LINE.y[::20], Role.THIRD, ChartForm.MARKS, texts=("<a>", "b", "c"))
    panel = only(chart(dots, marks))
    cloud, named = panel.pieces
    (shape,) = cloud.shapes
    drawn = np.concatenate(polylines(panel, shape.path.replace("h0m", " ")))
    assert np.abs((drawn - np.column_stack([X, LINE.y])) / unit(panel)).max() <= 0.5 + 1e-9
    assert [shape.text for shape in named.shapes] == ["<a>", "b", "c"]
    assert {shape.form for shape in (*cloud.shapes, *named.shapes)} == {"dots"}
    assert named.shapes[0].width > cloud.shapes[0].width > 2.0
    assert [label.text for label in panel.labels] == ["<a>", "b", "c"]


def test_cycles_are_pieces_and_details_are_apart() -> None:
    cycles = (("cycle 1", 20, 40), ("cycle 2", 40, 60))
    whole = only(chart(replace(LINE, whole=20, cycles=cycles)))
    assert [(piece.cycle, piece.is_detail) for piece in whole.pieces] == [
        ("", False), ("cycle 1", True), ("cycle 2", True),
    ]  # fmt: skip
    parts = only(chart(replace(LINE, cycles=cycles)))
    assert [(piece.cycle, piece.is_detail) for piece in parts.pieces] == [("cycle 1", False), ("cycle 2", False)]
    (line,) = polylines(parts, parts.pieces[1].shapes[0].path)
    assert line[[0, -1], 0] == pytest.approx(X[[40, -1]], abs=unit(parts)[0])


def test_a_record_at_a_time_has_a_panel_of_its_own() -> None:
    traces = [replace(LINE, x=X * 10.0**k, record=k) for k in (0, 3)]
    small, large = panels_of(chart(*traces, single=True))
    assert (small.record, large.record) == (0, 3)
    assert np.ptp(large.x.ends) == pytest.approx(1e3 * np.ptp(small.x.ends))
    assert len(panels_of(chart(*traces))) == 1
    assert panels_of(chart(traces[1], single=True))[0].record is None  # nothing to choose from


def test_drawings_are_to_scale() -> None:
    panel = only(chart(Trace("body", np.array([0.0, 40.0]), np.array([0.0, 3.0]), Role.REFERENCE), is_drawing=True))
    across, up = unit(panel)
    assert across == pytest.approx(up, rel=1e-6)


def test_cells_are_squares_about_their_points() -> None:
    x, y = np.array([1.0, 2.0]), np.array([2.0, 1.0])
    cells = Trace("negative", x, y, Role.FIRST, ChartForm.CELLS, low=np.array([1.0, 0.25]), texts=("a, b", "b, a"))
    across, down = (Axis("", NUMBER, limits=limits, names=("a", "b")) for limits in ((0.5, 2.5), (2.5, 0.5)))
    panel = only(chart(cells, x=across, y=down, is_drawing=True))
    (piece,) = panel.pieces
    assert [(shape.text, shape.opacity) for shape in piece.shapes] == [("a, b", 1.0), ("b, a", 0.25)]
    (corners,) = polylines(panel, piece.shapes[0].path)
    assert np.sort(corners[:4, 0]) == pytest.approx([0.53, 0.53, 1.47, 1.47], abs=1e-3)
    assert np.sort(corners[:4, 1]) == pytest.approx([1.53, 1.53, 2.47, 2.47], abs=1e-3)
    assert panel.x.ticks == panel.y.ticks == ((25.0, "a"), (75.0, "b"))


def test_bars_bands_and_ranges_reach_from_low_to_high() -> None:
    x, y, low = np.array([1.0, 2.0]), np.array([4.0, 5.0]), np.array([1.0, 3.0])
    for form, is_filled in ((ChartForm.BARS, True), (ChartForm.BAND, True), (ChartForm.RANGES, False)):
        panel = only(chart(Trace("t", x, y, Role.SECOND, form, low=low)))
        (piece,) = panel.pieces
        assert {shape.form for shape in piece.shapes} == {"fill" if is_filled else "line"}
        points = np.concatenate([part for shape in piece.shapes for part in polylines(panel, shape.path)])
        assert (points[:, 1].min(), points[:, 1].max()) == pytest.approx((1.0, 5.0), abs=unit(panel)[1]), form


def test_colours_of_one_value_are_one_in_the_dark_too() -> None:
    # A colour is found by its value on a bright page.
    assert LIGHT.keys() == DARK.keys()
    for name, colour in LIGHT.items():
        assert {DARK[other] for other, same in LIGHT.items() if same == colour} == {DARK[name]}
