"""Reports of systems on mounts: `write_simulation` of load cases, `write_system_isolation` of steady vibration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import Reader
from ..findings import Finding, gathered, words
from ..ground.result_columns import ResultColumn, texts
from ..vibration.bodies.mounted import MountedSystem
from ..vibration.bodies.six_response import SystemResponse
from ..vibration.description.system_file import SystemFile
from ..vibration.verdicts.answers import CandidateAnswer, CaseAnswer, findings_of, overall_verdicts, untested
from ..vibration.verdicts.verdicts import CaseVerdict
from . import check_report_path, system_charts
from .drawing import percent
from .page import (
    Block,
    Gallery,
    Level,
    Notice,
    Page,
    Parts,
    Section,
    Source,
    Table,
    Tile,
    Tiles,
    blocks_of,
    write_page,
)

_MOST_TILES, _MOST_HISTORIES = 8, 40
_LEVELS = {
    CaseVerdict.NO_LIMITS: Level.INFORMATION,
    CaseVerdict.PASSES: Level.GOOD,
    CaseVerdict.NOT_TESTED: Level.CARE,
    CaseVerdict.UNDECIDED: Level.CARE,
    CaseVerdict.FAILS: Level.POOR,
    CaseVerdict.OUTSIDE: Level.POOR,
    CaseVerdict.REFUSED: Level.POOR,
}
# Of the best candidates.
_HEADS = {
    CaseVerdict.PASSES: "Within all limits in all load cases: {}.",
    CaseVerdict.NOT_TESTED: "Not tested against all limits: {}. Those that load cases test are kept.",
    CaseVerdict.NO_LIMITS: "No limits: {}. Springs stay within their identified ranges, and nothing else is judged.",
    CaseVerdict.UNDECIDED: "Not decided: {}. No limit is known to be exceeded, but in some load cases a range reaches "
    "beyond one.",
}
_LOADS = (
    ResultColumn("axis", "", "candidate and axis", "candidate and axis"),
    ResultColumn("force", "N", "static load", "static load", "N", 1.0, 3),
    ResultColumn("moved", "m", "deflection", "deflection", "mm", 1e3, 3),
    ResultColumn("place", "1", "place in the range", "place in the range", "%", 100.0, 3),
    ResultColumn("down", "m", "free stroke down", "free stroke down", "mm", 1e3, 3),
    ResultColumn("up", "m", "free stroke up", "free stroke up", "mm", 1e3, 3),
)
_RANGES = (
    "Acceleration is the largest absolute one of the worst point, sway the largest displacement from rest relative to "
    "the base, stroke the largest share of a spring's way from rest to the end of its identified range. Friction "
    "leaves a range of static equilibria. The static load is the force of an axis; its deflection is that of the mount "
    "from its nominal place, positive as its direction. 0 % is the lower end of a spring's identified range, 100 % its "
    "upper end, and the free stroke of the mount ends there."
)


def write_simulation(
    path: str | Path, file: SystemFile, candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer],
    parts: Parts,
) -> None:  # fmt: skip
    """Write the report of a simulation with the lines and tables of its result.

    Raises
    ------
    StrandspringError       If the file does not end in .html, or cannot be written.
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
    drawings = Gallery([*system_charts.system_drawing(candidates[0].system, cases)])
    levels = {verdict.value: level for verdict, level in _LEVELS.items()}
    cautions = [Notice(Level.CARE, sentence) for sentence in gathered(findings_of(candidates, answers), Reader.FILE)]
    loads = Table.of("Static load and stroke of each mount", texts(_LOADS, list(_loads(candidates))))
    sections = [
        Section("verdict", "Verdict", [*_verdict(answers)]),
        Section("cautions", "Cautions", cautions),
        Section("figures", "Figures", [*blocks_of(parts, levels=levels), loads, _RANGES]),
        Section("system", "System", [drawings, system_charts.DRAWN]),
        Section("description", "Description as it was read", [Source(file.text)] if file.text else [], True),
        Section("histories", "Histories and spectra", [*_histories(answers, drawn)]),
    ]
    worst = max(drawn, key=lambda place: drawn[place].severity, default=None)
    write_page(path, Page(f"Simulation: {file.name}", file.description, sections, names, noun="Case", first=worst))


def _verdict(answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    overall = overall_verdicts(answers)
    best = next((verdict for verdict in _HEADS if verdict in overall.values()), CaseVerdict.FAILS)
    names = ", ".join(name for name, verdict in overall.items() if verdict is best)
    head = _HEADS.get(best, "No candidate is within all limits in all load cases.")
    yield Notice(_LEVELS[best], head.format(names))
    for kind in untested(answers):
        yield Notice(Level.CARE, words(kind.untested, Reader.FILE))
    yield Tiles([_tile(name, [one for one in answers if one.candidate == name]) for name in [*overall][:_MOST_TILES]])
    if chart := system_charts.shares_of_limits(answers):
        yield Gallery([chart])


def _tile(name: str, answers: Sequence[CaseAnswer]) -> Tile:
    passed = sum(answer.verdict is CaseVerdict.PASSES for answer in answers)
    answer = max(answers, key=lambda answer: answer.severity)
    figure, note = answer.nearest_limit, "no figures"
    if figure is not None:
        share = percent(figure.share, 3)
        note = f"nearest limit: {figure.quantity.value} of {figure.subject} in {answer.case.name}, {share}"
    return Tile(name, f"{passed} of {len(answers)}", "cases pass", note)


def _loads(candidates: Sequence[CandidateAnswer]) -> Iterator[dict[str, Any]]:
    """Static load and stroke of each axis of the mounts."""
    for candidate in candidates:
        if (static := candidate.static) is None:
            continue
        force = np.array([pose.force for pose in static.poses])
        displacement = np.array([pose.displacement for pose in static.poses])
        for k, (name, axis) in enumerate(zip(candidate.system.axis_names, candidate.system.axes, strict=True)):
            low, high = axis.spring.displacement_min, axis.spring.displacement_max
            moved = axis.series * (displacement[:, k] - axis.nominal)
            ranges = {"force": force[:, k], "moved": moved, "place": static.places[:, k]}
            row = {key: (float(values.min()), float(values.max())) for key, values in ranges.items()}
            down, up = displacement[:, k].min() - low, high - displacement[:, k].max()
            yield {"axis": f"{candidate.name}, {name}", **row, "down": axis.series * down, "up": axis.series * up}


def _histories(answers: Sequence[CaseAnswer], drawn: dict[int, CaseAnswer]) -> Iterator[Block]:
    left = sum(1 for answer in answers if answer.figures) - len(drawn)
    if left:
        yield Notice(Level.INFORMATION, f"Histories are left out of {left} of {len(answers)} answers.",
                     "Simulate fewer cases or candidates to see them.")  # fmt: skip
    if drawn:
        yield Gallery([system_charts.strokes(drawn), *system_charts.case_charts(drawn)])


def write_system_isolation(
    path: str | Path, name: str, system: MountedSystem, curves: Sequence[tuple[str, SystemResponse]], parts: Parts,
    findings: Sequence[Finding],
) -> None:  # fmt: skip
    """Write the report of the steady vibration of candidates, of which `system` is the first, likewise.

    Raises
    ------
    StrandspringError       If the file does not end in .html, or cannot be written.
    """
    check_report_path(path)
    names = [f"{candidate}, {response.shaking.name}, {response.level_text}" for candidate, response in curves]
    drawings = Gallery([*system_charts.system_drawing(system, ())])
    cautions = [Notice(Level.CARE, caution) for caution in gathered(findings, Reader.FILE)]
    gain = "Gain is the first harmonic of a point's absolute motion over that of the base, or its motion over a force."
    sections = (
        Section("curves", "Curves", [Gallery(system_charts.gains([response for _, response in curves])), gain]),
        Section("cautions", "Cautions", cautions),
        Section("figures", "Figures", [*blocks_of(parts)]),
        Section("system", "System", [drawings, system_charts.DRAWN]),
    )
    write_page(path, Page(f"Steady vibration: {name}", "", sections, dict(enumerate(names)),
                          noun="Curve", first=0))  # fmt: skip
