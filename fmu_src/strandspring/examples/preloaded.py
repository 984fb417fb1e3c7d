"""A preloaded mount: the weight of a mass loads it slowly, then the base vibrates about the static equilibrium.

python -m strandspring.examples.preloaded [--backend python]
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..cosimulation import FmuSpring, Master, Plant, one_mass
from .excitations import GRAVITY, Sine
from .loaded import LoadedMotion, simulate_loaded
from .mounts import EQUIPMENT_MOUNT, build_example_fmu, example_arguments

MASS = 20.0  # kg
UNLOADED = 0.0475  # m: start of the path, with no mass on the mount
BASE = Sine(amplitude=0.002, frequency=10.0)
STOP = 0.6  # s


def plant() -> Plant:
    """q is zero where the mount is unloaded, positive downwards."""
    return one_mass(MASS, MASS * GRAVITY, BASE.displacement, offset=UNLOADED)


def run(fmu: Path, step: float, master: Master | None = None) -> LoadedMotion:
    """Load the mount slowly by the mass, then vibrate the base."""
    with FmuSpring(fmu) as spring:
        return simulate_loaded(plant(), [spring], STOP, step, master)


def main() -> None:
    with example_arguments(__doc__) as (folder, backend):
        result = run(build_example_fmu(EQUIPMENT_MOUNT, "mount", folder, backend), 2.5e-4)
        motion = result.motion
        (sag,) = result.equilibrium
        half = motion.times >= 0.5 * STOP
        deviation = motion.q[half, 0] - sag
        acceleration = motion.acceleration[half, 0]
        print(f"static sag          {1e3 * sag:8.2f} mm under {MASS * GRAVITY:.0f} N")
        print(f"mean offset         {1e3 * 0.5 * (deviation.max() + deviation.min()):8.2f} mm below it under vibration")
        print(f"transmissibility    {np.ptp(motion.q[half, 0]) / (2.0 * BASE.amplitude):8.2f} at {BASE.frequency:g} Hz")
        print(f"peak acceleration   {np.abs(acceleration).max() / GRAVITY:8.2f} g")
        print(f"stroke used         {1e3 * motion.stroke[0]:8.2f} mm")


if __name__ == "__main__":
    main()
