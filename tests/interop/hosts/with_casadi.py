"""CasADi: the FMU with states as a DAE whose inputs are expressions of time, integrated stroke by stroke by CVODES."""

from __future__ import annotations

import casadi
import fmpy
import numpy as np

from motion import STEP, STROKE, TIMES, TURNS

TOLERANCES = {"reltol": 1e-12, "abstol": 1e-14, "max_num_steps": 100_000}


def run(fmu: str, _kind: str) -> tuple[np.ndarray, ...]:
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
    integrator = casadi.integrator("integrator", "cvodes", problem, 0.0, grid, TOLERANCES)
    observed = casadi.Function("observed", [time, state, stroke], [values])

    now = casadi.DM([dae.start(name) for name in states])
    rows = [observed(0.0, now, [TURNS[0], TURNS[1] - TURNS[0]])]
    for begin, length in zip(TURNS[:-1], np.diff(TURNS), strict=True):
        path = integrator(x0=now, p=[begin, length])["xf"]
        rows.append(observed(casadi.DM(grid).T, path, [begin, length]))
        now = path[:, -1]
    found = np.array(casadi.horzcat(*rows))
    return TIMES, found[outputs.index("force")], found[outputs.index("absorbed_energy")]
