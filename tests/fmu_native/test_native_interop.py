"""The native FMU in other programs: fmpy's solver, a host without Python, CMake, and Windows by wine.

What other tools make of both back ends is in tests/interop.

The macOS binary cannot be run here; test_native_build.py looks into it.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import fmpy
import numpy as np
import pytest

from fmu_tools import SPRING, check_fmu, wandering_path
from portable_host import compiled_host, environment, responses, run, unpacked, windows_host, wine
from strandspring import Spring
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import host_folder
from strandspring.model.modelfile import ModelFile

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


def test_fmpy_simulates_model_exchange(native_fmu: Path, path: np.ndarray) -> None:
    result = fmpy.simulate_fmu(
        str(native_fmu), fmi_type="ModelExchange", solver="CVode", stop_time=STEP * (len(path) - 1),
        output_interval=STEP, input=input_of(path), output=["force"], start_values={"displacement": path[0]},
        record_events=False,
    )  # fmt: skip
    assert_force(result["force"], path)


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
