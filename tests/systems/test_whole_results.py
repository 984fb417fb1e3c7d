"""Whole answers of commands about systems, studies and batches, as they were kept in results.json.

That they are right is for the oracles of the other files to show; these rows keep all of their figures and sentences
from changing unnoticed. After an answer changes on purpose: python tests/systems/test_whole_results.py
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import os
import shlex
import shutil
import tempfile
from pathlib import Path
from typing import Any

import pytest

from kept import different, lines, thinned
from many_springs import measured, write, write_batch
from strandspring.cli.main import main
from strandspring.examples.system_models import SYSTEMS
from strandspring.model.modelfile import ModelFile, save_model
from studies import COMMAND, SPRING, UNCERTAINTY
from tools import slow_but

pytestmark = pytest.mark.long

KEPT, REFUSED = (Path(__file__).with_name(name) for name in ("results.json", "refused_commands.json"))
FEW = "--draws 16 --step 0.0002"
COMMANDS = [
    f"simulate electronics_box.toml --case shock --case drop {FEW} -o out.csv",
    "simulate electronics_box.toml --case transport --candidate standard --draws 16 --step 0.0005 -o out.csv",
    "simulate gun_cradle.toml --draws 16 --candidate 'five springs' -o out.csv",
    f"simulate two_stage_platform.toml {FEW} -o out.csv",
    "simulate avionics_tray.toml --case engine --candidate '20 C' --draws 16 --step 0.0005 -o out.csv",
    "simulate avionics_tray.toml --case gunfire --case flight --candidate '-40 C' --draws 16 --step 0.001",
    "isolate electronics_box.toml --points 4 --band 6 30 --base-displacement 0.2 --direction y -o out.csv",
    "isolate electronics_box.toml --points 4 --band 6 30 --candidate softer --base-rotation 0.01 --direction x",
    "isolate gun_cradle.toml --points 4 --force 500 --at breech -o out.csv",
    "isolate avionics_tray.toml --points 4 --band 8 60 --candidate '20 C' --base-acceleration 0.5 --direction z",
    "study electronics_box.toml --vary body.box.mass=0%,100%,150% --case drop --step 0.0005 --draws 16 -o out.csv",
    " ".join([*COMMAND, "-o", "out.csv"]),
    "study mount.json --mass 4:5:2 --base-acceleration 2 --stiffness 0.9 --parallel 2 --series 2 --damping 10"
    " --band 2 20 --points 8 --draws 2 --extrapolate -o out.csv",
    "identify-many springs --method two-stage --degrees 3,2 -o models",
]

SLOW = ("transport", "two_stage", "gunfire", "rotation", "--direction z")
KEPT_FAST = [one for one in COMMANDS if not any(word in one for word in SLOW)]


def answer(command: str) -> Any:
    """What a command says as JSON, and the table that it writes, of which long lists are thinned."""
    arguments = [*shlex.split(command), *(["--workers", "1"] if command.startswith(("study", "identify")) else [])]
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.suppress(SystemExit):
        main([*arguments, "--json"])
    told = json.loads(said.getvalue())
    for path in (Path("out.csv"), Path("models/springs.csv")):
        if path.exists():
            with path.open(encoding="utf-8", newline="") as file:
                rows = list(csv.DictReader(file))
            told["table"] = {name: [_number(row[name]) for row in rows] for name in rows[0] if name != "sha256"}
    return thinned(told)


def refusal(command: str) -> list[Any]:
    """The status with which a command ends, and what it says on standard error."""
    status, said = 0, io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        try:
            main(shlex.split(command))
        except SystemExit as leaving:
            status = int(leaving.code or 0)
    return [status, " ".join(said.getvalue().replace(f"{Path.cwd()}/", "").split())]


def _number(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return prepared(tmp_path_factory.mktemp("results"))


def prepared(folder: Path) -> Path:
    """What the commands read."""
    shutil.copytree(SYSTEMS, folder, dirs_exist_ok=True)
    save_model(folder / "mount.json", ModelFile("mount", SPRING, uncertainty=UNCERTAINTY))
    write_batch(folder / "springs", 8, 360)
    write(folder / "springs" / "stiff.csv", measured(100, 360, stiffness=2.0))
    (folder / "springs" / "empty.csv").touch()
    save_model(folder / "bare.json", ModelFile("bare", SPRING))
    (folder / "none").mkdir()
    return folder


@pytest.mark.parametrize("command", slow_but(COMMANDS, KEPT_FAST))
def test_an_answer_is_the_kept_one(command: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    for path in (Path("out.csv"), *Path().glob("models/*")):
        path.unlink(missing_ok=True)
    kept = json.loads(KEPT.read_text(encoding="utf-8"))[command]
    # Least squares stop where the misfit is level, and draws of springs that were fitted follow them.
    assert different(answer(command), kept, "", 1e-3 if "identify" in command else 1e-6) == []


def test_refused_commands_say_the_kept_sentence_and_write_nothing(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    kept = json.loads(REFUSED.read_text(encoding="utf-8"))
    before = {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}
    assert different({command: refusal(command) for command in kept}, kept, "", 0.0) == []
    assert {status for status, _ in kept.values()} == {1, 2}
    assert {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()} == before


if __name__ == "__main__":
    answers = {}
    for each in COMMANDS:
        os.chdir(KEPT.parent)
        with tempfile.TemporaryDirectory() as temporary:
            os.chdir(prepared(Path(temporary)))
            answers[each] = answer(each)
    KEPT.write_text(lines(answers), encoding="utf-8")
    os.chdir(KEPT.parent)
    sentences = json.loads(REFUSED.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as temporary:
        os.chdir(prepared(Path(temporary)))
        REFUSED.write_text(lines({command: refusal(command) for command in sentences}), encoding="utf-8")
