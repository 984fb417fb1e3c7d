"""What a report says, whatever its form."""

from __future__ import annotations

import doctest
from dataclasses import replace
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import reports
from springs import TABLE
from strandspring import Finding, Identification, Outcome, StrandspringError, identify
from strandspring.model.modelfile import ModelFile
from strandspring.report import details, figure
from strandspring.report.charts import engineering, fit_charts
from strandspring.report.charts.engineering import EngineeringFigures
from strandspring.report.charts.evaluation import SHOWN_CYCLES, SHOWN_RECORDS, Evaluation
from strandspring.report.content import chart as charts
from strandspring.report.content import quantities
from strandspring.report.content.blocks import Facts, Gallery, Level, Notice, PageContent, PageTable, Text
from strandspring.report.content.chart import Chart, visible
from strandspring.report.details import ReportDetails
from strandspring.report.rendering import drawing, page
from strandspring.report.rendering.page import script_json
from strandspring.report.rendering.report_path import check_report_path
from strandspring.report.report_content import report_content
from synthetic import record_of, sine, spring_of

pytestmark = pytest.mark.long


def content_of(identification: Identification, **details: object) -> PageContent:
    return report_content(identification, identification.spring("a").model, ReportDetails(**details))  # type: ignore[arg-type]


def table_of(content: PageContent, title: str) -> PageTable:
    blocks = [block for section in content.sections for block in section.blocks if isinstance(block, PageTable)]
    return next(block for block in blocks if block.title == title)


def notices(content: PageContent) -> list[Notice]:
    return [block for section in content.sections for block in section.blocks if isinstance(block, Notice)]


def test_parameters_are_one_table_with_digits_that_mean_something() -> None:
    found = reports.campaign()
    rows = {row[0]: row for row in table_of(content_of(found), "Parameters").rows}
    assert len(rows) == 4 + 4 + 3
    for name in ("kappa_omega", "rho", "sigma", "n"):
        value, error = getattr(found.parameters, name), found.uncertainty[name]
        # Half a unit of the error's second digit at most.
        assert abs(float(rows[name][2]) - value) < 0.06 * error
        assert float(rows[name][4]) == pytest.approx(error, rel=0.05)
        low, high = map(float, rows[name][5].split(" to "))
        assert (low, high) == pytest.approx(found.uncertainty["interval_95"][name], abs=0.06 * error)
    assert rows["kE[2]"][3] == "N/m²"


def test_a_table_of_fe_is_shown_by_its_knots() -> None:
    found = replace(reports.plain(), parameters=TABLE)
    content = report_content(found, ModelFile("a", TABLE), ReportDetails())
    rows = table_of(content, "Parameters").rows
    assert rows[4][:4] == ("FE_forces[0]", "elastic force at 30 mm", "−52.9977", "N")
    assert len(rows[0]) == 4  # no errors, no columns for them
    blocks = [block for section in content.sections for block in section.blocks if isinstance(block, Facts)]
    labels = [fact[0] for block in blocks for fact in block.pairs]
    assert "FA about" in labels
    assert "Polynomials about" not in labels


def test_the_report_begins_with_the_verdict() -> None:
    found = reports.campaign()
    assert found.verdict is not None
    assert found.verdict.whole is not None
    content = content_of(found)
    first = content.sections[0].blocks[0]
    assert isinstance(first, Notice)
    assert first.level is Level.GOOD
    assert first.text.lower().split() == f"{found.verdict}.".lower().split()
    rows = table_of(content, "Held-out error").rows
    assert [row[0] for row in rows] == ["this spring", *found.verdict.whole.plain]
    doubtful = replace(found, findings=(Finding(Outcome.SPIKES, {}, "a.csv"),))
    assert notices(content_of(doubtful))[0].level is Level.CARE
    poor = replace(found.verdict, whole=replace(found.verdict.whole, of_spring=0.7, error=0.7), parts=())
    assert notices(content_of(replace(found, verdict=poor)))[0].level is Level.POOR
    assert notices(content_of(reports.plain()))[0].text.startswith("Not tested on held-out strokes")


@pytest.mark.parametrize("outcome", list(Outcome))
def test_every_caution_keeps_its_words(outcome: Outcome) -> None:
    content = content_of(replace(reports.plain(), findings=(Finding(outcome),)))
    last = notices(content)[-1]
    words = f"{last.text} {last.advice}".lower().replace(":", "").replace(";", "").replace(".", "").split()
    assert words == outcome.value.lower().replace(":", "").replace(";", "").replace(".", "").split()


def test_both_figures_stand_beside_each_other_where_they_differ() -> None:
    found = reports.lagging()
    own, fitted = found.figures, found.fitted_figures
    assert own["rnl"] < fitted["rnl"] - 0.02
    content = content_of(found)
    table = table_of(content, "Records and fit")
    (row,) = table.rows
    shown = dict(zip(table.header, row, strict=True))
    assert float(shown["RNL"]) == pytest.approx(own["rnl"], abs=1e-4)
    assert float(shown["RNL as fitted"]) == pytest.approx(fitted["rnl"], abs=1e-4)
    assert float(shown["energy / measured"]) == pytest.approx(own["predicted_energy"] / own["energy"], rel=3e-3)
    texts = " ".join(block.text for section in content.sections for block in section.blocks if isinstance(block, Text))
    assert f"RNL {own['rnl']:.4f}" in texts
    assert f"as fitted, with what was removed, it is RNL {fitted['rnl']:.4f}" in texts
    assert "RNL as fitted" not in table_of(content_of(reports.plain()), "Records and fit").header


def test_charts_show_the_saved_spring_along_the_displacement_as_recorded() -> None:
    found = reports.lagging()
    (record,), of = found.records, Evaluation(found)
    alone = found.spring().response(record.displacement, found.fits[0].omega_start)
    (view,) = of.views
    np.testing.assert_allclose(view.fit.predicted, alone, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(view.residuals, record.force - alone, rtol=0.0, atol=1e-9)
    traces = {trace.name: trace for trace in fit_charts.loops(of).traces}
    assert np.nanmax(traces["model"].y) == pytest.approx(alone[view.first :].max(), rel=0.01)
    assert np.nanmax(traces["as fitted"].y) == pytest.approx(view.fitted.predicted[view.first :].max(), rel=0.01)
    assert "as fitted" not in {trace.name for trace in fit_charts.loops(Evaluation(reports.plain())).traces}


def test_engineering_figures_compare_measured_with_modelled() -> None:
    rows = table_of(content_of(reports.campaign()), "Stiffness, energy per cycle and loss factor by amplitude").rows
    assert [row[0] for row in rows if row[0]] == ["5", "8", "10", "15", "20"]
    differences = [row for row in rows if row[1] == "difference"]
    assert len(differences) == 2
    for row in differences:
        # 3 cycles of 300 samples with 2 % of noise: far below 2 %.
        assert all(abs(float(cell.removesuffix(" %").replace("−", "-"))) < 2.0 for cell in row[2:])


def test_trends_compare_cycles_of_one_amplitude() -> None:
    """Three large cycles of which the last is 2 % stiffer, then three small ones."""
    displacement = np.concatenate([size * np.sin(np.linspace(0.0, 6.0 * np.pi, 900)) for size in (0.02, 0.01)])
    record = record_of(spring_of(1.0, 1.0), displacement)
    stiffer = np.where((np.arange(1800) >= 525) & (np.arange(1800) < 900), 1.02, 1.0)
    found = identify(replace(record, force=record.force * stiffer))
    blocks = [block for section in content_of(found).sections for block in section.blocks]
    charts = [figure for block in blocks if isinstance(block, Gallery) for figure in block.figures]
    sentences = {chart.key: chart.sentence for chart in charts if isinstance(chart, Chart)}
    expected = "from the first to the last cycle of one amplitude the measured one changes by +2 % at most."
    assert sentences["trend-secant-stiffness"].endswith(expected)
    assert "  " not in "".join(sentences.values())


def test_a_mass_that_cannot_rest_is_a_sentence() -> None:
    section = next(s for s in content_of(reports.plain(), mass=1e4).sections if s.key == "isolation")
    assert "static load" in getattr(section.blocks[0], "text", "")
    heavy = next(s for s in content_of(reports.plain(), mass=2.0).sections if s.key == "isolation")
    assert isinstance(heavy.blocks[0], Gallery)


def test_long_records_are_thinned_and_keep_their_extremes() -> None:
    values = np.random.default_rng(1).standard_normal(1_000_000)
    kept = visible(values, 6000)
    assert kept.size <= 6002
    assert (values[kept].min(), values[kept].max()) == (values.min(), values.max())
    assert kept[0] == 0
    assert kept[-1] == values.size - 1
    assert (np.diff(kept) > 0).all()


def test_many_records_and_cycles_are_drawn_in_part() -> None:
    found = identify(record_of(spring_of(1.0, 1.0), sine(60, 9000), noise=0.01))
    chart = fit_charts.loops(Evaluation(found))
    (cycles,) = {len(trace.cycles) for trace in chart.traces if trace.cycles}
    assert cycles == SHOWN_CYCLES
    assert "some of the many cycles" in chart.sentence
    many = replace(found, records=found.records * 60, fits=found.fits * 60, fitted=found.fitted * 60)
    chart = fit_charts.loops(Evaluation(many))
    assert len({trace.record for trace in chart.traces}) == SHOWN_RECORDS
    assert sum(trace.x.size for trace in chart.traces) < 80_000


def test_cycles_of_a_line_are_where_they_say() -> None:
    chart = fit_charts.force(Evaluation(reports.hinge()))
    assert isinstance(chart, Chart)
    line = next(trace for trace in chart.traces if trace.name == "model")
    (_, start, stop), *_ = line.cycles
    assert line.shown < start < stop <= line.x.size
    assert np.isfinite(line.y[start:stop]).all()
    assert np.isnan(line.y[start - 1])


@pytest.mark.parametrize("name", ["r.txt", "r", "r.htm"])
def test_other_endings_are_refused(name: str) -> None:
    with pytest.raises(StrandspringError, match=r"must end in \.html or \.pdf"):
        check_report_path(name)


@pytest.mark.parametrize("module", [details, figure, quantities, drawing, page, charts])
def test_examples_of_the_docstrings(module: ModuleType) -> None:
    ran = doctest.testmod(module)
    assert ran.attempted > 0
    assert ran.failed == 0


def test_nothing_ends_a_script() -> None:
    assert "<" not in script_json({"a": "</script><!--", "b": "&"})


def test_details_are_checked() -> None:
    with pytest.raises(StrandspringError, match="needs a label"):
        ReportDetails(fields=((" ", "x"),))
    with pytest.raises(StrandspringError, match="at most 500 characters"):
        ReportDetails(specimen="x" * 501)
    with pytest.raises(StrandspringError, match="mass"):
        ReportDetails(mass=-3.0)


def test_loops_whose_force_does_not_rise_have_no_loss_factor() -> None:
    of = Evaluation(reports.hinge())
    curve = EngineeringFigures(of).curve
    falling = [replace(row, force_high=row.force_low - 1.0) for row in curve]
    for rows, count in (([*falling[:5], *curve[5:]], 3), (falling, 2)):
        figures = SimpleNamespace(curve=rows, curve_reach=None, measured=(), smallest_measured=0.0)
        charts = engineering.over_amplitude(of, figures)  # type: ignore[arg-type]
        assert len(charts) == count
        assert not any("nan" in chart.sentence for chart in charts)


def test_clipped_forces_are_drawn_as_left_out() -> None:
    record = record_of(spring_of(1.0, 1.0), sine(), noise=0.01)
    high = float(np.quantile(record.force, 0.97))
    found = identify(replace(record, force=record.force.clip(None, high)))
    evaluation = Evaluation(found)
    (view,) = evaluation.views
    assert view.compared.size == view.fit.samples
    traces = {trace.name: trace for trace in fit_charts.loops(evaluation).traces}
    assert np.nanmax(traces["measured"].y) < high <= traces["not compared"].y.max()
