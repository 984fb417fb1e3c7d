"""From records to springs: all of one spring (`identify`), or each of its own (`identify_many`)."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, ClassVar

from numpy.typing import ArrayLike

from ..campaigns.batches.figures_in_batch import FEWEST, FIGURES, JUDGED, LIMIT
from ..campaigns.batches.sources import TABLE, find_springs
from ..campaigns.batches.spring_row import IDENTIFIED, STATUSES, BatchWork
from ..campaigns.jobs.options import Workers
from ..errors import Reader, RecordError
from ..findings import CAUTIONS, NOTES, Finding, Outcome, Severity, detailed, gathered, of_severity
from ..ground.arguments import optional_number
from ..ground.options import takes
from ..ground.result_columns import ResultColumn
from ..identification.identified import IdentifiedModel
from ..identification.identify import identify_records
from ..identification.options import Method
from ..loops.reading import Reading
from ..model.joint import HYSTERETIC_UNITS, ForceInterval
from ..model.stated_figures import differ, effects_in_words, in_words
from .common.given import Source, given_records
from .common.model_source import Progress, unseen
from .common.result import PlottedResult, picked
from .common.table import Table
from .common.text import counted, fit_table, loop_table, parameter_table, shape_of
from .options import Fitting
from .spring import Spring

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ..campaigns.batches.batch import BatchSummary
    from ..report import ReportDetails

_PROBLEMS = (
    ResultColumn("file", "", "file", "file"),
    ResultColumn("status", "", "status", "status"),
    ResultColumn("reason", "", "reason", "reason"),
)
_MEDIANS = (
    ResultColumn("figure", "", "figure", "figure"),
    ResultColumn("median", "", "median", "median"),
    ResultColumn("unit", "", "unit", "unit"),
    ResultColumn("scatter", "1", "scatter", "+-", "%", 100.0, 2),
)
_OUTLIERS = (ResultColumn("file", "", "file", "file"), ResultColumn("figures", "", "figures", "outlying in"))
_UNITS = {**FIGURES, **HYSTERETIC_UNITS, "rmse": "N"}


class Identification(IdentifiedModel, PlottedResult):
    """An identified spring with its figures and its origin; the attributes are those of `IdentifiedModel`."""

    _stated: ClassVar = {"notes": NOTES}  # cautions are outcomes

    @property
    def all_findings(self) -> tuple[Finding, ...]:
        """The findings, and those of the records beside."""
        return (*self.findings, *self.record_findings)

    @classmethod
    def from_model(cls, model: IdentifiedModel) -> Identification:
        """The same content with what people ask of it."""
        return cls(**{field.name: getattr(model, field.name) for field in fields(IdentifiedModel)})

    def spring(self, name: str = "spring", description: str = "") -> Spring:
        """The spring with its figures and provenance, ready to respond, to save and to build an FMU from.

        Raises
        ------
        ModelError   If the name is not an identifier.
        """
        return Spring.from_model(self.model_file(name, description))

    def parts(self, brief: bool) -> Iterator[str | Table]:
        """The verdict, how well the spring follows each record, and parameters; then the loops and what is missed."""
        if self.verdict is not None:
            yield str(self.verdict)
        if not brief:
            alone = " (the saved spring alone)" if differ(self.figures, self.fitted_figures) else ""
            yield f"Identified by the {self.method} method: {in_words(self.figures)}{alone}"
        yield fit_table(self.figures, self.fits, self.fitted)
        yield parameter_table(self.parameters, self.uncertainty, brief)
        yield f"  {shape_of(self.parameters)}"
        if brief:
            return
        if interval := ForceInterval.from_uncertainty(self.uncertainty):
            yield f"  {interval.sentence}"
        yield from (f"  {sentence}" for sentence in self.uncertainty.get("indistinct") or ())
        yield loop_table(self.recorded)
        if self.certainty is not None:
            lack, unrecorded = self.certainty.lack, self.certainty.unrecorded
            missed = detailed(Outcome.LACK_OF_FIT, lack.numbers, Reader.PYTHON)
            yield f"  {missed if lack.is_structured else 'nothing but noise is left'}"
            yield f"  {detailed(Outcome.SMALL_LOOPS, unrecorded.numbers, Reader.PYTHON)}"
        if removed := effects_in_words(self.effects):
            yield f"  removed as the rig's: {'; '.join(map(' '.join, removed.items()))}"

    def content(self) -> dict[str, Any]:
        """Method, parameters with their uncertainty, and what the model file holds of the fit."""
        return {
            **picked(self, "method", "options"),
            "parameters": self.parameters.as_dict(),
            "uncertainty": self.uncertainty,
            **dict.fromkeys(("verdict", "small_loops", "lack_of_fit")),
            **self.model_file().fit,
            "effects": self.effects,
            "records": [
                {"path": fit.path, **fit.as_json(fitted)} for fit, fitted in zip(self.fits, self.fitted, strict=True)
            ],
        }

    @property
    def table(self) -> Table:
        """The parameters with unit, value, standard error and 95 % interval, one in each row; NaN where unknown."""
        return parameter_table(self.parameters, self.uncertainty, in_files=True)

    def to_frame(self) -> pd.DataFrame:
        """The same with the parameters' names as the index."""
        return self.table.frame().set_index("parameter")

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the measured and predicted loops into axes of matplotlib, those of a new figure if None.

        `strandspring.report.identification_page.plot_chart` draws residuals, branches and more.
        """
        from ..report.identification_page import plot_chart

        return plot_chart(self, ax=self._axes(ax)[0])

    def report(self, path: str | Path, name: str = "spring", details: ReportDetails | None = None) -> None:
        """Write a report: a page (.html) that opens offline; print it from a browser for a PDF.

        Parameters
        ----------
        path : str or Path
        name : str               Of the spring.
        details : ReportDetails or None   Date, operator, specimen and further lines.

        Raises
        ------
        StrandspringError        If the ending is another, or the file cannot be written.

        Examples
        --------
        >>> from pathlib import Path
        >>> from tempfile import TemporaryDirectory
        >>> from strandspring import bundled_record, identify
        >>> with TemporaryDirectory() as folder:
        ...     identify(bundled_record(), reverse="displacement").report(Path(folder) / "hinge.html")
        """
        from ..report.identification_page import write_report

        write_report(path, self, self.model_file(name), self.parts(brief=False), details)


@takes(reading=Reading, fitting=Fitting)
def identify(
    data: Source | Sequence[Source] | ArrayLike | None = None,
    force: ArrayLike | Method | str | int | None = None,
    time: ArrayLike | str | int | None = None,
    *,
    displacement: ArrayLike | str | int | None = None,
    reading: Reading,
    fitting: Fitting,
) -> Identification:
    """Identify one spring from one or more records.

    The verdict of the result says how far the spring predicts strokes that it was not fitted to, and whether plain
    models do better; the findings say what the records show beside, and what to do.

    Parameters
    ----------
    data : path, Record, DataFrame, a sequence of these, or array_like, shape (K,)
        Records of one spring, or the displacement as an array.
    force, time : array_like, shape (K,), or the column as a name or a number from 1
        Arrays with an array of displacement; columns with files and tables, which are found by name or unit if None.
    displacement : array_like or the column of displacement   Likewise.
    reading : Reading
        How the records are read and what of them is used; or its fields as keywords, such as `units` and `reverse`.
        Where no unit is given, it is the one in the name of a column or a Series, such as "x [mm]"; else files are in
        mm, N and s, and arrays and DataFrames in m, N and s, with displacements within +-0.5 m. `summary` says what
        was assumed.
    fitting : Fitting
        Which method identifies the spring; or its fields as keywords: `method`, or `options` of one; and `save_anyway`.

    Returns
    -------
    Identification

    Raises
    ------
    IdentificationError   With an `Outcome`, if no physically possible spring can have made the records, the spring
                          alone follows them worse than a straight line does, or no class meets its certificate.
    RecordError           If the data are no records, a record is given twice, or does not suit the method.
    ValueError            If no record is given, or the method is unknown.
    TypeError             If `method` and `options` are given, or `save_anyway` is not a truth value.

    Examples
    --------
    >>> from strandspring import bundled_record, identify
    >>> result = identify(bundled_record(), reverse="displacement")
    >>> f"{result.rnl:.2f}"
    '0.98'
    >>> [outcome.name for outcome in result.outcomes]
    ['ONE_AMPLITUDE', 'FIRST_CYCLE_DIFFERS']
    """
    if isinstance(force, Method):
        force, fitting = None, replace(fitting, options=force)
    records = given_records(data, force, time, displacement, reading)
    return Identification.from_model(identify_records(records, fitting.chosen, fitting.save_anyway))


@dataclass(frozen=True, repr=False)
class ManyResult(PlottedResult):
    """What a batch of springs gave; each row of the table is one file.

    Attributes
    ----------
    folder : Path                Where the models and the tables are.
    batch : BatchSummary         Counts, first problems, outliers and findings.
    left_out : tuple of Finding  Files of folders that were not taken.
    seconds : float              That this run took.
    """

    _stated: ClassVar = {}  # beside `content`

    folder: Path
    batch: BatchSummary
    left_out: tuple[Finding, ...]
    seconds: float

    @property
    def is_complete(self) -> bool:
        """Whether every spring was identified."""
        return self.batch.statuses[IDENTIFIED] == self.batch.files

    @property
    def problem(self) -> str:
        """One sentence about the files that are not identified; empty without any."""
        statuses, files = self.batch.statuses, counted(self.batch.files, "spring")
        others = [f"{statuses[status]} {status}" for status in STATUSES if status != IDENTIFIED and statuses[status]]
        count = self.batch.files - statuses[IDENTIFIED]
        are = "is" if count == 1 else "are"
        return f"{count} of {files} {are} not identified ({', '.join(others)}); {TABLE} says why." if count else ""

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - the tables of files hold the rest
        """How many were identified, what was wrong with the others, medians, and outliers."""
        batch = self.batch
        identified, earlier = batch.statuses[IDENTIFIED], ""
        if batch.earlier:
            earlier = f"; {counted(batch.earlier, 'file')} finished by an earlier run"
        yield f"{identified} of {counted(batch.files, 'spring')} identified ({self.seconds:.3g} s){earlier}"
        yield self._problems
        yield from _more(batch.files - identified - len(batch.problems))
        if batch.amplitude is not None:
            at = f"Median at an amplitude of {1e3 * batch.amplitude:.4g} mm, with the scatter over the batch:"
            rows = [{"figure": name, "unit": _UNITS[name], **figures} for name, figures in self._figures.items()]
            yield Table(_MEDIANS, rows, at)
        if batch.short_count:
            yield f"{counted(batch.short_count, 'spring')} not tested at this amplitude, first: {batch.short[0]}"
        if not batch.judged:
            yield f"Outliers are looked for among {FEWEST} identified springs or more."
            return
        rule = f"robust z of the logarithm beyond {LIMIT} in {', '.join(JUDGED)}"
        yield f"Outliers: {batch.outlier_count or 'none'} ({rule})"
        yield Table(_OUTLIERS, [{"file": file, "figures": ", ".join(names)} for file, names in batch.outliers.items()])
        yield from _more(batch.outlier_count - len(batch.outliers))

    @property
    def _problems(self) -> Table:
        return Table(
            _PROBLEMS, [dict(zip(("file", "status", "reason"), row, strict=True)) for row in self.batch.problems]
        )

    @property
    def _figures(self) -> dict[str, Any]:
        return {name: {"median": middle, "scatter": scatter} for name, (middle, scatter) in self.batch.middle.items()}

    def sentences(self, severities: Collection[Severity], reader: Reader, brief: bool = False) -> tuple[str, ...]:
        """What was assumed, and cautions of the identifications, each with the number of files."""
        left_out = gathered(of_severity(self.left_out, severities), reader, brief)
        return (*left_out, *self.batch.found.lines(reader, severities, brief))

    @property
    def table(self) -> Table:
        """springs.csv, one file in each row."""
        frame = self.to_frame().astype(object)
        columns = [ResultColumn(heading, "", heading) for heading in map(str, frame)]
        return Table(columns, frame.where(frame.notna(), None).to_dict("records"))

    def to_frame(self) -> pd.DataFrame:
        """The table, one file in each row.

        Text that a spreadsheet would take for a formula is preceded by an apostrophe, as in the CSV file.
        """
        import pandas as pd

        # Only empty cells are unknown: a file may be called NA.csv.
        return pd.read_csv(self.batch.table, keep_default_na=False, na_values=[""], dtype={"file": str, "reason": str})

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the energy of each spring's loop against its secant stiffness at the common amplitude, outliers in red,
        into axes of matplotlib, those of a new figure if None.
        """
        (axes,) = self._axes(ax)
        table = self.to_frame()
        is_outlier = table["outlier"].notna()
        for color, label, rows in (("C0", "springs", table[~is_outlier]), ("C3", "outliers", table[is_outlier])):
            stiffness, energy = rows["secant stiffness [N/m]"], rows["energy per cycle [J]"]
            axes.plot(1e-3 * stiffness, energy, "o", color=color, label=label)
        at = "" if self.batch.amplitude is None else f" at {1e3 * self.batch.amplitude:.4g} mm"
        axes.set(xlabel="secant stiffness [N/mm]", ylabel="energy per cycle [J]", title=f"Loops{at}")
        axes.legend()
        return axes

    def content(self) -> dict[str, Any]:
        """Counts, problems, medians, outliers and findings, and where the tables are."""
        batch = self.batch
        return {
            "folder": self.folder,
            **picked(batch, "table", "columnar_table", "files", "earlier"),
            "statuses": {status: batch.statuses[status] for status in STATUSES},
            "problems": self._problems,
            "amplitude": batch.amplitude,
            "figures": self._figures,
            "short": batch.short_count,
            "outliers": {"count": batch.outlier_count if batch.judged else None, "first": batch.outliers},
            "cautions": batch.found.as_json(CAUTIONS),
            "notes": batch.found.as_json((*NOTES, Severity.STATED)),
            "left_out": tuple(gathered(self.left_out, Reader.FILE)),
            "seconds": self.seconds,
        }


def _more(count: int) -> list[str]:
    return [f"  and {count} more, see the table"] if count > 0 else []


@takes(reading=Reading, fitting=Fitting, placing=Workers(None))
def identify_many(
    sources: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    folder: str | os.PathLike[str],
    *,
    reading: Reading,
    fitting: Fitting,
    amplitude: float | None = None,
    placing: Workers,
    progress: Progress = unseen,
) -> ManyResult:
    """Identify many springs, each from a file of its own, on all cores.

    One damaged file does not stop the others. The folder gets a model file of each spring, and `springs.csv` (with
    pyarrow also `springs.parquet`) with one row for each file. `springs.journal.sqlite` there holds what is finished:
    the same call again, also after an interrupt, identifies only files that are new or have changed.

    Parameters
    ----------
    sources : path or sequence of paths
        Files, and folders: of these the files in them that are named like records, in alphabetical order, and not those
        in folders within them.
    folder : path               Of the results, created if it does not exist.
    reading : Reading           How all files are read and what of them is used; or its fields as keywords.
    fitting : Fitting           Which method identifies the springs; or its fields as keywords.
    amplitude : float or None   Of the loops whose figures are compared [m]; the largest that all springs have in common
                                if None.
    placing : Workers           Where the springs are identified, on all cores by default; or its fields as keywords.
    progress : callable         Called with what is being done, the number of finished files, and how many there are.

    Returns
    -------
    ManyResult

    Raises
    ------
    RecordError                 If there is no file, or a unit or selection is none.
    ValueError                  If the number of workers is below 1.
    StrandspringError           If the results cannot be written, or the workers cannot work.
    TypeError                   If workers and scheduler are given, or method and options.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import Spring, SpringParameters, identify_many
    >>> with TemporaryDirectory() as place:
    ...     for k in range(3):
    ...         spring = SpringParameters((0.0, 2000.0 + 10.0 * k), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)
    ...         Spring(spring).synthesize([0.02, 0.012]).save(Path(place) / f"spring{k}.csv", "mm")
    ...     _ = (Path(place) / "spring9.csv").write_text("")
    ...     result = identify_many(place, Path(place) / "models", workers=1)
    ...     frame = result.to_frame()
    >>> frame["status"].tolist()
    ['identified', 'identified', 'identified', 'unreadable']
    >>> result.problem
    '1 of 4 springs is not identified (1 unreadable); springs.csv says why.'
    """
    from ..campaigns.batches.batch import identify_batch  # slow to import

    work = BatchWork(fitting.chosen, reading, fitting.save_anyway)
    amplitude = optional_number("amplitude", amplitude, "m")
    if amplitude is not None and not 0.0 < amplitude < float("inf"):
        raise RecordError(f"`amplitude` must be finite and > 0 [m], got {amplitude!r}.")
    begin = monotonic()
    target = Path(folder)
    springs, left_out = find_springs([sources] if isinstance(sources, str | os.PathLike) else sources, target)
    batch = identify_batch(
        springs,
        target,
        work,
        placing.runner,
        amplitude,
        lambda done: progress("Identifying", done, len(springs)),
        placing.notify,
    )
    return ManyResult(target, batch, left_out, monotonic() - begin)
