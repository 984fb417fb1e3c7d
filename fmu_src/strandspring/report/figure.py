"""Charts of an identification: on its report, and for papers and notebooks in given axes or a file.

Each function makes a chart from an `Evaluation`, or None where there is nothing to show, or a sentence that says why.

Examples
--------
>>> import numpy as np
>>> from strandspring import Record, identify
>>> from strandspring.report.figure import plot_chart
>>> x = 0.02 * np.sin(np.linspace(0.0, 6 * np.pi, 900))
>>> spring_force = 2e3 * x + 10.0 * np.tanh(500.0 * (x + 0.004 * np.sign(np.gradient(x))))
>>> axes = plot_chart(identify(Record(x, spring_force)), "branches")
>>> axes.get_xlabel()
'displacement [mm]'
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core.parameters import SpringParameters
from ..errors import IsolationError, StrandspringError
from ..ground.gravity import STANDARD_GRAVITY
from ..ground.plotfile import SUFFIXES, save_figure, some_axes
from ..identification.figures import autocorrelation_time
from ..identification.identified import IdentifiedModel
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.loop import PANELS, group_by_amplitude
from ..model.joint import HYSTERETIC_UNITS, NORMAL_95, ForceInterval, JointCovariance, names_of
from ..vibration.one_mass.band import band_frequencies
from ..vibration.one_mass.options import DEFAULT_SHARES, Excitation
from ..vibration.one_mass.response import frequency_response
from ..vibration.one_mass.system import IsolatedMass, free_travel, static_equilibrium
from . import drawing
from .drawing import STYLE, Chart, band, bars, dots, evenly, line, marks, name_axes, visible
from .evaluation import SHOWN_RECORDS, Evaluation, RecordView
from .quantities import HZ, NUMBER, DisplayUnit, S, number, percent, span, unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Drawing = Callable[["Axes", int | None], None]
COLUMN = 88.0 / 25.4  # width of a column of a journal [inches]
_RESOLUTION = 600  # of a PNG [dots per inch]
_DOTS = 2500  # of a record
_BINS, _LAGS = (15, 60), 400  # of the histogram, and of the autocorrelation at most
_MODEL_POINTS, _BAND_POINTS = 401, 150
_GRADES = 20  # of the opacity of a correlation
_CLOSED = 0.05  # difference of the ends of a closed loop, share of its stroke
_TREND_CYCLES, _TREND_RANGE = 400, 0.1  # of a record, and least height, share of the mean
_PLACES = (0.5, 0.6, 0.4, 0.7, 0.3, 0.8, 0.2)  # where in the range a mass is tried to rest, by preference


def loops(evaluation: Evaluation) -> Chart:
    """Measured and predicted loops over each other."""
    length, force = evaluation.length, evaluation.force

    def draw(axes: Axes, record: int | None) -> None:
        for view in evaluation.of(record):
            x = length.factor * view.record.displacement
            _not_compared(axes, view, x, force)
            _over_cycles(axes, view, x, force.factor * view.record.force, "measured", "measured", lw=1.3)
        for view in evaluation.of(record):
            x = length.factor * view.record.displacement
            if view.differs:
                _over_cycles(axes, view, x, force.factor * view.fitted.predicted, "as fitted", "faint", "--")
            _over_cycles(axes, view, x, force.factor * view.fit.predicted, "model", "model")
        name_axes(axes, ("displacement", length), ("force", force))

    whole = evaluation.identification
    parts = []
    if len(evaluation.shown) < len(evaluation.views):
        parts.append(f"{SHOWN_RECORDS} of {len(evaluation.views)} records")
    if any(len(view.in_cycles(view.record.force)) < len(view.cycles) for view in evaluation.shown):
        parts.append("some of the many cycles")
    fitted = f" As fitted: {evaluation.beside}." if any(view.differs for view in evaluation.shown) else ""
    drawn = f" Drawn are {' and '.join(parts)}, evenly chosen." if parts else ""
    sentence = (
        "Measured force, and that of the saved spring alone along the displacement as recorded; rms error "
        f"{force.text(whole.rmse, 3)}, RNL {number(whole.rnl, 4)}.{fitted}{drawn}"
    )
    return Chart("loops", "Measured and predicted loops", sentence, draw, wide=True)


def _over_cycles(
    axes: Axes, view: RecordView, x: FloatArray, y: FloatArray, name: str, colour: str, style: str = "-",
    lw: float = 0.9,
) -> None:  # fmt: skip
    """Lines over the displacement, of a few cycles, in display units."""
    y = np.where(view.within, y, np.nan)
    for at in view.in_cycles(y):
        line(axes, x[at], y[at], name, colour, style, record=view.place, lw=lw)


def _not_compared(axes: Axes, view: RecordView, x: FloatArray, force: DisplayUnit) -> None:
    """What is drawn faintly, as it is not compared, at least in part."""
    end = None if not view.within.all() else view.first + 1
    if end is None or view.first:
        at = visible(view.record.force[:end], view.points)
        line(axes, x[at], force.factor * view.record.force[at], "not compared", "faint", record=view.place)


def _along(evaluation: Evaluation) -> tuple[tuple[str, DisplayUnit], Callable[[RecordView], FloatArray]]:
    """The axis along the records, and a record's values: times, or numbers if one of them has no rising times."""

    def times(view: RecordView) -> FloatArray:
        time = view.record.rising_time
        return np.arange(1.0, len(view.record) + 1.0) if time is None or not is_timed else time - time[0]

    is_timed = all(view.record.rising_time is not None for view in evaluation.views)
    return ("time", S) if is_timed else ("sample number", NUMBER), times


def force(evaluation: Evaluation) -> Chart:
    """Measured and predicted force along the record."""
    axis, times = _along(evaluation)
    unit = evaluation.force

    def draw(axes: Axes, record: int | None) -> None:
        for view in evaluation.of(record):
            _not_compared(axes, view, times(view), unit)
            for name, values, lw in (("measured", view.record.force, 1.3), ("model", view.fit.predicted, 0.9)):
                _line_along(axes, view, times(view), unit.factor * values, name, name, lw)
        name_axes(axes, axis, ("force", unit))

    samples = sum(view.fit.samples for view in evaluation.views)
    sentence = (
        f"Measured and predicted force over {axis[0]}; {samples} of {sum(len(v.record) for v in evaluation.views)} "
        "samples are compared."
    )
    return Chart("force", f"Force over {axis[0]}", sentence, draw, wide=True, records=evaluation.places)


def _line_along(
    axes: Axes, view: RecordView, x: FloatArray, y: FloatArray, name: str, colour: str, lw: float = 0.9
) -> None:
    """A line along the part compared."""
    at = view.first + visible(np.where(view.within, y, np.nan)[view.first :], view.points)
    line(axes, x[at], np.where(view.within, y, np.nan)[at], name, colour, record=view.place, lw=lw)


def residuals_over_displacement(evaluation: Evaluation) -> Chart:
    """Residuals over displacement, loading and unloading apart."""
    length, unit = evaluation.length, evaluation.residual

    def draw(axes: Axes, record: int | None) -> None:
        for view in evaluation.of(record):
            is_loading = view.of_compared(view.strokes.direction[view.strokes.of_sample].astype(float)) > 0.0
            x, residual = length.factor * view.of_compared(view.record.displacement), unit.factor * view.compared
            for name, colour, own in (("loading", "blue", is_loading), ("unloading", "green", ~is_loading)):
                at = np.flatnonzero(own)
                at = at[visible(residual[at], min(view.points, _DOTS) // 2)] if at.size else at
                dots(axes, x[at], residual[at], name, colour, record=view.place)
        name_axes(axes, ("displacement", length), ("measured − model", unit))

    sentence = f"Residual force over displacement. {_misfit(evaluation)}"
    return Chart("residuals-displacement", "Residuals over displacement", sentence, draw, records=evaluation.places)


def _misfit(evaluation: Evaluation) -> str:
    rms, largest = evaluation.identification.rmse, evaluation.largest_residual
    return (
        f"The rms residual is {evaluation.residual.text(rms, 3)}, the largest {evaluation.residual.text(largest, 3)}."
    )


def residuals_over_velocity(evaluation: Evaluation) -> Chart | None:
    """Residuals over velocity; None without times."""
    views = {
        view.place: (view, view.of_compared(view.velocity)) for view in evaluation.shown if view.velocity is not None
    }
    if not views:
        return None
    fastest = max(float(np.abs(velocity).max()) for _, velocity in views.values())
    unit = unit_of("velocity", fastest)
    slopes = []
    for view, velocity in views.values():
        spread = float(np.std(velocity) * np.std(view.compared))
        slopes.append(float(np.mean((velocity - velocity.mean()) * view.compared)) / spread if spread else 0.0)

    def draw(axes: Axes, record: int | None) -> None:
        for view, velocity in views.values():
            if record in (None, view.place):
                at = visible(view.compared, min(view.points, _DOTS))
                x, y = unit.factor * velocity[at], evaluation.residual.factor * view.compared[at]
                dots(axes, x, y, "residual", "blue", record=view.place)
        name_axes(axes, ("velocity", unit), ("measured − model", evaluation.residual))

    sentence = (
        f"Residual force over velocity, up to {unit.text(fastest, 3)}; their correlation is "
        f"{number(max(slopes, key=abs), 2)}{' at most' if len(slopes) > 1 else ''} (0 if no viscous force was left "
        "out)."
    )
    return Chart("residuals-velocity", "Residuals over velocity", sentence, draw, records=[*views])


def residuals_over_time(evaluation: Evaluation) -> Chart:
    """Residuals along the record."""
    axis, times = _along(evaluation)
    unit = evaluation.residual

    def draw(axes: Axes, record: int | None) -> None:
        for view in evaluation.of(record):
            _line_along(axes, view, times(view), unit.factor * view.residuals, "residual", "blue")
        name_axes(axes, axis, ("measured − model", unit))

    sentence = f"Residual force over {axis[0]}. {_misfit(evaluation)}"
    return Chart("residuals-time", f"Residuals over {axis[0]}", sentence, draw, wide=True, records=evaluation.places)


def histogram(evaluation: Evaluation) -> Chart:
    """Distribution of the residuals beside the normal one."""
    unit = evaluation.residual

    def draw(axes: Axes, record: int | None) -> None:
        for view in evaluation.of(record):
            values = unit.factor * view.compared
            mean, deviation = float(values.mean()), max(float(values.std()), 1e-300)
            reach = max(4.0 * deviation, 1e-12)
            count = int(np.clip(round(2.0 * values.size ** (1 / 3)), *_BINS))
            edges = np.linspace(mean - reach, mean + reach, count + 1)
            width = float(edges[1] - edges[0])
            heights = np.histogram(np.clip(values, edges[0], edges[-1]), edges)[0] / (values.size * width)
            middles = 0.5 * (edges[1:] + edges[:-1])
            bars(axes, middles, 0.0, heights, "residuals", "blue", width, record=view.place)
            grid = np.linspace(edges[0], edges[-1], 121)
            normal = np.exp(-0.5 * ((grid - mean) / deviation) ** 2) / (deviation * math.sqrt(2.0 * math.pi))
            line(axes, grid, normal, "normal distribution", "measured", record=view.place)
        name_axes(axes, ("measured − model", unit), ("density", DisplayUnit(f"1/{density}")))

    density = f"({unit.name})" if " " in unit.name else unit.name
    deviations = [np.abs(view.compared - view.compared.mean()) for view in evaluation.shown]
    outside = [float(np.mean(values > 2.0 * np.sqrt(np.mean(values**2)))) for values in deviations]
    sentence = (
        f"Distribution of the residuals; {percent(max(outside))} of them lie beyond two standard deviations"
        f"{' at most' if len(outside) > 1 else ''} (4.6 % of normally distributed ones would)."
    )
    return Chart("histogram", "Distribution of the residuals", sentence, draw, records=evaluation.places)


def autocorrelation(evaluation: Evaluation) -> Chart:
    """Correlation of residuals with later ones."""
    times = {view.place: autocorrelation_time(view.compared - view.compared.mean()) for view in evaluation.shown}

    def draw(axes: Axes, record: int | None) -> None:
        for view in evaluation.of(record):
            values = view.compared - view.compared.mean()
            lags = int(np.clip(6.0 * times[view.place], 20, min(_LAGS, max(values.size // 3, 2))))
            spectrum = np.abs(np.fft.rfft(values, 1 << (2 * values.size - 1).bit_length())) ** 2
            correlation = np.fft.irfft(spectrum)[: lags + 1]
            reach, lag = 1.96 / math.sqrt(values.size), np.arange(lags + 1.0)
            band(axes, lag, -reach, reach, "95 % of white noise", "muted")
            line(axes, lag, correlation / max(float(correlation[0]), 1e-300), "residuals", "blue", record=view.place)
        name_axes(axes, ("lag", DisplayUnit("samples")), ("autocorrelation", NUMBER))

    sentence = (
        f"Autocorrelation of the residuals; the integrated autocorrelation time is {number(max(times.values()), 2)}"
        f"{' at most' if len(times) > 1 else ''} in samples, and 1 for white noise."
    )
    return Chart("autocorrelation", "Autocorrelation of the residuals", sentence, draw, records=evaluation.places)


def _parts(evaluation: Evaluation) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Displacements over the identified range [m], FE [N] and the saturated hysteretic force [N] there."""
    p = evaluation.identification.parameters
    x = np.linspace(p.displacement_min, p.displacement_max, _MODEL_POINTS)
    elastic = evaluation.solver.force_with_partials(x, np.zeros(x.size))[0]
    return x, elastic, evaluation.solver.force_with_partials(x, np.ones(x.size))[0] - elastic


def branches(evaluation: Evaluation) -> Chart:
    """Elastic force and saturated branches."""
    x, elastic, hysteretic = _parts(evaluation)
    unit = evaluation.force

    def draw(axes: Axes, _record: int | None) -> None:
        for values, name, colour in (
            (elastic + hysteretic, "loading, saturated", "blue"), (elastic, "elastic force FE", "model"),
            (elastic - hysteretic, "unloading, saturated", "green"),
        ):  # fmt: skip
            line(axes, evaluation.length.factor * x, unit.factor * values, name, colour)
        name_axes(axes, ("displacement", evaluation.length), ("force", unit))

    sentence = (
        f"Elastic force FE from {span(float(elastic.min()), float(elastic.max()), unit)}, between the branches that "
        f"long strokes approach; they are {unit.text(2.0 * float(np.mean(hysteretic)), 3)} apart in the mean."
    )
    return Chart("branches", "Elastic force and saturated branches", sentence, draw)


def amplifier(evaluation: Evaluation) -> Chart:
    """The amplifier FA."""
    x, _, hysteretic = _parts(evaluation)
    values = hysteretic / evaluation.identification.parameters.kappa_omega

    def draw(axes: Axes, _record: int | None) -> None:
        line(axes, evaluation.length.factor * x, values, "FA", "model")
        axes.set_ylim(bottom=0.0)
        name_axes(axes, ("displacement", evaluation.length), ("FA", NUMBER))

    sentence = (
        f"Amplifier FA of the hysteretic force, 1 at the middle of the range; from {number(float(values.min()), 3)} to "
        f"{number(float(values.max()), 3)}."
    )
    return Chart("amplifier", "Amplifier of the hysteretic force", sentence, draw)


def omega(evaluation: Evaluation) -> Chart:
    """The normalized hysteretic variable along the records."""
    solver = evaluation.solver
    along = {view.place: solver.omega(view.record.displacement, view.fit.omega_start) for view in evaluation.shown}

    def draw(axes: Axes, record: int | None) -> None:
        for view in evaluation.of(record):
            x = evaluation.length.factor * view.record.displacement
            _over_cycles(axes, view, x, along[view.place], "omega", "model")
        name_axes(axes, ("displacement", evaluation.length), ("omega", NUMBER))

    largest = max(float(np.abs(along[view.place][view.first :]).max()) for view in evaluation.shown)
    sentence = (
        f"Normalized hysteretic variable omega over displacement; it reaches ±{number(largest, 3)}, where ±1 is "
        "saturation."
    )
    return Chart("omega", "Hysteretic variable omega over the path", sentence, draw)


def correlations(evaluation: Evaluation) -> Chart | None:
    """Correlations between all coefficients; None if they are unknown."""
    whole = evaluation.identification
    joint = JointCovariance.from_uncertainty(whole.parameters, whole.uncertainty)
    if joint is None:
        return None
    root = np.zeros((len(joint.root), len(joint.root)))
    for row, of_row in zip(root, joint.root, strict=True):
        row[: len(of_row)] = of_row
    deviations = np.linalg.norm(root, axis=1)
    known = deviations > 0.0
    root = root[known] / deviations[known, None]
    names = names_of(whole.parameters)
    labels = [name.removeprefix("ln ") for name, kept in zip(names, known, strict=True) if kept]
    if len(labels) < 2:
        return None
    values = np.clip(root @ root.T, -1.0, 1.0)
    pairs = np.triu(np.abs(values), 1)
    a, b = np.unravel_index(int(np.argmax(pairs)), pairs.shape)
    main = [k for k, label in enumerate(labels) if label in HYSTERETIC_UNITS]
    between = max((float(pairs[i, j]) for i in main for j in main), default=0.0)

    def draw(axes: Axes, _record: int | None) -> None:
        for name, colour, side in (("positive", "model", 1.0), ("negative", "blue", -1.0)):
            for grade in range(1, _GRADES + 1):
                y, x = np.argwhere(np.round(_GRADES * side * values) == grade).T + 1.0
                bars(axes, x, y - 0.47, y + 0.47, name, colour, 0.94, opacity=grade / _GRADES)
        ends, size = (0.5, len(labels) + 0.5), 6.5 if len(labels) <= 12 else 4.5
        name_axes(axes, ("", NUMBER), ("", NUMBER))
        for way in "xy":
            drawing.name_places(axes, way, labels, size)
        axes.set(xlim=ends, ylim=ends[::-1], aspect="equal")

    sentence = (
        f"Correlations between the {len(labels)} coefficients. The strongest is {number(float(values[a, b]), 3)}, "
        f"between {labels[a]} and {labels[b]}; among kappa_omega, rho, sigma and n it is at most {number(between, 2)} "
        "in size."
    )
    return Chart("correlations", "Correlations of the parameters", sentence, draw, is_square=True)


def interval_of_loop(evaluation: Evaluation) -> Chart | None:
    """The last closed loop of the last record with the uncertainty of its prediction; None if it is unknown."""
    whole, view = evaluation.identification, evaluation.views[-1]
    interval = ForceInterval.from_uncertainty(whole.uncertainty)
    joint = JointCovariance.from_uncertainty(whole.parameters, whole.uncertainty)
    if interval is None or joint is None:
        return None
    path, start, time = view.record.displacement, view.fit.omega_start, view.record.rising_time
    turning = view.strokes.turning
    ends = path[turning]
    closed = [k for k in range(ends.size - 2) if abs(ends[k] - ends[k + 2]) < _CLOSED * abs(ends[k] - ends[k + 1])]
    first = closed[-1] if closed else max(ends.size - 3, 0)
    loop = slice(turning[first], turning[min(first + 2, ends.size - 1)] + 1)
    predicted = view.fit.predicted[loop]
    errors = joint.errors(whole.parameters, lambda moved: PathSolver(moved).force(path, start, time)[loop])
    sure, reaching = NORMAL_95 * errors, interval.reach(predicted, errors)

    def draw(axes: Axes, _record: int | None) -> None:
        at = np.union1d(visible(predicted, _MODEL_POINTS), visible(path[loop], _MODEL_POINTS))
        x, force, factor = path[loop][at] * evaluation.length.factor, predicted[at], evaluation.force.factor
        up = np.gradient(path[loop])[at] >= 0.0
        for stroke in (up, ~up):
            for name, colour, reach in (
                ("95 % prediction interval of a measured force", "prediction", reaching),
                ("95 % confidence band of the mean", "model", sure),
            ):  # fmt: skip
                low, high = (factor * (force + side * reach[at])[stroke] for side in (-1.0, 1.0))
                band(axes, x[stroke], low, high, name, colour)
        line(axes, x, force * factor, "model", "model")
        name_axes(axes, ("displacement", evaluation.length), ("force", evaluation.force))

    reach, width = (f"{evaluation.residual.text(float(np.median(values)), 2)}" for values in (reaching, sure))
    sentence = (
        f"The model's last closed loop with the 95 % prediction interval (±{reach} in the median) and the 95 % "
        f"confidence band (±{width})."
    )
    return Chart("band", "Last loop with the uncertainty of its prediction", sentence, draw)


def over_amplitude(evaluation: Evaluation, place: int) -> Chart | None:
    """One of `PANELS` over the amplitude, measured and modelled; None if it has no value.

    A loop whose force does not rise on the whole has no loss factor.
    """
    column, unit, length = PANELS[place], evaluation.unit_of_figure(place), evaluation.length
    curve = [row for row in evaluation.curve if math.isfinite(getattr(row.model, column.key))]
    measured = [row for row in evaluation.measured if math.isfinite(getattr(row.figures, column.key))]
    if not curve:
        return None
    x = length.factor * np.array([row.amplitude for row in curve])
    y, reach = unit.factor * np.array([[getattr(row.model, column.key), row.reach[place]] for row in curve]).T

    def draw(axes: Axes, _record: int | None) -> None:
        if np.isfinite(reach).any():
            band(axes, x, y - reach, y + reach, "model, 95 % interval", "model")
        begin = min(int(np.searchsorted(x, length.factor * evaluation.smallest_measured)), x.size - 1)
        line(axes, x[begin:], y[begin:], "model about mid-range", "model")
        if begin:
            line(axes, x[: begin + 1], y[: begin + 1], "model, extrapolated", "model", "--")
        if measured:
            spread = np.array([0.0 if row.spread is None else getattr(row.spread, column.key) for row in measured])
            at, of = np.array([[row.figures.amplitude, getattr(row.figures, column.key)] for row in measured]).T
            error = unit.factor * spread if np.any(spread > 0.0) else None
            marks(axes, length.factor * at, unit.factor * of, "measured", "measured", error=error)
        axes.set_xlim(left=0.0)
        name_axes(axes, ("amplitude", length), (column.words, unit))

    ends = " to ".join(
        f"{number(float(y[k]), 3)} {unit.name} at {number(float(x[k]), 3)} {length.name}" for k in (0, -1)
    )
    count = {0: "no full cycle was measured", 1: "measured at one amplitude"}
    where = count.get(len(measured), f"measured at {len(measured)} amplitudes")
    sentence = f"Model's {column.words} from {ends}; {where}.".replace("  ", " ")
    key = f"amplitude-{column.key.replace('_', '-')}"
    return Chart(key, f"{column.words.capitalize()} over amplitude", sentence, draw)


def trends(evaluation: Evaluation) -> tuple[Chart, ...]:
    """Stiffness, energy and mean force of each cycle, measured and predicted; empty without two cycles of a record."""
    views = [view for view in evaluation.shown if len(view.measured_cycles) > 1]
    kinds = (("secant_stiffness", "stiffness"), ("energy_per_cycle", "energy"), ("mean_force", "force"))
    return tuple(_trend(evaluation, views, *kind) for kind in kinds) if views else ()


def _trend(evaluation: Evaluation, views: Sequence[RecordView], key: str, kind: str) -> Chart:
    rows, changes = {}, []
    for view in views:
        rows[view.place] = np.array(
            [[getattr(cycle.figures, key) for cycle in of] for of in (view.measured_cycles, view.predicted_cycles)]
        )
        for group in group_by_amplitude(view.measured_cycles):
            alike = rows[view.place][0][sorted(map(view.measured_cycles.index, group))]
            if alike.size > 1 and alike.any():
                changes.append(float((alike[-1] - alike[0]) / np.mean(np.abs(alike))))
    everything = np.concatenate([values.ravel() for values in rows.values()])
    unit = evaluation.force if kind == "force" else unit_of(kind, float(np.abs(everything).max()))
    text = key.replace("_", " ")

    def draw(axes: Axes, record: int | None) -> None:
        for place, values in rows.items():
            if record in (None, place):
                at = np.array(evenly(values.shape[1], _TREND_CYCLES))
                for name, own in zip(("measured", "model"), unit.factor * values[:, at], strict=True):
                    line(axes, at + 1.0, own, name, name, record=place, marker="o", ms=2.2)
        low, high = unit.factor * float(everything.min()), unit.factor * float(everything.max())
        middle, least = 0.5 * (low + high), 0.5 * _TREND_RANGE * abs(low + high)
        if high - low < least:  # what hardly changes is not drawn at full height
            axes.set_ylim(middle - 0.5 * least, middle + 0.5 * least)
        name_axes(axes, ("cycle", NUMBER), (text, unit))

    sentence = f"{text.capitalize()} of each cycle, measured and predicted"
    if changes:
        change, most = percent(max(changes, key=abs), sign=True), " at most" if len(changes) > 1 else ""
        sentence += f"; from the first to the last cycle of one amplitude the measured one changes by {change}{most}"
    return Chart(f"trend-{key.replace('_', '-')}", f"{text.capitalize()} of each cycle", f"{sentence}.", draw,
                 records=[*rows])  # fmt: skip


def transmissibility(evaluation: Evaluation, mass: float | None = None) -> Chart | str:
    """Absolute transmissibility under base motion of three levels; a sentence that says why, if it cannot be had."""
    spring = evaluation.identification.parameters
    try:
        system = _at_rest(evaluation.solver, spring) if mass is None else IsolatedMass(spring, mass)
        if system is None:
            return (
                "Transmissibility: no mass rests on this spring by its own weight within the identified range; give a "
                "mass and a load to strandspring isolate."
            )
        equilibrium = static_equilibrium(system)
        travel = free_travel(system, equilibrium)
        frequencies = band_frequencies(None, _BAND_POINTS, equilibrium)
        responses = [
            frequency_response(system, Excitation.BASE_DISPLACEMENT, share * travel, frequencies)
            for share in DEFAULT_SHARES
        ]
    except IsolationError as refusal:
        return f"Transmissibility: {refusal}"

    def draw(axes: Axes, _record: int | None) -> None:
        for response, colour in zip(responses, ("blue", "green", "purple"), strict=True):
            frequency, values = response.column("frequency"), response.column("transmissibility")
            name = f"base ±{unit_of('length', response.level).text(response.level, 2)}"
            line(axes, frequency, np.where(response.unstable, np.nan, values), name, colour)
            if response.unstable.any():
                line(axes, frequency, np.where(response.dotted, values, np.nan), "unstable", colour, ":")
        name_axes(axes, ("frequency", HZ), ("absolute transmissibility", NUMBER), log="xy")

    weighed = unit_of("mass", system.mass).text(system.mass)
    first, last = responses[0].resonance, responses[-1].resonance
    isolates = last.isolation_frequency
    sentence = (
        f"A mass of {weighed}{', chosen so that it rests near mid-range,' if mass is None else ''} on one spring: "
        f"static equilibrium at {evaluation.length.text(equilibrium.displacement)}, natural frequency of small motion "
        f"{number(equilibrium.frequency, 3)} Hz. Resonance at {number(first.frequency, 3)} Hz with a transmissibility "
        f"of {number(first.transmissibility, 3)} at the smallest base motion, and at {number(last.frequency, 3)} Hz "
        f"with {number(last.transmissibility, 3)} at the largest"
        f"{'' if math.isnan(isolates) else f'; isolation begins at {number(isolates, 3)} Hz there'}."
    )
    return Chart("transmissibility", f"Transmissibility of {weighed}", sentence, draw, wide=True)


def _at_rest(solver: PathSolver, spring: SpringParameters) -> IsolatedMass | None:
    """The mass whose weight rests near the middle of the range."""
    for place in _PLACES:
        x = spring.displacement_min + place * (spring.displacement_max - spring.displacement_min)
        mass = solver.force_with_partials(np.array([x]), np.zeros(1))[0].item() / STANDARD_GRAVITY
        if mass > 0.0:
            # Two digits, as somebody would ask for.
            system = IsolatedMass(spring, float(f"{mass:.2g}"))
            try:
                static_equilibrium(system)
            except IsolationError:
                continue
            return system
    return None


CHARTS: dict[str, Callable[[Evaluation], Chart | str | None]] = {
    "loops": loops,
    "force": force,
    "residuals-displacement": residuals_over_displacement,
    "residuals-velocity": residuals_over_velocity,
    "residuals-time": residuals_over_time,
    "histogram": histogram,
    "autocorrelation": autocorrelation,
    "branches": branches,
    "amplifier": amplifier,
    "omega": omega,
    "correlations": correlations,
    "band": interval_of_loop,
    "amplitude-secant-stiffness": partial(over_amplitude, place=0),
    "amplitude-energy-per-cycle": partial(over_amplitude, place=1),
    "amplitude-loss-factor": partial(over_amplitude, place=2),
    "transmissibility": transmissibility,
}


def plot_chart(
    identification: IdentifiedModel, chart: str = "loops", ax: Axes | None = None, record: int | None = None
) -> Axes:
    """Draw a chart of the report.

    Parameters
    ----------
    identification : IdentifiedModel
    chart : str             "loops", "force", "residuals-displacement", "residuals-velocity", "residuals-time",
                            "histogram", "autocorrelation", "branches", "amplifier", "omega", "correlations", "band",
                            "amplitude-secant-stiffness", "amplitude-energy-per-cycle", "amplitude-loss-factor" or
                            "transmissibility".
    ax : Axes or None       To draw into; new ones of pyplot if None.
    record : int or None    Place of the record shown; all if None.

    Raises
    ------
    StrandspringError       If there is no such chart, or it is unknown, as correlations are after other methods than
                            the refined one.
    """
    if chart not in CHARTS:
        raise StrandspringError(f"`chart` must be one of {', '.join(CHARTS)}, got {chart!r}.")
    found = CHARTS[chart](Evaluation(identification))
    if found is None:
        raise StrandspringError(f"This identification has no chart {chart!r}: it holds nothing of what that shows.")
    if isinstance(found, str):
        raise StrandspringError(found)
    return drawing.draw(found, some_axes(ax)[0], record)


def write_figure(path: str | Path, identification: IdentifiedModel) -> None:
    """Write measured and predicted loops as a figure for a column of a paper, 88 mm wide and without a title.

    Parameters
    ----------
    path : str or Path        Ending in .svg, .png or .pdf.
    identification : IdentifiedModel

    Raises
    ------
    StrandspringError         If the ending does not suit, or the file cannot be written.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise StrandspringError(f"A figure must end in {', '.join(SUFFIXES)}, got {str(path)!r}; choose one of them.")
    with rc_context(STYLE):
        figure = Figure((COLUMN, 0.62 * COLUMN), layout="constrained")
        drawing.draw(loops(Evaluation(identification)), figure.subplots())
        save_figure(path, figure, _RESOLUTION)
