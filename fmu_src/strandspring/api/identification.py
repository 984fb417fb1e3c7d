"""`identify`: records in, an identified spring with its figures out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from numpy.typing import ArrayLike

from ..errors import Reader
from ..findings import NOTES, Finding, Outcome, detailed
from ..ground.options import takes
from ..identification.identified import IdentifiedModel
from ..identification.identify import identify_records
from ..identification.options import Method
from ..loops.reading import Reading
from ..model.joint import ForceInterval
from ..model.stated_figures import differ, effects_in_words, in_words
from .common.given import Source, given_records
from .common.result import PlottedResult
from .common.table import Table
from .common.text import fit_table, loop_table, parameter_table, shape_of
from .options import Fitting
from .spring import Spring

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

    from ..report import ReportDetails


class Identification(IdentifiedModel, PlottedResult):
    """An identified spring with its figures and its origin; the attributes are those of `IdentifiedModel`.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, identify
    >>> import numpy as np
    >>> true = Spring(SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02))
    >>> path = 0.02 * np.sin(np.linspace(0.0, 6.0 * np.pi, 1500)) * np.repeat([1.0, 0.6, 0.3], 500)
    >>> result = identify(path, true.response(path), units={"displacement": "m", "force": "N"})
    >>> round(result.parameters.kappa_omega, 3), round(result.rnl, 4)
    (10.0, 1.0)
    >>> result.to_frame().loc["rho", "unit"]
    '1/m'
    """

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
        """The verdict, how well the spring alone follows each record, and the fit where it differs, parameters; then
        the loops, what the spring misses, what is known of small loops, and what the rig added.
        """
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
            "method": self.method,
            "options": self.options,
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

        `strandspring.report.figure.plot_chart` draws residuals, branches, figures over the amplitude and more.
        """
        from ..report.figure import plot_chart

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
