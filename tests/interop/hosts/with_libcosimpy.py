"""libcosim by its Python interface; the script sets the displacement of the end of each step before it."""

from __future__ import annotations

import numpy as np
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

from motion import STEP, TIMES, displacement


def run(fmu: str, _kind: str) -> tuple[np.ndarray, ...]:
    execution = CosimExecution.from_step_size(step_size=STEP * 1e9)  # ns
    index = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=fmu, instance_name="spring"))
    reference = {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=index)}
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    assert execution.add_manipulator(manipulator=manipulator)
    assert execution.add_observer(observer=observer)
    outputs = [reference["force"], reference["absorbed_energy"]]
    rows = []
    for value in displacement(TIMES[1:]).tolist():
        assert manipulator.slave_real_values(index, [reference["displacement"]], [value])
        assert execution.step()
        rows.append([1e-9 * execution.status().current_time, *observer.last_real_values(index, outputs)])
    return tuple(np.array(rows).T)
