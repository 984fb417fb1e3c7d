"""`info`: figures of a model's loops, beside those of records."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import chain
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...core.parameters import SpringParameters
from ...errors import OptionError
from ...findings import Finding, Outcome
from ...ground.arguments import numbers
from ...ground.options import refuse_given, takes
from ...ground.quoting import printable
from ...ground.result_columns import ResultColumn, cells, values
from ...kernel.path import PathSolver
from ...loops.campaign import Overlap, RateIndependence, campaign_verdicts
from ...loops.cycles import MeasuredLoop, measured_loops
from ...loops.loop import (
    LOOP_FIGURE,
    LOOP_FIGURES,
    PANELS,
    Loop,
    LoopFigures,
    relaxed_branches,
    steady_loop,
)
from ...loops.reading import Reading
from ...model.coordinates import counted_from, zero_sentence
from ...model.modelfile import ModelFile, is_fmu
from ...model.stated_cautions import stated_cautions
from ...model.stated_figures import in_words, stated_fit, stated_fits, stated_json, stated_verdict
from ...records.record import Record
from ..common.given import records_of
from ..common.model_source import ModelSource, describes_system, model_of, origin_of, path_of, source_of
from ..common.record_findings import effects_of, of_records, removed_effects
from ..common.result import PlottedResult
from ..common.table import table_lines
from ..common.text import counted, parameter_lines, verdict_json

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ..fmus.system_information import SystemInformation

_DEFAULT_SHARES = (0.25, 0.5, 0.75, 1.0)  # of the identified half range
_BRIEF = ("amplitude", "secant_stiffness", "energy_per_cycle", "loss_factor", "mean_force")
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
    pairs : tuple of (MeasuredLoop, Loop)   Loops of the records, each with the model's.
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
    pairs: tuple[tuple[MeasuredLoop, Loop], ...]
    rate_independence: RateIndependence | None
    overlap: Overlap | None
    findings: tuple[Finding, ...]

    @property
    def verdicts(self) -> tuple[str, ...]:
        """The sentences on rate and overlap, as far as there are any."""
        return tuple(verdict.sentence for verdict in (self.rate_independence, self.overlap) if verdict is not None)

    def brief(self, width: int | None = None) -> list[str]:
        """The same with fewer figures of each loop."""
        return self._lines([column for column in LOOP_FIGURES if column.key in _BRIEF], width)

    def text_lines(self, width: int | None = None) -> list[str]:
        """The model, the table of loops, and the verdicts; the table at most of a width."""
        return self._lines(LOOP_FIGURES, width)

    def _lines(self, columns: Sequence[ResultColumn], width: int | None) -> list[str]:
        headings = [*(column.heading for column in columns), "source"]
        return [*self._model_lines(), *table_lines(headings, self._cells(columns), ["source"], width), *self.verdicts]

    def _model_lines(self) -> list[str]:
        """The model file in words; fit and provenance are free JSON, of which any part may be missing."""
        model = self.model
        lines = [f"Model {model.name} ({self.source})" + (f": {model.description}" if model.description else "")]
        if verdict := stated_verdict(model):
            lines.append(f"  {verdict}")
        lines += parameter_lines(self.parameters, model.uncertainty)
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

    def _loops(self) -> Iterator[tuple[LoopFigures, MeasuredLoop | None, str]]:
        """Figures of each loop, the measured loop that they are of, and the record with whose loop the model's goes."""
        for loop in self.modelled:
            yield loop.figures, None, ""
        for measured, loop in self.pairs:
            yield measured.figures, measured, ""
            yield loop.figures, None, measured.path

    def as_json(self) -> dict[str, Any]:
        """The result as an object for JSON, in SI units."""
        return {
            "name": self.model.name,
            "parameters": self.parameters.as_dict(),
            "zero": self.zero,
            "fit": stated_json(self.model),
            "loops": [_loop_json(figures, measured) for figures, measured, _ in self._loops()],
            "rate_independence": verdict_json(self.rate_independence),
            "overlap": verdict_json(self.overlap),
            **self.findings_json,
        }

    def to_frame(self) -> pd.DataFrame:
        """One loop in each row, in SI units: source ("model" or a record's path), the figures of `LoopFigures` and, of
        measured loops, cycles and frequency; "from" is the record between whose turning points a loop of the model
        runs, empty without one.
        """
        import pandas as pd

        columns = ["source", *LOOP_FIGURE, "cycles", "frequency", "from"]
        rows = [{**_loop_json(figures, measured), "from": path} for figures, measured, path in self._loops()]
        return pd.DataFrame(rows, columns=columns).astype({"cycles": float, "frequency": float}).rename_axis("loop")

    def _cells(self, columns: Sequence[ResultColumn]) -> Iterator[list[str]]:
        """Rows of the table: the model's loops, then each measured loop with its scatter and the model's."""
        names = Counter(PurePath(path).name for path in {measured.path for measured, _ in self.pairs})
        for figures, measured, _ in self._loops():
            source = "model"
            if measured is not None:
                frequency = "" if measured.frequency is None else f", {measured.frequency:.3g} Hz"
                name = PurePath(measured.path).name
                source = (
                    f"{name if names[name] == 1 else measured.path} ({counted(measured.cycles, 'cycle')}{frequency})"
                )
            yield [*cells(columns, figures), source]
            if measured is not None and measured.spread is not None:
                yield [*cells(columns, measured.spread, "+-"), "  from cycle to cycle (standard deviation)"]

    def plot(self, ax: Sequence[Axes] | None = None) -> list[Axes]:
        """Draw secant stiffness, energy per cycle and loss factor over the amplitude: the model as a line, measured
        loops as points; returns the three axes, those of a new figure if None.
        """
        panels = self._axes(ax)
        solver = PathSolver(self.parameters)
        given = [*(measured.figures for measured, _ in self.pairs), *(loop.figures for loop in self.modelled)]
        widest = max(given, key=lambda figures: figures.amplitude)
        middle = 0.5 * (widest.low + widest.high)
        reaches = np.linspace(widest.amplitude / _DRAWN, widest.amplitude, _DRAWN)
        line = [steady_loop(solver, middle - reach, middle + reach).figures for reach in reaches.tolist()]
        for axis, column in zip(panels, PANELS, strict=True):
            axis.plot(1e3 * reaches, list(map(column.drawn, line)), "k", lw=1.2, label="model")
            for number, path in enumerate(dict.fromkeys(measured.path for measured, _ in self.pairs)):
                shown = [measured.figures for measured, _ in self.pairs if measured.path == path]
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
        from ..fmus.system_information import system_information  # slow to import

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
    measured = list(chain.from_iterable(map(measured_loops, records)))
    if not reaches and not records:
        reaches = tuple(
            0.5 * share * (parameters.displacement_max - parameters.displacement_min) for share in _DEFAULT_SHARES
        )
    middle = parameters.displacement_offset
    modelled = tuple(steady_loop(solver, middle - reach, middle + reach) for reach in reaches)
    pairs = tuple((loop, steady_loop(solver, loop.figures.low, loop.figures.high)) for loop in measured)
    loops = [*((source, loop.figures) for loop in modelled), *((loop.path, loop.figures) for loop in measured)]
    findings += [finding for loop in loops for finding in _outside(parameters, *loop)]
    findings += [_open(loop) for loop in measured if loop.gap != 0.0]
    verdicts = campaign_verdicts(records, modelled)
    return Information(
        source, content, origin, parameters, tuple(records), modelled, pairs, *verdicts, tuple(findings)
    )  # fmt: skip


def _loop_json(figures: LoopFigures, measured: MeasuredLoop | None) -> dict[str, Any]:
    shown = values(LOOP_FIGURES, figures)
    if measured is None:
        return {"source": "model", **shown}
    return {
        "source": measured.path,
        **shown,
        "cycles": measured.cycles,
        "frequency": measured.frequency,
        "gap": measured.gap,
        "spread": None if measured.spread is None else asdict(measured.spread),
    }


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
