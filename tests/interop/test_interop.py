"""Every tool of the matrix runs every kind of FMU that it can, and gives force and absorbed energy of the model: of the
bundled hinge, and of the same with a second mechanism and Maxwell branches.

The reference is the model itself over the displacement that holds at the time of each row, in the record's coordinates;
it knows nothing of the FMU. Each tool runs in a process of its own.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from branched_springs import BRANCHES, SECOND
from hosts.motion import STEP, TIMES, displacement
from matrix import EXCHANGE, KINDS, STATES, TOOLS, Kind, Sampling, Tool, table
from pages import ROOT, TEXTS
from strandspring import Spring, SpringParameters
from strandspring.model.modelfile import ModelFile, load_model
from tools import tool as needed

HINGE = load_model(ROOT / "models" / "rubber_hinge.json")
BRANCHED = ModelFile("branched", replace(HINGE.parameters, second=SECOND, branches=BRANCHES[:2]))
HOSTS = Path(__file__).with_name("hosts")


@cache
def reference(parameters: SpringParameters) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] and absorbed energy [J] of the model at the times of the motion.

    The rig's zero lies outside of this spring's range, so that its FMU counts from the middle of the range.
    """
    spring = Spring(parameters)
    middle = 0.5 * (parameters.displacement_min + parameters.displacement_max)
    path = middle + displacement(TIMES)
    return spring.response(path, time=TIMES), spring.absorbed_energy(path, time=TIMES)


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[Kind, int], Path]:
    """The hinge by each kind and each version of FMI that it has."""
    folder = tmp_path_factory.mktemp("fmus")
    builds = {(kind, fmi): build for kind in KINDS for fmi, build in ((2, kind.build), (3, kind.build_by_fmi_3))}
    return {key: build(HINGE, folder) for key, build in builds.items() if build}


def rows_of(tool: Tool, kind: Kind, fmu: Path, folder: Path) -> list[np.ndarray]:
    """Times, force and absorbed energy as the tool reports them."""
    result = folder / "result.npz"
    helpers = Path(__file__).parents[1] / "helpers"
    paths = os.pathsep.join([str(helpers), str(ROOT / "fmu_src")])
    done = subprocess.run(
        [sys.executable, str(HOSTS), tool.host, str(fmu), kind.interface, str(result)],
        capture_output=True, text=True, timeout=240, cwd=folder, env={**os.environ, "PYTHONPATH": paths}, check=False,
    )  # fmt: skip
    # Nor while Python ends; a container calls its own list of solvers an error.
    said = (done.stdout + done.stderr).lower().replace("[error] solver configure", "")
    assert "[error]" not in said
    assert done.returncode == 0, f"exit status {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    with np.load(result) as values:
        return [values[name] for name in ("time", "force", "absorbed_energy")]


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_pathsim_ends_without_an_error_what_never_began_or_has_ended(
    fmus: dict[tuple[Kind, int], Path], fmi: int
) -> None:
    """It terminates what it has when Python ends, whatever the state."""
    script = """
import sys
from pathsim_fmi.wrapper import FMUWrapper
unused, ended = (FMUWrapper(sys.argv[1], mode="cosimulation") for _ in range(2))
unused.instantiate()
ended.initialize()
ended.terminate()
"""
    fmu = fmus[next(kind for kind in KINDS if kind.interface == "CoSimulation"), fmi]
    done = subprocess.run(
        [sys.executable, "-c", script, str(fmu)], capture_output=True, text=True, timeout=240, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


CELLS = [(tool, kind) for tool in TOOLS for kind in KINDS if isinstance(tool.result(kind), Sampling)]


@pytest.mark.slow
@pytest.mark.parametrize(("tool", "kind"), CELLS, ids=[f"{tool.host}-{kind.title}" for tool, kind in CELLS])
def test_a_tool_gives_force_and_energy_of_the_model(
    tool: Tool, kind: Kind, fmus: dict[tuple[Kind, int], Path], tmp_path: Path
) -> None:
    if reason := tool.missing():
        pytest.skip(reason)
    if tool.module:
        needed(tool.module)
    time, *outputs = rows_of(tool, kind, fmus[kind, 2], tmp_path)
    if kind.build_by_fmi_3 and not tool.fmi_3:
        assert all(map(np.array_equal, rows_of(tool, kind, fmus[kind, 3], tmp_path), (time, *outputs)))
    worst = max(errors_of(tool, kind, HINGE, time, outputs))
    assert next((one for one in Sampling if worst <= one.tolerance), None) is tool.result(kind), worst


def errors_of(tool: Tool, kind: Kind, model: ModelFile, time: np.ndarray, outputs: list[np.ndarray]) -> list[float]:
    """Largest errors of force and absorbed energy at the communication points, as shares of their ranges."""
    samples = np.rint(time / STEP).astype(int)
    # Every communication point once, but for the first in tools that report ends of steps only.
    assert np.array_equal(samples, np.arange(samples[0], len(TIMES)))
    assert samples[0] <= 1
    assert np.abs(time - TIMES[samples]).max() <= 1e-9 * TIMES[-1]  # sums of steps
    errors = [
        np.abs(found - expected[samples]).max() / np.ptp(expected)
        for found, expected in zip(outputs, reference(model.parameters), strict=True)
    ]
    print(f"{tool.title}, {kind.title}: force {errors[0]:.1e}, absorbed energy {errors[1]:.1e} of the range")
    return errors


# Without states, they are for co-simulation only.
BRANCHED_CELLS = [(tool, kind) for tool, kind in CELLS if kind is not EXCHANGE]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tool", "kind"), BRANCHED_CELLS, ids=[f"{tool.host}-{kind.title}" for tool, kind in BRANCHED_CELLS]
)
def test_a_tool_gives_those_of_branches_and_a_second_mechanism(tool: Tool, kind: Kind, tmp_path: Path) -> None:
    if reason := tool.missing():
        pytest.skip(reason)
    if tool.module:
        needed(tool.module)
    time, *outputs = rows_of(tool, kind, kind.build(BRANCHED, tmp_path), tmp_path)
    worst = max(errors_of(tool, kind, BRANCHED, time, outputs))
    force, _ = reference(BRANCHED.parameters)
    # Steps are exact; solvers of the states have tolerances; what is late errs by what the force changes in a step.
    exact = 1e-7 if kind is STATES else 1e-9
    limit = exact if tool.result(kind) is Sampling.SAME_TIME else np.abs(np.diff(force)).max() / np.ptp(force)
    assert worst <= limit * (1.0 + 1e-6)


def test_the_documentation_has_the_matrix() -> None:
    assert table() in TEXTS["tool-tests"]
    force, _ = reference(HINGE.parameters)
    fastest = f"{np.abs(np.diff(force)).max() / np.ptp(force):.1e}".replace("e-0", "e-")
    for promised in (f"{len(TIMES) - 1} steps", f"{fastest} is what the force changes in the fastest of these steps"):
        assert promised in TEXTS["tool-tests"], promised
