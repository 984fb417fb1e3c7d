"""`build SYSTEM.toml`, as a command and in Python."""

from __future__ import annotations

import json
import shutil
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

import strandspring
from strandspring import BuildError, StrandspringError, build_fmu
from strandspring.errors import MountedSystemError
from strandspring.fmu.archive import write_archive
from strandspring.fmu.related_files import sealed
from strandspring.vibration.bodies.simulation import simulate_case
from strandspring.vibration.description.system_file import is_system_file, load_system_file
from terminal import Terminal

EXAMPLES = Path(strandspring.__file__).parent / "examples" / "systems"


@pytest.fixture(autouse=True)
def examples(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The examples, in the folder that tests run in."""
    shutil.copytree(EXAMPLES, tmp_path / "systems")
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str]) -> Terminal:
    return Terminal(capsys)


@pytest.mark.parametrize(
    ("name", "candidate", "inputs"),
    [
        ("electronics_box", "softer", ["base_acceleration_x", "base_acceleration_y", "base_acceleration_z"]),
        ("two_stage_platform", None, ["base_acceleration_x", "base_acceleration_y", "base_acceleration_z"]),
    ],
)
def test_examples_are_built(terminal: Terminal, name: str, candidate: str | None, inputs: list[str]) -> None:
    chosen = [] if candidate is None else ["--candidate", candidate]
    told = json.loads(terminal("build", f"systems/{name}.toml", *chosen, "-o", "out", "--json"))
    (fmu,) = told["fmus"]
    assert validate_fmu(fmu["path"]) == []
    assert fmu["check"].startswith("valid; 250 steps of co-simulation took ")
    assert told["inputs"] == inputs
    assert told["step"] == pytest.approx(0.05 * told["stable_step"], rel=0.06)
    # In Python too, and in words.
    again = build_fmu(f"systems/{name}.toml", "again", candidate=candidate)
    assert again.read_bytes() == Path(fmu["path"]).read_bytes()
    said = terminal("build", f"systems/{name}.toml", *chosen, "-o", "out")
    assert f"Internal step: at most {told['step']:g} s; stable up to " in said


def test_examples_are_built_for_fmi_3(terminal: Terminal) -> None:
    arguments = ("build", "systems/gun_cradle.toml", "--candidate", "four springs", "--fmi", "3", "--author", "A")
    told = json.loads(terminal(*arguments, "-o", "out", "--json"))
    (fmu,) = told["fmus"]
    assert (fmu["fmi"], fmu["backend"]) == (3, "native")
    assert Path(fmu["path"]) == Path("out/Gun_cradle_fmi3.fmu")
    assert fmu["check"].startswith("valid; 250 steps of co-simulation took ")
    again = build_fmu("systems/gun_cradle.toml", "again", candidate="four springs", fmi=3, author="A")
    assert again.read_bytes() == Path(fmu["path"]).read_bytes()
    assert "FMI 3.0" in terminal(*arguments, "-o", "out")
    assert "The reference comes out of co-simulation in 250 steps" in terminal("verify", str(again))
    # Beside that of FMI 2.0.
    two = json.loads(terminal("build", "systems/gun_cradle.toml", "--candidate", "four springs", "-o", "out", "--json"))
    assert (two["fmus"][0]["fmi"], two["inputs"]) == (2, told["inputs"])
    assert sorted(path.name for path in Path("out").iterdir()) == ["Gun_cradle.fmu", "Gun_cradle_fmi3.fmu"]
    with pytest.raises(MountedSystemError, match=r"^The version of FMI must be 2 or 3, got 4\.$"):
        build_fmu("systems/gun_cradle.toml", candidate="four springs", fmi=4)  # type: ignore[arg-type]


def test_it_is_verified(terminal: Terminal, tmp_path: Path) -> None:
    fmu = build_fmu("systems/two_stage_platform.toml", "out")
    said = terminal("verify", str(fmu))
    assert "The reference comes out of co-simulation in 250 steps, the force within 0.0e+00 N." in said
    for member, change in (
        ("reference.csv", lambda text: text.replace(b"-", b"", 400)),
        ("reference.csv", lambda text: text.replace(b"sway_", b"swing_", 1)),
        ("reference.csv", lambda _: b"time\n0.0\n"),
        ("stimuli.csv", lambda text: text.replace(b"0.0", b"nan", 1)),
    ):
        changed = tmp_path / "changed.fmu"
        with zipfile.ZipFile(fmu) as archive:
            contents = {name: archive.read(name) for name in archive.namelist() if not name.endswith("sha256.json")}
        path = f"resources/strandspring/{member}"
        contents[path] = change(contents[path])
        write_archive(changed, sealed(contents))
        terminal("verify", str(changed), status=1)
        assert any(text in terminal.out for text in ("that of the reference", "is not a table", "no variable"))


def test_a_recoil_is_an_input(terminal: Terminal) -> None:
    told = json.loads(terminal("build", "systems/gun_cradle.toml", "--candidate", "four springs", "--json"))
    loads = [name for name in told["inputs"] if name.startswith("load_")]
    assert len(loads) == 1
    described = fmpy.read_model_description(told["fmus"][0]["path"])
    assert next(v.description for v in described.modelVariables if v.name == loads[0]).startswith("Force on ")


@pytest.mark.slow
def test_the_fmu_moves_as_the_simulation_of_a_case() -> None:
    fmu = build_fmu("systems/electronics_box.toml", "out", candidate="standard")
    file = load_system_file("systems/electronics_box.toml")
    case = next(case for case in file.cases if case.kind == "pulse")
    run = simulate_case(dict(file.candidates)["standard"], case)
    step = 1e-4
    count = round(case.duration / step)
    (channel,) = case.channels
    names = [f"base_acceleration_{name}" for name in "xyz"]
    signal = np.zeros(count, dtype=[("time", float), *((name, float) for name in names)])
    signal["time"] = step * np.arange(count)
    for name, component in zip(names, channel.direction, strict=True):
        signal[name] = component * channel.signal.averages(step, count)
    points = ["circuit_board", "connector"]
    outputs = [f"{kind}_{point}_{name}" for kind in ("acceleration", "sway") for point in points for name in "xyz"]
    found = fmpy.simulate_fmu(
        str(fmu), stop_time=step * count, output_interval=step, step_size=step, input=signal, output=outputs
    )
    for kind, expected in (("acceleration", run.figures.acceleration), ("sway", run.figures.sway)):
        columns = [[found[f"{kind}_{point}_{name}"] for name in "xyz"] for point in points]
        largest = np.linalg.norm(columns, axis=1).max(axis=1)
        # Peaks between samples, and the coarser step. Measured: 5e-4.
        np.testing.assert_allclose(largest, expected, rtol=5e-3)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ("", "systems/electronics_box.toml: an FMU is of one candidate; choose `candidate` among standard, softer."),
        ("--candidate other", "choose `candidate` among standard, softer, got 'other'."),
    ],
)
def test_a_candidate_must_be_chosen(terminal: Terminal, options: str, sentence: str) -> None:
    terminal("build", "systems/electronics_box.toml", *options.split(), status=1)
    assert sentence in terminal.err
    assert not Path("dist").exists()


def test_options_of_models_are_refused(terminal: Terminal) -> None:
    terminal("build", "systems/electronics_box.toml", "--states", "--zero", "3", "--name", "a", status=2)
    sentence = "can only be given with a model or records, and systems/electronics_box.toml describes a system; leave"
    assert f"--states, --name, --zero {sentence}" in " ".join(terminal.err.split())
    terminal("build", "systems/corner_shear.json", "--candidate", "a", status=2)
    assert "--candidate is for descriptions of systems (SYSTEM.toml); leave it out." in terminal.err
    with pytest.raises(
        BuildError, match=r"^`states`, `zero` cannot be given with a description of a system; leave that"
    ):
        build_fmu("systems/electronics_box.toml", states=True, zero=0.0)
    with pytest.raises(BuildError, match=r"^`candidate` is for descriptions of systems"):
        build_fmu("systems/corner_shear.json", candidate="a")


def test_what_cannot_be_built_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    text = Path("systems/electronics_box.toml").read_text()
    Path("systems/heavy.toml").write_text(text.replace('mass = "20 kg"', 'mass = "20 t"'))
    with pytest.raises(MountedSystemError, match=r"rests at .* outside|cannot rest"):
        build_fmu("systems/heavy.toml", "out", candidate="standard")
    Path("systems/wrong.toml").write_text(text.replace("[[body]]", "[[bodies]]", 1))
    with pytest.raises(MountedSystemError, match=r"^systems/wrong\.toml, "):
        build_fmu("systems/wrong.toml", "out", candidate="standard")
    monkeypatch.setattr("strandspring.fmu.checks.table_check.FORCE_TOLERANCE", -1.0)
    with pytest.raises(BuildError, match="was not written, because the FMU failed its check: Its acceleration must be"):
        build_fmu("systems/electronics_box.toml", "out", candidate="standard")
    monkeypatch.undo()
    assert not Path("out").exists()


def test_a_system_is_told_from_records(tmp_path: Path) -> None:
    for name, text, expected in (
        ("a.toml", 'format = "strandspring-system"\n', True),
        ("b.toml", "[[body]]\n", True),
        ("c.TOML", "[[body]]\n", True),
        ("d.toml", "[[record]]\n", False),
        ("e.toml", "[[body]\n", False),
        ("f.csv", "[[body]]\n", False),
    ):
        (tmp_path / name).write_text(text)
        assert is_system_file(tmp_path / name) is expected, name
    assert not is_system_file(tmp_path / "missing.toml")
    with pytest.raises(StrandspringError):
        build_fmu(tmp_path / "missing.toml", tmp_path)
