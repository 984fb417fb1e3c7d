"""Cycles, windows and ranges as a user writes them: "2:5", "2:", ":5", "3"."""

from __future__ import annotations

import re

from ..errors import RecordError

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?"
_WINDOW = re.compile(rf"\s*({_NUMBER})?\s*:\s*({_NUMBER})?\s*")
_CYCLES = re.compile(r"\s*([0-9]{1,9})?\s*(:)?\s*([0-9]{1,9})?\s*")


def is_window(text: str) -> bool:
    """Whether a text is "FROM:TO", with numbers of which one may be left out.

    Examples
    --------
    >>> from strandspring.loops.windows import is_window
    >>> is_window("0.5:"), is_window("Time"), is_window(":")
    (True, False, False)
    """
    match = _WINDOW.fullmatch(text)
    return match is not None and any(match.groups())


def window(text: str) -> tuple[float | None, float | None]:
    """Both ends of "FROM:TO", None for one that is left out.

    Raises
    ------
    RecordError   If the text is not of that form.

    Examples
    --------
    >>> from strandspring.loops.windows import window
    >>> window("-5:2.5"), window("3:")
    ((-5.0, 2.5), (3.0, None))
    """
    match = _WINDOW.fullmatch(text) if isinstance(text, str) else None
    if match is None or not any(match.groups()):
        raise RecordError(f"must be FROM:TO, such as 2.5:10, 2.5: or :10, got {text!r:.60}.")
    low, high = (None if end is None else float(end) for end in match.groups())
    if low is not None and high is not None and low > high:
        raise RecordError(f"must be FROM:TO of which the first is not above the second, got {text!r:.60}.")
    return low, high


def cycle_range(text: str) -> tuple[int | None, int | None]:
    """First and last cycle of "2:5", "2:", ":5" or "3".

    Raises
    ------
    RecordError   If the text is not of that form.

    Examples
    --------
    >>> from strandspring.loops.windows import cycle_range
    >>> cycle_range("2:5"), cycle_range(":5"), cycle_range("3")
    ((2, 5), (None, 5), (3, 3))
    """
    match = _CYCLES.fullmatch(text) if isinstance(text, str) else None
    if match is None or not (match[1] or match[3]):
        raise RecordError(f"must be a cycle or FIRST:LAST, such as 3, 2:5, 2: or :5, got {text!r:.60}.")
    if match[2] is None:
        return int(text), int(text)
    first, last = (int(number) if number else None for number in (match[1], match[3]))
    if first is not None and last is not None and first > last:
        raise RecordError(f"must be FIRST:LAST of which the first is not above the second, got {text!r:.60}.")
    return first, last
