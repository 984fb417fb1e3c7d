"""`strandspring compare`: text, JSON, plot and refusals; verdicts are tested with `compare` itself."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from strandspring import Spring, identify
from synthetic import record_of, sine, spring_of
from terminal import Terminal

TRUE = spring_of(1.0, 1.0)


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    for name, kappa, seed in (("new", 25.0, 1), ("worn", 22.5, 2)):
        record = record_of(replace(TRUE, kappa_omega=kappa), sine(), 0.02, seed)
        record.save(f"{name}.csv")
        identify(record).spring(name).save(f"{name}.json")
    return Terminal(capsys)


def test_text_and_json_say_the_same(terminal: Terminal) -> None:
    text = terminal("compare", "new.json", "worn.json", "new.csv", "--draws", "20", "--verbose")
    told = json.loads(terminal("compare", "new.json", "worn.json", "new.csv", "--draws", "20", "--json"))
    assert told["verdict"] == "different"
    assert told["sentence"] in text
    assert "A: new (new.json)" in text
    assert "20 springs drawn of each, seed 0" in text
    assert told["records"][0]["better"] == "A"
    assert {one["quantity"] for one in told["parameters"]} == {"kappa_omega", "rho", "sigma", "n"}
    assert len(told["figures"]) == 16
    assert told["transmissibility"]["a"]["frequency"] > 0.0
    assert told["plot"] is None
    assert "Caution: Of the identification of A" in terminal.err


def test_the_plot_is_written(terminal: Terminal) -> None:
    assert "Plot: out.svg" in terminal("compare", "new.json", "worn.json", "--draws", "20", "--plot", "out.svg")
    assert "<svg" in Path("out.svg").read_text(encoding="utf-8")


def test_refusals(terminal: Terminal) -> None:
    Spring(replace(TRUE, displacement_offset=0.45, displacement_min=0.4, displacement_max=0.5)).save("far.json")
    terminal("compare", "new.json", "far.json", status=1)
    assert "share less than half of the narrower range" in terminal.err
    terminal("compare", "new.json", "missing.json", status=1)
    assert "missing.json" in terminal.err
    Path("link.png").symlink_to("new.json")
    for arguments, expected in (
        (["--plot", "x.txt"], "'--plot': must end in"),
        (["--plot", "link.png"], "would overwrite the input"),
        (["--draws", "3"], "at least 20"),
        (["--amplitude", "25"], "at most 20 mm"),
        (["--align", "left"], "left"),
    ):
        assert terminal("compare", "new.json", "worn.json", *arguments, status=2) == ""
        assert expected in terminal.err


def test_old_model_files_get_no_verdict(terminal: Terminal) -> None:
    Spring(TRUE, "old").save("old.json")
    assert "cannot be said: B holds no uncertainty" in terminal("compare", "new.json", "old.json", "--verbose")


def test_help_has_examples(terminal: Terminal) -> None:
    assert "strandspring compare new.json worn.json" in terminal("compare", "--help")
