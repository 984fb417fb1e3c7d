"""The FMU of a system: built from a SYSTEM.toml or from such an FMU, and what `info` says of it."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from ...core.variables import Variable
from ...errors import MountedSystemError
from ...fmu.checks.check import CheckReport
from ...fmu.native.platforms import Platform
from ...fmu.system.system_check import examine_system_fmu
from ...fmu.system.system_files import SystemOfFmu, SystemSettings, is_system_fmu, system_files
from ...fmu.system.system_native import build_system_fmu, system_identifier
from ...fmu.system.system_variables import ForceInput, SystemFmuOptions, system_variables
from ...model.certificate import certified
from ...vibration.bodies.loads import ChannelKind, LoadCase
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.rest import rest
from ...vibration.bodies.small_motion import SmallMotion
from ...vibration.description.system_file import SystemFile, load_system_file
from ..common.result import Result
from ..common.table import Table
from ..common.text import counted
from ..vibration.systems import MODES, RestingSystem, rest_tables

# Of the largest stable step: an error of some 0.1 % at the highest natural frequency.
_OF_STABLE = 0.05


@dataclass(frozen=True, eq=False)
class SystemToBuild:
    """One candidate of a SYSTEM.toml, and how its FMU is built."""

    file: SystemFile
    candidate: str
    system: MountedSystem
    options: SystemFmuOptions

    @classmethod
    def load(cls, path: str, candidate: str | None = None, author: str = "", fmi: int | None = None) -> SystemToBuild:
        """From a SYSTEM.toml, or the FMU of a system with its candidate and, by default, its author and FMI.

        Raises
        ------
        MountedSystemError   If the file is wrong, has no such candidate, or its bodies cannot rest.
        ModelError           If a spring does not meet its certificate.
        """
        if is_system_fmu(path):
            held = SystemOfFmu.load(path)
            before, name = held.settings.options, held.settings.candidate
            if candidate not in (None, name):
                raise MountedSystemError(
                    f"{held.file.path} is of the candidate {name}; build that of another one from the SYSTEM.toml."
                )
            options = replace(before, author=author or before.author, fmi=fmi or before.fmi)
            return cls(held.file, name, held.system, options)
        file = load_system_file(path)
        for model in file.models.values():
            certified(model)
        names = [name for name, _ in file.candidates]
        if candidate not in (names if len(names) > 1 else (None, *names)):
            got = "" if candidate is None else f", got {candidate!r:.60}"
            of = f"an FMU is of one candidate; choose `candidate` among {', '.join(names)}"
            raise MountedSystemError(f"{file.path}: {of}{got}.")
        name = candidate or names[0]
        system = dict(file.candidates)[name]
        rest(system)  # or the reason why there is none
        stable = SmallMotion.about_nominal(system).stable_step(tilted=True)
        step = min(float(f"{_OF_STABLE * stable:.1e}"), file.options.step or stable)
        forces = _force_inputs(file.cases)
        options = SystemFmuOptions(step, stable, file.options.rest_omega or 0.0, forces, author, fmi or 2)
        return cls(file, name, system, options)

    def target(self, folder: Path) -> Path:
        """Where its FMU is written."""
        return folder / f"{system_identifier(self.system, self.options.fmi)}.fmu"

    def build(self, folder: Path, platforms: Sequence[Platform] | None) -> Path:
        """Write its FMU into a folder."""
        files = system_files(self.file, self.candidate, self.options)
        return build_system_fmu(self.system, folder, self.options, platforms, files)

    def examine(self, fmu: Path) -> CheckReport:
        """Validate and run its FMU."""
        return examine_system_fmu(fmu, self.system, self.options)

    @property
    def lines(self) -> list[str]:
        """What it is, in words."""
        steps, inputs = f"Internal step: {_steps(self.options)}", f"Inputs: {', '.join(self.content['inputs'])}"
        return [f"System: {self.file.name}, {self.candidate}", inputs, steps]

    @property
    def content(self) -> dict[str, Any]:
        """The same for JSON."""
        of, inputs = self.options, _names(system_variables(self.system, self.options), "input")
        steps = {"step": of.step, "stable_step": of.largest_step}
        return {"name": self.file.name, "candidate": self.candidate, **steps, "inputs": inputs}


def _force_inputs(cases: Sequence[LoadCase]) -> tuple[ForceInput, ...]:
    """An input for each force on a body that some load case has; one for both senses of a direction."""
    inputs: dict[tuple[int, tuple[float, ...], tuple[float, ...]], ForceInput] = {}
    for case in cases:
        for channel in case.channels:
            body, place = channel.body, tuple(round(coordinate, 9) for coordinate in channel.place)
            along, against = (tuple(round(s * part, 9) + 0.0 for part in channel.direction) for s in (1.0, -1.0))
            if channel.kind is ChannelKind.FORCE and (body, place, against) not in inputs:
                force = ForceInput(case.name, body, channel.place, channel.direction)
                inputs.setdefault((body, place, along), force)
    return tuple(inputs.values())


def _steps(options: SystemFmuOptions) -> str:
    return f"at most {options.step:g} s; stable up to {options.largest_step:.4g} s"


def _names(variables: Sequence[Variable], causality: str) -> list[str]:
    return [variable.name for variable in variables if variable.causality == causality]


@dataclass(frozen=True, eq=False, repr=False)
class SystemInformation(Result):
    """What the FMU of a system holds.

    Attributes
    ----------
    source : str                    Path of the FMU.
    name, description : str         As SYSTEM.toml has them.
    settings : SystemSettings       Its candidate, and what it was built with.
    at_rest : RestingSystem         Static equilibrium with `omega_start`, and modes for small motion about it.
    variables : tuple of Variable   Of the FMU.
    """

    source: str
    name: str
    description: str
    settings: SystemSettings
    at_rest: RestingSystem
    variables: tuple[Variable, ...]

    _stated: ClassVar[Mapping[str, Any]] = {}

    def parts(self, brief: bool) -> Iterator[str | Table]:  # noqa: ARG002 - it is short
        """The FMU, static equilibrium and modes."""
        options, system = self.settings.options, self.at_rest.system
        about = f": {self.description}" if self.description else ""
        author = f", author {options.author}" if options.author else ""
        yield f"System {self.name}, {self.settings.candidate} ({self.source}){about}"
        yield f"  FMI {options.fmi}.0, co-simulation, built by strandspring {self.settings.version}{author}"
        models = dict.fromkeys(axis.model or "catalogue" for axis in system.axes)
        yield f"  {counted(len(system.mounts), 'mount')}, models of their axes: {', '.join(models)}"
        inputs, outputs = (_names(self.variables, causality) for causality in ("input", "output"))
        yield f"  inputs: {', '.join(inputs)}; {counted(len(outputs), 'output')}"
        yield f"  internal step: {_steps(options)}"
        yield from rest_tables([self.at_rest], brief=False)

    @property
    def table(self) -> Table:
        """One mode in each row."""
        return Table(MODES, self.at_rest.mode_rows)

    def content(self) -> Mapping[str, Any]:
        """The settings, the names of variables, static equilibrium and modes."""
        names = {f"{causality}s": _names(self.variables, causality) for causality in ("input", "output")}
        of_file = {"name": self.name, "description": self.description, **vars(self.settings)}
        return {**of_file, **names, **self.at_rest.content()}


def system_information(fmu: str | os.PathLike[str]) -> SystemInformation:
    """See `info`; raises MountedSystemError if it is not the FMU of a system, or is damaged."""
    held = SystemOfFmu.load(os.fspath(fmu))
    options, candidate = held.settings.options, held.settings.candidate
    at_rest = RestingSystem.about(candidate, held.system, options.omega_start)
    variables = system_variables(held.system, options)
    return SystemInformation(os.fspath(fmu), held.file.name, held.file.description, held.settings, at_rest, variables)
