"""The native FMU in other programs: fmpy, libcosimpy, ecospy, a host without Python, CMake, and Windows by wine.

The macOS binary cannot be run here; test_native_build.py looks into it.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest

from fmu_tools import SPRING, run_python, wandering_path
from portable_host import compiled_host, environment, responses, run, unpacked, windows_host, wine
from strandspring import Spring
from strandspring.fmu.check import check_fmu
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import host_folder
from strandspring.modelfile import ModelFile

STEP = 1e-3
# The same closed form in C and in Python, stroke by stroke: rounding of the mathematics libraries.
RTOL = 1e-12


@pytest.fixture(scope="module")
def path() -> np.ndarray:
    """Displacements with reversals, standstills and excursions out of the range."""
    return wandering_path(SPRING, 500, seed=4)


def assert_force(found: np.ndarray, path: np.ndarray) -> None:
    expected = Spring(SPRING).response(path)
    assert len(found) == len(expected)
    assert np.max(np.abs(found - expected)) <= RTOL * np.max(np.abs(expected))


def input_of(path: np.ndarray) -> np.ndarray:
    """The path as FMPy takes it: straight lines between steps."""
    times = STEP * np.arange(len(path))
    return np.array(list(zip(times, path, strict=True)), dtype=[("time", float), ("displacement", float)])


def test_fmpy_simulates_co_simulation(native_fmu: Path, path: np.ndarray) -> None:
    # FMPy sets the input of time t before the step from t, and samples before it.
    result = fmpy.simulate_fmu(
        str(native_fmu), fmi_type="CoSimulation", stop_time=STEP * (len(path) - 1), output_interval=STEP,
        input=input_of(path), output=["displacement", "force"], start_values={"displacement": path[0]},
    )  # fmt: skip
    assert len(result) == len(path)
    assert_force(result["force"][1:], path[:-1])


def test_fmpy_simulates_model_exchange(native_fmu: Path, path: np.ndarray) -> None:
    result = fmpy.simulate_fmu(
        str(native_fmu), fmi_type="ModelExchange", solver="CVode", stop_time=STEP * (len(path) - 1),
        output_interval=STEP, input=input_of(path), output=["force"], start_values={"displacement": path[0]},
        record_events=False,
    )  # fmt: skip
    assert_force(result["force"], path)


def printed(said: str) -> np.ndarray:
    """The forces among what a program printed; libraries print, too."""
    return np.array([float.fromhex(force) for force in re.findall(r"^force (\S+)$", said, flags=re.MULTILINE)])


COSIM = """
import sys
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

fmu, step, *path = sys.argv[1:]
path = [float.fromhex(x) for x in path]
execution = CosimExecution.from_step_size(step_size=float(step) * 1e9)  # ns
index = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=fmu, instance_name="spring"))
reference = {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=index)}
assert execution.real_initial_value(index, reference["displacement"], path[0])
manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
assert execution.add_manipulator(manipulator=manipulator)
assert execution.add_observer(observer=observer)
for displacement in path:
    assert manipulator.slave_real_values(index, [reference["displacement"]], [displacement])
    assert execution.step()
    print("force", observer.last_real_values(index, [reference["force"]])[0].hex())
"""


def test_libcosim_runs_it(native_fmu: Path, path: np.ndarray) -> None:
    said = run_python(COSIM, native_fmu, STEP, *(x.hex() for x in path.tolist()))
    assert_force(printed(said), path)


ECOS = """
import sys
from ecospy import EcosSimulation, EcosSimulationStructure

fmu, step, *path = sys.argv[1:]
path = [float.fromhex(x) for x in path]
with EcosSimulationStructure() as structure:
    structure.add_model("spring", fmu)
    with EcosSimulation(structure=structure, step_size=float(step)) as simulation:
        simulation.init()
        for displacement in path:
            simulation.set_real("spring::displacement", displacement)
            simulation.step()
            print("force", simulation.get_real("spring::force").hex())
"""


def test_ecos_runs_it(native_fmu: Path, path: np.ndarray) -> None:
    # Ecos initializes before the host can set a value, so the path begins at the start value, 0.
    from_zero = np.concatenate([[0.0], path])
    said = run_python(ECOS, native_fmu, STEP, *(x.hex() for x in from_zero.tolist()))
    assert_force(printed(said), from_zero)


def assert_host(host: list[str], libraries: list[Path], fmu: Path, path: np.ndarray, **options: object) -> None:
    """Each library, loaded beside the other by a program without Python, gives the force of the model."""
    for values in np.moveaxis(responses(host, fmu, libraries, path, **options), 1, 0):
        assert_force(values[:, 0], path)


def test_a_host_without_python_runs_it(native_fmu: Path, path: np.ndarray, tmp_path: Path) -> None:
    host = compiled_host(tmp_path)
    libraries = [unpacked(native_fmu, str(host_folder()), tmp_path / name) for name in ("one", "two")]
    assert_host(host, libraries, native_fmu, path)
    # The binary belongs to its description.
    refused = subprocess.run([*host, "{another}", "", str(libraries[0])], capture_output=True, text=True, check=False)
    assert refused.returncode == 1
    assert "fmi2Instantiate failed" in refused.stderr


@pytest.mark.slow
def test_fmpy_compiles_it_from_its_own_sources(tmp_path: Path) -> None:
    fmu = build_native_fmu(ModelFile("spring", SPRING), tmp_path, ())
    assert "no binary" in str(check_fmu(fmu).not_run)
    run(
        [sys.executable, "-m", "fmpy", "compile", "--all-warnings", "--warning-as-error", str(fmu)],
        cwd=tmp_path, env=environment(),
    )  # fmt: skip
    report = check_fmu(fmu)
    assert report.not_run is None
    assert report.problems == ()


@pytest.mark.slow
def test_wine_runs_the_windows_binary(native_fmu: Path, path: np.ndarray, tmp_path: Path) -> None:
    program = wine()
    if program is None:
        pytest.skip("wine is not installed: the Windows binary was looked into (test_native_build.py) but not run")
    host, settings = windows_host(tmp_path, program)
    # Both copies want the same address, so one of them is moved.
    libraries = [unpacked(native_fmu, "win64", tmp_path / name) for name in ("one", "two")]
    assert_host(host, libraries, native_fmu, path, env=settings)
