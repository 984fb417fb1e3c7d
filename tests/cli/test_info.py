"""`strandspring info`: text, JSON, cautions and refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from springs import TABLE
from strandspring import Spring
from strandspring.kernel.path import PathSolver
from strandspring.loops.loop import steady_loop
from synthetic import AMPLITUDE, MEAN, spring_of
from terminal import Terminal

ROOT = Path(__file__).resolve().parents[2]
HINGE_MODEL = str(ROOT / "models/rubber_hinge.json")
HINGE = [str(ROOT / "models/records/rubber_stretch.csv"), "--reverse", "displacement"]
FIGURES = {"low", "high", "amplitude", "secant_stiffness", "energy_per_cycle", "loss_factor", "damping_ratio",
           "mean_force", "min_force", "max_force"}  # fmt: skip
RIG = ("--zero", "rig")  # counted as in the record


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    Spring(spring_of(1.0, 1.0), "mount", "a mount").save("mount.json")
    return Terminal(capsys)


def synthesized(terminal: Terminal, name: str, amplitude: float, frequency: float) -> str:
    terminal("synthesize", "spring", "mount.json", "--amplitude", f"{amplitude}", "--frequency", f"{frequency}",
             "--noise", "0.01", "-o", name)  # fmt: skip
    return name


def test_a_table_of_fe_is_reported(terminal: Terminal) -> None:
    Spring(TABLE, "table").save("table.json")
    text = terminal("info", "table.json", *RIG)
    assert "  FE a spline through 10 knots, -52.9977 to " in text
    assert "30 to 70 mm, FA about 47 mm" in text
    assert json.loads(terminal("info", "table.json", *RIG, "--json"))["parameters"] == {
        name: list(value) if isinstance(value, tuple) else value for name, value in TABLE.as_dict().items()
    }


def test_without_records_the_quarters_of_the_range(terminal: Terminal) -> None:
    told = json.loads(terminal("info", "mount.json", *RIG, "--json"))
    assert set(told) == {
        "model",
        "name",
        "parameters",
        "zero",
        "saved",
        "fit",
        "loops",
        "rate_independence",
        "overlap",
        "cautions",
    }
    assert (told["model"], told["name"]) == ("mount.json", "mount")
    assert told["parameters"]["rho"] == spring_of(1.0, 1.0).rho
    assert [loop["amplitude"] for loop in told["loops"]] == pytest.approx([0.005, 0.01, 0.015, 0.02])
    solver = PathSolver(spring_of(1.0, 1.0))
    for loop in told["loops"]:
        assert set(loop) == {"source", *FIGURES}
        assert loop["source"] == "model"
        expected = steady_loop(solver, MEAN - loop["amplitude"], MEAN + loop["amplitude"]).figures
        for name in FIGURES:
            assert loop[name] == pytest.approx(getattr(expected, name), rel=1e-9), name
    assert told["rate_independence"] is None
    # A quarter of the range is too short for this spring to saturate.
    assert told["overlap"]["verdict"] == "apart"
    assert told["overlap"]["amplitudes"] == 3
    assert terminal.err == ""


def test_amplitudes_are_given_in_millimetres_about_the_offset(terminal: Terminal) -> None:
    told = json.loads(terminal("info", "mount.json", *RIG, "--amplitude", "7", "--json"))
    (loop,) = told["loops"]
    assert (loop["low"], loop["high"]) == pytest.approx((MEAN - 0.007, MEAN + 0.007))
    assert told["overlap"] is None
    terminal("info", "mount.json", *RIG, "--amplitude", "7", "--amplitude", f"{AMPLITUDE * 1e3}")
    assert terminal.err == ""
    terminal("info", "mount.json", *RIG, "--amplitude", "25")
    assert "outside the identified range 30 to 70 mm" in terminal.err
    assert "25 to 75 mm" in terminal.err


def test_a_record_stands_beside_its_model(terminal: Terminal) -> None:
    record = synthesized(terminal, "s.csv", 15.0, 2.0)
    told = json.loads(terminal("info", "mount.json", record, "--amplitude", "5", "--json"))
    wanted, measured, model = told["loops"]
    assert [loop["source"] for loop in (wanted, measured, model)] == ["model", "s.csv", "model"]
    assert measured["cycles"] == 2
    assert measured["frequency"] == pytest.approx(2.0)
    assert set(measured["spread"]) == {"secant_stiffness", "energy_per_cycle", "loss_factor", "damping_ratio"}
    assert (measured["low"], measured["high"]) == (model["low"], model["high"])
    for name in FIGURES - {"min_force", "max_force"}:  # of noisy samples the peaks are biased
        assert measured[name] == pytest.approx(model[name], rel=0.01), name  # 1 % noise, less after averaging
    # One record of one amplitude and frequency tells nothing of rates and overlap.
    assert told["rate_independence"] is None
    assert told["overlap"] is None


def test_a_campaign_tells_of_rate_and_overlap(terminal: Terminal) -> None:
    records = [synthesized(terminal, f"a{a}f{f}.csv", a, f) for a, f in ((8, 0.5), (8, 2.0), (20, 0.5), (20, 2.0))]
    told = json.loads(terminal("info", "mount.json", *records, "--json"))
    rate, overlap = told["rate_independence"], told["overlap"]
    # Each record has the same seed: what noise there is repeats, and the difference is at most that of the noise.
    assert rate["verdict"] == "independent"
    assert rate["frequencies"] == pytest.approx([0.5, 2.0])
    assert rate["amplitudes"] == 2
    assert overlap["verdict"] == "overlapping"
    assert len(told["loops"]) == 8
    text = terminal("info", "mount.json", *records, "--verbose")
    assert rate["sentence"] in text
    assert overlap["sentence"] in text
    terminal("info", "mount.json", *records, "--time", "1", "--verbose")
    assert "time is column 1 'time [s]', as given" in terminal.err


def test_two_records_of_one_frequency_cannot_tell_of_the_rate(terminal: Terminal) -> None:
    records = [synthesized(terminal, f"{a}.csv", a, 1.0) for a in (8, 20)]
    assert "frequency is unknown" in terminal("info", "mount.json", *records)


def test_the_text_names_model_fit_origin_and_figures(terminal: Terminal) -> None:
    text = terminal("info", HINGE_MODEL, *HINGE, "--verbose")
    for expected in ("Model rubber_hinge", "kappa_omega", "refined", "RNL 0.97", "from rubber_stretch.csv",
                     "secant N/mm", "energy N*mm", "loss factor", "damping ratio", "2 cycles, 0.0152 Hz",
                     "from cycle to cycle"):  # fmt: skip
        assert expected in text, expected
    lines = text.splitlines()
    (heading,) = [k for k, line in enumerate(lines) if "secant N/mm" in line]
    (measured, spread, model) = lines[heading + 1 : heading + 4]
    assert f"  {Path(HINGE[0]).name} (" in measured
    assert "+-" in spread
    assert model.split()[-1] == "model"
    # Each figure ends where its heading does.
    end = lines[heading].index("energy N*mm") + len("energy N*mm")
    assert float(measured[:end].split()[-1]) == pytest.approx(4.166, rel=1e-3)
    # The identified range is that of averaged samples, micrometres within the record's: no caution for that.
    cautions = [line for line in terminal.err.splitlines() if line.startswith("Caution")]
    assert cautions
    assert all(line.startswith("Caution: Of the identification: ") for line in cautions)


def test_a_model_written_by_hand_needs_no_fit_or_origin(terminal: Terminal) -> None:
    text = terminal("info", "mount.json")
    assert "Model mount (mount.json): a mount" in text
    assert "RNL" not in text
    content = json.loads(Path("mount.json").read_text(encoding="utf-8"))
    content["fit"] = {"rmse": "low", "rnl": None}
    content["provenance"] = {"method": ["\u001b[31m"], "records": [7, {"file": "a\u001b[31m.csv"}, {}]}
    Path("odd.json").write_text(json.dumps(content), encoding="utf-8")
    text = terminal("info", "odd.json")
    assert "from a?[31m.csv" in text
    assert "\u001b" not in text


def test_both_figures_are_told_as_far_as_they_are_known(terminal: Terminal) -> None:
    content = json.loads(Path("mount.json").read_text(encoding="utf-8"))
    alone = {"rmse": 30.64, "rnl": 0.80751, "energy": 2.0, "predicted_energy": 1.13}
    fitted = {"rmse": 3.5, "rnl": 0.97823, "energy": 2.0, "predicted_energy": 1.99}
    record = {"file": "a.csv", **alone, "fitted": fitted}
    content["fit"] = {**alone, "fitted": fitted, "records": [record, {**record, "file": "b.csv", "fitted": alone}]}
    Path("both.json").write_text(json.dumps(content), encoding="utf-8")
    text = terminal("info", "both.json", "--verbose")
    words = "rmse 30.64 N, RNL 0.8075, energy 0.56 of the measured"
    beside = "(as fitted: RNL 0.9782, energy 0.99 of the measured)"
    assert f"  identified: {words} {beside}\n    a.csv: {words} {beside}\n    b.csv: {words}\n" in text
    fit = json.loads(terminal("info", "both.json", "--json"))["fit"]
    assert fit == {**alone, "fitted": fitted, "records": content["fit"]["records"]}
    content["fit"] = {"rmse": 30.64, "rnl": 0.80751, "records": [{"file": "a.csv", "rnl": 0.8}]}
    Path("part.json").write_text(json.dumps(content), encoding="utf-8")
    assert "  identified: rmse 30.64 N, RNL 0.8075\n" in terminal("info", "part.json")
    fit = json.loads(terminal("info", "part.json", "--json"))["fit"]
    assert fit["fitted"] is fit["energy"] is None
    assert fit["records"] == []
    assert "RNL" not in terminal("compare", "part.json", "both.json")
    assert json.loads(terminal("info", "mount.json", "--json"))["fit"] is None


def test_a_loop_without_a_loss_factor_is_null_in_json_and_a_dash_in_text(terminal: Terminal) -> None:
    content = json.loads(Path("mount.json").read_text(encoding="utf-8"))
    content["parameters"]["kE"] = [0.0, -1e5]
    Path("falling.json").write_text(json.dumps(content), encoding="utf-8")
    (loop,) = json.loads(terminal("info", "falling.json", "--amplitude", "5", "--json"))["loops"]
    assert loop["loss_factor"] is loop["damping_ratio"] is None
    assert "  -  " in terminal("info", "falling.json", "--amplitude", "5")


def test_bad_input_gets_one_sentence(terminal: Terminal) -> None:
    Path("bad.json").write_text("{}", encoding="utf-8")
    rows = "\n".join(f"{k},{k}" for k in range(30))
    Path("half.csv").write_text(f"Displacement (mm),Force (N)\n{rows}\n", encoding="utf-8")
    for arguments, expected in (
        (["bad.json"], "bad.json"),
        (["missing.json"], "missing.json"),
        (["mount.json", "missing.csv"], "missing.csv"),
        (["mount.json", "half.csv"], "half.csv: no full cycle"),
        (["mount.json", "half.csv", "--force", "Kraft"], "Kraft"),
    ):
        assert terminal("info", *arguments, status=1) == ""
        *_, refusal = terminal.err.strip().splitlines()
        assert refusal.startswith("strandspring: ")
        assert expected in refusal


@pytest.mark.parametrize("amplitude", ["0", "-3", "nan", "inf", "1e300", "wide"])
def test_wrong_amplitudes_are_wrong_usage(terminal: Terminal, amplitude: str) -> None:
    terminal("info", "mount.json", "--amplitude", amplitude, status=2)


def test_help_has_examples(terminal: Terminal) -> None:
    assert "strandspring info spring.json a13.csv a46.csv --json" in terminal("info", "--help")
    assert "strandspring info" in terminal("--help")


def test_identify_tells_the_same_of_a_campaign(terminal: Terminal) -> None:
    records = [
        synthesized(terminal, f"{amplitude}_{frequency}.csv", amplitude, frequency)
        for amplitude, frequency in ((AMPLITUDE * 500, 0.5), (AMPLITUDE * 1000, 0.5), (AMPLITUDE * 1000, 2.0))
    ]
    found = json.loads(terminal("identify", *records, "-o", "found.json", "--json"))
    told = json.loads(terminal("info", "found.json", *records, *RIG, "--json"))
    assert found["rate_independence"] == told["rate_independence"]
    assert found["rate_independence"]["verdict"] == "independent"
    assert found["overlap"] == told["overlap"]
    assert found["overlap"]["amplitudes"] == 1
    assert found["rate_independence"]["sentence"] in terminal("identify", *records, "-o", "found.json", "--verbose")
    alone = json.loads(terminal("identify", records[0], "-o", "found.json", "--json"))
    assert alone["rate_independence"] is None
    assert alone["overlap"] is None
