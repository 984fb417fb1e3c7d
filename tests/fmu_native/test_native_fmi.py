"""The native FMU computes what the model computes, step by step, and keeps its state to itself."""

from __future__ import annotations

import json
from ctypes import byref, c_double

import numpy as np
import pytest

from fmu_tools import OTHER, SPRING, run_python, wandering_path
from native_tools import OK, WARNING, Native, close, library
from strandspring import SpringParameters
from strandspring.kernel.path import PathSolver

OUTPUTS = ("force", "stiffness", "absorbed_energy", "omega")


@pytest.fixture
def spring():
    with Native() as one:
        yield one


def model_outputs(parameters: SpringParameters, path: np.ndarray, omega_start: float = 0.0) -> np.ndarray:
    """The rows of OUTPUTS along a path."""
    model = PathSolver(parameters)
    return np.array([f(path, omega_start) for f in (model.force, model.stiffness, model.absorbed_energy, model.omega)])


def close_each(found: np.ndarray, expected: np.ndarray) -> None:
    for one, other in zip(found, expected, strict=True):
        close(one, other)


@pytest.mark.parametrize("parameters", [SPRING, OTHER])
@pytest.mark.parametrize("omega_start", [0.0, -0.6])
def test_outputs_are_those_of_the_model(parameters, omega_start):
    path = wandering_path(parameters, 400, seed=1)
    random = np.random.default_rng(2)
    with Native(library(parameters)) as one:
        one.initialize(displacement=path[0], omega_start=omega_start)
        found = [one.get(*OUTPUTS)]
        for displacement in path[1:]:
            for trial in random.normal(displacement, 0.01, random.integers(0, 3)):
                one.set(displacement=trial)
                one.get("force", "absorbed_energy")
            found.append(one.step(displacement, *OUTPUTS, size=10.0 ** random.uniform(-6, 1)))
    close_each(np.array(found).T, model_outputs(parameters, path, omega_start))


def test_outputs_answer_to_a_trial_without_a_step_and_trials_leave_no_trace(spring):
    spring.initialize()
    committed = spring.step(0.03, *OUTPUTS)
    before = spring.serialized()
    for trial in (0.035, -0.2, 0.0):
        spring.set(displacement=trial)
        close(spring.get(*OUTPUTS), model_outputs(SPRING, np.array([0.02, 0.03, trial]))[:, -1])
    spring.set(displacement=0.03)
    assert spring.get(*OUTPUTS) == committed
    assert spring.serialized() == before


def test_size_and_time_of_steps_do_not_matter():
    forces = []
    for pieces in (1, 2, 1000):
        with Native() as one:
            one.initialize()
            for target, start in ((0.04, 0.02), (0.01, 0.04)):
                for x in np.linspace(start, target, pieces + 1)[1:]:
                    force = one.step(float(x), "force", size=1.0 / pieces, time=-3.0)
            forces.append(force)
    assert forces[0] == forces[1] == forces[2]


def test_a_step_of_no_size_is_a_step(spring):
    spring.initialize()
    spring.step(0.03, size=0.0)
    close(spring.step(0.02, "force"), PathSolver(SPRING).force(np.array([0.02, 0.03, 0.02]))[-1:])


def test_energy_is_the_same_whenever_it_is_read(spring):
    path = wandering_path(SPRING, 80, seed=4)
    spring.initialize(displacement=path[0])
    for displacement in path[1:]:
        spring.step(displacement)
    close(spring.get("absorbed_energy"), PathSolver(SPRING).absorbed_energy(path)[-1:])


def test_parameters_can_be_set_before_initialization_ends(spring):
    changed = SpringParameters(
        (0.0, 1.0e4, 0.0, 0.0), (1.0, 0.0, 0.0), 30.0, 200.0, 0.9, 0.7, 0.01, -0.02, 0.04
    )  # fmt: skip
    values = {f"kE_{i}": c for i, c in enumerate(changed.kE)} | {f"kA_{i}": c for i, c in enumerate(changed.kA)}
    spring.set(**values)
    spring.enter_initialization()
    names = ("kappa_omega", "rho", "sigma", "n", "displacement_offset", "displacement_min", "displacement_max")
    spring.set(**{name: getattr(changed, name) for name in names}, displacement=0.01)
    # Outputs already answer to them.
    close(spring.get("force"), [0.0])
    assert spring.ExitInitializationMode() == OK
    path = wandering_path(changed, 80, seed=3)
    close([spring.step(x, "force")[0] for x in path], PathSolver(changed).force(np.insert(path, 0, 0.01))[1:])


def test_the_start_of_the_path_follows_the_displacement_until_initialization_ends(spring):
    spring.enter_initialization()
    for start in (0.01, 0.045):
        spring.set(displacement=start, omega_start=0.4)
        close(spring.get(*OUTPUTS), model_outputs(SPRING, np.array([start]), 0.4)[:, 0])
    assert spring.ExitInitializationMode() == OK
    path = np.array([0.045, 0.02])
    close(spring.step(0.02, *OUTPUTS), model_outputs(SPRING, path, 0.4)[:, -1])


@pytest.mark.parametrize("energy", [False, True])
def test_a_state_taken_is_a_state_kept(spring, energy):
    names = ["force", "stiffness", "omega", *(["absorbed_energy"] if energy else [])]
    spring.initialize()
    path = wandering_path(SPRING, 80, seed=7)
    for displacement in path[:40]:
        spring.step(displacement, *names)
    spring.set(displacement=0.033)
    spring.set_derivatives(0.4, -3.0)
    state = spring.snapshot()
    runs = []
    for _ in range(3):
        first = spring.get(*names)
        spring.DoStep(c_double(0.0), c_double(0.5), 1)
        runs.append([first, spring.get(*names), [spring.step(x, *names) for x in path[40:]]])
        assert spring.SetFMUstate(state) == OK
    assert runs[0] == runs[1] == runs[2]
    assert spring.FreeFMUstate(byref(state)) == OK
    assert state.value is None


def test_states_from_before_and_after_initialization(spring):
    spring.enter_initialization()
    spring.set(kappa_omega=30.0)
    before = spring.snapshot()
    spring.ExitInitializationMode()
    after = spring.snapshot()
    moved = spring.step(0.03, "force")
    assert spring.SetFMUstate(before) == OK
    assert spring.set(kappa_omega=60.0) == OK
    assert spring.ExitInitializationMode() == OK
    assert spring.step(0.03, "force") != moved
    assert spring.SetFMUstate(after) == OK
    assert spring.get("kappa_omega") == [30.0]
    assert spring.step(0.03, "force") == moved
    for state in (before, after):
        assert spring.FreeFMUstate(byref(state)) == OK


CONTINUE_ELSEWHERE = """
import json, sys
from pathlib import Path
from native_tools import OK, Library, Native
job = json.load(open(sys.argv[1]))
with Native(Library(Path(job["folder"]))) as one:
    assert one.restore(bytes.fromhex(job["state"])) == OK
    names = job["names"]
    print(json.dumps([one.get(*names, "rho"), [one.step(x, *names) for x in job["path"]]]))
"""


@pytest.mark.parametrize("names", [["force", "omega"], ["force", "stiffness", "absorbed_energy"]])
def test_a_state_goes_on_in_another_process_bit_for_bit(spring, names, tmp_path):
    spring.initialize(rho=123.4, omega_start=0.1)
    path = wandering_path(SPRING, 160, seed=8).tolist()
    for displacement in path[:80]:
        spring.step(displacement, *names)
    spring.set(displacement=0.0123)
    state = spring.serialized()
    here = [spring.get(*names, "rho"), [spring.step(x, *names) for x in path[80:]]]
    job = tmp_path / "job.json"
    content = {"folder": str(spring.library.folder), "state": state.hex(), "names": names, "path": path[80:]}
    job.write_text(json.dumps(content))
    assert json.loads(run_python(CONTINUE_ELSEWHERE, job)) == here


def test_a_state_can_be_taken_into_memory_given_before(spring):
    spring.initialize()
    state = spring.snapshot()
    address = state.value
    force = spring.step(0.03, "force")
    assert spring.GetFMUstate(byref(state)) == OK
    assert state.value == address
    spring.step(0.01)
    assert spring.SetFMUstate(state) == OK
    assert spring.get("force") == force
    assert spring.FreeFMUstate(byref(state)) == OK


def test_reset_returns_to_the_start_values(spring):
    with Native() as fresh:
        expected = fresh.serialized()
    spring.initialize(rho=50.0)
    spring.set_derivatives(1.0)
    spring.step(0.06, "absorbed_energy")
    assert spring.Terminate() == OK
    assert spring.Reset() == OK
    assert spring.serialized() == expected
    spring.initialize()
    close(spring.step(0.03, "force"), PathSolver(SPRING).force(np.array([0.02, 0.03]))[-1:])


def test_one_warning_per_excursion(spring):
    spring.initialize()
    for displacement, outside in [
        (0.03, False), (0.051, True), (0.06, True), (0.055, True), (0.04, False), (0.0, True),
        (0.02, False), (0.07, True), (-0.01, True),
    ]:  # fmt: skip
        spring.set(displacement=0.2)
        assert spring.extrapolating
        spring.step(displacement)
        assert spring.extrapolating is outside
    assert {(status, category) for status, category, _ in spring.messages} == {(WARNING, "logStatusWarning")}
    assert [text.split()[1] for _, _, text in spring.messages] == ["0.051", "0.0", "0.07", "-0.01"]
    assert all("[0.001, 0.05] m" in text for _, _, text in spring.messages)


def test_absurd_displacements_do_no_harm(spring):
    spring.initialize()
    for displacement in (1e9, -1e9, 1e6, 0.03):
        spring.step(displacement, *OUTPUTS)
        spring.derivatives(["force", "stiffness"], displacement=1.0, rho=1.0)
    assert spring.restore(spring.serialized()) == OK
    assert np.isfinite(spring.get("force")[0])


def test_two_springs_in_one_process_do_not_meet():
    with Native() as one, Native(library(OTHER)) as two:
        one.initialize()
        two.initialize()
        paths = wandering_path(SPRING, 80, seed=5), wandering_path(OTHER, 80, seed=6)
        found = []
        for a, b in zip(*paths, strict=True):
            one.set(displacement=a)
            two.set(displacement=b)
            for spring in (one, two):
                spring.DoStep(c_double(0.0), c_double(1.0), 1)
            found.append([*one.get("force"), *two.get("force")])
    close_each(
        np.array(found).T, np.array([PathSolver(p).force(x) for p, x in zip((SPRING, OTHER), paths, strict=True)])
    )
