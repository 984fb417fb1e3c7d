"""The FMU of a system, built from a SYSTEM.toml or from such an FMU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from ...errors import MountedSystemError
from ...fmu.native.platforms import Platform
from ...fmu.system.system_check import examine_system_fmu
from ...fmu.system.system_files import SystemOfFmu, is_system_fmu, system_files
from ...fmu.system.system_native import build_system_fmu, system_identifier
from ...fmu.system.system_variables import ForceInput, SystemFmuOptions, system_variables
from ...model.certificate import certified
from ...vibration.bodies.loads import ChannelKind, LoadCase, LoadChannel
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.bodies.rest import rest
from ...vibration.bodies.small_motion import SmallMotion
from ...vibration.description.system_file import SystemFile, load_system_file
from ..common.progress import Progress, unseen
from .in_place import BuildOptions, BuiltFmu, FmuJob, build_in_place

# Of the largest stable step: an error of some 0.1 % at the highest natural frequency.
_OF_STABLE = 0.05


@dataclass(frozen=True, eq=False)
class SystemToBuild:
    """One candidate of a SYSTEM.toml, and how its FMU is built.

    Attributes
    ----------
    file : SystemFile
    candidate : str
    system : MountedSystem
    options : SystemFmuOptions
    """

    file: SystemFile
    candidate: str
    system: MountedSystem
    options: SystemFmuOptions

    @classmethod
    def load(cls, path: str, candidate: str | None = None, author: str = "", fmi: int | None = None) -> SystemToBuild:
        """From a SYSTEM.toml, or from the FMU of a system with its candidate and, by default, its author and FMI.

        Raises
        ------
        MountedSystemError   If the file is wrong, has no such candidate, or its bodies cannot rest within the
                             identified ranges of their springs.
        ModelError           If a spring does not meet its certificate.
        """
        if is_system_fmu(path):
            return cls._rebuilt(path, candidate, author, fmi)
        file = load_system_file(path)
        for model in file.models.values():
            certified(model)
        name, system = _chosen(file, candidate)
        rest(system)  # or the reason why there is none
        stable = SmallMotion.about_nominal(system).stable_step(tilted=True)
        step = float(f"{_OF_STABLE * stable:.1e}")
        options = SystemFmuOptions(
            step if file.options.step is None else min(step, file.options.step),
            stable,
            file.options.rest_omega or 0.0,
            force_inputs(file.cases),
            author,
            2 if fmi is None else fmi,
        )
        return cls(file, name, system, options)

    @classmethod
    def _rebuilt(cls, fmu: str, candidate: str | None, author: str, fmi: int | None) -> SystemToBuild:
        held = SystemOfFmu.load(fmu)
        before, name = held.settings.options, held.settings.candidate
        if candidate not in (None, name):
            raise MountedSystemError(
                f"{held.file.path} is of the candidate {name}; build that of another one from the SYSTEM.toml."
            )
        options = replace(before, author=author or before.author, fmi=before.fmi if fmi is None else fmi)
        return cls(held.file, name, held.system, options)

    def target(self, folder: Path) -> Path:
        """Where its FMU is written."""
        return folder / f"{system_identifier(self.system, self.options.fmi)}.fmu"

    def build(self, folder: Path, platforms: Sequence[Platform] | None, progress: Progress = unseen) -> BuiltFmu:
        """Build, validate and run the FMU, and put it into the folder.

        Raises
        ------
        StrandspringError   If the folder is not writable, or the FMU cannot be built.
        BuildError          If it fails its check; nothing is then left behind.
        """
        job = FmuJob(
            self.target(folder),
            "system",
            partial(
                build_system_fmu,
                self.system,
                options=self.options,
                platforms=platforms,
                description=system_files(self.file, self.candidate, self.options),
            ),
            partial(examine_system_fmu, system=self.system, options=self.options),
        )
        return build_in_place(folder, [job], progress)[0]


@dataclass(frozen=True)
class BuiltSystem:
    """The FMU of a system, and what it was built of."""

    of: SystemToBuild
    fmu: BuiltFmu

    def brief(self, width: int | None = None) -> list[str]:  # noqa: ARG002 - it has no table
        """In few words."""
        return [*self._head, self.fmu.brief(self._settings)]

    def text_lines(self, width: int | None = None) -> list[str]:  # noqa: ARG002
        """In words."""
        return [*self._head, *self.fmu.text_lines(self._settings)]

    def as_json(self) -> dict[str, Any]:
        """The same for JSON."""
        return {
            "name": self.of.file.name,
            "candidate": self.of.candidate,
            "step": self.of.options.step,
            "stable_step": self.of.options.largest_step,
            "inputs": self._inputs,
            "fmus": [self.fmu.facts(self._settings)],
        }

    @property
    def _head(self) -> list[str]:
        options = self.of.options
        return [
            f"System: {self.of.file.name}, {self.of.candidate}",
            f"Inputs: {', '.join(self._inputs)}",
            f"Internal step: at most {options.step:g} s; stable up to {options.largest_step:.4g} s",
        ]

    @property
    def _inputs(self) -> list[str]:
        return [v.name for v in system_variables(self.of.system, self.of.options) if v.causality == "input"]

    @property
    def _settings(self) -> BuildOptions:
        return BuildOptions(fmi=self.of.options.fmi)


def force_inputs(cases: Sequence[LoadCase]) -> tuple[ForceInput, ...]:
    """An input for each force on a body that some load case has; one for both senses of a direction."""
    inputs: dict[tuple[int, tuple[float, ...], tuple[float, ...]], ForceInput] = {}
    for case in cases:
        for channel in case.channels:
            keys = [_key(channel, sense) for sense in (1.0, -1.0)]
            if channel.kind is ChannelKind.FORCE and not any(key in inputs for key in keys):
                inputs[keys[0]] = ForceInput(case.name, channel.body, channel.place, channel.direction)
    return tuple(inputs.values())


def _key(channel: LoadChannel, sense: float) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
    direction = tuple(round(sense * component, 9) + 0.0 for component in channel.direction)
    return channel.body, tuple(round(coordinate, 9) for coordinate in channel.place), direction


def _chosen(file: SystemFile, candidate: str | None) -> tuple[str, MountedSystem]:
    systems = dict(file.candidates)
    if candidate is None and len(systems) == 1:
        return file.candidates[0]
    if candidate not in systems:
        names = ", ".join(systems)
        raise MountedSystemError(
            f"{file.path}: an FMU is of one candidate; choose `candidate` among {names}"
            f"{'' if candidate is None else f', got {candidate!r:.60}'}."
        )
    return candidate, systems[candidate]
