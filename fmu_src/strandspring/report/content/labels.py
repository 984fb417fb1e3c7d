"""Where the texts of points stand so that none lies over another text or over a mark."""

from __future__ import annotations

import itertools
import math

import numpy as np

from ...kernel.arrays import FloatArray
from .chart import Chart, ChartForm, Trace

# Where the middle of a text is from its point: sideways in halves of its length, upwards in lines.
_PLACES = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))
_BESIDE, _ABOVE = 1.2, 1.0  # from a point to the near end of its text [columns], or to its middle [lines]
_MARK, _DOT = (1.0, 0.5), (0.2, 0.1)  # half of a mark, and of a piece of a line [columns, lines]
_DRAWN = (ChartForm.LINE, ChartForm.DASHED, ChartForm.DOTTED)

_Place = tuple[int, int]
_Box = tuple[float, float, float, float]  # left, right, bottom, top


def label_places(chart: Chart, columns: float, lines: float) -> dict[int, list[_Place | None]]:
    """Places of the texts of each trace with labels, by its number, to the right and up; None where there is no room.

    Parameters
    ----------
    chart : Chart
    columns, lines : float    How many letters fit across the chart, and how many lines of text.
    """
    labelled = {number: trace for number, trace in enumerate(chart.traces) if trace.labelled}
    if not labelled:
        return {}
    marks = {
        number: _scaled(chart, trace, columns, lines)
        for number, trace in enumerate(chart.traces)
        if trace.labelled or trace.form is ChartForm.MARKS
    }
    for number, trace in enumerate(chart.traces):
        if trace.form in _DRAWN:
            marks.setdefault(number, _along(_scaled(chart, trace, columns, lines)))
    taken: list[_Box] = [
        (x - width, x + width, y - height, y + height)
        for number, places in marks.items()
        for width, height in (_DOT if chart.traces[number].form in _DRAWN else _MARK,)
        for x, y in places
    ]
    found: dict[int, list[_Place | None]] = {}
    for number, trace in labelled.items():
        found[number] = []
        for (x, y), text in zip(marks[number], trace.texts, strict=True):
            free = (
                (place, box)
                for place, box in ((place, _box_of(x, y, len(text), place)) for place in _PLACES)
                if box[0] >= 0.0 and box[1] <= columns and box[2] >= 0.0 and box[3] <= lines
                and not any(_overlap(box, other) for other in taken)
            )  # fmt: skip
            place, box = next(free, (None, None))
            found[number].append(place)
            if box is not None:
                taken.append(box)
    return found


def _box_of(x: float, y: float, length: int, place: _Place) -> _Box:
    across, up = place
    middle, height = x + across * (0.5 * length + _BESIDE), y + up * _ABOVE
    return (middle - 0.5 * length, middle + 0.5 * length, height - 0.5, height + 0.5)


def _along(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Points along the lines through points, about half a column apart; NaN interrupts a line."""
    return [
        (a + share * (c - a), b + share * (d - b))
        for (a, b), (c, d) in itertools.pairwise(points)
        if math.isfinite(a + b + c + d)
        for share in np.linspace(0.0, 1.0, 2 + int(2.0 * max(abs(c - a), 2.0 * abs(d - b)))).tolist()
    ]


def _overlap(one: _Box, other: _Box) -> bool:
    return one[0] < other[1] and other[0] < one[1] and one[2] < other[3] and other[2] < one[3]


def _scaled(chart: Chart, trace: Trace, columns: float, lines: float) -> list[tuple[float, float]]:
    """The points of a trace in columns and lines from the lower left corner of the chart."""
    (left, right), (bottom, top) = (_ends(chart, way) for way in "xy")
    across, up = columns / (right - left), lines / (top - bottom)
    if chart.is_drawing:
        # A column is about half as wide as a line is high; what is left of the room is at both sides.
        across = min(across, 2.0 * up)
        up = 0.5 * across
    x = 0.5 * columns + across * (trace.x - 0.5 * (left + right))
    y = 0.5 * lines + up * (trace.y - 0.5 * (bottom + top))
    return list(zip(x.tolist(), y.tolist(), strict=True))


def _ends(chart: Chart, way: str) -> tuple[float, float]:
    """Of an axis of a chart, with a margin; `way` is x or y."""
    axis = chart.x if way == "x" else chart.y
    values: FloatArray = np.concatenate([getattr(trace, way) for trace in chart.traces])
    low, high = axis.limits
    low = float(np.nanmin(values)) if low is None else low
    high = float(np.nanmax(values)) if high is None else high
    margin = 0.05 * (high - low) or 0.5 * math.fabs(high) or 1.0
    return low - margin, high + margin
