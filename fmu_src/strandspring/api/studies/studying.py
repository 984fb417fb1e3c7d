"""`study`: how resonance and isolation scatter over masses, levels and the uncertainty of a model."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import asdict, dataclass, fields
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from ...campaigns.jobs.cluster import Cluster
from ...campaigns.studies.definition import RunRow, Study
from ...campaigns.studies.quantiles import GridPointSummary, Summaries
from ...campaigns.studies.run import run_study
from ...core.parameters import SpringParameters
from ...errors import ModelError
from ...ground.arguments import limits, number, numbers, optional_number, whole
from ...ground.files import readable
from ...model.coordinates import counted_from, zero_sentence
from ...model.modelfile import ModelFile
from ...model.spread import Spread
from ...model.stated_cautions import cautions_in_use
from ...vibration.one_mass.system import Excitation, IsolatedMass, IsolationError, free_travel, static_equilibrium
from ..common.caution_text import outside_range
from ..common.levels import given_levels
from ..common.progress import Progress, unseen
from ..common.result import Result
from ..common.text_table import table_lines
from ..spring import ModelSource, model_of, origin_of, path_of
from .study_rows import Rows, executed, quantile_columns, runner_of

if TYPE_CHECKING:
    import pandas as pd

_MOST_SHOWN = 1000  # grid points in words
_DEFAULT_SHARE = 0.01  # of the free travel
# Heading: figure, factor from SI to the unit of the heading.
_COLUMNS = {
    "resonance Hz": ("frequency", 1.0),
    "transmissibility": ("transmissibility", 1.0),
    "amplitude mm": ("amplitude", 1e3),
    "loss factor": ("loss_factor", 1.0),
    "isolates from Hz": ("isolation_frequency", 1.0),
}
_QUANTILES = {"median": "median", "5 %": "low", "95 %": "high"}


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult(Result):
    """Runs of a parameter study and their quantiles.

    Attributes
    ----------
    study : Study
    model : ModelFile
    zero : float                            Where displacement is counted from [m].
    summaries : sequence of GridPointSummary   Quantiles and refusals at each grid point.
    """

    study: Study
    model: ModelFile
    zero: float
    summaries: Summaries
    _rows: Rows

    @property
    def output(self) -> Path | None:
        """File with one line for each run, if one was asked for."""
        return self._rows.output

    def to_frame(self) -> pd.DataFrame:
        """One row for each run, in SI units; the columns are the attributes of `RunRow`."""
        return self._rows.frame()

    def quantiles(self) -> pd.DataFrame:
        """One row for each grid point: runs, refused ones, and 5, 50 and 95 % quantiles of the figures in SI units."""
        import pandas as pd

        rows = []
        for summary in self.summaries:
            row = {**asdict(summary.point), "runs": summary.runs, "refused": summary.refused}
            rows.append(row | quantile_columns(summary.figures))
        return pd.DataFrame(rows)

    @property
    def cautions(self) -> tuple[str, ...]:
        """Cautions of the model's identification."""
        return tuple(cautions_in_use(self.model.name, self.model))

    def lines(self, width: int | None = None) -> list[str]:
        """Quantiles, refusals and cautions in words, in tables of at most a width."""
        planned, summaries = self.study, self.summaries
        springs = f"{planned.draws} draws (seed {planned.seed})" if planned.draws else "the identified spring"
        lines = [f"{len(planned)} runs: {springs} at each of {len(summaries)} grid points, {summaries.refused} refused"]
        rows = []
        shown = summaries[:_MOST_SHOWN]
        for summary in shown:
            point = [*_point(planned.excitation, summary), str(summary.refused)]
            for title, quantile in (_QUANTILES if planned.draws else {"": "median"}).items():
                figures = [_cell(summary, name, scale, quantile) for name, scale in _COLUMNS.values()]
                rows.append([*(point if quantile == "median" else [""] * len(point)), title, *figures])
        lines += table_lines(["mass kg", "level", "stiffness", "refused", "", *_COLUMNS], rows, width=width)
        for summary in shown:
            mass, level, stiffness = _point(planned.excitation, summary)
            where = f"{mass} kg, {level}, stiffness x {stiffness}"
            if summary.refused:
                lines.append(f"  {where}: {summary.refused} of {summary.runs} refused, most often: {summary.reason}")
            if summary.at_end:
                lines.append(f"  {where}: {summary.at_end} of {summary.runs} have their peak at an end of the band")
            if summary.extrapolating:
                lines.append(
                    f"  Caution: {where}: in {summary.extrapolating} of {summary.runs} the spring moves "
                    f"{outside_range(planned.spring)}"
                )
        if len(summaries) > len(shown):
            lines.append(f"  and {len(summaries) - len(shown)} more grid points, all of them in the results file")
        lines += [f"  Caution: {sentence}" for sentence in self.cautions]
        counted = zero_sentence(self.zero)
        return [*lines, *([counted] if counted else [])]

    def summary(self) -> str:
        """Quantiles, refusals and cautions in words, in tables of at most a width."""
        return "\n".join(self.lines())

    def _repr_html_(self) -> str:
        return f"<p><strong>{escape(self.lines()[0])}</strong></p>{self.quantiles().to_html(escape=True)}"


def study(
    model: ModelSource,
    mass: ArrayLike,
    *,
    base_displacement: ArrayLike | None = None,
    base_acceleration: ArrayLike | None = None,
    force: ArrayLike | None = None,
    stiffness: ArrayLike = 1.0,
    draws: int = 100,
    seed: int = 0,
    load: float | None = None,
    parallel: int = 1,
    series: int = 1,
    damping: float = 0.0,
    band: tuple[float, float] | None = None,
    points: int = 24,
    extrapolate: bool = False,
    zero: str | float | None = None,
    workers: int | None = 1,
    scheduler: str | Cluster | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Progress = unseen,
    notify: Callable[[str], None] = lambda _: None,
) -> StudyResult:
    """Resonance and isolation over masses, levels, stiffness factors and springs drawn from a model's uncertainty.

    Draw k of a seed is the same spring in every study. A refused run, for instance one whose motion leaves the
    identified range, is a row with the reason.

    Parameters
    ----------
    model : Spring, or path of a model file or FMU
    mass : float or array_like     Each [kg].
    base_displacement, base_acceleration, force : float, array_like or None
        One level or several of one of them [m, m/s^2, N]; if None, a base displacement of 1 % of the free travel under
        the smallest mass.
    stiffness : float or array_like   Factors on all forces of the spring.
    draws : int                    Springs drawn at each grid point; 0 for the identified spring alone.
    seed : int
    load, parallel, series, damping, band, points, extrapolate, zero   As for `isolate`.
    workers : int or None          Number of processes; as many as cores if None. A script that asks for more than one
                                   must call this below ``if __name__ == "__main__":``.
    scheduler : str, Cluster or None
        Address of a dask.distributed scheduler, instead of workers, or a `Cluster` with certificates.
    output : path or None          File with one line for each run. Finished runs are kept beside it until all are done,
                                   and the same call continues from there.
    progress : callable            Is called with what is being done, the number of finished runs, and how many there
                                   are.
    notify : callable              Is called with a sentence while no run finishes.

    Returns
    -------
    StudyResult

    Raises
    ------
    ModelError       If the model is not a physically possible spring, or has no uncertainty to draw from.
    IsolationError   If an argument is out of bounds, there is no static equilibrium from which to choose the level, or
                     the runs cannot be executed.

    Examples
    --------
    >>> from strandspring import Spring, SpringParameters, study
    >>> spring = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02), "mount")
    >>> result = study(spring, mass=[5.0, 6.0], base_displacement=2e-4, draws=0, points=8)
    >>> result.to_frame()[["mass", "frequency", "transmissibility"]].round(1)
       mass  frequency  transmissibility
    0   5.0        7.7               8.6
    1   6.0        7.1               8.6
    """
    runner = runner_of(workers, scheduler, notify, IsolationError)
    path = path_of(model)
    if path is not None and Path(path).suffix.lower() == ".toml":
        raise IsolationError(f"{readable(path)} must be a model file; study the system it describes by `study_system`.")
    if output is not None and path is not None and Path(output).resolve() == Path(path).resolve():
        raise IsolationError(f"`output` {path} would overwrite the model; write elsewhere.")
    content = model_of(model)
    origin = origin_of(model, zero, content.parameters)
    spring = counted_from(origin, content.parameters)
    load, damping = optional_number("load", load, "N"), number("damping", damping, "N s/m")
    parallel, series = whole("parallel", parallel), whole("series", series)
    masses = numbers("mass", mass, "kg")
    given = given_levels(base_displacement, base_acceleration, force)
    if given is None:
        if not masses:
            raise IsolationError("`mass` must hold at least one mass [kg].")
        lightest = IsolatedMass(spring, min(masses), load, parallel, series, damping)
        travel = free_travel(lightest, static_equilibrium(lightest))
        given = Excitation.BASE_DISPLACEMENT, (_DEFAULT_SHARE * travel,)
    planned = Study(
        spring=spring,
        excitation=given[0],
        masses=masses,
        levels=given[1],
        stiffness_factors=numbers("stiffness", stiffness),
        draws=whole("draws", draws),
        seed=whole("seed", seed),
        spread=_spread(model, spring, content) if draws else None,
        load=load,
        parallel=parallel,
        series=series,
        damping=damping,
        band=None if band is None else limits("band", band, "Hz"),
        points=whole("points", points),
        extrapolate=extrapolate,
    )

    def run(results: Path) -> Summaries:
        return run_study(planned, results, runner, lambda runs: progress("Running", runs, len(planned)), notify)

    return StudyResult(planned, content, origin, *executed(run, output, _read))


def _spread(source: object, spring: SpringParameters, content: ModelFile) -> Spread:
    try:
        return Spread.of(spring, content.uncertainty)
    except ModelError as problem:
        raise ModelError(f"{path_of(source) or content.name}: {problem}") from None


def _read(results: Path) -> pd.DataFrame:
    import pandas as pd

    return pd.read_csv(results).set_axis([column.name for column in fields(RunRow)], axis="columns")


def _point(excitation: Excitation, summary: GridPointSummary) -> list[str]:
    point = summary.point
    return [f"{point.mass:g}", excitation.level_text(point.level), f"{point.stiffness_factor:g}"]


def _cell(summary: GridPointSummary, name: str, scale: float, quantile: str) -> str:
    quantiles = summary.figures[name]
    return "-" if quantiles is None else f"{scale * getattr(quantiles, quantile):.4g}"
