"""`write_report`: an identification's report, what is said in which order."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from .._version import __version__
from ..errors import Reader, worded
from ..findings import CAUTIONS, Finding, Outcome, detailed, gathered
from ..identification.identified import IdentifiedModel
from ..loops.campaign import campaign_verdicts
from ..loops.loop import relaxed_branches
from ..model.joint import ForceInterval
from ..model.modelfile import ModelFile
from ..model.stated_figures import Figures, differ, effects_in_words, energy_ratio
from . import report_tables as tables
from .charts import engineering, isolation_charts
from .charts.engineering import EngineeringFigures
from .charts.evaluation import Evaluation
from .content.blocks import Block, Facts, Gallery, Level, Notice, PageContent, Section, Signatures, Text, Tile, Tiles
from .content.chart import Chart
from .content.quantities import NUMBER, number, percent, prose, span, unit_of
from .details import ReportDetails
from .figure import CHARTS
from .rendering.page import write
from .rendering.report_path import check_report_path

_SIGNATURES = ("Prepared", "Checked", "Approved")
_RESIDUALS = ("residuals-time", "residuals-displacement", "residuals-velocity", "histogram", "autocorrelation")
# Findings that say that the model does not follow its own records.
_POOR = frozenset({Outcome.POOR_FIT, Outcome.NI_MODEL, Outcome.WORSE_THAN_LINE})
# Findings that leave the model as good as it would be without them.
_HARMLESS = frozenset(kind for kind in Outcome if kind.severity not in CAUTIONS)
_LISTED = 200  # records whose assumptions are listed

Progress = Callable[[str], None]


def write_report(
    path: str | Path,
    identification: IdentifiedModel,
    model: ModelFile,
    details: ReportDetails | None = None,
    progress: Progress | None = None,
) -> None:
    """Write the report of an identification.

    Parameters
    ----------
    path : str or Path      Ending in .html or .pdf.
    identification : IdentifiedModel
    model : ModelFile       The identified spring with its name.
    details : ReportDetails or None
    progress : callable     Called with the name of each part before the work on it begins.

    Raises
    ------
    StrandspringError       If the ending does not suit, the package `typst` is missing for a PDF, or the file cannot
                            be written.
    """
    check_report_path(path)
    content = report_content(identification, model, details or ReportDetails(), progress)
    if progress is not None:
        progress("pages")
    write(path, content)


def report_content(
    identification: IdentifiedModel,
    model: ModelFile,
    details: ReportDetails,
    progress: Progress | None = None,
) -> PageContent:
    """Everything a report says.

    Parameters
    ----------
    identification : IdentifiedModel
    model : ModelFile            For its name, description and version.
    details : ReportDetails
    progress : callable          Called with the name of each part before the work on it begins.
    """
    say = progress or (lambda _: None)
    evaluation = Evaluation(identification)
    figures = EngineeringFigures(evaluation)
    sections: list[Section] = []

    def add(key: str, title: str, *blocks: Block, folded: bool = False) -> None:
        sections.append(Section(key, title, blocks, folded))

    say("engineering figures")
    add("verdict", "Verdict", *_verdict(evaluation, figures))
    add("figures", "Engineering figures", *_engineering(evaluation, figures))
    say("fit and residuals")
    add("fit", "Fit", _gallery(evaluation, "force"), tables.records(evaluation))
    say("transmissibility")
    chart = isolation_charts.transmissibility(evaluation, details.mass)
    add("isolation", "Vibration isolation", Text(prose(chart)) if isinstance(chart, str) else Gallery((chart,)))
    add("residuals", "Residuals", _gallery(evaluation, *_RESIDUALS), folded=True)
    add("model", "Model", *_model(evaluation), folded=True)
    if trends := engineering.trends(evaluation):
        add("cycles", "From cycle to cycle", Gallery(trends), folded=True)
    add("assumptions", "What was assumed", *_assumptions(evaluation), folded=True)
    add("provenance", "Provenance", *_provenance(evaluation, model), folded=True)
    add("release", "Test and release", Facts(details.pairs), Signatures(_SIGNATURES))
    return PageContent(
        title=f"Spring identification: {model.name}",
        subtitle=evaluation.without_folders(model.description),
        sections=tuple(sections),
        records={view.place: view.name for view in evaluation.shown},
        footer=f"strandspring {__version__}",
    )


def _gallery(evaluation: Evaluation, *keys: str) -> Gallery:
    """Charts by their names, without those that are unknown."""
    charts = (CHARTS[key](evaluation) for key in keys)
    return Gallery(tuple(chart for chart in charts if isinstance(chart, Chart)))


def _verdict(evaluation: Evaluation, figures: EngineeringFigures) -> Iterator[Block]:
    yield _headline(evaluation)
    yield Tiles(tuple(_tiles(evaluation, figures)))
    yield _gallery(evaluation, "loops")
    for sentence in (_fit(evaluation), _range(evaluation, figures), _rate(evaluation), *_certainty(evaluation)):
        if sentence:
            yield Text(evaluation.prose(sentence))
    if (held_out := tables.held_out(evaluation)) is not None:
        yield held_out
    for finding in evaluation.identification.findings:
        yield _caution(finding, evaluation)
    for finding in relaxed_branches(evaluation.identification.parameters):
        yield _caution(finding, evaluation)
    for sentence in evaluation.identification.uncertainty.get("indistinct", ()):
        yield Notice(Level.CARE, prose(f"{sentence}."))


def _headline(evaluation: Evaluation) -> Notice:
    """How far the model can be relied on: the verdict, or what is found without one."""
    verdict = evaluation.identification.verdict
    findings = set(evaluation.identification.outcomes)
    is_usable = not findings & _POOR if verdict is None else verdict.is_usable
    if verdict is not None:
        sentence = str(verdict)
    elif is_usable:
        sentence = "not tested on held-out strokes, as by the refined method"
    else:
        sentence = "not usable: it does not follow its own records"
    if is_usable is False:
        level = Level.POOR
    else:
        level = Level.GOOD if is_usable and verdict is not None and not findings - _HARMLESS else Level.CARE
    return Notice(level, prose(_sentence(sentence)))


def _fit(evaluation: Evaluation) -> str:
    whole, unit = evaluation.identification, evaluation.residual
    text = (
        "The saved spring alone, driven by the displacement as recorded, follows the measured force with an rms error "
        f"of {unit.text(whole.rmse, 3)}, {percent(1.0 - whole.rnl)} of the rms force "
        f"({_figures(whole.figures)}; RNL 1 is perfect)"
    )
    if differ(whole.figures, whole.fitted_figures):
        text += f"; as fitted, {evaluation.beside}, it is {_figures(whole.fitted_figures)}"
    return f"{text}."


def _certainty(evaluation: Evaluation) -> Iterator[str]:
    """What the spring misses, and what is known of loops that were not recorded, where no finding says it."""
    certainty = evaluation.identification.certainty
    said = set(evaluation.identification.outcomes)
    if certainty is not None and Outcome.LACK_OF_FIT not in said:
        is_noise = not certainty.lack.is_structured
        lack = detailed(Outcome.LACK_OF_FIT, certainty.lack.numbers, Reader.FILE)
        yield _sentence("nothing but noise is left" if is_noise else lack)
    if certainty is not None and not said & {Outcome.ONE_AMPLITUDE, Outcome.SMALL_LOOPS}:
        yield _sentence(detailed(Outcome.SMALL_LOOPS, certainty.unrecorded.numbers, Reader.FILE))


def _figures(figures: Figures) -> str:
    """RNL and the energy of the loops."""
    ratio = energy_ratio(figures)
    energy = "" if ratio is None else f", loop energy {number(ratio, 3, zeros=True)} of the measured"
    return f"RNL {number(figures['rnl'], 4, zeros=True)}{energy}"


def _range(evaluation: Evaluation, figures: EngineeringFigures) -> str:
    p, unit = evaluation.identification.parameters, evaluation.length
    half = 0.5 * (p.displacement_max - p.displacement_min)
    where = (
        f"It holds from {span(p.displacement_min, p.displacement_max, unit)} (amplitudes up to "
        f"{unit.text(half, 3)}); outside it is continued linearly"
    )
    amplitudes = [row.figures.amplitude * unit.factor for row in figures.measured]
    if not amplitudes:
        return f"{where}. No full cycle was recorded."
    if amplitudes[-1] - amplitudes[0] < 0.1 * amplitudes[-1]:
        return f"{where}. Recorded amplitude: {number(amplitudes[-1], 3)} {unit.name}."
    return f"{where}. Recorded amplitudes: {number(amplitudes[0], 3)} to {number(amplitudes[-1], 3)} {unit.name}."


def _rate(evaluation: Evaluation) -> str:
    """Whether the spring is as rate independent as the model."""
    rate, overlap = campaign_verdicts(evaluation.identification.records)
    unknown = "The model is rate independent; these records do not show whether the spring is."
    return " ".join((unknown if rate is None else rate.sentence, *([] if overlap is None else [overlap.sentence])))


def _caution(finding: Finding, evaluation: Evaluation) -> Notice:
    """What was found, and the advice apart from it."""
    kind, reader = finding.kind.value, Reader.FILE
    head, remedy = (worded(text, finding.numbers, reader) for text in (kind.sentence, kind.remedy))
    place = "" if not finding.where else evaluation.without_folders(finding.where)
    beside = ", ".join(filter(None, (place, detailed(finding.kind, finding.numbers, reader))))
    level = Level.CARE if kind.severity in CAUTIONS else Level.INFORMATION
    return Notice(level, f"{head} ({beside})." if beside else f"{head}.", _sentence(remedy) if remedy else "")


def _sentence(text: str) -> str:
    """A clause with a capital and a full stop."""
    return f"{text[0].upper()}{text[1:].removesuffix('.')}."


def _tiles(evaluation: Evaluation, figures: EngineeringFigures) -> Iterator[Tile]:
    row = figures.largest
    shown = row.model if row.measured is None else row.measured.figures
    at = f"at ±{evaluation.length.text(0.5 * (row.high - row.low), 3)}"
    for name, text, kind in engineering.FIGURES:
        value = getattr(shown, name)
        unit = unit_of(kind, value) if kind else NUMBER
        model = number(getattr(row.model, name) * unit.factor, 3, zeros=True)
        note = f"model, {at}" if row.measured is None else f"measured {at}; model {model}"
        yield Tile(text.capitalize(), number(value * unit.factor, 3, zeros=True), unit.name, note)
    whole = evaluation.identification
    yield Tile("RNL", number(whole.rnl, 4, zeros=True), "", "saved spring alone; 1 is perfect")
    if (ratio := energy_ratio(whole.figures)) is not None:
        yield Tile("Loop energy", number(ratio, 3, zeros=True), "× measured", "saved spring alone")
    if whole.certainty is not None:
        missed = number(100.0 * whole.certainty.lack.missed, 2)
        yield Tile("Missed", missed, "%", "of the force's deviation, beside noise")


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
    yield Gallery(engineering.over_amplitude(evaluation, figures))


def _model(evaluation: Evaluation) -> Iterator[Block]:
    yield _gallery(evaluation, "branches", "amplifier", "omega", "band", "correlations")
    yield tables.parameters(evaluation)
    yield Facts(tables.ranges(evaluation))
    interval = ForceInterval.from_uncertainty(evaluation.identification.uncertainty)
    if interval is not None:
        yield Text(prose(f"{interval.sentence}."))
    if effects := effects_in_words(evaluation.identification.effects):
        yield Facts(tuple((f"Effect of the rig: {name}", evaluation.prose(size)) for name, size in effects.items()))


def _assumptions(evaluation: Evaluation) -> Iterator[Block]:
    whole = evaluation.identification
    pairs = []
    for view in evaluation.views[:_LISTED]:
        if view.record.findings:
            pairs.append((view.name, " ".join(gathered(view.record.findings, Reader.FILE))))
    notes = list(gathered((finding.in_folder for finding in whole.record_findings), Reader.FILE))
    if notes:
        pairs.append(("Not considered", " ".join(notes)))
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
