"""Whole outputs of public commands are those that are kept (README.md)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from make import GOLDEN, output

pytestmark = pytest.mark.long
COMMANDS = {name: kept["command"] for name, kept in json.loads(GOLDEN.read_text(encoding="utf-8")).items()}


def distance(before: Any, now: Any, of_angles: bool) -> float:
    """How far a figure is off, as a share of the largest of a list; infinite if something else than numbers differs."""
    if now == before:
        return 0.0
    if np.shape(before) != np.shape(now):
        return np.inf
    pairs = list(zip(np.ravel(np.array(before, object)), np.ravel(np.array(now, object)), strict=True))
    numbers = [pair for pair in pairs if type(pair[0]) is float and type(pair[1]) in (float, int)]
    if not numbers or any(a != b for a, b in pairs if type(a) is not float or type(b) not in (float, int)):
        return np.inf
    change = np.abs(np.subtract(*np.transpose(numbers)))
    return float((np.minimum(change, 360.0 - change) if of_angles else change).max() / np.abs(numbers).max())


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in ("simulate", "study"))) for name in COMMANDS]
)
def test_outputs_are_those_that_are_kept(name: str, tmp_path: Path) -> None:
    kept = json.loads(GOLDEN.read_text(encoding="utf-8"))[name]["figures"]
    found = output(COMMANDS[name], tmp_path)
    assert found.keys() == kept.keys()
    off = {place: distance(value, found[place], "phase" in place) for place, (value, _) in kept.items()}
    assert {place: (size, kept[place], found[place]) for place, size in off.items() if size > kept[place][1]} == {}
