"""A preloaded mount: the mass sets down on it, then the base shakes it about where it rests.

python -m strandspring.examples.preloaded [--backend python]
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..cosimulation import Iterative, Master, Motion, Plant, loaded_slowly, one_mass, simulate, spring_unit
from .excitations import GRAVITY, Sine
from .mounts import EQUIPMENT_MOUNT, fmu_of, workplace

MASS = 20.0  # kg
UNLOADED = 0.0475  # m: where the path starts, with nothing on the mount
BASE = Sine(amplitude=0.002, frequency=10.0)
STOP = 0.6  # s


def plant(base: Sine = BASE) -> Plant:
    """q is zero where the mount is unloaded, and counts down."""
    return one_mass(MASS, MASS * GRAVITY, base.displacement, offset=UNLOADED)


@dataclass(frozen=True, eq=False)
class Result:
    """Rest position q [m], and the motion about it."""

    rest: float
    motion: Motion


def run(fmu: Path, step: float, master: Master | None = None) -> Result:
    """Set the mass down slowly, then shake."""
    with spring_unit(fmu) as spring:
        rest = loaded_slowly(plant(), [spring])
        return Result(float(rest[0]), simulate(plant(), [spring], STOP, step, master or Iterative(), q=rest))


def main() -> None:
    with workplace(__doc__) as (folder, backend):
        result = run(fmu_of(EQUIPMENT_MOUNT, "mount", folder, backend), 2.5e-4)
        motion = result.motion
        half = motion.times >= 0.5 * STOP
        about = motion.q[half, 0] - result.rest
        shaken = motion.acceleration[half, 0]
        print(f"static sag          {1e3 * result.rest:8.2f} mm under {MASS * GRAVITY:.0f} N")
        print(f"mean offset         {1e3 * 0.5 * (about.max() + about.min()):8.2f} mm below it while shaken")
        print(f"transmissibility    {np.ptp(motion.q[half, 0]) / (2.0 * BASE.amplitude):8.2f} at {BASE.frequency:g} Hz")
        print(f"peak acceleration   {np.abs(shaken).max() / GRAVITY:8.2f} g")
        print(f"stroke used         {1e3 * motion.stroke[0]:8.2f} mm")


if __name__ == "__main__":
    main()
