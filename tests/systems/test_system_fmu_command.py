"""`build SYSTEM.toml`, as a command and in Python."""

from __future__ import annotations

import json
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Literal
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

import strandspring
from strandspring import BuildError, StrandspringError, build_fmu, info_system, isolate_system
from strandspring.errors import MountedSystemError
from strandspring.fmu.archive import write_archive
from strandspring.fmu.related_files import sealed
from strandspring.vibration.bodies.simulation import simulate_case
from strandspring.vibration.description.system_file import is_system_file, load_system_file
from terminal import Terminal, unfolded

EXAMPLES = Path(strandspring.__file__).parent / "examples" / "systems"


@pytest.fixture(autouse=True)
def examples(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The examples, in the folder that tests run in."""
    shutil.copytree(EXAMPLES, tmp_path / "systems")
    monkeypatch.chdir(tmp_path)


@pytest.fixture(scope="module")
def softer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU of the electronics box on softer mounts."""
    return build_fmu(EXAMPLES / "electronics_box.toml", tmp_path_factory.mktemp("softer"), candidate="softer")


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
    said = unfolded(terminal("verify", str(fmu)))
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
        path = f"extra/org.fmi-standard.fmi-ls-ref/{member}"
        contents[path] = change(contents[path])
        write_archive(changed, sealed(contents))
        terminal("verify", str(changed), status=1)
        assert any(text in terminal.err for text in ("that of the reference", "is not a table", "no variable"))


def members(fmu: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(fmu) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.mark.parametrize(
    ("name", "candidate", "fmi"), [("electronics_box", "softer", 2), ("gun_cradle", "four springs", 3)]
)
def test_it_is_built_again_from_itself(terminal: Terminal, name: str, candidate: str, fmi: Literal[2, 3]) -> None:
    system, text = f"systems/{name}.toml", Path(f"systems/{name}.toml").read_bytes()
    fmu = build_fmu(system, "out", candidate=candidate, fmi=fmi, author="A")
    other = build_fmu(system, "other", candidate=candidate, fmi=2 if fmi == 3 else 3, author="B")
    shutil.rmtree("systems")
    again = build_fmu(fmu, "again")
    assert again.name == fmu.name
    assert again.read_bytes() == fmu.read_bytes()
    told = json.loads(terminal("build", str(fmu), "-o", "told", "--candidate", candidate, "--json"))
    assert (told["candidate"], told["fmus"][0]["fmi"]) == (candidate, fmi)
    assert Path(told["fmus"][0]["path"]).read_bytes() == fmu.read_bytes()
    # Of the other version of FMI.
    terminal("build", str(fmu), "-o", "told", "--fmi", str(2 if fmi == 3 else 3), "--author", "B")
    assert (Path("told") / other.name).read_bytes() == other.read_bytes()
    held = members(fmu)
    assert held["resources/strandspring/SYSTEM.toml"] == text
    # The manifest names each related file, and what the FMU is made of.
    folder = "extra/org.fmi-standard.fmi-ls-ref/"
    manifest = ElementTree.fromstring(held[f"{folder}fmi-ls-manifest.xml"])
    related = {element.attrib["source"] for element in manifest}
    assert related == {"../../resources/strandspring/SYSTEM.toml", "experiments.exp", "stimuli.csv", "reference.csv"}
    assert related - {"../../resources/strandspring/SYSTEM.toml"} < {path.removeprefix(folder) for path in held}
    (step,) = ElementTree.fromstring(held[f"{folder}experiments.exp"]).findall("Experiment")
    rows = held[f"{folder}reference.csv"].decode().splitlines()
    assert float(rows[2].split(",")[0]) == float(step.attrib["stepSize"])
    assert rows[-1].split(",")[0] == step.attrib["stopTime"]
    for path, content in held.items():
        if path.startswith("resources/strandspring/models/"):
            assert json.loads(content) == json.loads((EXAMPLES / Path(path).name).read_text())
    terminal("build", str(fmu), "--candidate", "other", status=1)
    assert f"{fmu} is of the candidate {candidate}; build that of another one from the SYSTEM.toml." in terminal.err
    terminal("build", str(fmu), "--zero", "3", status=2)
    with pytest.raises(BuildError, match=r"^`states` cannot be given with a description of a system"):
        build_fmu(fmu, states=True)


def test_models_of_the_same_name_and_no_records_are_held() -> None:
    text = Path("systems/electronics_box.toml").read_text()
    for folder in ("one", "two"):
        Path(folder).mkdir()
    shutil.move("systems/corner_compression.json", "one/corner.json")
    shutil.move("systems/corner_shear.json", "two/corner.json")
    Path("shaken.csv").write_text("time [s],up [m/s^2]\n" + "".join(f"{1e-3 * k:g},{k % 7 - 3}\n" for k in range(200)))
    text = text.replace("corner_compression.json", "../one/corner.json")
    text = text.replace("corner_shear.json", "../two/corner.json")
    case = '[[case]]\nname = "shaken"\nrecord = { file = "../shaken.csv", columns = { z = "up" } }\n'
    Path("systems/changed.toml").write_text(text + case)
    fmu = build_fmu("systems/changed.toml", "out", candidate="standard")
    for path in ("systems", "one", "two"):
        shutil.rmtree(path)
    Path("shaken.csv").unlink()
    assert build_fmu(fmu, "again").read_bytes() == fmu.read_bytes()
    held = [name for name in members(fmu) if name.startswith("resources/strandspring/models/corner")]
    assert held[:2] == [f"resources/strandspring/models/corner{number}.json" for number in ("", "_2")]


@pytest.mark.parametrize(
    ("member", "change", "sentence"),
    [
        ("system.json", lambda text: text[:-20], "(resources/strandspring/system.json is damaged)"),
        ("system.json", lambda text: text.replace(b'"fmi": 2', b'"fmi": 4'), "system.json is damaged"),
        ("system.json", lambda text: text.replace(b'"softer"', b'"no"'), "system.json is not that of its SYSTEM.toml"),
        (
            "system.json",
            lambda text: text.replace(
                b'"forces": []', b'"forces": [{"name": "a", "body": 1, "place": [0, 0, 0], "direction": [1, 0, 0]}]'
            ),
            "system.json is not that of its SYSTEM.toml",
        ),
        (
            "system.json",
            lambda text: text.replace(b"/corner_shear.json", b"/../corner.json"),
            "The FMU holds no resources/strandspring/models/../corner.json",
        ),
        (
            "system.json",
            lambda text: text.replace(b'"corner_shear.json":', b'"corner.json":'),
            "'corner_shear.json' is missing",
        ),
        ("SYSTEM.toml", lambda text: text.replace(b"[[body]]", b"[[bodies]]", 1), "'bodies' is not a key here"),
        ("SYSTEM.toml", lambda _: b"\xff", "cannot be read as the FMU of a system"),
        ("models/corner_shear.json", lambda text: text.replace(b'"n":', b'"m":'), "models/corner_shear.json: param"),
    ],
)
def test_what_it_holds_must_be_sound(
    terminal: Terminal, softer: Path, member: str, change: Callable[[bytes], bytes], sentence: str
) -> None:
    contents = members(softer)
    path = f"resources/strandspring/{member}"
    assert change(contents[path]) != contents[path]
    write_archive(Path("changed.fmu"), {**contents, path: change(contents[path])})
    for command in ("build", "info"):
        terminal(command, "changed.fmu", status=1)
        assert terminal.err.count("changed.fmu") == 1
        assert sentence in terminal.err
    assert not Path("dist").exists()


def test_what_it_holds_is_shown(terminal: Terminal) -> None:
    fmu = str(build_fmu("systems/two_stage_platform.toml", "out", author="A"))
    said = terminal("info", fmu)
    assert said.startswith(f"System Two-stage platform, as described ({fmu})")
    assert "FMI 2.0, co-simulation, built by strandspring " in said
    assert ", author A\n" in said
    assert "inputs: base_acceleration_x, base_acceleration_y, base_acceleration_z; " in said
    told = json.loads(terminal("info", fmu, "--json"))
    assert (told["system"], told["candidate"], told["options"]["author"]) == (fmu, "as described", "A")
    (isolated,) = isolate_system("systems/two_stage_platform.toml", directions="x", points=2).candidates
    assert isolated.rest_lines() == terminal("info", fmu, "--verbose").splitlines()[-len(isolated.rest_lines()) :]
    frequencies = [mode["frequency"] for mode in told["modes"]]
    assert frequencies == [mode.frequency for mode in isolated.modes]
    assert info_system(fmu).to_frame()["frequency"].tolist() == frequencies
    page = members(Path(fmu))["documentation/index.html"].decode()
    for mode in isolated.modes:
        assert f'<td class="number">{mode.frequency:.4g}</td>' in page
        assert f"<td>{mode.words}</td>" in page
    # Three views.
    assert page.count("<svg") == 1
    assert page.count("<title>equipment</title>") == page.count("<title>below 1</title>") == 3
    terminal("info", fmu, "record.csv", "--save", "a.json", status=2)
    assert "records, --save can only be given with a model" in " ".join(terminal.err.split())
    spring = build_fmu("systems/corner_shear.json", "out")
    with pytest.raises(MountedSystemError, match=r"^out/corner_shear\.fmu cannot be read as the FMU of a system \("):
        info_system(spring)


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
