"""`study_system`: a SYSTEM.toml over a grid of its values, with every draw, candidate and load case."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ...campaigns.jobs.cluster import Cluster, runner_of
from ...campaigns.studies.system_planning import planned_study, undrawn
from ...campaigns.studies.varied import Given
from ...errors import MountedSystemError
from ...ground.files import readable
from ...vibration.description.named_files import FilesOfFolder
from ...vibration.description.system_file import read_description
from ..common.progress import Progress, unseen
from ..vibration.simulating import refuse_wrong_run
from .study_result import StudyResult, executed


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
) -> StudyResult:
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
    StudyResult

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
    return StudyResult(planned, *execution, known, content["name"])
