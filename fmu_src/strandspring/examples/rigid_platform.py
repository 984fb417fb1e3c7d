"""A rigid platform on four springs of two kinds, in heave, pitch and roll, driven over wavy ground.

    python -m strandspring.examples.rigid_platform [--backend python]

The heavy end stands on the stiffer springs. The ground lifts the two axles one after the other, the right side more
than the left.
"""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..cosimulation import Attachment, FmuSpring, Master, Plant, energy_balance
from .excitations import GRAVITY, Sine
from .loaded import LoadedMotion, simulate_loaded
from .mounts import SOFT_CORNER, STIFF_CORNER, build_example_fmu, example_arguments

MASS, PITCH_INERTIA, ROLL_INERTIA = 60.0, 8.0, 3.5  # kg, kg m^2
FRONT, REAR, HALF_TRACK = 0.5, 0.4, 0.3  # m, from the centre of gravity
STOP = 0.4  # s
START = 0.03  # m: compression of the springs where q is zero
WAVE = Sine(amplitude=0.0025, frequency=6.0)
LAG = 0.045  # s, from the front axle to the rear one


@dataclass(frozen=True)
class Corner:
    """Position of a spring [m], and the motion of the ground below it."""

    name: str
    ahead: float
    right: float
    share: float
    lag: float

    def ground(self, t: float) -> float:
        return self.share * WAVE.displacement(t - self.lag)

    def ground_velocity(self, t: float) -> float:
        return self.share * WAVE.velocity(t - self.lag)


CORNERS = (
    Corner("front left", FRONT, -HALF_TRACK, 0.8, 0.0),
    Corner("front right", FRONT, HALF_TRACK, 1.0, 0.0),
    Corner("rear left", -REAR, -HALF_TRACK, 0.8, LAG),
    Corner("rear right", -REAR, HALF_TRACK, 1.0, LAG),
)
MODELS = (SOFT_CORNER, SOFT_CORNER, STIFF_CORNER, STIFF_CORNER)


def plant() -> Plant:
    """q = heave (down) [m], pitch (front down) [rad], roll (right side down) [rad]."""
    springs = [Attachment([1.0, c.ahead, c.right], START, c.ground) for c in CORNERS]
    return Plant(np.diag([MASS, PITCH_INERTIA, ROLL_INERTIA]), springs, lambda _: [MASS * GRAVITY, 0.0, 0.0])


def run(soft: Path, stiff: Path, step: float, master: Master | None = None) -> LoadedMotion:
    """Load the springs by the platform's weight, then drive."""
    with ExitStack() as stack:
        springs = [
            stack.enter_context(FmuSpring(fmu, corner.name))
            for fmu, corner in zip((soft, soft, stiff, stiff), CORNERS, strict=True)
        ]
        return simulate_loaded(plant(), springs, STOP, step, master)


def main() -> None:
    with example_arguments(__doc__) as (folder, backend):
        soft = build_example_fmu(SOFT_CORNER, "soft_corner", folder, backend)
        stiff = build_example_fmu(STIFF_CORNER, "stiff_corner", folder, backend)
        result = run(soft, stiff, 5e-4)
        motion = result.motion
        heave, pitch, roll = result.equilibrium
        print(
            f"static equilibrium: heave {1e3 * heave:.2f} mm, "
            f"pitch {np.degrees(pitch):.3f} deg, roll {np.degrees(roll):.3f} deg"
        )
        for name, values, unit, factor in zip(
            ("heave", "pitch", "roll"), motion.q.T, ("mm", "deg", "deg"), (1e3, *[np.degrees(1.0)] * 2), strict=True
        ):
            print(f"{name:6} range {factor * np.ptp(values):8.3f} {unit}")
        print(f"peak acceleration {np.abs(motion.acceleration[:, 0]).max() / GRAVITY:.2f} g at the centre of gravity")
        for corner, stroke, force in zip(CORNERS, motion.stroke, motion.force.T, strict=True):
            print(f"{corner.name:12} stroke {1e3 * stroke:6.2f} mm, force {force.min():4.0f} to {force.max():4.0f} N")
        balance = energy_balance(plant(), motion)
        print(f"work of the ground {balance.base_work[-1]:.2f} J")
        print(f"energy balance closes within {balance.relative_error:.0e} of the energy exchanged")


if __name__ == "__main__":
    main()
