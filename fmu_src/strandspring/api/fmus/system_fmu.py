"""The FMU of a system: built from a SYSTEM.toml or from such an FMU, and what `info` says of it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from ...core.variables import Variable
from ...errors import MountedSystemError
from ...fmu.checks.check import CheckReport
from ...fmu.system.system_check import examine_system_fmu
from ...fmu.system.system_files import SystemOfFmu, SystemSettings, is_system_fmu, system_files
from ...fmu.system.system_native import build_system_fmu, system_identifier
from ...fmu.system.system_variables import ForceInput, SystemFmuOptions, system_variables
from ...model.certificate import certified
from ...vibration.bodies.loads import ChannelKind, LoadCase
from ...vibration.bodies.rest import rest
from ...vibration.bodies.small_motion import SmallMotion
from ...vibration.description.system_file import load_system_file
from ..common.result import Result, Table
from ..common.text import counted
from ..vibration.systems import MODES, RestingSystem, rest_tables
from .options import BuildOptions

# Of the largest stable step: an error of some 0.1 % at the highest natural frequency.
_OF_STABLE = 0.05


def build_system(
    path: str, folder: Path, building: BuildOptions, candidate: str | None, claim: Callable[[Path], None],
    place: Callable[..., CheckReport],
) -> tuple[list[str], dict[str, Any], int, dict[str, CheckReport]]:  # fmt: skip
    """Build the FMU of one candidate of a SYSTEM.toml, or again that of the FMU of a system: the fields of `Built`.

    `claim` refuses a path that must not be written; `place` takes it and functions that build and check an FMU.

    Raises
    ------
    MountedSystemError   If the file is wrong, has no such candidate, or its bodies cannot rest.
    ModelError           If a spring does not meet its certificate.
    """
    if is_system_fmu(path):
        held = SystemOfFmu.load(path)
        file, name, system, before = held.file, held.settings.candidate, held.system, held.settings.options
        if candidate not in (None, name):
            raise MountedSystemError(
                f"{file.path} is of the candidate {name}; build that of another one from the SYSTEM.toml."
            )
        options = replace(before, author=building.author or before.author, fmi=building.fmi or before.fmi)
    else:
        file = load_system_file(path)
        for model in file.models.values():
            certified(model)
        chosen = file.chosen_candidates(candidate)
        if len(chosen) > 1:
            names = ", ".join(name for name, _ in chosen)
            raise MountedSystemError(f"{file.path}: an FMU is of one candidate; choose `candidate` among {names}.")
        name, system = chosen[0]
        rest(system)  # or the reason why there is none
        stable = SmallMotion.about_nominal(system).stable_step(tilted=True)
        step = min(float(f"{_OF_STABLE * stable:.1e}"), file.options.step or stable)
        forces, omega = _force_inputs(file.cases), file.options.rest_omega or 0.0
        options = SystemFmuOptions(step, stable, omega, forces, building.author, building.version)
    target, files = folder / f"{system_identifier(system, options.fmi)}.fmu", system_files(file, name, options)
    claim(target)
    build = partial(build_system_fmu, system, options=options, platforms=building.chosen_platforms, description=files)
    check = place(target, build, partial(examine_system_fmu, system=system, options=options))
    inputs = _names(system_variables(system, options), "input")
    lines = [f"System: {file.name}, {name}", f"Inputs: {', '.join(inputs)}", f"Internal step: {_steps(options)}"]
    steps = {"step": options.step, "stable_step": options.largest_step}
    content = {"system": path, "name": file.name, "candidate": name, **steps, "inputs": inputs}
    return lines, content, options.fmi, {"system": check}


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
