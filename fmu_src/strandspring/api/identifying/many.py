"""`identify_many`: many files, each of one spring, identified into a folder with a table of all."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, ClassVar

from ...campaigns.batches.batch import BatchSummary, identify_batch
from ...campaigns.batches.figures_in_batch import FEWEST, FIGURES, JUDGED, LIMIT
from ...campaigns.batches.sources import TABLE, find_springs
from ...campaigns.batches.spring_row import IDENTIFIED, STATUSES, BatchWork
from ...campaigns.jobs.options import Workers
from ...errors import Reader, RecordError
from ...findings import CAUTIONS, NOTES, Finding, Severity, gathered
from ...ground.arguments import optional_number
from ...ground.options import takes
from ...ground.result_columns import ResultColumn
from ...loops.reading import Reading
from ...model.joint import HYSTERETIC_UNITS
from ..common.progress import Progress, unseen
from ..common.result import PlottedResult
from ..common.table import Table
from ..common.text import counted
from ..options import Fitting

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

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
_UNITS = {**FIGURES, **HYSTERETIC_UNITS, "rmse": "N"}


@dataclass(frozen=True, repr=False)
class ManyResult(PlottedResult):
    """What a batch of springs gave; each row of the table is one file.

    Attributes
    ----------
    folder : Path                Where the models and the tables are.
    batch : BatchSummary         Counts, first problems, outliers and findings.
    left_out : tuple of Finding  Files of folders that were not taken.
    seconds : float              That this run took.

    Examples
    --------
    See `identify_many`.
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
        if self.is_complete:
            return ""
        statuses = self.batch.statuses
        others = [f"{statuses[status]} {status}" for status in STATUSES if status != IDENTIFIED and statuses[status]]
        count = self.batch.files - statuses[IDENTIFIED]
        are = "is" if count == 1 else "are"
        of_all = f"{count} of {counted(self.batch.files, 'spring')}"
        return f"{of_all} {are} not identified ({', '.join(others)}); {TABLE} says why."

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - the tables of files hold the rest
        """How many were identified, what was wrong with the others, medians, and outliers."""
        batch = self.batch
        done = batch.files - batch.earlier
        rate = f", {done / self.seconds:.3g} springs/s" if done and self.seconds > 0.0 else ""
        were = "was" if batch.earlier == 1 else "were"
        before = f"; {counted(batch.earlier, 'file')} {were} finished by an earlier run" if batch.earlier else ""
        yield (
            f"{batch.statuses[IDENTIFIED]} of {counted(batch.files, 'spring')} identified "
            f"({self.seconds:.3g} s{rate}){before}"
        )
        yield Table(_PROBLEMS, self._problems)
        more = batch.files - batch.statuses[IDENTIFIED] - len(batch.problems)
        if more > 0:
            yield f"  and {more} more, see the table"
        if batch.amplitude is not None:
            rows = [
                {"figure": name, "median": middle, "unit": _UNITS[name], "scatter": scatter}
                for name, (middle, scatter) in batch.middle.items()
            ]
            at = f"Median at an amplitude of {1e3 * batch.amplitude:.4g} mm, with the scatter over the batch:"
            yield Table(_MEDIANS, rows, at)
        if batch.short_count:
            were = "was" if batch.short_count == 1 else "were"
            yield (
                f"{counted(batch.short_count, 'spring')} {were} not tested at this amplitude, first: {batch.short[0]}"
            )
        yield from self._outlier_lines()

    @property
    def _problems(self) -> list[dict[str, str]]:
        return [{"file": file, "status": status, "reason": reason} for file, status, reason in self.batch.problems]

    def _outlier_lines(self) -> list[str]:
        batch = self.batch
        if not batch.judged:
            return [f"Outliers are looked for among {FEWEST} identified springs or more."]
        rule = f"robust z of the logarithm beyond {LIMIT} in {', '.join(JUDGED)}"
        if not batch.outlier_count:
            return [f"No outliers ({rule})"]
        lines = [f"Outliers: {batch.outlier_count} ({rule})"]
        lines += [f"  {file}: {', '.join(figures)}" for file, figures in batch.outliers.items()]
        more = batch.outlier_count - len(batch.outliers)
        return lines if more <= 0 else [*lines, f"  and {more} more, see the table"]

    def said(self, reader: Reader, brief: bool = False) -> list[str]:
        """Cautions and notes in words for a reader, each with what it is."""
        found = self.batch.found
        cautions = found.lines(reader, CAUTIONS, brief)
        return [*map("Caution: {}".format, cautions), *map("Note: {}".format, self.notes)]

    @property
    def cautions(self) -> tuple[str, ...]:
        """Cautions of the identifications, each with the number of files."""
        return tuple(self.batch.found.lines(Reader.PYTHON, CAUTIONS))

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed, each with the number of files."""
        return (*gathered(self.left_out, Reader.PYTHON), *self.batch.found.lines(Reader.PYTHON, NOTES))

    def to_frame(self) -> pd.DataFrame:
        """The table, one file in each row.

        Text that a spreadsheet would take for a formula is preceded by an apostrophe, as in the CSV file.
        """
        import pandas as pd

        # Only empty cells are unknown: a file may be called NA.csv.
        return pd.read_csv(self.batch.table, keep_default_na=False, na_values=[""], dtype={"file": str, "reason": str})

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the energy of each spring's loop against its secant stiffness at the common amplitude; outliers are red.

        Parameters
        ----------
        ax : Axes or None   Of matplotlib; those of a new figure if None.
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
            "table": batch.table,
            "columnar_table": batch.columnar_table,
            "files": batch.files,
            "earlier": batch.earlier,
            "statuses": {status: batch.statuses[status] for status in STATUSES},
            "problems": self._problems,
            "amplitude": batch.amplitude,
            "figures": {
                name: {"median": middle, "scatter": scatter} for name, (middle, scatter) in batch.middle.items()
            },
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

    One damaged file does not stop the others. The folder gets a model file of each spring, and `springs.csv` (and
    `springs.parquet`, if pyarrow is installed) with one row for each file. `springs.journal.sqlite` there holds what is
    finished: the same call again, also after an interrupt, identifies only files that are new or have changed. The
    results do not depend on the number of workers nor on interrupts.

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
    >>> import numpy as np
    >>> from strandspring import Spring, SpringParameters, identify_many
    >>> path = 0.02 * np.sin(np.linspace(0.0, 6.0 * np.pi, 1500)) * np.repeat([1.0, 0.6, 0.3], 500)
    >>> with TemporaryDirectory() as place:
    ...     for k in range(3):
    ...         spring = SpringParameters((0.0, 2000.0 + 10.0 * k), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)
    ...         table = np.column_stack([1e3 * path, Spring(spring).response(path)])
    ...         np.savetxt(Path(place) / f"spring{k}.csv", table, delimiter=",", header="x [mm],F [N]", comments="")
    ...     _ = (Path(place) / "spring9.csv").write_text("")
    ...     result = identify_many(place, Path(place) / "models", workers=1)
    ...     frame = result.to_frame()
    >>> frame["status"].tolist()
    ['identified', 'identified', 'identified', 'unreadable']
    >>> frame["secant stiffness [N/m]"].diff()[1:3].round(2).tolist()
    [10.0, 10.0]
    >>> result.problem
    '1 of 4 springs is not identified (1 unreadable); springs.csv says why.'
    """
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
