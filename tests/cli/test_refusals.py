"""What commands refuse: exit status, one sentence on standard error and as JSON, and nothing written."""

from __future__ import annotations

import json
import shlex
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from terminal import Terminal

HERE = Path(__file__).parent
WITHOUT_JSON = ("synthesize", "docs", "nonsense", "identfy")


def rows() -> list[Any]:
    """Command, exit status and sentence of each row of refusals.txt."""
    groups = (HERE / "refusals.txt").read_text(encoding="utf-8").split("\n[")
    found = []
    for begin, _, text in (group.partition("]\n") for group in groups):
        for rest, said in (line.split("=> ", 1) for line in text.splitlines() if "=> " in line):
            command, (status, _, sentence) = f"{begin} {rest}".strip(), said.partition(" ")
            found.append(pytest.param(command, int(status), sentence, id=command))
    return found


@pytest.fixture(scope="module")
def folder(inputs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = Path(shutil.copytree(inputs, tmp_path_factory.mktemp("refusals"), dirs_exist_ok=True))
    for name, text in json.loads((HERE / "bad.json").read_text(encoding="utf-8")).items():
        (folder / name).write_text(text, encoding="utf-8")
    table = np.loadtxt(folder / "new.csv", delimiter=",", skiprows=1)
    np.savetxt(folder / "bare.csv", table * [1.0, 0.01], delimiter=",")
    shutil.copy(HERE.parent / "data/hinge/plastic_compress.csv", folder / "snap.csv")
    bad = json.loads((folder / "mount.json").read_text(encoding="utf-8"))
    bad["parameters"]["rho"] = "x"
    (folder / "bad.json").write_text(json.dumps(bad), encoding="utf-8")
    for copy, of in (("page.html", "new.csv"), ("mount.ssv", "mount.json"), ("r.csv.part.sqlite", "mount.json")):
        shutil.copy(folder / of, folder / copy)
    for link, of in (("link.csv", "new.csv"), ("link.png", "new.json")):
        (folder / link).symlink_to(of)
    return folder


def contents() -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in Path().rglob("*") if path.is_file()}


@pytest.mark.parametrize(("command", "status", "sentence"), rows())
def test_refusals(
    command: str, status: int, sentence: str, folder: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(folder)
    before, terminal, arguments = contents(), Terminal(capsys), shlex.split(command)
    assert terminal(*arguments, status=status) == ""
    said, last = terminal.err, terminal.err.strip().splitlines()[-1]
    assert sentence in last
    assert last.startswith("Error: " if status == 2 else "strandspring: ")
    if arguments[:1] and arguments[0] not in WITHOUT_JSON:
        error = json.loads(terminal(*arguments, "--json", status=status))["error"]
        assert terminal.err == said
        assert last.partition(": ")[2] == error["message"]
        assert (error["type"] == "UsageError") == (status == 2)
    assert contents() == before
