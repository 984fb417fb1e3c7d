"""`info`: figures of a model's loops, beside those of records."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.parameters import SpringParameters
from ...errors import OptionError, RecordError
from ...findings import Finding, Outcome
from ...ground.arguments import numbers
from ...ground.options import refuse_given, takes
from ...ground.quoting import printable
from ...ground.result_columns import values
from ...kernel.path import PathSolver
from ...loops.campaign import Overlap, RateIndependence, campaign_verdicts
from ...loops.cycles import MeasuredLoop, measured_loops
from ...loops.loop import (
    LOOP_FIGURES,
    PANELS,
    Loop,
    LoopFigures,
    relaxed_branches,
    steady_loop,
)
from ...loops.reading import Reading
from ...model.coordinates import counted_from, zero_sentence
from ...model.joint import ForceInterval
from ...model.modelfile import ModelFile, is_fmu
from ...model.stated_cautions import stated_cautions
from ...model.stated_figures import in_words, stated_fit, stated_fits, stated_json, stated_verdict
from ...records.record import Record
from ..common.given import records_of
from ..common.model_source import ModelSource, describes_system, model_of, origin_of, path_of, source_of
from ..common.record_findings import effects_of, of_records, removed_effects
from ..common.result import PlottedResult
from ..common.table import Table
from ..common.text import loop_table, parameter_table, shape_of, verdict_json

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..fmus.system_fmu import SystemInformation

_DEFAULT_SHARES = (0.25, 0.5, 0.75, 1.0)  # of the identified half range
_SLACK = 1e-3  # share of the identified range by which a loop may pass it: cycles differ by as much
_DRAWN = 60  # amplitudes of the modelled line in a plot


@dataclass(frozen=True, eq=False, repr=False)
class Information(PlottedResult):
    """A model's loops, and those of records with the model's between the same turning points.

    Attributes
    ----------
    source : str                            The model file's path, or the model's name.
    model : ModelFile                       As it was given.
    zero : float                            Displacement of the records at which displacements are 0 here [m].
    parameters : SpringParameters           The model's, counted from that zero.
    records : tuple of Record               Counted likewise.
    modelled : tuple of Loop                The model's loops of the amplitudes asked for.
    loops : tuple of MeasuredLoop           Loops of the records, each with the model's steady one as the predicted one.
    rate_independence : RateIndependence or None   Whether the force depends on the frequency.
    overlap : Overlap or None               Whether the loading paths of different amplitudes overlap.
    findings : tuple of Finding             Those of the identification; loops that run backwards, are open or leave
                                            the identified range; effects of the rig that were removed.
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

    @property
    def verdicts(self) -> tuple[str, ...]:
        """The sentences on rate and overlap, as far as there are any."""
        return tuple(verdict.sentence for verdict in (self.rate_independence, self.overlap) if verdict is not None)

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """The model, its parameters, its loops beside those of the records, and the verdicts."""
        yield from self._model_lines()
        yield parameter_table(self.parameters, self.model.uncertainty, brief)
        yield loop_table(self.loops, self.modelled)
        yield from self.verdicts

    @property
    def table(self) -> Table:
        """One loop in each row: source ("model" or a record's path), the figures of `LoopFigures`, and cycles and
        frequency of measured loops; "from" is the record between whose turning points a loop of the model runs.
        """
        return loop_table(self.loops, self.modelled, in_files=True)

    def _model_lines(self) -> list[str]:
        """The model file in words; fit and provenance are free JSON, of which any part may be missing."""
        model = self.model
        lines = [f"Model {model.name} ({self.source})" + (f": {model.description}" if model.description else "")]
        if verdict := stated_verdict(model):
            lines.append(f"  {verdict}")
        lines.append(f"  {shape_of(self.parameters)}")
        if interval := ForceInterval.from_uncertainty(model.uncertainty):
            lines.append(f"  {interval.sentence}")
        lines += [f"  {printable(sentence)}" for sentence in model.uncertainty.get("indistinct") or ()]
        origin = model.provenance
        method = f" by the {printable(origin['method'])} method" if "method" in origin else ""
        lines += list(_fit_lines(model, f"  identified{method}: "))
        records = origin.get("records")
        files = [r["file"] for r in records if isinstance(r, dict) and "file" in r] if isinstance(records, list) else []
        if files:
            lines.append(f"  from {', '.join(map(printable, files))}")
        if effects := effects_of(model):
            lines.append(f"  removed from the records, as effects of the rig: {effects}")
        if sentence := zero_sentence(self.zero):
            lines.append(f"  {sentence}")
        return lines

    def content(self) -> dict[str, Any]:
        """Parameters, what the file states of the fit, and the loops."""
        return {
            "name": self.model.name,
            "parameters": self.parameters.as_dict(),
            "zero": self.zero,
            "fit": stated_json(self.model),
            "loops": [
                *({"source": "model", **values(LOOP_FIGURES, loop.figures)} for loop in self.modelled),
                *chain.from_iterable(map(_loop_json, self.loops)),
            ],
            "rate_independence": verdict_json(self.rate_independence),
            "overlap": verdict_json(self.overlap),
        }

    def plot(self, ax: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw secant stiffness, energy per cycle and loss factor over the amplitude: the model as a line, measured
        loops as points; returns the three axes, those of a new figure if None.
        """
        panels = self._axes(ax)
        solver = PathSolver(self.parameters)
        given = [*(loop.figures for loop in self.loops), *(loop.figures for loop in self.modelled)]
        widest = max(given, key=lambda figures: figures.amplitude)
        middle = 0.5 * (widest.low + widest.high)
        reaches = np.linspace(widest.amplitude / _DRAWN, widest.amplitude, _DRAWN)
        line = [steady_loop(solver, middle - reach, middle + reach).figures for reach in reaches.tolist()]
        for axis, column in zip(panels, PANELS, strict=True):
            axis.plot(1e3 * reaches, list(map(column.drawn, line)), "k", lw=1.2, label="model")
            for number, path in enumerate(dict.fromkeys(loop.path for loop in self.loops)):
                shown = [loop.figures for loop in self.loops if loop.path == path]
                amplitudes = [1e3 * figures.amplitude for figures in shown]
                axis.plot(amplitudes, list(map(column.drawn, shown)), f"C{number}o", label=PurePath(path).name)
            axis.set(xlabel="amplitude [mm]", ylabel=column.label)
        panels[0].set_title(f"{self.model.name}, loops about {1e3 * middle:.2f} mm", fontsize=10)
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
    *data : Source, or arrays           Records; or arrays of displacement and force, and time if any.
    amplitudes : float or array_like    Of loops about the offset [m]; by default those of the records, or quarters of
                                        the identified range.
    zero : float, "rig" or "middle"     Displacement of the records from which displacements are counted [m]; by default
                                        that of an FMU, else the rig's if it lies within the range, else the middle.
    reading : Reading                   How records are read, and what of them is used; or its fields as keywords.

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
        from ..fmus.system_fmu import system_information  # slow to import

        return system_information(path)
    content = model_of(model)
    source = source_of(model)
    reaches = () if amplitudes is None else numbers("amplitudes", amplitudes, "m")
    for reach in reaches:
        if not (np.isfinite(reach) and reach > 0.0):
            raise ValueError(f"`amplitudes` must be finite and > 0 [m], got {reach!r}.")
    origin = origin_of(model, zero, content.parameters)
    parameters = counted_from(origin, content.parameters)
    records = records_of(data, reading)
    findings = [*stated_cautions(content, "Of the identification"), *relaxed_branches(content.parameters)]
    findings += of_records(records)
    if records:
        findings += removed_effects(source, content)
    records = [replace(record, displacement=record.displacement - origin) for record in records]
    solver = PathSolver(parameters)
    measured = [
        replace(loop, predicted=steady_loop(solver, loop.figures.low, loop.figures.high).figures)
        for record in records
        for loop in _loops_of(record)
    ]
    if not reaches and not records:
        reaches = tuple(
            0.5 * share * (parameters.displacement_max - parameters.displacement_min) for share in _DEFAULT_SHARES
        )
    middle = parameters.displacement_offset
    modelled = tuple(steady_loop(solver, middle - reach, middle + reach) for reach in reaches)
    loops = [*((source, loop.figures) for loop in modelled), *((loop.path, loop.figures) for loop in measured)]
    findings += [finding for loop in loops for finding in _outside(parameters, *loop)]
    findings += [_open(loop) for loop in measured if loop.gap != 0.0]
    verdicts = campaign_verdicts(records, modelled)
    return Information(
        source, content, origin, parameters, tuple(records), modelled, tuple(measured), *verdicts, tuple(findings)
    )  # fmt: skip


def _loops_of(record: Record) -> tuple[MeasuredLoop, ...]:
    """The loops of a record, of which there must be one."""
    if loops := measured_loops([record]):
        return loops
    selected = "lies within the selected displacements; select a range that holds one"
    where = "was found; record at least one full cycle" if record.compared is None else selected
    raise RecordError(f"{record.path}: no full cycle (two consecutive strokes equal in length within 3 %) {where}.")


def _loop_json(loop: MeasuredLoop) -> Iterator[dict[str, Any]]:
    """A measured loop, and the model's."""
    names = ("cycles", "frequency", "gap", "spread")
    yield {"source": loop.path, **values(LOOP_FIGURES, loop.figures), **{name: getattr(loop, name) for name in names}}
    yield {"source": "model", **values(LOOP_FIGURES, loop.predicted)}


def _fit_lines(model: ModelFile, beginning: str) -> Iterator[str]:
    """The figures that the model file states, over all records and, of several, of each."""
    whole, fits = stated_fit(model), stated_fits(model)
    for begin, fit in [(beginning, whole), *((f"    {fit.name}: ", fit) for fit in fits if len(fits) > 1)]:
        if fit is not None:
            beside = f" ({fit.beside})" if fit.beside else ""
            yield f"{begin}{in_words(fit.alone)}{beside}"


def _open(loop: MeasuredLoop) -> Finding:
    """A loop that does not close."""
    ends = (loop.figures.low, loop.figures.high)
    return Finding(Outcome.OPEN_LOOP, {"loop": (ends,), "gap": abs(loop.gap)}, loop.path)


def _outside(p: SpringParameters, source: str, figures: LoopFigures) -> Iterator[Finding]:
    """A loop that leaves the identified range."""
    low, high = p.displacement_min, p.displacement_max
    slack = _SLACK * (high - low)
    if figures.low < low - slack or figures.high > high + slack:
        ends = (figures.low, figures.high)
        yield Finding(Outcome.OUTSIDE_RANGE, {"loop": (ends,), "range": ((low, high),)}, source)
