"""Every command, in words (t), with all details (v) and as JSON (j): what it prints and writes, beside what was kept.

That the figures are right is for the oracles of other files to show. For another command, its line with null is added
to outputs.json before it is kept; see kept.py.
"""

from __future__ import annotations

import csv
import html
import json
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest

from kept import changes, thinned, words
from terminal import Terminal

pytestmark = pytest.mark.long  # it builds FMUs and runs them

KEPT = Path(__file__).with_name("outputs.json")
MODES = {"j": ["--json"], "t": [], "v": ["--verbose"]}
SLOW = ("transport", "two_stage", "gunfire", "rotation", "--direction z")
# Of what is fitted on another processor; the rest is computed to 1e-9 or better.
FITTED, COMPUTED = 2e-3, 1e-5


def commands() -> list[Any]:
    """Those that were kept; behind each stands how it is run."""
    names = json.loads(KEPT.read_text(encoding="utf-8"))
    return [pytest.param(name, marks=[pytest.mark.slow] * any(map(name.__contains__, SLOW)), id=name) for name in names]


@pytest.fixture(scope="module")
def folder(inputs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(shutil.copytree(inputs, tmp_path_factory.mktemp("outputs"), dirs_exist_ok=True))


@pytest.mark.parametrize("name", commands())
def test_outputs(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    command, _, mode = name.rpartition(" ")
    monkeypatch.chdir(folder)
    before = _files()
    terminal = Terminal(capsys)
    out = terminal(*shlex.split(command), *MODES[mode])
    too_long = [line for line in terminal.printed.splitlines() if len(line) > 80]
    assert mode != "t" or not too_long
    written = [path for path, state in _files().items() if before.get(path) != state]
    outputs = {
        "out": thinned(json.loads(out)) if mode == "j" else words(out),
        "err": words(terminal.err),
        "files": {path: _content(Path(path)) for path in sorted(written)},
    }
    is_fitted = command.startswith("identify") or ".csv" in command.partition(" -o")[0]
    assert changes(KEPT, {name: outputs}, FITTED if is_fitted else COMPUTED) == []


def _files() -> dict[str, tuple[int, int]]:
    found = ((str(path), path.stat()) for path in Path().rglob("*") if path.is_file())
    return {path: (state.st_size, state.st_mtime_ns) for path, state in found}


def _content(path: Path) -> Any:
    """What is kept of a file: of tables some rows, of pages what is read."""
    if path.suffix == ".json":
        return thinned(json.loads(path.read_text(encoding="utf-8")))
    if path.suffix == ".csv":
        with path.open(encoding="utf-8", newline="") as file:
            return thinned([" ; ".join(row) for row in csv.reader(file)])
    if path.suffix == ".html":
        page = re.sub(r"(?s)<(style|script).*?</\1>", "", path.read_text(encoding="utf-8"))
        return words(html.unescape(re.sub(r"<[^>]*>", " ", page)))
    return path.suffix
