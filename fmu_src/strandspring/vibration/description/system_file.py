"""SYSTEM.toml: rigid bodies on mounts of identified springs, candidates, limits and load cases, in one file.

    format = "strandspring-system"
    format_version = 1
    name = "Electronics box"
    units = { length = "mm", inertia = "kg m^2" }   # of numbers without a unit

    [[body]]
    name = "box"
    mass = "20 kg"
    inertia = { xx = 0.25, yy = 0.30, zz = 0.35 }   # about the centre of gravity; xy = -(integral of x*y dm)
    [[body.point]]
    name = "circuit board"
    place = [100, 0, 50]                            # of the nominal pose, in the frame of the base

    [mount_type.corner]                             # axes in the mount's own frame
    axes = [
      { direction = "-z", model = "compression.json", preload = "50 N" },
      { direction = "+x", model = "shear.json" },
      { direction = "+y", model = "shear.json" },
    ]

    [[mount]]
    name = "corner"
    type = "corner"
    places = [[150, 100, -120], [-150, 100, -120], [150, -100, -120], [-150, -100, -120]]

    [limits]
    acceleration = "15 g"

    [[case]]
    name = "shock"
    pulse = "half-sine"
    peak = "40 g"
    duration = "11 ms"
    directions = ["+x", "+z", "-z"]                 # one case for each

A text carries its unit; a number has the one that `units` states, and is refused otherwise. The direction of an axis
is where the body moves as the displacement of the spring grows. In the nominal pose each spring is where its elastic
force is `preload`, 0 N if not given, or at the displacement `nominal`; displacements are those of the model file.
Files are found from the folder of the description. The schema `models/strandspring-system.schema.json` lists all keys;
messages count tables from 1.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ...errors import MountedSystemError
from ...ground.files import read_text, readable
from ...ground.strict_toml import parse_toml
from ...ground.tables import refusal
from ...model.modelfile import ModelFile
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..options import DRAWS
from ..verdicts.verdicts import Limits
from .described_cases import CaseBuilder
from .described_system import limits_of, model_paths, mounted_systems
from .named_files import FilesOfFolder, NamedFiles
from .system_tables import FORMAT, SystemTable
from .table_types import located
from .unheld import slowest_period

_MAX_BYTES = 1_000_000
_MOST_MODELS = 600
_PERIODS_AFTERWARDS = 5.0
_AFTERWARDS = (0.05, 20.0)  # [s]


@dataclass(frozen=True)
class RunOptions:
    """How the cases are simulated.

    Parameters
    ----------
    step : float or None           Time step [s]; chosen by the program if None.
    rest_omega : float or None     omega of all springs at rest, in the direction of their static force; None: unknown.
    draws, seed : int              Of all that is unknown, see `Unknowns`.
    """

    step: float | None = None
    rest_omega: float | None = None
    draws: int = DRAWS
    seed: int = 0


@dataclass(frozen=True)
class SystemFile:
    """What a SYSTEM.toml describes.

    Parameters
    ----------
    path : str                          The file, made printable.
    name, description : str
    candidates : tuple                  Names and systems; one, "as described", where the file lists none.
    limits : Limits
    cases : tuple of LoadCase
    options : RunOptions
    files : tuple of Path               All that were read besides it.
    models : mapping                    Content of each model file, by its path as the file has it: `MountAxis.model`.
    text : str                          The file's; empty for a content that comes from elsewhere.
    """

    path: str
    name: str
    description: str
    candidates: tuple[tuple[str, MountedSystem], ...]
    limits: Limits
    cases: tuple[LoadCase, ...]
    options: RunOptions
    models: Mapping[str, ModelFile]
    files: tuple[Path, ...] = ()
    text: str = ""

    def chosen_candidates(self, wanted: str | Sequence[str] | None) -> list[tuple[str, MountedSystem]]:
        """The candidates of these names, each with its own; all if None.

        Raises
        ------
        MountedSystemError   If there is none of a name, or no name.
        """
        names = _names(wanted)
        known = [name for name, _ in self.candidates]
        for name in names or ():
            if name not in known:
                raise MountedSystemError(f"There is no candidate {name!r}; give one of {', '.join(map(repr, known))}.")
        return [(name, system) for name, system in self.candidates if names is None or name in names]

    def chosen_cases(self, wanted: str | Sequence[str] | None) -> list[LoadCase]:
        """The load cases of these names, of which that of a case with several directions means all of them.

        All cases if None.

        Raises
        ------
        MountedSystemError   If there is none of a name, or none at all.
        """
        if not self.cases:
            where = f"{self.path}, " if self.path else ""
            raise MountedSystemError(f"{where}case: there is none, and without one no verdict; add a [[case]].")
        names = _names(wanted)
        for name in names or ():
            if not any(_is_meant(case, name) for case in self.cases):
                known = ", ".join(case.name for case in self.cases)
                raise MountedSystemError(f"There is no load case {name!r}; there are {known}.")
        return [case for case in self.cases if names is None or any(_is_meant(case, name) for name in names)]


def _is_meant(case: LoadCase, name: str) -> bool:
    """Whether a case has a name, or is one of the directions of the case of that name."""
    return case.name == name or case.name.rpartition(" ")[0] == name


def _names(wanted: str | Sequence[str] | None) -> tuple[str, ...] | None:
    if wanted is None:
        return None
    names = (wanted,) if isinstance(wanted, str) else tuple(wanted)
    if not names:
        raise MountedSystemError("`cases` and `candidates` must name one or more, or be None for all.")
    return names


def is_system_file(path: str | os.PathLike[str]) -> bool:
    """Whether a path is that of a SYSTEM.toml, by its suffix and content; it need not be right."""
    if Path(path).suffix.lower() != ".toml":
        return False
    try:
        content = parse_toml(read_text(path, _MAX_BYTES, "a description (TOML)", MountedSystemError))
    except (MountedSystemError, ValueError):
        return False
    return content.get("format") == FORMAT or "body" in content


def load_system_file(path: str | os.PathLike[str]) -> SystemFile:
    """Read a SYSTEM.toml with all files that it names.

    Raises
    ------
    MountedSystemError   If the file or one that it names is wrong; the message names file and field.
    """
    name, text, files = readable(path), _text_of(path), FilesOfFolder(Path(path).parent)
    content = _content(text, name)
    try:
        return replace(system_of_content(content, files, name), files=tuple(files.paths), text=text)
    except MountedSystemError as problem:
        raise MountedSystemError(f"{name}, {problem}") from None


def read_description(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The content of a SYSTEM.toml as JSON represents it, not yet checked.

    Raises
    ------
    MountedSystemError   If the file cannot be read or is not TOML; the message names it.
    """
    return _content(_text_of(path), readable(path))


def _text_of(path: str | os.PathLike[str]) -> str:
    return read_text(path, _MAX_BYTES, "a description of a system (TOML)", MountedSystemError)


def _content(text: str, name: str) -> dict[str, Any]:
    try:
        return parse_toml(text)
    except ValueError as problem:
        if text.lstrip().startswith("{"):
            raise MountedSystemError(
                f"{name}: is not a description of a system (SYSTEM.toml) but JSON; if it is a model, name it as "
                "`model` of a mount in a description, or give it to `strandspring isolate`."
            ) from None
        raise MountedSystemError(f"{name}: is not valid TOML ({problem}); correct it.") from None


def system_of_content(content: Mapping[str, Any], files: NamedFiles, name: str = "") -> SystemFile:
    """The system of the content of a file.

    Parameters
    ----------
    content : mapping     As TOML or JSON gives it.
    files : NamedFiles    Those that the content names.
    name : str            The file, made printable.

    Raises
    ------
    MountedSystemError    If it is wrong; the message names the field.
    """
    try:
        table = SystemTable.model_validate(content)
    except ValidationError as error:
        raise MountedSystemError(refusal(error)) from None
    paths = model_paths(table)
    if len(paths) > _MOST_MODELS:
        raise MountedSystemError(f"mount_type: must name at most {_MOST_MODELS} model files, got {len(paths)}.")
    models = {}
    for file, field in paths.items():
        with located(*field):
            models[file] = files.model(file)
    candidates = mounted_systems(table, models)
    system = candidates[0][1]
    builder = CaseBuilder(system.bodies, system.gravity, _afterwards(system for _, system in candidates), files)
    return SystemFile(
        path=name,
        name=table.name,
        description=table.description,
        candidates=candidates,
        limits=limits_of(table.limits, system.points),
        cases=builder.load_cases(table.case),
        options=RunOptions(
            step=table.run.step,
            rest_omega=None if isinstance(table.run.rest_omega, str) else table.run.rest_omega,
            draws=table.run.draws,
            seed=table.run.seed,
        ),
        models=models,
    )


def system_schema() -> dict[str, Any]:
    """The JSON schema of SYSTEM.toml, for editors and programs that write it.

    Examples
    --------
    >>> system_schema()["required"]
    ['format', 'format_version', 'name', 'body', 'mount_type', 'mount']
    """
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **SystemTable.model_json_schema()}


def _afterwards(systems: Any) -> float:
    """How long motion is looked at after a load: some periods of the slowest vibration."""
    periods = [period for period in map(slowest_period, systems) if not math.isnan(period)]
    low, high = _AFTERWARDS
    return min(max(_PERIODS_AFTERWARDS * max(periods, default=low), low), high)
