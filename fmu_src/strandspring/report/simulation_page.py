"""`write_simulation`: answers about a system as one page that opens offline, or as a document for print."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from .._version import __version__
from ..vibration.verdicts.answers import CandidateAnswer, CaseAnswer
from ..vibration.verdicts.case_cautions import CautionKind
from ..vibration.verdicts.static_answer import SECANT_SHARE
from ..vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind
from .charts import motion_charts as charts
from .content.blocks import Block, Content, Facts, Gallery, Level, Notice, Section, Table, Text, Tile, Tiles
from .content.chart import Figure as Drawing
from .content.quantities import number, percent, prose
from .rendering.page import check_report_path, write

_JUDGED = (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.TILT, FigureKind.STROKE)
_MOST_TILES, _MOST_ROWS, _MOST_MODES = 8, 400, 12
_NOTHING = 1e-9  # of rounding, in display units


@dataclass(frozen=True, eq=False)
class SimulationContent:
    """What a report is made of.

    Parameters
    ----------
    name, description, source : str    Of the system, and the name of its file.
    candidates : sequence of CandidateAnswer
    answers : sequence of CaseAnswer
    draws : int
    """

    name: str
    description: str
    source: str
    candidates: Sequence[CandidateAnswer]
    answers: Sequence[CaseAnswer]
    draws: int


def write_simulation(path: str | Path, of: SimulationContent) -> None:
    """Write the report of a simulation.

    Parameters
    ----------
    path : str or Path            Ending in .html or .pdf.
    of : SimulationContent

    Raises
    ------
    StrandspringError             If the ending does not suit, the package `typst` is missing for a PDF, or the file
                                  cannot be written.
    """
    check_report_path(path)
    write(path, simulation_content(of))


def simulation_content(of: SimulationContent) -> Content:
    """Everything the report says."""
    drawn = {place: answer for place, answer in enumerate(of.answers) if answer.courses is not None}
    several = len(of.candidates) > 1
    names = {
        place: f"{answer.candidate}, {answer.case.name}" if several else answer.case.name
        for place, answer in drawn.items()
    }
    sections = [
        Section("verdict", "Verdict", tuple(_verdict(of))),
        Section("rest", "At rest", tuple(_rest(of))),
        Section("modes", "Natural modes", tuple(_modes(of))),
        Section("cautions", "Cautions", tuple(_cautions(of))),
    ]
    if drawn:
        sections.append(Section("histories", "Histories", tuple(_histories(of, drawn))))
        spectra = [one for one in (charts.shock_spectra(drawn), charts.power_spectra(drawn)) if one is not None]
        if spectra:
            sections.append(Section("spectra", "Spectra in and out", (Gallery(tuple(spectra)), *_settled(of))))
    sections.append(Section("errors", "Unknowns, errors and energy", tuple(_errors(of))))
    sections.append(Section("description", "Load cases", tuple(_description(of))))
    return Content(
        title=f"Simulation: {of.name}",
        subtitle=of.description,
        sections=tuple(sections),
        records=names,
        footer=f"strandspring {__version__}",
        noun="Case",
    )


def _verdict(of: SimulationContent) -> Iterator[Block]:
    by_candidate: dict[str, list[CaseAnswer]] = {}
    for answer in of.answers:
        by_candidate.setdefault(answer.candidate, []).append(answer)
    good = [name for name, own in by_candidate.items() if all(one.verdict is CaseVerdict.PASSES for one in own)]
    if good:
        yield Notice(Level.GOOD, f"Within all limits in all load cases: {', '.join(good)}.")
    elif of.answers:
        yield Notice(Level.POOR, "No candidate is within all limits in all load cases.")
    yield Tiles(tuple(_tile(name, own) for name, own in list(by_candidate.items())[:_MOST_TILES]))
    yield _verdict_table(of)
    if len(of.answers) > _MOST_ROWS:
        yield Text(f"{len(of.answers) - _MOST_ROWS} more rows are left out here; a CSV file has them all.")
    yield Text(
        "Acceleration is the largest absolute one of the worst point, sway the largest displacement from rest "
        "relative to the base, stroke the largest share of a spring's way from rest to the end of its identified "
        "range. Each is the worst of all static equilibria, in percent of its limit where it has one."
    )
    if not of.draws:
        yield Notice(Level.INFORMATION, "The spread by the uncertainty of the model files was not asked for.",
                     "Simulate with draws to see it.")  # fmt: skip
    if any(answer.figures for answer in of.answers):
        yield Gallery((charts.acceleration_against_stroke(of.answers),))


def _tile(name: str, own: Sequence[CaseAnswer]) -> Tile:
    passed = sum(answer.verdict is CaseVerdict.PASSES for answer in own)
    limited = [
        (figure.value / figure.limit, figure, answer) for answer in own for figure in answer.figures if figure.limit
    ]
    note = "no figures"
    if limited:
        share, figure, answer = max(limited, key=lambda one: one[0])
        note = f"nearest limit: {figure.quantity.value} of {figure.subject} in {answer.case.name}, {percent(share, 3)}"
    return Tile(name, f"{passed} of {len(own)}", "cases", note)


def _verdict_table(of: SimulationContent) -> Table:
    header = ["candidate and case", "verdict"]
    for quantity in _JUDGED:
        header.append(f"{quantity.value} [{quantity.column.shown.replace('deg', '°')}]")
        if of.draws and quantity is not FigureKind.TILT:
            header.append("5 to 95 %")
    if of.draws:
        header.append("draws beyond a limit")
    rows = []
    for answer in of.answers[:_MOST_ROWS]:
        row = [f"{answer.candidate}, {answer.case.name}", answer.verdict.value]
        for quantity in _JUDGED:
            figure = answer.worst(quantity)
            row.append(_cell(figure))
            if of.draws and quantity is not FigureKind.TILT:
                row.append(_spread(figure))
        if of.draws:
            row.append("–" if answer.spread is None else percent(answer.spread.failing, 3))
        rows.append(tuple(row))
    begins = tuple(
        k
        for k, answer in enumerate(of.answers[:_MOST_ROWS])
        if not k or answer.candidate != of.answers[k - 1].candidate
    )
    return Table("Verdict on each candidate in each load case", tuple(header), tuple(rows), strong=begins)


def _cell(figure: Figure | None) -> str:
    if figure is None:
        return "–"
    limit = "" if figure.limit is None else f" ({_share(figure)})"
    subject = "" if figure.quantity is FigureKind.TILT else f" {figure.subject}"
    return f"{_number(figure.quantity, figure.value)}{limit}{subject}"


def _share(figure: Figure) -> str:
    """Of the limit."""
    share = figure.value / (figure.limit or math.inf)
    return "0 %" if share < _NOTHING else percent(share, 3)


def _number(quantity: FigureKind, value: float) -> str:
    shown = quantity.column.factor * value
    return "0" if abs(shown) < _NOTHING else number(shown, 4)


def _spread(figure: Figure | None) -> str:
    if figure is None or figure.spread is None:
        return "–"
    return f"{_number(figure.quantity, figure.spread.low)} to {_number(figure.quantity, figure.spread.high)}"


def _rest(of: SimulationContent) -> Iterator[Block]:
    rows = []
    for one in of.candidates:
        if one.static is None:
            yield Notice(Level.POOR, f"{one.name}: {prose(one.refusal)}")
            continue
        for k, body in enumerate(one.system.bodies):
            for at, pose in enumerate(one.static.poses):
                moved = [_tiny(1e3 * float(each)) for each in pose.displacements[k]]
                tilt = _tiny(math.degrees(float(one.static.tilt[at, k])))
                low, high = one.static.places[at].min(), one.static.places[at].max()
                place = f"{number(100.0 * low, 3)} to {number(100.0 * high, 3)}"
                rows.append((f"{one.name}, {body.name}", _omega(pose.share), *moved, tilt, place))
    if rows:
        header = ("candidate and body", "omega", "x [mm]", "y [mm]", "z [mm]", "tilt [°]", "springs in their range [%]")
        yield Table("Static pose from the nominal one, for each omega at rest", header, tuple(rows[:_MOST_ROWS]))
        yield Text(
            "omega of springs at rest is unknown; it is 0, 1 or −1 times the sign of each spring's static force. "
            "0 % is the lower end of a spring's identified range, 100 % its upper end."
        )


def _modes(of: SimulationContent) -> Iterator[Block]:
    share = percent(SECANT_SHARE)
    header = ("mode", "tangent [Hz]", "motion", f"secant at {share} [Hz]", "damping [%]")
    for one in of.candidates:
        if one.static is None or not one.static.tangent:
            continue
        rows = []
        for k, mode in enumerate(one.static.tangent[:_MOST_MODES]):
            secant = one.static.secant[k] if one.static.secant else None
            of_loops = ("–", "–") if secant is None else (number(secant.frequency), number(100.0 * secant.damping, 2))
            rows.append((str(k + 1), number(mode.frequency), mode.words, *of_loops))
        yield Table(f"Natural modes of {one.name}", header, tuple(rows))
    yield Text(
        "Tangent: of vanishing motion about the static pose with omega 0. Secant: with the stiffness and the losses "
        f"of steady loops in which each spring moves by {share} of its way to the nearer end of its identified range."
    )


def _cautions(of: SimulationContent) -> Iterator[Block]:
    of_candidates: dict[str, list[str]] = {}
    for one in of.candidates:
        for sentence in one.cautions:
            of_candidates.setdefault(sentence, []).append(one.name)
    for sentence, names in of_candidates.items():
        yield Notice(Level.CARE, f"{', '.join(names)}: {prose(sentence)}")
    for answer in of.answers:
        if answer.refusal:
            yield Notice(Level.POOR, f"{answer.candidate}, {answer.case.name}: refused. {prose(answer.refusal)}")
    yield from _grouped(of.answers)


def _grouped(answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    """The largest caution of each kind, with where others of its kind are."""
    found: dict[CautionKind, list[tuple[float, str, str]]] = {}
    for answer in answers:
        for caution in answer.cautions:
            where = f"{answer.candidate}, {answer.case.name}"
            found.setdefault(caution.kind, []).append((caution.measure, where, caution.text))
    for cautions in (found[kind] for kind in CautionKind if kind in found):
        _, where, text = max(cautions, key=lambda one: one[0])
        others = [other for _, other, _ in cautions if other != where]
        more = f" Less so in: {'; '.join(others)}." if others else ""
        yield Notice(Level.CARE, f"{where}: {prose(text)}{more}")


def _histories(of: SimulationContent, drawn: Mapping[int, CaseAnswer]) -> Iterator[Block]:
    places = dict(drawn)
    left = sum(1 for answer in of.answers if answer.figures and answer.courses is None)
    if left:
        yield Notice(Level.INFORMATION, f"Histories are left out of {left} of {len(of.answers)} answers.",
                     "Simulate fewer cases or candidates to see them.")  # fmt: skip
    figures: list[Drawing] = [*charts.histories(places), charts.loops(places)]
    yield Gallery(tuple(figures))
    paths = tuple(charts.sway_paths(places))
    if paths:
        yield Gallery(paths)
    yield from _envelopes(of)


def _settled(of: SimulationContent) -> Iterator[Block]:
    """Root mean squares of vibration."""
    rows = []
    for answer in of.answers:
        values = [
            [one.quantity.column.factor * one.value for one in answer.figures_of(FigureKind.RMS_ACCELERATION)],
            [one.quantity.column.factor * one.value for one in answer.figures_of(FigureKind.RMS_SWAY)],
        ]
        if not values[0]:
            continue
        power = answer.courses.power if answer.courses is not None else ()
        for k, point in enumerate(answer.system.points):
            cells = [_tiny(value) for kind in values for value in kind[3 * k : 3 * k + 3]]
            error = max((one.root_mean_square_error for one in power[k]), default=0.0) if power else math.nan
            where = f"{answer.candidate}, {answer.case.name}, {point.name}"
            rows.append((where, *cells, percent(error) if math.isfinite(error) else "–"))
    if rows:
        header = (
            "candidate, case and point", "x [g]", "y [g]", "z [g]", "x [mm]", "y [mm]", "z [mm]", "statistical error",
        )  # fmt: skip
        yield Table("Root mean squares of acceleration, and of sway about its mean", header, tuple(rows[:_MOST_ROWS]))


def _envelopes(of: SimulationContent) -> Iterator[Block]:
    """The room that each point needs."""
    rows = []
    for one in of.candidates:
        own = [answer for answer in of.answers if answer.candidate == one.name and answer.runs]
        for k, point in enumerate(one.system.points):
            sways = [run.figures.sway_components[k] for answer in own for run in answer.runs]
            if sways:
                largest = [max(float(sway[axis]) for sway in sways) for axis in range(3)]
                rows.append((f"{one.name}, {point.name}", *(_tiny(1e3 * each) for each in largest)))
    if rows:
        header = ("candidate and point", "± x [mm]", "± y [mm]", "± z [mm]")
        yield Table("Sway envelope from rest over all load cases", header, tuple(rows[:_MOST_ROWS]))


def _errors(of: SimulationContent) -> Iterator[Block]:
    rows = []
    for answer in of.answers:
        if not answer.runs:
            continue
        row = [f"{answer.candidate}, {answer.case.name}"]
        for quantity in (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.STROKE):
            figure = answer.worst(quantity)
            row.append(
                "–" if figure is None else
                f"{_number(quantity, figure.min)} to {_number(quantity, figure.value)} ({_omega(figure.share)})"
            )  # fmt: skip
            row.append("–" if figure is None or not figure.value else percent(figure.error / figure.value))
        residual = max(run.energies.relative_residual for run in answer.runs)
        exchanged = max(run.energies.exchanged for run in answer.runs)
        row += [number(1e6 * min(run.step for run in answer.runs)), number(exchanged), percent(residual)]
        rows.append(tuple(row))
    header = (
        "candidate and case", "acceleration [g] (omega)", "error", "sway [mm] (omega)", "error", "stroke [%] (omega)",
        "error", "step [µs]", "energy exchanged [J]", "residual",
    )  # fmt: skip
    if rows:
        yield Table("Range over omega at rest, numerical errors and energy balance", header, tuple(rows[:_MOST_ROWS]))
        yield Text(
            "Each figure is given from the least to the worst static equilibrium, with omega of the worst. The "
            "error is a third of the change from the run with twice the step. The residual of the energy balance is "
            "over the energy exchanged."
        )


def _description(of: SimulationContent) -> Iterator[Block]:
    cases = {answer.case.name: answer.case for answer in of.answers}
    yield Facts((("File", of.source), *((name, case.text or case.kind) for name, case in cases.items())))


def _omega(share: float) -> str:
    return number(share, 3, sign=True) if share else "0"


def _tiny(value: float) -> str:
    return "0" if abs(value) < _NOTHING else number(value, 4)
