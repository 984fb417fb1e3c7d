"""Charts of verdicts: figures beside their limits, and the way of the springs in their ranges."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...vibration.verdicts.answers import CaseAnswer, overall_verdicts
from ...vibration.verdicts.verdicts import CaseVerdict, FigureKind
from ..content.chart import Axis, Chart, ChartForm, Role, Trace
from ..content.quantities import MM, NUMBER, PERCENT, DisplayUnit, G, number, percent, span

_COLOURS = (Role.FIRST, Role.SECOND, Role.THIRD, Role.LOAD, Role.REFERENCE)
_MOST_ANSWERS = 40  # beside their limits
_MOST_BARS = 18  # axes of an answer, those that use most of their ranges


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
    traces = []
    for k, of_kind in enumerate(kinds):
        x = np.array([place for place, _ in of_kind]) + 0.6 * ((k + 0.5) / len(kinds) - 0.5)
        low, high = 100.0 * np.array([[one.low / one.limit, one.high / one.limit] for _, one in of_kind if one.limit]).T
        role = _COLOURS[k % len(_COLOURS)]
        traces.append(Trace(of_kind[0][1].quantity.value, x, high, role, ChartForm.RANGES, low=low))
    ends = np.array([0.5, len(shown) + 0.5])
    traces.append(Trace("limit", ends, np.full(2, 100.0), Role.LIMIT, ChartForm.DASHED))
    more = len(shares) - len(shown)
    left = f" {more} answers farther from their limits are left out." if more else ""
    names = tuple(f"{answer.candidate}, {answer.case.name}" for answer in shown)
    return Chart(
        "limits", "Figures beside their limits", Axis("", NUMBER, names=names),
        Axis("share of the limit", PERCENT, limits=(0.0, None)), tuple(traces),
        "Of each kind of figure the one nearest to its limit, with the range that the verdict takes: below the line it "
        f"passes, above it fails, across it nothing is decided.{left}", wide=True,
    )  # fmt: skip


def acceleration_against_stroke(answers: Sequence[CaseAnswer]) -> Chart:
    """One mark for each case with the figure that decides, and a cross with the verdict where it does not pass; one
    colour for each candidate, which the legend names with the verdict on all cases together.
    """
    traces, order = [], list(CaseVerdict)
    for k, (candidate, verdict) in enumerate(overall_verdicts(answers).items()):
        of_one = sorted(
            (answer for answer in answers if answer.candidate == candidate),
            key=lambda answer: (-order.index(answer.verdict), -answer.severity),
        )
        figure = _deciding(of_one[0])
        name = f"{candidate}: {verdict.value}{figure and f', {figure} of its limit in {of_one[0].case.name}'}"
        for form in (ChartForm.CROSSES, ChartForm.MARKS):
            marks = [mark for answer in of_one for mark in _marks(answer, form)]
            x, y = np.array([mark[:2] for mark in marks]).reshape(-1, 2).T
            texts = tuple(text for _, _, text in marks)
            traces.append(Trace(name, x, y, _COLOURS[k % len(_COLOURS)], form, texts=texts))
    strokes, accelerations = (
        sorted({figure.limit * unit.factor for answer in answers for figure in answer.figures_of(kind) if figure.limit})
        for kind, unit in ((FigureKind.STROKE, PERCENT), (FigureKind.ACCELERATION, G))
    )
    right = max([*(x for trace in traces for x in trace.x.tolist()), *strokes])
    top = max([*(y for trace in traces for y in trace.y.tolist()), *accelerations])
    for limit in strokes:
        x, y = np.full(2, limit), np.array([0.0, 1.05 * top])
        traces.append(Trace(f"limit of stroke, {number(limit)} %", x, y, Role.LIMIT, ChartForm.DASHED))
    for limit in accelerations:
        x, y = np.array([0.0, 1.05 * right]), np.full(2, limit)
        traces.append(Trace(f"limit of a point, {number(limit)} g", x, y, Role.LIMIT, ChartForm.DOTTED))
    return Chart(
        "sheet", "Acceleration against stroke", Axis("stroke", PERCENT, limits=(0.0, 1.05 * right or 1.0)),
        Axis("acceleration", G, limits=(0.0, 1.05 * top or 1.0)), tuple(traces),
        "Each mark is a load case: largest acceleration of the worst point, and largest share of a spring's way "
        "from rest to the end of its identified range.", wide=True,
    )  # fmt: skip


def _deciding(answer: CaseAnswer) -> str:
    """The figure that is nearest to its limit, and its share of that; empty without one."""
    nearest = answer.nearest_limit
    return "" if nearest is None else f"{nearest.quantity.value} {percent(nearest.share, 3)}"


def _marks(answer: CaseAnswer, form: ChartForm) -> Iterator[tuple[float, float, str]]:
    """Stroke [%] and acceleration [g] of an answer of this form, if it has both, and what it is."""
    stroke, acceleration = answer.worst(FigureKind.STROKE), answer.worst(FigureKind.ACCELERATION)
    passes = answer.verdict in (CaseVerdict.NO_LIMITS, CaseVerdict.PASSES)
    if stroke and acceleration and math.isfinite(stroke.high) and passes == (form is ChartForm.MARKS):
        words = f"{answer.case.name}: {'' if passes else f'{answer.verdict.value}, '}{_deciding(answer)}"
        yield PERCENT.factor * stroke.high, G.factor * acceleration.high, words


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
        Axis("displacement", MM),
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
    low, high, rest = (MM.factor * values[chosen] for values in (first.low, first.high, first.rest))
    lowest = MM.factor * np.min([use.lowest for use in answer.uses], axis=0)[chosen]
    highest = MM.factor * np.max([use.highest for use in answer.uses], axis=0)[chosen]
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
            f"limit, {number(PERCENT.factor * limit)} % of the way from rest",
            np.column_stack([x - 0.4, x + 0.4, gap]).ravel(), np.column_stack([along, along, gap]).ravel(),
            Role.LIMIT, ChartForm.LINE, record=place,
        )  # fmt: skip
