"""Charts of load cases: acceleration against stroke, histories, loops of mounts, spectra and sway.

Charts with histories show one answer at a time; its place is the `record` of their traces.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...ground.gravity import STANDARD_GRAVITY
from ...kernel.arrays import FloatArray
from ...loops.strokes import IndexArray
from ...vibration.bodies.axis_names import axis_names
from ...vibration.signals.shock_spectra import ShockSpectrum
from ...vibration.signals.spectra import PowerSpectrum
from ...vibration.verdicts.answers import CaseAnswer
from ...vibration.verdicts.courses import SRS_DAMPING, Courses
from ...vibration.verdicts.verdicts import FigureKind
from ..content.chart import Axis, Chart, ChartForm, Role, Trace, joined
from ..content.quantities import DisplayUnit, number, percent
from ..content.thinning import visible

G, MM, PERCENT, N, HZ, S = (
    DisplayUnit("g", 1.0 / STANDARD_GRAVITY), DisplayUnit("mm", 1e3), DisplayUnit("%", 100.0), DisplayUnit("N"),
    DisplayUnit("Hz"), DisplayUnit("s")
)  # fmt: skip
_DENSITY = DisplayUnit("g²/Hz", STANDARD_GRAVITY**-2)
_STYLES = tuple(
    (role, form)
    for form in (ChartForm.LINE, ChartForm.DASHED)
    for role in (Role.FIRST, Role.MODEL, Role.SECOND, Role.THIRD)
)
_COLOURS = (Role.FIRST, Role.MODEL, Role.SECOND, Role.THIRD, Role.MEASURED)
_NO_MOTION = 1e-9  # of the largest in any direction
_POINTS = 2400  # of a line
_MOST_LINES = 5  # points or axes of an answer, those that move most
_NO_DENSITY = 1e-7  # of the largest
_LETTERS = "xyz"
Places = dict[int, CaseAnswer]


def acceleration_against_stroke(answers: Sequence[CaseAnswer]) -> Chart:
    """One mark for each case, one colour for each candidate."""
    traces = []
    marks: list[tuple[float, float, CaseAnswer]] = []
    for k, candidate in enumerate(dict.fromkeys(answer.candidate for answer in answers)):
        of_candidate = [mark for answer in answers if answer.candidate == candidate for mark in _marks(answer)]
        if of_candidate:
            texts = [mark[2].case.name for mark in of_candidate]
            x, y = (
                np.array([mark[0] for mark in of_candidate]),
                np.array([mark[1] for mark in of_candidate]),
            )
            traces.append(Trace(candidate, x, y, _COLOURS[k % len(_COLOURS)], ChartForm.MARKS, texts=tuple(texts)))
        marks += of_candidate
    strokes = {
        figure.limit
        for answer in answers
        for figure in answer.figures_of(FigureKind.STROKE)
        if figure.limit is not None
    }
    limits = {
        figure.limit for answer in answers for figure in answer.figures_of(FigureKind.ACCELERATION) if figure.limit
    }
    if marks:
        right, top = 1.05 * max(mark[0] for mark in marks), 1.05 * max(mark[1] for mark in marks)
        top = max([top, *(G.factor * limit for limit in limits)])
        for limit in sorted(strokes):
            ends = np.array([0.0, top])
            traces.append(
                Trace("limit of stroke", np.full(2, PERCENT.factor * limit), ends, Role.REFERENCE, ChartForm.DASHED)
            )
        for limit in sorted(limits):
            ends = np.array([0.0, max(right, PERCENT.factor)])
            traces.append(
                Trace("limit of a point", ends, np.full(2, G.factor * limit), Role.REFERENCE, ChartForm.DOTTED)
            )
    sentence = (
        "Each mark is a load case: largest acceleration of the worst point, and largest share of a spring's way "
        "from rest to the end of its identified range."
    )
    if marks:
        stroke, acceleration, answer = max(marks, key=lambda mark: mark[0])
        sentence += (
            f" The largest stroke, {number(stroke, 3)} %, is that of {answer.candidate} in {answer.case.name}, with "
            f"{number(acceleration, 3)} g."
        )
    return Chart(
        "sheet", "Acceleration against stroke",
        Axis("stroke", PERCENT, limits=(0.0, None)), Axis("acceleration", G, limits=(0.0, None)),
        tuple(traces), sentence, wide=True,
    )  # fmt: skip


def _marks(answer: CaseAnswer) -> Iterator[tuple[float, float, CaseAnswer]]:
    """Stroke [%] and acceleration [g] of an answer, if it has both."""
    stroke, acceleration = answer.worst(FigureKind.STROKE), answer.worst(FigureKind.ACCELERATION)
    if stroke is not None and acceleration is not None and math.isfinite(stroke.value):
        yield PERCENT.factor * stroke.value, G.factor * acceleration.value, answer


def histories(answers: Places) -> Iterator[Chart]:
    """Acceleration of the base and of the points, and sway of the points, over time."""
    acceleration: list[Trace] = []
    sway: list[Trace] = []
    for place, answer in answers.items():
        courses = _courses(answer)
        time, base = courses.histories.time, G.factor * courses.base
        if base.any():
            acceleration.append(
                _line(f"base {_letter(base)}", time, _largest(base), (Role.REFERENCE, ChartForm.LINE), place)
            )
        for k, name, style in _points(answer):
            a = G.factor * courses.histories.acceleration[:, k]
            s = MM.factor * (courses.histories.sway[:, k] - courses.histories.sway[0, k])
            acceleration.append(_line(f"{name} {_letter(a)}", time, _largest(a), style, place))
            sway.append(_line(f"{name} {_letter(s)}", time, _largest(s), style, place))
    for key, title, unit, traces in (
        ("acceleration", "Acceleration over time", G, acceleration),
        ("sway", "Sway from rest over time", MM, sway),
    ):
        if traces:
            yield Chart(
                f"history-{key}", title, Axis("time", S), Axis(key, unit), tuple(traces),
                "Of each point the component along x, y or z that moves most, from the static equilibrium with the "
                "largest acceleration.", wide=True, single=True,
            )  # fmt: skip


def loops(answers: Places) -> Chart:
    """Force of axes of mounts over the displacement of their springs, with the identified ranges."""
    traces: list[Trace] = []
    for place, answer in answers.items():
        courses, names = _courses(answer), axis_names(answer.system)
        displacement, force = MM.factor * courses.histories.displacement, courses.histories.force
        use = max(answer.uses, key=lambda spectrum: float(spectrum.share.max()))
        worst = np.argsort(-np.nan_to_num(use.share, posinf=1e9), kind="stable")[:_MOST_LINES]
        for k, axis in enumerate(worst.tolist()):
            at = _both(displacement[:, axis], force[:, axis])
            style = _STYLES[k % len(_STYLES)]
            traces.append(Trace(names[axis], displacement[at, axis], force[at, axis], *style, record=place))
        low, high = MM.factor * use.low[worst].min(), MM.factor * use.high[worst].max()
        ends = np.array([force[:, worst].min(), force[:, worst].max()])
        x, y, _ = joined([(np.full(2, low), ends), (np.full(2, high), ends)])
        traces.append(Trace("ends of the identified range", x, y, Role.REFERENCE, ChartForm.DOTTED, record=place))
    return Chart(
        "loops", "Loops of the mounts", Axis("displacement of a spring", MM), Axis("force of the axis", N),
        tuple(traces), f"The {_MOST_LINES} axes that use most of their identified range, stops and dampers included.",
        wide=True, single=True,
    )  # fmt: skip


def shock_spectra(answers: Places) -> Chart | None:
    """Shock response spectra of the base and of the points."""
    traces: list[Trace] = []
    for place, answer in answers.items():
        courses = _courses(answer)
        if not courses.shock:
            continue
        frequency = courses.shock[0][0].frequency
        if courses.base_shock:
            values = _maximax(courses.base_shock)
            traces.append(Trace("base", frequency, values, Role.REFERENCE, ChartForm.DASHED, record=place))
        for k, name, style in _points(answer):
            traces.append(Trace(name, frequency, _maximax(courses.shock[k]), *style, record=place))
    if not traces:
        return None
    return Chart(
        "shock-spectra", "Shock response spectra",
        Axis("natural frequency", HZ, log=True), Axis("maximax acceleration", G, log=True), tuple(traces),
        f"Largest absolute acceleration of an oscillator with {percent(SRS_DAMPING)} of critical damping at the "
        "point or "
        "on the base, during the load or after it; the largest along x, y and z.", wide=True, single=True,
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
    for across, up in ((0, 1), (0, 2), (1, 2)):
        traces = []
        for place, answer in answers.items():
            sway = _courses(answer).histories.sway
            for k, name, style in _points(answer):
                moved = MM.factor * (sway[:, k] - sway[0, k])
                moved[:, np.abs(moved).max(axis=0) < _NO_MOTION * np.abs(moved).max()] = 0.0
                at = _both(moved[:, across], moved[:, up])
                if moved[:, [across, up]].any():
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


def _letter(components: FloatArray) -> str:
    return _LETTERS[int(np.argmax(np.abs(components).max(axis=0)))]


def _largest(components: FloatArray) -> FloatArray:
    """The component with the largest magnitude, shape (K,)."""
    return np.asarray(components[:, int(np.argmax(np.abs(components).max(axis=0)))])


def _line(name: str, time: FloatArray, values: FloatArray, style: tuple[Role, ChartForm], place: int) -> Trace:
    at = visible(values, _POINTS)
    return Trace(name, time[at], values[at], *style, record=place)


def _both(x: FloatArray, y: FloatArray) -> IndexArray:
    """Samples of a path that draw the same line."""
    return np.union1d(visible(x, _POINTS // 2), visible(y, _POINTS // 2))
