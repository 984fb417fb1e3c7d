"""Answers as plain values of JSON, to be compared with kept ones."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
import pytest

_LARGE = ("spring", "signal")


def plain(value: Any) -> Any:
    """Fields of dataclasses but for springs and signals, names of members, and no numbers that JSON lacks."""
    if is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in fields(value) if field.name not in _LARGE}
    if isinstance(value, dict):
        return {str(getattr(key, "name", key)): plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return float(f"{value:.9g}") if np.isfinite(value) else str(value)
    return value if value is None or isinstance(value, int | str) else getattr(value, "name", str(value))


def thinned(value: Any) -> Any:
    """Six of a long list, and numbers with the digits that are compared."""
    if isinstance(value, dict):
        return {key: thinned(one) for key, one in value.items() if key not in ("folder", "seconds")}
    if isinstance(value, list):
        kept = value if len(value) <= 12 else [value[k] for k in np.linspace(0, len(value) - 1, 6).astype(int)]
        return [len(value), *map(thinned, kept)]
    return float(f"{value:.9g}") if isinstance(value, float) else value


def different(found: Any, kept: Any, place: str, share: float) -> list[str]:
    """Where two answers differ: numbers by more than a share, and words but for the digits in them."""
    if isinstance(kept, dict) and isinstance(found, dict):
        missing = [f"{place}: {sorted(found.keys() ^ kept.keys())}"] if found.keys() != kept.keys() else []
        both = sorted(kept.keys() & found.keys())
        return missing + [text for key in both for text in different(found[key], kept[key], f"{place}.{key}", share)]
    if isinstance(kept, list) and isinstance(found, list) and len(found) == len(kept):
        pairs = enumerate(zip(found, kept, strict=True))
        return [text for k, pair in pairs for text in different(*pair, f"{place}[{k}]", share)]
    if isinstance(kept, float) and isinstance(found, float):
        # Below 1e-9 of a metre, newton or second there is only rounding.
        return [] if found == pytest.approx(kept, rel=share, abs=1e-9, nan_ok=True) else [f"{place}: {found} {kept}"]
    if isinstance(kept, str) and isinstance(found, str):
        found, kept = (re.sub(r"\d[\d.e+-]*", "#", text) for text in (found, kept))
    return [] if found == kept else [f"{place}: {found!r} {kept!r}"]


def lines(values: dict[str, Any], text: Callable[[Any], str] = json.dumps) -> str:
    """An object of JSON with a line for each key."""
    return "{\n" + ",\n".join(f"{json.dumps(key)}: {text(value)}" for key, value in values.items()) + "\n}\n"
