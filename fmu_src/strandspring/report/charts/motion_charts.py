"""Charts of load cases over time and frequency: histories, loops of mounts, spectra and sway.

Charts with histories show one answer at a time; its place is the `record` of their traces.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...ground.gravity import STANDARD_GRAVITY
from ...kernel.arrays import FloatArray, IndexArray
from ...vibration.signals.shock_spectra import ShockSpectrum
from ...vibration.signals.spectra import PowerSpectrum
from ...vibration.verdicts.answers import CaseAnswer
from ...vibration.verdicts.courses import Courses
from ...vibration.verdicts.verdicts import FigureKind
from ..content.chart import Axis, Chart, ChartForm, Role, Trace, joined, visible
from ..content.quantities import HZ, MM, DisplayUnit, G, N, S, number, percent

_DENSITY = DisplayUnit("g²/Hz", STANDARD_GRAVITY**-2)
_STYLES = tuple(
    (role, form)
    for form in (ChartForm.LINE, ChartForm.DASHED)
    for role in (Role.FIRST, Role.SECOND, Role.THIRD, Role.LOAD)
)
_BASE = (Role.REFERENCE, ChartForm.LINE)
_NO_MOTION = 1e-9  # of the largest in any direction
_POINTS, _LEAST_POINTS, _ALL_POINTS = 2400, 100, 150_000  # of a line, and of all lines of a page
_MOST_LINES = 5  # points or axes of an answer, those that move most
_NO_DENSITY = 1e-7  # of the largest
_LETTERS = "xyz"
Places = dict[int, CaseAnswer]


def histories(answers: Places) -> tuple[list[Chart], list[Chart]]:
    """Magnitude of acceleration and sway of the points over time with their limits, and their components."""
    most = _points_of_line(answers)
    magnitudes, components = [], []
    for quantity, unit in ((FigureKind.ACCELERATION, G), (FigureKind.SWAY, MM)):
        judged: list[Trace] = []
        signed: list[Trace] = []
        for place, answer in answers.items():
            courses, lines = _courses(answer), []
            time, of_points = courses.histories.time, courses.histories.acceleration
            if quantity is FigureKind.SWAY:
                of_points = courses.histories.sway - courses.histories.sway[0]
            elif courses.base.any():
                lines.append(("base", courses.base, _BASE))
            lines += [(name, of_points[:, k], style) for k, name, style in _points(answer)]
            for name, vectors, style in lines:
                length = unit.factor * np.linalg.norm(vectors, axis=1)
                axis = int(np.argmax(np.abs(vectors).max(axis=0)))
                judged.append(_line(name, time, length, style, place, most))
                judged += _limit_and_range(answer, quantity, name, time, length, style[0], place)
                component = f"{name} {_LETTERS[axis]}"
                signed.append(_line(component, time, unit.factor * vectors[:, axis], style, place, most))
        word, time_axis = quantity.value, Axis("time", S)
        magnitudes.append(Chart(
            f"history-{word}", f"{word.capitalize()} beside its limit", time_axis,
            Axis(word, unit, limits=(0.0, None)), tuple(judged),
            "Magnitude of the vector, of which the verdict is. The lines are of one run; the bar at each peak is the "
            "range that the verdict takes from all runs.", wide=True, single=True,
        ))  # fmt: skip
        components.append(Chart(
            f"components-{word}", f"Components of {word}", time_axis, Axis(word, unit), tuple(signed),
            "Of each point the component along x, y or z that moves most, in the same run.", wide=True, single=True,
        ))  # fmt: skip
    return magnitudes, components


def _limit_and_range(
    answer: CaseAnswer, quantity: FigureKind, point: str, time: FloatArray, values: FloatArray, role: Role, place: int
) -> Iterator[Trace]:
    """The limit of a point as a line, and the range of its figure as a bar at the peak of its line."""
    figure = next((figure for figure in answer.figures_of(quantity) if figure.subject == point), None)
    if figure is None:
        return
    low, high = (quantity.column.factor * end for end in (figure.low, figure.high))
    yield Trace(
        "range of the peak", time[[int(np.argmax(values))]], np.array([high]), role, ChartForm.RANGES,
        low=np.array([low]), record=place,
    )  # fmt: skip
    if figure.limit is not None:
        limit, ends = quantity.column.factor * figure.limit, time[[0, -1]]
        yield Trace(
            f"limit {number(limit)} {quantity.column.shown}", ends, np.full(2, limit), Role.LIMIT, ChartForm.DASHED,
            record=place,
        )  # fmt: skip


def loops(answers: Places) -> Chart:
    """Force of axes of mounts over the displacement of their springs, with the identified ranges."""
    traces: list[Trace] = []
    most = _points_of_line(answers)
    for place, answer in answers.items():
        courses, names = _courses(answer), answer.system.axis_names
        displacement, force = MM.factor * courses.histories.displacement, courses.histories.force
        use = max(answer.uses, key=lambda spectrum: float(spectrum.share.max()))
        worst = np.argsort(-np.nan_to_num(use.share, posinf=1e9), kind="stable")[:_MOST_LINES]
        for k, axis in enumerate(worst.tolist()):
            at = _both(displacement[:, axis], force[:, axis], most)
            style = _STYLES[k % len(_STYLES)]
            traces.append(Trace(names[axis], displacement[at, axis], force[at, axis], *style, record=place))
        low, high = MM.factor * use.low[worst].min(), MM.factor * use.high[worst].max()
        ends = np.array([force[:, worst].min(), force[:, worst].max()])
        x, y, _ = joined([(np.full(2, low), ends), (np.full(2, high), ends)])
        traces.append(Trace("ends of the identified range", x, y, Role.REFERENCE, ChartForm.DOTTED, record=place))
    return Chart(
        "loops", "Loops of the mounts", Axis("displacement of a spring", MM), Axis("force of the axis", N),
        tuple(traces), f"The {_MOST_LINES} axes that use most of their ranges, in one run; stops and dampers included.",
        wide=True, single=True,
    )  # fmt: skip


def shock_spectra(answers: Places) -> Chart | None:
    """Shock response spectra of the base and of the points."""
    traces: list[Trace] = []
    damping = 0.0
    for place, answer in answers.items():
        courses = _courses(answer)
        if not courses.shock:
            continue
        damping = courses.damping
        frequency = courses.shock[0][0].frequency
        if courses.base_shock:
            values = _maximax(courses.base_shock)
            traces.append(Trace("base", frequency, values, Role.REFERENCE, ChartForm.DASHED, record=place))
        for k, name, style in _points(answer):
            traces.append(Trace(name, frequency, _maximax(courses.shock[k]), *style, record=place))
        for name, required in courses.allowed.items():
            at = required.frequencies
            levels = G.factor * required.at(at)
            traces.append(Trace(f"limit of {name}", at, levels, Role.LIMIT, ChartForm.DASHED, record=place))
    if not traces:
        return None
    return Chart(
        "shock-spectra", "Shock response spectra",
        Axis("natural frequency", HZ, log=True), Axis("maximax acceleration", G, log=True), tuple(traces),
        f"Largest absolute acceleration of an oscillator with {percent(damping)} of critical damping (Q = "
        f"{0.5 / damping:.3g}) at the point or on the base, during the load or after it; the largest along x, y and z.",
        wide=True, single=True,
    )  # fmt: skip


def power_spectra(answers: Places) -> Chart | None:
    """Power spectral densities of the base and of the points."""
    traces: list[Trace] = []
    error = 0.0
    for place, answer in answers.items():
        courses = _courses(answer)
        if not courses.power:
            continue
        error = max(error, courses.power[0][0].relative_error)
        if courses.base_power:
            traces.append(Trace("base", *_total(courses.base_power), Role.REFERENCE, ChartForm.DASHED, record=place))
        for k, name, style in _points(answer):
            traces.append(Trace(name, *_total(courses.power[k]), *style, record=place))
    if not traces:
        return None
    return Chart(
        "power-spectra", "Power spectral density",
        Axis("frequency", HZ, log=True), Axis("density", _DENSITY, log=True), tuple(traces),
        f"Of acceleration, the sum of x, y and z, by Welch's method; the standard error of a value is up to "
        f"{percent(error)}.", wide=True, single=True,
    )  # fmt: skip


def sway_paths(answers: Places) -> Iterator[Chart]:
    """Paths of the points from rest, in three projections."""
    most = _points_of_line(answers)
    for across, up in ((0, 1), (0, 2), (1, 2)):
        traces = []
        for place, answer in answers.items():
            sway = _courses(answer).histories.sway
            for k, name, style in _points(answer):
                moved = MM.factor * (sway[:, k] - sway[0, k])
                moved[:, np.abs(moved).max(axis=0) < _NO_MOTION * np.abs(moved).max()] = 0.0
                at = _both(moved[:, across], moved[:, up], most)
                if moved[:, [across, up]].any(axis=0).all():
                    traces.append(Trace(name, moved[at, across], moved[at, up], *style, record=place))
        a, b = _LETTERS[across], _LETTERS[up]
        if traces:
            yield Chart(
                f"sway-{a}{b}", f"Sway in {a} and {b}", Axis(a, MM), Axis(b, MM), tuple(traces),
                f"Paths of the points relative to the base, from rest, in {a} and {b}.", single=True,
            )  # fmt: skip


def _maximax(spectra: Sequence[ShockSpectrum]) -> FloatArray:
    """The largest along x, y and z, in display units."""
    return np.asarray(G.factor * np.max([spectrum.maximax for spectrum in spectra], axis=0))


def _total(spectra: Sequence[PowerSpectrum]) -> tuple[FloatArray, FloatArray]:
    """Frequencies and the sum over x, y and z in display units, interrupted where there is next to none."""
    density = _DENSITY.factor * np.sum([spectrum.density for spectrum in spectra], axis=0)
    significant = np.flatnonzero(density > _NO_DENSITY * density.max())
    shown = slice(1, int(significant[-1]) + 1 if significant.size else 1)
    return spectra[0].frequency[shown], np.where(density > _NO_DENSITY * density.max(), density, np.nan)[shown]


def _courses(answer: CaseAnswer) -> Courses:
    if answer.courses is None:
        raise ValueError("The answer has no histories.")
    return answer.courses


def _points(answer: CaseAnswer) -> Iterator[tuple[int, str, tuple[Role, ChartForm]]]:
    """The points with the largest acceleration, each with a colour of its own."""
    largest = np.max([run.figures.acceleration for run in answer.runs], axis=0)
    for k, point in enumerate(sorted(np.argsort(-largest, kind="stable")[:_MOST_LINES].tolist())):
        yield point, answer.system.points[point].name, _STYLES[k % len(_STYLES)]


def _line(
    name: str, time: FloatArray, values: FloatArray, style: tuple[Role, ChartForm], place: int, most: int
) -> Trace:
    at = visible(values, most)
    return Trace(name, time[at], values[at], *style, record=place)


def _both(x: FloatArray, y: FloatArray, most: int) -> IndexArray:
    """Samples of a path that draw the same line."""
    return np.union1d(visible(x, most // 2), visible(y, most // 2))


def _points_of_line(answers: Places) -> int:
    """How many points a line may have so that a page of all answers is not too large."""
    lines = sum(2 + 7 * min(_MOST_LINES, len(answer.system.points)) + _MOST_LINES for answer in answers.values())
    return min(_POINTS, max(_LEAST_POINTS, _ALL_POINTS // max(1, lines)))
