"""The parameter `input_resolution` of FMUs: friction follows no reversals below a sensor's digit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from test_branched_fmu import Run, begun

from branched_springs import BRANCHED, uneven_motion
from springs import EXAMPLES
from strandspring import Spring, SpringParameters
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.kernel.arrays import address
from strandspring.kernel.branches import maxwell_sums
from strandspring.kernel.library import library
from strandspring.kernel.path import PathSolver
from strandspring.model.modelfile import ModelFile

SPRINGS = {"plain": EXAMPLES["stranded_wire"], "table": EXAMPLES["table"], "both": BRANCHED["both"]}
FORMS: dict[str, dict[str, Any]] = {
    "fmi2": {"fmi": 2},
    "fmi3": {"fmi": 3},
    "arrays": {"fmi": 3, "arrays": True},
    "real-time": {"fmi": 2, "real_time": True},
    "no-energy": {"fmi": 3, "real_time": True, "no_energy": True},
}


@dataclass(frozen=True)
class Case:
    """A spring as an FMU, and motion over its range with reversals below and above a resolution."""

    fmu: Path
    parameters: SpringParameters
    has_energy: bool

    @property
    def resolution(self) -> float:
        return 0.02 * (self.parameters.displacement_max - self.parameters.displacement_min)

    def motion(self, samples: int = 400) -> tuple[np.ndarray, np.ndarray]:
        time, noise = uneven_motion(samples, seed=3)
        low, high = self.parameters.displacement_min, self.parameters.displacement_max
        share = 0.5 + 0.4 * np.sin(np.linspace(0.0, 9.0, samples))
        spread = np.geomspace(1.0, 200.0, samples) * 1e-3 * (noise - noise.mean()) / np.ptp(noise)
        return time, low + (high - low) * np.clip(share + spread, 0.0, 1.0)


@pytest.fixture(scope="module", params=[*((s, f) for s in SPRINGS for f in FORMS), *((s, "python") for s in SPRINGS)])
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Case:
    name, form = request.param
    model, folder = ModelFile(name, SPRINGS[name]), tmp_path_factory.mktemp("resolution")
    built = build_python_fmu if form == "python" else build_native_fmu
    return Case(built(model, folder, zero="rig", **FORMS.get(form, {})), SPRINGS[name], form != "no-energy")


@pytest.fixture
def run(case: Case) -> Iterator[Run]:
    with begun(case.fmu, float(case.motion()[1][0]), input_resolution=case.resolution) as run:
        yield run


def followed(path: np.ndarray, resolution: float) -> np.ndarray:
    found = np.empty_like(path)
    library().spring_resolved_path(path.size, address(path), resolution, address(found))
    return found


def test_the_force_is_that_of_the_model(case: Case, run: Run) -> None:
    time, path = case.motion()
    expected = Spring(case.parameters).response(path, 0.0, time, case.resolution)
    # Rounding of steps, of times that add up, and of tables of W: 1e-13.
    assert run.along(path, time) == pytest.approx(expected[1:], abs=1e-10 * np.abs(expected).max())
    assert run.get("omega")[0] == pytest.approx(
        PathSolver(case.parameters).omega(followed(path, case.resolution))[-1], abs=1e-12
    )
    without = Spring(case.parameters).response(path, 0.0, time)
    assert np.abs(expected - without).max() > 0.01 * np.abs(expected).max()


def test_trials_leave_no_trace(case: Case, run: Run) -> None:
    time, path = (values[:80] for values in case.motion())
    expected = Spring(case.parameters).response(path, 0.0, time, case.resolution)
    found = []
    for x, h in zip(path[1:].tolist(), np.diff(time).tolist(), strict=True):
        for share in (-3.0, -0.4, 0.0, 0.4, 3.0):
            run.set(displacement=x + share * case.resolution)
            run.get("force", "stiffness", "omega", *(["absorbed_energy"] * case.has_energy))
        found.append(run.step(x, h))
    assert found == pytest.approx(expected[1:], abs=1e-10 * np.abs(expected).max())


def test_a_trial_shows_what_a_step_in_no_time_gives(case: Case, run: Run) -> None:
    time, path = (values[:60] for values in case.motion())
    run.along(path, time)
    names = ["force", "stiffness", "omega", *(["absorbed_energy"] * case.has_energy)]
    for share in (-0.3, -1.2, -1.7, -2.5, 0.4, 1.4):
        run.set(displacement=float(path[-1]) + share * case.resolution)
        trial = run.get(*names)
        run.slave.doStep(run.time, 0.0)
        assert run.get(*names) == pytest.approx(trial, rel=1e-12)


def test_energy_is_that_of_the_displacement_which_friction_follows(case: Case, run: Run) -> None:
    if not case.has_energy:
        assert "absorbed_energy" not in run.references
        return
    time, path = case.motion()
    energy = PathSolver(case.parameters).slow.absorbed_energy(followed(path, case.resolution))
    if case.parameters.branches:
        energy += maxwell_sums(case.parameters.branches, path, time)[1]
    run.get("absorbed_energy")
    run.along(path, time)
    # Rounding of sums over 400 steps, and of times that add up.
    assert run.get("absorbed_energy")[0] == pytest.approx(energy[-1], abs=1e-10 * np.abs(energy).max())


def test_a_state_goes_on_in_another_instance(case: Case, run: Run) -> None:
    time, path = case.motion()
    run.along(path[:100], time[:100])
    state = run.slave.getFMUState()
    data = run.slave.serializeFMUState(state)
    expected = run.along(path[99:], time[99:])
    run.slave.freeFMUState(state)
    with begun(case.fmu, 0.0) as other:
        restored = other.slave.deserializeFMUState(data)
        other.slave.setFMUState(restored)
        other.time = float(time[99])
        assert other.along(path[99:], time[99:]) == expected
        other.slave.freeFMUState(restored)


def test_it_can_be_changed_and_friction_catches_up(case: Case, run: Run) -> None:
    """After the change the force is that of a spring that has come to this place, and goes on as without a change."""
    time, path = case.motion()
    run.along(path[:200], time[:200])
    run.set(input_resolution=0.0)
    resolved = np.append(followed(path[:200], case.resolution), path[199:])
    slow = PathSolver(case.parameters).slow
    omega = slow.omega(resolved)
    assert run.get("omega")[0] == pytest.approx(omega[200], abs=1e-12)
    run.along(path[199:], time[199:])
    assert run.get("omega")[0] == pytest.approx(omega[-1], abs=1e-12)
    run.set(input_resolution=case.resolution)
    # At once in the direction of the last motion, and not before a resolution in the other.
    heading = float(np.sign(path[-1] - path[-2]))
    run.step(float(path[-1]) - 0.9 * heading * case.resolution, 1.0)
    assert run.get("omega")[0] == pytest.approx(omega[-1], abs=1e-12)
    run.step(float(path[-1]) - 1.5 * heading * case.resolution, 1.0)
    assert abs(run.get("omega")[0] - omega[-1]) > 1e-6


def test_what_is_none_and_derivatives_are_refused(case: Case, run: Run) -> None:
    time, path = (values[:60] for values in case.motion())
    run.along(path, time)
    before = run.get("force", "omega", "input_resolution")
    for value in (-1e-9, 2e9, np.nan):
        with pytest.raises(FMICallException):
            run.set(input_resolution=value)
    assert run.get("force", "omega", "input_resolution") == before
    if case.fmu.stem.endswith("python"):
        return
    force, displacement = [run.references["force"]], [run.references["displacement"]]
    with pytest.raises(FMICallException):
        run.slave.getDirectionalDerivative(force, displacement, [1.0])
    run.set(input_resolution=0.0)
    assert run.slave.getDirectionalDerivative(force, displacement, [1.0])[0] == pytest.approx(run.get("stiffness")[0])
