"""`identify`: records in, an identified spring with its figures out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from ..errors import Reader
from ..findings import Finding, Outcome, detailed
from ..ground.options import takes
from ..identification.identified import IdentifiedModel
from ..identification.identify import identify_records
from ..identification.options import Method
from ..loops.reading import Reading
from ..model.joint import HYSTERETIC_UNITS
from ..model.stated_figures import differ, effects_in_words, in_words
from .common.given import Source, given_records
from .common.result import PlottedResult
from .common.text import brief_fit_lines, brief_parameter_lines, counted, fit_lines, parameter_lines
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

    _size = (6.4, 4.8)

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

    def brief(self, width: int | None = None) -> list[str]:  # noqa: ARG002 - it has no table
        """The verdict, figures of each record by the saved spring alone, those of the fit where they differ, and
        parameters.
        """
        return [
            *self._verdict,
            *brief_fit_lines(self.figures, self.fits, self.fitted),
            *brief_parameter_lines(self.parameters, self.uncertainty),
        ]

    def text_lines(self, width: int | None = None) -> list[str]:  # noqa: ARG002 - it has no table
        """The verdict, figures of the saved spring alone, those of the fit where they differ, parameters with errors,
        what the spring misses, what is known of small loops, and what the rig added.
        """
        alone = " (the saved spring alone)" if differ(self.figures, self.fitted_figures) else ""
        lines = [
            *self._verdict,
            f"Identified by the {self.method} method: {in_words(self.figures)}{alone}",
            *fit_lines(self.fits, self.fitted),
            *parameter_lines(self.parameters, self.uncertainty),
        ]
        if self.certainty is not None:
            lack, unrecorded = self.certainty.lack, self.certainty.unrecorded
            missed = detailed(Outcome.LACK_OF_FIT, lack.numbers, Reader.PYTHON)
            lines.append(f"  {missed if lack.is_structured else 'nothing but noise is left'}")
            lines.append(f"  {detailed(Outcome.SMALL_LOOPS, unrecorded.numbers, Reader.PYTHON)}")
        if removed := effects_in_words(self.effects):
            lines.append(f"  removed as the rig's: {'; '.join(map(' '.join, removed.items()))}")
        return lines

    @property
    def _verdict(self) -> list[str]:
        return [] if self.verdict is None else [str(self.verdict)]

    def as_json(self) -> dict[str, Any]:
        """The result as an object for JSON, in SI units."""
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
            "notes": self.findings_json["notes"],
        }

    def to_frame(self) -> pd.DataFrame:
        """The parameters with unit, value, standard error and 95 % interval, one in each row; NaN where unknown."""
        import pandas as pd

        numbers, known = self.parameters.as_dict(), self.uncertainty
        interval = known.get("interval_95", {})
        rows: dict[str, list[Any]] = {
            name: [unit, numbers[name], known.get(name), *interval.get(name, (None, None))]
            for name, unit in HYSTERETIC_UNITS.items()
        }
        for name, unit in (("FE_knots", "m"), ("FE_forces", "N"), ("kE", "N/m^{}"), ("kA", "1/m^{}")):
            errors = known.get(name) or [None] * len(numbers.get(name, ()))
            for k, (value, error) in enumerate(zip(numbers.get(name, ()), errors, strict=True)):
                rows[f"{name}[{k}]"] = [unit.format(k), value, error, None, None]
        frame = pd.DataFrame.from_dict(
            rows, orient="index", columns=["unit", "value", "standard_error", "low_95", "high_95"]
        )
        numeric = frame.columns[1:]
        return frame.astype(dict.fromkeys(numeric, float)).rename_axis("parameter")

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the measured and predicted loops into axes of matplotlib, those of a new figure if None.

        `strandspring.report.figure.plot_chart` draws residuals, branches, correlations and more.
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

        write_report(path, self, self.model_file(name), details)

    def __repr__(self) -> str:
        p = self.parameters
        shape = f"FE spline of {len(p.FE_knots)} knots" if p.FE_knots else f"FE of degree {len(p.kE) - 1}"
        files = ", ".join(PurePath(record.path).name for record in self.records[:3])
        more = f" and {len(self.records) - 3} more" if len(self.records) > 3 else ""
        return (
            f"<Identification of {files}{more} by the {self.method} method\n"
            f" {in_words(self.figures)}\n"
            f" kappa_omega {p.kappa_omega:.4g} N, rho {p.rho:.4g} 1/m, sigma {p.sigma:.4g}, n {p.n:.4g}, {shape}, "
            f"FA of degree {len(p.kA) - 1}\n"
            f" {counted(len(self.cautions), 'caution')}, {counted(len(self.notes), 'note')}: see .summary()>"
        )


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
