"""A model beside records: figures of its loops (`info`), and the force that it predicts along them (`predict`)."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..core.parameters import SpringParameters
from ..errors import OptionError, RecordError
from ..findings import Finding, Outcome
from ..ground.arguments import numbers
from ..ground.files import write_csv
from ..ground.options import refuse_given, takes
from ..ground.quoting import printable
from ..ground.strict_json import objects
from ..identification.figures import Followed, RecordFit, predict_record
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver
from ..loops.campaign import Overlap, RateIndependence, campaign_verdicts
from ..loops.cycles import MeasuredLoop, measured_loops
from ..loops.loop import PANELS, Loop, relaxed_branches, steady_loop
from ..loops.reading import Reading
from ..model.coordinates import counted_from, zero_sentence
from ..model.joint import ForceInterval, JointCovariance
from ..model.modelfile import ModelFile, is_fmu
from ..model.stated_cautions import stated_cautions
from ..model.stated_figures import in_words, stated_fit, stated_fits, stated_json, stated_verdict
from ..records.record import Record
from .common.given import Source, effects_of, given_records, of_records, outside, records_of, unrecorded
from .common.model_source import ModelSource, describes_system, model_of, origin_of, path_of, source_of
from .common.result import PlottedResult, Table
from .common.text import fit_table, loop_table, parameter_table, shape_of, verdict_json

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from .fmus.system_fmu import SystemInformation

_DEFAULT_SHARES = (0.25, 0.5, 0.75, 1.0)  # of the identified half range
_SLACK = 1e-3  # share of the identified range by which a loop may pass it: cycles differ by as much
# Of files, by the columns of a prediction.
_HEADINGS = {
    "displacement": "displacement [mm]", "force": "force [N]", "predicted": "predicted force [N]",
    "lower": "lower [N]", "upper": "upper [N]",
}  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Information(PlottedResult):
    """A model's loops, and those of records with the model's between the same turning points.

    Attributes
    ----------
    source : str                   The model file's path, or the model's name.
    model : ModelFile              As it was given.
    zero : float                   Displacement of the records at which displacements are 0 here [m].
    parameters : SpringParameters  The model's, counted from that zero.
    records : tuple of Record      Counted likewise.
    modelled : tuple of Loop       The model's loops of the amplitudes asked for.
    loops : tuple of MeasuredLoop  Of the records, each with the model's steady loop as the predicted one.
    rate_independence : RateIndependence or None   Whether the force depends on the frequency.
    overlap : Overlap or None      Whether the loading paths of different amplitudes overlap.
    findings : tuple of Finding
    """

    _size, _grid = (12.0, 4.0), (1, 3)

    source: str
    model: ModelFile
    zero: float
    parameters: SpringParameters
    records: tuple[Record, ...]
    modelled: tuple[Loop, ...]
    loops: tuple[MeasuredLoop, ...]
    rate_independence: RateIndependence | None
    overlap: Overlap | None
    findings: tuple[Finding, ...]

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """The model, its parameters, its loops beside those of the records, and the verdicts."""
        model, origin = self.model, self.model.provenance  # free JSON, of which any part may be missing
        yield f"Model {model.name} ({self.source})" + (f": {model.description}" if model.description else "")
        interval = ForceInterval.from_uncertainty(model.uncertainty)
        method = f" by the {printable(origin['method'])} method" if "method" in origin else ""
        of_each = [(f"  {fit.name}", fit) for fit in stated_fits(model)]
        figures = [(f"identified{method}", stated_fit(model)), *(of_each if len(of_each) > 1 else ())]
        files = [printable(entry["file"]) for entry in objects(origin.get("records")) if "file" in entry]
        effects = effects_of(model)
        lines = [
            stated_verdict(model),
            shape_of(self.parameters),
            interval.sentence if interval else "",
            *map(printable, model.uncertainty.get("indistinct") or ()),
            *(f"{of}: {in_words(f.alone)}{f' ({f.beside})' if f.beside else ''}" for of, f in figures if f),
            f"from {', '.join(files)}" if files else "",
            f"removed from the records, as effects of the rig: {effects}" if effects else "",
            zero_sentence(self.zero),
        ]
        yield from (f"  {line}" for line in lines if line)
        yield parameter_table(self.parameters, model.uncertainty, brief)
        yield loop_table(self.loops, self.modelled)
        yield from (found.sentence for found in (self.rate_independence, self.overlap) if found is not None)

    @property
    def table(self) -> Table:
        """One loop in each row; "from" is the record whose turning points the model has."""
        return loop_table(self.loops, self.modelled, in_files=True)

    def content(self) -> dict[str, Any]:
        """Parameters, what the file states of the fit, and the loops."""
        return {
            "name": self.model.name,
            "parameters": self.parameters.as_dict(),
            "zero": self.zero,
            "fit": stated_json(self.model),
            "loops": [{key: one for key, one in row.items() if key != "from"} for row in self.table.rows],
            "rate_independence": verdict_json(self.rate_independence),
            "overlap": verdict_json(self.overlap),
        }

    def plot(self, ax: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw secant stiffness, energy and loss factor over the amplitude; returns the axes, new ones if None."""
        panels = self._axes(ax)
        frame = self.to_frame().sort_values("amplitude")
        for axis, column in zip(panels, PANELS, strict=True):
            for source, rows in frame.groupby("source", sort=False):
                amplitudes, shown = 1e3 * rows["amplitude"], column.factor * rows[column.key]
                style = "kx" if source == "model" else "o"
                axis.plot(amplitudes, shown, style, label=PurePath(str(source)).name)
            axis.set(xlabel="amplitude [mm]", ylabel=column.label)
        panels[0].legend(fontsize=8)
        return panels


@takes(reading=Reading)
def info(
    model: ModelSource,
    *data: Any,
    amplitudes: ArrayLike | None = None,
    zero: str | float | None = None,
    reading: Reading,
) -> Information | SystemInformation:
    """Figures of a model's steady loops, beside those of records; or what the FMU of a system holds.

    Parameters
    ----------
    model : Spring, ModelFile or path   A model file, or an FMU that holds one; or the FMU of a system.
    *data : Source, or arrays         Records; or arrays of displacement and force, and time if any.
    amplitudes : float or array_like  Of loops about the offset [m]; those of the records, or quarters of the range, if
                                      None.
    zero : float, "rig" or "middle"   Where displacements are counted from [m]; as in an FMU if None, else from the
                                      rig's zero if the range holds it, else from the middle.
    reading : Reading                 How records are read and cut; or its fields as keywords.

    Returns
    -------
    Information or SystemInformation

    Raises
    ------
    ModelError    If the model is not a physically possible spring.
    RecordError   If the data are no records, or hold no full cycle.
    ValueError    If an amplitude is not > 0.
    TypeError     If amplitudes are no numbers.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, info, synthesize
    >>> spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> info(spring, amplitudes=[0.01]).to_frame()["secant_stiffness"].round(1).tolist()
    [2999.9]
    >>> information = info(spring, synthesize(spring, amplitudes=[0.01, 0.02]))
    >>> information.to_frame()["source"].tolist()
    ['<spring>', 'model', '<spring>', 'model']
    """
    path = path_of(model)
    if path is not None and is_fmu(path) and describes_system(path):
        if data:
            raise OptionError(f"{path} is the FMU of a whole system; give records with a model.")
        sentence = "{option} can only be given with a model, and {where} is the FMU of a whole system; leave it out."
        refuse_given(sentence, path, amplitudes=amplitudes, zero=zero, **reading.given)
        from .fmus.system_fmu import system_information  # slow to import

        return system_information(path)
    content, source = model_of(model), source_of(model)
    reaches = () if amplitudes is None else numbers("amplitudes", amplitudes, "m")
    if not all(0.0 < reach < np.inf for reach in reaches):
        raise ValueError(f"`amplitudes` must be finite and > 0 [m], got {amplitudes!r}.")
    origin = origin_of(model, zero, content.parameters)
    p = counted_from(origin, content.parameters)
    low, high, middle = p.displacement_min, p.displacement_max, p.displacement_offset
    records = records_of(data, reading)
    findings = [*stated_cautions(content, "Of the identification"), *relaxed_branches(p)]
    findings += of_records(records, source, content)
    if not (records or reaches):
        reaches = tuple(0.5 * share * (high - low) for share in _DEFAULT_SHARES)
    solver, loops = PathSolver(p), list[MeasuredLoop]()
    records = [replace(record, displacement=record.displacement - origin) for record in records]
    for record in records:
        found = measured_loops([record])
        if not found:
            within = "was found" if record.compared is None else "lies within the selected displacements"
            raise RecordError(
                f"{record.path}: no full cycle (two consecutive strokes equal in length within 3 %) {within}; record, "
                "or select, at least one full cycle."
            )
        steady = (steady_loop(solver, loop.figures.low, loop.figures.high).figures for loop in found)
        loops += (replace(loop, predicted=figures) for loop, figures in zip(found, steady, strict=True))
    modelled = tuple(steady_loop(solver, middle - reach, middle + reach) for reach in reaches)
    slack = _SLACK * (high - low)
    seen = [(source, loop.figures, 0.0) for loop in modelled]
    for path, figures, gap in (*seen, *((loop.path, loop.figures, loop.gap) for loop in loops)):
        turning = ((figures.low, figures.high),)
        if figures.low < low - slack or figures.high > high + slack:
            findings.append(Finding(Outcome.OUTSIDE_RANGE, {"loop": turning, "range": ((low, high),)}, path))
        if gap != 0.0:
            findings.append(Finding(Outcome.OPEN_LOOP, {"loop": turning, "gap": abs(gap)}, path))
    verdicts = campaign_verdicts(records, modelled)
    return Information(source, content, origin, p, tuple(records), modelled, tuple(loops), *verdicts, tuple(findings))


@dataclass(frozen=True, eq=False, repr=False)
class Prediction(Followed, PlottedResult):
    """Predicted forces of one or more records.

    Attributes
    ----------
    source : str               The model file's path, or the model's name.
    model : ModelFile
    records : tuple of Record
    fits : tuple of RecordFit  Of each record, along its displacement as recorded.
    findings : tuple of Finding
    interval : ForceInterval and JointCovariance, or None   Of the 95 % prediction interval.
    """

    source: str
    model: ModelFile
    records: tuple[Record, ...]
    fits: tuple[RecordFit, ...]
    findings: tuple[Finding, ...]
    interval: tuple[ForceInterval, JointCovariance] | None

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """How well the model follows each record, and all if there are several."""
        if not brief:
            yield f"Predicted with {self.source}: {in_words(self.figures)}"
        yield fit_table(self.figures, self.fits)

    def content(self) -> dict[str, Any]:
        """The figures over all records, and of each."""
        return {**self.figures, "records": [{"path": fit.path, **fit.as_json()} for fit in self.fits]}

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write all samples with the number of their record; displacements in mm.

        Raises
        ------
        StrandspringError   If the file cannot be written.
        """
        frame = self.to_frame().dropna(axis="columns", how="all")
        frame["displacement"] *= 1e3
        frame["record"] = np.repeat(np.arange(1, len(self.records) + 1), [*map(len, self.records)])
        write_csv(Path(path), map(str, frame.rename(columns=_HEADINGS)), frame.itertuples(index=False))

    def to_frame(self) -> pd.DataFrame:
        """One sample in each row in SI units, with its record and the ends of the 95 % interval, NaN if unknown."""
        import pandas as pd

        frames = []
        for record, fit in zip(self.records, self.fits, strict=True):
            width: float | FloatArray = np.nan
            if self.interval is not None:
                interval, joint = self.interval
                x, start, time = record.displacement, fit.omega_start, record.rising_time
                error = joint.errors(self.model.parameters, lambda p: PathSolver(p).force(x, start, time))  # noqa: B023
                width = interval.reach(fit.predicted, error)
            columns = {"displacement": record.displacement, "force": record.force, "predicted": fit.predicted}
            ends = {"lower": fit.predicted - width, "upper": fit.predicted + width}
            frames.append(pd.DataFrame({"record": record.path, **columns, **ends}))
        return pd.concat(frames, ignore_index=True)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw measured and predicted force over displacement; returns the axes, new ones if None."""
        (axis,) = self._axes(ax)
        for number, (record, fit) in enumerate(zip(self.records, self.fits, strict=True)):
            name = f" {PurePath(record.path).name}" if len(self.records) > 1 else ""
            axis.plot(1e3 * record.displacement, record.force, color=f"C{number}", alpha=0.5, label=f"measured{name}")
            axis.plot(1e3 * record.displacement, fit.predicted, "k", lw=0.8, label=None if number else "predicted")
        axis.set(xlabel="displacement [mm]", ylabel="force [N]", title=f"RNL {self.rnl:.4f}, rmse {self.rmse:.4g} N")
        axis.legend()
        return axis


@takes(reading=Reading)
def predict(
    model: ModelSource,
    data: Source | Sequence[Source] | ArrayLike | None = None,
    force: ArrayLike | str | int | None = None,
    time: ArrayLike | str | int | None = None,
    *,
    displacement: ArrayLike | str | int | None = None,
    reading: Reading,
) -> Prediction:
    """Predict the force of records with a model, and compare it with what was measured.

    The path is the displacement as recorded. The hysteretic state at its start is unknown and estimated as one bounded
    number, `omega_start`. Without measured forces there is `Spring.response`.

    Parameters
    ----------
    model : Spring, ModelFile or path   A model file, or an FMU that holds one.
    data, force, time, displacement   Records, given as to `identify`.
    reading : Reading                 How they are read and cut; or its fields as keywords.

    Returns
    -------
    Prediction

    Raises
    ------
    ModelError    If the model is not a physically possible spring, or its uncertainty is damaged.
    RecordError   If the data are no records.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, predict, synthesize
    >>> spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> prediction = predict(spring, synthesize(spring, noise=0.01))
    >>> round(prediction.rnl, 2)
    0.99
    >>> prediction.to_frame().columns.tolist()
    ['record', 'displacement', 'force', 'predicted', 'lower', 'upper']
    """
    content, source = model_of(model), source_of(model)
    interval = ForceInterval.from_uncertainty(content.uncertainty)
    joint = JointCovariance.from_uncertainty(content.parameters, content.uncertainty)
    records = tuple(given_records(data, force, time, displacement, reading))
    if not records:
        raise ValueError("`data` must hold at least one record, got none.")
    findings = [*of_records(records, source, content)]
    for record in records:
        findings += outside(record.path, record.displacement, content.parameters)
        findings += unrecorded(source, content, record)
    solver = PathSolver(content.parameters)
    fits = tuple(predict_record(solver, record) for record in records)
    known = None if interval is None or joint is None else (interval, joint)
    if known is None:
        findings.append(Finding(Outcome.NO_INTERVAL, {}, source))
    return Prediction(source, content, records, fits, tuple(findings), known)
