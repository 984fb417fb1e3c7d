"""FMPy: `simulate_fmu` with an input table."""

from __future__ import annotations

import fmpy
import numpy as np

from motion import SIGNALS, STEP, STOP, TIMES

OUTPUTS = ("force", "absorbed_energy")


def run(fmu: str, kind: str) -> tuple[np.ndarray, ...]:
    inputs = [v.name for v in fmpy.read_model_description(fmu).modelVariables if v.causality == "input"]
    table = np.rec.fromarrays([TIMES, *(SIGNALS[name](TIMES) for name in inputs)], names=["time", *inputs])
    result = fmpy.simulate_fmu(
        fmu, fmi_type=kind, stop_time=STOP, step_size=STEP, output_interval=STEP, input=table,
        output=OUTPUTS, record_events=False,
    )  # fmt: skip
    return tuple(result[name] for name in ("time", *OUTPUTS))
