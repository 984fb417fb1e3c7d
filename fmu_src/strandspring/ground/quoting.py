"""Text and values of files and users as messages show them: escaped and shortened."""

from __future__ import annotations

import json
from typing import Any

_MAX_SHOWN = 60


def quoted(text: str) -> str:
    """Quote text of a file or of the user for a message: escaped, and cut after 40 characters."""
    return repr(text if len(text) <= 40 else text[:39] + "…")


def shown(value: object) -> str:
    """A value of a TOML or JSON file for a message, shortened."""
    if isinstance(value, str):
        return quoted(value)
    try:
        is_of_json = value is None or isinstance(value, (bool, list, dict))
        text = json.dumps(value, default=repr) if is_of_json else repr(value)
    except (ValueError, RecursionError):  # from a program: an integer of thousands of digits, or endless nesting
        text = type(value).__name__
    return text if len(text) <= _MAX_SHOWN else text[: _MAX_SHOWN - 3] + "..."


def printable(value: Any) -> str:
    """Text of a file without control characters, which could change the terminal, and which XML cannot hold."""
    return "".join(c if c.isprintable() else "?" for c in str(value))
