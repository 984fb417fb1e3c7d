"""What the FMU of a system is made of, within it: SYSTEM.toml, the model files that it names, and how it was built.

    resources/strandspring/SYSTEM.toml      as it was given, with all candidates
    resources/strandspring/models/*.json    the model files
    resources/strandspring/system.json      the candidate, where each model file is, and the options of the FMU

Records that load cases name stay outside: of a load case the FMU has the place and direction of its force, no signal.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path, PurePath

from pydantic import TypeAdapter

from ..._version import __version__
from ...errors import ModelError, MountedSystemError
from ...ground.files import read_bytes, readable
from ...ground.strict_json import parse
from ...ground.strict_toml import parse_toml
from ...ground.unpacking import unpacked
from ...model.modelfile import MAXIMUM_BYTES, MAXIMUM_FMU_BYTES, ModelFile, is_fmu, model_of_text, text_in_fmu
from ...vibration.bodies.mounted import MountedSystem
from ...vibration.description.named_files import HeldFiles
from ...vibration.description.system_file import SystemFile, system_of_content
from .system_variables import SystemFmuOptions, unique_names

_FOLDER = "resources/strandspring"
DESCRIPTION, SETTINGS = f"{_FOLDER}/SYSTEM.toml", f"{_FOLDER}/system.json"
SOURCE = (DESCRIPTION, "application/toml", "Description of the system, of which model files lie beside it")
_AGAIN = "build the FMU from its SYSTEM.toml again"


@dataclass(frozen=True)
class SystemSettings:
    """What the FMU of a system was built with.

    Attributes
    ----------
    version : str                Of strandspring.
    candidate : str
    models : mapping             Path in the FMU of each model file, by its path as SYSTEM.toml has it.
    options : SystemFmuOptions
    """

    version: str
    candidate: str
    models: Mapping[str, str]
    options: SystemFmuOptions


@dataclass(frozen=True, eq=False)
class SystemOfFmu:
    """A system as its FMU holds it.

    Attributes
    ----------
    file : SystemFile            Without load cases.
    system : MountedSystem       Of the candidate.
    settings : SystemSettings
    """

    file: SystemFile
    system: MountedSystem
    settings: SystemSettings

    @classmethod
    def load(cls, fmu: str | Path) -> SystemOfFmu:
        """That of an FMU of ours.

        Raises
        ------
        MountedSystemError   If it cannot be read, or holds no such system.
        """
        name, packed = readable(fmu), read_bytes(fmu, MAXIMUM_FMU_BYTES, "an FMU", MountedSystemError)
        try:
            texts = _texts(packed, (DESCRIPTION, SETTINGS), MAXIMUM_BYTES)
            settings = _settings(texts.get(SETTINGS, ""))
            models_in_fmu = _texts(packed, settings.models.values(), MAXIMUM_FMU_BYTES)
        except ValueError as problem:
            raise MountedSystemError(f"{name} cannot be read as the FMU of a system ({problem}); {_AGAIN}.") from None
        try:
            models = {file: _model(path, models_in_fmu) for file, path in settings.models.items()}
            content = parse_toml(texts.get(DESCRIPTION, ""))
            content.pop("case", None)
            file = system_of_content(content, HeldFiles(models, {}), name)
        except ValueError as problem:
            raise MountedSystemError(f"{name}, {DESCRIPTION}: {problem}") from None
        system = dict(file.candidates).get(settings.candidate)
        if system is None or any(not 0 <= force.body < len(system.bodies) for force in settings.options.forces):
            raise MountedSystemError(f"{name}: {SETTINGS} is not that of its SYSTEM.toml; {_AGAIN}.")
        return cls(replace(file, text=texts[DESCRIPTION]), system, settings)


def is_system_fmu(path: str | Path) -> bool:
    """Whether a path is that of the FMU of a system, by its suffix and content; it need not be right."""
    try:
        return is_fmu(path) and bool(text_in_fmu(Path(path), SETTINGS))
    except ModelError:
        return False


def system_files(file: SystemFile, candidate: str, options: SystemFmuOptions) -> dict[str, bytes]:
    """These files by their path in the FMU."""
    names = unique_names(PurePath(model).stem for model in file.models)
    models = {model: f"{_FOLDER}/models/{name}.json" for model, name in zip(file.models, names, strict=True)}
    settings = SystemSettings(__version__, candidate, models, options)
    text = json.dumps({"format": "strandspring-system-build", **asdict(settings)}, indent=2, ensure_ascii=False)
    return {
        DESCRIPTION: file.text.encode("utf-8"),
        SETTINGS: f"{text}\n".encode(),
        **{models[name]: model.to_json().encode("utf-8") for name, model in file.models.items()},
    }


def _texts(packed: bytes, paths: Collection[str], maximum_bytes: int) -> dict[str, str]:
    """Files of an FMU by their path in it, as far as there are such; raises ValueError if they cannot be read."""
    return {path: content.decode("utf-8") for path, content in unpacked(packed, maximum_bytes, paths).items()}


def _settings(text: str) -> SystemSettings:
    try:
        return TypeAdapter(SystemSettings).validate_python(parse(text))
    except ValueError:
        raise ValueError(f"{SETTINGS} is damaged") from None


def _model(path: str, texts: Mapping[str, str]) -> ModelFile | str:
    """A model file, or the sentence that refuses it."""
    if path not in texts:
        return f"The FMU holds no {path}; {_AGAIN}."
    try:
        return model_of_text(texts[path], path)
    except ModelError as problem:
        return str(problem)
