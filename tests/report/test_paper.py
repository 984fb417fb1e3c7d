"""Reports as PDF and figures for papers."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from pypdf import PdfReader

import reports
from strandspring import Identification, StrandspringError
from strandspring.report import figure
from strandspring.report.charts import fit_charts, isolation_charts
from strandspring.report.charts.evaluation import Evaluation
from strandspring.report.content.blocks import Gallery
from strandspring.report.details import ReportDetails
from strandspring.report.rendering.document import COLUMNS, WIDE
from strandspring.report.rendering.drawing import STYLE, paper_figure
from strandspring.report.rendering.report_path import check_report_path
from strandspring.report.report_content import report_content, write_report

pytestmark = pytest.mark.long


def test_a_document_has_the_text_and_the_pages(tmp_path: Path) -> None:
    found = reports.hostile()
    details = ReportDetails(date="2 March", specimen=reports.HOSTILE, fields=(("Lot", "</x> #panic() $1$"),))
    write_report(tmp_path / "r.pdf", found, found.spring("hostile").model, details)
    pages = PdfReader(tmp_path / "r.pdf").pages
    assert 6 <= len(pages) <= 12
    text = "\n".join(page.extract_text() for page in pages).replace("\N{ZERO WIDTH SPACE}", "")
    for words in ("Spring identification: hostile", "2 March", "#panic() $1$", "x$_$y.csv", "kappa_omega"):
        assert words in text
    for words in ("95 % interval", "Prepared: name, date, signature", "SHA-256"):
        assert words in text
    assert "secret" not in text
    assert all(float(page.mediabox.width) == pytest.approx(595.3, abs=0.1) for page in pages)


def test_a_document_is_the_same_twice_and_complete_without_uncertainty(tmp_path: Path) -> None:
    found = reports.plain()
    for name in ("a.pdf", "b.pdf"):
        write_report(tmp_path / name, found, found.spring("plain").model)
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.pdf").read_bytes()
    text = "\n".join(page.extract_text() for page in PdfReader(tmp_path / "a.pdf").pages)
    assert "standard error" not in text
    assert str(tmp_path) not in text


def test_a_missing_typst_is_told_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: None)
    with pytest.raises(StrandspringError, match=r'pip install "strandspring\[pdf\]"'):
        check_report_path("r.pdf")
    check_report_path("r.html")


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_a_figure_is_the_same_twice(tmp_path: Path, suffix: str) -> None:
    for name in ("a", "b"):
        figure.write_figure(tmp_path / f"{name}.{suffix}", reports.hostile())
    assert (tmp_path / f"a.{suffix}").read_bytes() == (tmp_path / f"b.{suffix}").read_bytes()


def test_an_impossible_figure_is_refused(tmp_path: Path) -> None:
    with pytest.raises(StrandspringError, match="A figure must"):
        figure.write_figure(tmp_path / "a.jpg", reports.plain())
    assert not list(tmp_path.iterdir())


def overlaps(paper: Figure) -> list[str]:
    """Texts that lie over each other or beyond the edge, and legends over the data."""
    canvas = FigureCanvasAgg(paper)
    canvas.draw()
    found = []
    for axes in paper.axes:
        low, high = sorted(axes.get_xlim())
        texts = [*(tick.label1 for tick in axes.xaxis.get_major_ticks() if low <= tick.get_loc() <= high)]
        low, high = sorted(axes.get_ylim())
        texts += [tick.label1 for tick in axes.yaxis.get_major_ticks() if low <= tick.get_loc() <= high]
        texts += [axes.xaxis.label, axes.yaxis.label, axes._left_title]  # type: ignore[attr-defined]
        legend = axes.get_legend()
        if legend is not None:
            texts += legend.get_texts()
            if legend.get_window_extent().y0 < axes.get_window_extent().y1 - 1.0:
                found.append("legend over the data")
        boxes = [
            (text.get_text(), text.get_window_extent()) for text in texts if text.get_text() and text.get_visible()
        ]
        for (one, a), (other, b) in combinations(boxes, 2):
            if min(a.x1, b.x1) - max(a.x0, b.x0) > 1.0 and min(a.y1, b.y1) - max(a.y0, b.y0) > 1.0:
                found.append(f"{one} / {other}")
        width, height = canvas.get_width_height()
        found += [
            text for text, box in boxes if box.x0 < -1 or box.y0 < -1 or box.x1 > width + 1 or box.y1 > height + 1
        ]
    return found


@pytest.mark.parametrize("make", [reports.campaign, reports.hostile])
def test_no_texts_overlap_on_paper(make: Callable[[], Identification]) -> None:
    content = report_content(make(), make().spring("a").model, ReportDetails())
    galleries = [block for section in content.sections for block in section.blocks if isinstance(block, Gallery)]
    sized = [(chart, WIDE if chart.wide else COLUMNS[own.columns]) for own in galleries for chart in own.figures]
    loops = fit_charts.loops(Evaluation(make()))
    with mpl.rc_context({**STYLE, "figure.dpi": 150}):
        for chart, width in [*sized, (loops, 60.0), (loops, figure.COLUMN)]:
            assert overlaps(paper_figure(chart, width, content.records)) == [], chart.key


def test_plots_go_into_given_axes() -> None:
    for chart in figure.CHARTS:
        axes = Figure().subplots()
        assert figure.plot_chart(reports.campaign(), chart, axes, record=1) is axes
        assert axes.lines or axes.collections or axes.images, chart
    assert figure.plot_chart.__doc__ is not None
    assert re.findall(r'"([a-z-]+)"', figure.plot_chart.__doc__) == list(figure.CHARTS)


def test_what_is_not_known_is_not_plotted() -> None:
    for chart, reason in (
        ("band", "has no chart 'band'"),
        ("correlations", "has no chart"),
        ("loop", "must be one of"),
    ):
        with pytest.raises(StrandspringError, match=reason):
            figure.plot_chart(reports.plain(), chart, Figure().subplots())
    assert "static load" in str(isolation_charts.transmissibility(Evaluation(reports.plain()), 1e4))
