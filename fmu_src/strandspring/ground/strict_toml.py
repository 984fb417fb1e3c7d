"""TOML of files that others may have written: bounded nesting, no key that takes minutes to read."""

from __future__ import annotations

import json
import re
import sys
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_MAX_NESTING = 60
# A part of a dotted key between two dots. The parser's time grows as the square of the number of parts.
_PART = re.compile(r"""\.[ \t]*(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*(?=\.)""")
_MOST_PARTS = 1000


def parse_toml(text: str) -> dict[str, Any]:
    """The content of a TOML text as JSON represents it; dates and times become text.

    Raises
    ------
    ValueError   If it is not TOML, or is nested too deeply; the message says which, without advice.

    Examples
    --------
    >>> parse_toml('a = [1, 2.5, 2024-05-01]')
    {'a': [1, 2.5, '2024-05-01']}
    """
    if len(_PART.findall(text)) > _MOST_PARTS:
        raise ValueError(f"its dotted keys have more than {_MOST_PARTS} parts")
    try:
        content = tomllib.loads(text)
        _check_nesting(content)
        plain: dict[str, Any] = json.loads(json.dumps(content, default=str))
    except tomllib.TOMLDecodeError:
        raise
    except RecursionError:
        raise ValueError("lists or tables are nested too deeply") from None
    except ValueError as problem:
        # Python does not read integers of thousands of digits.
        raise ValueError("an integer has too many digits" if "digits" in str(problem) else str(problem)) from None
    return plain


def _check_nesting(content: Any) -> None:
    """Refuse what is nested deeper than any description, level by level, since keys may nest a thousandfold."""
    level = [content]
    for _ in range(_MAX_NESTING):
        level = [
            child
            for value in level
            for child in (value.values() if isinstance(value, dict) else value if isinstance(value, list) else ())
        ]
        if not level:
            return
    raise ValueError(f"lists or tables are nested more than {_MAX_NESTING} levels deep")
