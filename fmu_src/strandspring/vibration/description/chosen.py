"""Candidates and load cases of a description by their names."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import MountedSystemError
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from .system_file import SystemFile


def chosen_candidates(file: SystemFile, wanted: str | Sequence[str] | None) -> list[tuple[str, MountedSystem]]:
    """The candidates of these names, each with its own; all if None.

    Raises
    ------
    MountedSystemError   If there is none of a name.
    """
    names = _names(wanted)
    known = [name for name, _ in file.candidates]
    for name in names or ():
        if name not in known:
            raise MountedSystemError(f"There is no candidate {name!r}; give one of {', '.join(map(repr, known))}.")
    return [(name, one) for name, one in file.candidates if names is None or name in names]


def chosen_cases(file: SystemFile, wanted: str | Sequence[str] | None) -> list[LoadCase]:
    """The load cases of these names, of which that of a case with several directions means all of them; all if None.

    Raises
    ------
    MountedSystemError   If there is none of a name.
    """
    names = _names(wanted)
    for name in names or ():
        if not any(_is_meant(case, name) for case in file.cases):
            known = ", ".join(case.name for case in file.cases) or "none"
            raise MountedSystemError(f"There is no load case {name!r}; there are {known}.")
    return [case for case in file.cases if names is None or any(_is_meant(case, name) for name in names)]


def _is_meant(case: LoadCase, name: str) -> bool:
    """Whether a case has a name, or is one of the directions of the case of that name."""
    return case.name == name or case.name.rpartition(" ")[0] == name


def _names(wanted: str | Sequence[str] | None) -> tuple[str, ...] | None:
    if wanted is None:
        return None
    return (wanted,) if isinstance(wanted, str) else tuple(wanted)
