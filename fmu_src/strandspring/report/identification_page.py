"""`write_report`: an identification's report, what is said in which order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from .._version import __version__
from ..errors import Reader, worded
from ..findings import CAUTIONS, Finding, Outcome, detailed, gathered
from ..identification.identified import IdentifiedModel
from ..loops.campaign import campaign_verdicts
from ..loops.loop import PANELS, relaxed_branches, steady_loop
from ..model.modelfile import ModelFile
from ..model.stated_figures import energy_ratio
from . import ReportDetails, check_report_path
from .drawing import Chart, in_unit, percent, scaled
from .figure import CHARTS, Evaluation, transmissibility
from .page import (
    Block,
    Facts,
    Gallery,
    Level,
    Notice,
    Page,
    Parts,
    Section,
    Table,
    Tile,
    Tiles,
    blocks_of,
    write_page,
)

# Findings that say that the model does not follow its own records.
_POOR = frozenset({Outcome.POOR_FIT, Outcome.NI_MODEL, Outcome.WORSE_THAN_LINE})
# Findings that leave the model as good as it would be without them.
_HARMLESS = frozenset(kind for kind in Outcome if kind.severity not in CAUTIONS)
_LISTED = 200  # records in tables and assumptions


def write_report(
    path: str | Path, identification: IdentifiedModel, model: ModelFile, parts: Parts,
    details: ReportDetails | None = None,
) -> None:  # fmt: skip
    """Write the report of an identification with the lines and tables of its result.

    Raises
    ------
    StrandspringError       If the file does not end in .html, or cannot be written.
    """
    check_report_path(path)
    write_page(path, report_page(identification, model, parts, details or ReportDetails()))


def report_page(identification: IdentifiedModel, model: ModelFile, parts: Parts, details: ReportDetails) -> Page:
    """Everything a report says; parameters as of `write_report`."""
    e = Evaluation(identification)
    isolation = transmissibility(e, details.mass)
    signatures = [(f"{role}: name, date, signature", "") for role in ("Prepared", "Checked", "Approved")]
    result = [part for part in parts if part != str(identification.verdict)]
    amplitudes = [key for key in CHARTS if key.startswith("amplitude-")]
    sections = [
        Section("verdict", "Verdict", [*_verdict(e)]),
        Section("figures", "Figures", [*blocks_of(result, e.prose), _gallery(e, *amplitudes, "branches", "band")]),
        Section("fit", "Fit", [_gallery(e, "force", *(key for key in CHARTS if key.startswith("residuals-")))]),
        Section(
            "isolation", "Vibration isolation", [isolation if isinstance(isolation, str) else Gallery([isolation])]
        ),
        Section("assumptions", "What was assumed", [_assumptions(e)], is_folded=True),
        Section("provenance", "Provenance", [*_provenance(e, model)], is_folded=True),
        Section("release", "Test and release", [Facts(details.pairs), Facts(signatures)]),
    ]
    names = {view.place: view.name for view in e.shown}
    return Page(f"Spring identification: {model.name}", e.prose(model.description), sections, names)


def _gallery(e: Evaluation, *keys: str) -> Gallery:
    """Charts by their names, without those that are unknown."""
    return Gallery([chart for key in keys if isinstance(chart := CHARTS[key](e), Chart)])


def _verdict(e: Evaluation) -> Iterator[Block]:
    whole = e.identification
    yield _headline(whole)
    yield Tiles([*_tiles(e)])
    yield _gallery(e, "loops")
    rate, overlap = campaign_verdicts(whole.records)
    unknown = "The model is rate independent; these records do not show whether the spring is."
    yield " ".join((unknown if rate is None else rate.sentence, *([] if overlap is None else [overlap.sentence])))
    if whole.verdict is not None and whole.verdict.whole is not None:
        errors = {"this spring": whole.verdict.whole.error, **whole.verdict.whole.plain}
        header = ("model", "error, share of the force's standard deviation")
        yield Table("Held-out error", header, [(name, percent(error)) for name, error in errors.items()])
    for finding in (*whole.findings, *relaxed_branches(whole.parameters)):
        yield _caution(finding, e)


def _headline(whole: IdentifiedModel) -> Notice:
    """How far the model can be relied on: the verdict, or what is found without one."""
    findings, verdict = set(whole.outcomes), whole.verdict
    if verdict is not None:
        sentence, is_usable = str(verdict), verdict.is_usable
    elif findings & _POOR:
        sentence, is_usable = "not usable: it does not follow its own records", False
    else:
        sentence, is_usable = "not tested on held-out strokes, as by the refined method", None
    if is_usable is False:
        return Notice(Level.POOR, _sentence(sentence))
    return Notice(Level.GOOD if is_usable and not findings - _HARMLESS else Level.CARE, _sentence(sentence))


def _caution(finding: Finding, e: Evaluation) -> Notice:
    """What was found, and the advice apart from it."""
    kind, reader = finding.kind.value, Reader.FILE
    head, remedy = (worded(text, finding.numbers, reader) for text in (kind.sentence, kind.remedy))
    place = e.prose(finding.where) if finding.where else ""
    beside = ", ".join(filter(None, (place, detailed(finding.kind, finding.numbers, reader))))
    level = Level.CARE if kind.severity in CAUTIONS else Level.INFORMATION
    return Notice(level, f"{head} ({beside})." if beside else f"{head}.", _sentence(remedy) if remedy else "")


def _sentence(text: str) -> str:
    """A clause with a capital and a full stop."""
    return f"{text[0].upper()}{text[1:].removesuffix('.')}."


def _tiles(e: Evaluation) -> Iterator[Tile]:
    """Figures of the largest loop measured, else of the model over its whole range, and how well it is followed."""
    whole, p = e.identification, e.identification.parameters
    measured = max((loop for loop in whole.recorded if loop.cycles), key=lambda loop: loop.figures.amplitude,
                   default=None)  # fmt: skip
    whole_range = steady_loop(e.solver, p.displacement_min, p.displacement_max).figures
    figures, modelled = (whole_range, None) if measured is None else (measured.figures, measured.predicted)
    at = f"at ±{in_unit(figures.amplitude, e.length, 3)}"
    for column in PANELS:
        unit = replace(scaled(column, getattr(figures, column.key)), digits=3)
        value, model = (unit.text(getattr(of, column.key)) for of in (figures, modelled or figures))
        note = f"model, {at}" if measured is None else f"measured {at}; model {model}"
        yield Tile(column.words.capitalize(), value, unit.shown, note)
    yield Tile("RNL", in_unit(whole.rnl), "", "saved spring alone; 1 is perfect")
    if (ratio := energy_ratio(whole.figures)) is not None:
        yield Tile("Loop energy", in_unit(100.0 * ratio, digits=3), "%", "of measured, saved spring alone")
    if whole.certainty is not None:
        missed = in_unit(100.0 * whole.certainty.lack.missed, digits=2)
        yield Tile("Missed", missed, "%", "of the force's deviation, beside noise")


def _assumptions(e: Evaluation) -> Facts:
    pairs = [
        (view.name, " ".join(gathered(view.record.findings, Reader.FILE)))
        for view in e.views[:_LISTED] if view.record.findings
    ]  # fmt: skip
    found = (finding.in_folder for finding in e.identification.record_findings)
    if notes := list(gathered(found, Reader.FILE)):
        pairs.append(("Not considered", " ".join(notes)))
    return Facts(pairs)


def _provenance(e: Evaluation, model: ModelFile) -> Iterator[Block]:
    whole = e.identification
    rows = [(view.name, str(len(view.record)), view.record.sha256 or "not from a file") for view in e.views[:_LISTED]]
    yield Table("Files", ("file", "samples", "SHA-256"), rows)
    program = f"strandspring {model.provenance.get('version', __version__)}"
    yield Facts([("Method", whole.method), ("Options", _plain(whole.options) or "none"), ("Program", program)])


def _plain(value: Any) -> str:
    """A value of options in words."""
    if isinstance(value, Mapping):
        return ", ".join(f"{name.replace('_', ' ')} {_plain(entry)}" for name, entry in value.items())
    if isinstance(value, list | tuple):
        return "; ".join(map(_plain, value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
