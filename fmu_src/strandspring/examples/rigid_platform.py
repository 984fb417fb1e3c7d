"""A rigid platform on four springs of two kinds, in heave, pitch and roll, driven over wavy ground.

python -m strandspring.examples.rigid_platform prints what happens and draws it in rigid_platform.png.

The heavy end stands on the stiffer springs. The platform first sinks under its weight; then the ground lifts the two
axles one after the other, the right side more than the left. Each spring is an FMU; the platform is a linear plant.
"""

from __future__ import annotations

import math
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from strandspring import Spring, SpringParameters
from strandspring.cosimulation import Attachment, FmuSpring, Motion, Plant, apply_static_load, simulate

# Two mounts of one series, plausible, not measured, compressed by 30 mm where q is zero.
SOFT = SpringParameters(
    kE=(120.0, 1.5e4, 8.0e4, 1.0e7), kA=(1.0, 6.0), kappa_omega=18.0, rho=350.0, sigma=1.2, n=0.8,
    displacement_offset=0.03, displacement_min=0.01, displacement_max=0.05,
)  # fmt: skip
STIFF = SpringParameters(
    kE=(180.0, 2.4e4, 1.2e5, 1.5e7), kA=(1.0, 8.0, 60.0), kappa_omega=30.0, rho=300.0, sigma=1.0, n=0.6,
    displacement_offset=0.03, displacement_min=0.01, displacement_max=0.05,
)  # fmt: skip
COMPRESSION = 0.03  # m

GRAVITY = 9.80665  # m/s^2
MASS, PITCH_INERTIA, ROLL_INERTIA = 60.0, 8.0, 3.5  # kg, kg m^2
FRONT, REAR, HALF_TRACK = 0.5, 0.4, 0.3  # m, from the centre of gravity
WAVE, FREQUENCY = 0.0025, 2.0 * math.pi * 6.0  # m, rad/s
LAG = 0.045  # s, from the front axle to the rear one
STOP = 0.4  # s


@dataclass(frozen=True)
class Corner:
    """A spring and its position [m], and the motion of the ground below it."""

    name: str
    spring: SpringParameters
    ahead: float
    right: float
    share: float
    lag: float

    def ground(self, t: float) -> float:
        return self.share * WAVE * math.sin(FREQUENCY * (t - self.lag))


CORNERS = (
    Corner("front left", SOFT, FRONT, -HALF_TRACK, 0.8, 0.0),
    Corner("front right", SOFT, FRONT, HALF_TRACK, 1.0, 0.0),
    Corner("rear left", STIFF, -REAR, -HALF_TRACK, 0.8, LAG),
    Corner("rear right", STIFF, -REAR, HALF_TRACK, 1.0, LAG),
)


def plant() -> Plant:
    """q = heave (down) [m], pitch (front down) [rad], roll (right side down) [rad]."""
    springs = [Attachment([1.0, c.ahead, c.right], COMPRESSION, c.ground) for c in CORNERS]
    return Plant(np.diag([MASS, PITCH_INERTIA, ROLL_INERTIA]), springs, lambda _: [MASS * GRAVITY, 0.0, 0.0])


def drive(soft: Path, stiff: Path, step: float) -> tuple[np.ndarray, Motion]:
    """Load the springs by the platform's weight, then drive; q in static equilibrium, and the motion from there."""
    with ExitStack() as stack:
        springs = [
            stack.enter_context(FmuSpring(soft if corner.spring is SOFT else stiff, corner.name)) for corner in CORNERS
        ]
        equilibrium = apply_static_load(plant(), springs)
        return equilibrium, simulate(plant(), springs, STOP, step, q=equilibrium)


def main() -> None:
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        soft = Spring(SOFT, "soft_corner").build_fmu(folder, zero=0.0)
        stiff = Spring(STIFF, "stiff_corner").build_fmu(folder, zero=0.0)
        (heave, pitch, roll), motion = drive(soft, stiff, 5e-4)
    print(
        f"static equilibrium: heave {1e3 * heave:.2f} mm, "
        f"pitch {np.degrees(pitch):.3f} deg, roll {np.degrees(roll):.3f} deg"
    )
    q = motion.q * [1e3, np.degrees(1.0), np.degrees(1.0)]
    for name, values, unit in zip(("heave", "pitch", "roll"), q.T, ("mm", "deg", "deg"), strict=True):
        print(f"{name:6} range {np.ptp(values):8.3f} {unit}")
    print(f"peak acceleration {np.abs(motion.acceleration[:, 0]).max() / GRAVITY:.2f} g at the centre of gravity")
    for corner, displacement, force in zip(CORNERS, motion.displacement.T, motion.force.T, strict=True):
        print(
            f"{corner.name:12} stroke {1e3 * np.ptp(displacement):6.2f} mm, "
            f"force {force.min():4.0f} to {force.max():4.0f} N"
        )

    figure = Figure((9.0, 4.0), layout="constrained")
    body, loops = figure.subplots(1, 2)
    body.plot(motion.times, q, label=["heave [mm]", "pitch [deg]", "roll [deg]"])
    body.set(xlabel="time [s]", ylabel="motion of the platform")
    body.legend()
    loops.plot(1e3 * motion.displacement, motion.force, label=[corner.name for corner in CORNERS])
    loops.set(xlabel="compression of the spring [mm]", ylabel="force [N]")
    loops.legend()
    figure.savefig("rigid_platform.png")


if __name__ == "__main__":
    main()
