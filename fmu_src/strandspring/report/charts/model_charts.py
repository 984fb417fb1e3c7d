"""Charts of the model itself: branches, amplifier, omega, correlations of parameters, uncertainty of predictions."""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...model.joint import HYSTERETIC_UNITS, NORMAL_95, ForceInterval, JointCovariance, names_of
from ..content.chart import Axis, Chart, ChartForm, Role, Trace
from ..content.quantities import NUMBER, number, span
from .evaluation import Evaluation
from .fit_charts import over_cycles

_POINTS = 401
_CLOSED = 0.05  # difference of the ends of a closed loop, share of its stroke


def _parts(evaluation: Evaluation) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Displacements over the identified range [m], FE [N] and the saturated hysteretic force [N] there."""
    p = evaluation.identification.parameters
    x = np.linspace(p.displacement_min, p.displacement_max, _POINTS)
    elastic = evaluation.solver.force_with_partials(x, np.zeros(_POINTS))[0]
    return x, elastic, evaluation.solver.force_with_partials(x, np.ones(_POINTS))[0] - elastic


def branches(evaluation: Evaluation) -> Chart:
    """Elastic force and saturated branches."""
    x, elastic, hysteretic = _parts(evaluation)
    along, factor = x * evaluation.length.factor, evaluation.force.factor
    traces = (
        Trace("loading, saturated", along, (elastic + hysteretic) * factor, Role.FIRST),
        Trace("elastic force FE", along, elastic * factor, Role.MODEL),
        Trace("unloading, saturated", along, (elastic - hysteretic) * factor, Role.SECOND),
    )
    sentence = (
        f"Elastic force FE from {span(float(elastic.min()), float(elastic.max()), evaluation.force)}, between the "
        f"branches that long strokes approach; they are {number(2.0 * float(np.mean(hysteretic)) * factor, 3)} "
        f"{evaluation.force.name} apart in the mean."
    )
    return Chart(
        "branches", "Elastic force and saturated branches", Axis("displacement", evaluation.length),
        Axis("force", evaluation.force),
        traces, sentence,
    )  # fmt: skip


def amplifier(evaluation: Evaluation) -> Chart:
    """The amplifier FA."""
    x, _, hysteretic = _parts(evaluation)
    values = hysteretic / evaluation.identification.parameters.kappa_omega
    sentence = (
        f"Amplifier FA of the hysteretic force, 1 at the middle of the range; from {number(float(values.min()), 3)} to "
        f"{number(float(values.max()), 3)}."
    )
    return Chart(
        "amplifier", "Amplifier of the hysteretic force", Axis("displacement", evaluation.length),
        Axis("FA", NUMBER, limits=(0.0, None)), (Trace("FA", x * evaluation.length.factor, values, Role.MODEL),),
        sentence,
    )  # fmt: skip


def omega(evaluation: Evaluation) -> Chart:
    """The normalized hysteretic variable along the records."""
    traces = []
    peaks = []
    for view in evaluation.shown:
        values = evaluation.omega(view)
        peaks.append(float(np.abs(values[view.first :]).max()))
        displacement = view.record.displacement
        traces.append(
            over_cycles(view, displacement, values, (evaluation.length, NUMBER), "omega", Role.MODEL, ChartForm.LINE)
        )
    sentence = (
        f"Normalized hysteretic variable omega over displacement; it reaches ±{number(max(peaks), 3)}, where ±1 is "
        "saturation."
    )
    return Chart(
        "omega", "Hysteretic variable omega over the path", Axis("displacement", evaluation.length),
        Axis("omega", NUMBER),
        tuple(traces), sentence,
    )  # fmt: skip


def correlations(evaluation: Evaluation) -> Chart | None:
    """Correlations between all coefficients; None if they are unknown."""
    whole = evaluation.identification
    joint = JointCovariance.from_uncertainty(whole.parameters, whole.uncertainty)
    if joint is None:
        return None
    p = whole.parameters
    names = names_of(p)
    size = len(joint.root)
    root = np.zeros((size, size))
    for row, values in zip(root, joint.root, strict=True):
        row[: len(values)] = values
    deviations = np.linalg.norm(root, axis=1)
    known = deviations > 0.0
    root = root[known] / deviations[known, None]
    labels = [name.removeprefix("ln ") for name, kept in zip(names, known, strict=True) if kept]
    if len(labels) < 2:
        return None
    values = np.clip(root @ root.T, -1.0, 1.0)
    pairs = np.triu(np.abs(values), 1)
    a, b = np.unravel_index(int(np.argmax(pairs)), pairs.shape)
    main = [k for k, label in enumerate(labels) if label in HYSTERETIC_UNITS]
    between = max((float(pairs[i, j]) for i in main for j in main), default=0.0)
    sentence = (
        f"Correlations between the {len(labels)} coefficients. The strongest is {number(float(values[a, b]), 3)}, "
        f"between {labels[a]} and {labels[b]}; among kappa_omega, rho, sigma and n it is at most {number(between, 2)} "
        "in size."
    )
    traces = []
    for name, role, side in (("positive", Role.MODEL, 1.0), ("negative", Role.FIRST, -1.0)):
        # The strongest first, so that the legend has its colour.
        cells = sorted(np.argwhere(side * values > 0.0).tolist(), key=lambda cell: -side * values[tuple(cell)])
        texts = tuple(f"{labels[i]}, {labels[j]}: {number(float(values[i, j]), 3)}" for i, j in cells)
        y, x = np.array(cells, dtype=float).reshape(-1, 2).T + 1.0
        opacity = np.array([abs(values[i, j]) for i, j in cells])
        traces.append(Trace(name, x, y, role, ChartForm.CELLS, low=opacity, texts=texts))
    ends = (0.5, len(labels) + 0.5)
    x_axis, y_axis = (Axis("", NUMBER, limits=limits, names=tuple(labels)) for limits in (ends, ends[::-1]))
    return Chart("correlations", "Correlations of the parameters", x_axis, y_axis, tuple(traces), sentence,
                 is_drawing=True)  # fmt: skip


def band(evaluation: Evaluation) -> Chart | None:
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
    x, force, factor = path[loop] * evaluation.length.factor, predicted, evaluation.force.factor
    up = np.gradient(path[loop]) >= 0.0
    traces = [
        Trace(name, x[stroke], (force + reach)[stroke] * factor, role, ChartForm.BAND,
              low=(force - reach)[stroke] * factor)
        for stroke in (up, ~up)
        for name, role, reach in (
            ("95 % prediction interval of a measured force", Role.PREDICTION, reaching),
            ("95 % confidence band of the mean", Role.MODEL, sure),
        )
    ]  # fmt: skip
    reach, width = (f"{evaluation.residual.text(float(np.median(values)), 2)}" for values in (reaching, sure))
    return Chart(
        "band", "Last loop with the uncertainty of its prediction", Axis("displacement", evaluation.length),
        Axis("force", evaluation.force), (*traces, Trace("model", x, force * factor, Role.MODEL)),
        f"The model's last closed loop with the 95 % prediction interval (±{reach} in the median) and the 95 % "
        f"confidence band (±{width}).",
    )  # fmt: skip
