"""The study of a system: a SYSTEM.toml over a grid of its values, with every draw, candidate and load case."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...campaigns.jobs.options import Workers
from ...campaigns.studies.system_planning import planned_study, undrawn
from ...campaigns.studies.system_study import SystemStudy
from ...campaigns.studies.varied import Given, shown_alone
from ...errors import MountedSystemError
from ...ground.files import readable
from ...ground.gravity import STANDARD_GRAVITY
from ...vibration.description.named_files import FilesOfFolder
from ...vibration.description.system_file import read_description
from ...vibration.options import Part, Run
from ...vibration.verdicts.verdicts import CaseVerdict
from ..common.progress import Progress
from ..common.text import counted
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


def studied_system(
    system: str | os.PathLike[str],
    vary: Mapping[str, Given],
    part: Part,
    run: Run,
    placing: Workers,
    output: str | os.PathLike[str] | None,
    progress: Progress,
) -> SystemStudyResult:
    """Simulate a SYSTEM.toml over a grid of its values; see `study`.

    Raises
    ------
    MountedSystemError       If the file is wrong, a path or a name unknown, or the runs cannot be executed.
    """
    if output is not None and Path(output).resolve() == Path(system).resolve():
        raise MountedSystemError(f"`output` {readable(output)} would overwrite the description; write elsewhere.")
    where, content, files = readable(system), read_description(system), FilesOfFolder(Path(system).parent)
    try:
        planned = planned_study(content, files, vary, part, run)
        known = (*(kind.untested for kind in planned.untested), *undrawn(planned))
    except MountedSystemError as problem:
        raise MountedSystemError(f"{where}, {problem}") from None
    execution = executed(planned, placing, output, progress)
    return SystemStudyResult(planned, *execution, known, content["name"])
