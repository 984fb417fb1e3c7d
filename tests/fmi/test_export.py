"""What `strandspring export` writes: SSP parameter values and systems, and the command, as other programs read them."""

from __future__ import annotations

import json
import math
import os
import re
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, read_ssv
from fmpy.validation import validate_fmu

from fmu_tools import AWKWARD, CONSTANT, LONGEST, SPRING, wandering_path
from forms import FORMS
from pages import ROOT
from springs import force_scale
from strandspring import Spring, SpringParameters
from strandspring.core.variables import spring_parameters, start_values, variables
from strandspring.cosimulation import FmuSpring, Iterative, Jacobi, Motion, one_mass, simulate
from strandspring.examples import ssp_system
from strandspring.exchange.modelica import record_text
from strandspring.exchange.shaken_mass_slave import ShakenMass
from strandspring.exchange.ssp import ShakenMassValues
from strandspring.fmu.description.ssv import parameter_values
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.coordinates import placed, zero_sentence
from strandspring.model.modelfile import ModelFile, load_model
from terminal import Terminal, unfolded
from tools import tool

pytestmark = pytest.mark.long
HINGE = ROOT / "models" / "rubber_hinge.json"
RECORD = "StrandSpring/Records/mount.mo"


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    """The command line in a folder with two model files."""
    monkeypatch.chdir(tmp_path)
    Spring(SPRING, "mount", "a mount").save("mount.json")
    Spring(SPRING, "model").save("model.json")
    return Terminal(capsys)


def files() -> dict[str, bytes]:
    """Everything below the working folder but the model files."""
    found = {path.as_posix(): path.read_bytes() for path in Path().rglob("*") if path.is_file()}
    return {name: content for name, content in found.items() if name not in ("mount.json", "model.json")}


# SSP parameter values


@pytest.mark.parametrize("parameters", [SPRING, CONSTANT, LONGEST], ids=["spring", "constant", "longest"])
def test_ssv_holds_all_that_can_be_set_with_every_bit(parameters: SpringParameters, tmp_path: Path) -> None:
    exact = replace(parameters, kE=(0.1 + 0.2, *parameters.kE[1:]), rho=100.0 + 1e-13)
    path = tmp_path / "spring.ssv"
    path.write_text(parameter_values(ModelFile("spring", exact, AWKWARD)), encoding="utf-8", newline="\n")
    read, root = read_ssv(str(path)), ElementTree.parse(path).getroot()  # by the schema of SSP 1.0
    table = [v for v in variables(len(exact.kE), len(exact.kA)) if v.causality in ("input", "parameter")]
    assert (read.name, root.get("description")) == ("spring", AWKWARD)
    assert [(p.name, p.type, p.unit) for p in read.parameters] == [(v.name, "Real", v.unit) for v in table]
    values = {p.name: float(p.value) for p in read.parameters}
    assert values == start_values(exact)
    assert spring_parameters(values, len(exact.kE), len(exact.kA)) == exact
    described = fmpy.read_model_description(str(build_native_fmu(ModelFile("spring", exact), tmp_path)))
    of_fmu = {unit.name: unit.baseUnit for unit in described.unitDefinitions}
    for unit in root.iterfind("{*}Units/{*}Unit"):
        powers = {symbol: int(power) for symbol, power in unit[0].attrib.items()}
        base = of_fmu[str(unit.get("name"))]
        assert [powers.get(s, 0) for s in ("kg", "m", "s")] == [getattr(base, s) for s in ("kg", "m", "s")]
        assert (base.factor, base.offset) == (1.0, 0.0)


def test_ssv_applied_to_the_fmu_of_another_spring_makes_it_this_one() -> None:
    other = SpringParameters((1.0, 2.0, 3.0, 4.0), (1.0, 0.0, 0.0), 1.0, 2.0, 0.6, 3.0, 0.0, -1.0, 1.0)
    root, path = ElementTree.fromstring(parameter_values(ModelFile("s", SPRING))), wandering_path(SPRING, 200, seed=4)
    given = {str(p.get("name")): float(str(p[0].get("value"))) for p in root.iterfind("{*}Parameters/{*}Parameter")}
    with FORMS["co-simulation"].instance(other) as one:
        one.begin(**{**given, "displacement": path[0]})
        force = [*one.get("force"), *(row[0] for row in one.along(path, 1e-3 * np.arange(path.size), "force"))]
    assert force == pytest.approx(Spring(SPRING).response(path), abs=1e-12 * force_scale(SPRING, path))


# The command


def test_files_go_to_dist_and_hold_what_was_made(terminal: Terminal) -> None:
    said = terminal("export", "mount.json", "--ssv", "--modelica")
    assert said == (
        "Displacement is counted from 25.5 mm of the record, as in the FMU.\n"
        f"SSP parameter values: {Path('dist/mount.ssv')}\n"
        f"Modelica library: {Path('dist/StrandSpring')}, record StrandSpring.Records.mount\n"
    )
    model, zero = placed(ModelFile("mount", SPRING, "a mount"), None)
    assert files()["dist/mount.ssv"] == parameter_values(model).encode()
    assert files()[f"dist/{RECORD}"] == record_text(model, "mount", zero_sentence(zero)).encode()
    before = files()
    terminal("export", "model.json", "--modelica")  # another spring is added to the library
    assert "named _model, because model is taken in Modelica" in terminal.err
    order = "dist/StrandSpring/Records/package.order"
    assert files().keys() - before.keys() == {"dist/StrandSpring/Records/_model.mo"}
    assert {name for name, content in before.items() if files()[name] != content} == {order}
    assert files()[order].decode().split() == ["SpringData", "StrandedWireMount", "_model", "mount"]
    terminal("export", "mount.json", "--ssv", "--modelica", "--zero", "rig", "-o", "rig")
    assert "as in the record and in the FMU" in files()[f"rig/{RECORD}"].decode()
    assert files()["rig/mount.ssv"] == parameter_values(ModelFile("mount", SPRING, "a mount")).encode()
    said = unfolded(terminal("export", "mount.json", "--c", "-o", "firmware"))
    law = Path("firmware/strandspring_c/mount_law.c")
    assert re.search(rf"\nC sources: {re.escape(str(law))} and what it needs; \d+ kB of constants\n$", said), said
    answer = json.loads(terminal("export", "mount.json", "--ssv", "--json"))
    made = {"ssv": str(Path("dist/mount.ssv")), "ssp": None, "modelica": None, "c": None}
    assert answer == {"model": "mount.json", "name": "mount", "zero": 0.5 * (0.001 + 0.05), **made}


def test_the_output_is_a_folder_or_a_file(terminal: Terminal) -> None:
    Path("a.b").mkdir()
    for arguments, written in (
        (["--ssv", "-o", "a/b.ssv"], "a/b.ssv"), (["--ssp", "--mass", "2", "-o", "a/b.ssp"], "a/b.ssp"),
        (["--ssv", "-o", "a.b/../new"], "new/mount.ssv"), (["--modelica", "-o", "a.b"], f"a.b/{RECORD}"),
    ):  # fmt: skip
        before = files()
        terminal("export", "mount.json", *arguments)
        after = files()
        made = after.keys() - before.keys()
        assert made == {written} if "StrandSpring/" not in written else written in made
        terminal("export", "mount.json", *arguments)
        assert files() == after


def test_wrong_usage_and_bad_input_write_nothing(terminal: Terminal) -> None:
    Path("library").mkdir()
    Path("library/package.mo").touch()
    Path("bad.json").write_text("{}", encoding="utf-8")
    Path("plain").write_text("", encoding="utf-8")
    Path("other/StrandSpring").mkdir(parents=True)
    Path("other/StrandSpring/package.mo").write_text("within ;\npackage Other\nend Other;\n", encoding="utf-8")
    os.mkfifo("pipe.ssv")  # which `files` leaves out
    before, model = files(), Path("mount.json").read_bytes()
    for arguments, status, expected in (
        ([], 2, "--ssv"), (["--ssv", "-o", "values.xml"], 2, ".ssv"), (["--ssv", "-o", "mount.json"], 2, ".ssv"),
        (["--modelica", "-o", "mount.mo"], 2, "must be a folder, got mount.mo"),
        (["--modelica", "--ssv", "-o", "mount.ssv"], 2, "must be a folder, got mount.ssv"),
        (["--modelica", "-o", "library"], 2, "library is a Modelica package; give the folder that holds the library"),
        (["--c", "-o", "mount.c"], 2, "The C sources are a folder; -o must be a folder, got mount.c."),
        (["--ssp"], 2, "--ssp and --mass KG go together"), (["--ssv", "--mass", "2"], 2, "--ssp and --mass KG go"),
        (["--ssp", "--mass", "-2"], 2, "'--mass': must be a finite number > 0 [kg], got -2."),
        (["--ssp", "--mass", "2", "-o", "mount.ssv"], 2, "ending in .ssp, got mount.ssv"), (["--fmi"], 2, "--fmi"),
        (["--ssp", "--mass", "2", "--zero", "rig"], 1, "outside the identified range from 1 to 50 mm"),
        (["--ssv", "-o", "plain/folder"], 1, "cannot be written"),
        (["--ssv", "-o", f"{'x' * 300}.ssv"], 1, "cannot be written"),
        (["--ssv", "-o", "pipe.ssv"], 1, "pipe.ssv cannot be written: it is a folder or a device"),
        (["--ssv", "--modelica", "-o", "other"], 1, "is not a library that strandspring has written"),
    ):  # fmt: skip
        assert terminal("export", "mount.json", *arguments, status=status) == ""
        assert expected in " ".join(terminal.err.split()), terminal.err
        assert status == 2 or terminal.err.startswith("strandspring: ")
        assert (files(), Path("mount.json").read_bytes()) == (before, model)
    terminal("export", "bad.json", "--ssv", status=1)
    assert "bad.json" in terminal.err


# The SSP system

MASS, STOP, STEP = 0.01, 0.68, 5e-5  # 10 periods


@pytest.fixture
def ssp(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    path = tmp_path / "system.ssp"
    said = Terminal(capsys)("export", str(HINGE), "--ssp", "--mass", str(MASS), "-o", str(path))
    assert said.endswith(f"SSP system: {path}\n")
    return path


def test_the_system_holds_what_its_structure_names(ssp: Path, tmp_path: Path, capsys: Any) -> None:
    system = read_ssd(str(ssp)).system  # checked by the schema of SSP 1.0
    with zipfile.ZipFile(ssp) as archive:
        names, structure = set(archive.namelist()), archive.read("SystemStructure.ssd")
        spring_values = archive.read("resources/spring.ssv").decode()
        archive.extractall(tmp_path / "system")
    sources = {component.source for component in system.elements}
    assert names == {"SystemStructure.ssd", *sources, *(f"resources/{c.name}.ssv" for c in system.elements)}
    assert spring_values == parameter_values(placed(load_model(HINGE), None)[0])
    values = {p.name: float(p.value) for p in read_ssv(str(ssp), "resources/plant.ssv").parameters}
    # Without it OMSimulator 3 aborts.
    place = ".//{*}Annotation[@type='org.openmodelica']//{*}FixedStepMaster"
    (master,) = ElementTree.fromstring(structure).iterfind(place)
    assert 3000.0 < 1.0 / (values["frequency"] * float(master.attrib["stepSize"])) < 10000.0
    assert (master.attrib["description"], values["mass"]) == ("oms-ma", MASS)
    for name in ("spring", "plant"):
        assert validate_fmu(str(tmp_path / f"system/resources/{name}.fmu")) == []
    described = fmpy.read_model_description(str(tmp_path / "system/resources/plant.fmu")).modelVariables
    assert {v.name: float(v.start) for v in described if v.causality == "parameter"} == values
    registered = ShakenMass(instance_name="plant", resources="").vars
    assert {v.valueReference: (v.name, v.causality) for v in described} == {
        reference: (v.name, v.causality.name) for reference, v in registered.items()
    }
    with pytest.raises(FMICallException, match="fatal"):
        simulate_ssp(str(ssp))  # steps of 10 ms by FMPy's default: 7 in a period
    assert "Steps of 10 ms are too long for forces that are held over them; take 1.187 ms" in capsys.readouterr().err
    Terminal(capsys)("export", str(HINGE), "--ssp", "--mass", str(MASS), "-o", str(tmp_path / "again.ssp"))
    assert (tmp_path / "again.ssp").read_bytes() == ssp.read_bytes()


def run_libcosim(ssp: Path) -> np.ndarray:
    """As `ssp_system.run` in libcosim with its fixed-step algorithm; its times are in nanoseconds."""
    # Imported here, because libcosimpy does not exist for macOS and Python 3.10.
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    execution = CosimExecution.from_ssp_file(str(ssp), round(1e9 * STEP))
    observer = CosimObserver.create_time_series(buffer_size=100_000)
    execution.add_observer(observer)
    observed = []
    for component, name in (("plant", "position"), ("spring", "force")):
        index = execution.slave_index_from_instance_name(component)
        (reference,) = (v.reference for v in execution.slave_variables(index) if v.name.decode() == name)
        observer.start_time_series(index, reference, CosimVariableType.REAL)
        observed.append((index, reference))
    assert execution.simulate_until(round(1e9 * STOP))
    found = [observer.time_series_real_samples(*one, 1, round(STOP / STEP)) for one in observed]
    return np.array([[0.0, *(1e-9 * t for t in found[0][0])], *([0.0, *samples] for _, _, samples in found)])


def own_motion(folder: Path, stop: float, master: Any) -> Motion:
    """Of the same mass by our own master."""
    plant = ShakenMassValues.suited(placed(load_model(HINGE), None)[0], MASS)

    def base(t: float) -> float:
        return plant.amplitude * math.sin(2.0 * math.pi * plant.frequency * t)

    with FmuSpring(build_native_fmu(load_model(HINGE), folder)) as one:
        return simulate(one_mass(MASS, plant.load, base), [one], stop, STEP, master)


def difference(run: np.ndarray, motion: Motion) -> float:
    """Of position and force, in units of their ranges."""
    times, position, force = run
    np.testing.assert_allclose(times, motion.times, rtol=0.0, atol=1e-12)
    pairs = ((position, motion.q[:, 0]), (force[1:], motion.force[1:, 0]))
    return max(float(np.max(np.abs(a - b)) / np.ptp(b)) for a, b in pairs)


def test_fmpy_moves_the_system_as_our_own_master(ssp: Path, tmp_path: Path) -> None:
    # Rounding of 400 steps of the same arithmetic.
    assert difference(ssp_system.run(ssp, STEP, 0.02), own_motion(tmp_path, 0.02, Jacobi())) < 1e-9


@pytest.mark.slow
def test_tools_without_arguments_move_as_our_own_master(ssp: Path, tmp_path: Path) -> None:
    tool("libcosimpy")
    held, exact = (own_motion(tmp_path, STOP, master) for master in (Jacobi(), Iterative()))
    plant = ShakenMassValues.suited(placed(load_model(HINGE), None)[0], MASS)
    # It begins in equilibrium, and swings near resonance.
    base = plant.amplitude * np.sin(2.0 * math.pi * plant.frequency * exact.times)
    assert np.abs(exact.q[:20, 0] - base[:20]).max() < 0.01 * np.ptp(exact.q)
    assert np.ptp(exact.q) > 3.0 * plant.amplitude
    by_fmpy = ssp_system.run(ssp, STEP, STOP)
    # Rounding of 13600 steps of the same arithmetic; measured 4e-15.
    assert max(difference(run, held) for run in (run_libcosim(ssp), by_fmpy)) < 1e-9
    assert difference(by_fmpy, exact) < 1e-2  # what the pages state for held forces: 0.8 % of the range
