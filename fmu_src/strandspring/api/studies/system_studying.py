"""`study_system`: a SYSTEM.toml over a grid of its values, with every draw, candidate and load case."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...campaigns.jobs.cluster import Cluster
from ...campaigns.studies.run_system import run_system_study
from ...campaigns.studies.system_planning import planned_study, undrawn
from ...campaigns.studies.system_study import SystemStudy
from ...campaigns.studies.system_summaries import SystemSummaries, SystemSummary
from ...campaigns.studies.varied import Given, shown_alone
from ...errors import MountedSystemError
from ...ground.files import readable
from ...vibration.bodies.mounted import STANDARD_GRAVITY
from ...vibration.description.named_files import FilesOfFolder
from ...vibration.description.system_file import read_description
from ...vibration.verdicts.verdicts import Verdict
from ..common.plotting import save_plot, some_axes
from ..common.progress import Progress, unseen
from ..common.result import Result
from ..common.text import counted
from ..common.text_table import table_lines
from ..vibration.simulating import refuse_wrong_run
from .study_rows import Rows, executed, quantile_columns, runner_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_MOST_SHOWN = 1000  # candidates at grid points, in words
_SIZE = (8.0, 5.5)  # of the plot [inches]
# Heading: figure, factor from SI to the unit of the heading.
_COLUMNS = {
    "margin %": ("margin", 100.0),
    "acceleration g": ("acceleration", 1.0 / STANDARD_GRAVITY),
    "sway mm": ("sway", 1e3),
    "tilt deg": ("tilt", math.degrees(1.0)),
    "stroke %": ("stroke", 100.0),
}
_DECIMALS = 9  # beyond which a figure is rounding
_QUANTILES = {"median": "median", "5 %": "low", "95 %": "high"}
_COLORS = {
    Verdict.PASSES: "tab:green",
    Verdict.CLOSE: "tab:olive",
    Verdict.FAILS: "tab:red",
    Verdict.OUTSIDE: "tab:purple",
    Verdict.REFUSED: "tab:gray",
}
_MARKERS = "osD^vPX*<>"


@dataclass(frozen=True, eq=False, repr=False)
class SystemStudyResult(Result):
    """Runs of a study of a SYSTEM.toml, and what they say of each candidate at each grid point.

    Attributes
    ----------
    name : str
    study : SystemStudy
    cautions : tuple of str
    summaries : sequence of SystemSummary   One for each candidate at each grid point.
    """

    name: str
    study: SystemStudy
    cautions: tuple[str, ...]
    summaries: SystemSummaries
    _rows: Rows

    @property
    def output(self) -> Path | None:
        """File with one line for each run, if one was asked for."""
        return self._rows.output

    def to_frame(self) -> pd.DataFrame:
        """One row for each run, in SI units but for the varied values; the columns are those of the results file."""
        return self._rows.frame()

    def quantiles(self) -> pd.DataFrame:
        """One row for each candidate at each grid point: verdict, share of passing draws, governing limit, quantiles.

        Figures are in SI units, the worst of all cases; margins are shares of a limit that are left.
        """
        import pandas as pd

        rows = []
        for one in self.summaries:
            row: dict[str, Any] = dict(zip((v.heading for v in self.study.varied), one.values, strict=True))
            row |= {"candidate": one.candidate, "verdict": one.verdict.value, "passing": one.passing}
            row |= {"refused": one.refused, "governing": one.governing}
            rows.append(row | quantile_columns(one.figures))
        return pd.DataFrame(rows)

    def lines(self, width: int | None = None) -> list[str]:
        """Verdicts, governing limits and quantiles in words, in tables of at most a width."""
        study, shown = self.study, self.summaries[:_MOST_SHOWN]
        headings = [*(one.heading for one in study.varied), "candidate", "verdict", "least margin"]
        headings += (["passing %", ""] if study.draws else []) + [*_COLUMNS]
        rows = []
        for one in shown:
            values = [*map(shown_alone, one.values)]
            head = [*values, one.candidate, one.verdict.value, one.governing or "-"]
            if not study.draws:
                rows.append([*head, *_cells(one, "median")])
                continue
            head.append(f"{100.0 * one.passing:.3g}")
            for title, quantile in _QUANTILES.items():
                first = head if quantile == "median" else [""] * len(head)
                rows.append([*first, title, *_cells(one, quantile)])
        lines = [self._headline(), *table_lines(headings, rows, {"candidate", "verdict", "least margin"}, width)]
        for one in shown:
            if one.refused:
                of = study.runs_per_point // len(study.candidates)
                lines.append(f"  {self._where(one)}: {one.refused} of {of} refused, most often: {one.reason}")
        if len(self.summaries) > len(shown):
            lines.append(f"  and {len(self.summaries) - len(shown)} more rows, all of them in the results file")
        return [*lines, *(f"  Caution: {sentence}" for sentence in self.cautions)]

    def summary(self) -> str:
        """Verdicts, governing limits and quantiles in words."""
        return "\n".join(self.lines())

    def plot(self, axes: Axes | None = None) -> Axes:
        """Acceleration against stroke, a marker for each candidate at each grid point in the colour of its verdict.

        The worst of all points, mounts and cases counts; with draws, medians with bars from 5 to 95 %.

        Parameters
        ----------
        axes : Axes or None   Of matplotlib; those of a new figure if None.
        """
        (axes,) = some_axes(axes, 1, 1, _SIZE)
        names = [name for _, name in self.study.candidates]
        for verdict, color in _COLORS.items():
            for number, name in enumerate(names):
                chosen = [one for one in self.summaries if one.verdict is verdict and one.candidate == name]
                places = [place for one in chosen if (place := _place(one)) is not None]
                if not places:
                    continue
                x, y = np.array(places).transpose(1, 2, 0)  # each low, median, high
                label = f"{name}: {verdict.value}" if len(names) > 1 else verdict.value
                axes.errorbar(
                    x[1], y[1], xerr=(x[1] - x[0], x[2] - x[1]), yerr=(y[1] - y[0], y[2] - y[1]), label=label,
                    linestyle="none", marker=_MARKERS[number % len(_MARKERS)], color=color, elinewidth=0.8,
                )  # fmt: skip
        axes.set_xlabel("stroke used on the way from rest to the end of the range [%]")
        axes.set_ylabel("largest acceleration [g]")
        axes.set_title(self.name)
        axes.grid(alpha=0.3)
        if axes.get_legend_handles_labels()[0]:
            axes.legend()
        return axes

    def save_plot(self, path: str | os.PathLike[str]) -> None:
        """Write the plot into a file.

        Raises
        ------
        StrandspringError   If the name does not end in .png, .svg or .pdf, or the file cannot be written.
        """
        save_plot(path, _SIZE, lambda figure: self.plot(figure.subplots()))

    def _headline(self) -> str:
        study = self.study
        springs = f"{study.draws} draws (seed {study.seed})" if study.draws else "the identified springs"
        counts = ((verdict, self.summaries.count(verdict)) for verdict in Verdict)
        verdicts = ", ".join(f"{count} {verdict.value}" for verdict, count in counts if count)
        return (
            f"{self.name}: {counted(len(study), 'run')}: {springs} of {counted(len(study.candidates), 'candidate')} in "
            f"{counted(len(study.cases), 'load case')} at each of {counted(study.grid_size, 'grid point')}: "
            f"{verdicts}, {counted(self.summaries.refused, 'run')} refused"
        )

    def _where(self, one: SystemSummary) -> str:
        pairs = zip(self.study.varied, one.values, strict=True)
        return ", ".join([*(f"{v.path} {v.shown(value)}" for v, value in pairs), one.candidate])

    def _repr_html_(self) -> str:
        return f"<p><strong>{escape(self._headline())}</strong></p>{self.quantiles().to_html(escape=True)}"


def study_system(
    system: str | os.PathLike[str],
    vary: Mapping[str, Given],
    *,
    cases: str | Sequence[str] | None = None,
    candidates: str | Sequence[str] | None = None,
    draws: int | None = None,
    seed: int | None = None,
    step: float | None = None,
    workers: int | None = 1,
    scheduler: str | Cluster | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Progress = unseen,
    notify: Callable[[str], None] = lambda _: None,
) -> SystemStudyResult:
    """Simulate a SYSTEM.toml over a grid of its values, with springs drawn from the uncertainty of their model files.

    Every grid point is checked as the file is; one that describes no possible system is a refused row with its reason.
    Draw k of a seed is the same springs at every grid point. Figures are the worst of the static equilibria of
    `simulate`.

    Parameters
    ----------
    system : path
    vary : mapping           Values of each path, such as "body.box.mass"; `*` stands for all entries of a list. Text is
                             LOW:HIGH:COUNT or a list with commas, with one unit: "15 kg:25 kg:5", "4,6,8"; percent are
                             of what the file says. Other numbers are in SI units. The value of "mount.NAME.places" is
                             how many of the places have a mount, from the first on.
    cases, candidates : str, sequence of str or None   Names of those to simulate; all if None.
    draws : int or None      Draws at each grid point, 0 for the identified springs; what the file says if None.
    seed : int or None       Likewise.
    step : float or None     See `simulate`.
    workers, scheduler, output, progress, notify   As for `study`.

    Returns
    -------
    SystemStudyResult

    Raises
    ------
    MountedSystemError       If the file is wrong, a path or a name unknown, or the runs cannot be executed.

    Examples
    --------
    >>> import strandspring
    >>> from strandspring.examples.system_models import SYSTEMS
    >>> box = SYSTEMS / "electronics_box.toml"
    >>> result = strandspring.study_system(box, {"body.box.mass": "15 kg:25 kg:3"}, cases="drop", candidates="softer")
    >>> result.quantiles()[["body.box.mass [kg]", "verdict", "stroke_median"]].round(2)
       body.box.mass [kg] verdict  stroke_median
    0                15.0    pass           0.62
    1                20.0    pass           0.72
    2                25.0    pass           0.81
    """
    refuse_wrong_run(draws, seed, step)
    runner = runner_of(workers, scheduler, notify, MountedSystemError)
    if output is not None and Path(output).resolve() == Path(system).resolve():
        raise MountedSystemError(f"`output` {readable(output)} would overwrite the description; write elsewhere.")
    where, content, files = readable(system), read_description(system), FilesOfFolder(Path(system).parent)
    try:
        planned = planned_study(content, files, vary, cases, candidates, draws, seed, step)
        cautions = undrawn(planned) if planned.draws else ()
    except MountedSystemError as problem:
        raise MountedSystemError(f"{where}, {problem}") from None

    def run(results: Path) -> SystemSummaries:
        return run_system_study(planned, results, runner, lambda runs: progress("Running", runs, len(planned)), notify)

    return SystemStudyResult(content["name"], planned, cautions, *executed(run, output, _read))


def _read(results: Path) -> pd.DataFrame:
    import pandas as pd

    return pd.read_csv(results)


def _cells(one: SystemSummary, quantile: str) -> list[str]:
    cells = []
    for name, scale in _COLUMNS.values():
        quantiles = one.figures[name]
        cells.append("-" if quantiles is None else f"{round(scale * getattr(quantiles, quantile), _DECIMALS):.4g}")
    return cells


def _place(one: SystemSummary) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
    """Stroke [%] and acceleration [g], each low, median and high; None where one is not known."""
    stroke, acceleration = one.figures["stroke"], one.figures["acceleration"]
    if stroke is None or acceleration is None:
        return None
    x = (100.0 * stroke.low, 100.0 * stroke.median, 100.0 * stroke.high)
    g = STANDARD_GRAVITY
    return x, (acceleration.low / g, acceleration.median / g, acceleration.high / g)
