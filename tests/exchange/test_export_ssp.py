"""The exported SSP system as it is, run by FMPy, Ecos and libcosim, against our own masters."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssd, read_ssv
from fmpy.validation import validate_fmu

from strandspring.cosimulation import FmuSpring, Iterative, Jacobi, Master, Motion, one_mass, simulate
from strandspring.examples import ssp_system
from strandspring.exchange.shaken_mass_slave import ShakenMass as ShakenMassSlave
from strandspring.exchange.ssp import ShakenMassValues
from strandspring.fmu.description.ssv import parameter_values
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.coordinates import placed
from strandspring.model.modelfile import load_model
from terminal import Terminal
from tools import tool

HINGE = Path(__file__).resolve().parents[2] / "models/rubber_hinge.json"
MASS = 0.01
STOP = 0.68  # 10 periods
STEP = 5e-5


@pytest.fixture
def ssp(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    path = tmp_path / "system.ssp"
    said = Terminal(capsys)("export", str(HINGE), "--ssp", "--mass", str(MASS), "-o", str(path))
    assert said.endswith(f"SSP system: {path}\n")
    return path


def own(folder: Path, master: Master) -> tuple[ShakenMassValues, Motion]:
    """The plant's values as the command chooses them, and the motion."""
    model = load_model(HINGE)
    plant = ShakenMassValues.suited(placed(model, None)[0], MASS)

    def base(t: float) -> float:
        return plant.amplitude * math.sin(2.0 * math.pi * plant.frequency * t)

    with FmuSpring(build_native_fmu(model, folder)) as spring:
        return plant, simulate(one_mass(MASS, plant.load, base), [spring], STOP, STEP, master)


def run_libcosim(ssp: Path) -> np.ndarray:
    """As `ssp_system.run` in libcosim with its fixed-step algorithm; its times are in nanoseconds."""
    # Imported here, because libcosimpy does not exist for macOS and Python 3.10.
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.WARNING)
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
    columns = []
    for index, reference in observed:
        times, _, samples = observer.time_series_real_samples(index, reference, 1, round(STOP / STEP))
        columns.append([0.0, *samples])
    return np.array([[0.0, *(1e-9 * t for t in times)], *columns])


def difference(run: np.ndarray, motion: Motion) -> float:
    """Largest difference of position and force in units of their ranges."""
    times, position, force = run
    np.testing.assert_allclose(times, motion.times, rtol=0.0, atol=1e-12)
    pairs = ((position, motion.q[:, 0]), (force[1:], motion.force[1:, 0]))
    return max(float(np.max(np.abs(one - other)) / np.ptp(other)) for one, other in pairs)


def run_ecos(ssp: Path) -> np.ndarray:
    """The same in Ecos, which reads the force of a displacement that it has handed on, so that plant.force is asked."""
    from ecospy import EcosSimulation

    simulation = EcosSimulation(STEP, str(ssp))
    simulation.init()
    rows = [[0.0, 0.0, 0.0]]
    for k in range(round(STOP / STEP)):
        simulation.step()
        rows.append([(k + 1) * STEP, *map(simulation.get_real, ("plant::position", "plant::force"))])
    return np.array(rows).T


@pytest.mark.slow
def test_tools_without_arguments_move_as_our_own_master(ssp: Path, tmp_path: Path) -> None:
    tool("libcosimpy")
    tool("ecospy")
    plant, motion = own(tmp_path, Jacobi())
    # The case: 1.05 mm, against 9.97 and 12.4 mm with the start values that the plant had.
    _, exact = own(tmp_path, Iterative())
    times = exact.times
    excursion = exact.q[:, 0] - plant.amplitude * np.sin(2.0 * np.pi * plant.frequency * times)
    assert 1e3 * np.abs(excursion).max() == pytest.approx(1.052, abs=1e-3)
    assert np.ptp(motion.q) > 3.0 * plant.amplitude  # near resonance
    # Rounding of 13600 steps of the same arithmetic, within the 1e-3 that the issue asks for. Measured: 4e-15.
    for run in (run_libcosim(ssp), run_ecos(ssp), ssp_system.run(ssp, STEP, STOP)):
        assert difference(run, motion) < 1e-9
    # The error of held forces that the pages state for this step: 0.8 % of the range.
    assert difference(ssp_system.run(ssp, STEP, STOP), exact) < 1e-2


def test_steps_that_are_too_long_are_refused(ssp: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(FMICallException, match="fatal"):
        simulate_ssp(str(ssp))  # steps of 10 ms by FMPy's default: 7 in a period
    assert "Steps of 10 ms are too long for forces that are held over them; take 1.187 ms" in capsys.readouterr().err


def test_the_system_holds_what_its_structure_names(ssp: Path) -> None:
    system = read_ssd(str(ssp)).system  # checked by the schema of SSP 1.0
    with zipfile.ZipFile(ssp) as archive:
        names = set(archive.namelist())
        structure = archive.read("SystemStructure.ssd")
        spring_values = archive.read("resources/spring.ssv").decode()
    sources = {component.source for component in system.elements}
    bound = {f"resources/{component.name}.ssv" for component in system.elements}
    assert names == {"SystemStructure.ssd", *sources, *bound}
    assert spring_values == parameter_values(placed(load_model(HINGE), None)[0])
    values = {p.name: float(p.value) for p in read_ssv(str(ssp), "resources/plant.ssv").parameters}
    # Without it OMSimulator 3 aborts.
    (master,) = ElementTree.fromstring(structure).iterfind(
        ".//{*}Annotation[@type='org.openmodelica']//{*}FixedStepMaster"
    )
    assert 3000.0 < 1.0 / (values["frequency"] * float(master.attrib["stepSize"])) < 10000.0
    assert master.attrib["description"] == "oms-ma"
    assert values["mass"] == MASS
    assert set(values) == {"mass", "load", "amplitude", "frequency"}


def test_both_fmus_are_valid_and_the_plant_is_what_its_description_says(ssp: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(ssp) as archive:
        archive.extractall(tmp_path / "system")
    for name in ("spring", "plant"):
        assert validate_fmu(str(tmp_path / f"system/resources/{name}.fmu")) == []
    described = fmpy.read_model_description(str(tmp_path / "system/resources/plant.fmu")).modelVariables
    bound = {p.name: float(p.value) for p in read_ssv(str(ssp), "resources/plant.ssv").parameters}
    assert {v.name: float(v.start) for v in described if v.causality == "parameter"} == bound
    registered = ShakenMassSlave(instance_name="plant", resources="").vars
    assert {v.valueReference: (v.name, v.causality) for v in described} == {
        reference: (v.name, v.causality.name) for reference, v in registered.items()
    }


def test_the_same_system_has_the_same_bytes(ssp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Terminal(capsys)("export", str(HINGE), "--ssp", "--mass", str(MASS), "-o", str(tmp_path / "again.ssp"))
    assert (tmp_path / "again.ssp").read_bytes() == ssp.read_bytes()
