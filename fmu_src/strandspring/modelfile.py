"""The model file: one identified spring as JSON, validated on load, written as stable bytes."""

from __future__ import annotations

import json
import math
import re
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator, model_validator

from .core.parameters import MAXIMUM_DEGREE, N_RANGE, SIGMA_RANGE, SpringParameters
from .errors import ModelError
from .files import read_text, write_text

MAXIMUM_BYTES = 10_000_000
_VERSION = 1

# An identifier of C and Python that is also a safe file name.
NAME_PATTERN = r"^[A-Za-z][A-Za-z0-9_]{0,63}$"
NAME_RULE = "a letter followed by at most 63 letters, digits or underscores, and no device of Windows such as nul"
_RESERVED_ON_WINDOWS = {"con", "prn", "aux", "nul"} | {f"{d}{k}" for d in ("com", "lpt") for k in range(1, 10)}

Number = Annotated[float, Field(allow_inf_nan=False)]
Coefficients = Annotated[tuple[Number, ...], Field(min_length=1, max_length=MAXIMUM_DEGREE + 1)]
Json = dict[str, Any]


def checked_name(name: str) -> str:
    """The name, if a model and its FMU may be called so.

    Raises
    ------
    ModelError   If it is not an identifier, or cannot be a file name on Windows.
    """
    if not re.fullmatch(NAME_PATTERN, name) or name.lower() in _RESERVED_ON_WINDOWS:
        raise ModelError(f"The name must be {NAME_RULE}, got {name[:60]!r}; choose such a name.")
    return name


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Parameters(_Strict):
    """Parameters of the modified normalized Bouc-Wen model, paper eqs. (8)-(11), in SI units."""

    kE: Coefficients = Field(
        description="Elastic coefficients of ascending powers of displacement - displacement_offset [N/m^i]"
    )
    kA: Coefficients = Field(
        description="Amplifier coefficients of ascending powers of displacement - displacement_offset "
        "[1/m^i], the first of which is 1"
    )
    kappa_omega: Number = Field(gt=0.0, description="Saturated hysteretic force at displacement_offset [N]")
    rho: Number = Field(gt=0.0, description="Slope of omega at its zero crossing [1/m]")
    sigma: Number = Field(ge=SIGMA_RANGE[0], le=SIGMA_RANGE[1], description="Recovery after a reversal [-]")
    n: Number = Field(ge=N_RANGE[0], le=N_RANGE[1], description="Smoothness exponent [-]")
    displacement_offset: Number = Field(description="Displacement about which the polynomials are written [m]")
    displacement_min: Number = Field(description="Lower end of the identified range [m]")
    displacement_max: Number = Field(description="Upper end of the identified range [m]")

    @model_validator(mode="after")
    def _physically_possible(self) -> Parameters:
        self.spring()
        return self

    def spring(self) -> SpringParameters:
        """The parameters as the model takes them."""
        return SpringParameters(**self.model_dump())


class ModelFile(_Strict):
    """Content of a model file.

    `fit` and `uncertainty` hold figures of the identification; `provenance` names the records with sha256,
    the method, the options and the version. All three may be empty, as for a model written by hand.
    """

    format: Literal["strandspring-model"]
    format_version: Literal[1]
    name: str = Field(description=NAME_RULE, json_schema_extra={"pattern": NAME_PATTERN})
    description: str = Field(default="", max_length=2000)
    parameters: Parameters
    fit: Json = Field(default_factory=dict)
    uncertainty: Json = Field(default_factory=dict)
    provenance: Json = Field(default_factory=dict)

    @field_validator("format_version", mode="before")
    @classmethod
    def _whole_number(cls, version: object) -> object:
        # Python takes true and 1.0 for 1.
        if type(version) is not int or version != _VERSION:
            raise ValueError(f"input should be {_VERSION}")
        return version

    @field_validator("name")
    @classmethod
    def _identifier(cls, name: str) -> str:
        return checked_name(name)

    @field_validator("fit", "uncertainty", "provenance")
    @classmethod
    def _plain(cls, content: Json) -> Json:
        try:
            # Round trip: what is saved is what is held, and nothing that JSON cannot say is held.
            return dict(json.loads(json.dumps(content, allow_nan=False)))
        except (TypeError, ValueError, RecursionError):
            raise ValueError("must hold finite numbers, text, lists and objects only") from None

    @field_validator("description")
    @classmethod
    def _text(cls, text: str) -> str:
        # XML 1.0 cannot carry other control characters, not even escaped.
        bad = [c for c in text if (ord(c) < 32 and c not in "\t\n\r") or ord(c) in (0xFFFE, 0xFFFF)]
        if bad or any(0xD800 <= ord(c) <= 0xDFFF for c in text):
            raise ValueError("text must hold no control characters")
        return text


def model_file(name: str, parameters: SpringParameters, description: str = "", **extra: Json) -> ModelFile:
    """A model file of these parameters; `extra` may hold `fit`, `uncertainty` and `provenance`.

    Raises
    ------
    ModelError   If the name or the description is not allowed.
    """
    content = {
        "format": "strandspring-model",
        "format_version": _VERSION,
        "name": name,
        "parameters": asdict(parameters),
        "description": description,
        **extra,
    }
    try:
        return ModelFile.model_validate(content)
    except ValidationError as problem:
        raise ModelError(_sentence("the model", problem)) from None


def load_model(path: str | Path) -> ModelFile:
    """Read and validate a model file.

    Raises
    ------
    ModelError   One sentence naming the file and the field, if it cannot be read or is not a possible spring.
    """
    path = Path(path)
    text = read_text(path, MAXIMUM_BYTES, "model file (JSON)", ModelError)
    try:
        content = json.loads(
            text, parse_constant=_refuse_constant, parse_float=_finite, object_pairs_hook=_refuse_duplicates
        )
    except json.JSONDecodeError as problem:
        raise ModelError(
            f"{path}, line {problem.lineno}: not valid JSON ({problem.msg}); give a model file written by "
            "`strandspring identify`."
        ) from None
    except (ValueError, RecursionError) as problem:
        raise ModelError(f"{path}: not a valid model file ({problem}).") from None
    if not isinstance(content, dict) or content.get("format") != "strandspring-model":
        raise ModelError(
            f'{path}: field "format" must be "strandspring-model"; give a model file written by '
            "`strandspring identify`."
        )
    version = content.get("format_version")
    if type(version) is int and version > _VERSION:
        raise ModelError(
            f'{path}: field "format_version" is {str(version)[:20]}, so a newer strandspring has written the file, '
            f"and this one reads {_VERSION} only; upgrade strandspring."
        )
    try:
        return ModelFile.model_validate_json(text)
    except ValidationError as problem:
        raise ModelError(_sentence(str(path), problem)) from None


def save_model(path: str | Path, model: ModelFile) -> None:
    """Write a model file; the same model gives the same bytes."""
    text = json.dumps(model.model_dump(mode="json"), indent=2, ensure_ascii=False, allow_nan=False)
    write_text(Path(path), text + "\n")


def model_schema() -> Json:
    """The JSON Schema of the model file, published as ``models/strandspring-model.schema.json``."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **ModelFile.model_json_schema()}


def _refuse_constant(text: str) -> None:
    raise ValueError(f"numbers must be finite, found {text}")


def _finite(text: str) -> float:
    if not math.isfinite(float(text)):
        _refuse_constant(text[:40])
    return float(text)


def _refuse_duplicates(pairs: list[tuple[str, Any]]) -> Json:
    fields = dict(pairs)
    if len(fields) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f'field "{_printable(twice)}" is given twice')
    return fields


def _printable(text: str) -> str:
    """Text of a file as it may reach a terminal: no control character in it."""
    return ascii(text[:200])[1:-1]


def _sentence(where: str, problem: ValidationError) -> str:
    """The first problem pydantic found, as one sentence."""
    first = problem.errors()[0]
    field = _printable(".".join(str(part)[:40] for part in first["loc"]))
    kind, found = first["type"], ascii(first.get("input"))
    found = found if len(found) <= 60 else found[:57] + "..."
    if kind == "missing":
        return f'{where}: field "{field}" is missing; add it or identify the spring again.'
    if kind == "extra_forbidden":
        return f'{where}: field "{field}" is not known; remove it or correct its spelling.'
    if kind == "value_error" and field in {"", "parameters"}:
        return f"{where}: {str(first['ctx']['error']).rstrip('.')}; correct the parameters or identify again."
    if field == "name" and kind == "value_error":
        return f"{where}: {first['ctx']['error']}"
    reason = first["msg"].removeprefix("Value error, ")
    return f'{where}: field "{field}": {reason[0].lower()}{reason[1:]}, got {found}; correct this field.'
