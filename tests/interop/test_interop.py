"""Every tool of the matrix runs every kind of FMU that it can, and gives force and absorbed energy of the model: of the
bundled hinge, and of the same with a second mechanism and Maxwell branches; and the motion of a system of bodies.

The reference is the model itself over the displacement that holds at the time of each row, in the record's coordinates;
it knows nothing of the FMU. What a tool must give is what the table of the documentation says of it.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from branched_springs import BRANCHES, SECOND
from hosts import STEP, TIMES, displacement, shaking
from native_tools import OK
from pages import ROOT, TEXTS
from portable_host import wine
from strandspring import Spring, SpringParameters
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.python_backed import build_python_fmu
from strandspring.model.modelfile import ModelFile, load_model
from system_fmu_tools import BOX, BOX_OPTIONS, NativeSystem, system_library
from tools import tool as needed

HINGE = replace(load_model(ROOT / "models" / "rubber_hinge.json"), start=None)  # begins with omega = 0
BRANCHED = ModelFile("branched", replace(HINGE.parameters, second=SECOND, branches=BRANCHES[:2]))
# How far a tool's rows may be from the model: its largest error over the range of the values. Either the displacement
# of a row is that of its force, and FMU and model are the same closed form in two languages; or that of the start of a
# step is held over it: the fastest change in one step is 1.3e-3 of the force's range.
EXACT, LATE = "ok, exact", "ok, one step late"
TOLERANCES = {EXACT: 1e-9, LATE: 2e-3}


@dataclass(frozen=True)
class Kind:
    """A column of the documentation: its title, interface as FMPy names it, platforms (or Python) and states."""

    title: str
    interface: str
    platforms: str | None = "host"
    with_states: bool = False

    def build(self, model: ModelFile, folder: Path, fmi: int = 2) -> Path:
        if self.platforms is None:
            return build_python_fmu(model, folder)
        platforms = chosen_platforms(self.platforms if fmi == 2 else "host")
        return build_native_fmu(model, folder, platforms, with_states=self.with_states, fmi=fmi)


NATIVE = Kind("native, co-simulation", "CoSimulation", "all")
EXCHANGE = Kind("native, model exchange", "ModelExchange")
STATES = Kind("native with states, model exchange", "ModelExchange", with_states=True)
PYTHON = Kind("Python-backed, co-simulation", "CoSimulation", None)
KINDS = (NATIVE, EXCHANGE, STATES, PYTHON)


# Rows of the documentation: the function in `hosts` that runs the tool, and what to install of the extra `dev`.
TOOLS = {
    "`strandspring.simulate_fmu`": ("strandspring", ""), "FMPy, `simulate_fmu`": ("fmpy", ""),
    "PathSim (pathsim-fmi)": ("pathsim", "pathsim_fmi"), "CasADi": ("casadi", "casadi"), "CoFMUPy": ("cofmupy", ""),
    "FMU Manipulation Toolbox: check, and container in FMPy": ("container", "fmu_manipulation_toolbox"),
    "libcosim (libcosimpy)": ("libcosimpy", "libcosimpy"), "Ecos (ecospy)": ("ecospy", "ecospy"),
    "host in C without Python": ("c_host", ""), "the same for Windows, by wine": ("wine", "ziglang"),
}  # fmt: skip
# What the documentation says of each tool: how exact FMUs of each kind are in it, or why it does not run them.
TABLE = [
    line.strip("| ").split(" | ")
    for line in re.findall(r"^\| tool \|.*\n(?:\|.*\n)+", TEXTS["tool-tests"], re.MULTILINE)[0].splitlines()
]
MATRIX = {title: dict(zip([*KINDS, "FMI 3.0"], cells, strict=True)) for title, *cells in TABLE[2:]}
CELLS = [
    pytest.param(title, kind, id=f"{TOOLS[title][0]}-{kind.title}")
    for title in MATRIX for kind in KINDS if MATRIX[title][kind] in TOLERANCES
]  # fmt: skip


def rows_of(title: str, interface: str, fmu: Path, folder: Path) -> list[np.ndarray]:
    """Times and two outputs as the tool reports them."""
    host, module = TOOLS[title]
    if host == "cofmupy" and not (Path(sys.prefix, "cofmupy").is_dir() or "STRANDSPRING_ALL_TOOLS" in os.environ):
        pytest.skip("CoFMUPy is not installed: tests/interop/cofmupy.txt says how")
    if host == "wine" and not wine():
        pytest.skip("wine is not installed: test_build.py looked into the binary only")
    if module:
        needed(module)
    paths = os.pathsep.join([str(ROOT / "tests" / "helpers"), str(ROOT / "tests"), str(ROOT / "fmu_src")])
    command = [sys.executable, str(Path(__file__).with_name("hosts.py")), host, str(fmu), interface, "result.npz"]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=240, cwd=folder, env={**os.environ, "PYTHONPATH": paths},
        check=False,
    )  # fmt: skip
    # Nor while Python ends; a container calls its own list of solvers an error.
    said = (done.stdout + done.stderr).lower().replace("[error] solver configure", "")
    assert "[error]" not in said
    assert done.returncode == 0, f"exit status {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    with np.load(folder / "result.npz") as values:
        return [values[name] for name in ("time", "first", "second")]


@cache
def reference(p: SpringParameters) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] and absorbed energy [J] of the model at the times of the motion.

    The rig's zero lies outside of this spring's range, so that its FMU counts from the middle of the range.
    """
    spring, path = Spring(p), 0.5 * (p.displacement_min + p.displacement_max) + displacement(TIMES)
    return spring.response(path, time=TIMES), spring.absorbed_energy(path, time=TIMES)


@pytest.mark.slow
@pytest.mark.parametrize("model", [HINGE, BRANCHED], ids=["hinge", "branched"])
@pytest.mark.parametrize(("tool", "kind"), CELLS)
def test_a_tool_gives_force_and_energy_of_the_model(tool: str, kind: Kind, model: ModelFile, tmp_path: Path) -> None:
    if model is BRANCHED and kind is EXCHANGE:
        return  # without states, branches are for co-simulation only
    time, *outputs = rows_of(tool, kind.interface, kind.build(model, tmp_path), tmp_path)
    if model is HINGE and kind.platforms and MATRIX[tool]["FMI 3.0"] == "same bits":
        other = rows_of(tool, kind.interface, kind.build(model, tmp_path / "3", 3), tmp_path)
        assert all(map(np.array_equal, other, (time, *outputs)))
    samples = np.rint(time / STEP).astype(int)
    # Every communication point once, but for the first in tools that report ends of steps only.
    assert np.array_equal(samples, np.arange(samples[0], len(TIMES)))
    assert samples[0] <= 1
    assert np.abs(time - TIMES[samples]).max() <= 1e-9 * TIMES[-1]  # sums of steps
    pairs = zip(outputs, reference(model.parameters), strict=True)
    worst = max(np.abs(found - expected[samples]).max() / np.ptp(expected) for found, expected in pairs)
    print(f"{tool}, {kind.title}: {worst:.1e} of the range")
    if model is HINGE:
        assert [result for result, limit in TOLERANCES.items() if worst <= limit][:1] == [MATRIX[tool][kind]], worst
    else:  # solvers of the states have tolerances; what is late errs by what the force changes in a step
        force = reference(model.parameters)[0]
        late = np.abs(np.diff(force)).max() / np.ptp(force)
        exact = 1e-7 if kind is STATES else 1e-9
        assert worst <= (late if MATRIX[tool][kind] == LATE else exact) * (1.0 + 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_importers_get_the_motion_of_a_system(fmi: int, tmp_path: Path) -> None:
    from strandspring.fmu.system.system_native import build_system_fmu

    fmu = build_system_fmu(BOX, tmp_path, replace(BOX_OPTIONS, fmi=fmi), chosen_platforms("host"))
    with NativeSystem(system_library(BOX, BOX_OPTIONS)).begin() as one:
        expected = []
        for k, value in enumerate(shaking(TIMES[1:]).tolist()):
            assert one.set(base_acceleration_x=value) == one.go(k * STEP, STEP) == OK
            expected.append(one.get("sway_circuit_board_x", "absorbed_energy"))
    for tool in ("libcosim (libcosimpy)", "Ecos (ecospy)"):
        if fmi == 2 or MATRIX[tool]["FMI 3.0"] == "same bits":
            np.testing.assert_array_equal(np.transpose(rows_of(tool, "CoSimulation", fmu, tmp_path)[1:]), expected)
    assert np.abs(expected).max() > 1e-3


def test_the_documentation_has_every_tool_and_kind() -> None:
    assert TABLE[0] == ["tool", *(kind.title for kind in KINDS), "FMI 3.0"]
    assert list(MATRIX) == list(TOOLS)
    force = reference(HINGE.parameters)[0]
    fastest = f"{np.abs(np.diff(force)).max() / np.ptp(force):.1e}".replace("e-0", "e-")
    for text in (f"{len(TIMES) - 1} steps", f"{fastest} is what the force changes in the fastest of these steps"):
        assert text in TEXTS["tool-tests"], text
