"""What `strandspring export` writes: SSP parameter values and systems, and the command, as other programs read them."""

from __future__ import annotations

import math
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
from strandspring.cosimulation import FmuSpring, Jacobi, Motion, one_mass, simulate
from strandspring.examples import ssp_system
from strandspring.exchange.shaken_mass_slave import ShakenMass
from strandspring.exchange.ssp import ShakenMassValues
from strandspring.fmu.description.ssv import parameter_values
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.coordinates import placed
from strandspring.model.modelfile import ModelFile, load_model
from terminal import Terminal

pytestmark = pytest.mark.long
HINGE = ROOT / "models" / "rubber_hinge.json"
RECORD = "StrandSpring/Records/mount.mo"


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
