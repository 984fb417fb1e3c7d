"""JSON of files that others may have written: finite numbers, unique names, bounded nesting."""

from __future__ import annotations

import json
import math
from collections import Counter
from typing import Any

from .quoting import printable

_MAX_NESTING = 200


def parse(text: str) -> Any:
    """The value of a JSON text.

    Raises
    ------
    json.JSONDecodeError   If it is not JSON.
    ValueError             If a number is not one that a double holds, an object names a field twice, or lists and
                           objects are nested too deeply; the message says which, without advice.
    """
    try:
        content = json.loads(
            text, parse_constant=_refuse_constant, parse_float=_float, parse_int=_integer, object_pairs_hook=_object
        )
        levels = _nesting(content)
    except RecursionError:
        levels = _MAX_NESTING + 1
    if levels > _MAX_NESTING:
        raise ValueError(f"lists or objects are nested more than {_MAX_NESTING} levels deep")
    return content


def plain(value: Any) -> Any:
    """A value as it is after it was written to a file and read again.

    Raises
    ------
    TypeError, ValueError, RecursionError   If JSON cannot represent it.
    """
    # In a list, since it will be part of something.
    return parse(json.dumps([value], allow_nan=False))[0]


def objects(content: Any) -> list[dict[str, Any]]:
    """The objects of a list of free JSON."""
    return [entry for entry in content if isinstance(entry, dict)] if isinstance(content, list) else []


def is_finite(value: object) -> bool:
    """Whether a value is a number that a double holds; true and false are none."""
    try:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # an integer beyond the range of float
        return False


def _refuse_constant(text: str) -> None:
    raise ValueError(f"numbers must be finite, got {text[:40]}")


def _float(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        _refuse_constant(text)
    return value


def _integer(text: str) -> int:
    _float(text)  # before it becomes an integer, which takes long if there are many digits
    return int(text)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) < len(pairs):
        duplicate = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise ValueError(f'field "{printable(duplicate)}" is given twice')
    return content


def _nesting(content: object) -> int:
    """Levels of lists and objects."""
    children = content.values() if isinstance(content, dict) else content if isinstance(content, list) else ()
    return 1 + max(map(_nesting, children), default=0)


def finite(value: float | None) -> float | None:
    """A number; None if it is not finite."""
    return float(value) if value is not None and math.isfinite(value) else None
