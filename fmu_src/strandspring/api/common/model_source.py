"""What functions take as a model, what it says, and how they report progress."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from ...core.parameters import SpringParameters
from ...model.coordinates import chosen_zero
from ...model.modelfile import ModelFile, is_fmu, load_model

if TYPE_CHECKING:
    from ...fmu.related_files import BuildSettings

# Why options do not apply to what is given.
OF_MODELS = "{option} does not apply to {where}, which describes masses, mounts and springs itself"
OF_SYSTEMS = "{option} applies to a SYSTEM.toml only, got {where}; leave it out."


class HoldsModel(Protocol):
    """A `Spring`, or what else holds a model."""

    model: ModelFile


ModelSource: TypeAlias = HoldsModel | ModelFile | str | os.PathLike[str]
# Is called with what is being done, the parts done, and how many there are.
Progress: TypeAlias = Callable[[str, float, int], None]


def unseen(_task: str, _done: float, _total: int) -> None:
    """Progress that nobody watches."""


def model_of(source: ModelSource) -> ModelFile:
    """The model of a spring, of a model file, or of an FMU that holds one.

    Raises
    ------
    ModelError   If the file is not a physically possible spring.
    TypeError    If it is something else.
    """
    if isinstance(source, str | os.PathLike):
        return load_model(Path(source))
    model = source if isinstance(source, ModelFile) else getattr(source, "model", None)
    if not isinstance(model, ModelFile):
        raise TypeError(f"A model must be a Spring or the path of a model file or FMU, got {type(source).__name__}.")
    return model


def source_of(source: ModelSource) -> str:
    """What messages call a model: the path that was given, else its name."""
    return path_of(source) or model_of(source).name


def path_of(source: Any) -> str | None:
    """The path of a source; None for what is in memory."""
    return os.fspath(source) if isinstance(source, str | os.PathLike) else None


def built_with(source: Any) -> BuildSettings | None:
    """What an FMU that is the source was built with; None of another source.

    Raises
    ------
    ModelError   If it is an FMU that does not say so.
    """
    path = path_of(source)
    if path is None or not is_fmu(path):
        return None
    from ...fmu.related_files import BuildSettings

    return BuildSettings.of_fmu(Path(path))


def origin_of(source: Any, choice: str | float | None, parameters: SpringParameters) -> float:
    """The zero [m] that "rig", "middle" or a displacement of the record [m] stands for; by default that of an FMU from
    which the model is read, else a sensible one.

    Raises
    ------
    StrandspringError   If it is none of these, or the FMU is damaged.
    """
    before = built_with(source) if choice is None else None
    return before.zero if before is not None else chosen_zero(choice, parameters)


def is_system(source: Any) -> bool:
    """Whether a source is a SystemFile or the path of one, by its ending."""
    path = path_of(source)
    return hasattr(source, "chosen_candidates") if path is None else path.lower().endswith(".toml")


def describes_system(path: str) -> bool:
    """Whether a path is that of a SYSTEM.toml or of the FMU of a system."""
    # What reads systems is slow to import.
    if is_fmu(path):
        from ...fmu.system.system_files import is_system_fmu

        return is_system_fmu(path)
    if not path.lower().endswith(".toml"):
        return False
    from ...vibration.description.system_file import is_system_file

    return is_system_file(path)
