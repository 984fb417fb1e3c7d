"""Charts of systems on mounts: verdicts beside their limits, histories and spectra of load cases, drawings to scale.

Charts with histories show one answer at a time, by its place.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..ground.gravity import STANDARD_GRAVITY
from ..kernel.arrays import FloatArray, IndexArray
from ..vibration.bodies.loads import ChannelKind, LoadCase
from ..vibration.bodies.mounted import MountedSystem
from ..vibration.bodies.parts import BASE, MotionKind, RigidBody
from ..vibration.bodies.six_response import SystemResponse
from ..vibration.signals.spectra import PowerSpectrum
from ..vibration.verdicts.answers import CaseAnswer, overall_verdicts
from ..vibration.verdicts.courses import Courses
from ..vibration.verdicts.verdicts import CaseVerdict, FigureKind
from .drawing import LIGHT, Chart, annotate, bars, line, marks, name_axes, name_places, visible
from .quantities import HZ, MM, NUMBER, PERCENT, DisplayUnit, G, N, S, number, percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Answers = Mapping[int, CaseAnswer]
Line = tuple[str, FloatArray, str, str]  # name, values over time, colour and style
STYLES = [(colour, style) for style in ("-", "--") for colour in ("blue", "green", "purple", "care")]
_COLOURS = ("blue", "green", "purple", "care", "muted")
_DENSITY = DisplayUnit("g²/Hz", STANDARD_GRAVITY**-2)
_MOST_ANSWERS = 40  # beside their limits
_MOST_BARS = 18  # axes of an answer, those that use most of their ranges
_MOST_LINES = 5  # points or axes of an answer, those that move most
_NO_MOTION, _NO_DENSITY = 1e-9, 1e-7  # of the largest in any direction, and of the largest
_POINTS, _LEAST_POINTS, _ALL_POINTS = 2400, 100, 150_000  # of a line, and of all lines of a page
_NO_SIZE, _THIN = 0.05, 0.12  # least half size of a system [m], and of a view, of the largest
_AXIS, _ARROW = 0.18, 0.3  # lengths of axes of mounts and of arrows, of the largest half size
_IN_PLANE = 0.3  # least share of a direction that a view shows
_TURNING = ChannelKind.BASE_ANGULAR_VELOCITY
_VIEWS = {"top": (0, 1), "front": (0, 2), "side": (1, 2)}  # coordinates to the right and up


def shares_of_limits(answers: Sequence[CaseAnswer]) -> Chart | None:
    """The ranges of all kinds of figures as shares of their limits; None without a limit."""
    shares = {k: figure.share for k, answer in enumerate(answers) if (figure := answer.nearest_limit) is not None}
    nearest = sorted(sorted(shares, key=lambda k: -shares[k])[:_MOST_ANSWERS])
    shown = [answers[k] for k in nearest]
    figures = [
        [(place, figure) for place, answer in enumerate(shown, 1) if (figure := answer.worst(kind)) is not None
         and figure.limit and math.isfinite(figure.high)] for kind in FigureKind
    ]  # fmt: skip
    kinds = [of_kind for of_kind in figures if of_kind]
    if not kinds:
        return None

    def draw(axes: Axes, _record: int | None) -> None:
        for k, of_kind in enumerate(kinds):
            x = np.array([place for place, _ in of_kind]) + 0.6 * ((k + 0.5) / len(kinds) - 0.5)
            ends = [[100.0 * one.low / (one.limit or 1.0), 100.0 * one.high / (one.limit or 1.0)] for _, one in of_kind]
            low, high = np.array(ends).T
            colour, half = _COLOURS[k % len(_COLOURS)], 0.5 * (high - low)
            marks(axes, x, low + half, of_kind[0][1].quantity.value, colour, "", error=half)
        line(axes, [0.5, len(shown) + 0.5], [100.0, 100.0], "limit", "poor", "--")
        axes.set_ylim(bottom=0.0)
        name_places(axes, "x", [f"{answer.candidate}, {answer.case.name}" for answer in shown])
        name_axes(axes, ("", NUMBER), ("share of the limit", PERCENT))

    more = len(shares) - len(shown)
    sentence = (
        "Of each kind of figure the one nearest to its limit, with the range that the verdict takes: below the line it "
        "passes, above it fails, across it nothing is decided."
        f"{f' {more} answers farther from their limits are left out.' if more else ''}"
    )
    return Chart("limits", "Figures beside their limits", sentence, draw, wide=True)


def acceleration_against_stroke(answers: Sequence[CaseAnswer]) -> Chart:
    """One mark for each case with the figure that decides, and a cross with the verdict where it does not pass; one
    colour for each candidate, which the legend names with the verdict on all cases together.
    """

    def draw(axes: Axes, _record: int | None) -> None:
        texts = {}
        for k, (candidate, verdict) in enumerate(overall_verdicts(answers).items()):
            of_one = [answer for answer in answers if answer.candidate == candidate]
            worst = min(of_one, key=lambda answer: (-[*CaseVerdict].index(answer.verdict), -answer.severity))
            figure = _deciding(worst)
            name = f"{candidate}: {verdict.value}{figure and f', {figure} of its limit in {worst.case.name}'}"
            for answer in of_one:
                stroke, acceleration = answer.worst(FigureKind.STROKE), answer.worst(FigureKind.ACCELERATION)
                if stroke and acceleration and math.isfinite(stroke.high):
                    passes = answer.verdict in (CaseVerdict.NO_LIMITS, CaseVerdict.PASSES)
                    place, colour = (100.0 * stroke.high, G.factor * acceleration.high), _COLOURS[k % len(_COLOURS)]
                    marks(axes, *place, name, colour, "o" if passes else "X")
                    said = f"{answer.case.name}: {'' if passes else f'{answer.verdict.value}, '}{_deciding(answer)}"
                    texts[place] = (said, colour)
        for kind, unit, of_limit in (
            (FigureKind.STROKE, PERCENT, axes.axvline), (FigureKind.ACCELERATION, G, axes.axhline),
        ):  # fmt: skip
            figures = (figure for answer in answers for figure in answer.figures_of(kind))
            for limit in sorted({unit.factor * figure.limit for figure in figures if figure.limit}):
                subject, style = ("stroke", "--") if kind is FigureKind.STROKE else ("a point", ":")
                of_limit(limit, ls=style, color=LIGHT["poor"], label=f"limit of {subject}, {number(limit)} {unit.name}")
        axes.set(xlim=(0.0, None), ylim=(0.0, None))
        name_axes(axes, ("stroke", PERCENT), ("acceleration", G))
        annotate(axes, texts)

    sentence = (
        "Each mark is a load case: largest acceleration of the worst point, and largest share of a spring's way from "
        "rest to the end of its identified range."
    )
    return Chart("sheet", "Acceleration against stroke", sentence, draw, wide=True)


def _deciding(answer: CaseAnswer) -> str:
    """The figure that is nearest to its limit, and its share of that; empty without one."""
    nearest = answer.nearest_limit
    return "" if nearest is None else f"{nearest.quantity.value} {percent(nearest.share, 3)}"


def strokes(answers: Answers) -> Chart:
    """Where the springs of each axis rest and move within their identified ranges."""
    shares: dict[str, float] = {}
    for answer in answers.values():
        largest = np.max([np.nan_to_num(use.share, posinf=math.inf) for use in answer.uses], axis=0)
        for name, share in zip(answer.system.axis_names, largest.tolist(), strict=True):
            shares[name] = max(share, shares.get(name, 0.0))
    most = set(sorted(shares, key=lambda name: -shares[name])[:_MOST_BARS])
    places = {name: 1.0 + k for k, name in enumerate(name for name in shares if name in most)}
    more = len(shares) - len(places)
    left = f" {more} axes that use less of theirs are left out." if more else ""
    return Chart(
        "strokes", "Stroke beside its limit",
        f"From the least to the largest displacement of a spring in any run, as its model counts.{left}",
        partial(_draw_strokes, answers=answers, places=places), wide=True, records=[*answers],
    )  # fmt: skip


def _draw_strokes(axes: Axes, record: int, answers: Answers, places: Mapping[str, float]) -> None:
    """The ranges of an answer, how far they were used, where they are at rest, and the limits."""
    answer = answers[record]
    names = answer.system.axis_names
    chosen = [k for k, name in enumerate(names) if name in places]
    x = np.array([places[names[k]] for k in chosen])
    first = answer.uses[0]
    low, high, rest = (MM.factor * values[chosen] for values in (first.low, first.high, first.rest))
    lowest = MM.factor * np.min([use.lowest for use in answer.uses], axis=0)[chosen]
    highest = MM.factor * np.max([use.highest for use in answer.uses], axis=0)[chosen]
    bars(axes, x, low, high, "identified range", "faint", 0.8)
    bars(axes, x, lowest, highest, "reached", "blue", 0.5)
    marks(axes, x, rest, "at rest", "measured")
    limit = next((figure.limit for figure in answer.figures_of(FigureKind.STROKE) if figure.limit), 1.0)
    for end in (low, high):
        along = np.repeat(rest + limit * (end - rest), 3)
        name = f"limit, {number(100.0 * limit)} % of the way from rest"
        line(axes, (x[:, None] + (-0.4, 0.4, np.nan)).ravel(), along, name, "poor")
    name_places(axes, "x", [*places])
    name_axes(axes, ("", NUMBER), ("displacement", MM))


def histories(answers: Answers) -> Iterator[Chart]:
    """Magnitude of acceleration and sway of the points over time with their limits."""
    most = _points_of_line(answers)

    def draw(axes: Axes, record: int, quantity: FigureKind, unit: DisplayUnit) -> None:
        time, answer = _courses(answers[record]).histories.time, answers[record]
        for name, vectors, *style in _vectors(answer, quantity):
            length = unit.factor * np.linalg.norm(vectors, axis=1)
            at = visible(length, most)
            line(axes, time[at], length[at], name, *style)
            figure = next((figure for figure in answer.figures_of(quantity) if figure.subject == name), None)
            if figure is None:
                continue
            low, high = (unit.factor * end for end in (figure.low, figure.high))
            peak, half = time[int(np.argmax(length))], 0.5 * (high - low)
            marks(axes, [peak], [low + half], "range of the peak", style[0], "", error=[half])
            if figure.limit is not None:
                limit = unit.factor * figure.limit
                line(axes, time[[0, -1]], [limit, limit], f"limit {number(limit)} {unit.name}", "poor", "--")
        axes.set_ylim(bottom=0.0)
        name_axes(axes, ("time", S), (quantity.value, unit))

    sentence = (
        "Magnitude of the vector, of which the verdict is. The lines are of one run; the bar at each peak is the range "
        "that the verdict takes from all runs."
    )
    for quantity, unit in ((FigureKind.ACCELERATION, G), (FigureKind.SWAY, MM)):
        word, own = quantity.value, partial(draw, quantity=quantity, unit=unit)
        yield _of_each(answers, f"history-{word}", f"{word.capitalize()} beside its limit", sentence, own)


def _of_each(answers: Answers, key: str, title: str, sentence: str, draw: Callable[..., None]) -> Chart:
    """A chart of one answer at a time."""
    return Chart(key, title, sentence, draw, wide=not key.startswith("sway-"), records=[*answers])


def _vectors(answer: CaseAnswer, quantity: FigureKind) -> Iterator[Line]:
    """Acceleration of the base and the points, or sway of the points from rest, shape (K, 3) each."""
    courses = _courses(answer)
    of_points = courses.histories.acceleration
    if quantity is FigureKind.SWAY:
        of_points = courses.histories.sway - courses.histories.sway[0]
    elif courses.base.any():
        yield "base", courses.base, "muted", "-"
    for k, name, style in _points(answer):
        yield name, of_points[:, k], *style


def loops(answers: Answers) -> Chart:
    """Force of axes of mounts over the displacement of their springs, with the identified ranges."""
    most = _points_of_line(answers)

    def draw(axes: Axes, record: int) -> None:
        answer = answers[record]
        histories, names = _courses(answer).histories, answer.system.axis_names
        displacement, force = MM.factor * histories.displacement, histories.force
        use = max(answer.uses, key=lambda spectrum: float(spectrum.share.max()))
        worst = np.argsort(-np.nan_to_num(use.share, posinf=1e9), kind="stable")[:_MOST_LINES]
        for k, axis in enumerate(worst.tolist()):
            at = _both(displacement[:, axis], force[:, axis], most)
            line(axes, displacement[at, axis], force[at, axis], names[axis], *STYLES[k])
        for end in (MM.factor * use.low[worst].min(), MM.factor * use.high[worst].max()):
            axes.axvline(end, ls=":", lw=0.9, color=LIGHT["muted"], label="ends of the identified range")
        name_axes(axes, ("displacement of a spring", MM), ("force of the axis", N))

    sentence = f"The {_MOST_LINES} axes that use most of their ranges, in one run; stops and dampers included."
    return _of_each(answers, "loops", "Loops of the mounts", sentence, draw)


def spectra(answers: Answers) -> Iterator[Chart]:
    """Shock response spectra and power spectral densities of the base and of the points, where there are any."""
    shocks = {place: answer for place, answer in answers.items() if _courses(answer).shock}
    if shocks:
        damping = _courses([*shocks.values()][-1]).damping
        sentence = (
            f"Largest absolute acceleration of an oscillator with {percent(damping)} of critical damping (Q = "
            f"{0.5 / damping:.3g}) at the point or on the base, during the load or after it; the largest along x, y "
            "and z."
        )
        draw = partial(_draw_shock_spectra, answers=answers)
        yield _of_each(shocks, "shock-spectra", "Shock response spectra", sentence, draw)
    powers = {place: answer for place, answer in answers.items() if _courses(answer).power}
    if powers:
        error = max(_courses(answer).power[0][0].relative_error for answer in powers.values())
        sentence = (
            "Of acceleration, the sum of x, y and z, by Welch's method; the standard error of a value is up to "
            f"{percent(error)}."
        )
        draw = partial(_draw_power_spectra, answers=answers)
        yield _of_each(powers, "power-spectra", "Power spectral density", sentence, draw)


def _draw_shock_spectra(axes: Axes, record: int, answers: Answers) -> None:
    courses = _courses(answers[record])
    frequency = courses.shock[0][0].frequency
    named = [("base", courses.base_shock, ("muted", "--"))] if courses.base_shock else []
    named += [(name, courses.shock[k], style) for k, name, style in _points(answers[record])]
    for name, along, style in named:
        line(axes, frequency, G.factor * np.max([spectrum.maximax for spectrum in along], axis=0), name, *style)
    for name, required in courses.allowed.items():
        at = required.frequencies
        line(axes, at, G.factor * required.at(at), f"limit of {name}", "poor", "--")
    name_axes(axes, ("natural frequency", HZ), ("maximax acceleration", G), log="xy")


def _draw_power_spectra(axes: Axes, record: int, answers: Answers) -> None:
    courses = _courses(answers[record])
    if courses.base_power:
        line(axes, *_total(courses.base_power), "base", "muted", "--")
    for k, name, style in _points(answers[record]):
        line(axes, *_total(courses.power[k]), name, *style)
    name_axes(axes, ("frequency", HZ), ("density", _DENSITY), log="xy")


def _total(spectra: Sequence[PowerSpectrum]) -> tuple[FloatArray, FloatArray]:
    """Frequencies and the sum over x, y and z in display units, interrupted where there is next to none."""
    density = _DENSITY.factor * np.sum([spectrum.density for spectrum in spectra], axis=0)
    significant = np.flatnonzero(density > _NO_DENSITY * density.max())
    shown = slice(1, int(significant[-1]) + 1 if significant.size else 1)
    return spectra[0].frequency[shown], np.where(density > _NO_DENSITY * density.max(), density, np.nan)[shown]


def sway_paths(answers: Answers) -> Iterator[Chart]:
    """Paths of the points from rest, in three projections."""
    most = _points_of_line(answers)
    moved = {}
    for place, answer in answers.items():
        sway = MM.factor * (_courses(answer).histories.sway - _courses(answer).histories.sway[0])
        moving = np.abs(sway).max(axis=0) > _NO_MOTION * np.abs(sway).max()
        moved[place] = [(sway[:, k], moving[k], name, style) for k, name, style in _points(answer)]
    for across, up in _VIEWS.values():

        def draw(axes: Axes, record: int, across: int = across, up: int = up) -> None:
            for path, moving, name, style in moved[record]:
                if moving[across] and moving[up]:
                    at = _both(path[:, across], path[:, up], most)
                    line(axes, path[at, across], path[at, up], name, *style)
            name_axes(axes, ("xyz"[across], MM), ("xyz"[up], MM))

        a, b = "xyz"[across], "xyz"[up]
        moving = {k: answers[k] for k, of in moved.items() if any(along[across] and along[up] for _, along, *_ in of)}
        if moving:
            sentence = f"Paths of the points relative to the base, from rest, in {a} and {b}."
            yield _of_each(moving, f"sway-{a}{b}", f"Sway in {a} and {b}", sentence, draw)


def _courses(answer: CaseAnswer) -> Courses:
    if answer.courses is None:
        raise ValueError("The answer has no histories.")
    return answer.courses


def _points(answer: CaseAnswer) -> Iterator[tuple[int, str, tuple[str, str]]]:
    """The points with the largest acceleration, each with a colour of its own."""
    largest = np.max([run.figures.acceleration for run in answer.runs], axis=0)
    for k, point in enumerate(sorted(np.argsort(-largest, kind="stable")[:_MOST_LINES].tolist())):
        yield point, answer.system.points[point].name, STYLES[k]


def _both(x: FloatArray, y: FloatArray, most: int) -> IndexArray:
    """Samples of a path that draw the same line."""
    return np.union1d(visible(x, most // 2), visible(y, most // 2))


def _points_of_line(answers: Answers) -> int:
    """How many points a line may have so that a page of all answers is not too large."""
    lines = sum(2 + 7 * min(_MOST_LINES, len(answer.system.points)) + _MOST_LINES for answer in answers.values())
    return min(_POINTS, max(_LEAST_POINTS, _ALL_POINTS // max(1, lines)))


def gains(curves: Sequence[SystemResponse]) -> tuple[Chart, Chart]:
    """Gain of the points over frequency of each curve, in the direction in which they move most, and their sway."""
    first = curves[0]
    unit = DisplayUnit(first.gain_column.shown, first.gain_column.factor)

    def draw(axes: Axes, record: int | None, of_sway: bool = False) -> None:
        for place, response in enumerate(curves):
            motion = np.abs(response.gain)
            for p, point in enumerate(response.points[: len(STYLES)] if record in (None, place) else ()):
                gain = motion[:, p, int(np.argmax(motion[:, p].max(axis=0)))]
                values = 1e3 * response.sway[:, p] if of_sway else unit.factor * gain
                line(axes, response.frequency, values, point.name, *STYLES[p], record=place)
        y, log = (("sway", MM), "x") if of_sway else (("gain", unit), "xy")
        name_axes(axes, ("frequency", HZ), y, log=log)

    gain = "Of each point the direction in which it moves most."
    sway = "Largest distance of a point from its place at rest, relative to the base."
    return (
        Chart("gain", "Motion over excitation", gain, draw, wide=True),
        Chart("sway", "Sway", sway, partial(draw, of_sway=True), wide=True),
    )


def system_drawing(system: MountedSystem, cases: Sequence[LoadCase]) -> tuple[list[Chart], str]:
    """The system in its nominal pose to scale from three sides, along which directions the load cases act, and what
    these drawings show and leave out.
    """
    boxes = {body.name: _box(body) for body in system.bodies}
    places = [body.center for body in system.bodies] + [mount.place for mount in system.mounts]
    places += [point.place for point in system.points]
    everything = np.concatenate([*(box for box in boxes.values() if box is not None), np.array(places)])
    low, high = everything.min(axis=0), everything.max(axis=0)
    size = float(0.5 * (high - low).max()) or _NO_SIZE
    half = np.maximum(0.5 * (high - low), _THIN * size)
    corners = MM.factor * (0.5 * (low + high) + np.array([[-1.0], [1.0]]) * half)
    charts = []
    for name, plane in _VIEWS.items():
        right, up = ("xyz"[axis] for axis in plane)
        draw = partial(_draw_view, system=system, boxes=boxes, cases=cases, plane=plane, corners=corners[:, plane])
        sentence = f"To scale, {right} to the right and {up} up."
        charts.append(Chart(f"system-{name}", f"{name.capitalize()} view", sentence, draw, is_square=True))
    sizeless = [name for name, box in boxes.items() if box is None]
    unknown = f"; no inertia gives the size of {', '.join(sizeless)}" if sizeless else ""
    text = (
        "The nominal pose. Outlines are uniform cuboids of the mass and inertia of each body, not its housing"
        f"{unknown}. Each axis of a mount is drawn from its place to where a motion of the body is positive; loads "
        "point along the acceleration of the base or the force."
    )
    turning = [case.name for case in cases if any(channel.kind is _TURNING for channel in case.channels)]
    return charts, f"{text} The base turns in {', '.join(turning)}, which is not drawn." if turning else text


def _box(body: RigidBody) -> FloatArray | None:
    """Corners of the uniform cuboid with the mass and inertia of a body, shape (8, 3) [m]; None if that is unknown."""
    if body.motion is not MotionKind.SIX:
        return None
    moments, axes = np.linalg.eigh(np.array(body.inertia))
    # A moment is m/12 times the sum of the squares of the other two edges.
    edges = np.sqrt(np.maximum(6.0 / body.mass * (moments.sum() - 2.0 * moments), 0.0))
    signs = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
    return np.asarray(np.array(body.center) + (signs * edges) @ axes.T)


def _draw_view(
    axes: Axes, _record: int | None, system: MountedSystem, boxes: Mapping[str, FloatArray | None],
    cases: Sequence[LoadCase], plane: tuple[int, int], corners: FloatArray,
) -> None:  # fmt: skip
    """One side of a system: `plane` are its two coordinates, `corners` two corners of what is in it [mm]."""
    size = 0.5 * float(np.ptp(corners, axis=0).max())
    texts: dict[tuple[float, float], tuple[str, str]] = {}

    def seen(places: Any) -> tuple[FloatArray, FloatArray]:
        x, y = MM.factor * np.array(places, dtype=float)[:, plane].T
        return x, y

    for box in boxes.values():
        # Corners that differ in one sign are joined by an edge.
        for a, b in itertools.combinations(range(8), 2):
            if box is not None and (a ^ b).bit_count() == 1:
                line(axes, *seen(box[[a, b]]), "body", "muted")
    labels = list(dict.fromkeys(label if axis.name else "" for mount in system.mounts
                                for axis, label in zip(mount.axes, mount.axis_labels, strict=True)))  # fmt: skip
    for mount in system.mounts:
        for axis, label in zip(mount.axes, mount.axis_labels, strict=True):
            way = np.array([[0.0], [_AXIS * size / MM.factor]]) * np.array(axis.direction)
            style = ("-", "--", ":")[labels.index(label if axis.name else "") % 3]
            line(axes, *seen(np.array(mount.place) + way), f"axis: {label}" if axis.name else "axis", "green", style)
    on_base, on_body = (
        {mount.name: mount.place for mount in system.mounts if (mount.support == BASE) is is_on_base}
        for is_on_base in (True, False)
    )
    for name, colour, places in (
        ("centre of gravity", "measured", {body.name: body.center for body in system.bodies}),
        ("point", "blue", {point.name: point.place for point in system.points if point.name not in boxes}),
        ("mount on the base", "green", on_base), ("mount on a body", "purple", on_body),
    ):  # fmt: skip
        if places:
            marks(axes, *seen(list(places.values())), name, colour)
            for text, x, y in zip(places, *seen(list(places.values())), strict=True):
                texts.setdefault((float(x), float(y)), (text, colour))
    middle, half = corners.mean(axis=0), 0.5 * np.ptp(corners, axis=0)
    for direction, names in _load_directions(cases).items():
        along = np.array(direction)[[*plane]]
        if (length := math.hypot(*along.tolist())) >= _IN_PLANE:
            reach = float(np.min(half / np.maximum(np.abs(along), 1e-12))) + 0.12 * size / length
            tail = middle - (reach + _ARROW * size) * along
            _arrow(axes, tail, middle - reach * along, "direction of a load", "care")
            texts[float(tail[0]), float(tail[1])] = (", ".join(names), "care")
    along = np.array(system.gravity)[[*plane]] / (math.hypot(*system.gravity) or 1.0)
    if math.hypot(*along.tolist()) >= _IN_PLANE:
        name = f"gravity, {number(math.hypot(*system.gravity) / STANDARD_GRAVITY, 3)} g"
        _arrow(axes, corners[1] + 0.1 * size, corners[1] + 0.1 * size + _ARROW * size * along, name, "purple")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
    name_axes(axes, ("xyz"[plane[0]], MM), ("xyz"[plane[1]], MM))
    annotate(axes, texts)


def _load_directions(cases: Sequence[LoadCase]) -> dict[tuple[float, ...], list[str]]:
    """Names of the cases by the directions of accelerations of the base, of forces, and of impacts."""
    directions: dict[tuple[float, ...], list[str]] = {}
    for case in cases:
        vectors = [channel.direction for channel in case.channels if channel.kind is not _TURNING]
        if any(case.velocity):
            vectors.append(tuple((-np.array(case.velocity) / math.hypot(*case.velocity)).tolist()))
        for vector in vectors:
            names = directions.setdefault(tuple(round(part, 6) + 0.0 for part in vector), [])
            if case.name not in names:
                names.append(case.name)
    return directions


def _arrow(axes: Axes, tail: FloatArray, tip: FloatArray, name: str, colour: str) -> None:
    back = 0.3 * (tail - tip)
    side = 0.4 * np.array([-back[1], back[0]])
    x, y = np.array([tail, tip, tip + back + side, tip, tip + back - side]).T
    line(axes, x, y, name, colour)
