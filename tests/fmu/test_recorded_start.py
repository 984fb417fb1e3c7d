"""Where an FMU starts: in the state at the first sample of the record, or within what was recorded there."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest

from branched_springs import BRANCHES, SECOND
from fmu_tools import instance
from strandspring import BuildError, Record, Spring, SpringParameters, build_fmu, export, identify
from strandspring.fmu.checks.check import examine_fmu
from strandspring.fmu.description.ssv import parameter_values
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.model.coordinates import placed
from strandspring.model.file_tables import Start
from strandspring.model.modelfile import ModelFile, load_model, save_model
from terminal import Terminal

# Unloaded at displacement 0 after an unloading: its force there is 0.9 N at omega = 0, and 0 at omega = -1.
RUBBER = SpringParameters((1.4, 50.0), (1.0,), 0.9, 250.0, 0.8, 0.9, 0.01, 0.0, 0.02)
TIME = np.linspace(0.0, 3.0, 601)


def rig(lowest: float) -> np.ndarray:
    """A first loading from rest, then cycles down to another displacement [m]."""
    swing = 0.5 * (1.0 - np.cos(2.0 * np.pi * TIME))
    return np.where(TIME < 0.5, 0.02 * swing, lowest + (0.02 - lowest) * swing)


@pytest.fixture(scope="module")
def loaded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ModelFile, Record]:
    """A record that begins at rest, and its model file."""
    path = rig(0.004)
    noise = 0.002 * np.random.default_rng(0).standard_normal(path.size)
    folder = tmp_path_factory.mktemp("loaded")
    Record(path, Spring(RUBBER).response(path, omega_start=-1.0) + noise, TIME).save(folder / "rubber.csv")
    found = identify(folder / "rubber.csv")
    model = found.model_file("rubber")
    save_model(folder / "rubber.json", model)
    return folder, model, found.records[0]


def driven(fmu: Path, path: np.ndarray, folder: Path) -> np.ndarray:
    """Force along a path, the FMU as it starts by itself [N]."""
    with instance(fmu, folder) as one:
        force = one.initialize(displacement=float(path[0])).get("force")
        for k, x in enumerate(path[1:].tolist()):
            force += one.step(x, "force", time=0.001 * k)
    return np.array(force)


@pytest.mark.parametrize("build", [build_native_fmu, build_python_fmu])
def test_a_first_loading_begins_at_rest(
    loaded: tuple[Path, ModelFile, Record], build: Callable[..., Path], tmp_path: Path
) -> None:
    """Issue 52: RNL was 0.26 along the FMU's own record, and 0.9 N the force of a spring that nothing loads."""
    _, model, record = loaded
    assert model.start is not None
    assert (model.start.displacement, model.start.at_rest) == (0.0, True)
    assert model.start.omega == pytest.approx(-1.0, abs=0.01)  # of noise of 0.002 N
    force = driven(build(model, tmp_path), record.displacement, tmp_path / "unpacked")
    assert force[0] == pytest.approx(record.force[0], abs=0.01)
    rnl = 1.0 - np.linalg.norm(force - record.force) / np.linalg.norm(record.force)
    assert rnl == pytest.approx(model.fit["records"][0]["rnl"], abs=1e-9)  # rounding


def test_what_was_left_out_of_the_fit_tells_where_it_began() -> None:
    """The memory of the start is gone where the fit begins, so that only the first force shows it."""
    path = rig(0.0)
    model = identify(Record(path, Spring(RUBBER).response(path, omega_start=-0.6), TIME)).model_file()
    assert model.fit["records"][0]["first_sample"] == 101
    assert model.start.omega == pytest.approx(-0.6, abs=0.05)  # of a force within 0.03 %, one 20th of kappa_omega


@pytest.mark.parametrize("zero", np.linspace(0.001, 0.019, 7).tolist())
def test_elsewhere_it_starts_within_what_was_recorded_there(zero: float, tmp_path: Path) -> None:
    path = 0.01 - 0.01 * np.cos(2.0 * np.pi * TIME + 0.4)
    record = Record(path, Spring(RUBBER).response(path, omega_start=-0.4), TIME)
    model = identify(record).model_file("mount")
    assert model.start is not None
    assert not model.start.at_rest
    fmu = build_native_fmu(model, tmp_path, zero=zero)
    (force,) = driven(fmu, np.array([0.0]), tmp_path / "unpacked")
    there = record.force[np.abs(path - zero) < 2e-4]
    assert there.min() < force < there.max()


STATE = Start(displacement=0.0, omega=-0.75, second_omega=0.25, branch_forces=[0.0], at_rest=False)
WHOLE = ModelFile("whole", replace(RUBBER, second=replace(SECOND, kA=(1.0,)), branches=BRANCHES[:1]), start=STATE)


@pytest.mark.parametrize("form", [{}, {"fmi": 3}, {"with_states": True}, {"real_time": True}, {"python": True}])
def test_the_whole_state_starts_there_in_all_forms(form: dict[str, object], tmp_path: Path) -> None:
    fmu = build_python_fmu(WHOLE, tmp_path) if "python" in form else build_native_fmu(WHOLE, tmp_path, **form)
    start = {v.name: v.start for v in fmpy.read_model_description(str(fmu)).modelVariables}
    names = ("omega", "second_omega") if "with_states" in form else ("omega_start", "second_omega_start")
    assert [float(start[name]) for name in names] == [-0.75, 0.25]
    assert examine_fmu(fmu).problems == ()  # binary and description begin alike
    if form in ({}, {"python": True}):
        (force,) = driven(fmu, np.array([0.0]), tmp_path / "unpacked")
        # kE - kappa_omega*0.75, and the second mechanism's 0.25*9 N.
        assert force == pytest.approx(1.4 - 50.0 * 0.01 - 0.75 * 0.9 + 0.25 * 9.0, rel=1e-12)


def test_exports_start_there(tmp_path: Path) -> None:
    spring = Spring.from_model(WHOLE)
    ssv, modelica = export(spring, tmp_path, ssv=True, modelica=True)
    assert 'name="omega_start"' in (text := ssv.read_text(encoding="utf-8"))
    (law,) = export(spring, tmp_path, c=True)
    # What a program calls that steps the spring without FMI.
    header = " ".join(law.with_suffix(".h").read_text(encoding="utf-8").replace("\n *", "").split())
    assert "begins with spring_start(0.0, -0.75) and spring_added_start(0.0, 0.25)" in header
    for name, value in (("omega_start", "-0.75"), ("second_omega_start", "0.25")):
        assert f'value="{value}"' in text.split(f'name="{name}"')[1].split("</ssv:Parameter>")[0]
        assert f"    {name}={value}" in modelica.read_text(encoding="utf-8")
    assert text == parameter_values(placed(WHOLE, None)[0])


def test_without_a_recorded_start_omega_is_0(tmp_path: Path) -> None:
    _, modelica = export(Spring(RUBBER, "hand"), tmp_path, ssv=True, modelica=True)
    assert "    omega_start=0.0" in modelica.read_text(encoding="utf-8")


def test_the_command_checks_the_fmu_along_its_record(
    loaded: tuple[Path, ModelFile, Record], terminal: Terminal
) -> None:
    folder, model, _ = loaded
    table, file = str(folder / "rubber.csv"), str(folder / "rubber.json")
    assert "RNL as stated along rubber.csv" in " ".join(terminal("build", table, "-o", "record").split())
    told = terminal("build", file, "--record", table, "--backend", "both", "-o", "model")
    assert " ".join(told.split()).count("RNL as stated along rubber.csv") == 2
    assert "RNL" not in terminal("build", file, "-o", "alone")
    content = json.loads(model.to_json())
    content["fit"]["records"][0]["rnl"] -= 2e-6
    Path("other.json").write_text(json.dumps(content), encoding="utf-8")
    terminal("build", "other.json", "--record", table, "-o", "other", status=1)
    assert "dist" not in terminal.err
    assert f"RNL along {table} must be 0.9988" in terminal.err
    assert not Path("other").exists()


def test_a_record_of_another_model_is_refused(loaded: tuple[Path, ModelFile, Record], terminal: Terminal) -> None:
    folder, _, record = loaded
    replace(record, force=record.force + 0.001).save("another.csv")
    terminal("build", str(folder / "rubber.json"), "--record", "another.csv", status=1)
    assert "another.csv: the model rubber states no figures of this record" in terminal.err
    with pytest.raises(BuildError, match="the model hand states no figures of this record"):
        build_fmu(Spring(RUBBER, "hand"), record=folder / "rubber.csv")
    with pytest.raises(BuildError, match="`record` is for a model"):
        build_fmu(folder / "rubber.csv", record=folder / "rubber.csv")
    terminal("build", str(folder / "rubber.csv"), "--record", "another.csv", status=2)
    assert not Path("dist").exists()


def test_arrays_of_one_length_are_told_apart(tmp_path: Path) -> None:
    pair = [Record(path, Spring(RUBBER).response(path, -0.5), TIME) for path in (rig(0.0), rig(0.002))]
    found = identify(pair)
    assert build_fmu(found, tmp_path, name="pair").exists()
    assert load_model(tmp_path / "pair.fmu").start == found.model_file().start


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    return Terminal(capsys)
