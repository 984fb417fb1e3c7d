"""Types of the fields of SYSTEM.toml, each with the sentence that refuses another value and its JSON schema."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any

from pydantic import Discriminator, Field, GetCoreSchemaHandler, PlainValidator

from ...errors import MountedSystemError, StrandspringError
from ...ground.quoting import quoted, shown
from ...ground.strict_json import is_finite
from ...ground.tables import OWN, TAG, field_name
from ..bodies.parts import Vector
from . import quantity_text as q

_LONGEST_NAME = 80
_AXES: Mapping[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class FieldError(MountedSystemError):
    """What is wrong with a field.

    Parameters
    ----------
    location : tuple of str and int   Of the field.
    problem : str                     What is wrong, and what to do.
    """

    def __init__(self, location: tuple[str | int, ...], problem: str) -> None:
        super().__init__(f"{field_name(location)}: {problem}")
        self.location, self.problem = location, problem


@contextmanager
def located(*location: str | int) -> Iterator[None]:
    """Errors in the block as those of a field, or of the fields of a table there."""
    try:
        yield
    except FieldError as error:
        raise FieldError((*location, *error.location), error.problem) from None
    except StrandspringError as error:
        raise FieldError(location, str(error)) from None


@dataclass(frozen=True, eq=False)
class ReadBy:
    """Makes a type of a function that reads it.

    Parameters
    ----------
    read : callable      Takes what stands in the file; raises ValueError with the rest of a sentence that begins with
                         the field.
    schema : mapping     JSON schema of what stands in the file.
    """

    read: Callable[[Any], Any]
    schema: Mapping[str, Any]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        return PlainValidator(self.read).__get_pydantic_core_schema__(source, handler)

    def __get_pydantic_json_schema__(self, _core: Any, _handler: Any) -> dict[str, Any]:
        return dict(self.schema)


def kind_of_value(value: Any) -> str:
    """The tag of the form of a field: what TOML calls its value."""
    kind = "table" if isinstance(value, dict) else "list" if isinstance(value, list) else "quantity"
    return f"{TAG}{kind}"


def forms(message: str) -> Discriminator:
    """Tells forms of a field apart by what TOML calls its value."""
    return Discriminator(kind_of_value, custom_error_type=OWN, custom_error_message=message)


def _read_quantity(least: float, *kinds: q.QuantityKind) -> Callable[[Any], float]:
    def read(value: Any) -> float:
        number = q.in_si(value, *kinds)
        if least > 0.0 and not number >= least:
            raise ValueError(f"must be {kinds[0].name} > 0, got {shown(value)}")
        if least == 0.0 and not number >= 0.0:
            raise ValueError(f"must be {kinds[0].name} >= 0, got {shown(value)}")
        return number

    return read


def _measured(kind: q.QuantityKind, least: float = -math.inf) -> ReadBy:
    bound = {"minimum": 0} if least == 0.0 else {"exclusiveMinimum": 0} if least > 0.0 else {}
    text = {"type": "string", "maxLength": 60, "pattern": r"^\s*[+-]?[0-9.]", "examples": [kind.example]}
    bare = f"a number in the unit that `units` states for {kind.key}" if kind.key else f"a number in {kind.unit}"
    schema = {
        "anyOf": [{"type": "number", **bound}, text],
        "description": f"{kind.name[:1].upper()}{kind.name[1:]}: text with its unit, or {bare}.",
    }
    return ReadBy(_read_quantity(least, kind), schema)


def unit_of(kind: q.QuantityKind) -> ReadBy:
    """The unit of numbers without one, which is read as its size in SI units."""
    example = kind.example.split(" ", 1)[1]

    def read(value: Any) -> float:
        try:
            return q.unit_in_si(value, kind)
        except q.QuantityError:
            raise ValueError(f"must be the unit of {kind.name}, such as '{example}', got {shown(value)}") from None

    return ReadBy(read, {"type": "string", "minLength": 1, "maxLength": 60, "examples": [example]})


_POSITIVE = 5e-324  # the least number above 0

Length = Annotated[float, _measured(q.LENGTH)]
PositiveLength = Annotated[float, _measured(q.LENGTH, _POSITIVE)]
Mass = Annotated[float, _measured(q.MASS, _POSITIVE)]
Duration = Annotated[float, _measured(q.TIME, _POSITIVE)]
Time = Annotated[float, _measured(q.TIME, 0.0)]
Angle = Annotated[float, _measured(q.ANGLE)]
PositiveAngle = Annotated[float, _measured(q.ANGLE, _POSITIVE)]
Force = Annotated[float, _measured(q.FORCE)]
PositiveForce = Annotated[float, _measured(q.FORCE, _POSITIVE)]
Velocity = Annotated[float, _measured(q.VELOCITY, _POSITIVE)]
Acceleration = Annotated[float, _measured(q.ACCELERATION)]
PositiveAcceleration = Annotated[float, _measured(q.ACCELERATION, _POSITIVE)]
Frequency = Annotated[float, _measured(q.FREQUENCY, _POSITIVE)]
Stiffness = Annotated[float, _measured(q.STIFFNESS, _POSITIVE)]
Damping = Annotated[float, _measured(q.DAMPING, 0.0)]
Inertia = Annotated[float, _measured(q.INERTIA)]
Impulse = Annotated[float, _measured(q.IMPULSE, _POSITIVE)]
PositiveInertia = Annotated[float, _measured(q.INERTIA, _POSITIVE)]


def _read_rate(value: Any) -> tuple[float, bool]:
    """A sweep rate above 0 and whether it is logarithmic."""
    if not isinstance(value, str):
        raise ValueError("must be a rate with its unit, such as '3 oct/min' or '10 Hz/s'")
    rate, kind = q.measured(value, q.OCTAVE_RATE, q.FREQUENCY_RATE)
    if not rate > 0.0:
        raise ValueError(f"must be a rate > 0, got {quoted(value)}; a sweep down goes from the higher frequency")
    return rate, kind is q.OCTAVE_RATE


SweepRate = Annotated[
    tuple[float, bool],
    ReadBy(_read_rate, {"type": "string", "maxLength": 60, "examples": ["3 oct/min", "10 Hz/s"]}),
]


def _read_vector(value: Any, kind: q.QuantityKind) -> Vector:
    if not (isinstance(value, list) and len(value) == 3):
        raise ValueError(f"must be a list of x, y and z, such as ['{kind.example}', 0, 0], got {shown(value)}")
    x, y, z = (q.in_si(component, kind) for component in value)
    return x, y, z


def _vector(kind: q.QuantityKind) -> ReadBy:
    coordinate = {"anyOf": [{"type": "number"}, {"type": "string", "maxLength": 60}]}
    return ReadBy(
        partial(_read_vector, kind=kind),
        {
            "type": "array",
            "items": coordinate,
            "minItems": 3,
            "maxItems": 3,
            "description": f"x, y, z: texts with units, or numbers in the unit that `units` states for {kind.key}.",
        },
    )


Place = Annotated[Vector, _vector(q.LENGTH)]
AccelerationVector = Annotated[Vector, _vector(q.ACCELERATION)]


@dataclass(frozen=True)
class Direction:
    """A unit vector and how it is written."""

    vector: Vector
    text: str


def read_direction(value: Any) -> Direction:
    """The direction "+x", "-z" or [1, 0, 1].

    Raises
    ------
    ValueError   If it is none; the text is the rest of a sentence.
    """
    if isinstance(value, str):
        axis = _AXES.get(value.strip()[-1:].lower())
        sign = value.strip()[:-1]
        if axis is None or sign not in ("", "+", "-"):
            raise ValueError(f"must be '+x', '-x', '+y', '-y', '+z', '-z' or three numbers, got {quoted(value)}")
        factor = -1.0 if sign == "-" else 1.0
        x, y, z = (factor * component if component else 0.0 for component in axis)
        return Direction((x, y, z), f"{sign or '+'}{value.strip()[-1:].lower()}")
    if not (isinstance(value, list) and len(value) == 3 and all(is_finite(component) for component in value)):
        raise ValueError(f"must be three numbers, or a text such as '+x', got {shown(value)}")
    # The largest first, so that neither squares nor their sum leave the range of a double.
    largest = max(abs(float(component)) for component in value)
    if largest == 0.0:
        raise ValueError("must be a direction, got three zeros")
    scaled = [float(component) / largest for component in value]
    length = math.hypot(*scaled)
    x, y, z = (component / length for component in scaled)
    return Direction((x, y, z), f"({', '.join(f'{float(component):g}' for component in value)})")


_DIRECTION_SCHEMA = {
    "anyOf": [
        {"type": "string", "pattern": "^[+-]?[xyzXYZ]$"},
        {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
    ],
    "description": "'+x', '-z' and the like, or a vector of any length.",
}
NamedDirection = Annotated[Direction, ReadBy(read_direction, _DIRECTION_SCHEMA)]


def _read_name(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError(f"must be text, got {shown(value)}")
    if not (1 <= len(value) <= _LONGEST_NAME and value.isprintable() and value.strip() == value):
        raise ValueError(
            f"must be a name of 1 to {_LONGEST_NAME} printable characters without blanks at its ends, got "
            f"{quoted(value)}"
        )
    return value


Name = Annotated[str, ReadBy(_read_name, {"type": "string", "minLength": 1, "maxLength": _LONGEST_NAME})]
FilePath = Annotated[str, Field(min_length=1, max_length=1000)]
Text = Annotated[str, Field(max_length=2000)]
