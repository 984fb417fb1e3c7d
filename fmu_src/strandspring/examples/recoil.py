"""Recoil of a gun on its mount: a round gives the recoiling parts an impulse; the spring stops and returns them.

python -m strandspring.examples.recoil prints what happens and draws it in recoil.png.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from strandspring import Spring, SpringParameters
from strandspring.cosimulation import FmuSpring, Motion, Plant, one_mass, simulate

# Plausible, not measured. 0 is the battery position, where the spring is unloaded.
SPRING = SpringParameters(
    kE=(0.0, 1.2e4, 4.0e4, 1.0e6), kA=(1.0, 4.0), kappa_omega=160.0, rho=150.0, sigma=1.5, n=0.7,
    displacement_offset=0.0, displacement_min=-0.06, displacement_max=0.08,
)  # fmt: skip
MASS = 25.0  # kg, recoiling parts
IMPULSE = 50.0  # N s, of one round
STOP = 0.4  # s


def plant() -> Plant:
    """q is the recoil travel, zero in battery."""
    return one_mass(MASS)


def fire(fmu: Path, step: float) -> Motion:
    """Fire one round; `simulate` couples the mass to the FMU by the iterative master."""
    with FmuSpring(fmu) as spring:
        return simulate(plant(), [spring], STOP, step, velocity=[IMPULSE / MASS])


def main() -> None:
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        motion = fire(Spring(SPRING, "recoil_spring").build_fmu(folder, zero=0.0), 2.5e-4)
    q, force, absorbed = motion.q[:, 0], motion.force[:, 0], motion.absorbed_energy[:, 0]
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
