"""`write_simulation`: answers about a system as one page that opens offline, or as a document for print."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from .._version import __version__
from ..errors import Reader
from ..findings import gathered, words
from ..vibration.verdicts.answers import CandidateAnswer, CaseAnswer, findings_of, overall_verdicts, untested
from ..vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind
from .charts import motion_charts, verdict_charts
from .charts.system_drawing import system_drawing
from .content.blocks import (
    MOST_ROWS,
    Block,
    Gallery,
    Level,
    Notice,
    PageContent,
    PageTable,
    Section,
    Text,
    Tile,
    Tiles,
    first_rows,
)
from .content.quantities import number, percent, prose
from .rendering.page import write
from .rendering.report_path import check_report_path
from .simulation_tables import at_rest, inputs, natural_modes, tiny

_SHOWN = (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.TILT, FigureKind.STROKE)
_MOST_TILES, _MOST_HISTORIES = 8, 40
_LEVELS = {
    CaseVerdict.NO_LIMITS: Level.INFORMATION,
    CaseVerdict.PASSES: Level.GOOD,
    CaseVerdict.NOT_TESTED: Level.CARE,
    CaseVerdict.UNDECIDED: Level.CARE,
}  # else poor
# Of the best candidates.
_HEADS = {
    CaseVerdict.PASSES: "Within all limits in all load cases: {}.",
    CaseVerdict.NOT_TESTED: "Not tested against all limits: {}. Those that load cases test are kept.",
    CaseVerdict.NO_LIMITS: "No limits: {}. Springs stay within their identified ranges, and nothing else is judged.",
    CaseVerdict.UNDECIDED: "Not decided: {}. No limit is known to be exceeded, but in some load cases a range reaches "
    "beyond one.",
}
_NOTHING = 1e-9  # of rounding, in display units


def write_simulation(
    path: str | Path, name: str, description: str, source: str, candidates: Sequence[CandidateAnswer],
    answers: Sequence[CaseAnswer],
) -> None:  # fmt: skip
    """Write the report of a simulation.

    Parameters
    ----------
    path : str or Path                 Ending in .html or .pdf.
    name, description, source : str    Of the system, and the name of its file.
    candidates : sequence of CandidateAnswer
    answers : sequence of CaseAnswer

    Raises
    ------
    StrandspringError                  If the ending does not suit, the package `typst` is missing for a PDF, or the
                                       file cannot be written.
    """
    check_report_path(path)
    kept = [place for place, answer in enumerate(answers) if answer.courses is not None]
    nearest = sorted(kept, key=lambda place: -answers[place].severity)[:_MOST_HISTORIES]
    drawn = {place: answers[place] for place in sorted(nearest)}
    names = {
        place: f"{answer.case.name if len(candidates) == 1 else answer.where}: {answer.verdict.value}"
        for place, answer in drawn.items()
    }
    cases = list({answer.case.name: answer.case for answer in answers}.values())
    drawing = system_drawing(candidates[0].system, cases)
    sections = [
        Section("verdict", "Verdict", tuple(_verdict(answers))),
        Section("cautions", "Cautions", tuple(_cautions(candidates, answers))),
        Section("system", "System", (*drawing, *inputs(candidates, answers, cases, source))),
        Section("rest", "At rest", tuple(at_rest(candidates))),
    ]
    if drawn:
        sections.append(Section("histories", "Histories", tuple(_histories(candidates, answers, drawn))))
        spectra = tuple(filter(None, (motion_charts.shock_spectra(drawn), motion_charts.power_spectra(drawn))))
        if spectra:
            sections.append(Section("spectra", "Spectra in and out", (Gallery(spectra), *_settled(answers))))
    sections.append(Section("modes", "Natural modes", tuple(natural_modes(candidates))))
    sections.append(Section("errors", "Errors and energy", tuple(_errors(answers))))
    content = PageContent(
        title=f"Simulation: {name}",
        subtitle=description,
        sections=tuple(sections),
        records=names,
        footer=f"strandspring {__version__}",
        noun="Case",
        first=max(drawn, key=lambda place: drawn[place].severity, default=None),
        panels=_MOST_HISTORIES,
    )
    write(path, content)


def _verdict(answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    by_candidate: dict[str, list[CaseAnswer]] = {}
    for answer in answers:
        by_candidate.setdefault(answer.candidate, []).append(answer)
    overall = overall_verdicts(answers)
    best = next((verdict for verdict in _HEADS if verdict in overall.values()), CaseVerdict.FAILS)
    names = ", ".join(name for name, verdict in overall.items() if verdict is best)
    head = _HEADS.get(best, "No candidate is within all limits in all load cases.")
    yield Notice(_LEVELS.get(best, Level.POOR), head.format(names))
    for kind in untested(answers):
        yield Notice(Level.CARE, words(kind.untested, Reader.FILE))
    yield Tiles(tuple(_tile(name, of_candidate) for name, of_candidate in list(by_candidate.items())[:_MOST_TILES]))
    if chart := verdict_charts.shares_of_limits(answers):
        yield Gallery((chart,))
    yield _verdict_table(answers)
    if len(answers) > MOST_ROWS:
        yield Text(f"{len(answers) - MOST_ROWS} more rows are left out here; a CSV file has them all.")
    yield Text(
        "Acceleration is the largest absolute one of the worst point, sway the largest displacement from rest "
        "relative to the base, stroke the largest share of a spring's way from rest to the end of its identified "
        "range. Each is given with the range that is unknown, and in percent of its limit where it has one."
    )


def _tile(name: str, answers: Sequence[CaseAnswer]) -> Tile:
    passed = sum(answer.verdict is CaseVerdict.PASSES for answer in answers)
    answer = max(answers, key=lambda answer: answer.severity)
    figure, note = answer.nearest_limit, "no figures"
    if figure is not None:
        share = percent(figure.share, 3)
        note = f"nearest limit: {figure.quantity.value} of {figure.subject} in {answer.case.name}, {share}"
    return Tile(name, f"{passed} of {len(answers)}", "cases pass", note)


def _verdict_table(answers: Sequence[CaseAnswer]) -> PageTable:
    limited = {figure.quantity for answer in answers for figure in answer.figures if figure.limit is not None}
    answers = answers[:MOST_ROWS]
    shown = (*_SHOWN, *(quantity for quantity in FigureKind if quantity in limited and quantity not in _SHOWN))
    header = ["candidate and case", "verdict"]
    header += [f"{quantity.value} [{quantity.column.shown.replace('deg', '°')}]" for quantity in shown]
    header.append("draws beyond a limit")
    rows = []
    for answer in answers:
        row = [answer.where, answer.verdict.value]
        row += [_cell(answer.worst(quantity)) for quantity in shown]
        row.append(percent(answer.beyond, 3) if answer.draws else "–")
        rows.append(tuple(row))
    begins = tuple(k for k, answer in enumerate(answers) if not k or answer.candidate != answers[k - 1].candidate)
    levels = tuple(_LEVELS.get(answer.verdict, Level.POOR) for answer in answers)
    title = "Verdict on each candidate in each load case"
    return PageTable(title, tuple(header), tuple(rows), strong=begins, levels=levels)


def _cell(figure: Figure | None) -> str:
    """The range of a figure, the share of its limit and what it is of."""
    if figure is None:
        return "–"
    low, high = (_number(figure.quantity, end) for end in (figure.low, figure.high))
    words = high if low == high else f"{low} to {high}"
    share = figure.share
    limit = "" if math.isnan(share) else f" ({'0 %' if share < _NOTHING else percent(share, 3)})"
    subject = "" if figure.quantity is FigureKind.TILT else f" {figure.subject}"
    return f"{words}{limit}{subject}"


def _number(quantity: FigureKind, value: float) -> str:
    shown = quantity.column.factor * value
    return "0" if abs(shown) < _NOTHING else number(shown, 3)


def _cautions(candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    """Refusals, and those of candidates and cases."""
    for answer in answers:
        if answer.verdict is CaseVerdict.REFUSED:
            yield Notice(Level.POOR, f"{answer.where}: refused. {prose(answer.refusal)}")
    for sentence in gathered(findings_of(candidates, answers), Reader.FILE):
        yield Notice(Level.CARE, sentence)


def _histories(
    candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer], drawn: dict[int, CaseAnswer]
) -> Iterator[Block]:
    left = sum(1 for answer in answers if answer.figures) - len(drawn)
    if left:
        yield Notice(Level.INFORMATION, f"Histories are left out of {left} of {len(answers)} answers.",
                     "Simulate fewer cases or candidates to see them.")  # fmt: skip
    judged, components = motion_charts.histories(drawn)
    yield Gallery((*judged, verdict_charts.strokes(drawn)))
    yield Gallery((*components, motion_charts.loops(drawn)))
    if paths := tuple(motion_charts.sway_paths(drawn)):
        yield Gallery(paths)
    yield from _envelopes(candidates, answers)


def _settled(answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    """Root mean squares of vibration."""
    rows = []
    for answer in answers:
        power = answer.courses.power if answer.courses is not None else ()
        for k, (name, values) in enumerate(answer.settled):
            error = max((spectrum.root_mean_square_error for spectrum in power[k]), default=0.0) if power else math.nan
            cells = (*map(tiny, values), percent(error) if math.isfinite(error) else "–")
            rows.append((f"{answer.where}, {name}", *cells))
    header = (
        "candidate, case and point", "x [g]", "y [g]", "z [g]", "x [mm]", "y [mm]", "z [mm]", "statistical error",
    )  # fmt: skip
    yield from first_rows("Root mean squares of acceleration, and of sway about its mean", header, rows)


def _envelopes(candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    """The room that each point needs."""
    rows = []
    for candidate in candidates:
        answered = [answer for answer in answers if answer.candidate == candidate.name and answer.runs]
        for k, point in enumerate(candidate.system.points):
            sways = [run.figures.sway_components[k] for answer in answered for run in answer.runs]
            if sways:
                largest = [max(float(sway[axis]) for sway in sways) for axis in range(3)]
                rows.append((f"{candidate.name}, {point.name}", *(tiny(1e3 * component) for component in largest)))
    header = ("candidate and point", "± x [mm]", "± y [mm]", "± z [mm]")
    yield from first_rows("Sway envelope from rest over all load cases", header, rows)


def _errors(answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    rows = []
    for answer in answers:
        if not answer.runs:
            continue
        row = [answer.where]
        for quantity in (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.STROKE):
            figure = answer.worst(quantity)
            row.append("–" if figure is None or not figure.value else percent(figure.error / figure.value))
        residual = max(run.energies.relative_residual for run in answer.runs)
        exchanged = max(run.energies.exchanged for run in answer.runs)
        row += [number(1e6 * answer.runs[0].step), number(exchanged), percent(residual)]
        rows.append(tuple(row))
    header = (
        "candidate and case", "acceleration", "sway", "stroke", "step [µs]", "energy exchanged [J]", "residual",
    )  # fmt: skip
    if rows:
        yield from first_rows("Numerical errors and energy balance", header, rows)
        yield Text(
            "The error is a bound: the change from the run with twice the step. The residual of the energy balance is "
            "over the energy exchanged."
        )
