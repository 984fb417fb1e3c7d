"""Engineering figures of a spring: by amplitude, measured with their scatter and modelled with their 95 % interval, and
from cycle to cycle."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import ModelError
from ...findings import Outcome
from ...identification.identified import IdentifiedModel
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...loops.cycles import MeasuredLoop
from ...loops.loop import PANELS, LoopFigures, group_by_amplitude, steady_loop
from ...model.joint import NORMAL_95, JointCovariance
from ..content.chart import Axis, Chart, ChartForm, Role, Trace, evenly
from ..content.quantities import NUMBER, number, percent, unit_of
from .evaluation import Evaluation, RecordView

KINDS = ("stiffness", "energy", "")  # of their units; empty of pure numbers
# Attribute of LoopFigures, its name, kind of unit.
FIGURES = tuple((column.key, column.words, kind) for column, kind in zip(PANELS, KINDS, strict=True))
NAMES = tuple(name for name, _, _ in FIGURES)
_TRENDS = (FIGURES[0], FIGURES[1], ("mean_force", "mean force", "force"))
_TREND_CYCLES = 400  # of a record, in the trend
_TREND_RANGE = 0.1  # least height of a trend, share of the mean
_NEARLY = 0.9  # share of an amplitude that counts as that amplitude
_SHARES = np.linspace(0.05, 1.0, 20)  # amplitudes of the model's curve, of half the identified range
_MOST = 12  # amplitudes in the table


@dataclass(frozen=True)
class AmplitudeComparison:
    """One amplitude.

    Attributes
    ----------
    low, high : float                  Turning points [m].
    model : LoopFigures                The model's steady loop between them.
    reach : tuple of float or None     Half of the 95 % interval of the model's `NAMES`; None if unknown.
    measured : MeasuredLoop or None None where nothing was measured.
    """

    low: float
    high: float
    model: LoopFigures
    reach: tuple[float, ...] | None
    measured: MeasuredLoop | None


class EngineeringFigures:
    """Stiffness, energy and loss factor of a spring.

    Parameters
    ----------
    evaluation : Evaluation
    """

    def __init__(self, evaluation: Evaluation) -> None:
        self._evaluation = evaluation

    @cached_property
    def measured(self) -> tuple[MeasuredLoop, ...]:
        """The full cycles of all records, by amplitude and rate."""
        return tuple(loop for loop in self._evaluation.identification.recorded if loop.cycles)

    @cached_property
    def table(self) -> tuple[AmplitudeComparison, ...]:
        """The measured amplitudes, evenly chosen of many, and quarters of the identified range where none is near."""
        p = self._evaluation.identification.parameters
        chosen = [self.measured[k] for k in evenly(len(self.measured), _MOST)]
        rows: list[tuple[float, float, MeasuredLoop | None]] = [
            (row.figures.low, row.figures.high, row) for row in chosen
        ]
        half = 0.5 * (p.displacement_max - p.displacement_min)
        middle = 0.5 * (p.displacement_max + p.displacement_min)
        for share in (0.25, 0.5, 0.75, 1.0):
            if all(abs(0.5 * (high - low) / (share * half) - 1.0) > 0.1 for low, high, _ in rows):
                rows.append((middle - share * half, middle + share * half, None))
        rows.sort(key=lambda row: row[1] - row[0])
        ends = [(low, high) for low, high, _ in rows]
        reach = self._reach(ends)
        return tuple(
            AmplitudeComparison(low, high, steady_loop(self._evaluation.solver, low, high).figures,
                       None if reach is None or np.isnan(reach[k]).any() else tuple(reach[k].tolist()), measured)
            for k, (low, high, measured) in enumerate(rows)
        )  # fmt: skip

    @cached_property
    def smallest_measured(self) -> float:
        """Amplitude below which loops are extrapolated [m]; infinite if none was measured."""
        return _NEARLY * min((row.figures.amplitude for row in self.measured), default=math.inf)

    @property
    def largest(self) -> AmplitudeComparison:
        """The largest amplitude that was measured; of the model only if there is none."""
        return max(self.table, key=lambda row: (row.measured is not None, row.high - row.low))

    @cached_property
    def _curve_ends(self) -> list[tuple[float, float]]:
        p = self._evaluation.identification.parameters
        middle = 0.5 * (p.displacement_max + p.displacement_min)
        half = 0.5 * (p.displacement_max - p.displacement_min)
        return [(middle - share * half, middle + share * half) for share in _SHARES.tolist()]

    @cached_property
    def curve(self) -> tuple[LoopFigures, ...]:
        """The model's figures over the amplitude, about the middle of the identified range."""
        return tuple(steady_loop(self._evaluation.solver, *ends).figures for ends in self._curve_ends)

    @cached_property
    def curve_reach(self) -> FloatArray | None:
        """Half of their 95 % intervals, shape (A, 3); None if unknown."""
        return self._reach(self._curve_ends)

    def _reach(self, ends: list[tuple[float, float]]) -> FloatArray | None:
        """Half of the 95 % interval of `NAMES` for loops between these turning points, shape (L, 3).

        NaN for loops smaller than the recorded ones where the records do not decide them: another minimum may fit about
        as well, of which the covariance at this one says nothing.
        """
        whole: IdentifiedModel = self._evaluation.identification
        joint = JointCovariance.from_uncertainty(whole.parameters, whole.uncertainty)
        if joint is None:
            return None
        try:
            reach = NORMAL_95 * joint.errors(whole.parameters, lambda moved: _figures(PathSolver(moved), ends))
        except ModelError:  # next to it there is no spring any more
            return None
        if {Outcome.SMALL_LOOPS, Outcome.ONE_AMPLITUDE} & {*whole.outcomes}:
            amplitudes = np.array([0.5 * (high - low) for low, high in ends])
            reach[amplitudes < self.smallest_measured] = np.nan
        return reach


def _figures(solver: PathSolver, ends: list[tuple[float, float]]) -> FloatArray:
    loops = [steady_loop(solver, *pair).figures for pair in ends]
    return np.array([[getattr(figures, name) for name in NAMES] for figures in loops])


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
        ends_words = (
            f"{number(float(shown[k]), 3)} {unit.name} at {number(float(x[k]), 3)} {evaluation.length.name}"
            for k in (0, -1)
        )
        count = {0: "no full cycle was measured", 1: "measured at one amplitude"}
        sentence = (
            f"Model's {text} from {' to '.join(ends_words)}; "
            f"{count.get(len(measured), f'measured at {len(measured)} amplitudes')}."
        ).replace("  ", " ")
        charts.append(
            Chart(f"amplitude-{name.replace('_', '-')}", f"{text.capitalize()} over amplitude",
                  Axis("amplitude", evaluation.length, limits=(0.0, None)), Axis(text, unit), tuple(traces), sentence)
        )  # fmt: skip
    return tuple(charts)


def trends(evaluation: Evaluation) -> tuple[Chart, ...]:
    """Stiffness, energy and mean force of each cycle, measured and predicted; empty without two cycles of a record."""
    views = [view for view in evaluation.shown if len(view.measured_cycles) > 1]
    return tuple(_trend(evaluation, views, *figure) for figure in _TRENDS) if views else ()


def _trend(evaluation: Evaluation, views: list[RecordView], name: str, text: str, kind: str) -> Chart:
    rows, changes = [], []
    for view in views:
        measured, predicted = (
            np.array([getattr(cycle.figures, name) for cycle in cycles])
            for cycles in (view.measured_cycles, view.predicted_cycles)
        )
        rows.append((view.place, evenly(measured.size, _TREND_CYCLES), measured, predicted))
        for group in group_by_amplitude(view.measured_cycles):
            alike = measured[sorted(map(view.measured_cycles.index, group))]
            if alike.size > 1 and alike.any():
                changes.append(float((alike[-1] - alike[0]) / np.mean(np.abs(alike))))
    everything = np.concatenate([values for _, _, *both in rows for values in both])
    unit = evaluation.force if kind == "force" else unit_of(kind, float(np.abs(everything).max()))
    traces = [
        Trace(label, np.array(at) + 1.0, values[at] * unit.factor, role, ChartForm.MARKED_LINE, record=place)
        for place, at, *both in rows
        for label, role, values in zip(("measured", "model"), (Role.MEASURED, Role.MODEL), both, strict=True)
    ]
    low, high = unit.factor * float(everything.min()), unit.factor * float(everything.max())
    middle, least = 0.5 * (low + high), 0.5 * _TREND_RANGE * abs(low + high)
    # What hardly changes is not drawn at full height.
    limits = (middle - 0.5 * least, middle + 0.5 * least) if high - low < least else (None, None)
    sentence = f"{text.capitalize()} of each cycle, measured and predicted"
    if changes:
        most = " at most" if len(changes) > 1 else ""
        change = percent(max(changes, key=abs), sign=True)
        sentence += f"; from the first to the last cycle of one amplitude the measured one changes by {change}{most}"
    return Chart(
        f"trend-{name.replace('_', '-')}", f"{text.capitalize()} of each cycle", Axis("cycle", NUMBER, whole=True),
        Axis(text, unit, limits=limits), tuple(traces), f"{sentence}.", single=True,
    )  # fmt: skip
