"""Recoil of a gun on its mount: a round gives the recoiling parts an impulse; springs stop and return them.

python -m strandspring.examples.recoil prints what happens and draws it in recoil.png.

The parts lie between two of the paper's springs, one behind and one in front, both compressed by its pre-deformation in
battery. Recoil compresses one and relaxes the other, so that neither comes loose.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from strandspring import Spring
from strandspring.cosimulation import Attachment, FmuSpring, Motion, Plant, simulate

from .paper import PRE_DEFORMATION, SPRING

MASS = 12.0  # kg, recoiling parts
IMPULSE = 12.0  # N s, of one round
STOP = 0.4  # s


def plant() -> Plant:
    """q is the recoil travel, zero in battery."""
    return Plant([[MASS]], [Attachment([1.0], PRE_DEFORMATION), Attachment([-1.0], PRE_DEFORMATION)])


def fire(fmu: Path, step: float) -> Motion:
    """Fire one round; `simulate` couples the mass to the FMUs by the iterative master."""
    with FmuSpring(fmu, "behind") as behind, FmuSpring(fmu, "in_front") as in_front:
        return simulate(plant(), [behind, in_front], STOP, step, velocity=[IMPULSE / MASS])


def main() -> None:
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        motion = fire(Spring(SPRING, "recoil_spring").build_fmu(folder, zero=0.0), 2.5e-4)
    q, force, absorbed = motion.q[:, 0], motion.force @ [1.0, -1.0], motion.absorbed_energy.sum(axis=1)
    peak = int(np.argmax(q))
    back = peak + int(np.argmax(q[peak:] <= 0.0))
    energy = 0.5 * IMPULSE**2 / MASS
    print(f"energy of recoil    {energy:8.1f} J")
    print(f"recoil              {1e3 * q[peak]:8.1f} mm after {1e3 * motion.times[peak]:.0f} ms")
    print(f"peak force          {force.max():8.0f} N on the mount")
    print(f"back in battery     {1e3 * motion.times[back]:8.0f} ms after firing, {-motion.velocity[back, 0]:.2f} m/s")
    print(f"absorbed by then    {absorbed[back]:8.1f} J, {100.0 * absorbed[back] / energy:.0f} % of the recoil's")
    print(f"overrun             {-1e3 * q.min():8.1f} mm")

    figure = Figure((9.0, 4.0), layout="constrained")
    travel, loop = figure.subplots(1, 2)
    travel.plot(1e3 * motion.times, 1e3 * q)
    travel.set(xlabel="time [ms]", ylabel="recoil travel [mm]")
    loop.plot(1e3 * q, force)
    loop.set(xlabel="recoil travel [mm]", ylabel="force on the mount [N]")
    figure.savefig("recoil.png")


if __name__ == "__main__":
    main()
