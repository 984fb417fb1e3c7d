"""An SSP system: a plant FMU and the spring FMU in one .ssp file, run by FMPy and by libcosim.

    python -m strandspring.examples.ssp_system [--backend python]

Both couple as `Jacobi()` does: each FMU steps with the outputs of the other at the beginning of the step. That is of
first order and adds energy, so the step must be small. FMPy starts with every connector at zero, which suits a spring
whose displacement and force are zero in static equilibrium.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import ParameterSet, read_ssv

from ..exchange.ssp import ShakenMass, write_system
from ..model.modelfile import ModelFile
from .excitations import Sine
from .mounts import RECOIL_SPRING, build_example_fmu, example_arguments

MASS = 10.0  # kg
BASE = Sine(amplitude=0.004, frequency=7.0)
STOP = 0.4  # s


@dataclass(frozen=True, eq=False)
class Run:
    """Position of the mass [m] and force of the spring [N] at times [s], each of shape (K + 1,)."""

    times: np.ndarray
    position: np.ndarray
    force: np.ndarray


def build(folder: Path, spring: Path) -> Path:
    """Write the .ssp file of the plant and a spring FMU, with the parameter values of the recoil spring."""
    plant = ShakenMass(MASS, 0.0, BASE.amplitude, BASE.frequency)
    return write_system(folder / "shaken_mass.ssp", spring, ModelFile("recoil", RECOIL_SPRING), plant)


def parameters(ssp: Path) -> ParameterSet:
    """The parameter values of both components for FMPy, which does not look for them in the .ssp file."""
    every = ParameterSet(name="system")
    for component in ("plant", "spring"):
        for parameter in read_ssv(str(ssp), f"resources/{component}.ssv").parameters:
            parameter.name = f"{component}.{parameter.name}"
            every.parameters.append(parameter)
    return every


def run_fmpy(ssp: Path, step: float, stop: float = STOP) -> Run:
    """Run FMPy's SSP simulation; the time in each of its rows is that of the beginning of the step."""
    # FMPy sums up the time: half a step less prevents an extra step by rounding.
    rows = simulate_ssp(str(ssp), stop_time=stop - 0.5 * step, step_size=step, parameter_set=parameters(ssp))
    columns = ([0.0, *(rows["time"] + step)], [0.0, *rows["plant.position"]], [0.0, *rows["spring.force"]])
    return Run(*map(np.array, columns))


def run_libcosim(ssp: Path, step: float, stop: float = STOP) -> Run:
    """Run libcosim with its fixed-step algorithm; its times are in nanoseconds."""
    # Imported here, because libcosimpy does not exist for macOS and Python 3.10.
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_ssp_file(str(ssp), round(1e9 * step))
    observer = CosimObserver.create_time_series(buffer_size=100_000)
    execution.add_observer(observer)
    observed = []
    for component, name in (("plant", "position"), ("spring", "force")):
        index = execution.slave_index_from_instance_name(component)
        (reference,) = (v.reference for v in execution.slave_variables(index) if v.name.decode() == name)
        observer.start_time_series(index, reference, CosimVariableType.REAL)
        observed.append((index, reference))
    if not execution.simulate_until(round(1e9 * stop)):
        raise RuntimeError("libcosim could not simulate the system")
    columns = []
    for index, reference in observed:
        times, _, samples = observer.time_series_real_samples(index, reference, 1, round(stop / step))
        columns.append([0.0, *samples])
    return Run(np.array([0.0, *(1e-9 * t for t in times)]), *map(np.array, columns))


def main() -> None:
    with example_arguments(__doc__) as (folder, backend):
        ssp = build(folder, build_example_fmu(RECOIL_SPRING, "mount", folder, backend))
        for step in (2e-4, 1e-4):
            for name, run in (("FMPy", run_fmpy), ("libcosim", run_libcosim)):
                result = run(ssp, step)
                print(
                    f"{name:8} at {1e3 * step:.1f} ms: largest excursion {1e3 * np.abs(result.position).max():.3f} mm, "
                    f"largest force {np.abs(result.force).max():.2f} N"
                )


if __name__ == "__main__":
    main()
