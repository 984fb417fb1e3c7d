"""A study of a SYSTEM.toml from what users say of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...findings import Finding
from ...vibration.description.named_files import HeldFiles, NamedFiles, named_models, named_records
from ...vibration.description.system_file import system_of_content
from ...vibration.description.system_tables import DEFAULT_GRAVITY, SystemTable
from ...vibration.options import Part, Run
from ...vibration.verdicts.drawn_springs import Drawn
from .system_study import SystemStudy
from .varied import Given, varied, with_texts


def planned_study(
    content: Mapping[str, Any],
    files: NamedFiles,
    vary: Mapping[str, Given],
    part: Part,
    run: Run,
) -> SystemStudy:
    """The study, with all files that it may need.

    Parameters
    ----------
    content : mapping        Of the description.
    files : NamedFiles       Those that it names.
    vary : mapping           Values of each path, see `varied`.
    part : Part              What is simulated.
    run : Run                How; what the description says where it says nothing.

    Raises
    ------
    MountedSystemError       If the description is wrong, or a path, a name or a value.
    """
    # Of all values with a unit that a file may leave out, this alone is not 0.
    content = {"gravity": [*DEFAULT_GRAVITY], **content}
    file = system_of_content(content, files)
    table = SystemTable.model_validate(content)
    axes = tuple(varied(path, given, content, table) for path, given in vary.items())
    models: dict[str, None] = {}
    records: dict[str, None] = {}
    for variant in with_texts(content, table, axes):
        models |= dict.fromkeys(named_models(variant))
        records |= dict.fromkeys(named_records(variant))
    chosen = [name for name, _ in file.chosen_candidates(part.candidates)]
    loads = [case.name for case in file.chosen_cases(part.cases)]
    return SystemStudy(
        content=content,
        files=HeldFiles.read(files, models, records),
        varied=axes,
        candidates=_numbered([name for name, _ in file.candidates], chosen),
        cases=_numbered([case.name for case in file.cases], loads),
        points=tuple(point.name for point in file.candidates[0][1].points),
        draws=file.options.draws if run.draws is None else run.draws,
        seed=file.options.seed if run.seed is None else run.seed,
        step=run.step,
    )


def undrawn(study: SystemStudy) -> tuple[Finding, ...]:
    """Of each model file that cannot be drawn from."""
    missing: list[Finding] = []
    for file in study.distinct_files():
        for number, _ in study.candidates:
            found = Drawn.from_models(file.candidates[number][1], file.models).missing
            missing += (finding for finding in found if finding not in missing)
    return tuple(missing)


def _numbered(names: Sequence[str], chosen: Sequence[str]) -> tuple[tuple[int, str], ...]:
    return tuple((names.index(name), name) for name in chosen)
