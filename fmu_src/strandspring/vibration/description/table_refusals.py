"""What is wrong with a table, in one sentence that names the field."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from pydantic import ValidationError

from ...errors import MountedSystemError, StrandspringError
from ...ground.files import readable
from ...records.units import quoted

TAG = "="  # begins what tells forms of a field apart, which is no part of the field's name
_LONGEST = 60


def field_name(location: Sequence[str | int]) -> str:
    """A field as people name it, such as mount[2].type; tables count from 1.

    Examples
    --------
    >>> field_name(("mount", 1, "type"))
    'mount[2].type'
    """
    name = ""
    for part in location:
        if isinstance(part, int):
            name += f"[{part + 1}]"
        elif not part.startswith(TAG):
            name += f".{readable(part)[:_LONGEST]}" if name else readable(part)[:_LONGEST]
    return name


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


def refusal(error: ValidationError) -> str:
    """The first thing that is wrong, without the file."""
    problem = error.errors(include_url=False)[0]
    context: Mapping[str, Any] = problem.get("ctx", {})
    value = problem.get("input")
    reason = _reason(problem["type"], context, value, problem["msg"])
    field = field_name(problem["loc"])
    text = f"{field}: {reason}" if field else reason
    return text if text.endswith(".") else f"{text}."


def _reason(kind: str, context: Mapping[str, Any], value: Any, own_message: str) -> str:
    if kind == "value_error":
        return str(context["error"])
    if kind == OWN:
        return f"{own_message}, got {_shown(value)}"
    if kind == "missing":
        return "is missing; add it"
    if kind == "literal_error":
        return f"must be {str(context['expected'])[:400]}, got {_shown(value)}"
    if kind in _BOUNDS:
        rule, key = _BOUNDS[kind]
        return f"must be {rule} {context[key]:g}, got {_shown(value)}"
    if kind in _COUNTS:
        rule, key, what = _COUNTS[kind]
        count = len(value) if isinstance(value, list | dict | str) else 0
        return "must not be empty" if count == 0 else f"must have {rule} {context[key]} {what}, got {count}"
    return f"must be {_EXPECTED.get(kind, 'what the description of the file format says')}, got {_shown(value)}"


OWN = "form"  # type of errors whose message is ours
_EXPECTED = {
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "list_type": "a list",
    "string_type": "text",
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "finite_number": "a finite number",
    "int_parsing_size": "a smaller number",
}
_BOUNDS = {
    "greater_than": (">", "gt"),
    "greater_than_equal": (">=", "ge"),
    "less_than": ("<", "lt"),
    "less_than_equal": ("<=", "le"),
}
_COUNTS = {
    "too_long": ("at most", "max_length", "entries"),
    "too_short": ("at least", "min_length", "entries"),
    "string_too_long": ("at most", "max_length", "characters"),
    "string_too_short": ("at least", "min_length", "characters"),
}


def _shown(value: Any) -> str:
    if isinstance(value, str):
        return quoted(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return f"{value!r:.40}"
    return "a list" if isinstance(value, list) else "a table" if isinstance(value, dict) else "something else"
