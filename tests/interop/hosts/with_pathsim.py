"""PathSim with the FMU as a block between sources and a scope."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pathsim import Connection, Simulation
from pathsim.blocks import Scope, Source
from pathsim.solvers import RK4
from pathsim_fmi import CoSimulationFMU, ModelExchangeFMU

from motion import SIGNALS, STEP, STOP


def _source(signal: Callable[[np.ndarray], np.ndarray]) -> Source:
    return Source(lambda time: float(signal(np.float64(time))))


def run(fmu: str, kind: str) -> tuple[np.ndarray, ...]:
    spring = CoSimulationFMU(fmu, dt=STEP) if kind == "CoSimulation" else ModelExchangeFMU(fmu)
    sources = {name: _source(SIGNALS[name]) for name in spring.fmu_wrapper.input_refs}
    scope = Scope()
    wires = [
        *(Connection(source, spring[name]) for name, source in sources.items()),
        Connection(spring["force"], scope[0]),
        Connection(spring["absorbed_energy"], scope[1]),
    ]
    Simulation([*sources.values(), spring, scope], wires, dt=STEP, log=False, Solver=RK4).run(STOP)
    time, outputs = scope.read()
    return time, *outputs
