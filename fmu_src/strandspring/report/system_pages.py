"""Reports of systems on mounts under load cases and of steady vibration, and their charts: verdicts beside limits,
histories and spectra, drawings to scale.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import Reader
from ..findings import Finding, gathered, words
from ..ground.gravity import STANDARD_GRAVITY
from ..ground.result_columns import ResultColumn
from ..kernel.arrays import FloatArray
from ..vibration.bodies.loads import ChannelKind, LoadCase
from ..vibration.bodies.mounted import MountedSystem
from ..vibration.bodies.parts import BASE, MotionKind, RigidBody
from ..vibration.bodies.six_response import SystemResponse
from ..vibration.description.system_file import SystemFile
from ..vibration.verdicts.answers import CandidateAnswer, CaseAnswer, findings_of, overall_verdicts, untested
from ..vibration.verdicts.courses import Courses
from ..vibration.verdicts.verdicts import CaseVerdict, FigureKind
from .drawing import (
    ACCELERATION,
    COLOURS,
    DISPLACEMENT,
    FORCE,
    FREQUENCY,
    NUMBER,
    PERCENT,
    TIME,
    Chart,
    Curve,
    Steady,
    in_unit,
    percent,
    steady_curves,
)
from .page import Level, Notice, Page, Parts, Section, Source, Table, Tile, write_page

_SWAY = replace(DISPLACEMENT, words="sway")
_DENSITY = ResultColumn("density", "", "density", shown="g²/Hz", factor=STANDARD_GRAVITY**-2)
_WAYS = {letter: replace(DISPLACEMENT, words=letter) for letter in "xyz"}
_MOST_TILES, _MOST_HISTORIES = 8, 40
_MOST_ANSWERS = 40  # beside their limits
_MOST_LINES = 5  # points or axes of an answer, those that move most
_NO_DENSITY = 1e-7  # of the largest
_NO_SIZE = 0.05  # least half size of a system [m]
_AXIS, _ARROW, _APART = 0.18, 0.3, 1.12  # lengths, and where arrows end, of the half size
_IN_PLANE = 0.3  # least share of a direction that a view shows
_VIEWS = {"top": [0, 1], "front": [0, 2], "side": [1, 2]}  # coordinates to the right and up
# Corners of a cuboid that an edge joins differ in one sign.
_EDGES = [[*pair] for pair in itertools.combinations(range(8), 2) if (pair[0] ^ pair[1]).bit_count() == 1]
_LEVELS = {
    **dict.fromkeys(CaseVerdict, Level.POOR),
    CaseVerdict.NO_LIMITS: Level.INFORMATION,
    CaseVerdict.PASSES: Level.GOOD,
    CaseVerdict.NOT_TESTED: Level.CARE,
    CaseVerdict.UNDECIDED: Level.CARE,
}
# Of the best candidates.
_HEADS = {
    CaseVerdict.PASSES: "Within all limits in all load cases: {}.",
    CaseVerdict.NOT_TESTED: "Not tested against all limits: {}. Those that load cases test are kept.",
    CaseVerdict.NO_LIMITS: "No limits: {}. Springs stay within their identified ranges.",
    CaseVerdict.UNDECIDED: "Not decided: {}. In some load cases a range reaches beyond a limit.",
}
_LOADS = (
    ResultColumn("axis", "", "", "candidate and axis"),
    ResultColumn("force", "N", "", "static load", "N", 1.0, 3),
    ResultColumn("moved", "m", "", "deflection", "mm", 1e3, 3),
    ResultColumn("place", "1", "", "place in the range", "%", 100.0, 3),
    ResultColumn("down", "m", "", "free stroke down", "mm", 1e3, 3),
    ResultColumn("up", "m", "", "free stroke up", "mm", 1e3, 3),
)
_RANGES = "Sway is relative to the base, stroke the largest share of a spring's way from rest to the end of its range."
_DRAWN = (
    "Outlines are cuboids with a body's mass and inertia, not its housing; loads point as base or force accelerate."
)


def write_simulation(
    path: str | Path, file: SystemFile, candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer],
    parts: Parts,
) -> None:  # fmt: skip
    """Write the report with the parts of a result; raises StrandspringError if its ending is wrong or it cannot be."""
    kept = [place for place, answer in enumerate(answers) if answer.courses is not None]
    kept.sort(key=lambda place: -answers[place].severity)
    drawn = {place: answers[place] for place in sorted(kept[:_MOST_HISTORIES])}
    names = {place: f"{answer.where}: {answer.verdict.value}" for place, answer in drawn.items()}
    histories: list[Any] = [_strokes(drawn)] if drawn else []
    for chart, curves in _CASE_CHARTS.items():
        of_all = [
            replace(curve, record=place)
            for place, answer in drawn.items() if answer.courses is not None
            for curve in curves(answer, answer.courses)
        ]  # fmt: skip
        if of_all:
            histories.append(replace(chart, curves=of_all))
    if left := sum(1 for answer in answers if answer.figures) - len(drawn):
        histories.append(f"{left} more have none here; simulate fewer cases or candidates to see them.")
    cases = list({answer.case.name: answer.case for answer in answers}.values())
    loads = Table("Static load and stroke of each mount", _LOADS, list(_loads(candidates)))
    sections = [
        Section("Verdict", [*_verdict(answers)]),
        Section("Cautions", _cautions(findings_of(candidates, answers))),
        Section("Figures", [*parts, loads, _RANGES]),
        Section("System", [*_drawings(candidates[0].system, cases), _DRAWN]),
        Section("Description as it was read", [Source(file.text)] if file.text else [], True),
        Section("Histories and spectra", histories),
    ]
    levels = {verdict.value: level for verdict, level in _LEVELS.items()}
    first = next(iter(kept), None)
    page = Page(f"Simulation: {file.name}", file.description, sections, names, "Case", first, levels=levels)
    write_page(path, page)


def write_system_isolation(
    path: str | Path, name: str, system: MountedSystem, curves: Sequence[tuple[str, SystemResponse]], parts: Parts,
    findings: Sequence[Finding],
) -> None:  # fmt: skip
    """Write the report of the steady vibration of candidates, the first of which is `system`, likewise."""
    names = [f"{candidate}, {response.shaking.name}, {response.level_text}" for candidate, response in curves]
    sections = (
        Section("Curves", [*_gains([response for _, response in curves])]),
        Section("Cautions", _cautions(findings)),
        Section("Figures", [*parts]),
        Section("System", [*_drawings(system, ()), _DRAWN]),
    )
    write_page(path, Page(f"Steady vibration: {name}", "", sections, dict(enumerate(names)), "Curve", 0))


def _cautions(findings: Sequence[Finding]) -> list[Notice]:
    return [Notice(Level.CARE, sentence) for sentence in gathered(findings, Reader.FILE)]


def _verdict(answers: Sequence[CaseAnswer]) -> Iterator[Any]:
    overall = overall_verdicts(answers)
    best = next((verdict for verdict in _HEADS if verdict in overall.values()), CaseVerdict.FAILS)
    names = ", ".join(name for name, verdict in overall.items() if verdict is best)
    head = _HEADS.get(best, "No candidate is within all limits in all load cases.")
    yield Notice(_LEVELS[best], head.format(names))
    for kind in untested(answers):
        yield Notice(Level.CARE, words(kind.untested, Reader.FILE))
    for name in [*overall][:_MOST_TILES]:
        own = [answer for answer in answers if answer.candidate == name]
        passed = sum(answer.verdict is CaseVerdict.PASSES for answer in own)
        worst, note = max(own, key=lambda answer: answer.severity), "no figures"
        if (figure := worst.nearest_limit) is not None:
            note = f"nearest limit: {_deciding(worst)}, {figure.subject} in {worst.case.name}"
        yield Tile(name, f"{passed} of {len(own)}", "cases pass", note)
    yield from _shares_of_limits(answers)


def _loads(candidates: Sequence[CandidateAnswer]) -> Iterator[dict[str, Any]]:
    """Static load and stroke of each axis of the mounts."""
    for candidate in candidates:
        if (static := candidate.static) is None:
            continue
        force = np.array([pose.force for pose in static.poses])
        displacement = np.array([pose.displacement for pose in static.poses])
        for k, (name, axis) in enumerate(zip(candidate.system.axis_names, candidate.system.axes, strict=True)):
            moved = axis.series * (displacement[:, k] - axis.nominal)
            ranges = {"force": force[:, k], "moved": moved, "place": static.places[:, k]}
            row = {key: (float(values.min()), float(values.max())) for key, values in ranges.items()}
            down = axis.series * (displacement[:, k].min() - axis.spring.displacement_min)
            up = axis.series * (axis.spring.displacement_max - displacement[:, k].max())
            yield {"axis": f"{candidate.name}, {name}", **row, "down": down, "up": up}


def _shares_of_limits(answers: Sequence[CaseAnswer]) -> Iterator[Chart]:
    """Ranges of all kinds of figures as shares of their limits; none without a limit."""
    limited = sorted((answer for answer in answers if answer.nearest_limit), key=lambda answer: -answer.severity)
    shown = [answer for answer in answers if answer in limited[:_MOST_ANSWERS]]
    curves = []
    for kind, colour, offset in zip(FigureKind, itertools.cycle(COLOURS), np.linspace(-0.3, 0.3, len(FigureKind))):
        figures = [(place + offset, figure.low / figure.limit, figure.share) for place, answer in enumerate(shown, 1)
                   if (figure := answer.worst(kind)) and figure.limit and math.isfinite(figure.high)]  # fmt: skip
        if figures:
            x, low, high = np.array(figures).T
            curves.append(Curve(x, 0.5 * (low + high), kind.value, colour, "", reach=0.5 * (high - low)))
    if curves:
        curves.append(Curve([0.5, len(shown) + 0.5], [1.0, 1.0], "limit", "poor", "--"))
        title, sentence = "Figures beside their limits", "Of each kind the figure nearest to its limit."
        y, places = replace(PERCENT, words="share of the limit"), [answer.where for answer in shown]
        yield Chart("limits", title, sentence, NUMBER, y, curves, zero="y", places=places)


def acceleration_against_stroke(answers: Sequence[CaseAnswer]) -> Chart:
    """A mark for each case with the figure that decides, a cross with the verdict where it does not pass."""
    curves, texts = [], []
    for (candidate, verdict), colour in zip(overall_verdicts(answers).items(), itertools.cycle(COLOURS)):
        of_one = [answer for answer in answers if answer.candidate == candidate]
        worst = min(of_one, key=lambda answer: (-[*CaseVerdict].index(answer.verdict), -answer.severity))
        figure = _deciding(worst)
        name = f"{candidate}: {verdict.value}{figure and f', {figure} of its limit in {worst.case.name}'}"
        for answer in of_one:
            stroke, acceleration = answer.worst(FigureKind.STROKE), answer.worst(FigureKind.ACCELERATION)
            if stroke and acceleration and math.isfinite(stroke.high):
                passes = answer.verdict in (CaseVerdict.NO_LIMITS, CaseVerdict.PASSES)
                curves.append(Curve([stroke.high], [acceleration.high], name, colour, "o" if passes else "X"))
                said = f"{answer.case.name}: {'' if passes else f'{answer.verdict.value}, '}{_deciding(answer)}"
                texts.append((stroke.high, acceleration.high, said, colour))
    strokes, accelerations = (
        sorted({figure.limit for answer in answers for figure in answer.figures_of(kind) if figure.limit})
        for kind in (FigureKind.STROKE, FigureKind.ACCELERATION)
    )
    right = max([*strokes, *(x for x, *_ in texts)], default=1.0)
    top = max([*accelerations, *(y for _, y, *_ in texts)], default=1.0)
    for limit in strokes:
        curves.append(Curve([limit] * 2, [0.0, top], f"limit of stroke, {percent(limit, 4)}", "poor", "--"))
    for limit in accelerations:
        name = f"limit of a point, {in_unit(limit, ACCELERATION)}"
        curves.append(Curve([0.0, right], [limit] * 2, name, "poor", ":"))
    x = replace(PERCENT, words="stroke")
    return Chart("sheet", "", "", x, ACCELERATION, curves, zero="xy", texts=texts)


def _deciding(answer: CaseAnswer) -> str:
    """The figure nearest to its limit, and its share of that; empty without one."""
    nearest = answer.nearest_limit
    return "" if nearest is None else f"{nearest.quantity.value} {percent(nearest.share, 3)}"


def _strokes(answers: Mapping[int, CaseAnswer]) -> Chart:
    """Where springs rest and move within their identified ranges, of one answer at a time."""
    places = [*dict.fromkeys(name for answer in answers.values() for name in answer.system.axis_names)]
    curves = []
    for k, answer in answers.items():
        x = np.array([1.0 + places.index(name) for name in answer.system.axis_names])
        low, high, rest = answer.uses[0].low, answer.uses[0].high, answer.uses[0].rest
        lowest = np.min([use.lowest for use in answer.uses], axis=0)
        highest = np.max([use.highest for use in answer.uses], axis=0)
        limit = next((figure.limit for figure in answer.figures_of(FigureKind.STROKE) if figure.limit), 1.0)
        name = f"limit, {percent(limit, 4)} of the way from rest"
        curves += [
            Curve(x, 0.5 * (low + high), "identified range", "faint", "", k, 0.5 * (high - low), 14.0),
            Curve(x, 0.5 * (lowest + highest), "reached", "blue", "", k, 0.5 * (highest - lowest), 7.0),
            Curve(x, rest, "at rest", "measured", "o", k),
            *(Curve(x, rest + limit * (end - rest), name, "poor", "_", k) for end in (low, high)),
        ]
    title = "Stroke beside its limit"
    return Chart("strokes", title, "Of all runs.", NUMBER, DISPLACEMENT, curves, is_apart=True, places=places)


def _history(answer: CaseAnswer, courses: Courses, kind: FigureKind) -> Iterator[Curve]:
    """Magnitude of acceleration or sway of the points over time with their limits."""
    time, sway = courses.histories.time, courses.histories.sway
    of_points = courses.histories.acceleration if kind is FigureKind.ACCELERATION else sway - sway[0]
    if kind is FigureKind.ACCELERATION and courses.base.any():
        yield Curve(time, np.linalg.norm(courses.base, axis=1), "base", "muted")
    for k, name, colour in _points(answer):
        length = np.linalg.norm(of_points[:, k], axis=1)
        yield Curve(time, length, name, colour)
        for figure in (figure for figure in answer.figures_of(kind) if figure.subject == name):
            peak, half = time[int(np.argmax(length))], 0.5 * (figure.high - figure.low)
            yield Curve([peak], [figure.low + half], "range of the peak", colour, "", reach=[half])
            if figure.limit is not None:
                level = f"limit {in_unit(figure.limit, kind.column)}"
                yield Curve(time[[0, -1]], [figure.limit] * 2, level, "poor", "--")


def _loops(answer: CaseAnswer, courses: Courses) -> Iterator[Curve]:
    """Force of axes of mounts over displacement of their springs, with identified ranges."""
    displacement, force = courses.histories.displacement, courses.histories.force
    use = max(answer.uses, key=lambda use: float(use.share.max()))
    worst = np.argsort(-np.nan_to_num(use.share, posinf=1e9), kind="stable")[:_MOST_LINES]
    for axis, colour in zip(worst.tolist(), COLOURS, strict=False):
        yield Curve(displacement[:, axis], force[:, axis], answer.system.axis_names[axis], colour)
    heights = [force[:, worst].min(), force[:, worst].max()]
    for end in (use.low[worst].min(), use.high[worst].max()):
        yield Curve([end, end], heights, "ends of the identified range", "muted", ":")


def _spectra(answer: CaseAnswer, courses: Courses, kind: str) -> Iterator[Curve]:
    """Of x, y and z the largest of shock, with limits, or the sum of power."""
    base, of_points = getattr(courses, f"base_{kind}"), getattr(courses, kind)
    named = [(base, "base", "muted", "--")] if base else []
    named += [(of_points[k], name, colour, "-") for k, name, colour in _points(answer)] if of_points else []
    for along, name, colour, style in named:
        if kind == "shock":
            y = np.max([spectrum.maximax for spectrum in along], axis=0)
        else:
            y = np.sum([spectrum.density for spectrum in along], axis=0)
            y[y <= _NO_DENSITY * y.max()] = np.nan
            y[0] = np.nan
        yield Curve(along[0].frequency, y, name, colour, style)
    for name, required in courses.allowed.items() if kind == "shock" and of_points else ():
        yield Curve(required.frequencies, required.at(required.frequencies), f"limit of {name}", "poor", "--")


def _points(answer: CaseAnswer) -> Iterator[tuple[int, str, str]]:
    """The points with the largest acceleration, each with a colour."""
    largest = np.max([run.figures.acceleration for run in answer.runs], axis=0)
    for point, colour in zip(sorted(np.argsort(-largest, kind="stable")[:_MOST_LINES].tolist()), COLOURS, strict=False):
        yield point, answer.system.points[point].name, colour


_MAGNITUDE = "Magnitude in one run; the bar at each peak is the range of all runs, which is judged."
_OF_LOOPS = f"The {_MOST_LINES} axes that use most of their ranges, in one run."
_MAXIMAX = "The largest along x, y and z; damping is that of the allowed spectra, else 5 % of critical (Q = 10)."
_CASE_CHARTS: dict[Chart, Callable[[CaseAnswer, Courses], Iterator[Curve]]] = {
    Chart("history-acceleration", "Acceleration beside its limit", _MAGNITUDE, TIME, ACCELERATION, (), is_apart=True,
          zero="y"): partial(_history, kind=FigureKind.ACCELERATION),
    Chart("history-sway", "Sway beside its limit", _MAGNITUDE, TIME, _SWAY, (), is_apart=True,
          zero="y"): partial(_history, kind=FigureKind.SWAY),
    Chart("loops", "Loops of the mounts", _OF_LOOPS, replace(DISPLACEMENT, words="displacement of a spring"),
          replace(FORCE, words="force of the axis"), (), is_apart=True): _loops,
    Chart("shock-spectra", "Shock response spectra", _MAXIMAX, replace(FREQUENCY, words="natural frequency"),
          replace(ACCELERATION, words="maximax acceleration"), (), is_apart=True,
          log="xy"): partial(_spectra, kind="shock"),
    Chart("power-spectra", "Power spectral density", "Of acceleration, the sum of x, y and z.",
          FREQUENCY, _DENSITY, (), is_apart=True, log="xy"): partial(_spectra, kind="power"),
}  # fmt: skip


def _gains(responses: Sequence[SystemResponse]) -> tuple[Chart, Chart]:
    """Gain and sway of the points over frequency, of one curve at a time."""
    drawn: dict[str, list[Curve]] = {"gain": [], "sway": []}
    for place, one in enumerate(responses):
        motion = np.abs(one.gain)
        most = np.take_along_axis(motion, motion.max(axis=0).argmax(axis=1)[None, :, None], axis=2)[:, :, 0]
        for name, values in (("gain", most), ("sway", one.sway)):
            columns = zip(values.T, one.points, strict=True)
            motions = [Steady(one.frequency, along, one.stable, point.name) for along, point in columns]
            drawn[name] += steady_curves(motions, place)
    y = replace(responses[0].gain_column, words="gain")
    of_gain = "First harmonic of each point's motion in the direction in which it moves most."
    of_sway = "Largest distance of a point from rest, relative to the base."
    return (
        Chart("gain", "Motion over excitation", of_gain, FREQUENCY, y, drawn["gain"], log="xy"),
        Chart("sway", "Sway", of_sway, FREQUENCY, _SWAY, drawn["sway"], log="x"),
    )


def _drawings(system: MountedSystem, cases: Sequence[LoadCase]) -> Iterator[Chart]:
    """The system to scale from three sides, with the directions of the load cases."""
    boxes = [_box(body) for body in system.bodies if body.motion is MotionKind.SIX]
    bodies = {body.name: body.center for body in system.bodies}
    marks = (
        ("centre of gravity", "measured", bodies),
        ("point", "blue", {point.name: point.place for point in system.points if point.name not in bodies}),
        ("mount on the base", "green", {one.name: one.place for one in system.mounts if one.support == BASE}),
        ("mount on a body", "purple", {one.name: one.place for one in system.mounts if one.support != BASE}),
    )
    everything = np.concatenate([*boxes, *(np.array([*places.values()]) for *_, places in marks if places)])
    low, high = everything.min(axis=0), everything.max(axis=0)
    size, middle = float(0.5 * (high - low).max()) or _NO_SIZE, 0.5 * (low + high)
    lines = [(box[pair, :], "body", "muted", "-") for box in boxes for pair in _EDGES]
    styles: dict[str, str] = {}
    for mount in system.mounts:
        for axis, label in zip(mount.axes, mount.axis_labels, strict=True):
            name = f"axis: {label}" if axis.name else "axis"
            style = styles.setdefault(name, ("-", "--", ":")[len(styles) % 3])
            lines.append((np.add(mount.place, np.outer([0.0, _AXIS * size], axis.direction)), name, "green", style))
    # Names of the cases by the directions of accelerations of the base, forces and impacts.
    loads: dict[tuple[float, ...], dict[str, None]] = {}
    for case in cases:
        vectors = [one.direction for one in case.channels if one.kind is not ChannelKind.BASE_ANGULAR_VELOCITY]
        if any(case.velocity):
            vectors.append(tuple((-np.array(case.velocity) / math.hypot(*case.velocity)).tolist()))
        for vector in vectors:
            loads.setdefault(tuple(round(part, 6) + 0.0 for part in vector), {})[case.name] = None
    arrows = [(np.array(way), middle, "direction of a load", "care", ", ".join(names)) for way, names in loads.items()]
    weight = math.hypot(*system.gravity) or 1.0
    down, corner = np.array(system.gravity) / weight, high + 0.1 * size
    strength = f"gravity, {weight / STANDARD_GRAVITY:.3g} g"
    arrows.append((down, corner + (_APART + _ARROW) * size * down, strength, "purple", ""))
    for view, plane in _VIEWS.items():
        a, b = plane
        curves = [Curve(line[:, a], line[:, b], name, colour, style) for line, name, colour, style in lines]
        texts: dict[tuple[float, ...], tuple[str, str]] = {}
        for kind, colour, places in marks:
            if places:
                at = np.array([*places.values()])[:, plane]
                curves.append(Curve(at[:, 0], at[:, 1], kind, colour, "o"))
                for text, place in zip(places, at.tolist(), strict=True):
                    texts.setdefault(tuple(place), (text, colour))
        for direction, about, kind, colour, text in arrows:
            if (length := math.hypot(*direction[plane].tolist())) >= _IN_PLANE:
                way = size / length * direction[plane]
                tail, tip = (about[plane] - share * way for share in (_APART + _ARROW, _APART))
                back, side = 0.3 * (tail - tip), 0.12 * (tail - tip)[::-1] * (-1.0, 1.0)
                head = np.array([tail, tip, tip + back + side, tip, tip + back - side])
                curves.append(Curve(head[:, 0], head[:, 1], kind, colour))
                if text:
                    texts[tuple(tail.tolist())] = (text, colour)
        x, y = (_WAYS["xyz"[axis]] for axis in plane)
        title, sentence = f"{view.capitalize()} view", f"To scale, {x.words} to the right and {y.words} up."
        shown = [(place[0], place[1], *text) for place, text in texts.items()]
        yield Chart(f"system-{view}", title, sentence, x, y, curves, "square", texts=shown)


def _box(body: RigidBody) -> FloatArray:
    """Corners of the cuboid with the mass and inertia of a body, shape (8, 3) [m]."""
    moments, axes = np.linalg.eigh(np.array(body.inertia))
    # A moment is m/12 times the sum of the squares of the other two edges.
    edges = np.sqrt(np.maximum(6.0 / body.mass * (moments.sum() - 2.0 * moments), 0.0))
    signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    return np.asarray(np.array(body.center) + (signs * edges) @ axes.T)
