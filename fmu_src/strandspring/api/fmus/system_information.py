"""`info` of the FMU of a system: what it holds, where its bodies rest and how they vibrate there."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from ...core.variables import Variable
from ...fmu.system.system_files import SystemOfFmu, SystemSettings
from ...fmu.system.system_variables import system_variables
from ...vibration.bodies.rest import rest
from ..common.result import Result
from ..common.text import counted
from ..vibration.system_isolation import IsolatedSystem

if TYPE_CHECKING:
    import pandas as pd


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

    def text_lines(self, width: int | None = None) -> list[str]:  # noqa: ARG002 - its table is narrow
        """The FMU, static equilibrium and modes in words."""
        options, system = self.settings.options, self.isolated.system
        about = f": {self.description}" if self.description else ""
        author = f", author {options.author}" if options.author else ""
        return [
            f"System {self.name}, {self.settings.candidate} ({self.source}){about}",
            f"  FMI {options.fmi}.0, co-simulation, built by strandspring {self.settings.version}{author}",
            f"  {counted(len(system.mounts), 'mount')}, models of their axes: "
            f"{', '.join(dict.fromkeys(axis.model or 'catalogue' for axis in system.axes))}",
            f"  inputs: {', '.join(self._names('input'))}; {counted(len(self._names('output')), 'output')}",
            f"  internal step: at most {options.step:g} s; stable up to {options.largest_step:.4g} s",
            *self.isolated.rest_lines(),
        ]

    def as_json(self) -> dict[str, Any]:
        """The result as an object for JSON, in SI units."""
        return {
            "name": self.name,
            "description": self.description,
            **asdict(self.settings),
            "inputs": self._names("input"),
            "outputs": self._names("output"),
            **{key: value for key, value in self.isolated.as_json().items() if key in ("static_equilibrium", "modes")},
        }

    def to_frame(self) -> pd.DataFrame:
        """One mode in each row: frequency [Hz], viscous damping as a share of critical damping, motion in words."""
        import pandas as pd

        rows = [(mode.frequency, mode.damping, mode.words) for mode in self.isolated.modes]
        return pd.DataFrame(rows, columns=["frequency", "viscous_damping", "motion"]).rename_axis("mode")

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
