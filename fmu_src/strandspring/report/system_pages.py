"""Reports of systems on mounts: `write_simulation` of load cases, `write_system_isolation` of steady vibration."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ..core.spline import Elastic
from ..errors import Reader
from ..findings import gathered, words
from ..ground.gravity import STANDARD_GRAVITY
from ..vibration.bodies.loads import LoadCase
from ..vibration.bodies.modes import Mode
from ..vibration.bodies.mounted import MountedSystem
from ..vibration.bodies.parts import BASE, MotionKind, MountAxis, RigidBody, Vector, direction_words
from ..vibration.bodies.six_response import SystemResponse
from ..vibration.verdicts.answers import CandidateAnswer, CaseAnswer, findings_of, overall_verdicts, untested
from ..vibration.verdicts.static_answer import SECANT_SHARE
from ..vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind
from . import check_report_path, system_charts
from .page import Block, Facts, Gallery, Level, Notice, Page, Section, Table, Tile, Tiles, write_page
from .quantities import number, percent, prose

_SHOWN = (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.TILT, FigureKind.STROKE)
_MOST_TILES, _MOST_HISTORIES, _MOST_MODES = 8, 40, 12
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

Curve = tuple[str, SystemResponse]


def write_simulation(
    path: str | Path, name: str, description: str, source: str, candidates: Sequence[CandidateAnswer],
    answers: Sequence[CaseAnswer],
) -> None:  # fmt: skip
    """Write the report of a simulation.

    Parameters
    ----------
    path : str or Path                 Ending in .html.
    name, description, source : str    Of the system, and the name of its file.
    candidates : sequence of CandidateAnswer
    answers : sequence of CaseAnswer

    Raises
    ------
    StrandspringError                  If the ending does not suit, or the file cannot be written.
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
    drawings, text = system_charts.system_drawing(candidates[0].system, cases)
    sections = [
        Section("verdict", "Verdict", [*_verdict(answers)]),
        Section("cautions", "Cautions", [*_cautions(candidates, answers)]),
        Section("system", "System", [Gallery(drawings), text, *_inputs(candidates, answers, cases, source)]),
        Section("rest", "At rest", [*_at_rest(candidates)]),
    ]
    if drawn:
        sections.append(Section("histories", "Histories", [*_histories(candidates, answers, drawn)]))
        if spectra := list(system_charts.spectra(drawn)):
            sections.append(Section("spectra", "Spectra in and out", [Gallery(spectra), *_settled(answers)]))
    sections.append(Section("modes", "Natural modes", [*_secant_modes(candidates)]))
    sections.append(Section("errors", "Errors and energy", [*_errors(answers)]))
    worst = max(drawn, key=lambda place: drawn[place].severity, default=None)
    write_page(path, Page(f"Simulation: {name}", description, sections, names, noun="Case", first=worst))


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
    yield Tiles([_tile(name, of_candidate) for name, of_candidate in list(by_candidate.items())[:_MOST_TILES]])
    if chart := system_charts.shares_of_limits(answers):
        yield Gallery([chart])
    yield _verdict_table(answers)
    yield (
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


def _verdict_table(answers: Sequence[CaseAnswer]) -> Table:
    limited = {figure.quantity for answer in answers for figure in answer.figures if figure.limit is not None}
    shown = (*_SHOWN, *(quantity for quantity in FigureKind if quantity in limited and quantity not in _SHOWN))
    names = (f"{quantity.value} [{_shown_unit(quantity)}]" for quantity in shown)
    rows = []
    for answer in answers:
        cells = (_cell(answer.worst(quantity)) for quantity in shown)
        rows.append((answer.where, answer.verdict.value, *cells, percent(answer.beyond, 3) if answer.draws else "–"))
    begins = [k for k, answer in enumerate(answers) if not k or answer.candidate != answers[k - 1].candidate]
    levels = [_LEVELS.get(answer.verdict, Level.POOR) for answer in answers]
    header = ("candidate and case", "verdict", *names, "draws beyond a limit")
    return Table("Verdict on each candidate in each load case", header, rows, begins, levels)


def _shown_unit(quantity: FigureKind) -> str:
    return quantity.column.shown.replace("deg", "°")


def _cell(figure: Figure | None) -> str:
    """The range of a figure, the share of its limit and what it is of."""
    if figure is None:
        return "–"
    low, high = (_tiny(figure.quantity.column.factor * end, 3) for end in (figure.low, figure.high))
    words = high if low == high else f"{low} to {high}"
    share = figure.share
    limit = "" if math.isnan(share) else f" ({'0 %' if share < _NOTHING else percent(share, 3)})"
    subject = "" if figure.quantity is FigureKind.TILT else f" {figure.subject}"
    return f"{words}{limit}{subject}"


def _cautions(candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    """Refusals, and those of candidates and cases."""
    for answer in answers:
        if answer.verdict is CaseVerdict.REFUSED:
            yield Notice(Level.POOR, f"{answer.where}: refused. {prose(answer.refusal)}")
    for sentence in gathered(findings_of(candidates, answers), Reader.FILE):
        yield Notice(Level.CARE, sentence)


def _inputs(
    candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer], cases: Sequence[LoadCase], source: str
) -> Iterator[Block]:
    """What was read: bodies, points, mounts, limits and load cases."""
    system = candidates[0].system
    gravity = [number(part / STANDARD_GRAVITY, 4) for part in system.gravity]
    yield Facts([("File", source), ("Gravity", f"({', '.join(gravity)}) g")])
    bodies = [
        (body.name, number(body.mass), _place(body.center), *_inertia(body), _motion(body)) for body in system.bodies
    ]
    header = ("body", "mass [kg]", "centre of gravity [mm]", "Ixx, Iyy, Izz [kg m²]", "Ixy, Ixz, Iyz [kg m²]", "motion")
    yield Table("Bodies", header, bodies)
    points = [(point.name, system.bodies[point.body].name, _place(point.place)) for point in system.points]
    yield from _table("Points", ("point", "body", "place [mm]"), points)
    yield from _mounts(candidates)
    yield from _limits(answers)
    rows = [(case.name, case.text or case.kind, f"{number(case.duration)} s") for case in cases]
    yield from _table("Load cases", ("case", "load", "simulated"), rows)


def _table(title: str, header: Sequence[str], rows: Sequence[tuple[str, ...]]) -> Iterator[Block]:
    """A table if it has rows."""
    if rows:
        yield Table(title, header, rows)


def _place(place: Vector) -> str:
    return ", ".join(_tiny(1e3 * part) for part in place)


def _inertia(body: RigidBody) -> tuple[str, str]:
    if body.motion is MotionKind.AXIS:
        return "–", "–"
    inertia = np.array(body.inertia)
    if body.motion is MotionKind.PLANE:
        direction = np.array(body.direction)
        return f"{number(float(direction @ inertia @ direction))} about the normal", "–"
    products = [_tiny(float(inertia[at])) for at in ((0, 1), (0, 2), (1, 2))]
    return ", ".join(number(part) for part in np.diag(inertia).tolist()), ", ".join(products)


def _motion(body: RigidBody) -> str:
    if body.motion is MotionKind.SIX:
        return "six degrees of freedom"
    along = direction_words(body.direction)
    return f"along {along}" if body.motion is MotionKind.AXIS else f"in the plane with the normal {along}"


def _mounts(candidates: Sequence[CandidateAnswer]) -> Iterator[Block]:
    axes: dict[tuple[str, ...], None] = {}
    mounts: dict[tuple[str, ...], dict[str, None]] = {}
    if len(candidates) > 1:
        types = [
            (candidate.name, ", ".join(dict.fromkeys(mount.type_name for mount in candidate.system.mounts)))
            for candidate in candidates
        ]
        yield Table("Candidates", ("candidate", "mount types"), types)
    for system in (candidate.system for candidate in candidates):
        for mount in system.mounts:
            support = "base" if mount.support == BASE else system.bodies[mount.support].name
            body = system.bodies[mount.body].name
            mounts.setdefault((mount.name, body, support, _place(mount.place)), {})[mount.type_name] = None
            for label, axis in zip(mount.axis_labels, mount.axes, strict=True):
                axes[(f"{mount.type_name}, {label}", *_axis(axis))] = None
    rows = [(*mount, " or ".join(types_of_mount)) for mount, types_of_mount in mounts.items()]
    yield from _table("Mounts", ("mount", "carries", "stands on", "place [mm]", "type"), rows)
    header = (
        "type and axis", "direction", "model file", "parallel × series", "preload of a spring [N]",
        "nominal displacement [mm]", "identified range [mm]", "stops [mm]", "damping [N s/m]",
    )  # fmt: skip
    yield from _table("Axes of the mount types", header, list(axes))


def _axis(axis: MountAxis) -> tuple[str, ...]:
    spring, stops = axis.spring, "–"
    preload = Elastic(spring).force(axis.nominal - spring.displacement_offset)
    if axis.stops is not None:
        ends = [f"{_tiny(1e3 * end)}" for end in (axis.stops.low, axis.stops.high) if math.isfinite(end)]
        stops = f"at {' and '.join(ends)}, {number(1e-3 * axis.stops.stiffness)} N/mm"
    return (
        direction_words(axis.direction),
        axis.model or "–",
        f"{axis.parallel} × {axis.series}",
        _tiny(preload),
        _tiny(1e3 * axis.nominal),
        f"{_tiny(1e3 * spring.displacement_min)} to {_tiny(1e3 * spring.displacement_max)}",
        stops,
        _tiny(axis.damping),
    )


def _limits(answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    tested = answers[0].limits.tested([answer.case for answer in answers if answer.candidate == answers[0].candidate])
    limits: dict[tuple[FigureKind, float], dict[str, None]] = {}
    counts: dict[FigureKind, set[str]] = {}
    for answer in answers:
        for figure in answer.figures:
            counts.setdefault(figure.quantity, set()).add(figure.subject)
            if figure.limit is not None:
                limits.setdefault((figure.quantity, figure.limit), {})[figure.subject] = None
    rows = []
    for (quantity, limit), subjects in limits.items():
        of_all = len(subjects) == len(counts[quantity]) and len(subjects) > 1
        at_most = f"{number(quantity.column.factor * limit)} {_shown_unit(quantity)}"
        by = ", ".join(tested.get(quantity, ("all",)))
        rows.append((quantity.value, at_most, "all" if of_all else ", ".join(subjects), by))
    rows += [(kind.value, "–", "–", "not tested") for kind, names in tested.items() if not names]
    yield from _table("Limits", ("quantity", "at most", "of", "tested by"), rows)
    without = [quantity.value for quantity in counts if not any(of == quantity for of, _ in limits)]
    if without:
        yield f"Without a limit, and only reported: {', '.join(without)}."


def _at_rest(candidates: Sequence[CandidateAnswer]) -> Iterator[Block]:
    """Static poses of the bodies, static load and displacement of each axis of the mounts."""
    poses, loads = [], []
    for candidate in candidates:
        if candidate.static is None:
            yield Notice(Level.POOR, f"{candidate.name}: {prose(candidate.refusal)}")
            continue
        static = candidate.static
        for k, body in enumerate(candidate.system.bodies):
            moved = 1e3 * np.array([pose.displacements[k] for pose in static.poses])
            tilt = np.degrees(static.tilt[:, k])
            poses.append((f"{candidate.name}, {body.name}", *(_range(part) for part in moved.T), _range(tilt)))
        force = np.array([pose.force for pose in static.poses])
        displacement = np.array([pose.displacement for pose in static.poses])
        names = candidate.system.axis_names
        for k, axis in enumerate(candidate.system.axes):
            moved = axis.series * (displacement[:, k] - axis.nominal)
            down = axis.series * (displacement[:, k] - axis.spring.displacement_min)
            up = axis.series * (axis.spring.displacement_max - displacement[:, k])
            free = f"{_tiny(1e3 * down.min(), 3)} and {_tiny(1e3 * up.min(), 3)}"
            cells = (_range(force[:, k]), _range(1e3 * moved), _range(100.0 * static.places[:, k]), free)
            loads.append((f"{candidate.name}, {names[k]}", *cells))
    if not poses:
        return
    header: tuple[str, ...] = ("candidate and body", "x [mm]", "y [mm]", "z [mm]", "tilt [°]")
    yield Table("Static pose from the nominal one", header, poses)
    header = (
        "candidate and axis", "static load [N]", "deflection [mm]", "place in the range [%]",
        "free stroke down and up [mm]",
    )  # fmt: skip
    yield from _table("Static load and stroke of each mount", header, loads)
    yield (
        "Friction leaves a range of static equilibria. The static load is the force of the axis; deflection is that of "
        "the mount along the axis from its nominal place, positive as its direction. 0 % is the lower end of a "
        "spring's identified range, 100 % its upper end, and the free stroke of the mount ends there."
    )


def _range(values: np.ndarray) -> str:
    low, high = _tiny(float(values.min()), 3), _tiny(float(values.max()), 3)
    return low if low == high else f"{low} to {high}"


def _tiny(value: float, digits: int = 4) -> str:
    """A number, 0 where it is nothing but rounding."""
    return "0" if abs(value) < _NOTHING else number(value, digits)


def _histories(
    candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer], drawn: dict[int, CaseAnswer]
) -> Iterator[Block]:
    left = sum(1 for answer in answers if answer.figures) - len(drawn)
    if left:
        yield Notice(Level.INFORMATION, f"Histories are left out of {left} of {len(answers)} answers.",
                     "Simulate fewer cases or candidates to see them.")  # fmt: skip
    judged, paths = system_charts.histories(drawn), system_charts.sway_paths(drawn)
    yield Gallery([*judged, system_charts.strokes(drawn), system_charts.loops(drawn), *paths])
    rows = []
    for candidate in candidates:
        answered = [answer for answer in answers if answer.candidate == candidate.name and answer.runs]
        for k, point in enumerate(candidate.system.points):
            sways = [run.figures.sway_components[k] for answer in answered for run in answer.runs]
            if sways:
                largest = [max(float(sway[axis]) for sway in sways) for axis in range(3)]
                rows.append((f"{candidate.name}, {point.name}", *(_tiny(1e3 * component) for component in largest)))
    header = ("candidate and point", "± x [mm]", "± y [mm]", "± z [mm]")
    yield from _table("Sway envelope from rest over all load cases", header, rows)


def _settled(answers: Sequence[CaseAnswer]) -> Iterator[Block]:
    """Root mean squares of vibration."""
    rows = []
    for answer in answers:
        power = answer.courses.power if answer.courses is not None else ()
        for k, (name, values) in enumerate(answer.settled):
            error = max((spectrum.root_mean_square_error for spectrum in power[k]), default=0.0) if power else math.nan
            cells = (*map(_tiny, values), percent(error) if math.isfinite(error) else "–")
            rows.append((f"{answer.where}, {name}", *cells))
    header = (
        "candidate, case and point", "x [g]", "y [g]", "z [g]", "x [mm]", "y [mm]", "z [mm]", "statistical error",
    )  # fmt: skip
    yield from _table("Root mean squares of acceleration, and of sway about its mean", header, rows)


def _secant_modes(candidates: Sequence[CandidateAnswer]) -> Iterator[Block]:
    """Modes of small motion, and of motion by half of the free stroke."""
    share = percent(SECANT_SHARE)
    header = ("mode", "tangent [Hz]", "motion", f"secant at {share} [Hz]", "damping [%]")
    for candidate in candidates:
        rows = []
        tangent, secants = ((), ()) if candidate.static is None else (candidate.static.tangent, candidate.static.secant)
        for k, mode in enumerate(tangent[:_MOST_MODES]):
            of_loops = (number(secants[k].frequency), number(100.0 * secants[k].damping, 2)) if secants else ("–", "–")
            rows.append((str(k + 1), number(mode.frequency), mode.words, *of_loops))
        yield from _table(f"Natural modes of {candidate.name}", header, rows)
    yield (
        "Tangent: of vanishing motion about the static pose. Secant: with the stiffness and the losses "
        f"of steady loops in which each spring moves by {share} of its way to the nearer end of its identified range."
    )


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
    yield from _table("Numerical errors and energy balance", header, rows)
    if rows:
        yield (
            "The error is a bound: the change from the run with twice the step. The residual of the energy balance is "
            "over the energy exchanged."
        )


def write_system_isolation(
    path: str | Path, name: str, system: MountedSystem, modes: Mapping[str, Sequence[Mode]], curves: Sequence[Curve]
) -> None:
    """Write the report of the steady vibration of a system.

    Parameters
    ----------
    path : str or Path            Ending in .html.
    name : str                    Of the system.
    system : MountedSystem        The first candidate.
    modes : mapping               Of small motion of each candidate.
    curves : sequence of (candidate, SystemResponse)

    Raises
    ------
    StrandspringError             If the ending does not suit, or the file cannot be written.
    """
    check_report_path(path)
    names = [f"{candidate}, {response.shaking.name}, {response.level_text}" for candidate, response in curves]
    drawings, text = system_charts.system_drawing(system, ())
    sections = (
        Section("resonances", "Resonances", [*_resonances(names, curves)]),
        Section("curves", "Curves", [Gallery(system_charts.gains([response for _, response in curves]))]),
        Section("system", "System", [Gallery(drawings), text]),
        Section("modes", "Natural modes", [*_viscous_modes(modes)]),
    )
    write_page(path, Page(f"Steady vibration: {name}", "", sections, dict(enumerate(names)), noun="Curve", first=0))


def _resonances(names: Sequence[str], curves: Sequence[Curve]) -> Iterator[Block]:
    rows, cautions = [], []
    for name, (_, response) in zip(names, curves, strict=True):
        column = response.gain_column
        worst = max((error.largest for error in response.errors), default=None)
        for peak in response.resonances:
            gain = f"{number(column.factor * peak.gain)} {column.shown}".rstrip()
            isolates = number(peak.isolation_frequency) if math.isfinite(peak.isolation_frequency) else "–"
            cells = (number(peak.frequency), gain, number(1e3 * peak.sway), isolates)
            rows.append((name, f"{peak.point} {peak.direction}", *cells, "–" if worst is None else percent(worst)))
        cautions += [Notice(Level.CARE, f"{name}: {words}") for words in gathered(response.findings, Reader.FILE)]
    header = (
        "candidate, excitation and level", "motion of", "resonance [Hz]", "gain", "sway [mm]", "isolation from [Hz]",
        "error",
    )  # fmt: skip
    yield from _table("Largest gain of each point in each direction", header, rows)
    yield (
        "Gain is the first harmonic of a point's absolute motion over that of the base, or its motion over a force. "
        "The error is the largest difference of acceleration, sway and tilt from time integration of the exact "
        "equations, at the motions with the largest acceleration and tilt; where no body turns by half a degree there "
        "is none."
    )
    yield from cautions


def _viscous_modes(modes: Mapping[str, Sequence[Mode]]) -> Iterator[Block]:
    for candidate, of_candidate in modes.items():
        rows = [
            (str(k), number(mode.frequency), number(100.0 * mode.damping, 3), mode.words)
            for k, mode in enumerate(of_candidate, start=1)
        ]
        yield from _table(f"Natural modes of {candidate}", ("mode", "Hz", "viscous damping [%]", "motion"), rows)
