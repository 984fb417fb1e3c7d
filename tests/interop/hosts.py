"""Tools that run FMUs, a function for each; each run is a process of its own: python hosts.py HOST FMU KIND RESULT.npz

A function takes an FMU and an interface as FMPy names it, and returns the times [s] as the tool reports them and the
outputs of the FMU's first input and OUTPUTS.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

Rows = tuple[np.ndarray, ...]
# Exact in binary and a whole number of nanoseconds, so that no tool's clock drifts.
STEP = 2.0**-9  # s
STROKE = 3072 * STEP  # s
# Where the path turns, in the coordinates of the FMU [m]; the inner loops are minor ones.
TURNS = np.array([0.0, 0.012, -0.013, 0.004])
STOP = STROKE * (len(TURNS) - 1)
TIMES = STEP * np.arange(round(STOP / STEP) + 1)


def _stroke(time: np.ndarray) -> Rows:
    """Where the stroke of a time begins [m], its length [m] and the share of its duration that has passed."""
    k = np.clip((time // STROKE).astype(int), 0, len(TURNS) - 2)
    return TURNS[k], TURNS[k + 1] - TURNS[k], time / STROKE - k


def displacement(time: np.ndarray) -> np.ndarray:
    """Half periods of cosines from turn to turn, so that all turns are at communication points [m]."""
    begin, length, share = _stroke(time)
    return np.asarray(begin + 0.5 * length * (1.0 - np.cos(np.pi * share)))


def velocity(time: np.ndarray) -> np.ndarray:
    """The rate of that [m/s]."""
    _, length, share = _stroke(time)
    return np.asarray(0.5 * length * np.pi / STROKE * np.sin(np.pi * share))


def shaking(time: np.ndarray) -> np.ndarray:
    """Acceleration of the base of a system [m/s^2]."""
    return np.asarray(60.0 * np.sin(40.0 * time))


# Inputs of FMUs by name, an FMU without states has the first only; outputs of a spring, and of a system.
SIGNALS = {"displacement": displacement, "velocity": velocity, "base_acceleration_x": shaking}
OUTPUTS = {"force": ("force", "absorbed_energy"), "sway": ("sway_circuit_board_x", "absorbed_energy")}


def variables(fmu: str) -> tuple[list[str], list[str]]:
    """Inputs that move and outputs that are compared."""
    import fmpy

    names = [v.name for v in fmpy.read_model_description(fmu).modelVariables]
    return [name for name in SIGNALS if name in names], list(OUTPUTS["force" if "force" in names else "sway"])


def strandspring(fmu: str, _kind: str) -> Rows:
    from strandspring import simulate_fmu

    motion = simulate_fmu(fmu, displacement(TIMES), TIMES)
    return motion.time, motion.force, motion.absorbed_energy


def fmpy(fmu: str, kind: str) -> Rows:
    import fmpy

    inputs, outputs = variables(fmu)
    table = np.rec.fromarrays([TIMES, *(SIGNALS[name](TIMES) for name in inputs)], names=["time", *inputs])
    result = fmpy.simulate_fmu(
        fmu, fmi_type=kind, stop_time=STOP, step_size=STEP, output_interval=STEP, input=table, output=outputs,
        record_events=False, set_input_derivatives=False,
    )  # fmt: skip
    return tuple(result[name] for name in ("time", *outputs))


def pathsim(fmu: str, kind: str) -> Rows:
    """The FMU as a block between sources and a scope."""
    from pathsim import Connection, Simulation
    from pathsim.blocks import Scope, Source
    from pathsim.solvers import RK4
    from pathsim_fmi import CoSimulationFMU, ModelExchangeFMU

    spring = CoSimulationFMU(fmu, dt=STEP) if kind == "CoSimulation" else ModelExchangeFMU(fmu)
    signals = {name: SIGNALS[name] for name in spring.fmu_wrapper.input_refs}
    sources = {name: Source(lambda time, one=one: float(one(np.float64(time)))) for name, one in signals.items()}
    scope = Scope()
    wires = [Connection(source, spring[name]) for name, source in sources.items()]
    wires += [Connection(spring[name], scope[k]) for k, name in enumerate(OUTPUTS["force"])]
    Simulation([*sources.values(), spring, scope], wires, dt=STEP, log=False, Solver=RK4).run(STOP)
    time, outputs = scope.read()
    return time, *outputs


def casadi(fmu: str, _kind: str) -> Rows:
    """The FMU with states as a DAE whose inputs are expressions of time, integrated stroke by stroke by CVODES."""
    import casadi
    import fmpy

    dae = casadi.DaeBuilder("spring", str(fmpy.extract(fmu)))
    states, outputs = dae.x(), dae.y()
    model = dae.create("model", ["x", "u"], ["ode", "y"])
    time, state, stroke = casadi.MX.sym("time"), casadi.MX.sym("state", len(states)), casadi.MX.sym("stroke", 2)
    phase, (begin, length) = casadi.pi * time / STROKE, casadi.vertsplit(stroke)
    inputs = {
        "displacement": begin + 0.5 * length * (1.0 - casadi.cos(phase)),
        "velocity": 0.5 * length * casadi.pi / STROKE * casadi.sin(phase),
    }
    rates, values = model(state, casadi.vertcat(*(inputs[name] for name in dae.u())))
    grid = STEP * np.arange(1, round(STROKE / STEP) + 1)
    problem = {"x": state, "t": time, "p": stroke, "ode": rates}
    tolerances = {"reltol": 1e-12, "abstol": 1e-14, "max_num_steps": 100_000}
    integrator = casadi.integrator("integrator", "cvodes", problem, 0.0, grid, tolerances)
    observed = casadi.Function("observed", [time, state, stroke], [values])
    now = casadi.DM([dae.start(name) for name in states])
    rows = [observed(0.0, now, [TURNS[0], TURNS[1] - TURNS[0]])]
    for start, way in zip(TURNS[:-1], np.diff(TURNS), strict=True):
        path = integrator(x0=now, p=[start, way])["xf"]
        rows.append(observed(casadi.DM(grid).T, path, [start, way]))
        now = path[:, -1]
    found = np.array(casadi.horzcat(*rows))
    return TIMES, *(found[outputs.index(name)] for name in OUTPUTS["force"])


def cofmupy(fmu: str, _kind: str) -> Rows:
    """It needs an FMPy older than that of the other tools, so it is in a folder of its own; its rows begin steps."""
    values = dict(zip(map(str, TIMES.tolist()), displacement(TIMES).tolist(), strict=True))
    table = {"id": "rig", "variable": "displacement", "type": "literal", "values": values, "interpolation": "previous"}
    system = {
        "fmus": [{"id": "spring", "path": fmu, "initialization": {}}], "cosim_method": "jacobi", "iterative": False,
        "connections": [{"source": table, "target": {"id": "spring", "variable": "displacement", "type": "fmu"}}],
    }  # fmt: skip
    sys.path.insert(0, str(Path(sys.prefix, "cofmupy")))
    coordinator = import_module("cofmupy").Coordinator()
    Path("system.json").write_text(json.dumps(system), encoding="utf-8")
    coordinator.start("system.json")
    coordinator.run_simulation(STEP, float(TIMES[-1]) + STEP)
    results = coordinator.get_results()
    return tuple(np.array(results[key]) for key in ("time", ("spring", "force"), ("spring", "absorbed_energy")))


def container(fmu: str, kind: str) -> Rows:
    """FMU Manipulation Toolbox: its check of the FMU, then a container around the FMU, which FMPy runs."""
    import fmpy as reader

    def said(program: str, *arguments: str) -> str:
        command = [str(Path(sys.executable).with_name(program)), *arguments]
        return subprocess.run(command, check=True, capture_output=True, text=True, timeout=120).stdout

    shutil.copy(fmu, "spring.fmu")
    checked, fmi = said("fmutool", "-input", "spring.fmu", "-check"), reader.read_model_description(fmu).fmiVersion[0]
    for sentence in ("This FMU seems to be compliant with FMI-{}.0.", "No semantic error against the FMI-{} standard."):
        assert sentence.format(fmi) in checked, checked
    Path("box.csv").write_text("rule;from_fmu;from_port;to_fmu;to_port\nFMU;spring.fmu;;;\n", encoding="utf-8")
    said("fmucontainer", "-container", f"box.csv:{STEP}", "-fmu-directory", ".")
    return fmpy("box.fmu", kind)


def ecospy(fmu: str, _kind: str) -> Rows:
    """Ecos; the script sets the input of the end of each step before it."""
    from ecospy import EcosSimulation, EcosSimulationStructure

    (name, *_), outputs = variables(fmu)
    rows = []
    with EcosSimulationStructure() as structure:
        structure.add_model("spring", fmu)
        with EcosSimulation(structure=structure, step_size=STEP) as simulation:
            simulation.init()
            for time, value in zip(TIMES[1:].tolist(), SIGNALS[name](TIMES[1:]).tolist(), strict=True):
                simulation.set_real(f"spring::{name}", value)
                simulation.step()
                rows.append([time, *(simulation.get_real(f"spring::{output}") for output in outputs)])
    return tuple(np.array(rows).T)


def libcosimpy(fmu: str, _kind: str) -> Rows:
    """libcosim by its Python interface; the script sets the input of the end of each step before it."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    (name, *_), outputs = variables(fmu)
    execution = CosimExecution.from_step_size(step_size=STEP * 1e9)  # ns
    index = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=fmu, instance_name="spring"))
    reference = {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=index)}
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    assert execution.add_manipulator(manipulator=manipulator)
    assert execution.add_observer(observer=observer)
    rows = []
    for value in SIGNALS[name](TIMES[1:]).tolist():
        assert manipulator.slave_real_values(index, [reference[name]], [value])
        assert execution.step()
        found = observer.last_real_values(index, [reference[output] for output in outputs])
        rows.append([1e-9 * execution.status().current_time, *found])
    return tuple(np.array(rows).T)


def c_host(fmu: str, _kind: str, platform: str | None = None) -> Rows:
    """A simulator in C without Python, host.c."""
    from portable_host import responses
    from strandspring.fmu.native.platforms import host_folder

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        values = responses(Path(fmu), displacement(TIMES), Path(folder), platform or str(host_folder()))
    assert np.array_equal(values[:, 0], values[:, 1])  # of two copies of the binary
    return TIMES, *values[:, 0].T


def wine(fmu: str, kind: str) -> Rows:
    """The same simulator for Windows."""
    return c_host(fmu, kind, "win64")


if __name__ == "__main__":
    host, given_fmu, given_kind, result = sys.argv[1:]
    found: Any = globals()[host](given_fmu, given_kind)
    np.savez(result, **dict(zip(("time", "first", "second"), found, strict=True)))
