"""Charts of an identification: on its report, and for papers and notebooks in given axes or a file.

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
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

import numpy as np

from ..core.parameters import SpringParameters
from ..errors import IsolationError, ModelError, StrandspringError
from ..findings import Outcome
from ..ground.gravity import STANDARD_GRAVITY
from ..ground.plotfile import SUFFIXES, save_figure, some_axes
from ..ground.result_columns import ResultColumn
from ..identification.figures import RecordFit, chosen_samples
from ..identification.identified import IdentifiedModel
from ..kernel.arrays import BoolArray, FloatArray
from ..kernel.path import PathSolver
from ..loops.loop import PANELS, LoopFigures, steady_loop
from ..loops.strokes import Strokes, find_strokes
from ..model.joint import NORMAL_95, ForceInterval, JointCovariance
from ..model.stated_figures import differ
from ..records.record import Record
from ..vibration.one_mass.band import band_frequencies
from ..vibration.one_mass.options import DEFAULT_SHARES, Excitation
from ..vibration.one_mass.response import frequency_response
from ..vibration.one_mass.system import IsolatedMass, free_travel, static_equilibrium
from . import drawing
from .drawing import DISPLACEMENT, FORCE, FREQUENCY, STYLE, TIME, Chart, Curve, evenly, in_unit, scaled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMN = 88.0 / 25.4  # width of a column of a journal [inches]
_RESOLUTION = 600  # of a PNG [dots per inch]
_RECORDS, _CYCLES = 40, 12  # in the charts, and of a record in those in which cycles lie over each other
_MODEL_POINTS, _BAND_POINTS = 401, 150
_CLOSED = 0.05  # difference of the ends of a closed loop, share of its stroke
_AMPLITUDES = np.linspace(0.05, 1.0, 15)  # of the model's curve, shares of half the identified range
_NEARLY = 0.9  # share of an amplitude that counts as that amplitude
_PLACES = (0.5, 0.6, 0.4, 0.7, 0.3, 0.8, 0.2)  # where in the range a mass is tried to rest, by preference
_SAMPLE, _VELOCITY = ResultColumn("sample", "1", "sample number"), ResultColumn("velocity", "m/s", "velocity")
_TRANSMISSIBILITY = ResultColumn("transmissibility", "1", "absolute transmissibility")


@dataclass(frozen=True, eq=False)
class RecordView:
    """A record beside its prediction."""

    name: str  # of its file without folders
    record: Record
    fit: RecordFit  # of the spring alone along the displacement as recorded
    fitted: RecordFit  # with what was removed from the record
    place: int  # among the records

    @cached_property
    def strokes(self) -> Strokes:
        """Strokes of the measured displacement."""
        return find_strokes(self.record.displacement)

    @cached_property
    def is_compared(self) -> BoolArray:
        """Samples that are compared, shape (K,)."""
        return chosen_samples(self.record, 0) & (np.arange(len(self.record)) >= self.fit.first_sample)

    def compared(self, values: FloatArray) -> FloatArray:
        """Values, NaN where a sample is not compared, shape (K,)."""
        return np.where(self.is_compared, values, np.nan)

    @property
    def residuals(self) -> FloatArray:
        """Measured minus predicted force [N]; NaN where a sample is not compared."""
        return self.compared(self.record.force - self.fit.predicted)

    def left_out(self, x: FloatArray) -> list[Curve]:
        """The measured force over what is given, where it is not compared."""
        y = np.where(self.is_compared, np.nan, self.record.force)
        return [] if self.is_compared.all() else [Curve(x, y, "not compared", "faint", record=self.place)]

    def over_cycles(self, force: FloatArray, name: str, colour: str, style: str = "-", width: float = 0.9) -> Curve:
        """A force over the displacement, of some of many cycles of two strokes each, evenly chosen."""
        turning = self.strokes.turning
        starts = turning[np.searchsorted(turning, self.fit.first_sample) :: 2]
        cycle = np.searchsorted(starts, np.arange(len(self.record)), side="right")
        chosen = np.isin(cycle, evenly(starts.size + 1, _CYCLES))
        y = np.where(chosen, self.compared(force), np.nan)
        return Curve(self.record.displacement, y, name, colour, style, self.place, width=width)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """An identification, prepared for charts."""

    identification: IdentifiedModel

    @cached_property
    def solver(self) -> PathSolver:
        """The spring."""
        return PathSolver(self.identification.parameters)

    @cached_property
    def views(self) -> tuple[RecordView, ...]:
        """All records; equal names of files are numbered."""
        whole = self.identification
        names = [PurePath(record.path).name or record.path for record in whole.records]
        counts = [names[: k + 1].count(name) for k, name in enumerate(names)]
        numbered = [name if count == 1 else f"{name} ({count})" for name, count in zip(names, counts, strict=True)]
        rows = zip(numbered, whole.records, whole.fits, whole.fitted, range(len(names)), strict=True)
        return tuple(RecordView(*row) for row in rows)

    @cached_property
    def shown(self) -> tuple[RecordView, ...]:
        """The records in the charts: all, or evenly chosen ones of very many."""
        return tuple(self.views[k] for k in evenly(len(self.views), _RECORDS))

    def prose(self, text: str) -> str:
        """A text with the records' paths cut down to the names of their files."""
        in_folders = (view for view in self.views if PurePath(view.record.path).name != view.record.path)
        for view in sorted(in_folders, key=lambda view: -len(view.record.path)):
            text = text.replace(view.record.path, view.name)
        return text

    @cached_property
    def length(self) -> ResultColumn:
        """Displacement in a unit for this spring."""
        p = self.identification.parameters
        return scaled(DISPLACEMENT, p.displacement_max - p.displacement_min)

    @cached_property
    def force(self) -> ResultColumn:
        """Force in a unit for this spring."""
        return scaled(FORCE, max(float(np.abs(view.record.force).max()) for view in self.views))

    @cached_property
    def largest_residual(self) -> float:
        """Of all samples compared [N]."""
        return max(float(np.nanmax(np.abs(view.residuals))) for view in self.views)

    @cached_property
    def residual(self) -> ResultColumn:
        """Residual in a unit of its own."""
        return scaled(replace(FORCE, words="measured − model"), self.largest_residual)

    @cached_property
    def smallest_measured(self) -> float:
        """Amplitude below which loops are extrapolated [m]; infinite if none was measured."""
        cycles = (loop.figures.amplitude for loop in self.identification.recorded if loop.cycles)
        return _NEARLY * min(cycles, default=math.inf)

    @cached_property
    def curve(self) -> tuple[tuple[LoopFigures, ...], FloatArray]:
        """Steady loops about the middle of the range by amplitude, and half of their 95 % intervals of `PANELS`.

        Unknown (NaN) are loops smaller than the recorded ones where the records do not decide them: another minimum may
        fit about as well, of which the covariance at this one says nothing.
        """
        whole, p = self.identification, self.identification.parameters
        middle, half = 0.5 * (p.displacement_max + p.displacement_min), 0.5 * (p.displacement_max - p.displacement_min)

        def loops(solver: PathSolver) -> tuple[LoopFigures, ...]:
            ends = ((middle - share * half, middle + share * half) for share in _AMPLITUDES.tolist())
            return tuple(steady_loop(solver, *pair).figures for pair in ends)

        def figures(moved: SpringParameters) -> FloatArray:
            return np.array([[getattr(of, column.key) for column in PANELS] for of in loops(PathSolver(moved))])

        joint = JointCovariance.from_uncertainty(p, whole.uncertainty)
        reach = np.full((_AMPLITUDES.size, len(PANELS)), np.nan)
        if joint is not None:
            with suppress(ModelError):  # next to it there may be no spring any more
                reach = NORMAL_95 * joint.errors(p, figures)
        if {Outcome.SMALL_LOOPS, Outcome.ONE_AMPLITUDE} & {*whole.outcomes}:
            reach[half * _AMPLITUDES < self.smallest_measured] = np.nan
        return loops(self.solver), reach


def loops(e: Evaluation) -> Chart:
    """Measured and predicted loops over each other."""
    curves = []
    for view in e.shown:
        curves += view.left_out(view.record.displacement)
        curves.append(view.over_cycles(view.record.force, "measured", "measured", width=1.3))
        if differ(view.fit.figures, view.fitted.figures):
            curves.append(view.over_cycles(view.fitted.predicted, "as fitted", "faint", "--"))
        curves.append(view.over_cycles(view.fit.predicted, "model", "model"))
    sentence = (
        "Measured force, and that of the saved spring alone along the displacement as recorded; rms error "
        f"{in_unit(e.identification.rmse, e.force, 3)}, RNL {in_unit(e.identification.rnl)}. Of many records and "
        "cycles some are drawn, evenly chosen."
    )
    return Chart("loops", "Measured and predicted loops", sentence, e.length, e.force, curves, "wide")


def _along(e: Evaluation) -> tuple[ResultColumn, Callable[[RecordView], FloatArray]]:
    """The axis along the records, and a record's values: times, or numbers if one of them has no rising times."""
    if any(view.record.rising_time is None for view in e.views):
        return _SAMPLE, lambda view: np.arange(1.0, len(view.record) + 1.0)
    return TIME, lambda view: np.asarray(view.record.rising_time) - np.asarray(view.record.rising_time)[0]


def force(e: Evaluation) -> Chart:
    """Measured and predicted force along the record."""
    axis, times = _along(e)
    curves = []
    for view in e.shown:
        t, measured, modelled = times(view), view.compared(view.record.force), view.compared(view.fit.predicted)
        curves += view.left_out(t)
        curves.append(Curve(t, measured, "measured", "measured", record=view.place, width=1.3))
        curves.append(Curve(t, modelled, "model", "model", record=view.place))
    samples, of = sum(view.fit.samples for view in e.views), sum(len(view.record) for view in e.views)
    sentence = f"Measured and predicted force over {axis.words}; {samples} of {of} samples are compared."
    return Chart("force", f"Force over {axis.words}", sentence, axis, e.force, curves, "wide", is_apart=True)


def residuals(e: Evaluation, over: str) -> Chart | None:
    """Residuals along the record, or over displacement or velocity; None without times of which to take that."""
    axis, times = _along(e)
    axis = {"displacement": e.length, "velocity": _VELOCITY}.get(over, axis)
    if over == "velocity" and any(view.record.rising_time is None for view in e.views):
        return None
    curves = []
    for view in e.shown:
        x = view.record.displacement if over == "displacement" else times(view)
        if over == "velocity":
            x = np.gradient(view.record.displacement, x)
        at = np.flatnonzero(view.is_compared)
        is_loading = view.strokes.direction[view.strokes.of_sample[at]] > 0
        if over == "time":
            curves.append(Curve(x, view.residuals, "residual", "blue", record=view.place))
            continue
        for name, colour, own in (("loading", "blue", at[is_loading]), ("unloading", "green", at[~is_loading])):
            if own.size:
                curves.append(Curve(x[own], view.residuals[own], name, colour, ".", view.place))
    if over == "velocity":
        axis = scaled(axis, max(float(np.abs(curve.x).max()) for curve in curves))
    title, form = f"Residuals over {axis.words}", "wide" if over == "time" else "half"
    rms, largest = (in_unit(value, e.residual, 3) for value in (e.identification.rmse, e.largest_residual))
    sentence = f"Residual force over {axis.words}; rms {rms}, largest {largest}."
    return Chart(f"residuals-{over}", title, sentence, axis, e.residual, curves, form, is_apart=True)


def branches(e: Evaluation) -> Chart:
    """Elastic force and saturated branches."""
    p = e.identification.parameters
    x = np.linspace(p.displacement_min, p.displacement_max, _MODEL_POINTS)
    lower, elastic, upper = (e.solver.force_with_partials(x, np.full(x.size, omega))[0] for omega in (-1.0, 0.0, 1.0))
    named = ((upper, "loading, saturated", "blue"), (elastic, "elastic force FE", "model"),
             (lower, "unloading, saturated", "green"))  # fmt: skip
    curves = [Curve(x, *curve) for curve in named]
    apart = in_unit(float(np.mean(upper - lower)), e.force, 3)
    sentence = (
        f"Elastic force FE between the branches that long strokes approach; they are {apart} apart in the mean, and FA "
        "changes that over the displacement."
    )
    return Chart("branches", "Elastic force and saturated branches", sentence, e.length, e.force, curves)


def band(e: Evaluation) -> Chart | None:
    """The last closed loop of the last record with the uncertainty of its prediction; None if it is unknown."""
    whole, view = e.identification, e.views[-1]
    interval = ForceInterval.from_uncertainty(whole.uncertainty)
    joint = JointCovariance.from_uncertainty(whole.parameters, whole.uncertainty)
    if interval is None or joint is None:
        return None
    path, start, time = view.record.displacement, view.fit.omega_start, view.record.rising_time
    turning = view.strokes.turning
    ends = path[turning]
    closed = [k for k in range(ends.size - 2) if abs(ends[k] - ends[k + 2]) < _CLOSED * abs(ends[k] - ends[k + 1])]
    first = closed[-1] if closed else max(ends.size - 3, 0)
    middle, last = (turning[min(first + k, ends.size - 1)] - turning[first] for k in (1, 2))
    loop = slice(turning[first], turning[first] + last + 1)
    x, y = path[loop], view.fit.predicted[loop]
    errors = joint.errors(whole.parameters, lambda moved: PathSolver(moved).force(path, start, time)[loop])
    reaching, sure = interval.reach(y, errors), NORMAL_95 * errors
    curves = [Curve(x, y, "model", "model")]
    names = ("95 % prediction interval of a measured force", "95 % confidence band of the mean")
    for at in (slice(0, middle + 1), slice(middle, last + 1)):
        curves.append(Curve(x[at], y[at], names[0], "prediction", "band", reach=reaching[at]))
        curves.append(Curve(x[at], y[at], names[1], "model", "band", reach=sure[at]))
    sentence = (
        "The model's last closed loop with the 95 % prediction interval "
        f"(±{in_unit(float(np.median(reaching)), e.residual, 2)} in the median) and the 95 % confidence band "
        f"(±{in_unit(float(np.median(sure)), e.residual, 2)})."
    )
    return Chart("band", "Last loop with the uncertainty of its prediction", sentence, e.length, e.force, curves)


def over_amplitude(e: Evaluation, place: int) -> Chart | None:
    """One of `PANELS` over the amplitude, measured and modelled; None if it has no value.

    A loop whose force does not rise on the whole has no loss factor.
    """
    column, (modelled, reach) = PANELS[place], e.curve
    x, y = np.array([[figures.amplitude, getattr(figures, column.key)] for figures in modelled]).T
    known = np.isfinite(y)
    if not known.any():
        return None
    x, y, reach = x[known], y[known], reach[known, place]
    measured = [loop for loop in e.identification.recorded if loop.cycles]
    begin = min(int(np.searchsorted(x, e.smallest_measured)), x.size - 1)
    curves = [
        Curve(x, y, "model, 95 % interval", "model", "band", reach=reach),
        Curve(x[begin:], y[begin:], "model about mid-range", "model"),
        Curve(x[: begin + 1], y[: begin + 1], "model, extrapolated", "model", "--"),
    ]
    if measured:
        at, of = np.array([[loop.figures.amplitude, getattr(loop.figures, column.key)] for loop in measured]).T
        spread = [0.0 if loop.spread is None else getattr(loop.spread, column.key) for loop in measured]
        curves.append(Curve(at, of, "measured, by cycle", "measured", "o", reach=spread))
    unit = scaled(column, float(np.abs(y).max()))
    ends = " to ".join(f"{in_unit(float(y[k]), unit, 3)} at {in_unit(float(x[k]), e.length, 3)}" for k in (0, -1))
    sentence = f"Model's {column.words} from {ends}; measured loops: {len(measured)}."
    key, title = f"amplitude-{column.key.replace('_', '-')}", f"{column.words.capitalize()} over amplitude"
    shown = [curve for curve in curves if curve.style != "band" or np.isfinite(reach).any()]
    return Chart(key, title, sentence, replace(e.length, words="amplitude"), unit, shown, zero="x")


def transmissibility(e: Evaluation, mass: float | None = None) -> Chart | str:
    """Absolute transmissibility under base motion of three levels; a sentence that says why, if it cannot be had."""
    try:
        system = next(_at_rest(e), None) if mass is None else IsolatedMass(e.identification.parameters, mass)
        if system is None:
            return (
                "Transmissibility: no mass rests on this spring by its own weight within the identified range; give a "
                "mass and a load to strandspring isolate."
            )
        equilibrium = static_equilibrium(system)
        travel, frequencies = free_travel(system, equilibrium), band_frequencies(None, _BAND_POINTS, equilibrium)
        responses = [
            frequency_response(system, Excitation.BASE_DISPLACEMENT, share * travel, frequencies)
            for share in DEFAULT_SHARES
        ]
    except IsolationError as refusal:
        return f"Transmissibility: {refusal}"
    curves = []
    for response, colour in zip(responses, ("blue", "green", "purple"), strict=True):
        x, y = response.column("frequency"), response.column("transmissibility")
        level = in_unit(response.level, scaled(DISPLACEMENT, response.level), 2)
        curves.append(Curve(x, np.where(response.unstable, np.nan, y), f"base ±{level}", colour))
        if response.unstable.any():
            curves.append(Curve(x, np.where(response.dotted, y, np.nan), "unstable", colour, ":"))
    weighed = in_unit(system.mass, scaled(ResultColumn("mass", "kg", "mass"), system.mass))
    peaks = [response.resonance for response in (responses[0], responses[-1])]
    isolates = peaks[-1].isolation_frequency
    resonance = " and ".join(f"{peak.transmissibility:.3g} at {peak.frequency:.3g} Hz" for peak in peaks)
    sentence = (
        f"A mass of {weighed}{', chosen so that it rests near mid-range,' if mass is None else ''} on one spring: "
        f"static equilibrium at {in_unit(equilibrium.displacement, e.length)}, natural frequency of small motion "
        f"{in_unit(equilibrium.frequency, FREQUENCY, 3)}. Resonance of the smallest and of the largest base motion: "
        f"{resonance}{'' if math.isnan(isolates) else f'; of the largest isolation begins at {isolates:.3g} Hz'}."
    )
    return Chart("transmissibility", f"Transmissibility of {weighed}", sentence, FREQUENCY, _TRANSMISSIBILITY, curves,
                 "wide", log="xy")  # fmt: skip


def _at_rest(e: Evaluation) -> Iterator[IsolatedMass]:
    """Masses whose weight rests within the range, near its middle first."""
    p = e.identification.parameters
    for place in _PLACES:
        x = np.array([p.displacement_min + place * (p.displacement_max - p.displacement_min)])
        mass = e.solver.force_with_partials(x, np.zeros(1))[0].item() / STANDARD_GRAVITY
        if mass > 0.0:
            system = IsolatedMass(p, float(f"{mass:.2g}"))  # two digits, as somebody would ask for
            try:
                static_equilibrium(system)
            except IsolationError:
                continue
            yield system


CHARTS: dict[str, Callable[[Evaluation], Chart | str | None]] = {
    "loops": loops,
    "force": force,
    **{f"residuals-{over}": partial(residuals, over=over) for over in ("time", "displacement", "velocity")},
    "branches": branches,
    "band": band,
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
    chart : str             "loops", "force", "residuals-time", "residuals-displacement", "residuals-velocity",
                            "branches", "band", "amplitude-secant-stiffness", "amplitude-energy-per-cycle",
                            "amplitude-loss-factor" or "transmissibility".
    ax : Axes or None       To draw into; new ones of pyplot if None.
    record : int or None    Place of the record shown; all if None.

    Raises
    ------
    StrandspringError       If there is no such chart, or it is unknown, as a band is after other methods than the
                            refined one.
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

    Raises
    ------
    StrandspringError         If the file does not end in .svg, .png or .pdf, or cannot be written.
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
