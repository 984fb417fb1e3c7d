"""From records to springs: all of one spring (`identify`), or each of its own (`identify_many`)."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
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
from ..ground.options import Option, takes
from ..ground.result_columns import ResultColumn
from ..identification.identified import IdentifiedModel
from ..identification.identify import identify_records
from ..identification.options import Method
from ..loops.campaign import Overlap, RateIndependence, campaign_verdicts
from ..loops.reading import Reading
from ..model.joint import HYSTERETIC_UNITS, ForceInterval
from ..model.stated_figures import differ, effects_in_words, in_words
from .common.given import Source, given_records
from .common.model_source import Progress, unseen
from .common.result import PlottedResult, Table, picked
from .common.text import counted, fit_table, loop_table, parameter_table, shape_of, verdict_json
from .options import Fitting
from .spring import Spring

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ..campaigns.batches.batch import BatchSummary
    from ..report import ReportDetails

_AMPLITUDE = Option("number", "Amplitude", "m", least=0.0, is_open=True)
_PROBLEMS = [ResultColumn(name, "", name, name) for name in ("file", "status", "reason")]
_MEDIANS = [
    *(ResultColumn(name, "", name, name) for name in ("figure", "median", "unit")),
    ResultColumn("scatter", "1", "scatter", "+-", "%", 100.0, 2),
]
_UNITS = {**FIGURES, **HYSTERETIC_UNITS, "rmse": "N"}


class Identification(IdentifiedModel, PlottedResult):
    """An identified spring; the attributes are those of `IdentifiedModel`."""

    _stated: ClassVar = {"notes": NOTES}  # cautions are outcomes

    @cached_property
    def campaign(self) -> tuple[RateIndependence | None, Overlap | None]:
        """Whether the rate matters and whether loading paths overlap, of several records; `info` also judges one."""
        return campaign_verdicts(self.records) if len(self.records) > 1 else (None, None)

    def spring(self, name: str = "spring", description: str = "") -> Spring:
        """The spring with its figures and provenance.

        Raises
        ------
        ModelError   If the name is not an identifier.
        """
        return Spring.from_model(self.model_file(name, description))

    def parts(self, brief: bool, campaign: bool = True) -> Iterator[str | Table]:
        """The verdict, how records are followed, and parameters; then loops and, but for reports, the campaign."""
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
        yield from (f"  {pair}" for pair in self.uncertainty.get("indistinct") or ())
        yield loop_table(self.recorded)
        if self.certainty is not None:
            lack, unrecorded = self.certainty.lack, self.certainty.unrecorded
            missed = detailed(Outcome.LACK_OF_FIT, lack.numbers, Reader.PYTHON)
            yield f"  {missed if lack.is_structured else 'nothing but noise is left'}"
            yield f"  {detailed(Outcome.SMALL_LOOPS, unrecorded.numbers, Reader.PYTHON)}"
        if removed := effects_in_words(self.effects):
            yield f"  removed as the rig's: {'; '.join(map(' '.join, removed.items()))}"
        yield from (found.sentence for found in self.campaign if campaign and found is not None)

    def content(self) -> dict[str, Any]:
        """Method, parameters with their uncertainty, and what the model file holds of the fit."""
        rate, overlap = map(verdict_json, self.campaign)
        return {
            **picked(self, "method", "options", "uncertainty", "effects"),
            "parameters": self.parameters.as_dict(),
            **dict.fromkeys(("verdict", "small_loops", "lack_of_fit")),
            **self.model_file().fit,
            "records": [
                {"path": fit.path, **fit.as_json(fitted)} for fit, fitted in zip(self.fits, self.fitted, strict=True)
            ],
            "rate_independence": rate,
            "overlap": overlap,
        }

    @property
    def table(self) -> Table:
        """One parameter in each row, with standard error and 95 % interval; NaN where unknown."""
        return parameter_table(self.parameters, self.uncertainty, in_files=True)

    def to_frame(self) -> pd.DataFrame:
        """The same with the parameters' names as the index."""
        return self.table.frame().set_index("parameter")

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw measured and predicted loops, in new axes if None; `report.identification_page` has more charts."""
        from ..report.identification_page import plot_chart

        return plot_chart(self, ax=self._axes(ax)[0])

    def report(
        self, path: str | Path, name: str = "spring", details: ReportDetails | None = None, description: str = ""
    ) -> None:
        """Write a report: a page (.html) that opens offline; print it from a browser for a PDF.

        Parameters
        ----------
        path : str or Path
        name, description : str           Of the spring.
        details : ReportDetails or None   Date, operator, specimen and further lines.

        Raises
        ------
        StrandspringError   If the ending is another, or the file cannot be written.

        Examples
        --------
        >>> from tempfile import TemporaryDirectory
        >>> from strandspring import bundled_record, identify
        >>> with TemporaryDirectory() as folder:
        ...     identify(bundled_record(), reverse="displacement").report(f"{folder}/hinge.html")
        """
        from ..report import ReportDetails
        from ..report.identification_page import report_page
        from ..report.page import write_page

        parts = self.parts(brief=False, campaign=False)
        write_page(path, report_page(self, self.model_file(name, description), parts, details or ReportDetails()))


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

    The verdict of the result says how far the spring predicts strokes that it was not fitted to.

    Parameters
    ----------
    data : path, Record, DataFrame, a sequence of these, or array_like, shape (K,)
        Records of one spring, or the displacement as an array.
    force, time : array_like, shape (K,), or the column as a name or a number from 1
        Arrays beside an array; columns of files and tables, which are found by name or unit if None.
    displacement : array_like or the column of displacement   Likewise.
    reading : Reading
        How records are read and what of them is used; or its fields as keywords, such as `units`.
        Where neither these nor names such as "x [mm]" give units, files are in mm, N and s, other
        data in m, N and s.
    fitting : Fitting
        Which method identifies the spring; or its fields as keywords, such as `method`.

    Raises
    ------
    IdentificationError   With an `Outcome`, if no possible spring has made the records, a straight
                          line follows them better, or no class meets its certificate.
    RecordError           If data are no records, one is given twice, or does not suit the method.
    ValueError            If no record is given, or the method is unknown.
    TypeError             If options exclude each other, or are of another type.

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
    model = identify_records(records, fitting.chosen, fitting.save_anyway)
    return Identification(**{field.name: getattr(model, field.name) for field in fields(model)})


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

    folder: Path
    batch: BatchSummary
    left_out: tuple[Finding, ...]
    seconds: float

    @property
    def problem(self) -> str:
        """One sentence about the files that are not identified; empty if all are."""
        others = {status: self.batch.statuses[status] for status in STATUSES if status != IDENTIFIED}
        count, files = sum(others.values()), counted(self.batch.files, "spring")
        why = ", ".join(f"{number} {status}" for status, number in others.items() if number)
        are = "is" if count == 1 else "are"
        return f"{count} of {files} {are} not identified ({why}); {TABLE} says why." if count else ""

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - the tables of files hold the rest
        """How many were identified, what was wrong with the first others, medians, and the first outliers."""
        batch = self.batch
        earlier = f"; {counted(batch.earlier, 'file')} finished by an earlier run" if batch.earlier else ""
        identified = f"{batch.statuses[IDENTIFIED]} of {counted(batch.files, 'spring')} identified"
        yield f"{identified} ({self.seconds:.3g} s){earlier}"
        yield Table(_PROBLEMS, batch.problems, "The first that are not identified:")
        if batch.amplitude is not None:
            at = f"Median at an amplitude of {1e3 * batch.amplitude:.4g} mm, with the scatter over the batch:"
            rows = [{"figure": name, "unit": _UNITS[name], **figures} for name, figures in batch.figures.items()]
            yield Table(_MEDIANS, rows, at)
        if batch.short_count:
            yield f"{counted(batch.short_count, 'spring')} not tested at this amplitude, first: {batch.short}"
        if not batch.judged:
            yield f"Outliers are looked for among {FEWEST} identified springs or more."
            return
        rule = f"robust z of the logarithm beyond {LIMIT} in {', '.join(JUDGED)}"
        yield f"Outliers: {batch.outlier_count or 'none'} ({rule})"
        yield from (f"  {file}: {', '.join(names)}" for file, names in batch.outliers.items())

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
        """The same; an apostrophe precedes text that a spreadsheet would take for a formula."""
        import pandas as pd

        # Only empty cells are unknown: a file may be called NA.csv.
        return pd.read_csv(self.batch.table, keep_default_na=False, na_values=[""], dtype={"file": str, "reason": str})

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw energy over secant stiffness at the common amplitude; in new axes if None."""
        (axes,), frame = self._axes(ax), self.to_frame()
        for is_outlier, rows in frame.groupby(frame["outlier"].notna()):
            style, label = ("C3o", "outliers") if is_outlier else ("C0o", "springs")
            axes.plot(1e-3 * rows["secant stiffness [N/m]"], rows["energy per cycle [J]"], style, label=label)
        at = "" if self.batch.amplitude is None else f" at {1e3 * self.batch.amplitude:.4g} mm"
        axes.set(xlabel="secant stiffness [N/mm]", ylabel="energy per cycle [J]", title=f"Loops{at}")
        axes.legend()
        return axes

    def content(self) -> dict[str, Any]:
        """Counts, problems, medians, outliers and findings, and where the tables are."""
        batch = self.batch
        return {
            "folder": self.folder,
            **picked(batch, "table", "columnar_table", "files", "earlier", "problems", "amplitude", "figures"),
            "statuses": {status: batch.statuses[status] for status in STATUSES},
            "short": batch.short_count,
            "outliers": {"count": batch.outlier_count if batch.judged else None, "first": batch.outliers},
            "cautions": batch.found.as_json(CAUTIONS),
            "notes": batch.found.as_json((*NOTES, Severity.STATED)),
            "left_out": tuple(gathered(self.left_out, Reader.FILE)),
            "seconds": self.seconds,
        }


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

    One damaged file does not stop the others. The folder gets model files, and `springs.csv` (with
    pyarrow also `springs.parquet`) with a row for each file. The same call again, also after an
    interrupt, identifies only files that are new or have changed.

    Parameters
    ----------
    sources : path or sequence of paths
        Files, and folders: of these the files that are named like records, not those in folders within.
    folder : path               Of the results, created if it does not exist.
    reading : Reading           How files are read and what of them is used; or its fields as keywords.
    fitting : Fitting           Which method identifies the springs; or its fields as keywords.
    amplitude : float or None   Of the loops compared [m]; the largest that all springs have if None.
    placing : Workers           Where that is done, on all cores by default; or its fields as keywords.
    progress : callable         Called with what is done, the files finished, and their number.

    Raises
    ------
    RecordError         If there is no file, or a unit, a selection or the amplitude is none.
    StrandspringError   If results cannot be written, or the workers cannot work.
    TypeError           If options exclude each other, or are of another type.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from strandspring import Spring, SpringParameters, identify_many
    >>> spring = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> with TemporaryDirectory() as place:
    ...     spring.synthesize([0.02, 0.012]).save(f"{place}/good.csv", "mm")
    ...     Path(f"{place}/empty.csv").touch()
    ...     result = identify_many(place, f"{place}/models", workers=1)
    ...     result.to_frame()["status"].tolist()
    ['unreadable', 'identified']
    >>> result.problem
    '1 of 2 springs is not identified (1 unreadable); springs.csv says why.'
    """
    from ..campaigns.batches.batch import identify_batch  # slow to import

    work = BatchWork(fitting.chosen, reading, fitting.save_anyway)
    if amplitude is not None:
        amplitude = _AMPLITUDE.checked("amplitude", amplitude, RecordError)
    begin, target = monotonic(), Path(folder)
    springs, left_out = find_springs([sources] if isinstance(sources, str | os.PathLike) else sources, target)
    done = lambda files: progress("Identifying", files, len(springs))  # noqa: E731
    batch = identify_batch(springs, target, work, placing, amplitude, done)
    return ManyResult(target, batch, left_out, monotonic() - begin)
