"""FMPy: `simulate_fmu` with an input table."""

from __future__ import annotations

import fmpy
import numpy as np

from motion import STEP, STOP, TIMES, displacement

OUTPUTS = ("force", "absorbed_energy")


def run(fmu: str, kind: str) -> tuple[np.ndarray, ...]:
    table = np.rec.fromarrays([TIMES, displacement(TIMES)], names="time,displacement")
    result = fmpy.simulate_fmu(
        fmu, fmi_type=kind, stop_time=STOP, step_size=STEP, output_interval=STEP, input=table, output=OUTPUTS,
        record_events=False,
    )  # fmt: skip
    return tuple(result[name] for name in ("time", *OUTPUTS))
