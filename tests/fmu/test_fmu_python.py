"""The Python-backed FMU computes what the model computes, and keeps its state to itself."""

from __future__ import annotations

import json
import os
import sys
from dataclasses import replace

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fmu_tools import OTHER, SPRING, Instance, built, check_fmu, instance, run_python, status_of, wandering_path
from strandspring.cosimulation.fmu_spring import CosimulationError, FmuSpring
from strandspring.errors import BuildError
from strandspring.kernel.path import PathSolver

ROUNDING = 1e-12
FATAL = 4  # the one error status of PythonFMU


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fmu")


@pytest.fixture(scope="module")
def fmu(folder):
    return built(folder)


@pytest.fixture
def spring(fmu, folder):
    with instance(fmu, folder / "unpacked") as one:
        yield one


def close(found, expected):
    expected = np.asarray(expected)
    np.testing.assert_allclose(found, expected, rtol=ROUNDING, atol=ROUNDING * np.abs(expected).max())


@pytest.mark.parametrize("parameters", [SPRING, OTHER])
@pytest.mark.parametrize("omega_start", [0.0, -0.6])
def test_outputs_are_those_of_the_model(parameters, omega_start, tmp_path):
    path = wandering_path(parameters, 400, seed=1)
    random = np.random.default_rng(2)
    with instance(built(tmp_path, parameters), tmp_path / "unpacked") as one:
        one.initialize(displacement=path[0], omega_start=omega_start)
        found = [one.get("force", "stiffness", "absorbed_energy", "omega")]
        for displacement in path[1:]:
            for trial in random.normal(displacement, 0.01, random.integers(0, 3)):
                one.set("displacement", trial)
                one.get("force", "absorbed_energy")
            size = 10.0 ** random.uniform(-6, 1)
            found.append(one.step(displacement, "force", "stiffness", "absorbed_energy", "omega", size=size))
    force, stiffness, energy, omega = np.array(found).T
    model = PathSolver(parameters)
    close(force, model.force(path, omega_start))
    close(stiffness, model.stiffness(path, omega_start))
    close(energy, model.absorbed_energy(path, omega_start))
    close(omega, model.omega(path, omega_start))


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    path=st.lists(st.floats(-0.02, 0.08, allow_subnormal=False), min_size=2, max_size=12),
    omega_start=st.floats(-1.0, 1.0, allow_subnormal=False),
)
def test_any_path_gives_the_force_of_the_model(spring, path, omega_start):
    spring.slave.reset()
    spring.initialize(displacement=path[0], omega_start=omega_start)
    found = spring.get("force") + [spring.step(x, "force")[0] for x in path[1:]]
    close(found, PathSolver(SPRING).force(np.array(path), omega_start))


def test_outputs_answer_to_a_trial_without_a_step(spring):
    spring.initialize()
    spring.step(0.03)
    committed = spring.get("force")
    spring.set("displacement", 0.025)
    assert spring.get("force") != committed
    close(spring.get("force"), PathSolver(SPRING).force(np.array([0.02, 0.03, 0.025]))[-1:])
    spring.set("displacement", 0.03)
    assert spring.get("force") == committed


def test_trials_leave_no_bit_behind(fmu, folder):
    path = wandering_path(SPRING, 100, seed=3)
    with (
        instance(fmu, folder / "unpacked", "a") as tried,
        instance(fmu, folder / "unpacked", "b") as plain,
    ):
        tried.initialize()
        plain.initialize()
        for displacement in path:
            for trial in (0.049, -0.01, displacement + 1e-9):
                tried.set("displacement", trial)
                tried.get("force", "stiffness", "omega")
            assert tried.step(displacement, "force", "stiffness", "omega") == plain.step(
                displacement, "force", "stiffness", "omega"
            )


def test_before_initialization_ends_outputs_are_those_of_the_start(spring):
    spring.slave.setupExperiment(startTime=0.0)
    spring.slave.enterInitializationMode()
    for displacement, omega in [(0.02, 0.0), (0.04, 0.5), (0.01, -1.0)]:
        spring.set("displacement", displacement)
        spring.set("omega_start", omega)
        close(spring.get("force"), PathSolver(SPRING).force(np.array([displacement]), omega))
        assert spring.get("omega", "absorbed_energy") == [omega, 0.0]
    spring.set("rho", -1.0)
    assert status_of(spring.get, "force") == FATAL
    assert "`rho` must be > 0" in spring.messages[-1][2]


def test_path_starts_where_initialization_ends(spring):
    spring.slave.setupExperiment(startTime=0.0)
    spring.set("displacement", 0.045)
    spring.slave.enterInitializationMode()
    spring.set("displacement", 0.01)
    spring.slave.exitInitializationMode()
    close(spring.step(0.012, "force"), PathSolver(SPRING).force(np.array([0.01, 0.012]))[-1:])


def test_parameters_can_be_set_before_initialization_ends(spring):
    spring.initialize(rho=100.0, kappa_omega=40.0, **{"kE_1": 2e4})
    assert spring.get("rho", "kE_1") == [100.0, 2e4]
    changed = replace(SPRING, rho=100.0, kappa_omega=40.0, kE=(3.0, 2e4, -2.0e4, 1.0e6))
    path = np.array([0.02, 0.04, 0.03])
    found = spring.get("force") + [spring.step(x, "force")[0] for x in path[1:]]
    close(found, PathSolver(changed).force(path))


def test_size_and_time_of_steps_do_not_matter(fmu, folder):
    forces = []
    for pieces in (1, 2, 1000):
        with instance(fmu, folder / "unpacked") as one:
            one.initialize()
            for target, start in ((0.04, 0.02), (0.01, 0.04)):
                for x in np.linspace(start, target, pieces + 1)[1:]:
                    force = one.step(float(x), "force", size=1.0 / pieces)
            forces.append(force)
    assert forces[0] == forces[1] == forces[2]


def test_a_step_of_no_size_is_a_step(spring):
    spring.initialize()
    spring.step(0.03, size=0.0)
    close(spring.step(0.02, "force"), PathSolver(SPRING).force(np.array([0.02, 0.03, 0.02]))[-1:])


def test_energy_is_the_same_whenever_it_is_read(fmu, folder):
    path = wandering_path(SPRING, 80, seed=4)
    expected = PathSolver(SPRING).absorbed_energy(path)
    with instance(fmu, folder / "unpacked") as late:
        late.initialize(displacement=path[0])
        for displacement in path[1:]:
            late.step(displacement)
        close(late.get("absorbed_energy"), expected[-1:])


def test_an_fmu_unpacked_twice_leaves_the_path_of_python_as_it_was(fmu, tmp_path):
    before = list(sys.path)
    for name in ("a", "with space"):
        with instance(fmu, tmp_path / name) as one:
            assert one.initialize().step(0.03, "force")[0] > 0.0
            one.slave.reset()
            assert sys.path == before


@pytest.mark.parametrize("name", ["Üben", "a#b", "50%25"])
def test_folders_that_the_binary_cannot_read_are_named(fmu, tmp_path, monkeypatch, name):
    """Without that the binary ends the process."""
    (tmp_path / name).mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / name))
    with pytest.raises(BuildError, match=f"cannot read the folder .*{name}.*; set TMPDIR to one named"):
        check_fmu(fmu)
    with pytest.raises(CosimulationError, match="set TMPDIR"):
        FmuSpring(fmu)


LIVES = """
import gc, sys
from pathlib import Path
from fmu_tools import instance
for k in range(int(sys.argv[3])):
    with instance(Path(sys.argv[1]), Path(sys.argv[2])) as one:
        one.initialize()
        one.step(0.03)
    if k % 100 == 0:
        gc.collect()
print(open("/proc/self/statm").read().split()[1])
"""


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="resident memory is read from /proc")
def test_each_life_leaves_as_little_as_is_said(fmu, tmp_path):
    few, many = (int(run_python(LIVES, fmu, tmp_path, count)) for count in (100, 2100))
    assert 4096 * (many - few) / 2000 < 8e3  # bytes; 7 kB are said


def test_different_springs_in_one_process_do_not_meet(tmp_path):
    first, second = built(tmp_path, SPRING, "first"), built(tmp_path, OTHER, "second")
    with instance(first, tmp_path / "1") as one, instance(second, tmp_path / "2") as two:
        check_interleaved(one, two)


def test_springs_of_one_name_in_one_process_do_not_meet(tmp_path):
    stiffer = replace(SPRING, kE=(3.0, 2.2e4, -2.0e4, 1.0e6))
    first, second = built(tmp_path / "a", SPRING), built(tmp_path / "b", stiffer)
    with instance(first, tmp_path / "1") as one, instance(second, tmp_path / "2") as two:
        check_interleaved(one, two, stiffer)


def check_interleaved(one, two, second=OTHER):
    one.initialize()
    two.initialize()
    paths = wandering_path(SPRING, 80, seed=5), wandering_path(second, 80, seed=6)
    found = ([one.get("force")[0]], [two.get("force")[0]])
    for a, b in zip(paths[0][1:], paths[1][1:], strict=True):
        one.set("displacement", a)
        two.set("displacement", b)
        one.slave.doStep(0.0, 1.0)
        two.slave.doStep(0.0, 1.0)
        found[0].append(one.get("force")[0])
        found[1].append(two.get("force")[0])
    close(found[0], PathSolver(SPRING).force(paths[0]))
    close(found[1], PathSolver(second).force(paths[1]))


def test_many_instances_of_one_fmu(fmu, folder):
    before = list(sys.path)
    slaves = [Instance(fmu, folder / "unpacked", f"i{k}") for k in range(12)]
    for k, one in enumerate(slaves):
        one.initialize(displacement=0.01 + 0.001 * k)
    for k, one in enumerate(slaves):
        path = np.array([0.01 + 0.001 * k, 0.03])
        close(one.step(0.03, "force"), PathSolver(SPRING).force(path)[-1:])
        one.slave.freeInstance()
    assert sys.path == before


@pytest.mark.parametrize("energy", [False, True])
def test_a_state_taken_is_a_state_kept(spring, energy):
    names = ["force", "stiffness", "omega", *(["absorbed_energy"] if energy else [])]
    spring.initialize()
    path = wandering_path(SPRING, 80, seed=7)
    for displacement in path[:40]:
        spring.step(displacement, *names)
    spring.set("displacement", 0.033)
    state = spring.slave.getFMUstate()
    runs = []
    for _ in range(3):
        runs.append([spring.get(*names), [spring.step(x, *names) for x in path[40:]]])
        spring.slave.setFMUstate(state)
    assert runs[0] == runs[1] == runs[2]
    spring.slave.freeFMUstate(state)


def test_states_from_before_and_after_initialization(spring):
    spring.slave.setupExperiment(startTime=0.0)
    spring.slave.enterInitializationMode()
    spring.set("kappa_omega", 30.0)
    before = spring.slave.getFMUstate()
    spring.slave.exitInitializationMode()
    after = spring.slave.getFMUstate()
    moved = spring.step(0.03, "force")
    spring.slave.setFMUstate(before)
    spring.set("kappa_omega", 60.0)
    spring.slave.exitInitializationMode()
    assert spring.step(0.03, "force") != moved
    spring.slave.setFMUstate(after)
    assert spring.get("kappa_omega") == [30.0]
    assert spring.step(0.03, "force") == moved


CONTINUE_ELSEWHERE = """
import json, sys
from pathlib import Path
from fmu_tools import instance
job = json.load(open(sys.argv[1]))
with instance(Path(job["fmu"]), Path(job["folder"])) as one:
    one.slave.setFMUstate(one.slave.deSerializeFMUstate(bytes.fromhex(job["state"])))
    names = job["names"]
    print(json.dumps([one.get(*names), [one.step(x, *names) for x in job["path"]]]))
"""


@pytest.mark.parametrize("names", [["force", "omega"], ["force", "stiffness", "absorbed_energy"]])
def test_a_state_goes_on_in_another_process_bit_for_bit(fmu, folder, spring, names, tmp_path):
    spring.initialize(rho=123.4, omega_start=0.1)
    path = wandering_path(SPRING, 160, seed=8).tolist()
    for displacement in path[:80]:
        spring.step(displacement, *names)
    spring.set("displacement", 0.0123)
    state = spring.slave.serializeFMUstate(spring.slave.getFMUstate())
    here = [spring.get(*names), [spring.step(x, *names) for x in path[80:]]]
    job = tmp_path / "job.json"
    job.write_text(
        json.dumps(
            {
                "fmu": str(fmu), "folder": str(folder / "unpacked"), "state": state.hex(), "names": names,
                "path": path[80:],
            }
        )
    )  # fmt: skip
    assert json.loads(run_python(CONTINUE_ELSEWHERE, job)) == here


def test_reset_returns_to_the_start_values(spring):
    spring.initialize(rho=50.0)
    spring.step(0.06, "absorbed_energy")
    spring.slave.reset()
    spring.slave.enterInitializationMode()
    assert spring.get("rho", "displacement") == [SPRING.rho, 0.0]
    spring.slave.reset()
    spring.initialize()
    close(spring.step(0.03, "force"), PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1:])


def test_one_warning_per_excursion(spring):
    spring.initialize()
    for displacement, outside in [
        (0.03, False), (0.051, True), (0.06, True), (0.055, True), (0.04, False), (0.0, True),
        (0.02, False), (0.07, True), (-0.01, True),
    ]:  # fmt: skip
        spring.set("displacement", 0.2)
        assert spring.extrapolating
        spring.step(displacement)
        assert spring.extrapolating is outside
    warnings = spring.logged(1)
    assert [text.split()[1] for text in warnings] == ["0.051", "0.0", "0.07", "-0.01"]
    assert all("[0.001, 0.05] m" in text for text in warnings)


def test_the_ends_of_the_range_are_inside(spring):
    spring.initialize(displacement=SPRING.displacement_max)
    assert not spring.extrapolating
    spring.step(SPRING.displacement_min)
    assert not spring.extrapolating
    assert spring.messages == []


def test_fmpy_simulates_it(fmu):
    time = np.linspace(0.0, 1.0, 201)
    displacement = 0.025 + 0.02 * np.sin(12.0 * time)
    signal = np.array(list(zip(time, displacement, strict=True)), dtype=[("time", float), ("displacement", float)])
    result = fmpy.simulate_fmu(
        str(fmu), stop_time=1.0, output_interval=0.005, input=signal, start_values={"displacement": 0.025},
        output=["displacement", "force", "absorbed_energy"],
    )  # fmt: skip
    assert result["time"][-1] == pytest.approx(1.0)
    close(result["force"], PathSolver(SPRING).force(result["displacement"]))
    close(result["absorbed_energy"], PathSolver(SPRING).absorbed_energy(result["displacement"]))


def test_working_folder_and_locale_do_not_matter(fmu, tmp_path):
    code = """
import os, sys
from pathlib import Path
from fmu_tools import instance
os.chdir("/")
with instance(Path(sys.argv[1]), Path(sys.argv[2])) as one:
    one.initialize()
    print(one.step(0.03, "force")[0].hex())
"""
    environment = {**os.environ, "LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0"}
    found = run_python(code, fmu, tmp_path / "with space", environment=environment)
    close([float.fromhex(found.strip())], PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1:])


def test_check_runs_the_fmu(fmu):
    report = check_fmu(fmu)
    assert report.not_run is None
    assert report.steps > 100
    assert report.force_difference < 1e-10
    assert report.seconds > 0.0
    assert f"{report.steps} steps" in report.summary


def test_check_tells_what_is_wrong(tmp_path):
    broken = tmp_path / "broken.fmu"
    broken.write_bytes(b"no zip")
    with pytest.raises(BuildError, match=r"broken\.fmu must not be used"):
        check_fmu(broken)


def test_check_says_why_it_does_not_run(fmu, monkeypatch):
    monkeypatch.setattr("platform.machine", lambda: "riscv64")
    report = check_fmu(fmu)
    assert "riscv64" in report.not_run
    assert report.steps == 0
    assert "riscv64" in report.summary


def test_valid(fmu):
    assert validate_fmu(str(fmu)) == []


def test_no_package_is_imported_at_run_time(fmu, folder):
    fmpy.extract(str(fmu), unzipdir=str(folder / "alone"))
    code = """
import subprocess, sys
inside = '''
import sys
sys.path.insert(0, sys.argv[1])
name = open(sys.argv[1] + "/slavemodule.txt").read()
module = __import__(name)
one = module.Spring(instance_name="one", resources=sys.argv[1])
one.set_real([0], [0.02])
one.exit_initialization_mode()
one.set_real([0], [0.03])
assert one.do_step(0.0, 1.0)
print(one.get_real([1])[0])
package = name.removesuffix("_slave")
others = {m.split(".")[0] for m in sys.modules} - set(sys.stdlib_module_names) - {package, name, "__main__"}
assert not others, others
'''
print(subprocess.run([sys.executable, "-S", "-I", "-c", inside, sys.argv[1]], check=True,
                     capture_output=True, text=True).stdout)
"""
    force = float(run_python(code, folder / "alone" / "resources"))
    close([force], PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1:])
