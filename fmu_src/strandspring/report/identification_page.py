"""The report of an identification, and its charts, also for papers and notebooks.

Examples
--------
>>> import numpy as np
>>> from strandspring import Record, identify
>>> from strandspring.report.identification_page import plot_chart
>>> x = 0.02 * np.sin(np.linspace(0.0, 6 * np.pi, 900))
>>> spring_force = 2e3 * x + 10.0 * np.tanh(500.0 * (x + 0.004 * np.sign(np.gradient(x))))
>>> axes = plot_chart(identify(Record(x, spring_force)), "branches")
>>> axes.get_xlabel()
'displacement [mm]'
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from .._version import __version__
from ..errors import IsolationError, ModelError, Reader, StrandspringError
from ..findings import CAUTIONS, Outcome, gathered, words
from ..ground.gravity import STANDARD_GRAVITY
from ..ground.plotfile import save_figure, some_axes
from ..ground.result_columns import ResultColumn
from ..identification.figures import RecordFit, chosen_samples
from ..identification.identified import IdentifiedModel
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.campaign import campaign_verdicts
from ..loops.loop import PANELS, relaxed_branches, steady_loop
from ..loops.strokes import find_strokes
from ..model.joint import NORMAL_95, JointCovariance
from ..model.modelfile import ModelFile
from ..model.stated_figures import differ, energy_ratio
from ..records.record import Record
from ..vibration.one_mass.band import band_frequencies
from ..vibration.one_mass.options import DEFAULT_SHARES, Excitation
from ..vibration.one_mass.response import frequency_response
from ..vibration.one_mass.system import IsolatedMass, free_travel, static_equilibrium
from . import ReportDetails, drawing
from .drawing import Chart, Curve, Steady, evenly, in_unit, percent, scaled, steady_curves
from .page import Level, Notice, Page, Parts, Section, Tile, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMN = 88.0 / 25.4  # width of a column of a journal [inches]
_RESOLUTION = 600  # of a PNG [dots per inch]
_RECORDS, _CYCLES = 40, 12  # in the charts, and of a record where cycles lie over each other
_MODEL_POINTS, _BAND_POINTS = 401, 150
_AMPLITUDES = np.linspace(0.05, 1.0, 15)  # of the model's curve, shares of half the identified range
_NEARLY = 0.9  # share of an amplitude that counts as that amplitude
_PLACES = (0.5, 0.6, 0.4, 0.7, 0.3, 0.8, 0.2)  # where in the range a mass is tried to rest, by preference
_VELOCITY = ResultColumn("velocity", "m/s", "velocity", shown="mm/s", factor=1e3)
_MASS = ResultColumn("mass", "kg", "mass")
_TRANSMISSIBILITY = ResultColumn("transmissibility", "1", "absolute transmissibility")
_KEYS = [f"amplitude-{column.key.replace('_', '-')}" for column in PANELS]
_ITEM, _FILE = ("item", "details"), ("file", "samples", "SHA-256")
# The model does not follow its own records.
_POOR = frozenset({Outcome.POOR_FIT, Outcome.NI_MODEL, Outcome.WORSE_THAN_LINE})


class RecordView:
    """A record beside its prediction: `fit` of the spring alone along the displacement as recorded, and `fitted` with
    what was removed from the record.
    """

    def __init__(self, name: str, record: Record, fit: RecordFit, fitted: RecordFit, place: int) -> None:
        self.name, self.record, self.fit, self.fitted, self.place = name, record, fit, fitted, place
        self.strokes = find_strokes(record.displacement)
        self.is_compared = chosen_samples(record, fit.first_sample)  # shape (K,)
        # Measured minus predicted force [N], likewise; NaN where a sample is not compared.
        self.residuals = np.where(self.is_compared, record.force - fit.predicted, np.nan)

    def along(self, axis: ResultColumn) -> FloatArray:
        """What an axis counts, shape (K,) [SI]."""
        x, time = self.record.displacement, self.record.rising_time
        if axis.key == "displacement":
            return x
        if axis.key == "sample" or time is None:
            return np.arange(1.0, x.size + 1.0)
        return np.gradient(x, time) if axis.key == "velocity" else time - time[0]

    def curves(self, axis: ResultColumn) -> Iterator[Curve]:
        """Measured and predicted force; over displacement of some of many cycles of two strokes."""
        x, chosen, place = self.along(axis), self.is_compared, self.place
        measured, predicted = self.record.force, self.fit.predicted
        if not chosen.all():
            yield Curve(x, np.where(chosen, np.nan, measured), "not compared", "faint", record=place)
        if axis.key == "displacement":
            turning = self.strokes.turning
            starts = turning[np.searchsorted(turning, self.fit.first_sample) :: 2]
            cycle = np.searchsorted(starts, np.arange(x.size), side="right")
            chosen = chosen & np.isin(cycle, evenly(starts.size + 1, _CYCLES))
        yield Curve(x, np.where(chosen, measured, np.nan), "measured", "measured", record=place, width=1.3)
        if differ(self.fit.figures, self.fitted.figures):
            yield Curve(x, np.where(chosen, self.fitted.predicted, np.nan), "as fitted", "faint", "--", place)
        yield Curve(x, np.where(chosen, predicted, np.nan), "model", "model", record=place)


class Evaluation:
    """An identification for charts: `views` of its records, some of them `shown`, and fitting units."""

    def __init__(self, whole: IdentifiedModel, mass: float | None = None) -> None:
        p = whole.parameters
        self.whole, self.mass, self.solver = whole, mass, PathSolver(p)
        # Equal names of files are numbered.
        names = [PurePath(record.path).name or record.path for record in whole.records]
        counts = [names[: k + 1].count(name) for k, name in enumerate(names)]
        numbered = [name if count == 1 else f"{name} ({count})" for name, count in zip(names, counts, strict=True)]
        rows = zip(numbered, whole.records, whole.fits, whole.fitted, range(len(names)), strict=True)
        self.views = [RecordView(*row) for row in rows]
        self.shown = [self.views[k] for k in evenly(len(self.views), _RECORDS)]
        self.time = drawing.SAMPLE if any(record.rising_time is None for record in whole.records) else drawing.TIME
        self.length = scaled(drawing.DISPLACEMENT, p.displacement_max - p.displacement_min)
        self.force = scaled(drawing.FORCE, max(float(np.abs(record.force).max()) for record in whole.records))
        # Of all samples compared [N].
        self.largest_residual = max(float(np.nanmax(np.abs(view.residuals))) for view in self.views)
        self.residual = scaled(replace(drawing.FORCE, words="measured − model"), self.largest_residual)
        self.measured = [loop for loop in whole.recorded if loop.cycles]
        # Below it loops are extrapolated [m].
        self.smallest_measured = _NEARLY * min((loop.figures.amplitude for loop in self.measured), default=math.inf)

    @cached_property
    def curve(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Amplitudes of steady loops about mid-range [m], shape (A,), their `PANELS`, and half of the 95 % intervals of
        these, shape (A, 3), NaN where the records do not decide them.
        """
        whole, p = self.whole, self.whole.parameters
        middle = 0.5 * (p.displacement_max + p.displacement_min)
        amplitudes = _AMPLITUDES * (p.displacement_max - middle)

        def figures(solver: PathSolver) -> FloatArray:
            found = (steady_loop(solver, middle - one, middle + one).figures for one in amplitudes.tolist())
            return np.array([[getattr(of, column.key) for column in PANELS] for of in found])

        joint = JointCovariance.from_uncertainty(p, whole.uncertainty)
        reach = np.full((amplitudes.size, len(PANELS)), np.nan)
        if joint is not None:
            with suppress(ModelError):  # next to it there may be no spring any more
                reach = NORMAL_95 * joint.errors(p, lambda moved: figures(PathSolver(moved)))
        # Of another minimum, which may fit as well, the covariance at this one says nothing.
        if {Outcome.SMALL_LOOPS, Outcome.ONE_AMPLITUDE} & {*whole.outcomes}:
            reach[amplitudes < self.smallest_measured] = np.nan
        return amplitudes, figures(self.solver), reach


def loops(e: Evaluation) -> Chart:
    """Measured and predicted loops over each other."""
    curves = [curve for view in e.shown for curve in view.curves(e.length)]
    rms = in_unit(e.whole.rmse, e.force, 3)
    sentence = f"The saved spring alone along the displacement as recorded; rms error {rms}."
    return Chart("loops", "Measured and predicted loops", sentence, e.length, e.force, curves)


def force(e: Evaluation) -> Chart:
    """Measured and predicted force along the record."""
    curves = [curve for view in e.shown for curve in view.curves(e.time)]
    samples, of = sum(view.fit.samples for view in e.views), sum(len(view.record) for view in e.views)
    sentence = f"{samples} of {of} samples are compared."
    return Chart("force", f"Force over {e.time.words}", sentence, e.time, e.force, curves, is_apart=True)


def residuals(e: Evaluation, over: str) -> Chart | None:
    """Residuals over time, displacement or velocity; None without times of which to take that."""
    axis = {"displacement": e.length, "velocity": _VELOCITY}.get(over, e.time)
    if axis is _VELOCITY and e.time is not drawing.TIME:
        return None
    curves = []
    for view in e.shown:
        x, direction = view.along(axis), view.strokes.direction[view.strokes.of_sample]
        if axis is e.time:
            curves.append(Curve(x, view.residuals, "residual", "blue", record=view.place))
            continue
        for name, colour, way in (("loading", "blue", 1), ("unloading", "green", -1)):
            if (own := view.is_compared & (direction == way)).any():
                curves.append(Curve(x[own], view.residuals[own], name, colour, ".", view.place))
    title, form = f"Residuals over {axis.words}", "wide" if axis is e.time else "half"
    rms, largest = (in_unit(value, e.residual, 3) for value in (e.whole.rmse, e.largest_residual))
    sentence = f"Rms {rms}, largest {largest}."
    return Chart(f"residuals-{over}", title, sentence, axis, e.residual, curves, form, is_apart=True)


def over_amplitude(e: Evaluation, place: int) -> Chart | None:
    """One of `PANELS` over the amplitude; None if it has no value.

    A loop whose force does not rise on the whole has no loss factor.
    """
    column, (x, y, reach) = PANELS[place], e.curve
    known = np.isfinite(y[:, place])
    if not known.any():
        return None
    x, y, reach = x[known], y[known, place], reach[known, place]
    begin = min(int(np.searchsorted(x, e.smallest_measured)), x.size - 1)
    curves = [
        Curve(x[begin:], y[begin:], "model about mid-range", "model"),
        Curve(x[: begin + 1], y[: begin + 1], "model, extrapolated", "model", "--"),
    ]
    if np.isfinite(reach).any():
        curves.insert(0, Curve(x, y, "model, 95 % interval", "model", "band", reach=reach))
    if e.measured:
        at, of = np.array([[loop.figures.amplitude, getattr(loop.figures, column.key)] for loop in e.measured]).T
        spread = [0.0 if loop.spread is None else getattr(loop.spread, column.key) for loop in e.measured]
        curves.append(Curve(at, of, "measured, by cycle", "measured", "o", reach=spread))
    unit = scaled(column, float(np.abs(y).max()))
    ends = " to ".join(f"{in_unit(float(y[k]), unit, 3)} at {in_unit(float(x[k]), e.length, 3)}" for k in (0, -1))
    sentence = f"Model's {column.words} from {ends}; measured loops: {len(e.measured)}."
    title = f"{column.words.capitalize()} over amplitude"
    return Chart(_KEYS[place], title, sentence, replace(e.length, words="amplitude"), unit, curves, "half", zero="x")


def branches(e: Evaluation) -> Chart:
    """Elastic force and saturated branches."""
    p = e.whole.parameters
    x = np.linspace(p.displacement_min, p.displacement_max, _MODEL_POINTS)
    lower, elastic, upper = (e.solver.force_with_partials(x, np.full(x.size, omega))[0] for omega in (-1.0, 0.0, 1.0))
    curves = [
        Curve(x, upper, "loading, saturated", "blue"),
        Curve(x, elastic, "elastic force FE", "model"),
        Curve(x, lower, "unloading, saturated", "green"),
    ]
    apart = in_unit(float(np.mean(upper - lower)), e.force, 3)
    sentence = f"FE between the branches that long strokes approach, {apart} apart in the mean."
    return Chart("branches", "Elastic force and saturated branches", sentence, e.length, e.force, curves, "half")


def transmissibility(e: Evaluation) -> Chart | str:
    """Absolute transmissibility under three levels of base motion, or why it cannot be had.

    Unless a mass is given it is one whose weight rests near the middle of the range.
    """
    p, refusal = e.whole.parameters, "no mass rests on this spring by its own weight."
    x = p.displacement_min + np.array(_PLACES) * (p.displacement_max - p.displacement_min)
    weights = e.solver.force_with_partials(x, 0.0 * x)[0]
    # Two digits, as somebody would ask for.
    resting = [float(f"{weight / STANDARD_GRAVITY:.2g}") for weight in weights.tolist() if weight > 0.0]
    for mass in resting if e.mass is None else [e.mass]:
        try:
            system = IsolatedMass(p, mass)
            equilibrium = static_equilibrium(system)
            travel, frequencies = free_travel(system, equilibrium), band_frequencies(None, _BAND_POINTS, equilibrium)
            responses = [
                frequency_response(system, Excitation.BASE_DISPLACEMENT, share * travel, frequencies)
                for share in DEFAULT_SHARES
            ]
            break
        except IsolationError as error:
            refusal = refusal if e.mass is None else str(error)
    else:
        return f"Transmissibility: {refusal}"
    motions = []
    for response in responses:
        level = f"base ±{in_unit(response.level, scaled(drawing.DISPLACEMENT, response.level), 2)}"
        x, y = response.column("frequency"), response.column("transmissibility")
        motions.append(Steady(x, y, ~response.unstable, level))
    peaks = [response.resonance for response in (responses[0], responses[-1])]
    small, large = (f"{peak.transmissibility:.3g} at {peak.frequency:.3g} Hz" for peak in peaks)
    chosen = ", of a mass that rests near mid-range" if e.mass is None else ""
    rest, natural = in_unit(equilibrium.displacement, e.length), in_unit(equilibrium.frequency, drawing.FREQUENCY, 3)
    isolates = in_unit(peaks[-1].isolation_frequency, drawing.FREQUENCY, 3)
    sentence = (
        f"Rest at {rest}{chosen}, natural frequency {natural}; resonance {small} (smallest motion) and {large}, "
        f"isolation from {isolates}."
    )
    title = f"Transmissibility of {in_unit(mass, scaled(_MASS, mass))} on one spring"
    curves = steady_curves(motions)
    return Chart("transmissibility", title, sentence, drawing.FREQUENCY, _TRANSMISSIBILITY, curves, log="xy")


CHARTS: dict[str, Callable[[Evaluation], Chart | str | None]] = {
    "loops": loops,
    "force": force,
    **{f"residuals-{over}": partial(residuals, over=over) for over in ("time", "displacement", "velocity")},
    **{_KEYS[place]: partial(over_amplitude, place=place) for place in range(len(PANELS))},
    "branches": branches,
    "transmissibility": transmissibility,
}


def plot_chart(
    identification: IdentifiedModel, chart: str = "loops", ax: Axes | None = None, record: int | None = None
) -> Axes:
    """Draw a chart of the report.

    Parameters
    ----------
    identification : IdentifiedModel
    chart : str             One of `CHARTS`.
    ax : Axes or None       To draw into; new ones of pyplot if None.
    record : int or None    Place of the record shown; all if None.

    Raises
    ------
    StrandspringError       If there is no such chart, or nothing is known of what it shows.
    """
    if chart not in CHARTS:
        raise StrandspringError(f"`chart` must be one of {', '.join(CHARTS)}, got {chart!r}.")
    found = CHARTS[chart](Evaluation(identification))
    if not isinstance(found, Chart):
        raise StrandspringError(found or f"This identification has no chart {chart!r}.")
    return found.draw(some_axes(ax)[0], record)


def write_figure(path: str | Path, identification: IdentifiedModel) -> None:
    """Write the loops as a figure (.png, .svg or .pdf) for a paper; raises StrandspringError if it cannot be."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(drawing.STYLE):
        figure = Figure((COLUMN, 0.62 * COLUMN), layout="constrained")
        loops(Evaluation(identification)).draw(figure.subplots())
        save_figure(Path(path), figure, _RESOLUTION)


def report_page(identification: IdentifiedModel, model: ModelFile, parts: Parts, details: ReportDetails) -> Page:
    """Everything a report says, with the parts of a result."""
    e = Evaluation(identification, details.mass)
    charts = {key: found for key, make in CHARTS.items() if (found := make(e)) is not None}

    def of(*subjects: str) -> list[Chart | str]:
        return [chart for key, chart in charts.items() if key.partition("-")[0] in subjects]

    noted = [(view.name, view.record.findings) for view in e.views]
    noted.append(("Not considered", tuple(finding.in_folder for finding in identification.record_findings)))
    assumed = [(name, " ".join(gathered(findings, Reader.FILE))) for name, findings in noted if findings]
    files = [(view.name, str(len(view.record)), view.record.sha256 or "not from a file") for view in e.views]
    options = json.dumps(identification.options, ensure_ascii=False, default=str)
    program = f"strandspring {model.provenance.get('version', __version__)}"
    origin = [("Method", identification.method), ("Options", options), ("Program", program)]
    result = [part for part in parts if part != str(identification.verdict)]
    signatures = [(f"{role}: name, date, signature", "") for role in ("Prepared", "Checked", "Approved")]
    sections = [
        Section("Verdict", [_headline(identification), *_tiles(e), *of("loops"), *_verdict(e)]),
        Section("Figures", [*result, *of("amplitude", "branches")]),
        Section("Fit", of("force", "residuals")),
        Section("Vibration isolation", of("transmissibility")),
        Section("What was assumed", [plain("", ("record", "what was assumed"), assumed)], is_folded=True),
        Section("Provenance", [plain("Files", _FILE, files), plain("", _ITEM, origin)], is_folded=True),
        Section("Test and release", [plain("", _ITEM, [*details.pairs, *signatures])]),
    ]
    names = {view.place: view.name for view in e.shown}
    folders = {view.record.path: view.name for view in e.views if PurePath(view.record.path).name != view.record.path}
    return Page(f"Spring identification: {model.name}", model.description, sections, names, files=folders)


def _headline(whole: IdentifiedModel) -> Notice:
    """How far the model can be relied on."""
    text, is_usable = "Not tested on held-out strokes.", None
    if whole.verdict is not None:
        text, is_usable = str(whole.verdict), whole.verdict.is_usable
    elif _POOR & {*whole.outcomes}:
        text, is_usable = "Not usable: it does not follow its own records.", False
    has_cautions = any(kind.severity in CAUTIONS for kind in whole.outcomes)
    level = Level.GOOD if is_usable and not has_cautions else Level.CARE
    return Notice(Level.POOR if is_usable is False else level, f"{text[0].upper()}{text[1:]}")


def _tiles(e: Evaluation) -> Iterator[Tile]:
    """Figures of the largest loop measured, else of the model's over its range, and how well it fits."""
    whole, p = e.whole, e.whole.parameters
    measured = max(e.measured, key=lambda loop: loop.figures.amplitude, default=None)
    whole_range = steady_loop(e.solver, p.displacement_min, p.displacement_max).figures
    figures, modelled = (whole_range, None) if measured is None else (measured.figures, measured.predicted)
    at = f"at ±{in_unit(figures.amplitude, e.length, 3)}"
    for column in PANELS:
        unit = replace(scaled(column, getattr(figures, column.key)), digits=3)
        value, model = (unit.text(getattr(of, column.key)) for of in (figures, modelled or figures))
        note = f"model, {at}" if measured is None else f"measured {at}; model {model}"
        yield Tile(column.words.capitalize(), value, unit.shown, note)
    yield Tile("RNL", in_unit(whole.rnl), "", "saved spring alone; 1 is perfect")
    if (ratio := energy_ratio(whole.figures)) is not None:
        yield Tile("Loop energy", percent(ratio, 3), "", "of measured, saved spring alone")
    if whole.certainty is not None:
        yield Tile("Missed", percent(whole.certainty.lack.missed), "", "of the force's deviation, beside noise")


def _verdict(e: Evaluation) -> Iterator[Any]:
    """Rate and overlap of the records, errors on held-out strokes, and what was found."""
    whole = e.whole
    rate, overlap = campaign_verdicts(whole.records)
    unknown = "The model is rate independent; these records do not show whether the spring is."
    yield unknown if rate is None else rate.sentence
    if overlap is not None:
        yield overlap.sentence
    if whole.verdict is not None and whole.verdict.whole is not None:
        errors = {"this spring": whole.verdict.whole.error, **whole.verdict.whole.plain}
        header = ("model", "error, share of the force's standard deviation")
        yield plain("Held-out error", header, [(name, percent(error)) for name, error in errors.items()])
    for finding in (*whole.findings, *relaxed_branches(whole.parameters)):
        level = Level.CARE if finding.kind.severity in CAUTIONS else Level.INFORMATION
        yield Notice(level, words(finding, Reader.FILE))
