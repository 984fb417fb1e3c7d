"""`write_report`: an identification's report, what is said in which order."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from .._version import __version__
from ..identification.certainty.prediction_interval import ForceInterval
from ..identification.identified_model import IdentifiedModel
from ..identification.notes import notes_on
from ..model.joint import HYSTERETIC_UNITS
from ..model.modelfile import ModelFile
from ..model.outcomes import Outcome
from ..model.stated_figures import differ, energy_ratio
from . import report_tables as tables
from .charts import engineering_charts, fit_charts, isolation_charts, model_charts
from .charts.engineering import EngineeringFigures
from .charts.evaluation import Evaluation
from .content.blocks import Block, Facts, Gallery, Level, Notice, PageContent, Section, Signatures, Text, Tile, Tiles
from .content.chart import Figure
from .content.quantities import NUMBER, number, percent, prose, unit_of
from .details import ReportDetails
from .rendering.page import check_report_path, write
from .verdict import HARMLESS, verdict

_SIGNATURES = ("Prepared", "Checked", "Approved")
# Outcomes whose details end with advice.
_ADVISING = frozenset({Outcome.SMALL_LOOPS, Outcome.LACK_OF_FIT})
_LISTED = 200  # records whose assumptions are listed

_EFFECT_UNITS = {
    "delay": "s", "viscosity": "N s/m", "play": "m", "force_zero": "N", "displacement_zero": "m", "drift": "N",
    "moving_mass": "kg", "fixture_stiffness": "N/m",
}  # fmt: skip

Progress = Callable[[str], None]


def write_report(
    path: str | Path,
    identification: IdentifiedModel,
    model: ModelFile,
    details: ReportDetails | None = None,
    comparison: str = "",
    progress: Progress | None = None,
) -> None:
    """Write the report of an identification.

    Parameters
    ----------
    path : str or Path      Ending in .html or .pdf.
    identification : IdentifiedModel
    model : ModelFile       The identified spring with its name.
    details : ReportDetails or None
    comparison : str        How other classes of models compare, in a sentence; empty if they were not fitted.
    progress : callable     Called with the name of each part before the work on it begins.

    Raises
    ------
    StrandspringError       If the ending does not suit, the package `typst` is missing for a PDF, or the file cannot
                            be written.
    """
    check_report_path(path)
    content = report_content(identification, model, details or ReportDetails(), comparison, progress)
    if progress is not None:
        progress("pages")
    write(path, content)


def report_content(
    identification: IdentifiedModel,
    model: ModelFile,
    details: ReportDetails,
    comparison: str = "",
    progress: Progress | None = None,
) -> PageContent:
    """Everything a report says.

    Parameters
    ----------
    identification : IdentifiedModel
    model : ModelFile            For its name, description and version.
    details : ReportDetails
    comparison : str             How other classes of models compare, in a sentence; empty if they were not fitted.
    progress : callable          Called with the name of each part before the work on it begins.
    """
    say = progress or (lambda _: None)
    evaluation = Evaluation(identification)
    figures = EngineeringFigures(evaluation)
    say("engineering figures")
    head = [
        Section("verdict", "Verdict", tuple(_verdict(evaluation, figures, comparison))),
        Section("figures", "Engineering figures", tuple(_engineering(evaluation, figures))),
    ]
    say("fit and residuals")
    middle = [
        Section(
            "fit",
            "Fit",
            (Gallery((fit_charts.loops(evaluation), fit_charts.force(evaluation))), tables.records(evaluation)),
        ),
        Section("residuals", "Residuals", (Gallery(_residuals(evaluation)),)),
        Section("model", "Model", tuple(_model(evaluation))),
    ]
    if trends := engineering_charts.trends(evaluation):
        middle.append(Section("cycles", "From cycle to cycle", (Gallery(trends),)))
    say("transmissibility")
    chart = isolation_charts.transmissibility(evaluation, details.mass)
    block = Text(prose(chart)) if isinstance(chart, str) else Gallery((chart,))
    middle.append(Section("isolation", "Vibration isolation", (block,)))
    tail = [
        Section("assumptions", "What was assumed", tuple(_assumptions(evaluation))),
        Section("provenance", "Provenance", tuple(_provenance(evaluation, model))),
        Section("release", "Release", (Signatures(_SIGNATURES),)),
    ]
    first = Section("details", "Test", (Facts(details.pairs),))
    return PageContent(
        title=f"Spring identification: {model.name}",
        subtitle=evaluation.without_folders(model.description),
        sections=(first, *head, *middle, *tail),
        records={view.place: view.name for view in evaluation.shown},
        footer=f"strandspring {__version__}",
    )


def _verdict(evaluation: Evaluation, figures: EngineeringFigures, comparison: str) -> Iterator[Block]:
    notice, sentences = verdict(evaluation, figures)
    yield notice
    yield Tiles(tuple(_tiles(evaluation, figures)))
    for sentence in sentences:
        yield Text(evaluation.prose(sentence))
    if comparison:
        yield Text(evaluation.prose(comparison))
    for outcome, detail in evaluation.identification.findings.items():
        grade = Level.INFORMATION if outcome in HARMLESS else Level.CARE
        yield Notice(grade, *_caution(outcome, evaluation.prose(detail)))
    for sentence in evaluation.identification.uncertainty.get("indistinct", ()):
        yield Notice(Level.CARE, prose(f"{sentence}."))


def _caution(outcome: Outcome, detail: str) -> tuple[str, str]:
    """What was found, and the advice apart from it."""
    sentence = outcome.value.removesuffix(".")
    # The last clause advises; harmless findings need no advice.
    end = -1 if outcome in HARMLESS else max(sentence.rfind(": "), sentence.rfind("; "))
    head, advice = (sentence, "") if end < 0 else (sentence[:end], sentence[end + 2 :])
    if outcome in _ADVISING:
        detail, _, further = detail.rpartition(": ")
        advice = "; ".join(filter(None, (advice, further)))
    text = f"{head} ({detail})." if detail else f"{head}."
    return text, f"{advice[:1].upper()}{advice[1:]}." if advice else ""


def _tiles(evaluation: Evaluation, figures: EngineeringFigures) -> Iterator[Tile]:
    row = figures.largest
    shown = row.model if row.measured is None else row.measured.figures
    at = f"at ±{number(0.5 * (row.high - row.low) * evaluation.length.factor, 3)} {evaluation.length.name}"
    for name, text, kind in engineering_charts.FIGURES:
        value = getattr(shown, name)
        unit = unit_of(kind, value) if kind else NUMBER
        model = number(getattr(row.model, name) * unit.factor, 3, zeros=True)
        note = f"model, {at}" if row.measured is None else f"measured {at}; model {model}"
        yield Tile(text.capitalize(), number(value * unit.factor, 3, zeros=True), unit.name, note)
    whole = evaluation.identification
    error = f"rms error {number(whole.rmse * evaluation.residual.factor, 3)} {evaluation.residual.name}"
    alone, fitted = whole.figures, whole.fitted_figures
    is_apart = differ(alone, fitted)
    beside = f"; as fitted {number(fitted['rnl'], 4, zeros=True)}" if is_apart else ""
    yield Tile("RNL", number(whole.rnl, 4, zeros=True), "", f"saved spring alone, 1 is perfect; {error}{beside}")
    ratio, of_fit = energy_ratio(alone), energy_ratio(fitted)
    if ratio is not None:
        beside = f"; as fitted {number(of_fit, 3, zeros=True)}" if is_apart and of_fit is not None else ""
        yield Tile("Loop energy", number(ratio, 3, zeros=True), "× measured", f"saved spring alone{beside}")
    if whole.lack_of_fit is not None:
        height = percent(whole.lack_of_fit.of_height)
        yield Tile(
            "Misfit of the fit", number(whole.lack_of_fit.over_noise, 2), "× noise", f"{height} of the loops' height"
        )


def _engineering(evaluation: Evaluation, figures: EngineeringFigures) -> Iterator[Block]:
    yield tables.engineering(evaluation, figures)
    signs = []
    if any(row.measured is not None and row.measured.spread is not None for row in figures.table):
        signs.append("standard deviation from cycle to cycle (measured)")
    if any(row.reach is not None for row in figures.table):
        signs.append("95 % confidence interval (model)")
    text = f"±: {', '.join(signs)}. " if signs else ""
    text += (
        "Secant stiffness between the turning points; loss factor = energy per cycle / (2π · stored energy), with "
        "stored energy = secant stiffness · amplitude² / 2. The model's loop is the steady one between the same "
        "turning points."
    )
    if evaluation.identification.effects:
        text += " Measured figures contain the effects of the rig, the model's do not."
    yield Text(text)
    yield Gallery(engineering_charts.over_amplitude(evaluation, figures))


def _residuals(evaluation: Evaluation) -> tuple[Figure, ...]:
    charts = (
        fit_charts.residuals_over_time(evaluation),
        fit_charts.residuals_over_displacement(evaluation),
        fit_charts.residuals_over_velocity(evaluation),
        fit_charts.histogram(evaluation),
        fit_charts.autocorrelation(evaluation),
    )
    return tuple(chart for chart in charts if chart is not None)


def _model(evaluation: Evaluation) -> Iterator[Block]:
    charts: list[Figure] = [
        model_charts.branches(evaluation),
        model_charts.amplifier(evaluation),
        model_charts.omega(evaluation),
    ]
    band, correlations = model_charts.band(evaluation), model_charts.correlations(evaluation)
    if correlations is not None:
        charts.append(correlations)
    if band is not None:
        charts += band
    yield Gallery(tuple(charts))
    yield tables.parameters(evaluation)
    yield Facts(tables.ranges(evaluation))
    interval = ForceInterval.from_uncertainty(evaluation.identification.uncertainty)
    if interval is not None:
        yield Text(prose(f"{interval.sentence}."))
    effects = (
        (f"Effect of the rig: {name.replace('_', ' ')}", f"{_plain(value)} {_EFFECT_UNITS.get(name, '')}".rstrip())
        for name, value in evaluation.identification.effects.items()
    )
    further = (*_sampled(evaluation.identification.uncertainty), *effects)
    if further:
        yield Facts(further)


def _sampled(known: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Bootstrap and posterior, where they were asked for."""
    names = tuple(HYSTERETIC_UNITS)
    if "bootstrap" in known:
        bootstrap = known["bootstrap"]
        spread = ", ".join(f"{name} ± {number(bootstrap[name], 2)}" for name in names)
        yield f"Bootstrap of {bootstrap['repetitions']} (seed {bootstrap['seed']})", spread
    if "posterior" in known:
        posterior = known["posterior"]
        medians = {name: [number(posterior[name][k], 6) for k in (2, 0, -1)] for name in names}
        ends = ", ".join(f"{name} {middle} ({low} to {high})" for name, (middle, low, high) in medians.items())
        short = "" if posterior["long_enough"] else "; too few steps to be trusted"
        yield f"Posterior of {posterior['steps']} steps (seed {posterior['seed']})", f"median and 95 %: {ends}{short}"


def _assumptions(evaluation: Evaluation) -> Iterator[Block]:
    whole = evaluation.identification
    pairs = []
    for view in evaluation.views[:_LISTED]:
        if view.record.notes:
            pairs.append((view.name, "; ".join(map(evaluation.without_folders, view.record.notes))))
    notes = [evaluation.prose(note) for note in notes_on(whole)]
    if notes:
        pairs.append(("Not considered", " ".join(notes)))
    share = percent(whole.steady_share, 3)
    pairs.append(("Steady section", f"from {share} of the longest stroke"))
    yield Facts(tuple(pairs))


def _provenance(evaluation: Evaluation, model: ModelFile) -> Iterator[Block]:
    whole = evaluation.identification
    options = [f"{name.replace('_', ' ')} {_plain(value)}" for name, value in whole.options.items()]
    yield tables.provenance(evaluation)
    yield Facts(
        (
            ("Method", whole.method),
            ("Options", ", ".join(options) or "none"),
            ("Program", f"strandspring {model.provenance.get('version', __version__)}"),
        )
    )


def _plain(value: Any) -> str:
    """A value of options or effects in words."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value, 6)
    if isinstance(value, dict):
        return ", ".join(f"{name} {_plain(entry)}" for name, entry in value.items())
    if isinstance(value, list | tuple):
        return "; ".join(map(_plain, value))
    return str(value)
