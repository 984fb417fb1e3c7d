"""Two stages: equipment on one spring on a platform, which stands on four equal springs on a vibrating base.

    python -m strandspring.examples.equipment_on_platform [--backend python]

The four lower springs have the same displacement, so one FMU represents all of them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..cosimulation import Attachment, FmuSpring, Master, Plant, energy_balance
from .excitations import GRAVITY, Sine
from .loaded import LoadedMotion, simulate_loaded
from .mounts import EQUIPMENT_MOUNT, SOFT_CORNER, build_example_fmu, example_arguments

EQUIPMENT, PLATFORM = 6.0, 45.0  # kg
BASE = Sine(amplitude=0.0015, frequency=18.0)
STOP = 0.4  # s


def plant() -> Plant:
    """q = positions of the platform and of the equipment, down [m]."""
    below = Attachment([1.0, 0.0], 0.03, BASE.displacement, count=4)
    above = Attachment([-1.0, 1.0], 0.05)
    weight = GRAVITY * np.array([PLATFORM, EQUIPMENT])
    return Plant(np.diag([PLATFORM, EQUIPMENT]), [below, above], lambda _: weight)


def run(below: Path, above: Path, step: float, master: Master | None = None) -> LoadedMotion:
    """Load the springs by the weights, then vibrate the base."""
    with FmuSpring(below, "below") as lower, FmuSpring(above, "above") as upper:
        return simulate_loaded(plant(), [lower, upper], STOP, step, master)


def main() -> None:
    with example_arguments(__doc__) as (folder, backend):
        below = build_example_fmu(SOFT_CORNER, "soft_corner", folder, backend)
        above = build_example_fmu(EQUIPMENT_MOUNT, "equipment_mount", folder, backend)
        result = run(below, above, 2.5e-4)
        motion = result.motion
        half = motion.times >= 0.5 * STOP
        base = BASE.amplitude * (2.0 * np.pi * BASE.frequency) ** 2
        for name, sag, values in zip(("platform", "equipment"), result.equilibrium, motion.acceleration.T, strict=True):
            peak = np.abs(values[half]).max()
            print(
                f"{name:10} static equilibrium at {1e3 * sag:6.2f} mm, peak {peak / GRAVITY:.2f} g, "
                f"{peak / base:.2f} times that of the base"
            )
        for name, stroke, energy in zip(("below", "above"), motion.stroke, motion.absorbed_energy[-1], strict=True):
            print(f"springs {name}: stroke {1e3 * stroke:.2f} mm, absorbed {energy:.3f} J each")
        print(f"energy balance {energy_balance(plant(), motion).relative_error:.0e} of the energy exchanged")


if __name__ == "__main__":
    main()
