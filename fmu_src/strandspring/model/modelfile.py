"""The model file: one identified spring as JSON, validated on load, written as stable bytes.

``models/strandspring-model.schema.json`` describes it for other programs; see `model_schema`.
"""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from ..core.parameters import KNOTS, MAXIMUM_AMPLIFIER_DEGREE, MAXIMUM_DEGREE, SCALARS, SpringParameters
from ..errors import ModelError
from ..ground.files import bundled_file, read_bytes, read_text, readable, write_text
from ..ground.strict_json import escaped, is_finite, parse, plain, shown
from ..ground.unpacking import unpacked
from .stated_uncertainty import check_uncertainty

MAXIMUM_BYTES = 10_000_000
MAXIMUM_FMU_BYTES = 200_000_000  # packed, and all its files together unpacked
MODEL_IN_FMU = "resources/strandspring/model.json"
_FORMAT = "strandspring-model"
_SCHEMA = f"{_FORMAT}.schema.json"  # beside the models of a source checkout, below examples in a wheel
# Of a model whose FE is a polynomial, and of one whose FE is a table.
_VERSION, _TABLE_VERSION = 1, 2
# The lists among the parameters in the order of the file, with how many numbers each may have.
_POLYNOMIALS = {"kE": (1, MAXIMUM_DEGREE + 1), "kA": (1, MAXIMUM_AMPLIFIER_DEGREE + 1)}
_TABLES = {"FE_knots": KNOTS, "FE_forces": KNOTS, "kA": (1, MAXIMUM_AMPLIFIER_DEGREE + 1)}
_LISTS = {_VERSION: _POLYNOMIALS, _TABLE_VERSION: _TABLES}
_MAX_DESCRIPTION = 2000

# An identifier of C and Python that is also a safe file name.
LONGEST_NAME = 64
NAME_PATTERN = r"^[A-Za-z][A-Za-z0-9_]{0,63}$"
NAME_RULE = "a letter followed by at most 63 letters, digits or underscores, and not a Windows device such as nul"
_WINDOWS_DEVICES = {"con", "prn", "aux", "nul"} | {f"{d}{k}" for d in ("com", "lpt") for k in range(1, 10)}

Json = dict[str, Any]


def check_name(name: str) -> str:
    """The name, if it is valid for a model and its FMU.

    Raises
    ------
    ModelError   If it is not an identifier, or cannot be a file name on Windows.
    """
    if not isinstance(name, str):
        raise ModelError(f"The name must be text, got {type(name).__name__}.")
    if not re.fullmatch(NAME_PATTERN, name) or name.lower() in _WINDOWS_DEVICES:
        raise ModelError(f"The name must be {NAME_RULE}, got {name[:60]!r}; choose another name.")
    return name


def identifier(text: str) -> str:
    """Text, such as a file name without its suffix, as a valid name."""
    name = re.sub(r"[^A-Za-z0-9_]+", "_", text).strip("_")[:LONGEST_NAME].rstrip("_")
    try:
        return check_name(name)
    except ModelError:  # begins with a digit, say
        return f"spring_{name}"[:LONGEST_NAME].rstrip("_")


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

    Raises
    ------
    ModelError   If the name or the description is invalid, a dict contains what JSON cannot represent, or a field of
                 the uncertainty is not what this program reads there.
    """

    name: str
    parameters: SpringParameters
    description: str = ""
    fit: Json = field(default_factory=dict)
    uncertainty: Json = field(default_factory=dict)
    provenance: Json = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_name(self.name)
        if len(self.description) > _MAX_DESCRIPTION:
            raise _wrong("description", f"must have at most {_MAX_DESCRIPTION} characters", self.description)
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
        check_uncertainty(self.parameters, self.uncertainty)

    @classmethod
    def from_content(cls, content: Json) -> ModelFile:
        """The model of a JSON object.

        Raises
        ------
        ModelError   If a field is missing, unknown or invalid; the message names it.
        """
        _check_fields(content, ("format", "format_version", "name", "parameters"), {f.name for f in fields(cls)})
        if content["format"] != _FORMAT:
            raise _wrong("format", f"must be {_FORMAT!r}", content["format"])
        # Python considers true and 1.0 equal to 1.
        version = content["format_version"]
        if type(version) is not int or version not in _LISTS:
            raise _wrong("format_version", f"must be {_VERSION}, or {_TABLE_VERSION} where FE is a table", version)
        values = {name: content[name] for name in content if name not in ("format", "format_version")}
        for name, value in values.items():
            expected, description = (str, "text") if name in ("name", "description") else (dict, "an object")
            if not isinstance(value, expected):
                raise _wrong(name, f"must be {description}", value)
        return cls(**{**values, "parameters": _parameters(values["parameters"], _LISTS[version])})

    def to_json(self) -> str:
        """Text of the file; the same model gives the same text."""
        content = {
            "format": _FORMAT,
            "format_version": _TABLE_VERSION if self.parameters.FE_knots else _VERSION,
            "name": self.name,
            "description": self.description,
            "parameters": self.parameters.as_dict(),
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
    schema: Json = json.loads(bundled_file(Path(_SCHEMA)).read_bytes())
    return schema


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
    if not isinstance(content, dict) or content.get("format") != _FORMAT:
        raise ModelError(
            f'{path}: field "format" must be "{_FORMAT}"; give a model file written by `strandspring identify`.'
        )
    version = content.get("format_version")
    if type(version) is int and version > _TABLE_VERSION:
        raise ModelError(
            f'{path}: field "format_version" is {str(version)[:20]}: the file was written by a newer strandspring, '
            f"and this one reads versions {_VERSION} and {_TABLE_VERSION} only; upgrade strandspring."
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
        content = unpacked(packed, MAXIMUM_BYTES, (name,)).get(name)
        text = None if content is None else _decoded(content, name)
    except ValueError as problem:
        raise ModelError(
            f"{readable(path)} cannot be read as an FMU ({problem}); copy it again, or build it again."
        ) from None
    if text is None:
        raise ModelError(f"{readable(path)} holds no {name}; give the FMU of a spring that strandspring built.")
    return text


def _decoded(content: bytes, name: str) -> str:
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise ValueError(f"{name} is not UTF-8 text") from None


def save_model(path: str | Path, model: ModelFile) -> None:
    """Write a model file; the same model gives the same bytes."""
    write_text(Path(path), model.to_json())


def _parameters(values: Json, lists: Mapping[str, tuple[int, int]]) -> SpringParameters:
    """The parameters of a model file with these lists."""
    _check_fields(values, (*lists, *SCALARS), (), "parameters.")
    for name, (least, most) in lists.items():
        value = values[name]
        if not (isinstance(value, list) and least <= len(value) <= most and all(map(is_finite, value))):
            raise _wrong(f"parameters.{name}", f"must be a list of {least} to {most} finite numbers", value)
    for name in SCALARS:
        if not is_finite(values[name]):
            raise _wrong(f"parameters.{name}", "must be a finite number", values[name])
    try:
        return SpringParameters(**{"kE": (), **values, **{name: float(values[name]) for name in SCALARS}})
    except ValueError as problem:
        raise ModelError(f"{str(problem).rstrip('.')}; correct the parameters or identify again.") from None


def _check_fields(content: Json, required: Iterable[str], optional: Collection[str], prefix: str = "") -> None:
    for name in required:
        if name not in content:
            raise ModelError(f'field "{prefix}{name}" is missing; add it or identify the spring again.')
    for name in content:
        if name not in required and name not in optional:
            raise ModelError(f'field "{prefix}{escaped(name[:40])}" is not known; remove it or correct its spelling.')


def _wrong(name: str, condition: str, value: object) -> ModelError:
    return ModelError(f'field "{name}": {condition}, got {shown(value)}; correct this field.')
