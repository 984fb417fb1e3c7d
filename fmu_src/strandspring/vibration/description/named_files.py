"""Model files and records that a description names: read from a folder, or held, to travel to other computers."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol, TypeVar

from ...errors import MountedSystemError, StrandspringError
from ...ground.quoting import quoted
from ...model.modelfile import ModelFile, load_model
from ...records.content import FileContent, read_content

_OF_CASES = ("record", "random", "force")  # tables of cases that may have a `file`

Held = TypeVar("Held")


class NamedFiles(Protocol):
    """Content of files by their text in the description."""

    def model(self, file: str) -> ModelFile:
        """A model file; raises StrandspringError if there is none."""
        ...

    def record(self, file: str) -> FileContent:
        """A record or a table of levels; raises StrandspringError if there is none."""
        ...


@dataclass(frozen=True)
class FilesOfFolder:
    """Read whenever they are asked for.

    Parameters
    ----------
    folder : Path             From which paths are relative.
    paths : dict of Path      Of those that have been asked for, as keys.
    """

    folder: Path
    paths: dict[Path, None] = field(default_factory=dict)

    def model(self, file: str) -> ModelFile:
        """See `NamedFiles`."""
        return load_model(self._found(file))

    def record(self, file: str) -> FileContent:
        """See `NamedFiles`."""
        return read_content(self._found(file))

    def _found(self, file: str) -> Path:
        try:
            path = self.folder / Path(file).expanduser()
        except RuntimeError as problem:
            raise MountedSystemError(f"{quoted(file)} names no user's folder ({problem}); give its path.") from None
        self.paths[path] = None
        return path


@dataclass(frozen=True)
class HeldFiles:
    """Read once.

    Parameters
    ----------
    models, records : mapping   Content of each file, or the sentence that refuses it.
    """

    models: Mapping[str, ModelFile | str]
    records: Mapping[str, FileContent | str]

    @classmethod
    def read(cls, files: NamedFiles, models: Iterable[str], records: Iterable[str]) -> HeldFiles:
        """Read files; those that cannot be read are refused when they are asked for."""
        return cls(_read(files.model, models), _read(files.record, records))

    def model(self, file: str) -> ModelFile:
        """See `NamedFiles`."""
        return _given(self.models.get(file, f"{quoted(file)} is missing; put it beside the description."))

    def record(self, file: str) -> FileContent:
        """See `NamedFiles`."""
        return _given(self.records[file])

    def digests(self) -> dict[str, str]:
        """A digest of each file's content, or of its refusal."""
        held: dict[str, object] = {f"model {name}": model for name, model in self.models.items()}
        held |= {
            f"record {name}": content if isinstance(content, str) else content.sha256
            for name, content in self.records.items()
        }
        return {name: hashlib.sha256(repr(content).encode()).hexdigest() for name, content in held.items()}


def _read(read: Callable[[str], Held], names: Iterable[str]) -> dict[str, Held | str]:
    held: dict[str, Held | str] = {}
    for name in names:
        try:
            held[name] = read(name)
        except StrandspringError as refusal:
            held[name] = str(refusal)
    return held


def _given(held: Held | str) -> Held:
    if isinstance(held, str):
        raise MountedSystemError(held)
    return held


def named_models(content: Mapping[str, Any]) -> Iterator[str]:
    """Model files that a valid description names, also of mount types that nothing uses."""
    axes = (axis for mount_type in content["mount_type"].values() for axis in mount_type["axes"])
    return (axis["model"] for axis in axes if "model" in axis)


def named_records(content: Mapping[str, Any]) -> Iterator[str]:
    """Files that the cases of a valid description name."""
    for case in content.get("case", ()):
        for key in _OF_CASES:
            if "file" in case.get(key, {}):
                yield case[key]["file"]
