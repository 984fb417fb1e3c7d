"""The model file: one identified spring as JSON, validated on load, written as stable bytes.

``models/strandspring-model.schema.json`` describes it for other programs; see `model_schema`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..core.parameters import SpringParameters
from ..errors import ModelError
from ..ground.files import read_bytes, read_text, readable, write_text
from ..ground.quoting import shown
from ..ground.strict_json import parse, plain
from ..ground.unpacking import unpacked_text
from .joint import JointCovariance
from .names import FORMAT, MAX_DESCRIPTION, VERSION, check_name

if TYPE_CHECKING:
    from .file_tables import Certificate, Start

MAXIMUM_BYTES = 10_000_000
MAXIMUM_FMU_BYTES = 200_000_000  # packed, and all its files together unpacked
_ROUNDING = 1e-6  # of figures that the order of sums changes, relative
MODEL_IN_FMU = "resources/strandspring/model.json"

Json = dict[str, Any]


@dataclass(frozen=True)
class ModelFile:
    """Content of a model file.

    Parameters
    ----------
    name : str                      Identifier for the model and its FMU.
    parameters : SpringParameters
    description : str               Free text.
    fit, uncertainty : dict         Figures of the identification; empty for a model written by hand.
    provenance : dict               Records with their sha256, method, options and version; empty likewise.
    start : Start or None           Displacement and state at the first sample of the first record; None likewise.
    certificate : Certificate or None   Range that the force keeps; None likewise.

    Raises
    ------
    ModelError   If the name or the description is invalid, a dict contains what JSON cannot represent, or a field of
                 the uncertainty is not what this program reads there, or the start is not one of this spring.
    """

    name: str
    parameters: SpringParameters
    description: str = ""
    fit: Json = field(default_factory=dict)
    uncertainty: Json = field(default_factory=dict)
    provenance: Json = field(default_factory=dict)
    start: Start | None = None
    certificate: Certificate | None = None

    def __post_init__(self) -> None:
        check_name(self.name)
        if len(self.description) > MAX_DESCRIPTION:
            raise _wrong("description", f"must have at most {MAX_DESCRIPTION} characters", self.description)
        # XML 1.0 cannot represent other control characters, not even escaped.
        control = any((ord(c) < 32 and c not in "\t\n\r") or ord(c) in (0xFFFE, 0xFFFF) for c in self.description)
        if control or any(0xD800 <= ord(c) <= 0xDFFF for c in self.description):
            raise _wrong("description", "must not contain control characters", self.description)
        for name in ("fit", "uncertainty", "provenance"):
            value = getattr(self, name)
            try:
                # So that loading a saved model gives an equal one.
                object.__setattr__(self, name, plain(value))
            except (TypeError, ValueError, RecursionError):
                raise _wrong(name, "must contain finite numbers, text, lists and objects only", value) from None
        if self.uncertainty:
            _check_uncertainty(self.parameters, self.uncertainty)
        if self.start is not None:
            _check_start(self.parameters, self.start)

    @classmethod
    def from_content(cls, content: Json) -> ModelFile:
        """The model of a JSON object.

        Raises
        ------
        ModelError   If a field is missing, unknown or invalid; the message names it.
        """
        from .file_tables import FileTable

        with _refused_in_words("correct it, or identify the spring again"):
            table = FileTable.model_validate(content)
        try:
            parameters = SpringParameters(**{"kE": (), **table.parameters.model_dump(exclude_defaults=True)})
        except ValueError as problem:
            raise ModelError(f"{str(problem).rstrip('.')}; correct the parameters or identify again.") from None
        free = {name: content.get(name, {}) for name in ("fit", "uncertainty", "provenance")}
        return cls(table.name, parameters, table.description, **free, start=table.start, certificate=table.certificate)

    def to_json(self) -> str:
        """Text of the file; the same model gives the same text."""
        stated = {"start": self.start, "certificate": self.certificate}
        content = {
            "format": FORMAT,
            "format_version": VERSION,
            "name": self.name,
            "description": self.description,
            "parameters": self.parameters.as_dict(),
            **{name: table.model_dump(exclude_defaults=True) for name, table in stated.items() if table is not None},
            "fit": self.fit,
            "uncertainty": self.uncertainty,
            "provenance": self.provenance,
        }
        return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def model_schema() -> Json:
    """The JSON schema of model files, for programs that write or check them.

    Examples
    --------
    >>> model_schema()["required"]
    ['format', 'format_version', 'name', 'parameters']
    """
    from .file_tables import FileTable

    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **FileTable.model_json_schema()}


def load_model(path: str | Path) -> ModelFile:
    """Read and validate a model file, or the one that an FMU of ours holds.

    Raises
    ------
    ModelError   If the file cannot be read or is not a physically possible spring; names the file and the field.
    """
    path = Path(path)
    text = (
        text_in_fmu(path, MODEL_IN_FMU)
        if is_fmu(path)
        else read_text(path, MAXIMUM_BYTES, "a model file (JSON)", ModelError)
    )
    return model_of_text(text, str(path))


def model_of_text(text: str, path: str) -> ModelFile:
    """The model of the text of a model file; messages name its path.

    Raises
    ------
    ModelError   If it is not a physically possible spring; names the file and the field.
    """
    try:
        content = parse(text)
    except json.JSONDecodeError as problem:
        raise ModelError(
            f"{path}, line {problem.lineno}: not valid JSON ({problem.msg}); give a model file written by "
            "`strandspring identify`."
        ) from None
    except ValueError as problem:
        raise ModelError(
            f"{path}: not a valid model file ({problem}); correct it, or give a model file written by "
            "`strandspring identify`."
        ) from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ModelError(
            f'{path}: field "format" must be "{FORMAT}"; give a model file written by `strandspring identify`.'
        )
    version = content.get("format_version")
    if type(version) is int and version > VERSION:
        raise ModelError(
            f'{path}: field "format_version" is {str(version)[:20]}: the file was written by a newer strandspring, '
            f"and this one reads versions up to {VERSION}; upgrade strandspring."
        )
    try:
        return ModelFile.from_content(content)
    except ModelError as problem:
        raise ModelError(f"{path}: {problem}") from None


def is_fmu(path: str | Path) -> bool:
    """Whether a path is that of an FMU by its name."""
    return str(path).lower().endswith(".fmu")


def is_model_path(path: str | Path) -> bool:
    """Whether a path is that of a model file or of an FMU by its name."""
    return is_fmu(path) or str(path).lower().endswith(".json")


def text_in_fmu(path: Path, name: str) -> str:
    """The text of a file in an FMU of ours.

    Raises
    ------
    ModelError   If it cannot be read, or is absurdly large.
    """
    packed = read_bytes(path, MAXIMUM_FMU_BYTES, "an FMU", ModelError)
    try:
        text = unpacked_text(packed, MAXIMUM_BYTES, name)
    except ValueError as problem:
        raise ModelError(
            f"{readable(path)} cannot be read as an FMU ({problem}); copy it again, or build it again."
        ) from None
    if text is None:
        raise ModelError(f"{readable(path)} holds no {name}; give the FMU of a spring that strandspring built.")
    return text


def save_model(path: str | Path, model: ModelFile) -> None:
    """Write a model file; the same model gives the same bytes."""
    write_text(Path(path), model.to_json())


def saved_model(path: Path, model: ModelFile) -> ModelFile:
    """Write a model file, or keep the one that is there if it differs by rounding only; what the file then holds.

    Processors round differently, so that the records of a file identified elsewhere give other last digits.
    """
    with suppress(ModelError):
        held = load_model(path)
        if _is_rounded(json.loads(held.to_json()), json.loads(model.to_json())):
            return held
    save_model(path, model)
    return model


def _is_rounded(one: Any, other: Any, largest: float = 0.0) -> bool:
    """Whether two contents of JSON differ by rounding only; `largest` is that of the numbers beside them."""
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(_is_rounded(one[name], other[name]) for name in one)
    if isinstance(one, list) and isinstance(other, list):
        largest = max((abs(value) for value in one if isinstance(value, float)), default=0.0)
        return len(one) == len(other) and all(_is_rounded(*pair, largest) for pair in zip(one, other, strict=True))
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=_ROUNDING, abs_tol=1e-3 * _ROUNDING * largest)
    return bool(one == other)


def _check_uncertainty(spring: SpringParameters, uncertainty: Json) -> None:
    """Check the fields that this program reads, as far as they are given; raises ModelError, which names the field."""
    from .file_tables import Uncertainty

    with _refused_in_words("identify the spring again, or remove it", "uncertainty."):
        Uncertainty.model_validate(uncertainty)
    for name in (spring.elastic_name, "kA"):
        given, count = uncertainty.get(name), len(getattr(spring, name))
        if given is not None and len(given) != count:
            raise _wrong(f"uncertainty.{name}", f"must have {count} numbers, one for each coefficient", given)
    JointCovariance.from_uncertainty(spring, uncertainty)


def _check_start(spring: SpringParameters, start: Start) -> None:
    """Check that the start is one of this spring; raises ModelError, which names the field."""
    if (start.second_omega is None) != (spring.second is None):
        raise _wrong("start.second_omega", "must be given where there is a second mechanism only", start.second_omega)
    if len(start.branch_forces) != len(spring.branches):
        raise _wrong("start.branch_forces", f"must have {len(spring.branches)} numbers", start.branch_forces)


@contextmanager
def _refused_in_words(remedy: str, prefix: str = "") -> Iterator[None]:
    """What pydantic refuses in the block as one sentence that names the field."""
    from pydantic import ValidationError

    from ..ground.tables import refusal

    try:
        yield
    except ValidationError as error:
        raise ModelError(f"{prefix}{refusal(error, 0, remedy)}") from None


def _wrong(name: str, condition: str, value: object) -> ModelError:
    return ModelError(f"{name}: {condition}, got {shown(value)}; correct this field.")
