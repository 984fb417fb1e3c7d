"""`study_system`: a SYSTEM.toml over a grid of its values, with every draw, candidate and load case."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...campaigns.jobs.cluster import Cluster, runner_of
from ...campaigns.studies.system_planning import planned_study, undrawn
from ...campaigns.studies.system_study import SystemStudy
from ...campaigns.studies.varied import Given, shown_alone
from ...errors import MountedSystemError
from ...ground.files import readable
from ...ground.gravity import STANDARD_GRAVITY
from ...vibration.description.named_files import FilesOfFolder
from ...vibration.description.system_file import read_description
from ...vibration.verdicts.verdicts import CaseVerdict
from ..common.progress import Progress, unseen
from ..common.text import counted
from ..vibration.simulating import refuse_wrong_run
from .study_result import AnyStudyResult, executed

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_COLORS = {
    CaseVerdict.NO_LIMITS: "tab:blue",
    CaseVerdict.PASSES: "tab:green",
    CaseVerdict.NOT_TESTED: "tab:cyan",
    CaseVerdict.UNDECIDED: "tab:olive",
    CaseVerdict.FAILS: "tab:red",
    CaseVerdict.OUTSIDE: "tab:purple",
    CaseVerdict.REFUSED: "tab:gray",
}
_MARKERS = "osD^vPX*<>"


@dataclass(frozen=True, eq=False, repr=False)
class SystemStudyResult(AnyStudyResult[SystemStudy]):
    """Runs of a study of a SYSTEM.toml, and what they say of each candidate at each grid point.

    The figures of a candidate are the worst of all cases; margins are shares of a limit that are left.

    Attributes
    ----------
    study : SystemStudy
    known : tuple of Finding  Limits that are not tested, and models that are taken as known in all draws.
    name : str
    """

    _rows = "rows"
    _brief = ("margin",)
    _size = (8.0, 5.5)

    name: str

    def to_frame(self) -> pd.DataFrame:
        """One row for each run, in SI units but for the varied values; the columns are those of the results file."""
        return super().to_frame().set_axis([column.file_heading for column in self.study.columns], axis="columns")

    def as_json(self) -> dict[str, Any]:
        """The result as the command prints it with --json."""
        content = super().as_json()
        for point in content["points"]:
            point["values"] = [point.pop(axis.heading) for axis in self.study.varied]
        varied = [{"path": axis.path, "unit": axis.unit, "values": axis.values} for axis in self.study.varied]
        return {"name": self.name, "vary": varied, "cases": [name for _, name in self.study.cases], **content}

    def plot(self, ax: Axes | None = None) -> Axes:
        """Acceleration against stroke, a marker for each candidate at each grid point in the colour of its verdict.

        The worst of all points, mounts and cases counts, at the upper end of its range; the legend has the limit with
        the least margin, that of most grid points.

        Parameters
        ----------
        ax : Axes or None     Of matplotlib; those of a new figure if None.
        """
        (axes,) = self._axes(ax)
        names = [name for _, name in self.study.candidates]
        summaries = self._summaries
        for verdict, color in _COLORS.items():
            for number, name in enumerate(names):
                chosen = summaries[(summaries["verdict"] == verdict.value) & (summaries["candidate"] == name)]
                if chosen.empty:
                    continue
                label = f"{name}: {verdict.value}" if len(names) > 1 else verdict.value
                deciding = chosen["least_margin"].mode()
                label += f", least margin: {deciding[0]}" if deciding.size else ""
                drawn = chosen.dropna(subset=["stroke_median", "acceleration_median"])
                self._bars(
                    axes, drawn, {"stroke": 100.0, "acceleration": 1.0 / STANDARD_GRAVITY}, label=label,
                    linestyle="none", marker=_MARKERS[number % len(_MARKERS)], color=color,
                )  # fmt: skip
        axes.set_xlabel("stroke used on the way from rest to the end of the range [%]")
        axes.set_ylabel("largest acceleration [g]")
        axes.set_title(self.name)
        return axes

    @property
    def headline(self) -> str:
        """What was run, in words, and how many candidates at grid points have each verdict."""
        study, summaries = self.study, self._summaries
        counts = ((verdict.value, (summaries["verdict"] == verdict.value).sum()) for verdict in CaseVerdict)
        verdicts = ", ".join(f"{count} {verdict}" for verdict, count in counts if count)
        return (
            f"{self.name}: {counted(len(study), 'run')} of {study.draws} draws (seed {study.seed}): "
            f"{counted(len(study.candidates), 'candidate')} in "
            f"{counted(len(study.cases), 'load case')} at each of {counted(study.grid_size, 'grid point')}: "
            f"{verdicts}, {counted(int(summaries['refused'].sum()), 'run')} refused"
        )

    def _head(self, point: dict[str, Any]) -> dict[str, str]:
        head = {axis.heading: shown_alone(point[axis.heading]) for axis in self.study.varied}
        head |= {"candidate": point["candidate"], "verdict": point["verdict"]}
        head["least margin"] = point["least_margin"] or "-"
        return head | {"beyond a limit %": "-" if point["beyond"] is None else f"{100.0 * point['beyond']:.3g}"}

    def _where(self, point: dict[str, Any]) -> str:
        values = (f"{axis.path} {axis.shown(point[axis.heading])}" for axis in self.study.varied)
        return ", ".join([*values, point["candidate"]])


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
    """Simulate a SYSTEM.toml over a grid of its values.

    Every grid point is checked as the file is; one that describes no possible system is a refused row with its reason.
    Every run draws what `simulate` draws, with the same seed; figures are the upper ends of their ranges.

    Parameters
    ----------
    system : path
    vary : mapping           Values of each path, such as "body.box.mass"; `*` stands for all entries of a list. Text is
                             LOW:HIGH:COUNT or a list with commas, with one unit: "15 kg:25 kg:5", "4,6,8"; percent are
                             of what the file says. Other numbers are in what its `units` state. The value of
                             "mount.NAME.places" is how many of the places have a mount, from the first on.
    cases, candidates : str, sequence of str or None   Names of those to simulate; all if None.
    draws, seed : int or None   Of each run; what the file says if None.
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
       body.box.mass [kg]      verdict  stroke_median
    0                15.0         pass           0.65
    1                20.0         pass           0.76
    2                25.0  not decided           0.85
    """
    refuse_wrong_run(draws, seed, step)
    runner = runner_of(workers, scheduler, notify, MountedSystemError)
    if output is not None and Path(output).resolve() == Path(system).resolve():
        raise MountedSystemError(f"`output` {readable(output)} would overwrite the description; write elsewhere.")
    where, content, files = readable(system), read_description(system), FilesOfFolder(Path(system).parent)
    try:
        planned = planned_study(content, files, vary, cases, candidates, draws, seed, step)
        known = (*(kind.untested for kind in planned.untested), *undrawn(planned))
    except MountedSystemError as problem:
        raise MountedSystemError(f"{where}, {problem}") from None

    execution = executed(planned, runner, output, progress, notify)
    return SystemStudyResult(planned, *execution, known, content["name"])
