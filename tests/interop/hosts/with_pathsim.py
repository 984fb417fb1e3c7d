"""PathSim with the FMU as a block between a source and a scope."""

from __future__ import annotations

import numpy as np
from pathsim import Connection, Simulation
from pathsim.blocks import Scope, Source
from pathsim_fmi import CoSimulationFMU

from motion import STEP, STOP, displacement


def run(fmu: str, _kind: str) -> tuple[np.ndarray, ...]:
    source, spring, scope = Source(lambda t: float(displacement(np.float64(t)))), CoSimulationFMU(fmu, dt=STEP), Scope()
    wires = [
        Connection(source, spring["displacement"]),
        Connection(spring["force"], scope[0]),
        Connection(spring["absorbed_energy"], scope[1]),
    ]
    Simulation([source, spring, scope], wires, dt=STEP, log=False).run(STOP)
    time, outputs = scope.read()
    return time, *outputs
