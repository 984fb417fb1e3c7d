"""Whole outputs of public commands are those that are kept (README.md)."""

from __future__ import annotations

import csv
import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from terminal import Terminal

pytestmark = pytest.mark.long
HERE = Path(__file__).parent
GOLDEN = HERE / "golden.json"
# Models lie here, records and examples where they are installed from.
SOURCES = (HERE, *(HERE.parents[1] / folder for folder in ("models/records", "fmu_src/strandspring/examples/systems")))
KEPT = 24  # of a longer list, from its beginning to its end
SHARES = {"predict": 3e-6, "compare": 1e-6, "plan": 1e-6}  # tolerances where something is searched for


def flat(content: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Leaves by their place, rows of one kind as columns; sentences, which may be said better, are left out."""
    if isinstance(content, list) and content and all(isinstance(row, dict) for row in content):
        # Where an output is computed between the frequencies that are asked for is left open.
        rows = [row for row in content if str(row.get("requested", row.get("requested frequency", True))) == "True"]
        is_table = len({tuple(row) for row in rows}) == 1
        content = {key: [row[key] for row in rows] for key in rows[0]} if is_table else rows
    if isinstance(content, list) and any(isinstance(value, list | dict) for value in content):
        content = {str(k): value for k, value in enumerate(content)}
    if isinstance(content, dict):
        for key, value in content.items():
            yield from flat(value, f"{place}{key}.")
        return
    if isinstance(content, list) and len(content) > KEPT:
        content = [len(content), *(content[(len(content) - 1) * k // (KEPT - 1)] for k in range(KEPT))]
    if not any(isinstance(value, str) and " " in value for value in np.atleast_1d(np.array(content, object))):
        yield place.rstrip("."), content


def is_near(kept: Any, found: Any, share: float, of_angles: bool) -> bool:
    """Whether numbers differ by at most a share of the largest of a list."""
    if kept == found or isinstance(kept, str) or np.shape(kept) != np.shape(found):
        return bool(kept == found)
    one, other = np.array(kept, float), np.array(found, float)  # None is not a number
    change = np.abs(one - other)
    change = np.minimum(change, 360.0 - change) if of_angles else change
    return np.array_equal(np.isnan(one), np.isnan(other)) and np.nanmax(change) <= share * np.nanmax(np.abs(one))


def cell(text: str) -> float | str | None:
    return float(text) if re.fullmatch(r"[-+]?\d+(\.\d*)?(e[-+]?\d+)?", text) else text or None


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] * (name in ("simulate", "study")))
        for name in json.loads(GOLDEN.read_text(encoding="utf-8"))
    ],
)
def test_outputs_are_those_that_are_kept(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    for path in (path for source in SOURCES for path in source.glob("*.[jct]*")):
        (tmp_path / path.name).symlink_to(path)
    monkeypatch.chdir(tmp_path)
    printed = Terminal(capsys)(*golden[name]["command"].split())
    found = dict(flat(json.loads(printed))) if printed.startswith("{") else {}
    if (tmp_path / "table.csv").exists():
        with (tmp_path / "table.csv").open(encoding="utf-8", newline="") as file:
            found |= flat([{key: cell(text) for key, text in row.items()} for row in csv.DictReader(file)], "table.")
    if "STRANDSPRING_KEEP" in os.environ:
        golden[name]["figures"] = found
        text = json.dumps(golden, allow_nan=False).replace('], "', '],\n"').replace('}}, "', '}},\n"')
        GOLDEN.write_text(f"{text}\n", encoding="utf-8")
    kept, share = golden[name]["figures"], SHARES.get(name, 1e-9)
    assert found.keys() == kept.keys()
    off = [place for place, value in kept.items() if not is_near(value, found[place], share, "phase" in place)]
    assert {place: (kept[place], found[place]) for place in off} == {}
