"""Charts of the fit: loops, force along the record, residuals."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...identification.figures import autocorrelation_time
from ...kernel.arrays import FloatArray
from ..content.chart import Axis, Chart, ChartForm, Role, Trace, joined, visible
from ..content.quantities import NUMBER, DisplayUnit, S, number, percent, unit_of
from .evaluation import SHOWN_RECORDS, Evaluation, RecordView

_BINS = (15, 60)  # of the histogram
_DOTS = 2500  # of a record
_LAGS = 400  # of the autocorrelation, at most


def over_cycles(
    view: RecordView,
    x: FloatArray,
    y: FloatArray,
    unit: tuple[DisplayUnit, DisplayUnit],
    name: str,
    role: Role,
    form: ChartForm,
) -> Trace:
    """A line over the displacement (or another quantity) in which single cycles can be chosen."""
    places = view.in_cycles(y)
    xs, ys, ends = joined([(x[at] * unit[0].factor, y[at] * unit[1].factor) for _, at in places])
    cycles = tuple((f"cycle {n}", *pair) for (n, _), pair in zip(places, ends, strict=True))
    return Trace(name, xs, ys, role, form, record=view.place, cycles=cycles if len(cycles) > 1 else ())


def _not_compared(view: RecordView, x: FloatArray, force: FloatArray) -> Iterator[Trace]:
    """What is drawn faintly, in display units."""
    if view.not_compared is not None:
        at = view.line(force, view.not_compared)
        yield Trace("not compared", x[at], force[at], Role.LEFT_OUT, record=view.place)


def loops(evaluation: Evaluation) -> Chart:
    """Measured and predicted loops over each other."""
    unit = (evaluation.length, evaluation.force)
    traces: list[Trace] = []
    for view in evaluation.shown:
        x, force = view.record.displacement, view.record.force
        traces += _not_compared(view, x * unit[0].factor, force * unit[1].factor)
        traces.append(over_cycles(view, x, view.only_compared(force), unit, "measured", Role.MEASURED, ChartForm.LINE))
    for view in evaluation.shown:
        x, force = view.record.displacement, view.only_compared(view.fit.predicted)
        if view.differs:
            fitted = view.only_compared(view.fitted.predicted)
            traces.append(over_cycles(view, x, fitted, unit, "as fitted", Role.LEFT_OUT, ChartForm.DASHED))
        traces.append(over_cycles(view, x, force, unit, "model", Role.MODEL, ChartForm.LINE))
    whole = evaluation.identification
    fitted_words = f" As fitted: {evaluation.beside}." if any(view.differs for view in evaluation.shown) else ""
    sentence = (
        "Measured force, and that of the saved spring alone along the displacement as recorded; rms error "
        f"{unit[1].text(whole.rmse, 3)}, RNL {number(whole.rnl, 4)}."
        f"{fitted_words}{_shown(evaluation)}"
    )
    return Chart(
        "loops", "Measured and predicted loops", Axis("displacement", unit[0]), Axis("force", unit[1]),
        tuple(traces), sentence, wide=True,
    )  # fmt: skip


def _shown(evaluation: Evaluation) -> str:
    """What of many records and cycles is drawn, in a sentence; empty if all is."""
    parts = []
    if len(evaluation.shown) < len(evaluation.views):
        parts.append(f"{SHOWN_RECORDS} of {len(evaluation.views)} records")
    if any(view.cycles[-1][0] > len(view.cycles) for view in evaluation.shown):
        parts.append("some of the many cycles")
    return f" Drawn are {' and '.join(parts)}, evenly chosen." if parts else ""


def _along(evaluation: Evaluation) -> Axis:
    """The axis along the records: time, or the sample number if one of them has no rising times."""
    timed = all(view.record.rising_time is not None for view in evaluation.views)
    return Axis("time", S) if timed else Axis("sample number", NUMBER)


def _position(view: RecordView, axis: Axis) -> FloatArray:
    return view.position if axis.unit.name else np.arange(1.0, len(view.record) + 1.0)


def _line_along(view: RecordView, axis: Axis, values: FloatArray, unit: DisplayUnit, name: str, role: Role) -> Trace:
    """A line along the record, and its cycles in detail."""
    x, at = _position(view, axis), view.line(values, slice(view.first, None))
    places = view.in_cycles(values) if len(view.cycles) > 1 else []
    xs, ys, ends = joined([(x[part], values[part] * unit.factor) for part in (at, *(part for _, part in places))])
    cycles = tuple((f"cycle {n}", *pair) for (n, _), pair in zip(places, ends[1:], strict=True))
    return Trace(name, xs, ys, role, record=view.place, cycles=cycles, whole=at.size)


def force(evaluation: Evaluation) -> Chart:
    """Measured and predicted force along the record."""
    axis = _along(evaluation)
    traces: list[Trace] = []
    for view in evaluation.shown:
        traces += _not_compared(view, _position(view, axis), view.record.force * evaluation.force.factor)
        for name, role, values in (
            ("measured", Role.MEASURED, view.record.force), ("model", Role.MODEL, view.fit.predicted),
        ):  # fmt: skip
            traces.append(_line_along(view, axis, view.only_compared(values), evaluation.force, name, role))
    samples = sum(view.fit.samples for view in evaluation.views)
    sentence = (
        f"Measured and predicted force over {axis.text}; {samples} of {sum(len(v.record) for v in evaluation.views)} "
        "samples are compared."
    )
    return Chart(
        "force", f"Force over {axis.text}", axis, Axis("force", evaluation.force), tuple(traces), sentence,
        wide=True, single=True,
    )  # fmt: skip


def residuals_over_displacement(evaluation: Evaluation) -> Chart:
    """Residuals over displacement, loading and unloading apart."""
    unit = (evaluation.length, evaluation.residual)
    traces = []
    for view in evaluation.shown:
        loading = view.strokes.direction[view.strokes.of_sample] > 0
        for name, role, stroke in (("loading", Role.FIRST, loading), ("unloading", Role.SECOND, ~loading)):
            branch = np.where(stroke, view.residuals, np.nan)
            pieces, labels = [], []
            most = max(min(view.points, _DOTS) // (2 * len(view.cycles)), 30)
            for cycle, samples in view.cycles:
                places = samples.start + np.flatnonzero(np.isfinite(branch[samples]))
                at = places[visible(branch[places], most)] if places.size else places
                pieces.append((view.record.displacement[at] * unit[0].factor, branch[at] * unit[1].factor))
                labels.append(f"cycle {cycle}")
            xs, ys, ends = joined(pieces)
            cycles = tuple((label, *pair) for label, pair in zip(labels, ends, strict=True))
            traces.append(
                Trace(name, xs, ys, role, ChartForm.DOTS, record=view.place, cycles=cycles if len(cycles) > 1 else ())
            )
    return Chart(
        "residuals-displacement", "Residuals over displacement", Axis("displacement", unit[0]),
        Axis("measured − model", unit[1]), tuple(traces),
        f"Residual force over displacement. {_misfit(evaluation)}", single=True,
    )  # fmt: skip


def _misfit(evaluation: Evaluation) -> str:
    largest = max(float(np.abs(view.compared).max()) for view in evaluation.views)
    unit = evaluation.residual
    return f"The rms residual is {unit.text(evaluation.identification.rmse, 3)}, the largest {unit.text(largest, 3)}."


def residuals_over_velocity(evaluation: Evaluation) -> Chart | None:
    """Residuals over velocity; None without times."""
    views = [(view, view.of_compared(view.velocity)) for view in evaluation.shown if view.velocity is not None]
    if not views:
        return None
    fastest = max(float(np.abs(velocity).max()) for _, velocity in views)
    unit = unit_of("velocity", fastest)
    traces, slopes = [], []
    for view, velocity in views:
        residual = view.compared
        at = visible(residual, min(view.points, _DOTS))
        traces.append(
            Trace("residual", velocity[at] * unit.factor, residual[at] * evaluation.residual.factor, Role.FIRST,
                  ChartForm.DOTS, record=view.place)
        )  # fmt: skip
        spread = float(np.std(velocity) * np.std(residual))
        slopes.append(float(np.mean((velocity - velocity.mean()) * residual)) / spread if spread else 0.0)
    strongest = max(slopes, key=abs)
    sentence = (
        f"Residual force over velocity, up to {unit.text(fastest, 3)}; their correlation is "
        f"{number(strongest, 2)}{' at most' if len(slopes) > 1 else ''} (0 if no viscous force was left out)."
    )
    return Chart(
        "residuals-velocity", "Residuals over velocity", Axis("velocity", unit),
        Axis("measured − model", evaluation.residual), tuple(traces), sentence, single=True,
    )  # fmt: skip


def residuals_over_time(evaluation: Evaluation) -> Chart:
    """Residuals along the record."""
    axis = _along(evaluation)
    traces = [
        _line_along(view, axis, view.residuals, evaluation.residual, "residual", Role.FIRST)
        for view in evaluation.shown
    ]
    return Chart(
        "residuals-time", f"Residuals over {axis.text}", axis, Axis("measured − model", evaluation.residual),
        tuple(traces),
        f"Residual force over {axis.text}. {_misfit(evaluation)}", wide=True, single=True,
    )  # fmt: skip


def histogram(evaluation: Evaluation) -> Chart:
    """Distribution of the residuals beside the normal one."""
    factor, traces, outside = evaluation.residual.factor, [], []
    for view in evaluation.shown:
        values = view.compared * factor
        mean, deviation = float(values.mean()), float(values.std())
        reach = max(4.0 * deviation, 1e-12)
        count = int(np.clip(round(2.0 * values.size ** (1 / 3)), *_BINS))
        edges = np.linspace(mean - reach, mean + reach, count + 1)
        heights = np.histogram(np.clip(values, edges[0], edges[-1]), edges)[0] / (values.size * (edges[1] - edges[0]))
        traces.append(
            Trace("residuals", 0.5 * (edges[1:] + edges[:-1]), heights, Role.FIRST, ChartForm.BARS, record=view.place)
        )
        grid = np.linspace(edges[0], edges[-1], 121)
        scale = max(deviation, 1e-300)
        normal = np.exp(-0.5 * ((grid - mean) / scale) ** 2) / (scale * math.sqrt(2.0 * math.pi))
        traces.append(Trace("normal distribution", grid, normal, Role.MEASURED, record=view.place))
        outside.append(float(np.mean(np.abs(values - mean) > 2.0 * scale)))
    sentence = (
        f"Distribution of the residuals; {percent(max(outside))} of them lie beyond two standard deviations"
        f"{' at most' if len(outside) > 1 else ''} (4.6 % of normally distributed ones would)."
    )
    density = f"1/({evaluation.residual.name})" if " " in evaluation.residual.name else f"1/{evaluation.residual.name}"
    return Chart(
        "histogram", "Distribution of the residuals", Axis("measured − model", evaluation.residual),
        Axis("density", DisplayUnit(density), limits=(0.0, None)), tuple(traces), sentence, single=True,
    )  # fmt: skip


def autocorrelation(evaluation: Evaluation) -> Chart:
    """Correlation of residuals with later ones."""
    traces, times = [], []
    for view in evaluation.shown:
        values = view.compared - view.compared.mean()
        time = autocorrelation_time(values)
        times.append(time)
        lags = int(np.clip(6.0 * time, 20, min(_LAGS, max(values.size // 3, 2))))
        spectrum = np.abs(np.fft.rfft(values, 1 << (2 * values.size - 1).bit_length())) ** 2
        correlation = np.fft.irfft(spectrum)[: lags + 1]
        correlation = correlation / max(float(correlation[0]), 1e-300)
        reach = 1.96 / math.sqrt(values.size)
        lag = np.arange(lags + 1.0)
        traces += [
            Trace("95 % of white noise", lag, np.full(lag.size, reach), Role.REFERENCE, ChartForm.BAND,
                  low=np.full(lag.size, -reach), record=view.place),
            Trace("residuals", lag, correlation, Role.FIRST, record=view.place),
        ]  # fmt: skip
    sentence = (
        f"Autocorrelation of the residuals; the integrated autocorrelation time is {number(max(times), 2)}"
        f"{' at most' if len(times) > 1 else ''} in samples, and 1 for white noise."
    )
    return Chart(
        "autocorrelation", "Autocorrelation of the residuals", Axis("lag", DisplayUnit("samples")),
        Axis("autocorrelation", NUMBER), tuple(traces), sentence, single=True,
    )  # fmt: skip
