"""The FMU of a system in importers of others: FMPy, libcosim and Ecos, against its own steps by ctypes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest

from native_tools import OK
from strandspring.fmu.native.platforms import chosen_platforms
from strandspring.fmu.system.system_native import build_system_fmu
from system_fmu_tools import BOX, BOX_OPTIONS, NativeSystem
from tools import tool

# Exact in binary and a whole number of nanoseconds, so that no tool's clock drifts.
STEP, COUNT = 2.0**-9, 60
INPUT = "base_acceleration_x"
OUTPUTS = ["sway_circuit_board_x", "acceleration_circuit_board_z", "force_corner_1_z", "absorbed_energy"]
VALUES = 60.0 * np.sin(np.linspace(0.0, 6.0, COUNT))


def with_fmpy(fmu: Path) -> np.ndarray:
    # FMPy holds a discrete input from its time on; the last row ends the last step.
    signal = np.zeros(COUNT, dtype=[("time", float), (INPUT, float)])
    signal["time"], signal[INPUT] = STEP * np.arange(COUNT), VALUES
    rows = []

    def record(time: float, recorder: fmpy.simulation.Recorder) -> bool:
        del time
        read = recorder.fmu.getReal if description.fmiVersion == "2.0" else recorder.fmu.getFloat64
        rows.append(list(read([references[name] for name in OUTPUTS])))
        return True

    description = fmpy.read_model_description(str(fmu))
    references = {v.name: v.valueReference for v in description.modelVariables}
    fmpy.simulate_fmu(
        str(fmu),
        stop_time=STEP * COUNT,
        output_interval=STEP,
        input=signal,
        output=OUTPUTS,
        step_finished=record,
        set_input_derivatives=False,
    )
    return np.array(rows)


def with_libcosim(fmu: Path) -> np.ndarray:
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(step_size=STEP * 1e9)  # ns
    index = execution.add_local_slave(local_slave=CosimLocalSlave(fmu_path=str(fmu), instance_name="box"))
    reference = {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=index)}
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    assert execution.add_manipulator(manipulator=manipulator)
    assert execution.add_observer(observer=observer)
    rows = []
    for value in VALUES.tolist():
        assert manipulator.slave_real_values(index, [reference[INPUT]], [value])
        assert execution.step()
        rows.append(observer.last_real_values(index, [reference[name] for name in OUTPUTS]))
    return np.array(rows)


def with_ecos(fmu: Path) -> np.ndarray:
    from ecospy import EcosSimulation, EcosSimulationStructure

    rows = []
    with EcosSimulationStructure() as structure:
        structure.add_model("box", str(fmu))
        with EcosSimulation(structure=structure, step_size=STEP) as simulation:
            simulation.init()
            for value in VALUES.tolist():
                simulation.set_real(f"box::{INPUT}", value)
                simulation.step()
                rows.append([simulation.get_real(f"box::{name}") for name in OUTPUTS])
    return np.array(rows)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("importer", "fmi"), [(with_fmpy, 2), (with_libcosim, 2), (with_ecos, 2), (with_fmpy, 3), (with_ecos, 3)]
)
def test_importers_get_the_motion(importer: Callable[[Path], np.ndarray], fmi: int, tmp_path: Path) -> None:
    if importer is with_libcosim:
        tool("libcosimpy")
    if importer is with_ecos:
        tool("ecospy")
    fmu = build_system_fmu(BOX, tmp_path, replace(BOX_OPTIONS, fmi=fmi), chosen_platforms("host"))
    with NativeSystem().begin() as one:
        expected = []
        for k, value in enumerate(VALUES.tolist()):
            assert one.set(**{INPUT: value}) == OK
            assert one.go(k * STEP, STEP) == OK
            expected.append(one.get(*OUTPUTS))
    found = importer(fmu)
    np.testing.assert_array_equal(found[-COUNT:], expected)
    assert np.abs(found[:, 0]).max() > 1e-3
