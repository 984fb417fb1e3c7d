"""Two stages: equipment on one spring on a platform, which stands on four equal springs on a shaking base.

    python -m strandspring.examples.equipment_on_platform [--backend python]

The four springs below move alike, so one FMU stands for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..cosimulation import (
    Attachment,
    Iterative,
    Master,
    Motion,
    Plant,
    energy_balance,
    loaded_slowly,
    simulate,
    spring_unit,
)
from .excitations import GRAVITY, Sine
from .mounts import EQUIPMENT_MOUNT, SOFT_CORNER, fmu_of, workplace

EQUIPMENT, PLATFORM = 6.0, 45.0  # kg
BASE = Sine(amplitude=0.0015, frequency=18.0)
STOP = 0.4  # s


def plant() -> Plant:
    """q = positions of the platform and of the equipment, down [m]."""
    below = Attachment([1.0, 0.0], 0.03, BASE.displacement, count=4)
    above = Attachment([-1.0, 1.0], 0.05)
    weight = GRAVITY * np.array([PLATFORM, EQUIPMENT])
    return Plant(np.diag([PLATFORM, EQUIPMENT]), [below, above], lambda _: weight)


@dataclass(frozen=True, eq=False)
class Result:
    """Rest position q, and the motion from there."""

    rest: np.ndarray
    motion: Motion


def run(below: Path, above: Path, step: float, master: Master | None = None) -> Result:
    """Set platform and equipment down, then shake the base."""
    with spring_unit(below, "below") as lower, spring_unit(above, "above") as upper:
        rest = loaded_slowly(plant(), [lower, upper])
        return Result(rest, simulate(plant(), [lower, upper], STOP, step, master or Iterative(), q=rest))


def main() -> None:
    with workplace(__doc__) as (folder, backend):
        below = fmu_of(SOFT_CORNER, "soft_corner", folder, backend)
        above = fmu_of(EQUIPMENT_MOUNT, "equipment_mount", folder, backend)
        result = run(below, above, 2.5e-4)
        motion = result.motion
        half = motion.times >= 0.5 * STOP
        base = BASE.amplitude * (2.0 * np.pi * BASE.frequency) ** 2
        for name, rest, values in zip(("platform", "equipment"), result.rest, motion.acceleration.T, strict=True):
            peak = np.abs(values[half]).max()
            print(
                f"{name:10} rests at {1e3 * rest:6.2f} mm, peak {peak / GRAVITY:.2f} g, ratio to base {peak / base:.2f}"
            )
        for name, stroke, energy in zip(("below", "above"), motion.stroke, motion.absorbed_energy[-1], strict=True):
            print(f"springs {name}: stroke {1e3 * stroke:.2f} mm, absorbed {energy:.3f} J each")
        print(f"energy balance {energy_balance(plant(), motion).error:.0e} of what was exchanged")


if __name__ == "__main__":
    main()
