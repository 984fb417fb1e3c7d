"""`strandspring simulate`: text, JSON, files and refusals."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from strandspring.examples import systems
from terminal import Terminal

EXAMPLES = Path(systems.__path__[0])
FEW = ("--case", "one round", "--candidate", "five springs")


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    for name in ("gun_cradle.toml", "recoil_spring.json"):
        shutil.copy(EXAMPLES / name, name)
    return Terminal(capsys)


def test_text_says_verdict_pose_modes_and_cautions(terminal: Terminal) -> None:
    text = terminal("simulate", "gun_cradle.toml", *FEW)
    assert text.startswith("Gun cradle: 1 candidate in 1 load case: 1 pass\n")
    assert len(text.splitlines()) <= 12
    for expected in ("five springs:", "one round", "Springs move by up to"):
        assert expected in text, expected
    details = terminal("simulate", "gun_cradle.toml", *FEW, "--verbose")
    for expected in ("recoiling parts rests at", "modes: small motion (tangent)", "draws of omega at rest"):
        assert expected in details, expected
        assert expected not in text
    assert sorted(Path().iterdir()) == [Path("gun_cradle.toml"), Path("recoil_spring.json")]


def test_json_is_one_object_with_everything(terminal: Terminal) -> None:
    command = ("simulate", "gun_cradle.toml", *FEW, "--draws", "16", "-o", "out.csv", "--plot", "sheet.png", "--json")
    told = json.loads(terminal(*command, "--histories", "courses"))
    assert set(told) == {
        "file", "system", "limits", "tested", "candidates", "cases", "output", "report", "plot", "histories"
    }  # fmt: skip
    (case,) = told["cases"]
    assert case["verdict"] == "pass"
    assert case["draws"] == {"count": 16, "refused": 0, "beyond": 0.0}
    assert case["spectra"]["shock"]["damping"] == 0.05
    assert told["histories"] == ["courses/five_springs_one_round.csv"]
    assert Path("out.csv").is_file()
    assert Path("sheet.png").is_file()


def test_a_design_that_fails_is_a_result(terminal: Terminal) -> None:
    text = Path("gun_cradle.toml").read_text(encoding="utf-8").replace('sway = "46 mm"', 'sway = "10 mm"')
    Path("gun_cradle.toml").write_text(text, encoding="utf-8")
    assert "1 fail" in terminal("simulate", "gun_cradle.toml", *FEW)


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("--case", "two shots"), 1, "There is no load case 'two shots'; there are one round, two rounds."),
        (("--step", "0.1"), 1, "`step` is 0.1 s, and the integration is stable up to"),
        (("--step", "0"), 2, "must be a finite number > 0 [s], got 0."),
        (("--report", "out.txt"), 2, "must end in .html, .pdf"),
        (("-o", "gun_cradle.toml"), 2, "--output gun_cradle.toml would overwrite the input gun_cradle.toml"),
        (("-o", "recoil_spring.json"), 2, "--output recoil_spring.json would overwrite the input recoil_spring.json"),
        (("-o", "out.png"), 2, "give a name that ends in .csv"),
    ],
)
def test_refusals(terminal: Terminal, arguments: tuple[str, ...], status: int, said: str) -> None:
    before = {path: path.read_bytes() for path in Path().iterdir()}
    assert terminal("simulate", "gun_cradle.toml", *arguments, status=status) == ""
    assert said in terminal.err
    assert {path: path.read_bytes() for path in Path().iterdir()} == before


def test_a_missing_file_is_refused(terminal: Terminal) -> None:
    assert terminal("simulate", "none.toml", status=1) == ""
    assert "none.toml: no such file" in terminal.err
