"""Every command, in words (t), with all details (v) and as JSON (j): what it prints and writes, beside what was kept.

After a change that is meant to move them: STRANDSPRING_KEEP=1 python -m pytest -n 0 tests/cli/test_outputs.py
For another command, its line with null is added to outputs.json before.
"""

from __future__ import annotations

import csv
import html
import json
import math
import os
import re
import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from strandspring import __version__
from terminal import Terminal

pytestmark = pytest.mark.long  # it builds FMUs and runs them

HERE = Path(__file__).parent
KEPT = HERE / "outputs.json"
MODES = {"j": ["--json"], "t": [], "v": ["--verbose"]}
NUMBER = re.compile(r"([-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)")
ITEMS = 5  # of a long list or table that are kept
# What differs from machine to machine or release to release.
ELSEWHERE = {"sha256", "size", "seconds", "elapsed", "binaries"}
OF_MACHINE = re.compile(
    r"(?<=\.fmu )\([^)]*\)|(?<=Binaries: ).*(?= Check:)|\d+(?:\.\d+)?(?:e-\d+)? (?:ms\b|KiB)|\(\d[\d.]* s\b[^)]*\)"
    r"|within \S+ N|All \d+ files|\b(?:linux|win|darwin)64\b"
)
# Of what is fitted on another processor; the rest is computed to 1e-9 or better.
FITTED, COMPUTED = 2e-3, 1e-5


def kept() -> dict[str, Any]:
    """What was kept, by the command and, behind it, how it is run."""
    outputs: dict[str, Any] = json.loads(KEPT.read_text(encoding="utf-8"))
    return outputs


@pytest.fixture(scope="module")
def folder(inputs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(shutil.copytree(inputs, tmp_path_factory.mktemp("outputs"), dirs_exist_ok=True))


@pytest.mark.parametrize("name", kept(), ids=str)
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
        "out": _thinned(json.loads(out)) if mode == "j" else _words(out),
        "err": _words(terminal.err),
        "files": {path: _content(Path(path)) for path in sorted(written)},
    }
    outputs = json.loads(json.dumps(outputs).replace(__version__, "VERSION"))
    if "STRANDSPRING_KEEP" in os.environ:
        every = {**kept(), name: outputs}
        lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in every.items())
        KEPT.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    is_fitted = command.startswith("identify") or ".csv" in command.partition(" -o")[0]
    assert list(_differences(kept()[name], outputs, FITTED if is_fitted else COMPUTED)) == []


def _files() -> dict[str, tuple[int, int]]:
    found = ((str(path), path.stat()) for path in Path().rglob("*") if path.is_file())
    return {path: (state.st_size, state.st_mtime_ns) for path, state in found}


def _content(path: Path) -> Any:
    """What is kept of a file: of tables some rows, of pages what is read."""
    if path.suffix == ".json":
        return _thinned(json.loads(path.read_text(encoding="utf-8")))
    if path.suffix == ".csv":
        with path.open(encoding="utf-8", newline="") as file:
            return _thinned([" ; ".join(row) for row in csv.reader(file)])
    if path.suffix == ".html":
        page = re.sub(r"(?s)<(style|script).*?</\1>", "", path.read_text(encoding="utf-8"))
        curves = re.findall(r'<path class="(?:line|dots) [^>]*? d="([^"]*)"', page)
        return [_words(html.unescape(re.sub(r"<[^>]*>", " ", page))), [_middle(curve) for curve in curves]]
    return path.suffix


def _middle(curve: str) -> list[float]:
    """The mean of the points of a curve of SVG, in a drawing of some thousand units."""
    points = [np.cumsum(np.reshape(re.findall(r"-?\d+", line.replace("h0", "")), (-1, 2)).astype(float), axis=0)
              for line in re.split("^m|M", curve)[1:]]  # fmt: skip
    return np.round(np.mean(np.concatenate(points), axis=0), 1).tolist()


def _words(text: str) -> str:
    return OF_MACHINE.sub("...", " ".join(text.split()))


def _thinned(content: Any) -> Any:
    """Without what differs elsewhere; of long lists the length and some items, the first and the last among them."""
    if isinstance(content, dict):
        return {key: _thinned(value) for key, value in content.items() if key not in ELSEWHERE}
    if not isinstance(content, list):
        return _words(content) if isinstance(content, str) else content
    items = content
    if len(content) > ITEMS:
        items = [len(content), *(content[k * (len(content) - 1) // (ITEMS - 1)] for k in range(ITEMS))]
    return [_thinned(item) for item in items]


def _differences(kept: Any, found: Any, rtol: float, place: str = "") -> Any:
    """Places at which kept and found differ, with both."""
    if isinstance(kept, dict) and isinstance(found, dict) and list(kept) == list(found):
        for key in kept:
            yield from _differences(kept[key], found[key], rtol, f"{place}.{key}")
    elif isinstance(kept, list) and isinstance(found, list) and len(kept) == len(found):
        for k, (one, other) in enumerate(zip(kept, found, strict=True)):
            yield from _differences(one, other, rtol, f"{place}[{k}]")
    elif isinstance(kept, str) and isinstance(found, str):
        parts, others = NUMBER.split(kept), NUMBER.split(found)
        numbers = zip(parts[1::2], others[1::2], strict=False)
        if parts[::2] != others[::2] or not all(_is_near(one, other, rtol) for one, other in numbers):
            yield place, kept, found
    elif isinstance(kept, float) and isinstance(found, float):
        if not math.isclose(kept, found, rel_tol=rtol, abs_tol=1e-9):
            yield place, kept, found
    elif kept != found or type(kept) is not type(found):
        yield place, kept, found


def _is_near(kept: str, found: str, rtol: float) -> bool:
    """Whether printed numbers differ by one unit of the last digit at most, or by the tolerance."""
    one, other = (float(text.replace("−", "-")) for text in (kept, found))
    digits, _, exponent = kept.partition("e")
    unit = 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
    return abs(one - other) <= max(1.001 * unit if "." in kept else 0.0, rtol * abs(one), 1e-12)
