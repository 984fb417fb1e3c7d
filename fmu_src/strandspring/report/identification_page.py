"""`write_report`: an identification's report, what is said in which order, and its tables."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .._version import __version__
from ..core.parameters import SpringParameters
from ..errors import Reader, worded
from ..findings import CAUTIONS, Finding, Outcome, detailed, gathered
from ..ground.result_columns import ResultColumn
from ..identification.figures import RecordFit
from ..identification.identified import IdentifiedModel
from ..loops.campaign import campaign_verdicts
from ..loops.loop import PANELS, LoopFigures, relaxed_branches
from ..model.joint import HYSTERETIC_PARAMETERS, NORMAL_95, ForceInterval
from ..model.modelfile import ModelFile
from ..model.stated_figures import Figures, differ, effects_in_words, energy_ratio
from . import ReportDetails, check_report_path
from .drawing import Chart
from .evaluation import AmplitudeComparison, Evaluation
from .figure import CHARTS, transmissibility, trends
from .page import Block, Facts, Gallery, Level, Notice, Page, Section, Table, Tile, Tiles, write_page
from .quantities import by_error, number, percent, prose, span, superscript, with_reach

# Findings that say that the model does not follow its own records.
_POOR = frozenset({Outcome.POOR_FIT, Outcome.NI_MODEL, Outcome.WORSE_THAN_LINE})
# Findings that leave the model as good as it would be without them.
_HARMLESS = frozenset(kind for kind in Outcome if kind.severity not in CAUTIONS)
_LISTED = 200  # records in tables and assumptions
_TEXT = (
    "Secant stiffness between the turning points; loss factor = energy per cycle / (2π · stored energy), with stored "
    "energy = secant stiffness · amplitude² / 2. The model's loop is the steady one between the same turning points."
)


def write_report(
    path: str | Path, identification: IdentifiedModel, model: ModelFile, details: ReportDetails | None = None
) -> None:
    """Write the report of an identification.

    Parameters
    ----------
    path : str or Path      Ending in .html.
    identification : IdentifiedModel
    model : ModelFile       The identified spring with its name.
    details : ReportDetails or None

    Raises
    ------
    StrandspringError       If the ending does not suit, or the file cannot be written.
    """
    check_report_path(path)
    write_page(path, report_page(identification, model, details or ReportDetails()))


def report_page(identification: IdentifiedModel, model: ModelFile, details: ReportDetails) -> Page:
    """Everything a report says; parameters as of `write_report`."""
    evaluation = Evaluation(identification)
    chart = transmissibility(evaluation, details.mass)
    residuals = ("residuals-time", "residuals-displacement", "residuals-velocity", "histogram", "autocorrelation")
    sections = [
        Section("verdict", "Verdict", [*_verdict(evaluation)]),
        Section("figures", "Engineering figures", [*_engineering(evaluation)]),
        Section("fit", "Fit", [_gallery(evaluation, "force"), _records(evaluation)]),
        Section("isolation", "Vibration isolation", [prose(chart) if isinstance(chart, str) else Gallery([chart])]),
        Section("residuals", "Residuals", [_gallery(evaluation, *residuals)], is_folded=True),
        Section("model", "Model", [*_model(evaluation)], is_folded=True),
    ]
    if charts := trends(evaluation):
        sections.append(Section("cycles", "From cycle to cycle", [Gallery(charts)], is_folded=True))
    signatures = [(f"{role}: name, date, signature", "") for role in ("Prepared", "Checked", "Approved")]
    sections += [
        Section("assumptions", "What was assumed", [_assumptions(evaluation)], is_folded=True),
        Section("provenance", "Provenance", [*_provenance(evaluation, model)], is_folded=True),
        Section("release", "Test and release", [Facts(details.pairs), Facts(signatures)]),
    ]
    names = {view.place: view.name for view in evaluation.shown}
    subtitle = evaluation.without_folders(model.description)
    return Page(f"Spring identification: {model.name}", subtitle, sections, names)


def _gallery(evaluation: Evaluation, *keys: str) -> Gallery:
    """Charts by their names, without those that are unknown."""
    return Gallery([chart for key in keys if isinstance(chart := CHARTS[key](evaluation), Chart)])


def _verdict(evaluation: Evaluation) -> Iterator[Block]:
    whole = evaluation.identification
    yield _headline(evaluation)
    yield Tiles([*_tiles(evaluation)])
    yield _gallery(evaluation, "loops")
    for sentence in (_fit(evaluation), _range(evaluation), _rate(evaluation), *_certainty(evaluation)):
        yield evaluation.prose(sentence)
    if whole.verdict is not None and whole.verdict.whole is not None:
        errors = {"this spring": whole.verdict.whole.error, **whole.verdict.whole.plain}
        header = ("model", "error, share of the force's standard deviation")
        yield Table("Held-out error", header, [(name, percent(error)) for name, error in errors.items()])
    for finding in whole.findings:
        yield _caution(finding, evaluation)
    for finding in relaxed_branches(whole.parameters):
        yield _caution(finding, evaluation)
    for sentence in whole.uncertainty.get("indistinct", ()):
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


def _figures(figures: Figures) -> str:
    """RNL and the energy of the loops."""
    ratio = energy_ratio(figures)
    energy = "" if ratio is None else f", loop energy {percent(ratio, 3)} of measured"
    return f"RNL {number(figures['rnl'], 4, zeros=True)}{energy}"


def _certainty(evaluation: Evaluation) -> Iterator[str]:
    """What the spring misses, and what is known of loops that were not recorded, where no finding says it."""
    certainty = evaluation.identification.certainty
    said = set(evaluation.identification.outcomes)
    if certainty is not None and Outcome.LACK_OF_FIT not in said:
        is_noise = not certainty.lack.is_structured
        lack = detailed(Outcome.LACK_OF_FIT, certainty.lack.numbers, Reader.FILE)
        yield _sentence("nothing but noise is left" if is_noise else lack)
    is_said = bool(said & {Outcome.ONE_AMPLITUDE, Outcome.SMALL_LOOPS})
    loops = {} if certainty is None or is_said else certainty.unrecorded.numbers
    if text := detailed(Outcome.SMALL_LOOPS, loops, Reader.FILE):
        yield _sentence(text)


def _range(evaluation: Evaluation) -> str:
    p, unit = evaluation.identification.parameters, evaluation.length
    half = 0.5 * (p.displacement_max - p.displacement_min)
    where = (
        f"It holds from {span(p.displacement_min, p.displacement_max, unit)} (amplitudes up to "
        f"{unit.text(half, 3)}); outside it is continued linearly"
    )
    amplitudes = [row.figures.amplitude * unit.factor for row in evaluation.measured]
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


def _tiles(evaluation: Evaluation) -> Iterator[Tile]:
    row, whole = evaluation.largest, evaluation.identification
    shown = row.model if row.measured is None else row.measured.figures
    at = f"at ±{evaluation.length.text(row.amplitude, 3)}"
    for place, column in enumerate(PANELS):
        unit = evaluation.unit_of_figure(place)
        value, model = (number(getattr(of, column.key) * unit.factor, 3, zeros=True) for of in (shown, row.model))
        note = f"model, {at}" if row.measured is None else f"measured {at}; model {model}"
        yield Tile(column.words.capitalize(), value, unit.name, note)
    yield Tile("RNL", number(whole.rnl, 4, zeros=True), "", "saved spring alone; 1 is perfect")
    if (ratio := energy_ratio(whole.figures)) is not None:
        yield Tile("Loop energy", number(100.0 * ratio, 3), "%", "of measured, saved spring alone")
    if whole.certainty is not None:
        missed = number(100.0 * whole.certainty.lack.missed, 2)
        yield Tile("Missed", missed, "%", "of the force's deviation, beside noise")


def _engineering(evaluation: Evaluation) -> Iterator[Block]:
    """Stiffness, energy and loss factor of each amplitude, measured and modelled."""
    units = [evaluation.unit_of_figure(place) for place in range(len(PANELS))]
    rows: list[tuple[str, ...]] = []
    strong = []
    for row in evaluation.amplitudes:
        strong.append(len(rows))
        amplitude = number(row.amplitude * evaluation.length.factor, 4)
        for label, cells in _of_amplitude(row, [unit.factor for unit in units], evaluation.smallest_measured):
            rows.append((amplitude, label, *cells))
            amplitude = ""
    names = [f"{column.words} [{unit.name}]".removesuffix(" []") for column, unit in zip(PANELS, units, strict=True)]
    header = (f"amplitude [{evaluation.length.name}]", "", *names)
    yield Table("Stiffness, energy per cycle and loss factor by amplitude", header, rows, strong)
    signs = []
    if any(row.measured is not None and row.measured.spread is not None for row in evaluation.amplitudes):
        signs.append("standard deviation from cycle to cycle (measured)")
    if any(reach == reach for row in evaluation.amplitudes for reach in row.reach):
        signs.append("95 % confidence interval (model)")
    text = f"±: {', '.join(signs)}. {_TEXT}" if signs else _TEXT
    effects = " Measured figures contain the effects of the rig, the model's do not."
    yield f"{text}{effects}" if evaluation.identification.effects else text
    yield _gallery(evaluation, *(name for name in CHARTS if name.startswith("amplitude-")))


def _of_amplitude(row: AmplitudeComparison, factors: list[float], smallest: float) -> Iterator[tuple[str, list[str]]]:
    def cells(figures: LoopFigures, reach: tuple[float, ...]) -> list[str]:
        return [
            with_reach(getattr(figures, column.key) * factor, of_figure * factor)
            for column, factor, of_figure in zip(PANELS, factors, reach, strict=True)
        ]

    measured = row.measured
    if measured is None:
        yield "model, extrapolated" if row.amplitude < smallest else "model only", cells(row.model, row.reach)
        return
    of_cycles = (float("nan") if measured.spread is None else getattr(measured.spread, column.key) for column in PANELS)
    rate = "" if measured.frequency is None else f", {number(measured.frequency, 2)} Hz"
    yield (
        f"measured, {measured.cycles} cycle{'s' if measured.cycles > 1 else ''}{rate}",
        cells(measured.figures, tuple(of_cycles)),
    )
    yield "model", cells(row.model, row.reach)
    pairs = [(getattr(row.model, column.key), getattr(measured.figures, column.key)) for column in PANELS]
    yield "difference", [percent(a / b - 1.0, sign=True) if b else "–" for a, b in pairs]


def _records(evaluation: Evaluation) -> Table:
    """Records with what was compared, and how well the spring alone follows them; also the fit where it differs."""
    unit, views = evaluation.residual, evaluation.views[:_LISTED]
    beside = any(view.differs for view in views)

    def cells(fit: RecordFit) -> tuple[str, str]:
        ratio = energy_ratio(fit.figures)
        return number(fit.rnl, 4, zeros=True), "–" if ratio is None else percent(ratio, 3)

    rows = []
    for view in views:
        error = number(view.fit.rmse * unit.factor, 3, zeros=True)
        row = (view.name, f"{view.fit.samples} of {len(view.record)}", error, *cells(view.fit))
        rows.append((*row, *(cells(view.fitted) if beside else ()), view.fit.compared))
    header = ("record", "samples compared", f"rms error [{unit.name}]", "RNL", "energy, of measured")
    fitted = ("RNL as fitted", "energy as fitted") if beside else ()
    return Table("Records and fit", (*header, *fitted, "compared"), rows)


def _model(evaluation: Evaluation) -> Iterator[Block]:
    p, unit, whole = evaluation.identification.parameters, evaluation.length, evaluation.identification
    yield _gallery(evaluation, "branches", "amplifier", "omega", "band", "correlations")
    yield _parameters(evaluation)
    form, about = f"FE is a polynomial of degree {len(p.kE) - 1}, FA one of degree {len(p.kA) - 1}", "Polynomials about"
    if p.FE_knots:
        form = f"FE is a cubic spline through {len(p.FE_knots)} knots, FA a polynomial of degree {len(p.kA) - 1}"
        about = "FA about"
    identified = span(p.displacement_min, p.displacement_max, unit)
    yield Facts([("Identified range", identified), (about, unit.text(p.displacement_offset, 6)), ("Form", form)])
    if (interval := ForceInterval.from_uncertainty(whole.uncertainty)) is not None:
        yield prose(f"{interval.sentence}.")
    if effects := effects_in_words(whole.effects):
        yield Facts([(f"Effect of the rig: {name}", evaluation.prose(size)) for name, size in effects.items()])


def _parameters(evaluation: Evaluation) -> Table:
    """All parameters with unit, standard error and 95 % interval; without the last two if they are unknown."""
    p, known, unit = evaluation.identification.parameters, evaluation.identification.uncertainty, evaluation.length
    main = [_main_row(column, p, known) for column in HYSTERETIC_PARAMETERS]
    if p.FE_knots:
        elastic = [("FE_forces", f"elastic force at {unit.text(x)}", "N") for x in p.FE_knots]
    else:
        elastic = [("kE", f"elastic force, power {k}", _power("N", k)) for k in range(len(p.kE))]
    amplifier = [("kA", f"amplifier, power {k}", _power("1", k)) for k in range(len(p.kA))]
    amplifier[0] = ("kA", "amplifier, power 0, 1 by definition", "–")
    rows = [*main, *_rows(elastic, p, known), *_rows(amplifier, p, known)]
    groups = [0, len(main), len(rows) - len(amplifier)]
    if not p.is_plain:
        groups.append(len(rows))
        rows += _further_rows(p, known.get("further") or {})
    header: tuple[str, ...] = ("parameter", "meaning", "value", "unit", "standard error", "95 % interval")
    if not known:
        header, rows = header[:4], [row[:4] for row in rows]
    return Table("Parameters", header, rows, groups)


def _main_row(column: ResultColumn, p: SpringParameters, known: dict[str, Any]) -> tuple[str, ...]:
    value, error = getattr(p, column.key), known.get(column.key)
    low, high = known.get("interval_95", {}).get(column.key, (None, None))
    if low is not None and high is not None:
        interval = f"{by_error(low, error)} to {by_error(high, error)}"
    elif high is not None:
        interval = f"below {number(high, 3)}"
    else:
        interval = "not bounded" if low is None else f"above {number(low, 3)}"
    deviation = "at its bound" if error is None else number(error, 2, zeros=True)
    return column.key, column.words, by_error(value, error), column.shown or "–", deviation, interval


def _rows(
    coefficients: list[tuple[str, str, str]], p: SpringParameters, known: dict[str, Any]
) -> Iterator[tuple[str, ...]]:
    """Rows of the coefficients of FE or FA, each with its name, meaning and unit."""
    for k, (name, meaning, unit) in enumerate(coefficients):
        value, error = getattr(p, name)[k], (known.get(name) or [None] * len(coefficients))[k]
        reach = ("–", "–")
        if error:
            ends = (by_error(value + side * NORMAL_95 * error, error) for side in (-1.0, 1.0))
            reach = number(error, 2, zeros=True), " to ".join(ends)
        yield f"{name}[{k}]", meaning, by_error(value, error), unit, *reach


def _further_rows(p: SpringParameters, known: dict[str, Any]) -> Iterator[tuple[str, ...]]:
    """Rows of a second mechanism and of Maxwell branches."""
    parameters = []
    if p.second is not None:
        for column in HYSTERETIC_PARAMETERS:
            parameters.append((f"second.{column.key}", column.words, column.shown, getattr(p.second, column.key)))
        for k, coefficient in enumerate(p.second.kA):
            parameters.append((f"second.kA[{k}]", f"second amplifier, power {k}", _power("1", k), coefficient))
    for j, branch in enumerate(p.branches):
        parameters.append((f"branches[{j}].stiffness", "Maxwell branch, added to fast motion", "N/m", branch.stiffness))
        parameters.append((f"branches[{j}].time_constant", "decay of its force at rest", "s", branch.time_constant))
    for name, meaning, unit, value in parameters:
        of_name = known.get(name) or {}
        error, (low, high) = of_name.get("standard_error"), of_name.get("interval_95") or (None, None)
        reach = ("–", "–")
        if error and low is not None and high is not None:
            reach = number(error, 2, zeros=True), f"{by_error(low, error)} to {by_error(high, error)}"
        yield name, meaning, by_error(value, error), unit or "–", *reach


def _power(unit: str, power: int) -> str:
    return f"{unit}/m{superscript(power) if power > 1 else ''}" if power else unit


def _assumptions(evaluation: Evaluation) -> Facts:
    pairs = [
        (view.name, " ".join(gathered(view.record.findings, Reader.FILE)))
        for view in evaluation.views[:_LISTED] if view.record.findings
    ]  # fmt: skip
    found = (finding.in_folder for finding in evaluation.identification.record_findings)
    if notes := list(gathered(found, Reader.FILE)):
        pairs.append(("Not considered", " ".join(notes)))
    return Facts(pairs)


def _provenance(evaluation: Evaluation, model: ModelFile) -> Iterator[Block]:
    whole, views = evaluation.identification, evaluation.views[:_LISTED]
    rows = [(view.name, str(len(view.record)), view.record.sha256 or "not from a file") for view in views]
    yield Table("Files", ("file", "samples", "SHA-256"), rows)
    options = [f"{name.replace('_', ' ')} {_plain(value)}" for name, value in whole.options.items()]
    program = f"strandspring {model.provenance.get('version', __version__)}"
    yield Facts([("Method", whole.method), ("Options", ", ".join(options) or "none"), ("Program", program)])


def _plain(value: Any) -> str:
    """A value of options in words."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value, 6)
    if isinstance(value, dict):
        return ", ".join(f"{name} {_plain(entry)}" for name, entry in value.items())
    if isinstance(value, list | tuple):
        return "; ".join(map(_plain, value))
    return str(value)
