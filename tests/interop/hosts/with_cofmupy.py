"""CoFMUPy, which takes a system as a file: a table of values connected to the FMU.

It needs an FMPy older than that of the other tools, so it is in a folder of its own (see cofmupy.txt). Its rows have
the time at which the step begins.
"""

from __future__ import annotations

import json
import sys
import tempfile
from importlib import import_module
from pathlib import Path

import numpy as np

from motion import STEP, TIMES, displacement

FOLDER = Path(sys.prefix, "cofmupy")


def run(fmu: str, _kind: str) -> tuple[np.ndarray, ...]:
    values = dict(zip(map(str, TIMES.tolist()), displacement(TIMES).tolist(), strict=True))
    table = {"id": "rig", "variable": "displacement", "type": "literal", "values": values, "interpolation": "previous"}
    system = {
        "fmus": [{"id": "spring", "path": fmu, "initialization": {}}],
        "connections": [{"source": table, "target": {"id": "spring", "variable": "displacement", "type": "fmu"}}],
        "cosim_method": "jacobi",
        "iterative": False,
    }
    assert FOLDER.is_dir(), f"{FOLDER} does not exist: install CoFMUPy as tests/interop/cofmupy.txt says."
    sys.path.insert(0, str(FOLDER))
    coordinator = import_module("cofmupy").Coordinator()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "system.json")
        file.write_text(json.dumps(system), encoding="utf-8")
        coordinator.start(str(file))
    coordinator.run_simulation(STEP, float(TIMES[-1]) + STEP)
    results = coordinator.get_results()
    return tuple(np.array(results[key]) for key in ("time", ("spring", "force"), ("spring", "absorbed_energy")))
