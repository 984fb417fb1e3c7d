"""Tables of files from outside as pydantic models, and what is wrong with one in a sentence that names the field."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from .files import readable
from .quoting import quoted, shown

TAG = "="  # begins what tells forms of a field apart, which is no part of the field's name
_KEY = "[key]"  # what pydantic adds to the location of a key that is wrong
OWN = "form"  # type of errors whose message is ours
_LONGEST = 60
_LONGEST_NAME = 80
_LISTED = 20
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,4})?)\s*(.*)", re.DOTALL)


def suggestion(name: str, known: Sequence[str]) -> str:
    """What is meant by an unknown name, or what there is, as the end of a sentence without its stop."""
    near = get_close_matches(name[:_LONGEST_NAME], known, n=1)
    if near:
        return f"use {quoted(near[0])} if you mean that"
    if not known:
        return "there are none, so remove it"
    more = f" and {len(known) - _LISTED} more" if len(known) > _LISTED else ""
    return f"use one of {', '.join(map(quoted, known[:_LISTED]))}{more}"


class StrictTable(BaseModel):
    """A table of a file; unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _check_keys(cls, content: Any) -> Any:
        if isinstance(content, dict) and cls.model_config.get("extra") == "forbid":
            known = list(cls.model_fields)
            for key in content:
                if key not in known:
                    raise ValueError(f"{quoted(key)} is not a key here; {suggestion(key, known)}")
        return content


def field_name(location: Sequence[str | int], first: int = 1) -> str:
    """A field as people name it, such as mount[2].type; tables count from `first`.

    Examples
    --------
    >>> field_name(("mount", 1, "type"))
    'mount[2].type'
    """
    name = ""
    for part in location:
        if isinstance(part, int):
            name += f"[{part + first}]"
        elif not part.startswith(TAG) and part != _KEY:
            name += f".{readable(part)[:_LONGEST]}" if name else readable(part)[:_LONGEST]
    return name


def refusal(error: ValidationError, first: int = 1, remedy: str = "") -> str:
    """The first thing that is wrong, without the file; lists count from `first`.

    Parameters
    ----------
    error : ValidationError
    first : int               Number of the first entry of a list.
    remedy : str              What to do about a wrong value.
    """
    problem = error.errors(include_url=False)[0]
    context: Mapping[str, Any] = problem.get("ctx", {})
    reason = _reason(problem["type"], context, problem.get("input"), problem["msg"])
    advice = _how_to_write(problem["type"], problem.get("input"))
    if not advice and problem["type"] not in _WITH_REMEDY:
        advice = remedy
    field = field_name(problem["loc"], first)
    return (f"{field}: {reason}" if field else reason) + (f"; {advice}." if advice else ".")


def _reason(kind: str, context: Mapping[str, Any], value: Any, own_message: str) -> str:
    if kind == "value_error":
        return str(context["error"])
    if kind == OWN:
        return f"{own_message}, got {shown(value)}"
    if kind == "missing":
        return "is missing; add it"
    if kind == "literal_error":
        return f"must be {str(context['expected'])[:400]}, got {shown(value)}"
    if kind in _BOUNDS:
        rule, key = _BOUNDS[kind]
        return f"must be {rule} {context[key]:g}, got {shown(value)}"
    if kind in _COUNTS:
        rule, key, what = _COUNTS[kind]
        count = len(value) if isinstance(value, list | dict | str) else 0
        return "must not be empty" if count == 0 else f"must have {rule} {context[key]} {what}, got {count}"
    return f"must be {_EXPECTED.get(kind, 'what the description of the file format says')}, got {shown(value)}"


def _how_to_write(kind: str, value: Any) -> str:
    """How to write the number that a text begins with, of percents their hundredth; "" if there is none.

    Examples
    --------
    >>> _how_to_write("float_type", "90 %"), _how_to_write("float_type", "most"), _how_to_write("int_type", "9 mm")
    ('write 0.9', '', 'write the number alone, without quotation marks')
    """
    is_text = kind in ("float_type", "int_type") and isinstance(value, str) and len(value) <= _LONGEST
    match = _NUMBER.fullmatch(value) if is_text else None
    if match is None:
        return ""
    size = {"": 1.0, "%": 100.0}.get(match[2].strip())
    # Fifteen digits are exact.
    if size is None or abs(float(match[1])) >= 1e15:
        return "write the number alone, without quotation marks"
    number = float(match[1]) / size
    return "" if kind == "int_type" and number % 1.0 != 0.0 else f"write {number:.15g}"


_WITH_REMEDY = ("value_error", "missing")
_EXPECTED = {
    "model_type": "a table of keys and values",
    "model_attributes_type": "a table of keys and values",
    "dict_type": "a table of keys and values",
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
