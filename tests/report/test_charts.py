"""What charts and tables of reports show, against the numbers that they are made of."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import reports
from strandspring import Finding, Identification, Outcome, StrandspringError
from strandspring.errors import Reader
from strandspring.findings import advised
from strandspring.report import figure
from strandspring.report.content.blocks import Level, Notice, PageContent
from strandspring.report.content.chart import Axis, Chart, ChartForm, Role, Trace, visible
from strandspring.report.content.quantities import MM, NUMBER
from strandspring.report.details import ReportDetails
from strandspring.report.rendering.palette import DARK, LIGHT
from strandspring.report.rendering.panels import Panel, panels_of
from strandspring.report.rendering.report_path import check_report_path
from strandspring.report.report_content import report_content

X = np.linspace(-3.0, 5.0, 60)
pytestmark = pytest.mark.long  # some seconds of identification and drawing

LINE = Trace("measured", X, np.sin(X), Role.MEASURED)


def content_of(identification: Identification) -> PageContent:
    return report_content(identification, identification.spring("a").model, ReportDetails())


def blocks_of(content: PageContent, kind: type[Any]) -> list[Any]:
    return [block for section in content.sections for block in section.blocks if isinstance(block, kind)]


def chart(*traces: Trace, **options: Any) -> Chart:
    """A chart with linear axes unless others are given."""
    chosen = {"x": Axis("x", MM), "y": Axis("y", NUMBER), **options}
    return Chart("key", "Title", traces=traces, sentence="Words.", **chosen)


def polylines(panel: Panel, path: str) -> list[NDArray[np.float64]]:
    """The points of a path in the units of the axes; each of the lines has shape (K, 2)."""
    lines = []
    for move in re.split("^m|M", path.replace("h0", ""))[1:]:
        numbers = np.array(re.findall(r"-?\d+", move), dtype=float).reshape(-1, 2)
        share = np.cumsum(numbers, axis=0) / panel.size * (1.0, -1.0) + (0.0, 1.0)
        for axis, part in zip((panel.x, panel.y), share.T, strict=True):
            low, high = axis.ends
            part[:] = low * (high / low) ** part if axis.axis.log else low + (high - low) * part
        lines.append(share)
    return lines


def unit(panel: Panel) -> NDArray[np.float64]:
    """One unit of the paths, in those of linear axes."""
    return np.array([np.ptp(axis.ends) / size for axis, size in zip((panel.x, panel.y), panel.size, strict=True)])


@pytest.mark.parametrize("form", [ChartForm.LINE, ChartForm.DOTS])
def test_lines_and_dots_are_where_their_points_are(form: ChartForm) -> None:
    y = LINE.y.copy()
    y[20] = np.nan
    (panel,) = panels_of(chart(replace(LINE, y=y, form=form)))
    (shape,) = panel.pieces[0].shapes
    drawn, given = np.concatenate(polylines(panel, shape.path)), np.column_stack([X, y])[np.isfinite(y)]
    assert np.abs((drawn - given) / unit(panel)).max() <= 0.5 + 1e-9  # rounded to whole units


def test_logarithmic_axes_have_ticks_where_they_belong() -> None:
    x, y = np.geomspace(0.3, 80.0, 50), np.geomspace(1e-7, 1e3, 50)
    axes = {"x": Axis("f", NUMBER, log=True), "y": Axis("g", NUMBER, log=True)}
    (panel,) = panels_of(chart(Trace("a", x, y, Role.FIRST), **axes))
    (line,) = polylines(panel, panel.pieces[0].shapes[0].path)
    np.testing.assert_allclose(line, np.column_stack([x, y]), rtol=0.01)  # half of a unit of ten decades by 2500
    low, high = panel.x.ends
    assert [text for _, text in panel.x.ticks] == ["0.5", "1", "2", "5", "10", "20", "50", "100"]
    for place, text in panel.x.ticks:
        assert place == pytest.approx(100.0 * np.log(float(text) / low) / np.log(high / low), abs=0.01)


def test_many_samples_are_thinned_to_what_is_seen() -> None:
    values = np.random.default_rng(1).standard_normal(200_000)
    kept = visible(values, 6000)
    assert kept.size <= 6002
    assert (values[kept].min(), values[kept].max()) == (values.min(), values.max())
    assert (kept[0], kept[-1], (np.diff(kept) > 0).all()) == (0, values.size - 1, True)
    x = np.linspace(0.0, 1.0, values.size)
    y = np.sin(30.0 * x) + 0.2 * values
    (panel,) = panels_of(chart(Trace("noisy", x, y, Role.MODEL)))
    (shape,) = panel.pieces[0].shapes
    assert len(shape.path) < 60_000  # some three points in each of 3000 columns
    (line,) = polylines(panel, shape.path)
    across, up = unit(panel)
    for left in panel.x.ends[0] + across * np.arange(0, 3000, 7):
        # Whatever lies in a column is drawn in it or in its neighbours, up to the threshold and rounding.
        inside = y[(x >= left) & (x < left + across)]
        near = line[(line[:, 0] >= left - 2.0 * across) & (line[:, 0] <= left + 3.0 * across), 1]
        assert not inside.size or near.min() - 2.0 * up <= inside.min() <= inside.max() <= near.max() + 2.0 * up


def test_pieces_records_bars_and_cells() -> None:
    cycles = (("cycle 1", 20, 40), ("cycle 2", 40, 60))
    (whole,), (parts,) = (panels_of(chart(replace(LINE, cycles=cycles, **first))) for first in ({"whole": 20}, {}))
    details = [("cycle 1", True), ("cycle 2", True)]
    assert [(piece.cycle, piece.is_detail) for piece in whole.pieces] == [("", False), *details]
    assert [(piece.cycle, piece.is_detail) for piece in parts.pieces] == [(name, False) for name, _ in details]
    (line,) = polylines(parts, parts.pieces[1].shapes[0].path)
    assert line[[0, -1], 0] == pytest.approx(X[[40, -1]], abs=unit(parts)[0])
    x, y, low = np.array([1.0, 2.0]), np.array([4.0, 5.0]), np.array([1.0, 3.0])
    for form, drawn in ((ChartForm.BARS, "fill"), (ChartForm.BAND, "fill"), (ChartForm.RANGES, "line")):
        (panel,) = panels_of(chart(Trace("t", x, y, Role.SECOND, form, low=low)))
        shapes = panel.pieces[0].shapes
        assert {shape.form for shape in shapes} == {drawn}
        heights = np.concatenate([part for shape in shapes for part in polylines(panel, shape.path)])[:, 1]
        assert (heights.min(), heights.max()) == pytest.approx((1.0, 5.0), abs=unit(panel)[1]), form
    cells = Trace("c", x, y - 3.0, Role.FIRST, ChartForm.CELLS, low=np.array([1.0, 0.25]), texts=("a, b", "b, a"))
    axis = Axis("", NUMBER, limits=(0.5, 2.5), names=("a", "b"))
    (panel,) = panels_of(chart(cells, x=axis, y=axis, is_drawing=True))
    assert [(shape.text, shape.opacity) for shape in panel.pieces[0].shapes] == [("a, b", 1.0), ("b, a", 0.25)]
    assert panel.x.ticks == ((25.0, "a"), (75.0, "b"))


def test_colours_of_one_value_are_one_in_the_dark_too() -> None:
    # A colour is found by its value on a bright page.
    assert LIGHT.keys() == DARK.keys()
    for name, colour in LIGHT.items():
        assert {DARK[other] for other, same in LIGHT.items() if same == colour} == {DARK[name]}


def test_the_report_begins_with_the_verdict_and_keeps_the_words_of_every_caution() -> None:
    def words(*texts: str) -> list[str]:
        return re.sub("[:;.]", "", " ".join(texts).lower()).split()

    found = reports.campaign()
    assert found.verdict is not None
    assert found.verdict.whole is not None
    poor = replace(found.verdict, whole=replace(found.verdict.whole, of_spring=0.7, error=0.7), parts=())
    doubtful = replace(found, findings=(Finding(Outcome.SPIKES, {}, "a.csv"),))
    for one, level in ((found, Level.GOOD), (doubtful, Level.CARE), (replace(found, verdict=poor), Level.POOR)):
        first = blocks_of(content_of(one), Notice)[0]
        assert (first.level, words(first.text)) == (level, words(str(one.verdict)))
    findings = tuple(finding for finding in map(Finding, Outcome) if finding.is_complete)
    every = content_of(replace(reports.plain(), findings=findings))
    said = [words(notice.text, notice.advice or "") for notice in blocks_of(every, Notice)]
    assert [finding.name for finding in findings if words(advised(finding, Reader.FILE)) not in said] == []


def test_figures_for_papers_and_notebooks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from matplotlib.figure import Figure

    for suffix in ("svg", "png", "pdf"):
        for name in "ab":
            figure.write_figure(tmp_path / f"{name}.{suffix}", reports.campaign())
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
    for key in figure.CHARTS:
        axes = Figure().subplots()
        assert figure.plot_chart(reports.campaign(), key, axes, record=1) is axes
        assert axes.lines or axes.collections or axes.images, key
    with pytest.raises(StrandspringError, match="has no chart 'band'"):
        figure.plot_chart(reports.plain(), "band", Figure().subplots())
    monkeypatch.setattr("importlib.util.find_spec", lambda _name: None)
    with pytest.raises(StrandspringError, match=r'pip install "strandspring\[pdf\]"'):
        check_report_path("r.pdf")
