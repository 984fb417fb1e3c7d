"""`info` of the FMU of a system: what it holds, where its bodies rest and how they vibrate there."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from ...core.variables import Variable
from ...fmu.system.system_files import SystemOfFmu, SystemSettings
from ...fmu.system.system_variables import system_variables
from ...vibration.bodies.rest import rest
from ..common.result import Result
from ..common.table import Table
from ..common.text import counted
from ..vibration.system_isolation import MODES, IsolatedSystem, rest_tables


@dataclass(frozen=True, eq=False, repr=False)
class SystemInformation(Result):
    """What the FMU of a system holds.

    Attributes
    ----------
    source : str                     Path of the FMU.
    name, description : str          As SYSTEM.toml has them.
    settings : SystemSettings        Its candidate, and what it was built with.
    isolated : IsolatedSystem        Static equilibrium with `omega_start`, and modes for small motion about it.
    variables : tuple of Variable    Of the FMU.
    """

    source: str
    name: str
    description: str
    settings: SystemSettings
    isolated: IsolatedSystem
    variables: tuple[Variable, ...]

    _stated: ClassVar[Mapping[str, Any]] = {}

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - it is short
        """The FMU, static equilibrium and modes."""
        options, system = self.settings.options, self.isolated.system
        about = f": {self.description}" if self.description else ""
        author = f", author {options.author}" if options.author else ""
        yield f"System {self.name}, {self.settings.candidate} ({self.source}){about}"
        yield f"  FMI {options.fmi}.0, co-simulation, built by strandspring {self.settings.version}{author}"
        models = dict.fromkeys(axis.model or "catalogue" for axis in system.axes)
        yield f"  {counted(len(system.mounts), 'mount')}, models of their axes: {', '.join(models)}"
        yield f"  inputs: {', '.join(self._names('input'))}; {counted(len(self._names('output')), 'output')}"
        yield f"  internal step: at most {options.step:g} s; stable up to {options.largest_step:.4g} s"
        yield from rest_tables([self.isolated], brief=False)

    @property
    def table(self) -> Table:
        """One mode in each row."""
        return Table(MODES, self.isolated.mode_rows)

    def content(self) -> Mapping[str, Any]:
        """The settings, the names of variables, static equilibrium and modes."""
        of_candidate = self.isolated.content()
        return {
            "name": self.name,
            "description": self.description,
            **vars(self.settings),
            "inputs": self._names("input"),
            "outputs": self._names("output"),
            **{key: of_candidate[key] for key in ("static_equilibrium", "modes")},
        }

    def _names(self, causality: str) -> list[str]:
        return [variable.name for variable in self.variables if variable.causality == causality]


def system_information(fmu: str | os.PathLike[str]) -> SystemInformation:
    """What the FMU of a system holds: its candidate, variables, static equilibrium and natural modes; see `info`.

    Raises
    ------
    MountedSystemError   If it is not such an FMU, or is damaged.
    """
    held = SystemOfFmu.load(os.fspath(fmu))
    options = held.settings.options
    isolated = IsolatedSystem.at_rest(held.settings.candidate, held.system, rest(held.system, options.omega_start))
    variables = system_variables(held.system, options)
    return SystemInformation(
        os.fspath(fmu), held.file.name, held.file.description, held.settings, isolated, variables
    )  # fmt: skip
