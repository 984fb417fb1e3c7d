"""The result of a study of a spring or of a system, and where its runs are executed."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...campaigns.jobs.options import Workers
from ...campaigns.studies.execution import run_study
from ...campaigns.studies.runs import Runs
from ...campaigns.studies.summaries import QUANTILES, read_results, summaries
from ...findings import Finding
from ...ground.result_columns import ResultColumn
from ...ground.scratch import TemporaryFolder
from ...model.coordinates import zero_sentence
from ..common.progress import Progress
from ..common.result import PlottedResult
from ..common.table import Table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_MOST_SHOWN = 1000  # rows in words


def executed(
    study: Runs[Any],
    placing: Workers,
    output: str | os.PathLike[str] | None,
    progress: Progress,
) -> tuple[pd.DataFrame, Path | None, pd.DataFrame | None]:
    """Execute a study with its results in a file, a temporary one if none is asked for.

    Returns
    -------
    DataFrame           See `summaries`.
    Path or None        The file with the rows.
    DataFrame or None   The rows, where there is no file.
    """

    def run(results: Path) -> pd.DataFrame:
        done = lambda runs: progress("Running", runs, len(study))  # noqa: E731
        run_study(study, results, placing.runner, done, placing.notify)
        return summaries(study, results)

    if output is not None:
        return run(Path(output)), Path(output), None
    with TemporaryFolder() as folder:
        results = folder / "results.csv"
        return run(results), None, read_results(study, results)


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult(PlottedResult):
    """Runs of a study, and what they say of each candidate at each grid point.

    The columns of `to_frame` are those of the study: of a spring the attributes of `RunRow`, of a system those of the
    results file. The figures of a candidate are the worst of all cases; margins are shares of a limit that are left.

    Attributes
    ----------
    study : Runs              A `Study` of a spring, or a `SystemStudy`.
    output : Path or None     File with one line for each run, if one was asked for.
    known : tuple of Finding  What limits the worth of the result whatever its runs say.
    name : str                Of the model or the system.
    zero : float or None      Where displacement of a spring is counted from [m].
    """

    _size = (8.0, 5.5)

    study: Runs[Any]
    _summaries: pd.DataFrame
    output: Path | None
    _frame: pd.DataFrame | None
    known: tuple[Finding, ...]
    name: str
    zero: float | None = None

    def to_frame(self) -> pd.DataFrame:
        """One row for each run, in SI units but for the varied values of a system."""
        return self._runs().set_axis(self.study.names, axis="columns")

    @property
    def table(self) -> Table:
        """The same, as in the results file."""
        return Table(self.study.columns, list(_records(self._runs())))

    def _runs(self) -> pd.DataFrame:
        return read_results(self.study, Path(self.output or "")) if self._frame is None else self._frame

    def quantiles(self) -> pd.DataFrame:
        """One row for each candidate at each grid point: what it is, what was counted, and 5, 50 and 95 % quantiles of
        the figures in SI units.
        """
        return self._summaries.copy()

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What limits the worth of the result."""
        return (
            *self.known,
            *(finding for point in _records(self._summaries) for finding in self.study.findings(point)),
        )

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - its table knows
        """What was counted, the figures from the 5 to the 95 % quantile, and refusals."""
        study, shown = self.study, list(_records(self._summaries.head(_MOST_SHOWN)))
        yield f"{self.name}: {study.headline(self._summaries)}"
        rows, columns, details = [{**point, **_ranges(point, study.figures)} for point in shown], [*study.head], []
        for figure in (figure for figure in study.figures if figure.short):
            columns.append(figure)
            details += [] if figure.key in study.few else [figure.key]
            if study.draws and study.rows_of_draws:
                median = f"{figure.key}_median"
                columns.append(replace(figure, key=median, short="median", shown=""))
                details.append(median)
        if study.draws and study.rows_of_draws:
            yield "Figures are 5 to 95 % of the draws."
        varied = {"candidate", "verdict", *(figure.key for figure in study.figures)}
        yield Table(columns, rows, details=details, varied=varied)
        runs = len(study) // len(self._summaries)
        for point in shown:
            if point["refused"]:
                refused = f"{point['refused']} of {runs} refused, most often: {point['reason']}"
                yield f"  {study.where(point)}: {refused}"
        if more := len(self._summaries) - len(shown):
            yield f"  and {more} more {study.rows_are}, all of them in the results file"
        if self.zero is not None and (counted := zero_sentence(self.zero)):
            yield counted

    def content(self) -> Mapping[str, Any]:
        """What was run, and the quantiles of each candidate at each grid point."""
        study = self.study
        quantiles = {f"{figure.key}_{end}" for figure in study.figures for end in QUANTILES}
        points = []
        for point in _records(self._summaries):
            of_figures = {}
            for figure in study.figures:
                ends = {end: point[f"{figure.key}_{end}"] for end in QUANTILES}
                of_figures[figure.key] = None if None in ends.values() else ends
            of_point = study.stated_point({name: value for name, value in point.items() if name not in quantiles})
            points.append({**of_point, "figures": of_figures})
        of = {"name": self.name} if self.zero is None else {"zero": self.zero}
        counts = {"runs": len(study), "draws": study.draws, "seed": study.seed}
        return {**of, **study.stated, **counts, "points": points}

    def _overview(self) -> pd.DataFrame:
        return self.quantiles()

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw transmissibility over frequency at resonance, or the acceleration over the stroke of systems in the
        colours of their verdicts, with bars from 5 to 95 % of the draws.

        Parameters
        ----------
        ax : Axes or None   Of matplotlib; those of a new figure if None.
        """
        (axes,) = self._axes(ax)
        x, y = (next(figure for figure in self.study.figures if figure.key == key) for key in self.study.drawn)
        for group, look in self.study.groups(self._summaries):
            rows = group.dropna(subset=[f"{figure.key}_median" for figure in (x, y)])
            ends = [f.factor * rows[[f"{f.key}_{end}" for end in QUANTILES]].to_numpy(float).T for f in (x, y)]
            bars = [(median - low, high - median) for low, median, high in ends]
            axes.errorbar(ends[0][1], ends[1][1], xerr=bars[0], yerr=bars[1], elinewidth=0.8, **look)
        axes.set(xlabel=x.label, ylabel=y.label, title=self.name)
        axes.grid(alpha=0.3)
        axes.legend()
        return axes


def _records(table: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """The rows of a table, None where a value is unknown."""
    names = table.columns.tolist()
    for row in table.itertuples(index=False, name=None):
        yield {name: None if value != value else value for name, value in zip(names, row, strict=True)}


def _ranges(point: Mapping[str, Any], figures: Sequence[ResultColumn]) -> dict[str, tuple[float, float] | None]:
    """From the 5 to the 95 % quantile of each figure."""
    ends = {figure.key: (point[f"{figure.key}_q05"], point[f"{figure.key}_q95"]) for figure in figures}
    return {key: None if None in pair else pair for key, pair in ends.items()}
