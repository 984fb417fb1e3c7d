"""A mass that swings freely on the FMU with states in CasADi loses its energy as in co-simulation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest

from fmu_tools import SPRING
from matrix import build_with_states
from strandspring.cosimulation import FmuSpring, one_mass, simulate
from strandspring.fmu.native.native_fmu import build_native_fmu
from strandspring.model.modelfile import ModelFile
from tools import tool

casadi = tool("casadi")

MASS, SPEED, STOP, STEP = 5.0, 0.6, 1.0, 1e-3  # kg, m/s, s, s
CENTRED = replace(SPRING, displacement_offset=0.0, displacement_min=-0.03, displacement_max=0.03)
# Held in balance where it starts, at 0.
LOAD = CENTRED.kE[0]


def decay_in_casadi(fmu: Path, plugin: str, is_algebraic: bool) -> np.ndarray:
    """Displacement of the mass every step [m], at the solver's own tolerances."""
    dae = casadi.DaeBuilder("spring", str(fmpy.extract(str(fmu))))
    model = dae.create("model", ["x", "u"], ["ode", "y"])
    q, speed, spring = casadi.MX.sym("q"), casadi.MX.sym("speed"), casadi.MX.sym("spring", dae.nx())
    inputs = {"displacement": q, "velocity": speed}
    rates, outputs = model(spring, casadi.vertcat(*(inputs[name] for name in dae.u())))
    value = (LOAD - outputs[dae.y().index("force")]) / MASS
    acceleration = casadi.MX.sym("acceleration") if is_algebraic else value
    problem = {"x": casadi.vertcat(q, speed, spring), "ode": casadi.vertcat(speed, acceleration, rates)}
    if is_algebraic:
        problem |= {"z": acceleration, "alg": acceleration - value}
    times = STEP * np.arange(1, round(STOP / STEP) + 1)
    integrator = casadi.integrator("decay", plugin, problem, 0.0, times)
    # Where a motion begins at omega = 0 and n < 1, the slope of omega has a cusp, at which IDACalcIC gives up. Without
    # IDACalcIC, algebraic variables would need consistent starts.
    begun = {"omega": 1e-6} if plugin == "idas" else {}
    start = [0.0, SPEED, *(begun.get(name, float(dae.start(name)[0])) for name in dae.x())]
    return np.concatenate([[0.0], np.array(integrator(x0=start)["xf"])[0]])


@pytest.mark.parametrize(("plugin", "is_algebraic"), [("cvodes", False), ("idas", False), ("idas", True)])
def test_free_decay_in_casadi_is_that_of_co_simulation(plugin: str, is_algebraic: bool, tmp_path: Path) -> None:
    model = ModelFile("spring", CENTRED)
    with FmuSpring(build_native_fmu(model, tmp_path, zero=0.0)) as spring:
        fine = simulate(one_mass(MASS, LOAD), [spring], STOP, STEP / 10, velocity=[SPEED]).q[::10, 0]
    found = decay_in_casadi(build_with_states(model, tmp_path / "states"), plugin, is_algebraic)
    amplitude = np.abs(fine).max()
    print(f"{plugin}: {np.abs(found - fine).max() / amplitude:.1e} of the amplitude")
    assert np.abs(fine[-200:]).max() < 0.5 * amplitude  # it does decay
    assert np.abs(found - fine).max() <= 0.01 * amplitude
