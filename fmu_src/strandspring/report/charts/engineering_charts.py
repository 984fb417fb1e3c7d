"""Charts of engineering figures: over the amplitude, and from cycle to cycle."""

from __future__ import annotations

import numpy as np

from ...loops.loop import PANELS, group_by_amplitude
from ..content.chart import Axis, Chart, ChartForm, Role, Trace
from ..content.quantities import NUMBER, number, percent, unit_of
from .engineering import KINDS, EngineeringFigures
from .evaluation import Evaluation, RecordView

_TREND_CYCLES = 400  # of a record, in the trend
# Attribute of LoopFigures, its name, kind of unit (a pure number if empty).
FIGURES = tuple((column.key, column.words, kind) for column, kind in zip(PANELS, KINDS, strict=True))
_TRENDS = (FIGURES[0], FIGURES[1], ("mean_force", "mean force", "force"))


def over_amplitude(evaluation: Evaluation, figures: EngineeringFigures) -> tuple[Chart, ...]:
    """Stiffness, energy and loss factor over the amplitude, measured and modelled, without those that have no value.

    A loop whose force does not rise on the whole has no loss factor.
    """
    charts = []
    for place, (name, text, kind) in enumerate(FIGURES):
        of_model = np.array([getattr(row, name) for row in figures.curve])
        defined = np.isfinite(of_model)
        if not defined.any():
            continue
        values = of_model[defined]
        measured = [row for row in figures.measured if np.isfinite(getattr(row.figures, name))]
        largest = np.max(np.abs([*values, *(getattr(row.figures, name) for row in measured)]))
        unit = unit_of(kind, float(largest)) if kind else NUMBER
        x = np.array([row.amplitude for row in figures.curve])[defined] * evaluation.length.factor
        traces = []
        if figures.curve_reach is not None:
            reach = figures.curve_reach[defined, place]
            known = np.isfinite(reach)
            ends = [(values + side * reach)[known] * unit.factor for side in (1.0, -1.0)]
            if known.any():
                traces.append(Trace("model, 95 % interval", x[known], ends[0], Role.MODEL, ChartForm.BAND, low=ends[1]))
        begin = min(int(np.searchsorted(x, figures.smallest_measured * evaluation.length.factor)), x.size - 1)
        shown = values * unit.factor
        traces.append(Trace("model about mid-range", x[begin:], shown[begin:], Role.MODEL))
        if begin:
            smaller = slice(0, begin + 1)
            traces.append(Trace("model, extrapolated", x[smaller], shown[smaller], Role.MODEL, ChartForm.DASHED))
        if measured:
            spread = np.array([0.0 if row.spread is None else getattr(row.spread, name) for row in measured])
            at = np.array([row.figures.amplitude for row in measured]) * evaluation.length.factor
            marks = np.array([getattr(row.figures, name) for row in measured])
            errors = spread * unit.factor if np.any(spread > 0.0) else None
            traces.append(Trace("measured", at, marks * unit.factor, Role.MEASURED, ChartForm.MARKS, error=errors))
        first, last = (float(v) * unit.factor for v in (values[0], values[-1]))
        sentence = (
            f"Model's {text} from {number(first, 3)} at {number(float(x[0]), 2)} {evaluation.length.name} to "
            f"{number(last, 3)} {unit.name} at {number(float(x[-1]), 3)} {evaluation.length.name}; "
            f"{_amplitudes(len(measured))}."
        ).replace("  ", " ")
        charts.append(
            Chart(f"amplitude-{name.replace('_', '-')}", f"{text.capitalize()} over amplitude",
                  Axis("amplitude", evaluation.length, limits=(0.0, None)), Axis(text, unit), tuple(traces), sentence)
        )  # fmt: skip
    return tuple(charts)


def _amplitudes(count: int) -> str:
    if not count:
        return "no full cycle was measured"
    return "measured at one amplitude" if count == 1 else f"measured at {count} amplitudes"


def trends(evaluation: Evaluation) -> tuple[Chart, ...]:
    """Stiffness, energy and mean force of each cycle, measured and predicted; empty without two cycles of a record."""
    views = [view for view in evaluation.shown if len(view.measured_cycles) > 1]
    if not views:
        return ()
    return tuple(_trend(evaluation, views, *figure) for figure in _TRENDS)


def _trend(evaluation: Evaluation, views: list[RecordView], name: str, text: str, kind: str) -> Chart:
    rows = []
    for view in views:
        both = zip(view.measured_cycles, view.predicted_cycles, strict=True)
        rows.append((view, np.array([[getattr(cycle.figures, name) for cycle in pair] for pair in both])))
    unit = (
        evaluation.force if kind == "force" else unit_of(kind, max(float(np.abs(values).max()) for _, values in rows))
    )
    traces, changes = [], []
    for view, values in rows:
        chosen = np.unique(np.linspace(0, len(values) - 1, min(len(values), _TREND_CYCLES)).round().astype(int))
        for column, (label, role) in enumerate((("measured", Role.MEASURED), ("model", Role.MODEL))):
            traces.append(
                Trace(label, chosen + 1.0, values[chosen, column] * unit.factor, role, ChartForm.MARKED_LINE,
                      record=view.place)
            )  # fmt: skip
        for group in group_by_amplitude(view.measured_cycles):
            alike = np.array([getattr(cycle.figures, name) for cycle in sorted(group, key=view.measured_cycles.index)])
            if alike.size > 1:
                changes.append(_drift(alike))
    sentence = f"{text.capitalize()} of each cycle, measured and predicted"
    if changes:
        most = " at most" if len(changes) > 1 else ""
        change = percent(max(changes, key=abs), sign=True)
        sentence += f"; from the first to the last cycle of one amplitude the measured one changes by {change}{most}"
    return Chart(
        f"trend-{name.replace('_', '-')}", f"{text.capitalize()} of each cycle", Axis("cycle", NUMBER, whole=True),
        Axis(text, unit), tuple(traces), f"{sentence}.", single=True,
    )  # fmt: skip


def _drift(values: np.ndarray) -> float:
    """Change from the first to the last value, as a share of the mean."""
    scale = float(np.mean(np.abs(values)))
    return float(values[-1] - values[0]) / scale if scale else 0.0
