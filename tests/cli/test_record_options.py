"""Options that say how records are read and what of them is used, as all commands share them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from strandspring import Spring
from synthetic import spring_of
from terminal import Terminal


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    Spring(spring_of(1.0, 1.0), "mount").save("mount.json")
    run = Terminal(capsys)
    run(
        "synthesize",
        "spring",
        "mount.json",
        "--amplitude",
        "20",
        "--frequency",
        "0.5",
        "--noise",
        "0.01",
        "-o",
        "a.csv",
    )
    return run


def test_every_command_that_reads_records_selects(terminal: Terminal) -> None:
    for command in (
        ("identify", "a.csv", "-o", "model.json", "--json"),
        ("predict", "mount.json", "a.csv", "--json"),
        ("info", "mount.json", "a.csv", "--json"),
    ):
        json.loads(terminal(*command, "--cycles", "1:2"))
        assert "a.csv: cycles 1 to 2 of " in terminal.err
        json.loads(terminal(*command, "--time", "0.5:", "--time", "time", "--verbose"))
        assert "a.csv: time is column " in terminal.err
        assert "a.csv: time from 0.5 s to its end selected" in terminal.err
        terminal(*command, "--cycles", "99", status=1)
        assert "cycle 99 cannot be selected, since the record has" in terminal.err
    record = json.loads(terminal("predict", "mount.json", "a.csv", "--displacement-range", "50:", "--json"))["records"][
        0
    ]
    assert record["compared"].endswith("within the selected displacements")


def test_a_description_file_is_read_as_its_records(terminal: Terminal) -> None:
    Path("campaign.toml").write_text('[[record]]\nfile = "*.csv"\ncycles = "1:2"\n')
    told = json.loads(terminal("predict", "mount.json", "campaign.toml", "--json"))
    assert [record["path"] for record in told["records"]] == ["a.csv"]
    assert "cycles 1 to 2 of" in terminal.err
    terminal("predict", "mount.json", "campaign.toml", "--cycles", "2:")
    assert "cycle 2 of 2 selected" in terminal.err


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (("--cycles", "x"), "must be a cycle or FIRST:LAST, such as 3, 2:5, 2: or :5, got 'x'"),
        (("--cycles", "4:2"), "the first is not above the second"),
        (("--displacement-range", "5"), "must be FROM:TO"),
        (("--displacement-range", "5:1"), "the first is not above the second, got '5:1'"),
        (("--time", "5:1"), "the first is not above the second"),
        (("--force-unit", "furlong"), "unit 'furlong' of the force is not known"),
        (("--time-unit", "mm"), "unit 'mm' of the time is a unit of length"),
        (("--time", "a", "--time", "b"), "must be one column, got a and b"),
        (("--time", "1:2", "--time", "3:4"), "must be one window FROM:TO, got 1:2 and 3:4"),
    ],
)
def test_what_is_no_selection_is_wrong_usage(terminal: Terminal, options: tuple[str, ...], expected: str) -> None:
    terminal("predict", "mount.json", "a.csv", *options, status=2)
    assert expected in " ".join(terminal.err.split())


def test_cycles_of_a_part_are_not_offered_as_those_of_the_record(terminal: Terminal) -> None:
    """The page would print numbers that choose other cycles of the whole record."""
    told = json.loads(terminal("show", "a.csv", "-o", "page.html", "--json"))
    cycles = len(told["records"][0]["cycles"])
    assert f'"cycles":{cycles},' in Path("page.html").read_text(encoding="utf-8")
    terminal("show", "a.csv", "--cycles", "2:", "-o", "page.html")
    page = Path("page.html").read_text(encoding="utf-8")
    assert '"cycles":0,' in page
    assert "Cycles are counted within the part that was selected" in page


@pytest.mark.parametrize("command", ["info mount.json", "compare mount.json mount.json"])
@pytest.mark.parametrize("option", ["--cycles 2", "--time 0:5", "--force-unit kN", "--reverse force"])
def test_what_concerns_records_is_not_ignored_without_one(terminal: Terminal, command: str, option: str) -> None:
    terminal(*command.split(), *option.split(), status=2)
    assert "none is given; give a record" in " ".join(terminal.err.split())
