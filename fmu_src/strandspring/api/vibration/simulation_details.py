"""What `simulate` prints with `--verbose`: static poses, modes, all kinds of figures, energy balances."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...kernel.arrays import FloatArray
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.verdicts.answers import CandidateAnswer, CaseAnswer
from ...vibration.verdicts.static_answer import SECANT_SHARE, StaticAnswer
from ...vibration.verdicts.verdicts import Figure, FigureKind
from ..common.table import table_lines

_NOTHING = 1e-9  # of rounding, in the unit for people
_JUDGED = {
    FigureKind.ACCELERATION: "at point",
    FigureKind.SWAY: "at point",
    FigureKind.TILT: "of body",
    FigureKind.STROKE: "of mount",
}  # each with what it is of


def detail_lines(
    candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer], width: int | None = None
) -> Iterator[str]:
    """Each candidate with its static pose, modes and cases."""
    for candidate in candidates:
        of_candidate = [answer for answer in answers if answer.candidate == candidate.name]
        yield ""
        yield f"{candidate.name}:"
        yield from static_lines(candidate, width)
        yield from figure_lines(of_candidate, width)
        yield from run_lines(of_candidate, width)
        yield from rms_lines(of_candidate, width)


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


def figure_lines(answers: Sequence[CaseAnswer], width: int | None = None) -> Iterator[str]:
    """The figure of each kind that is nearest to its limit, with its subject and its largest numerical error."""
    headings = ["case"]
    for quantity, subject in _JUDGED.items():
        headings += [f"{quantity.value} {quantity.column.shown}", "of limit", subject]
    rows = []
    for answer in answers:
        if answer.figures:
            worst = [answer.worst(quantity) for quantity in _JUDGED]
            cells = [cell for figure in worst for cell in _cells(figure)]
            rows.append([answer.case.name, *cells, f"{100.0 * answer.relative_error:.2g}"])
    if rows:
        yield "  largest of what is unknown, and the largest numerical error of any figure:"
        yield from table_lines([*headings, "error %"], rows, {"case", *_JUDGED.values()}, width)


def _cells(figure: Figure | None) -> tuple[str, str, str]:
    if figure is None:
        return "-", "-", "-"
    value = figure.quantity.column.factor * figure.high
    share = figure.share
    return (
        "0" if abs(value) < _NOTHING else f"{value:.4g}",
        "-" if math.isnan(share) else f"{100.0 * share:.0f} %",
        figure.subject,
    )


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
            beyond = f"{100.0 * answer.beyond:.3g}" if answer.draws else "-"
            steps = f"{1e6 * answer.runs[0].step:.4g}"
            rows.append(
                [answer.case.name, str(answer.draws), beyond, str(answer.refused), steps, f"{100.0 * residual:.2g}"]
            )
    if rows:
        yield "  draws of omega at rest, springs, mounts and realisations; step of the nominal run:"
        headings = ["case", "draws", "beyond a limit %", "refused", "step us", "energy residual %"]
        yield from table_lines(headings, rows, {"case"}, width)


def rms_lines(answers: Sequence[CaseAnswer], width: int | None = None) -> Iterator[str]:
    """Root mean squares of the points in cases that settle."""
    rows = [[answer.case.name, name, *map(_tiny, values)] for answer in answers for name, values in answer.settled]
    if rows:
        yield "  root mean squares from the settling on, of sway about its mean:"
        headings = ["case", "point", "x g", "y g", "z g", "x mm", "y mm", "z mm"]
        yield from table_lines(headings, rows, {"case", "point"}, width)


def _friction(static: StaticAnswer) -> str:
    """What the static poses are of."""
    return "with friction" if len(static.poses) > 1 else "at the omega that is given"


def _by_weight(static: StaticAnswer, system: MountedSystem) -> str:
    """Which way the weight moves the springs, which tells an axis of the wrong sense."""
    nominal = np.array([axis.nominal for axis in system.axes])
    ways = static.poses[0].displacement - nominal
    most = int(np.argmax(np.abs(ways)))
    at = "without friction" if not static.poses[0].omega.any() else _friction(static)
    return f"{at} the weight moves {system.axis_names[most]} by {1e3 * ways[most]:+.3g} mm"


def _tiny(value: float) -> str:
    return "0" if abs(value) < _NOTHING else f"{value:.3g}"
