"""Charts of systems on mounts: verdicts beside their limits, histories and spectra of load cases, drawings to scale.

Charts with histories show one answer at a time, by its place.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..ground.gravity import STANDARD_GRAVITY
from ..ground.result_columns import ResultColumn
from ..kernel.arrays import FloatArray
from ..vibration.bodies.loads import ChannelKind, LoadCase
from ..vibration.bodies.mounted import MountedSystem
from ..vibration.bodies.parts import BASE, MotionKind, RigidBody
from ..vibration.bodies.six_response import SystemResponse
from ..vibration.verdicts.answers import CaseAnswer, overall_verdicts
from ..vibration.verdicts.courses import Courses
from ..vibration.verdicts.verdicts import CaseVerdict, FigureKind
from .drawing import ACCELERATION, DISPLACEMENT, FORCE, FREQUENCY, NUMBER, PERCENT, TIME, Chart, Curve, in_unit, percent

Answers = Mapping[int, CaseAnswer]
STYLES = [(colour, style) for style in ("-", "--") for colour in ("blue", "green", "purple", "care")]
_SWAY = replace(DISPLACEMENT, words="sway")
_DENSITY = ResultColumn("density", "", "density", shown="g²/Hz", factor=STANDARD_GRAVITY**-2)
_MOST_ANSWERS = 40  # beside their limits
_MOST_AXES = 18  # of an answer, those that use most of their ranges
_MOST_LINES = 5  # points or axes of an answer, those that move most
_NO_MOTION, _NO_DENSITY = 1e-9, 1e-7  # of the largest in any direction, and of the largest
_NO_SIZE, _THIN = 0.05, 0.12  # least half size of a system [m], and of a view, of the largest
_AXIS, _ARROW = 0.18, 0.3  # lengths of axes of mounts and of arrows, of the largest half size
_IN_PLANE = 0.3  # least share of a direction that a view shows
_TURNING = ChannelKind.BASE_ANGULAR_VELOCITY
_VIEWS = {"top": [0, 1], "front": [0, 2], "side": [1, 2]}  # coordinates to the right and up


def shares_of_limits(answers: Sequence[CaseAnswer]) -> Chart | None:
    """The ranges of all kinds of figures as shares of their limits; None without a limit."""
    limited = sorted((answer for answer in answers if answer.nearest_limit), key=lambda answer: -answer.severity)
    shown = [answer for answer in answers if answer in limited[:_MOST_ANSWERS]]
    curves = []
    for kind, (colour, _), offset in zip(FigureKind, itertools.cycle(STYLES), np.linspace(-0.3, 0.3, len(FigureKind))):
        figures = [(place + offset, figure.low / figure.limit, figure.share) for place, answer in enumerate(shown, 1)
                   if (figure := answer.worst(kind)) and figure.limit and math.isfinite(figure.high)]  # fmt: skip
        if figures:
            x, low, high = np.array(figures).T
            curves.append(Curve(x, 0.5 * (low + high), kind.value, colour, "", reach=0.5 * (high - low)))
    if not curves:
        return None
    curves.append(Curve([0.5, len(shown) + 0.5], [1.0, 1.0], "limit", "poor", "--"))
    sentence = (
        f"Of each kind of figure the one nearest to its limit, of at most {_MOST_ANSWERS} answers, with the range that "
        "the verdict takes: below the line it passes, above it fails, across it nothing is decided."
    )
    y, places = replace(PERCENT, words="share of the limit"), [answer.where for answer in shown]
    return Chart("limits", "Figures beside their limits", sentence, NUMBER, y, curves, "wide", zero="y",
                 places=places)  # fmt: skip


def acceleration_against_stroke(answers: Sequence[CaseAnswer]) -> Chart:
    """One mark for each case with the figure that decides, and a cross with the verdict where it does not pass; one
    colour for each candidate, which the legend names with the verdict on all cases together.
    """
    curves, texts = [], []
    for (candidate, verdict), (colour, _) in zip(overall_verdicts(answers).items(), itertools.cycle(STYLES)):
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
    right = 1.05 * max([*strokes, *(x for x, *_ in texts)], default=1.0)
    top = 1.05 * max([*accelerations, *(y for _, y, *_ in texts)], default=1.0)
    curves += [
        Curve([limit] * 2, [0.0, top], f"limit of stroke, {percent(limit, 4)}", "poor", "--") for limit in strokes
    ]
    for limit in accelerations:
        name = f"limit of a point, {in_unit(limit, ACCELERATION)}"
        curves.append(Curve([0.0, right], [limit] * 2, name, "poor", ":"))
    sentence = (
        "Each mark is a load case: largest acceleration of the worst point, and largest share of a spring's way from "
        "rest to the end of its identified range."
    )
    x = replace(PERCENT, words="stroke")
    return Chart(
        "sheet", "Acceleration against stroke", sentence, x, ACCELERATION, curves, "wide", zero="xy", texts=texts
    )


def _deciding(answer: CaseAnswer) -> str:
    """The figure that is nearest to its limit, and its share of that; empty without one."""
    nearest = answer.nearest_limit
    return "" if nearest is None else f"{nearest.quantity.value} {percent(nearest.share, 3)}"


def case_charts(answers: Answers) -> Iterator[Chart]:
    """Histories and spectra, of one answer at a time."""
    for chart, curves in _CASE_CHARTS.items():
        drawn = [replace(curve, record=place) for place, answer in answers.items() for curve in curves(answer)]
        if drawn:
            yield replace(chart, curves=drawn)


def strokes(answers: Answers) -> Chart:
    """Where the springs of each axis rest and move within their identified ranges, of one answer at a time."""
    shares: dict[str, float] = {}
    for answer in answers.values():
        largest = np.max([np.nan_to_num(use.share, posinf=math.inf) for use in answer.uses], axis=0)
        for name, share in zip(answer.system.axis_names, largest.tolist(), strict=True):
            shares[name] = max(share, shares.get(name, 0.0))
    most = sorted(shares, key=lambda name: -shares[name])[:_MOST_AXES]
    places = [name for name in shares if name in most]
    drawn = [replace(curve, record=k) for k, answer in answers.items() for curve in _strokes(answer, places)]
    sentence = (
        "From the least to the largest displacement of a spring in any run, as its model counts; of at most "
        f"{_MOST_AXES} axes, those that use most of their ranges."
    )
    return Chart(
        "strokes", "Stroke beside its limit", sentence, NUMBER, DISPLACEMENT, drawn, "wide", True, places=places
    )


def _strokes(answer: CaseAnswer, places: Sequence[str]) -> Iterator[Curve]:
    names, first = answer.system.axis_names, answer.uses[0]
    chosen = [k for k, name in enumerate(names) if name in places]
    x = np.array([1.0 + places.index(names[k]) for k in chosen])
    low, high, rest = first.low[chosen], first.high[chosen], first.rest[chosen]
    lowest = np.min([use.lowest for use in answer.uses], axis=0)[chosen]
    highest = np.max([use.highest for use in answer.uses], axis=0)[chosen]
    gap = np.full(x.size, np.nan)
    for name, colour, begin, end, width in (
        ("identified range", "faint", low, high, 14.0), ("reached", "blue", lowest, highest, 7.0),
    ):  # fmt: skip
        yield Curve(np.repeat(x, 3), np.column_stack([begin, end, gap]).ravel(), name, colour, width=width)
    yield Curve(x, rest, "at rest", "measured", "o")
    limit = next((figure.limit for figure in answer.figures_of(FigureKind.STROKE) if figure.limit), 1.0)
    for end in (low, high):
        across, along = np.column_stack([x - 0.3, x + 0.3, gap]).ravel(), np.repeat(rest + limit * (end - rest), 3)
        yield Curve(across, along, f"limit, {percent(limit, 4)} of the way from rest", "poor")


def _history(answer: CaseAnswer, kind: FigureKind) -> Iterator[Curve]:
    """Magnitude of acceleration or sway of the points over time with their limits."""
    courses = _courses(answer)
    time, sway = courses.histories.time, courses.histories.sway
    of_points = courses.histories.acceleration if kind is FigureKind.ACCELERATION else sway - sway[0]
    if kind is FigureKind.ACCELERATION and courses.base.any():
        yield Curve(time, np.linalg.norm(courses.base, axis=1), "base", "muted")
    for k, name, (colour, style) in _points(answer):
        length = np.linalg.norm(of_points[:, k], axis=1)
        yield Curve(time, length, name, colour, style)
        for figure in (figure for figure in answer.figures_of(kind) if figure.subject == name):
            peak, half = time[int(np.argmax(length))], 0.5 * (figure.high - figure.low)
            yield Curve([peak], [figure.low + half], "range of the peak", colour, "", reach=[half])
            if figure.limit is not None:
                level = f"limit {in_unit(figure.limit, kind.column)}"
                yield Curve(time[[0, -1]], [figure.limit] * 2, level, "poor", "--")


def _loops(answer: CaseAnswer) -> Iterator[Curve]:
    """Force of axes of mounts over the displacement of their springs, with the identified ranges."""
    displacement, force = _courses(answer).histories.displacement, _courses(answer).histories.force
    use = max(answer.uses, key=lambda use: float(use.share.max()))
    worst = np.argsort(-np.nan_to_num(use.share, posinf=1e9), kind="stable")[:_MOST_LINES]
    for k, axis in enumerate(worst.tolist()):
        yield Curve(displacement[:, axis], force[:, axis], answer.system.axis_names[axis], *STYLES[k])
    heights = [force[:, worst].min(), force[:, worst].max()]
    for end in (use.low[worst].min(), use.high[worst].max()):
        yield Curve([end, end], heights, "ends of the identified range", "muted", ":")


def _paths(answer: CaseAnswer, across: int, up: int) -> Iterator[Curve]:
    """Paths of the points that move in two coordinates."""
    sway = _courses(answer).histories.sway - _courses(answer).histories.sway[0]
    moving = np.abs(sway).max(axis=0) > _NO_MOTION * np.abs(sway).max()
    for k, name, style in _points(answer):
        if moving[k, across] and moving[k, up]:
            yield Curve(sway[:, k, across], sway[:, k, up], name, *style)


def _shock_spectra(answer: CaseAnswer) -> Iterator[Curve]:
    courses = _courses(answer)
    if not courses.shock:
        return
    named = [("base", courses.base_shock, ("muted", "--"))] if courses.base_shock else []
    named += [(name, courses.shock[k], style) for k, name, style in _points(answer)]
    for name, along, style in named:
        yield Curve(along[0].frequency, np.max([spectrum.maximax for spectrum in along], axis=0), name, *style)
    for name, required in courses.allowed.items():
        yield Curve(required.frequencies, required.at(required.frequencies), f"limit of {name}", "poor", "--")


def _power_spectra(answer: CaseAnswer) -> Iterator[Curve]:
    """Sums over x, y and z, interrupted where there is next to none."""
    courses = _courses(answer)
    named = [("base", courses.base_power, ("muted", "--"))] if courses.base_power else []
    named += [(name, courses.power[k], style) for k, name, style in _points(answer) if courses.power]
    for name, along, style in named:
        density = np.sum([spectrum.density for spectrum in along], axis=0)
        density[density <= _NO_DENSITY * density.max()] = np.nan
        known = slice(1, int(np.flatnonzero(np.isfinite(density))[-1]) + 1) if np.isfinite(density).any() else slice(0)
        yield Curve(along[0].frequency[known], density[known], name, *style)


def _courses(answer: CaseAnswer) -> Courses:
    if answer.courses is None:
        raise ValueError("The answer has no histories.")
    return answer.courses


def _points(answer: CaseAnswer) -> Iterator[tuple[int, str, tuple[str, str]]]:
    """The points with the largest acceleration, each with a colour of its own."""
    largest = np.max([run.figures.acceleration for run in answer.runs], axis=0)
    for k, point in enumerate(sorted(np.argsort(-largest, kind="stable")[:_MOST_LINES].tolist())):
        yield point, answer.system.points[point].name, STYLES[k]


_MAGNITUDE = (
    "Magnitude of the vector, of which the verdict is. The lines are of one run; the bar at each peak is the range "
    "that the verdict takes from all runs."
)
_LOOPS = f"The {_MOST_LINES} axes that use most of their ranges, in one run; stops and dampers included."
_MAXIMAX = (
    "Largest absolute acceleration of an oscillator at the point or on the base, during the load or after it; the "
    "largest along x, y and z. Its damping is that of the allowed spectra, else 5 % of critical (Q = 10)."
)
_WAYS = {letter: replace(DISPLACEMENT, words=letter) for letter in "xyz"}
_CASE_CHARTS: dict[Chart, Callable[[CaseAnswer], Iterator[Curve]]] = {
    Chart("history-acceleration", "Acceleration beside its limit", _MAGNITUDE, TIME, ACCELERATION, (), "wide", True,
          zero="y"): partial(_history, kind=FigureKind.ACCELERATION),
    Chart("history-sway", "Sway beside its limit", _MAGNITUDE, TIME, _SWAY, (), "wide", True,
          zero="y"): partial(_history, kind=FigureKind.SWAY),
    Chart("loops", "Loops of the mounts", _LOOPS, replace(DISPLACEMENT, words="displacement of a spring"),
          replace(FORCE, words="force of the axis"), (), "wide", True): _loops,
    **{
        Chart(f"sway-{a}{b}", f"Sway in {a} and {b}", "Paths of the points relative to the base, from rest.", _WAYS[a],
              _WAYS[b], (), is_apart=True): partial(_paths, across="xyz".index(a), up="xyz".index(b))
        for a, b in ("xy", "xz", "yz")
    },
    Chart("shock-spectra", "Shock response spectra", _MAXIMAX, replace(FREQUENCY, words="natural frequency"),
          replace(ACCELERATION, words="maximax acceleration"), (), "wide", True, log="xy"): _shock_spectra,
    Chart("power-spectra", "Power spectral density", "Of acceleration, the sum of x, y and z, by Welch's method.",
          FREQUENCY, _DENSITY, (), "wide", True, log="xy"): _power_spectra,
}  # fmt: skip


def gains(responses: Sequence[SystemResponse]) -> tuple[Chart, Chart]:
    """Gain of the points over frequency of each curve, in the direction in which they move most, and their sway."""
    gain, sway = [], []
    for place, response in enumerate(responses):
        motion = np.abs(response.gain)
        for p, point in enumerate(response.points[: len(STYLES)]):
            most = motion[:, p, int(np.argmax(motion[:, p].max(axis=0)))]
            gain.append(Curve(response.frequency, most, point.name, *STYLES[p], record=place))
            sway.append(Curve(response.frequency, response.sway[:, p], point.name, *STYLES[p], record=place))
    y = replace(responses[0].gain_column, words="gain")
    of_gain = "Of each point the direction in which it moves most."
    of_sway = "Largest distance of a point from its place at rest, relative to the base."
    return (
        Chart("gain", "Motion over excitation", of_gain, FREQUENCY, y, gain, "wide", log="xy"),
        Chart("sway", "Sway", of_sway, FREQUENCY, _SWAY, sway, "wide", log="x"),
    )


DRAWN = (
    "The nominal pose. Outlines are uniform cuboids of the mass and inertia of each body, not its housing; bodies that "
    "move in a plane or along an axis have none. Each axis of a mount is drawn from its place to where a motion of the "
    "body is positive; loads point along the acceleration of the base or the force. Turning of the base is not drawn."
)


def system_drawing(system: MountedSystem, cases: Sequence[LoadCase]) -> Iterator[Chart]:
    """The system to scale from three sides, and along which directions the load cases act."""
    boxes = [_box(body) for body in system.bodies if body.motion is MotionKind.SIX]
    places = [body.center for body in system.bodies] + [mount.place for mount in system.mounts]
    places += [point.place for point in system.points]
    everything = np.concatenate([*boxes, np.array(places)])
    low, high = everything.min(axis=0), everything.max(axis=0)
    size = float(0.5 * (high - low).max()) or _NO_SIZE
    half, middle = np.maximum(0.5 * (high - low), _THIN * size), 0.5 * (low + high)
    for name, plane in _VIEWS.items():
        x, y = (_WAYS["xyz"[axis]] for axis in plane)
        title, sentence = f"{name.capitalize()} view", f"To scale, {x.words} to the right and {y.words} up."
        curves, texts = _view(system, boxes, cases, plane, middle, half, size)
        yield Chart(f"system-{name}", title, sentence, x, y, curves, "square", texts=texts)


def _box(body: RigidBody) -> FloatArray:
    """Corners of the uniform cuboid with the mass and inertia of a body, shape (8, 3) [m]."""
    moments, axes = np.linalg.eigh(np.array(body.inertia))
    # A moment is m/12 times the sum of the squares of the other two edges.
    edges = np.sqrt(np.maximum(6.0 / body.mass * (moments.sum() - 2.0 * moments), 0.0))
    signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    return np.asarray(np.array(body.center) + (signs * edges) @ axes.T)


def _view(
    system: MountedSystem, boxes: Sequence[FloatArray], cases: Sequence[LoadCase], plane: list[int],
    center: FloatArray, sizes: FloatArray, size: float,
) -> tuple[list[Curve], list[tuple[float, float, str, str]]]:  # fmt: skip
    """One side of a system, which shows two coordinates, and its texts."""
    curves: list[Curve] = []
    texts: dict[tuple[float, float], tuple[str, str]] = {}
    for box in boxes:
        # Corners that differ in one sign are joined by an edge.
        edges = [pair for pair in itertools.combinations(range(8), 2) if (pair[0] ^ pair[1]).bit_count() == 1]
        curves += [_path(box[list(edge)][:, plane], "body", "muted") for edge in edges]
    named = [(mount, axis, f"axis: {label}" if axis.name else "axis") for mount in system.mounts
             for axis, label in zip(mount.axes, mount.axis_labels, strict=True)]  # fmt: skip
    labels = list(dict.fromkeys(label for _, _, label in named))
    for mount, axis, label in named:
        way = np.array(mount.place) + np.array([[0.0], [_AXIS * size]]) * np.array(axis.direction)
        curves.append(_path(way[:, plane], label, "green", ("-", "--", ":")[labels.index(label) % 3]))
    bodies = {body.name: body.center for body in system.bodies}
    on_base = {mount.name: mount.place for mount in system.mounts if mount.support == BASE}
    for name, colour, places in (
        ("centre of gravity", "measured", bodies),
        ("point", "blue", {point.name: point.place for point in system.points if point.name not in bodies}),
        ("mount on the base", "green", on_base),
        ("mount on a body", "purple", {one.name: one.place for one in system.mounts if one.name not in on_base}),
    ):  # fmt: skip
        if places:
            x, y = np.array(list(places.values()))[:, plane].T
            curves.append(Curve(x, y, name, colour, "o"))
            for text, *place in zip(places, x.tolist(), y.tolist(), strict=True):
                texts.setdefault((place[0], place[1]), (text, colour))
    middle, half = center[plane], sizes[plane]
    for direction, names in _load_directions(cases).items():
        along = np.array(direction)[plane]
        if (length := math.hypot(*along.tolist())) >= _IN_PLANE:
            reach = float(np.min(half / np.maximum(np.abs(along), 1e-12))) + 0.12 * size / length
            tail = middle - (reach + _ARROW * size) * along
            curves.append(_arrow(tail, middle - reach * along, "direction of a load", "care"))
            texts[float(tail[0]), float(tail[1])] = (", ".join(names), "care")
    along = np.array(system.gravity)[plane] / (math.hypot(*system.gravity) or 1.0)
    if math.hypot(*along.tolist()) >= _IN_PLANE:
        tail = middle + half + 0.1 * size
        name = f"gravity, {math.hypot(*system.gravity) / STANDARD_GRAVITY:.3g} g"
        curves.append(_arrow(tail, tail + _ARROW * size * along, name, "purple"))
    return curves, [(*place, *text) for place, text in texts.items()]


def _load_directions(cases: Sequence[LoadCase]) -> dict[tuple[float, ...], dict[str, None]]:
    """Names of the cases by the directions of accelerations of the base, of forces, and of impacts."""
    directions: dict[tuple[float, ...], dict[str, None]] = {}
    for case in cases:
        vectors = [channel.direction for channel in case.channels if channel.kind is not _TURNING]
        if any(case.velocity):
            vectors.append(tuple((-np.array(case.velocity) / math.hypot(*case.velocity)).tolist()))
        for vector in vectors:
            directions.setdefault(tuple(round(part, 6) + 0.0 for part in vector), {})[case.name] = None
    return directions


def _arrow(tail: FloatArray, tip: FloatArray, name: str, colour: str) -> Curve:
    back = 0.3 * (tail - tip)
    side = 0.4 * np.array([-back[1], back[0]])
    return _path(np.array([tail, tip, tip + back + side, tip, tip + back - side]), name, colour)


def _path(places: FloatArray, name: str, colour: str, style: str = "-") -> Curve:
    """A line through places, shape (P, 2) [m]."""
    return Curve(places[:, 0], places[:, 1], name, colour, style)
