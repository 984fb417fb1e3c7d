"""FMUs of FMI 3.0 run by FMPy: co-simulation and model exchange against FMI 2.0, equal to the bit."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from fmu_tools import OTHER, SPRING, check_fmu, wandering_path
from portable_host import environment
from springs import TABLE
from strandspring import Spring, build_fmu, verify
from strandspring.core.parameters import SpringParameters
from strandspring.core.variables import start_values
from strandspring.fmu.checks.check import running
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms, host_folder
from strandspring.model.modelfile import ModelFile, save_model
from terminal import Terminal

STEP = 1e-3
OUTPUTS = ["force", "stiffness", "absorbed_energy"]
SPRINGS = {"polynomial": SPRING, "table": TABLE, "other": OTHER}


def built(folder: Path, spring: SpringParameters = SPRING, fmi: int = 3, **form: bool) -> Path:
    return build_native_fmu(ModelFile("spring", spring), folder, chosen_platforms("host"), zero=0.0, fmi=fmi, **form)


@pytest.fixture(scope="module", params=SPRINGS)
def pair(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[SpringParameters, Any]:
    """A spring and its FMUs by version of FMI."""
    spring, folder = SPRINGS[request.param], tmp_path_factory.mktemp("run")
    return spring, {fmi: built(folder, spring, fmi) for fmi in (2, 3)}


def simulated(fmu: Path, displacement: np.ndarray, **options: Any) -> np.ndarray:
    """What FMPy makes of a path that is straight between steps."""
    times = STEP * np.arange(len(displacement))
    signal = np.array(list(zip(times, displacement, strict=True)), dtype=[("time", float), ("displacement", float)])
    start = {"displacement": displacement[0], **options.pop("start_values", {})}
    result = fmpy.simulate_fmu(
        str(fmu), stop_time=times[-1], output_interval=STEP, input=signal, output=OUTPUTS, start_values=start, **options
    )  # fmt: skip
    return np.array([result[name] for name in ("time", *OUTPUTS)])


@pytest.mark.parametrize(
    "interface",
    [
        {"fmi_type": "CoSimulation"},
        {"fmi_type": "ModelExchange", "solver": "CVode"},
        {"fmi_type": "ModelExchange", "solver": "Euler"},
    ],
    ids=lambda interface: "-".join(interface.values()),
)
def test_fmpy_gets_the_bits_of_fmi_2(pair: tuple[SpringParameters, Any], interface: dict[str, str]) -> None:
    spring, fmus = pair
    path = wandering_path(spring, 400, seed=7)
    before, after = (simulated(fmus[fmi], path, **interface) for fmi in (2, 3))
    np.testing.assert_array_equal(after, before)
    assert np.ptp(after[1]) > 0.0


@pytest.mark.parametrize("solver", ["CVode", "Euler"])
def test_model_exchange_on_an_oscillating_input(pair: tuple[SpringParameters, Any], solver: str) -> None:
    spring, fmus = pair
    middle = 0.5 * (spring.displacement_min + spring.displacement_max)
    reach = 0.6 * (spring.displacement_max - spring.displacement_min)
    path = middle + reach * np.sin(2.0 * np.pi * 7.3 * STEP * np.arange(500))
    before, after = (
        simulated(fmus[fmi], path, fmi_type="ModelExchange", solver=solver, relative_tolerance=1e-6) for fmi in (2, 3)
    )
    np.testing.assert_array_equal(after, before)


def test_arrays_are_parameters(tmp_path: Path) -> None:
    other = replace(SPRING, kE=(1.0, 2e4, -1e4, 2e6), kA=(1.0, 4.0, 10.0), rho=200.0)
    path = wandering_path(SPRING, 200, seed=3)
    changed = {"kE": np.array(other.kE), "kA": np.array(other.kA), "rho": other.rho}
    found = simulated(built(tmp_path / "one", arrays=True), path, start_values=changed)
    expected = simulated(built(tmp_path / "two", other, fmi=2), path)
    np.testing.assert_array_equal(found, expected)
    singly = start_values(other)
    np.testing.assert_array_equal(simulated(built(tmp_path / "three"), path, start_values=singly), expected)


def test_states_form_has_the_bits_of_fmi_2(tmp_path: Path) -> None:
    found = []
    for fmi in (2, 3):
        fmu = built(tmp_path, fmi=fmi, with_states=True)
        names = {v.name: v.valueReference for v in fmpy.read_model_description(str(fmu)).modelVariables}
        with running(fmu, model_exchange=True) as model:
            model.setupExperiment(startTime=0.0)
            model.enterInitializationMode()
            model.setReal([names["displacement"], names["velocity"], names["omega"]], [0.01, 0.5, 0.3])
            model.exitInitializationMode()
            rates = np.zeros(2)
            model.getDerivatives(np.ctypeslib.as_ctypes(rates), 2)
            found.append([*model.getReal([names[name] for name in OUTPUTS]), *rates])
    assert found[0] == found[1]
    assert all(found[0][:2])


@pytest.mark.parametrize("length", [0, 1, 3, 5, 200])
def test_arrays_of_another_length_are_refused(length: int, tmp_path: Path) -> None:
    with running(built(tmp_path, arrays=True)) as slave:
        reference = 14  # kE
        slave.enterInitializationMode()
        assert slave.getFloat64([reference], 4) == list(SPRING.kE)
        with pytest.raises(FMICallException):
            slave.setFloat64([reference], [1.0] * length)
        with pytest.raises(FMICallException):
            slave.getFloat64([reference], length)
        # Nothing was changed.
        assert slave.getFloat64([reference], 4) == list(SPRING.kE)
        assert slave.getFloat64([reference, 8, 15], 8) == [*SPRING.kE, SPRING.rho, *SPRING.kA]


@pytest.mark.parametrize("with_states", [False, True])
def test_it_is_checked_and_verified(with_states: bool, tmp_path: Path) -> None:
    fmu = built(tmp_path, with_states=with_states)
    report = check_fmu(fmu)
    assert report.interfaces == (("model exchange",) if with_states else ("co-simulation", "model exchange"))
    assert report.force_difference < 1e-9
    assert verify(fmu).ok


def test_an_fmu_that_answers_otherwise_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from strandspring.fmu.native import native_fmu

    fill = native_fmu.filled
    wrong = ModelFile("spring", replace(SPRING, rho=1.01 * SPRING.rho))
    monkeypatch.setattr(native_fmu, "filled", lambda image, _model, *rest: fill(image, wrong, *rest))
    for states in (False, True):
        with pytest.raises(Exception, match="was not written, because the FMU failed its check"):
            build_fmu(Spring(SPRING, "spring"), tmp_path / "dist", fmi=3, states=states)
    assert not (tmp_path / "dist").exists()


def test_the_command_builds_the_bytes_of_the_function(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    terminal = Terminal(capsys)
    save_model(Path("spring.json"), ModelFile("spring", SPRING))
    options = ["--fmi", "3", "--states", "--author", "A", "--zero", "20", "--platform", "host", "--json"]
    fmus = json.loads(terminal("build", "spring.json", "-o", "command", *options))["fmus"]
    assert [(Path(one["path"]).name, one["backend"], one["fmi"], list(one["binaries"])) for one in fmus] == [
        ("spring_fmi3.fmu", "native", 3, [host_folder(3)]), ("spring_fmi3_states.fmu", "states", 3, [host_folder(3)]),
    ]  # fmt: skip
    assert all("valid; 401 steps" in one["check"] for one in fmus)
    for one, states in zip(fmus, (False, True), strict=True):
        path = Path(one["path"])
        made = build_fmu(
            Spring.load("spring.json"), "python", fmi=3, states=states, author="A", zero=0.02, platforms="host"
        )
        assert made.name == path.name
        assert made.read_bytes() == path.read_bytes()
        # From the FMU, with its settings.
        assert build_fmu(path, "again", platforms="host").read_bytes() == path.read_bytes()
    assert "FMI 3.0" in terminal("build", "spring.json", "--fmi", "3", "--platform", "host")
    assert build_fmu("dist/spring_fmi3.fmu", "two", fmi=2, platforms="host").name == "spring.fmu"


@pytest.mark.parametrize("fmi", [2, 3])
def test_without_energy_the_rest_is_compared(fmi: int, tmp_path: Path) -> None:
    spring = Spring(SPRING, "spring")
    fmu = build_fmu(spring, tmp_path, fmi=fmi, real_time=True, no_energy=True, platforms="host")
    assert verify(fmu).ok
    assert build_fmu(fmu, tmp_path / "again", platforms="host").read_bytes() == fmu.read_bytes()


@pytest.mark.slow
def test_fmpy_compiles_it_from_its_own_sources(tmp_path: Path) -> None:
    fmu = build_native_fmu(ModelFile("spring", SPRING), tmp_path, (), zero=0.0, fmi=3)
    assert "no binary" in str(check_fmu(fmu).not_run)
    subprocess.run(
        [sys.executable, "-m", "fmpy", "compile", "--all-warnings", str(fmu)],
        cwd=tmp_path, env=environment(), check=True, capture_output=True, timeout=300,
    )  # fmt: skip
    assert check_fmu(fmu).not_run is None
    path = wandering_path(SPRING, 300, seed=5)
    np.testing.assert_array_equal(simulated(fmu, path), simulated(built(tmp_path / "native"), path))
