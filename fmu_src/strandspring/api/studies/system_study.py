"""The study of a system: a SYSTEM.toml over a grid of its values, with every draw, candidate and load case."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ...campaigns.jobs.options import Workers
from ...campaigns.studies.system_planning import planned_study, undrawn
from ...campaigns.studies.varied import Given
from ...errors import MountedSystemError
from ...ground.files import readable
from ...vibration.description.named_files import FilesOfFolder
from ...vibration.description.system_file import read_description
from ...vibration.options import Part, Run
from ..common.progress import Progress
from .study_result import StudyResult, executed


def studied_system(
    system: str | os.PathLike[str],
    vary: Mapping[str, Given],
    part: Part,
    run: Run,
    placing: Workers,
    output: str | os.PathLike[str] | None,
    progress: Progress,
) -> StudyResult:
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
    return StudyResult(planned, *execution, known, content["name"])
