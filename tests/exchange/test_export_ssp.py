"""The exported SSP system, run by FMPy and libcosim with its parameter values, against our own master."""

from __future__ import annotations

import math
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd, read_ssv
from fmpy.validation import validate_fmu

from strandspring.cosimulation import FmuSpring, Jacobi, Motion, one_mass, simulate
from strandspring.examples import ssp_system
from strandspring.exchange.shaken_mass_slave import ShakenMass as ShakenMassSlave
from strandspring.exchange.ssp import ShakenMassValues
from strandspring.fmu.description.ssv import parameter_values
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.coordinates import placed
from strandspring.model.modelfile import load_model
from terminal import Terminal

HINGE = Path(__file__).resolve().parents[2] / "models/rubber_hinge.json"
MASS = 0.01
STOP = 0.2
STEP = 5e-5


@pytest.fixture
def ssp(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    path = tmp_path / "system.ssp"
    said = Terminal(capsys)("export", str(HINGE), "--ssp", "--mass", str(MASS), "-o", str(path))
    assert said.endswith(f"SSP system: {path}\n")
    return path


def own(folder: Path) -> tuple[ShakenMassValues, Motion]:
    """The plant's values as the command chooses them, and the motion by `Jacobi()`, which couples as SSP tools do."""
    model = load_model(HINGE)
    plant = ShakenMassValues.suited(placed(model, None)[0].parameters, MASS)

    def base(t: float) -> float:
        return plant.amplitude * math.sin(2.0 * math.pi * plant.frequency * t)

    with FmuSpring(build_native_fmu(model, folder)) as spring:
        return plant, simulate(one_mass(MASS, plant.load, base), [spring], STOP, STEP, Jacobi())


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


@pytest.mark.slow
def test_the_system_moves_as_by_our_own_master(ssp: Path, tmp_path: Path) -> None:
    plant, motion = own(tmp_path)
    assert np.ptp(motion.q) > 3.0 * plant.amplitude  # near resonance
    # Rounding of 4000 steps of the same arithmetic. Measured: 3e-15.
    assert difference(run_libcosim(ssp), motion) < 1e-9
    # FMPy starts with a force of 0, which leaves the load alone on the mass for one step: an error of first order.
    # Measured: 1.04 times.
    kick = plant.load / MASS * STEP / (2.0 * math.pi * plant.frequency)
    assert difference(ssp_system.run(ssp, STEP, STOP), motion) < 1.5 * kick / np.ptp(motion.q)


def test_the_system_holds_what_its_structure_names(ssp: Path) -> None:
    system = read_ssd(str(ssp)).system  # checked by the schema of SSP 1.0
    with zipfile.ZipFile(ssp) as archive:
        names = set(archive.namelist())
        spring_values = archive.read("resources/spring.ssv").decode()
    sources = {component.source for component in system.elements}
    bound = {f"resources/{component.name}.ssv" for component in system.elements}
    assert names == {"SystemStructure.ssd", *sources, *bound}
    assert spring_values == parameter_values(placed(load_model(HINGE), None)[0])
    values = {p.name: float(p.value) for p in read_ssv(str(ssp), "resources/plant.ssv").parameters}
    assert values["mass"] == MASS
    assert set(values) == {"mass", "load", "amplitude", "frequency"}


def test_both_fmus_are_valid_and_the_plant_is_what_its_description_says(ssp: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(ssp) as archive:
        archive.extractall(tmp_path / "system")
    for name in ("spring", "plant"):
        assert validate_fmu(str(tmp_path / f"system/resources/{name}.fmu")) == []
    described = fmpy.read_model_description(str(tmp_path / "system/resources/plant.fmu")).modelVariables
    registered = ShakenMassSlave(instance_name="plant", resources="").vars
    assert {v.valueReference: (v.name, v.causality) for v in described} == {
        reference: (v.name, v.causality.name) for reference, v in registered.items()
    }


def test_the_same_system_has_the_same_bytes(ssp: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Terminal(capsys)("export", str(HINGE), "--ssp", "--mass", str(MASS), "-o", str(tmp_path / "again.ssp"))
    assert (tmp_path / "again.ssp").read_bytes() == ssp.read_bytes()
