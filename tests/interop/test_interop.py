"""Every tool of the matrix runs every kind of FMU that it can, and gives force and absorbed energy of the model: of the
bundled hinge, and of the same with a second mechanism and Maxwell branches; and the motion of a system of bodies.

The reference is the model itself over the displacement that holds at the time of each row, in the record's coordinates;
it knows nothing of the FMU. A new kind of FMU is one entry of KINDS; a new tool one of TOOLS and a function in hosts.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping
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
from system_fmu_tools import BOX, BOX_OPTIONS, NativeSystem
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


@dataclass(frozen=True)
class Tool:
    """A row of the documentation.

    Parameters
    ----------
    host : str            The function in `hosts` that runs it, and what to install of the extra `dev`.
    results : mapping     How exact FMUs must be in it, or in words why it does not run them: by interface, and by kind
                          where that differs.
    fmi_3 : str           In words why it does not run FMUs of FMI 3.0; empty if they give the bits of FMI 2.0.
    missing : callable    Why it cannot be run on this computer, or None.
    """

    title: str
    host: str
    results: Mapping[Kind | str, str]
    fmi_3: str = ""
    module: str | None = None
    missing: Callable[[], str | None] = lambda: None

    def result(self, kind: Kind) -> str:
        return self.results[kind if kind in self.results else kind.interface]


def without_cofmupy() -> str | None:
    is_there = Path(sys.prefix, "cofmupy").is_dir() or "STRANDSPRING_ALL_TOOLS" in os.environ
    return None if is_there else "CoFMUPy is not installed: tests/interop/cofmupy.txt says how"


_SAME = {"CoSimulation": EXACT, "ModelExchange": "has no model exchange"}
_LATE = {"CoSimulation": LATE, "ModelExchange": "has no model exchange"}
_HOST = {"CoSimulation": EXACT, "ModelExchange": "not written for it"}
TOOLS = (
    Tool("`strandspring.simulate_fmu`", "strandspring", _SAME),
    Tool("FMPy, `simulate_fmu`", "fmpy", _LATE | {EXCHANGE: EXACT, STATES: LATE}),
    Tool("PathSim (pathsim-fmi)", "pathsim", _SAME | {EXCHANGE: "needs continuous states", STATES: EXACT},
         module="pathsim_fmi"),
    Tool("CasADi", "casadi", {"CoSimulation": "has no co-simulation", EXCHANGE: "knows states only", STATES: EXACT},
         module="casadi"),
    Tool("CoFMUPy", "cofmupy", _SAME, missing=without_cofmupy),
    Tool("FMU Manipulation Toolbox: check, and container in FMPy", "container", _LATE,
         module="fmu_manipulation_toolbox"),
    Tool("libcosim (libcosimpy)", "libcosimpy", _SAME, "\"Unsupported FMI version\"", module="libcosimpy"),
    Tool("Ecos (ecospy)", "ecospy", _SAME, module="ecospy"),
    Tool("host in C without Python", "c_host", _HOST | {PYTHON: "must preload libpython"}, "not written for it"),
    Tool("the same for Windows, by wine", "wine", _HOST | {PYTHON: "must load Python first"}, "not written for it",
         "ziglang", lambda: None if wine() else "wine is not installed: test_build.py looked into the binary only"),
)  # fmt: skip
CELLS = [pytest.param(tool, kind, id=f"{tool.host}-{kind.title}")
         for tool in TOOLS for kind in KINDS if tool.result(kind) in TOLERANCES]  # fmt: skip


def rows_of(tool: Tool, interface: str, fmu: Path, folder: Path) -> list[np.ndarray]:
    """Times and two outputs as the tool reports them."""
    if reason := tool.missing():
        pytest.skip(reason)
    if tool.module:
        needed(tool.module)
    paths = os.pathsep.join([str(ROOT / "tests" / "helpers"), str(ROOT / "tests"), str(ROOT / "fmu_src")])
    command = [sys.executable, str(Path(__file__).with_name("hosts.py")), tool.host, str(fmu), interface, "result.npz"]
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
def test_a_tool_gives_force_and_energy_of_the_model(tool: Tool, kind: Kind, model: ModelFile, tmp_path: Path) -> None:
    if model is BRANCHED and kind is EXCHANGE:
        return  # without states, branches are for co-simulation only
    time, *outputs = rows_of(tool, kind.interface, kind.build(model, tmp_path), tmp_path)
    if model is HINGE and kind.platforms and not tool.fmi_3:
        other = rows_of(tool, kind.interface, kind.build(model, tmp_path / "3", 3), tmp_path)
        assert all(map(np.array_equal, other, (time, *outputs)))
    samples = np.rint(time / STEP).astype(int)
    # Every communication point once, but for the first in tools that report ends of steps only.
    assert np.array_equal(samples, np.arange(samples[0], len(TIMES)))
    assert samples[0] <= 1
    assert np.abs(time - TIMES[samples]).max() <= 1e-9 * TIMES[-1]  # sums of steps
    pairs = zip(outputs, reference(model.parameters), strict=True)
    worst = max(np.abs(found - expected[samples]).max() / np.ptp(expected) for found, expected in pairs)
    print(f"{tool.title}, {kind.title}: {worst:.1e} of the range")
    if model is HINGE:
        assert next((result for result, limit in TOLERANCES.items() if worst <= limit), None) == tool.result(kind), (
            worst
        )
    else:  # solvers of the states have tolerances; what is late errs by what the force changes in a step
        force = reference(model.parameters)[0]
        late = np.abs(np.diff(force)).max() / np.ptp(force)
        exact = 1e-7 if kind is STATES else 1e-9
        assert worst <= (late if tool.result(kind) == LATE else exact) * (1.0 + 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("fmi", [2, 3])
def test_importers_get_the_motion_of_a_system(fmi: int, tmp_path: Path) -> None:
    from strandspring.fmu.system.system_native import build_system_fmu

    fmu = build_system_fmu(BOX, tmp_path, replace(BOX_OPTIONS, fmi=fmi), chosen_platforms("host"))
    with NativeSystem().begin() as one:
        expected = []
        for k, value in enumerate(shaking(TIMES[1:]).tolist()):
            assert one.set(base_acceleration_x=value) == one.go(k * STEP, STEP) == OK
            expected.append(one.get("sway_circuit_board_x", "absorbed_energy"))
    for tool in TOOLS:
        if tool.host in ("libcosimpy", "ecospy") and not (tool.fmi_3 and fmi == 3):
            np.testing.assert_array_equal(np.transpose(rows_of(tool, "CoSimulation", fmu, tmp_path)[1:]), expected)
    assert np.abs(expected).max() > 1e-3


def test_the_documentation_has_the_matrix() -> None:
    def cell(result: str) -> str:
        return result if result in TOLERANCES else f"- ({result})"

    heads = ["tool", *(kind.title for kind in KINDS), "FMI 3.0"]
    cells = [
        [tool.title, *(cell(tool.result(kind)) for kind in KINDS), cell(tool.fmi_3) if tool.fmi_3 else "same bits"]
        for tool in TOOLS
    ]
    table = "\n".join(f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *cells))
    force = reference(HINGE.parameters)[0]
    fastest = f"{np.abs(np.diff(force)).max() / np.ptp(force):.1e}".replace("e-0", "e-")
    for text in (
        table,
        f"{len(TIMES) - 1} steps",
        f"{fastest} is what the force changes in the fastest of these steps",
    ):
        assert text in TEXTS["tool-tests"], text
