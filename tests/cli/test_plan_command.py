"""`strandspring plan`: text, JSON, files and refusals; what it chooses is tested with `plan` itself."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from strandspring import Spring
from synthetic import record_of, sine, spring_of
from terminal import Terminal

TRUE = spring_of(1.0, 1.2)
RIG = ("--velocity", "300", "--duration", "40")


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    record_of(TRUE, sine(), 0.005, 1).save("first.csv")
    Spring(TRUE).save("spring.json")
    return Terminal(capsys)


def test_text_fits_a_terminal_and_the_programme_is_written(terminal: Terminal) -> None:
    text = terminal("plan", "spring.json", *RIG, "-o", "program", "--plot", "plan.png")
    assert len(text.splitlines()) <= 25
    assert max(map(len, text.splitlines())) <= 80
    assert "Programme: program.csv" in text
    assert Path("plan.png").stat().st_size > 0
    time, displacement = np.loadtxt("program.csv", delimiter=",", skiprows=1).T
    assert time[-1] <= 40.0
    assert displacement.max() == pytest.approx(1e3 * TRUE.displacement_max, abs=1e-6)


def test_json_says_the_same(terminal: Terminal) -> None:
    text = terminal("plan", "spring.json", *RIG)
    told = json.loads(terminal("plan", "spring.json", *RIG, "--json"))
    assert told["program"] is None
    assert f"{told['duration']:.4g} s" in text
    for block in told["blocks"]:
        assert block["decides"] in text
    assert {figure["quantity"] for figure in told["figures"]} == {"energy", "stiffness", "parameter"}


def test_a_record_is_identified_on_the_way(terminal: Terminal) -> None:
    text = terminal("plan", "first.csv", "--displacement", "1", "--force", "2", *RIG)
    assert text.startswith("Test for first.csv")
    assert "units assumed" not in terminal("plan", "spring.json", *RIG) + terminal.err


def test_a_rough_stiffness_needs_a_stroke(terminal: Terminal) -> None:
    assert "Test for a stiffness of 20 N/mm over 40 mm" in terminal(
        "plan", "--stiffness", "20", "--stroke", "-20:20", *RIG
    )
    terminal("plan", "--stiffness", "20", *RIG, status=2)
    assert "needs the --stroke" in terminal.err


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        ((), 2, "Give either a model or records"),
        (("spring.json", "--stiffness", "3"), 2, "Give either a model or records"),
        (("spring.json", "--force", "2"), 2, "--force can only be given with records"),
        (("spring.json", "--stroke", "5"), 2, "must be LOW:HIGH"),
        (("spring.json", "--stroke", "5:"), 2, "must be LOW:HIGH"),
        (("spring.json", "--velocity", "0"), 2, "--velocity"),
        (("spring.json", "-o", "spring.json"), 2, "would overwrite the input"),
        (("spring.json", "--duration", "0.01"), 1, "give a longer --duration"),
        (("spring.json", "--force-limit", "1e-6"), 1, "give a larger --force-limit"),
        (("missing.json",), 1, "missing.json"),
        (("missing.csv",), 1, "missing.csv"),
    ],
)
def test_refusals(terminal: Terminal, arguments: tuple[str, ...], status: int, words: str) -> None:
    terminal("plan", *arguments, status=status)
    assert words in terminal.err
