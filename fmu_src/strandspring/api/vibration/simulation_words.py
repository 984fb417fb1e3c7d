"""Answers about systems in words and as tables for a terminal."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterator, Sequence

import numpy as np

from ...kernel.arrays import FloatArray
from ...vibration.bodies.axis_names import axis_names
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.verdicts.answers import CandidateAnswer, CaseAnswer
from ...vibration.verdicts.case_cautions import Caution, CautionKind
from ...vibration.verdicts.static_answer import SECANT_SHARE, StaticAnswer
from ...vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind
from ..common.text import counted
from ..common.text_table import table_lines

_NOTHING = 1e-9  # of rounding, in the unit for people
_JUDGED = (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.TILT, FigureKind.STROKE)


def headline(name: str, answers: Sequence[CaseAnswer]) -> str:
    """The verdicts counted."""
    candidates = len({answer.candidate for answer in answers})
    cases = len({answer.case.name for answer in answers})
    counts = Counter(answer.verdict for answer in answers)
    verdicts = ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in CaseVerdict if counts[verdict])
    where = f"{counted(candidates, 'candidate')} in {counted(cases, 'load case')}"
    return f"{name}: {where}: {verdicts}" if answers else f"{name}: no load case"


def verdict_table(answers: Sequence[CaseAnswer]) -> tuple[list[str], list[list[str]], Collection[str]]:
    """Headings, rows, and which columns are of text: the figure of each kind that is nearest to its limit."""
    headings = [
        "candidate", "case", "verdict", "acceleration g", "of limit", "at point", "sway mm", "of limit", "at point",
        "tilt deg", "of limit", "stroke %", "of limit", "of mount", "error %",
    ]  # fmt: skip
    rows = []
    for answer in answers:
        row = [answer.candidate, answer.case.name, answer.verdict.value]
        for quantity in _JUDGED:
            figure = answer.worst(quantity)
            row += [_value(figure), _of_limit(figure)]
            if quantity is not FigureKind.TILT:
                row.append("-" if figure is None else figure.subject)
        rows.append([*row, _largest_error(answer)])
    return headings, rows, {"candidate", "case", "verdict", "at point", "of mount"}


def _value(figure: Figure | None) -> str:
    if figure is None:
        return "-"
    low, high = (figure.quantity.column.factor * end for end in (figure.low, figure.high))
    if abs(high) < _NOTHING:
        return "0"
    return f"{high:.4g}" if high - low < 1e-3 * high else f"{low:.4g} to {high:.4g}"


def _of_limit(figure: Figure | None) -> str:
    return "-" if figure is None or figure.limit is None else f"{100.0 * figure.high / figure.limit:.0f} %"


def _largest_error(answer: CaseAnswer) -> str:
    """Of the figures that are judged, relative to each."""
    if not answer.figures:
        return "-"
    errors = [
        figure.error / largest
        for quantity in (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.STROKE)
        if (largest := max((judged.value for judged in answer.figures_of(quantity)), default=0.0)) > 0.0
        for figure in answer.figures_of(quantity)
    ]
    return f"{100.0 * max(errors, default=0.0):.2g}"


def detail_lines(
    candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer], width: int | None = None
) -> Iterator[str]:
    """Each candidate with its static pose, modes and cases."""
    for candidate in candidates:
        of_candidate = [answer for answer in answers if answer.candidate == candidate.name]
        yield ""
        yield f"{candidate.name}:"
        yield from static_lines(candidate, width)
        for answer in of_candidate:
            if answer.verdict is CaseVerdict.REFUSED:
                yield f"  {answer.case.name}: refused: {answer.refusal}"
        yield from run_lines(of_candidate, width)
        yield from rms_lines(of_candidate, width)
        for sentence in candidate.cautions:
            yield f"  Caution: {sentence}"
        for sentence in grouped_cautions(of_candidate):
            yield f"  Caution: {sentence}"


def static_lines(candidate: CandidateAnswer, width: int | None = None) -> Iterator[str]:
    """Static pose and modes in words."""
    static = candidate.static
    if static is None:
        yield f"  refused: {candidate.refusal}"
        return
    for k, body in enumerate(candidate.system.bodies):
        tilt = math.degrees(static.tilt[:, k].max())
        moved = _moved(1e3 * np.array([pose.displacements[k] for pose in static.poses]))
        tilted = f", tilted by up to {_tiny(tilt)} degrees" if tilt >= _NOTHING else ""
        yield f"  {body.name} rests {moved} {_friction(static)}{tilted}"
    low, high = static.places.min(), static.places.max()
    yield (
        f"  springs at rest between {100.0 * low:.0f} and {100.0 * high:.0f} % of their identified ranges, "
        f"{_friction(static)}; {_by_weight(static, candidate.system)}"
    )
    if static.tangent:
        rows = []
        for k, mode in enumerate(static.tangent):
            secant = static.secant[k] if static.secant else None
            rows.append(
                [
                    str(k + 1),
                    f"{mode.frequency:.4g}",
                    mode.words,
                    "-" if secant is None else f"{secant.frequency:.4g}",
                    "-" if secant is None else f"{100.0 * secant.damping:.2g}",
                ]
            )
        share = f"{100.0 * SECANT_SHARE:.0f}"
        yield f"  modes: small motion (tangent), and springs moving by {share} % of their free travel (secant):"
        yield from table_lines(["mode", "Hz", "motion", "secant Hz", "damping %"], rows, {"motion"}, width)


def _moved(displacements: FloatArray) -> str:
    """Displacements from the nominal pose by omega, shape (poses, 3) [mm], in words."""
    ranges = [
        f"{name} {_tiny(low)}" if high - low < _NOTHING else f"{name} {_tiny(low)} to {_tiny(high)}"
        for name, low, high in zip(
            "xyz", displacements.min(axis=0).tolist(), displacements.max(axis=0).tolist(), strict=True
        )
        if max(abs(low), abs(high)) >= _NOTHING
    ]
    return f"at {', '.join(ranges)} mm from its nominal pose" if ranges else "in its nominal pose"


def run_lines(answers: Sequence[CaseAnswer], width: int | None = None) -> Iterator[str]:
    """Draws, step and energy balance of each case."""
    rows = []
    for answer in answers:
        if answer.runs:
            residual = max(run.energies.relative_residual for run in answer.runs)
            step = 1e6 * answer.runs[0].step
            beyond = f"{100.0 * answer.beyond:.3g}" if answer.draws else "-"
            cells = [answer.case.name, str(answer.draws), beyond, str(answer.refused)]
            rows.append([*cells, f"{step:.4g}", f"{100.0 * residual:.2g}"])
    if rows:
        yield "  draws of omega at rest, springs and realisations; step of the nominal run:"
        headings = ["case", "draws", "beyond a limit %", "refused", "step us", "energy residual %"]
        yield from table_lines(headings, rows, {"case"}, width)
    for answer in answers:
        if answer.refused:
            yield f"  {answer.case.name}: {answer.refused} draws refused, most often: {answer.refusal}"


def rms_lines(answers: Sequence[CaseAnswer], width: int | None = None) -> Iterator[str]:
    """Root mean squares of the points in cases that settle."""
    rows = []
    for answer in answers:
        values = [
            [quantity.column.factor * figure.value for figure in answer.figures_of(quantity)]
            for quantity in (FigureKind.RMS_ACCELERATION, FigureKind.RMS_SWAY)
        ]
        for k, point in enumerate(answer.system.points if values[0] else ()):
            cells = [_tiny(value) for kind in values for value in kind[3 * k : 3 * k + 3]]
            rows.append([answer.case.name, point.name, *cells])
    if rows:
        yield "  root mean squares from the settling on, of sway about its mean:"
        headings = ["case", "point", "x g", "y g", "z g", "x mm", "y mm", "z mm"]
        yield from table_lines(headings, rows, {"case", "point"}, width)


def _friction(static: StaticAnswer) -> str:
    """What the static poses are of."""
    return "with friction" if len(static.poses) > 1 else "at the omega that is given"


def _by_weight(static: StaticAnswer, system: MountedSystem) -> str:
    """Which way the weight moves the springs, which tells an axis of the wrong sense."""
    nominal = np.array([axis.nominal for _, axis in system.axes()])
    ways = static.poses[0].displacement - nominal
    most = int(np.argmax(np.abs(ways)))
    at = "without friction" if not static.poses[0].omega.any() else _friction(static)
    return f"{at} the weight moves {axis_names(system)[most]} by {1e3 * ways[most]:+.3g} mm"


def _tiny(value: float) -> str:
    return "0" if abs(value) < _NOTHING else f"{value:.3g}"


def grouped_cautions(answers: Sequence[CaseAnswer]) -> Iterator[str]:
    """For each kind of caution the largest one of several cases."""
    by_kind: dict[CautionKind, list[tuple[Caution, CaseAnswer]]] = {}
    for answer in answers:
        for caution in answer.cautions:
            by_kind.setdefault(caution.kind, []).append((caution, answer))
    for pairs in (by_kind[kind] for kind in CautionKind if kind in by_kind):
        caution, answer = max(pairs, key=lambda pair: pair[0].measure)
        others = len({id(affected) for _, affected in pairs}) - 1
        more = f" (less so in {counted(others, 'other case')})" if others else ""
        yield f"{answer.case.name}{more}: {caution.text}"
