"""What commands print: little, in 80 columns, and with --verbose the rest."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from strandspring import Spring
from synthetic import sine, spring_of
from terminal import Terminal


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    """In a folder with a model, its record, and the same at the end of a force sensor's range."""
    monkeypatch.chdir(tmp_path)
    spring = Spring(spring_of(1.0, 1.0), "mount")
    spring.save("mount.json")
    x = np.concatenate([sine(3, 300), 0.05 + 0.5 * (sine(3, 300) - 0.05)])
    force = spring.response(x) + 0.05 * np.random.default_rng(0).standard_normal(x.size)
    ends = np.quantile(force, [0.1, 0.9])
    for name, values in (("whole.csv", force), ("clipped.csv", force.clip(*ends))):
        rows = (f"{1e3 * a:.4f},{b:.5f}" for a, b in zip(x, values, strict=True))
        Path(name).write_text("displacement [mm],force [N]\n" + "\n".join(rows) + "\n")
    return Terminal(capsys)


def test_a_run_prints_a_line_a_record_the_parameters_and_what_was_written(terminal: Terminal) -> None:
    verdict, first, *parameters, last = terminal("identify", "whole.csv", "-o", "k").splitlines()
    assert verdict.startswith("usable: ")
    assert first.startswith("whole.csv: rmse 0.0")
    assert [line.split()[0] for line in parameters] == ["kappa_omega", "rho", "sigma", "n", "FE"]
    assert last == "Model file: k.json"
    assert Path("k.json").is_file()
    details = terminal("identify", "whole.csv", "-o", "k", "--verbose")
    assert "95 % prediction interval" in details
    assert "whole.csv: force is column 2 'force [N]', chosen by its name or unit" in terminal.err


@pytest.mark.parametrize(
    "command",
    [
        "identify whole.csv clipped.csv -o k.json",
        "identify clipped.csv -o k.json",
        "predict mount.json whole.csv clipped.csv",
        "info mount.json whole.csv",
        "isolate mount.json --mass 5 --points 8",
        "compare mount.json mount.json",
        "study mount.json --mass 4:6:2 --draws 0 --points 8 -o runs.csv",
        "build mount.json",
        "show clipped.csv -o page",
    ],
)
def test_all_fits_80_columns(command: str, terminal: Terminal) -> None:
    terminal(*command.split())
    assert [line for line in terminal.printed.splitlines() if len(line) > 80] == []


def test_what_is_clipped_is_in_no_figure(terminal: Terminal) -> None:
    whole, clipped = (
        json.loads(terminal("identify", name, "-o", "k", "--json"))["records"][0]
        for name in ("whole.csv", "clipped.csv")
    )
    assert clipped["rmse"] == pytest.approx(whole["rmse"], rel=0.1)  # of a thousand samples
    assert clipped["samples"] < whole["samples"]
    assert clipped["compared"].endswith("clipped samples left out")
    assert clipped["predicted_energy"] == pytest.approx(clipped["energy"], rel=0.02)
    told = json.loads(terminal("predict", "mount.json", "clipped.csv", "--json"))
    assert told["rmse"] == pytest.approx(whole["rmse"], rel=0.1)
    assert "are at the end of the force sensor's range" in told["cautions"][0]
    terminal("show", "clipped.csv", "-o", "page.html")
    assert "clipped forces, left out" in terminal.err


@pytest.mark.parametrize("name", ["LVDT", "crosshead", "Ram position"])
def test_names_of_displacement(name: str, terminal: Terminal) -> None:
    text = Path("whole.csv").read_text().replace("displacement [mm]", name)
    Path("named.csv").write_text(text)
    terminal("predict", "mount.json", "named.csv")
    assert "units assumed: displacement mm" in terminal.err


def test_what_is_no_record_no_system_and_no_fmu_is_named(terminal: Terminal) -> None:
    for command, expected in (
        ("identify mount.json -o k", "mount.json: is not a record but JSON"),
        ("simulate mount.json", "mount.json: is not a description of a system"),
        ("verify whole.csv", "It is not an FMU, which is a zip archive"),
    ):
        terminal(*command.split(), status=1)
        assert expected in terminal.err
    Path("marked.csv").write_text(
        "x [mm];F [N]\n" + "".join(f"{k},5;{9 * k},25\n" for k in range(40)) + "0,5;1.013,25\n" * 9
    )
    terminal("identify", "marked.csv", "-o", "k", status=1)
    assert "without marks between thousands" in terminal.err
