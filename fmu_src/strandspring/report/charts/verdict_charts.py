"""Charts of verdicts: acceleration against stroke of all answers, and the way of the springs of one in their ranges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...ground.gravity import STANDARD_GRAVITY
from ...vibration.verdicts.answers import CaseAnswer
from ...vibration.verdicts.verdicts import FigureKind
from ..content.chart import Axis, Chart, ChartForm, Role, Trace
from ..content.quantities import NUMBER, DisplayUnit, number, span

_G, _MM, _PERCENT = DisplayUnit("g", 1.0 / STANDARD_GRAVITY), DisplayUnit("mm", 1e3), DisplayUnit("%", 100.0)
_COLOURS = (Role.FIRST, Role.MODEL, Role.SECOND, Role.THIRD, Role.MEASURED)
_MOST_BARS = 18  # axes of an answer, those that use most of their ranges


def acceleration_against_stroke(answers: Sequence[CaseAnswer]) -> Chart:
    """One mark for each case with its name, one colour for each candidate."""
    traces = []
    marks: list[tuple[float, float, CaseAnswer]] = []
    for k, candidate in enumerate(dict.fromkeys(answer.candidate for answer in answers)):
        of_candidate = [mark for answer in answers if answer.candidate == candidate for mark in _marks(answer)]
        if of_candidate:
            texts = tuple(answer.case.name for _, _, answer in of_candidate)
            x, y = np.array([mark[:2] for mark in of_candidate]).T
            colour = _COLOURS[k % len(_COLOURS)]
            traces.append(Trace(candidate, x, y, colour, ChartForm.MARKS, texts=texts, labelled=True))
        marks += of_candidate
    limits = {
        quantity: sorted({figure.limit for answer in answers for figure in answer.figures_of(quantity) if figure.limit})
        for quantity in (FigureKind.STROKE, FigureKind.ACCELERATION)
    }
    right = top = 1.0
    if marks:
        strokes, accelerations = (
            [_PERCENT.factor * limit for limit in limits[FigureKind.STROKE]],
            [_G.factor * limit for limit in limits[FigureKind.ACCELERATION]],
        )
        right = 1.05 * max(*(mark[0] for mark in marks), *strokes)
        top = 1.05 * max([*(mark[1] for mark in marks), *accelerations])
        for limit in strokes:
            x, y = np.full(2, limit), np.array([0.0, top])
            traces.append(Trace(f"limit of stroke, {number(limit)} %", x, y, Role.LIMIT, ChartForm.DASHED))
        for limit in accelerations:
            x, y = np.array([0.0, right]), np.full(2, limit)
            traces.append(Trace(f"limit of a point, {number(limit)} g", x, y, Role.LIMIT, ChartForm.DOTTED))
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
        Axis("stroke", _PERCENT, limits=(0.0, right)), Axis("acceleration", _G, limits=(0.0, top)),
        tuple(traces), sentence, wide=True,
    )  # fmt: skip


def _marks(answer: CaseAnswer) -> Iterator[tuple[float, float, CaseAnswer]]:
    """Stroke [%] and acceleration [g] of an answer, if it has both."""
    stroke, acceleration = answer.worst(FigureKind.STROKE), answer.worst(FigureKind.ACCELERATION)
    if stroke is not None and acceleration is not None and math.isfinite(stroke.high):
        yield _PERCENT.factor * stroke.high, _G.factor * acceleration.high, answer


def strokes(answers: Mapping[int, CaseAnswer]) -> Chart:
    """Where the springs of each axis rest and move within their identified ranges."""
    shares: dict[str, float] = {}
    for answer in answers.values():
        largest = np.max([np.nan_to_num(use.share, posinf=math.inf) for use in answer.uses], axis=0)
        for name, share in zip(answer.system.axis_names, largest.tolist(), strict=True):
            shares[name] = max(share, shares.get(name, 0.0))
    most = set(sorted(shares, key=lambda name: -shares[name])[:_MOST_BARS])
    places = {name: 1.0 + k for k, name in enumerate(name for name in shares if name in most)}
    left = (
        f" {len(shares) - len(places)} axes that use less of theirs are left out." if len(shares) > len(places) else ""
    )
    return Chart(
        "strokes", "Stroke beside its limit", Axis("", NUMBER, names=tuple(places)),
        Axis("displacement", DisplayUnit("mm")),
        tuple(trace for place, answer in answers.items() for trace in _strokes(answer, place, places)),
        f"From the least to the largest displacement of a spring in any run, as its model counts.{left}", wide=True,
        single=True,
    )  # fmt: skip


def _strokes(answer: CaseAnswer, place: int, places: Mapping[str, float]) -> Iterator[Trace]:
    """The ranges of an answer, how far they were used, where they are at rest, and the limits."""
    names = answer.system.axis_names
    chosen = [k for k, name in enumerate(names) if name in places]
    x = np.array([places[names[k]] for k in chosen])
    first = answer.uses[0]
    low, high, rest = (_MM.factor * values[chosen] for values in (first.low, first.high, first.rest))
    lowest = _MM.factor * np.min([use.lowest for use in answer.uses], axis=0)[chosen]
    highest = _MM.factor * np.max([use.highest for use in answer.uses], axis=0)[chosen]
    for name, ends, role, width in (
        ("identified range", (low, high), Role.LEFT_OUT, 0.8), ("reached", (lowest, highest), Role.FIRST, 0.5),
    ):  # fmt: skip
        texts = tuple(f"{name} {span(a, b, DisplayUnit('mm'))}" for a, b in zip(*ends, strict=True))
        yield Trace(name, x, ends[1], role, ChartForm.BARS, low=ends[0], width=width, texts=texts, record=place)
    yield Trace("at rest", x, rest, Role.MEASURED, ChartForm.MARKS, record=place)
    limit = next((figure.limit for figure in answer.figures_of(FigureKind.STROKE) if figure.limit), 1.0)
    gap = np.full(x.size, np.nan)
    for end in (low, high):
        along = rest + limit * (end - rest)
        yield Trace(
            f"limit, {number(_PERCENT.factor * limit)} % of the way from rest",
            np.column_stack([x - 0.4, x + 0.4, gap]).ravel(), np.column_stack([along, along, gap]).ravel(),
            Role.LIMIT, ChartForm.LINE, record=place,
        )  # fmt: skip
