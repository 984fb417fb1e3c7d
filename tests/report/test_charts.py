"""What charts and tables of reports show, against the numbers that they are made of."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import reports
from strandspring import Finding, Identification, Outcome, ReportDetails, StrandspringError
from strandspring.errors import Reader
from strandspring.findings import advised
from strandspring.report import check_report_path, identification_page
from strandspring.report.drawing import DISPLACEMENT, LIGHT, NUMBER, Chart, Curve, visible
from strandspring.report.identification_page import report_page
from strandspring.report.page import Level, Notice, Page, Section, write_page

X = np.linspace(-3.0, 5.0, 60)
pytestmark = pytest.mark.long  # some seconds of identification and drawing


def content_of(identification: Identification) -> Page:
    return report_page(identification, identification.spring("a").model, identification.parts(False), ReportDetails())


def blocks_of(page: Page, kind: type[Any]) -> list[Any]:
    return [block for section in page.sections for block in section.blocks if isinstance(block, kind)]


def drawn(folder: Path, *curves: Curve, **options: Any) -> tuple[str, Any]:
    """The SVG of a chart on a page, and its scales: box, ends, whether they are logarithmic, units."""
    chart = Chart("key", "Title", "Words.", replace(DISPLACEMENT, factor=1.0), NUMBER, curves, **options)
    write_page(folder / "page.html", Page("T", "", [Section("S", [chart])], {}))
    svg = re.search(r"<svg.*?</svg>", (folder / "page.html").read_text(encoding="utf-8"), re.DOTALL)
    assert svg is not None
    scales = re.search('data-scales="(.*?)"', svg[0])
    assert scales is not None
    return svg[0], json.loads(scales[1].replace("&#34;", '"'))


def polylines(svg: str, colour: str, scales: Any) -> list[NDArray[np.float64]]:
    """The points of the paths of a colour in the units of the axes; each of the lines has shape (K, 2)."""
    box, ends, log, _ = scales
    lines = []
    for path in re.findall(rf'<path d="([^"]*)"[^>]*{LIGHT[colour]}', svg):
        numbers = np.array(re.findall(r"-?[\d.]+", path), dtype=float).reshape(-1, 2)
        share = (numbers - (box[0], box[3])) / (box[1] - box[0], box[2] - box[3])
        for k, part in enumerate(share.T):
            low, high = ends[2 * k : 2 * k + 2]
            part[:] = low * (high / low) ** part if log[k] else low + (high - low) * part
        begins = np.cumsum([move.count("L") + 1 for move in path.split("M")[1:]])[:-1]
        lines += np.split(share, begins)
    return lines


@pytest.mark.parametrize("style", ["-", "."])
def test_lines_and_dots_are_where_their_points_are(style: str, tmp_path: Path) -> None:
    y = np.sin(X)
    y[20] = np.nan
    svg, scales = drawn(tmp_path, Curve(X, y, "a", "model", style))
    points, given = np.concatenate(polylines(svg, "model", scales)), np.column_stack([X, y])[np.isfinite(y)]
    (left, right, top, bottom), ends, *_ = scales
    tenth = 0.1 * np.array([(ends[1] - ends[0]) / (right - left), (ends[3] - ends[2]) / (bottom - top)])
    for place in given if style == "." else points:  # lines leave out points that are not seen
        others = points if style == "." else given
        assert (np.abs(others - place) / tenth).max(axis=1).min() <= 1.1  # the box is rounded to tenths
    assert scales[3] == ["mm", ""]


def test_logarithmic_axes_have_ticks_where_they_belong(tmp_path: Path) -> None:
    x, y = np.geomspace(0.3, 80.0, 50), np.geomspace(1e-7, 1e3, 50)
    svg, scales = drawn(tmp_path, Curve(x, y, "a", "blue"), log="xy")
    (left, right, *_), (low, high, *_), log, _ = scales
    (line,) = polylines(svg, "blue", scales)
    assert log == [True, True]
    np.testing.assert_allclose(line[[0, -1]], [[0.3, 1e-7], [80.0, 1e3]], rtol=0.02)  # a tenth of 140 for ten decades
    ticks = re.findall(r'middle[^"]*" x="([\d.]+)"[^>]*>([\d.]+)</text>', svg)
    assert [text for _, text in ticks] == ["0.5", "1", "2", "5", "10", "20", "50", "100"]
    for place, text in ticks:
        share = np.log(float(text) / low) / np.log(high / low)
        assert float(place) == pytest.approx(left + share * (right - left), abs=0.1)


def test_many_samples_are_thinned_to_what_is_seen(tmp_path: Path) -> None:
    values = np.random.default_rng(1).standard_normal(200_000)
    kept = visible(values, 6000)
    assert kept.size <= 6002
    assert (values[kept].min(), values[kept].max()) == (values.min(), values.max())
    assert (kept[0], kept[-1], (np.diff(kept) > 0).all()) == (0, values.size - 1, True)
    x = np.linspace(0.0, 1.0, values.size)
    y = np.sin(30.0 * x) + 0.2 * values
    svg, scales = drawn(tmp_path, Curve(x, y, "noisy", "model"), form="wide")
    (line,) = polylines(svg, "model", scales)
    assert len(svg) < 60_000
    low, high = scales[1][:2]
    across = (high - low) / 600.0  # about a point
    for left in np.arange(0.0, 1.0, 7.0 * across):
        # Whatever lies in a point of the width is drawn in it or beside it, up to a third of a point.
        inside, beside = (x >= left) & (x < left + across), abs(line[:, 0] - left - 0.5 * across) < 2.5 * across
        near = line[beside, 1]
        assert near.min() - 0.01 <= y[inside].min() <= y[inside].max() <= near.max() + 0.01


def test_names_are_text_and_never_markup_or_colours(tmp_path: Path) -> None:
    name = f"{LIGHT['model']} 1.23456 <b>$x$</b>"
    curves = (Curve(X, X, name, "model", record=3), Curve(X, -X, "other", "blue"))
    texts = [(0.0, 0.0, "#d55e00 1.23456 <i>", "text")]
    svg, _ = drawn(tmp_path, *curves, texts=texts)
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "#d55e00 1.23456 &lt;i&gt;" in svg
    assert "#d55e00 1.23456 &lt;b&gt;$x$&lt;/b&gt;" in page
    assert '<g data-record="3">' in svg
    used = re.findall(r'(?:url\(|href=")#([^)"]+)', svg)
    assert used
    assert all(svg.count(f'id="{one}"') == 1 for one in used)
    assert drawn(tmp_path, *curves, texts=texts)[0] == svg


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
    said = [words(notice.text) for notice in blocks_of(every, Notice)]
    assert [finding.name for finding in findings if words(advised(finding, Reader.FILE)) not in said] == []


def test_figures_for_papers_and_notebooks(tmp_path: Path) -> None:
    from matplotlib.figure import Figure

    for suffix in ("svg", "png", "pdf"):
        for name in "ab":
            identification_page.write_figure(tmp_path / f"{name}.{suffix}", reports.campaign())
        assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()
    for key in identification_page.CHARTS:
        axes = Figure().subplots()
        assert identification_page.plot_chart(reports.campaign(), key, axes, record=1) is axes
        assert axes.lines or axes.collections or axes.patches, key
    with pytest.raises(StrandspringError, match="has no chart 'residuals-velocity'"):
        identification_page.plot_chart(reports.hostile(), "residuals-velocity", Figure().subplots())
    with pytest.raises(StrandspringError, match=r"let the report end in \.html, open it in a browser and print it"):
        check_report_path("r.pdf")
