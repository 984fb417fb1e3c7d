"""An SSP system: a shaken mass and the FMU of its spring in one .ssp file, run by FMPy.

python -m strandspring.examples.ssp_system prints what happens and draws it in ssp_system.png.

Each FMU steps with the outputs of the other at the beginning of the step, as by `cosimulation.Jacobi`. That is of first
order and adds energy, so the step must be small. FMPy and Ecos ignore the parameter sets of the .ssp file: they run the
start values of the FMUs, which are the same until a parameter set is edited.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssv
from matplotlib.figure import Figure

from strandspring import Spring, export

from .paper import SPRING

MASS = 25.0  # kg, whose weight compresses the spring to about the middle of its range
PERIODS = 6  # of the base


def run(ssp: Path, step: float, stop: float) -> np.ndarray:
    """Times [s], position of the mass [m] and force of the spring [N], shape (3, K + 1)."""
    # FMPy sums up the time: half a step less prevents an extra step by rounding. The time in each of its rows is
    # that of the beginning of the step.
    rows = simulate_ssp(str(ssp), stop_time=stop - 0.5 * step, step_size=step)
    columns = (rows["time"] + step, rows["plant.position"], rows["spring.force"])
    return np.array([[0.0, *column] for column in columns])


def main() -> None:
    figure = Figure((7.0, 4.0), layout="constrained")
    axes = figure.subplots()
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        (ssp,) = export(Spring(SPRING, "shaken_mass"), folder, ssp_mass=MASS)
        values = {value.name: float(value.value) for value in read_ssv(str(ssp), "resources/plant.ssv").parameters}
        for step in (2e-4, 1e-4):
            times, position, force = run(ssp, step, PERIODS / values["frequency"])
            print(
                f"steps of {1e3 * step:.1f} ms: largest excursion {1e3 * np.abs(position).max():.3f} mm, "
                f"largest force {np.abs(force).max():.2f} N"
            )
            axes.plot(times, 1e3 * position, label=f"steps of {1e3 * step:.1f} ms")
    axes.set(xlabel="time [s]", ylabel="position of the mass [mm]")
    axes.legend()
    figure.savefig("ssp_system.png")


if __name__ == "__main__":
    main()
