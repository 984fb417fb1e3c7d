"""`strandspring isolate`: text, JSON, CSV, plots and refusals."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from springs import MOUNT
from strandspring import Spring
from strandspring.examples.rigid_platform import STIFF as STIFF_CORNER
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass
from terminal import Terminal

FEW = ("--points", "12")


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    Spring(MOUNT, "mount", "a mount").save("mount.json")
    return Terminal(capsys)


def test_a_mass_is_all_that_must_be_said(terminal: Terminal) -> None:
    text = terminal("isolate", "mount.json", "--mass", "5.1", *FEW)
    for expected in ("5.1 kg on 1 spring, static load 50.01 N", "static sag 2.516 mm", "26 N/mm, 11.36 Hz",
                     "resonance Hz", "0.15 mm", "0.3 mm", "0.6 mm"):  # fmt: skip
        assert expected in text, expected
    assert list(Path().iterdir()) == [Path("mount.json")]


def test_json_csv_and_python_say_the_same(terminal: Terminal) -> None:
    command = ["isolate", "mount.json", "--mass", "12", "--parallel", "2", "--damping", "40", "--load", "100", *FEW]
    command += [
        "--base-acceleration",
        "1",
        "--base-acceleration",
        "3",
        "--band",
        "4",
        "30",
        "--plot",
        "out.svg",
        "--zero",
        "rig",
    ]
    told = json.loads(terminal(*command, "-o", "out.csv", "--json"))
    assert set(told) == {
        "model",
        "zero",
        "system",
        "static_equilibrium",
        "excitation",
        "levels",
        "cautions",
        "output",
        "plot",
    }
    assert told["system"] == {"mass": 12.0, "load": 100.0, "parallel": 2, "series": 1, "damping": 40.0}
    assert told["excitation"] == "base acceleration"
    system = IsolatedMass(MOUNT, 12.0, 100.0, 2, 1, 40.0)
    with Path("out.csv").open(encoding="utf-8", newline="") as file:
        table = list(csv.DictReader(file))  # pandas rounds in its own way
    for level, of_level in zip((1.0, 3.0), told["levels"], strict=True):
        expected = frequency_response(
            system, Excitation.BASE_ACCELERATION, level, np.geomspace(4.0, 30.0, 12), resolve=True
        )
        assert (of_level["level"], of_level["unit"]) == (level, "m/s^2")
        assert of_level["resonance"]["frequency"] == expected.resonance.frequency
        given = [point["transmissibility"] for point in of_level["points"]]
        assert given == [point.transmissibility for point in expected.points]
        rows = [row for row in table if float(row["level [m/s^2]"]) == level]
        assert [float(row["transmissibility [1]"]) for row in rows] == given
        assert [float(row["frequency [Hz]"]) for row in rows] == [point.frequency for point in expected.points]
    first = Path("out.svg").read_bytes()
    terminal(*command)
    assert Path("out.svg").read_bytes() == first


def test_several_models_are_compared_at_the_same_levels(terminal: Terminal) -> None:
    Spring(STIFF_CORNER, "stiff").save("stiff.json")
    both = ["isolate", "mount.json", "stiff.json", "--mass", "8", *FEW]
    text = terminal(*both, "--plot", "both.png", "-o", "both.csv", "--verbose")
    assert "mount (mount.json): 8 kg on 1 spring" in text
    assert "on stiff, the smallest of these models." in text
    rows = [line.split()[0] for line in text.splitlines() if re.match(r"  (mount|stiff) ", line)]
    assert rows == ["mount"] * 3 + ["stiff"] * 3
    assert Path("both.png").stat().st_size > 10_000
    assert pd.read_csv("both.csv")["model"].unique().tolist() == ["mount", "stiff"]
    told = json.loads(terminal(*both, "--json"))
    assert set(told) == {"levels_chosen", "models", "cautions", "output", "plot"}
    mount, stiff = told["models"]
    assert [level["level"] for level in mount["levels"]] == [level["level"] for level in stiff["levels"]]
    alone = json.loads(terminal("isolate", "stiff.json", "--mass", "8", *FEW, "--json"))
    assert {**stiff, "cautions": [], "output": None, "plot": None} == alone


def test_outputs_are_checked_before_models_are_read(terminal: Terminal) -> None:
    for option in ("-o", "--plot"):
        terminal("isolate", "missing.json", "--mass", "5", option, "mount.json/x.png", status=1)
        assert "mount.json/x.png cannot be written: " in terminal.err
        assert "mount.json is not a folder." in terminal.err
        Path("folder.png").mkdir(exist_ok=True)
        terminal("isolate", "missing.json", "--mass", "5", option, "folder.png", status=1)
        assert "folder.png cannot be written: it is a folder or a device" in terminal.err
    terminal("isolate", "missing.json", "--mass", "5", "--zero", "left", status=2)
    assert "--zero must be `rig`, `middle` or a displacement of the record in mm, got 'left'." in terminal.err


@pytest.mark.parametrize("ending", ["png", "pdf"])
def test_plots_have_the_kind_of_their_name(terminal: Terminal, ending: str) -> None:
    terminal("isolate", "mount.json", "--mass", "5", *FEW, "--plot", f"out.{ending}")
    assert Path(f"out.{ending}").read_bytes()[:4] == {"png": b"\x89PNG", "pdf": b"%PDF"}[ending]


@pytest.mark.slow
@pytest.mark.parametrize("mass", ["0.012", "0.025"])
def test_spikes_of_superharmonics_do_not_stop_the_curve(terminal: Terminal, mass: str) -> None:
    """Small loops of the hinge (n = 3) have next to no damping: its superharmonic resonances are needles."""
    model = Path(__file__).resolve().parents[2] / "models/rubber_hinge.json"
    told = json.loads(terminal("isolate", str(model), "--mass", mass, "--json"))
    for level in told["levels"]:
        assert sum(point["requested"] for point in level["points"]) >= 190
        assert level["resonance"]["frequency"] == pytest.approx(14.0, rel=0.2)


def test_folds_are_reported(terminal: Terminal) -> None:
    text = terminal("isolate", "mount.json", "--mass", "5.1", "--damping", "20", "--base-displacement", "2",
                    "--band", "5", "25", "--extrapolate", "--points", "60")  # fmt: skip
    assert "The curve folds" in text


def test_motion_beyond_the_identified_range_is_reported(terminal: Terminal) -> None:
    command = ["isolate", "mount.json", "--mass", "5.1", "--damping", "20", "--base-displacement", "0.1",
               "--base-displacement", "5", "--band", "5", "25", *FEW, "--extrapolate", "--zero", "rig"]  # fmt: skip
    within, beyond = json.loads(terminal(*command, "-o", "out.csv", "--json"))["levels"]
    assert (within["extrapolating"], beyond["extrapolating"]) == (False, True)
    assert not any(point["extrapolating"] for point in within["points"])
    outside = [point["min"] < 0.02 or point["max"] > 0.08 for point in beyond["points"]]
    assert [point["extrapolating"] for point in beyond["points"]] == outside
    table = pd.read_csv("out.csv")
    assert table[table["level [m]"] == 0.005]["outside the identified range"].tolist() == outside
    frequencies = [point["frequency"] for point in beyond["points"] if point["extrapolating"]]
    (told,) = (line for line in terminal(*command, "--verbose").splitlines() if "Caution" in line)
    assert told == (
        f"  Caution: 5 mm: from {min(frequencies):.4g} to {max(frequencies):.4g} Hz the spring moves outside the "
        "identified range 20 to 80 mm, where the model is continued linearly."
    )


def test_the_masses_that_can_rest_are_reported(terminal: Terminal) -> None:
    terminal("isolate", "mount.json", "--mass", "1000", "--parallel", "2", *FEW, status=1)
    told = re.search(r"where (\S+) to (\S+) kg can rest; use another mass", terminal.err)
    assert told is not None
    least, greatest = map(float, told.groups())
    few = ("--parallel", "2", "--base-displacement", "0.001", "--points", "2")
    assert least == 0.0  # the force at the lower end is negative
    terminal("isolate", "mount.json", "--mass", f"{0.99 * greatest}", *few)
    terminal("isolate", "mount.json", "--mass", f"{1.01 * greatest}", *few, status=1)
    terminal("isolate", "mount.json", "--mass", "5", "--load", "9000", *FEW, status=1)
    assert "can rest" not in terminal.err


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--mass", "1000"), "The static load of 9806.65 N on each spring must lie within the forces"),
        (("--mass", "1000"), "kg can rest; use another mass"),
        (("--mass", "5", "--base-displacement", "5", "--zero", "rig"), "outside the identified range of 20 to 80 mm"),
        (("--mass", "5", "--base-displacement", "5"), "Hz and a level of 5 mm the spring moves from"),
        (("--mass", "0"), "'--mass': must be a finite number > 0 [kg], got 0."),
        (("--mass", "-2"), "'--mass': must be a finite number > 0 [kg], got -2."),
        (("--mass", "nan"), "'--mass': must be a finite number > 0 [kg], got nan."),
        (("--mass", "heavy"), "'--mass': must be a finite number > 0 [kg], got heavy."),
        (("--mass", "5", "--force", "0"), "'--force': must be a finite number > 0 [N], got 0."),
        (("--mass", "5", "--base-displacement", "-1"),
         "'--base-displacement': must be a finite number > 0 [mm], got -1."),
        (("--mass", "5", "--base-acceleration", "-0.5"),
         "'--base-acceleration': must be a finite number > 0 [m/s^2], got -0.5."),
        (("--mass", "5", "--band", "0", "10"), "'--band': The band must rise from above 0 [Hz], got 0 to 10."),
        (("--mass", "5", "--band", "10", "5"), "'--band': The band must rise from above 0 [Hz], got 10 to 5."),
        (("--mass", "5", "--parallel", "0"), "'--parallel': 0 is not in the range 1<=x<=1000000."),
        (("--mass", "5", "--damping", "-1"), "'--damping': must be a finite number >= 0 [N s/m], got -1."),
        (("--mass", "5", "--load", "inf"), "'--load': must be a finite number [N], got inf."),
    ],
)  # fmt: skip
def test_impossible_systems_get_one_sentence(terminal: Terminal, arguments: tuple[str, ...], told: str) -> None:
    is_usage = told.startswith("'--")
    status = 2 if is_usage else 1
    terminal("isolate", "mount.json", *arguments, *FEW, "-o", "out.csv", "--plot", "out.png", status=status)
    *usage, sentence = terminal.err.strip().splitlines()
    assert told in sentence
    assert len(usage) == (3 if is_usage else 0)
    assert terminal.out == ""
    assert list(Path().iterdir()) == [Path("mount.json")]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((), "Missing option '--mass'"),
        (("--mass", "5", "--force", "1", "--base-displacement", "1"), "exclude each other"),
        (("--mass", "5", "--plot", "out.txt"), "'--plot': must end in .png, .svg, .pdf"),
    ],
)
def test_wrong_usage(terminal: Terminal, arguments: tuple[str, ...], told: str) -> None:
    terminal("isolate", "mount.json", *arguments, status=2)
    assert told in terminal.err


@pytest.mark.slow
def test_the_fmu_moves_as_the_balance_says(terminal: Terminal) -> None:
    command = ["isolate", "mount.json", "--mass", "16", "--parallel", "3", "--series", "2", *FEW]
    told = json.loads(terminal(*command, "--base-acceleration", "1.5", "--verify", "--json"))
    (level,) = told["levels"]
    assert len(level["verification"]) == 3
    for check in level["verification"]:
        assert check["agrees"]
        # Far within the marks: what is left is the master's, (2 pi/256)^2/12 = 5e-5, and some more at resonance.
        assert abs(check["difference"]) < 1e-3
        assert abs(check["phase"]) < 0.3
    assert "agrees" in terminal(*command, "--force", "3", "--verify")
