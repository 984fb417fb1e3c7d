"""Recoil of a gun on its mount: a round gives the recoiling parts an impulse; the spring stops and returns them.

python -m strandspring.examples.recoil [--backend python]
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..cosimulation import FmuSpring, Iterative, Master, Motion, Plant, energy_balance, one_mass, simulate
from .mounts import RECOIL_SPRING, build_example_fmu, example_arguments

MASS = 25.0  # kg, recoiling parts
IMPULSE = 50.0  # N s, of one round
STOP = 0.4  # s


def plant() -> Plant:
    """q is the recoil travel, zero in battery."""
    return one_mass(MASS)


def run(fmu: Path, step: float, master: Master | None = None) -> Motion:
    """Fire one round."""
    with FmuSpring(fmu) as spring:
        return simulate(plant(), [spring], STOP, step, master or Iterative(), velocity=[IMPULSE / MASS])


def main() -> None:
    with example_arguments(__doc__) as (folder, backend):
        motion = run(build_example_fmu(RECOIL_SPRING, "recoil_spring", folder, backend), 2.5e-4)
        q, absorbed = motion.q[:, 0], motion.absorbed_energy[:, 0]
        peak = int(np.argmax(q))
        back = peak + int(np.argmax(q[peak:] <= 0.0))
        energy = 0.5 * IMPULSE**2 / MASS
        print(f"energy of recoil    {energy:8.1f} J")
        print(f"recoil              {1e3 * q[peak]:8.1f} mm after {1e3 * motion.times[peak]:.0f} ms")
        print(f"peak force          {motion.force[:, 0].max():8.0f} N on the mount")
        print(
            f"back in battery     {1e3 * motion.times[back]:8.0f} ms after firing, {-motion.velocity[back, 0]:.2f} m/s"
        )
        print(f"absorbed by then    {absorbed[back]:8.1f} J, {100.0 * absorbed[back] / energy:.0f} % of the recoil's")
        print(f"overrun             {-1e3 * q.min():8.1f} mm")
        print(f"energy balance      {energy_balance(plant(), motion).relative_error:8.0e} of the energy exchanged")


if __name__ == "__main__":
    main()
