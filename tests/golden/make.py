"""Whole outputs of public commands, kept in golden.json:

    PYTHONPATH=fmu_src python tests/golden/make.py [--only NAME ...]

computes them, or some, anew (README.md).
"""

from __future__ import annotations

import csv
import io
import json
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from strandspring.cli.main import main as strandspring

HERE = Path(__file__).parent
GOLDEN = HERE / "golden.json"
# Models lie here, records and examples where they are installed from.
SOURCES = (HERE, *(HERE.parents[1] / folder for folder in ("models/records", "fmu_src/strandspring/examples/systems")))
KEPT = 24  # of a longer list, from its beginning to its end
SHARE = 1e-9  # tolerance of a figure that is new


def output(command: str, folder: Path) -> dict[str, Any]:
    """Figures and words, by place, of what a command prints and writes to table.csv in an empty folder."""
    out, here = io.StringIO(), Path.cwd()
    for source in SOURCES:
        for path in source.glob("*.[jct]*"):
            (folder / path.name).symlink_to(path)
    os.chdir(folder)
    try:
        with redirect_stdout(out), redirect_stderr(io.StringIO()):
            strandspring(command.split())
    except SystemExit as leaving:
        if leaving.code:
            raise RuntimeError(f"{command}: exit status {leaving.code}: {out.getvalue()}") from None
    finally:
        os.chdir(here)
    found = dict(flat(json.loads(out.getvalue()))) if "--json" in command else {}
    if (folder / "table.csv").exists():
        with (folder / "table.csv").open(encoding="utf-8", newline="") as file:
            found |= flat([{key: number(text) for key, text in row.items()} for row in csv.DictReader(file)], "table.")
    return found


def number(text: str) -> float | str:
    """A number where a text is one."""
    try:
        return float(text)
    except ValueError:
        return text


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
    if not any(
        isinstance(value, str) and " " in value for value in (content if isinstance(content, list) else [content])
    ):
        yield place.rstrip("."), content


def main() -> None:
    """Compute, and write one line for each figure."""
    golden = json.loads(GOLDEN.read_text(encoding="utf-8"))
    for name in sys.argv[2:] if sys.argv[1:2] == ["--only"] else golden:
        before = golden[name]["figures"]
        with tempfile.TemporaryDirectory(prefix="golden-") as folder:
            found = output(golden[name]["command"], Path(folder))
        golden[name]["figures"] = {key: [value, before.get(key, [0, SHARE])[1]] for key, value in found.items()}
    text = json.dumps(golden, allow_nan=False).replace('], "', '],\n"').replace('}}, "', '}},\n"')
    GOLDEN.write_text(f"{text}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
