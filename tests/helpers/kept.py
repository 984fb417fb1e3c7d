"""Answers as plain values of JSON, compared with kept ones.

After a change that is meant to move them: STRANDSPRING_KEEP=1 python -m pytest -n 0 and the file of the tests.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from strandspring import __version__

ITEMS = 5  # of a long list or table that are kept
NUMBER = re.compile(r"([-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)")
# What differs from machine to machine or release to release.
ELSEWHERE = {"sha256", "size", "seconds", "elapsed", "folder", "binaries"}
OF_MACHINE = re.compile(
    r"(?<=\.fmu )\([^)]*\)|(?<=Binaries: ).*(?= Check:)|\d+(?:\.\d+)?(?:e-\d+)? (?:ms\b|KiB)|\(\d[\d.]* s\b[^)]*\)"
    r"|within \S+ N|(?<=reproduced )exactly|\d+ files are unchanged|\b(?:linux|win|darwin)64\b"
)


def changes(path: Path, answers: dict[str, Any], rtol: float) -> list[Any]:
    """Places at which answers differ from those of their names in a file."""
    found = json.loads(json.dumps(answers).replace(__version__, "VERSION"))
    kept = json.loads(path.read_text(encoding="utf-8"))
    if "STRANDSPRING_KEEP" in os.environ:
        kept |= found
        lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in kept.items())
        path.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    return list(differences({name: kept[name] for name in found}, found, rtol))


def plain(value: Any) -> Any:
    """Fields of dataclasses but for springs, catalogues, signals; names of members, and no numbers that JSON lacks."""
    if is_dataclass(value):
        names = [field.name for field in fields(value) if field.name not in ("spring", "stated", "signal")]
        value = {name: getattr(value, name) for name in names}
    if isinstance(value, dict):
        return {str(getattr(key, "name", key)): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return float(f"{value:.9g}") if np.isfinite(value) else str(value)
    return value if value is None or isinstance(value, int | str) else getattr(value, "name", str(value))


def words(text: str) -> str:
    return OF_MACHINE.sub("...", " ".join(text.split()))


def thinned(content: Any) -> Any:
    """Without what differs elsewhere; of long lists the length and some items, the first and the last among them."""
    if isinstance(content, dict):
        return {key: thinned(value) for key, value in content.items() if key not in ELSEWHERE}
    if not isinstance(content, list):
        return words(content) if isinstance(content, str) else content
    items = content
    if len(content) > ITEMS:
        items = [len(content), *(content[k * (len(content) - 1) // (ITEMS - 1)] for k in range(ITEMS))]
    return [thinned(item) for item in items]


def differences(kept: Any, found: Any, rtol: float, place: str = "") -> Iterator[Any]:
    """Places at which kept and found differ, with both."""
    if isinstance(kept, dict) and isinstance(found, dict) and list(kept) == list(found):
        for key in kept:
            yield from differences(kept[key], found[key], rtol, f"{place}.{key}")
    elif isinstance(kept, list) and isinstance(found, list) and len(kept) == len(found):
        for k, (one, other) in enumerate(zip(kept, found, strict=True)):
            yield from differences(one, other, rtol, f"{place}[{k}]")
    elif isinstance(kept, str) and isinstance(found, str):
        parts, others = NUMBER.split(kept), NUMBER.split(found)
        numbers = zip(parts[1::2], others[1::2], strict=False)
        if parts[::2] != others[::2] or not all(_is_near(one, other, rtol) for one, other in numbers):
            yield place, kept, found
    elif isinstance(kept, float) and isinstance(found, float):
        # Below 1e-9 of a metre, newton or second there is only rounding.
        if not math.isclose(kept, found, rel_tol=rtol, abs_tol=1e-9):
            yield place, kept, found
    elif kept != found or type(kept) is not type(found):
        yield place, kept, found


def _is_near(kept: str, found: str, rtol: float) -> bool:
    """Whether printed numbers differ by one unit of the last digit at most, or by the tolerance."""
    if kept == found:  # also where it is no finite number
        return True
    one, other = (float(text.replace("−", "-")) for text in (kept, found))
    digits, _, exponent = kept.partition("e")
    unit = 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
    return abs(one - other) <= max(1.001 * unit if "." in kept else 0.0, rtol * abs(one), 1e-12)
