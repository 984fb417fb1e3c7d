"""What studies have in common: where their runs are executed, and their results as text, tables and JSON."""

from __future__ import annotations

import os
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar

from ...campaigns.jobs.runners import Runner
from ...campaigns.studies.execution import run_study
from ...campaigns.studies.runs import Runs
from ...campaigns.studies.summaries import QUANTILES, read_results, summaries
from ...findings import Finding
from ...ground.result_columns import ResultColumn
from ...ground.scratch import TemporaryFolder
from ..common.progress import Progress
from ..common.result import PlottedResult
from ..common.table import table_lines, without_constants

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_MOST_SHOWN = 1000  # rows in words
_DECIMALS = 9  # beyond which a figure is rounding
_TITLES = {"median": "median", "q05": "5 %", "q95": "95 %"}

Planned = TypeVar("Planned", bound=Runs[Any])


def executed(
    study: Runs[Any],
    runner: Runner,
    output: str | os.PathLike[str] | None,
    progress: Progress,
    notify: Callable[[str], None],
) -> tuple[pd.DataFrame, Path | None, pd.DataFrame | None]:
    """Execute a study with its results in a file, a temporary one if none is asked for.

    Returns
    -------
    DataFrame           See `summaries`.
    Path or None        The file with the rows.
    DataFrame or None   The rows, where there is no file.
    """

    def run(results: Path) -> pd.DataFrame:
        run_study(study, results, runner, lambda runs: progress("Running", runs, len(study)), notify)
        return summaries(study, results)

    if output is not None:
        return run(Path(output)), Path(output), None
    with TemporaryFolder() as folder:
        results = folder / "results.csv"
        return run(results), None, read_results(study, results)


@dataclass(frozen=True, eq=False, repr=False)
class AnyStudyResult(PlottedResult, Generic[Planned]):
    """Runs of a study, and what they say of each candidate at each grid point.

    Attributes
    ----------
    study : Runs
    output : Path or None     File with one line for each run, if one was asked for.
    known : tuple of Finding  What limits the worth of the result whatever its runs say.
    """

    _rows: ClassVar[str] = "grid points"  # what the rows of the table are
    _brief: ClassVar[Sequence[str]]  # keys of the figures that everybody has to know

    study: Planned
    _summaries: pd.DataFrame
    output: Path | None
    _frame: pd.DataFrame | None
    known: tuple[Finding, ...]

    def to_frame(self) -> pd.DataFrame:
        """One row for each run, in SI units."""
        return self._frame.copy() if self._frame is not None else read_results(self.study, Path(self.output or ""))

    def quantiles(self) -> pd.DataFrame:
        """One row for each candidate at each grid point: what it is, what was counted, and 5, 50 and 95 % quantiles of
        the figures in SI units.
        """
        return self._summaries.copy()

    @property
    @abstractmethod
    def headline(self) -> str:
        """What was run, in words."""

    @abstractmethod
    def _head(self, point: dict[str, Any]) -> dict[str, str]:
        """The cells before the figures, by heading."""

    @abstractmethod
    def _where(self, point: dict[str, Any]) -> str:
        """The grid point and the candidate in words."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What limits the worth of the result."""
        return self.known

    def brief(self, width: int | None = None) -> list[str]:
        """The same with the 5 and 95 % quantiles of a figure as its range, and what all grid points share before."""
        shown = list(records(self._summaries.head(_MOST_SHOWN)))
        printed = [figure for figure in self.study.figures if figure.key in self._brief]
        ends = ("q05", "q95") if self.study.draws and self.study.rows_of_draws else ("median", "median")
        rows = [
            [*self._head(point).values(), *(_range(*(_cell(point, figure, end) for end in ends)) for figure in printed)]
            for point in shown
        ]
        figures = [figure.heading for figure in printed]
        headings = [*(self._head(shown[0]) if shown else ()), *figures]
        headings, rows, shared = without_constants(headings, rows, {"candidate", "verdict", *figures})
        of_all = [f"Throughout: {shared}"] if shared else []
        if ends[0] != ends[1]:
            of_all.append("Figures are 5 to 95 % of the draws.")
        table = table_lines(headings, rows, {"candidate", "verdict", "least margin"}, width)
        return [self.headline, *of_all, *table, *self._remarks(shown)]

    def text_lines(self, width: int | None = None) -> list[str]:
        """What was counted, quantiles and refusals in words, in tables of at most a width."""
        shown = list(records(self._summaries.head(_MOST_SHOWN)))
        printed = [figure for figure in self.study.figures if figure.short]
        titles = _TITLES if self.study.draws and self.study.rows_of_draws else {"median": ""}
        several = len(titles) > 1
        rows = []
        head: dict[str, str] = {}
        for point in shown:
            head = self._head(point)
            for end, title in titles.items():
                first = list(head.values()) if end == "median" else [""] * len(head)
                rows.append([*first, *([title] if several else []), *(_cell(point, figure, end) for figure in printed)])
        headings = [*head, *([""] if several else []), *(figure.heading for figure in printed)]
        table = table_lines(headings, rows, {"candidate", "verdict", "least margin"}, width)
        return [self.headline, *table, *self._remarks(shown)]

    def _remarks(self, shown: Sequence[dict[str, Any]]) -> list[str]:
        """What is to be said of the rows that are shown, and of others."""
        runs = len(self.study) // len(self._summaries)
        lines = [
            f"  {self._where(point)}: {point['refused']} of {runs} refused, most often: {point['reason']}"
            for point in shown
            if point["refused"]
        ]
        more = len(self._summaries) - len(shown)
        return [*lines, *([f"  and {more} more {self._rows}, all of them in the results file"] if more else [])]

    def as_json(self) -> dict[str, Any]:
        """The result as the command prints it with --json."""
        columns = {f"{figure.key}_{end}" for figure in self.study.figures for end in QUANTILES}
        return {
            "runs": len(self.study),
            "draws": self.study.draws,
            "seed": self.study.seed,
            **self.findings_json,
            "points": [
                {
                    **{name: value for name, value in point.items() if name not in columns},
                    "figures": {figure.key: _quantiles(point, figure) for figure in self.study.figures},
                }
                for point in records(self._summaries)
            ],
        }

    def _overview(self) -> pd.DataFrame:
        return self.quantiles()

    def _bars(self, axes: Axes, table: pd.DataFrame, figures: Mapping[str, float], **style: Any) -> None:
        """Draw medians of two figures, times a factor each, with bars from 5 to 95 %."""
        x, y = (f * table[[f"{key}_{end}" for end in QUANTILES]].to_numpy(float).T for key, f in figures.items())
        axes.errorbar(
            x[1], y[1], xerr=(x[1] - x[0], x[2] - x[1]), yerr=(y[1] - y[0], y[2] - y[1]), elinewidth=0.8, **style
        )
        axes.grid(alpha=0.3)
        axes.legend()


def records(table: pd.DataFrame) -> Iterator[dict[str, Any]]:
    """The rows of a table, None where a value is unknown."""
    names = table.columns.tolist()
    for row in table.itertuples(index=False, name=None):
        yield {name: None if value != value else value for name, value in zip(names, row, strict=True)}


def _quantiles(point: dict[str, Any], figure: ResultColumn) -> dict[str, float] | None:
    quantiles = {end: point[f"{figure.key}_{end}"] for end in QUANTILES}
    return None if None in quantiles.values() else quantiles


def _range(low: str, high: str) -> str:
    return low if low == high else f"{low}{' to ' if low.startswith('-') else '-'}{high}"


def _cell(point: dict[str, Any], figure: ResultColumn, end: str) -> str:
    value = point[f"{figure.key}_{end}"]
    return "-" if value is None else f"{round(figure.factor * value, _DECIMALS):.4g}"
