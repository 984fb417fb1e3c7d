"""Windows that people write as FROM:TO."""

from __future__ import annotations

import re

from ..errors import RecordError
from ..ground.arguments import is_finite_number

Bounds = tuple[float | None, float | None]

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_WINDOW = re.compile(rf"\s*({_NUMBER})?\s*:\s*({_NUMBER})?\s*")


def check_ends(name: str, ends: Bounds, shown: object) -> None:
    """Refuse what are no two ends, of which either may be None."""
    unit = {"time": " [s]", "displacement": " [m]"}.get(name, "")
    if not (isinstance(ends, tuple | list) and len(ends) == 2):
        raise RecordError(f"`{name}` must be a pair of first and last{unit}, None for an open end, got {shown!s:.60}.")
    given = [value for value in ends if value is not None]
    if not all(map(is_finite_number, given)) or given != sorted(given):
        raise RecordError(
            f"`{name}` must be two finite numbers{unit} of which the first is not above the second, got {shown!s:.60}."
        )
    if name == "cycles" and any(value != int(value) or value < 1 for value in given):
        raise RecordError(f"`cycles` must be whole numbers from 1 on, got {shown!s:.60}.")


def is_window(text: str) -> bool:
    """Whether a text is "FROM:TO", with numbers of which one may be left out."""
    match = _WINDOW.fullmatch(text)
    return match is not None and any(match.groups())


def window(text: str, name: str = "window", factor: float = 1.0) -> Bounds:
    """Both ends of "FROM:TO" times a factor, None for one that is left out; other texts are a RecordError."""
    # One cycle is both ends of its range.
    whole = f"{text}:{text}" if name == "cycles" and isinstance(text, str) and ":" not in text else text
    match = _WINDOW.fullmatch(whole) if isinstance(whole, str) and is_window(whole) else None
    if match is None:
        cycles = "a cycle or FIRST:LAST, such as 3, 2:5, 2: or :5"
        form = cycles if name == "cycles" else "FROM:TO, such as 2.5:10, 2.5: or :10"
        raise RecordError(f"`{name}` must be {form}, got {text!r:.60}.")
    low, high = (None if end is None else factor * float(end) for end in match.groups())
    check_ends(name, (low, high), repr(text))
    return low, high
