"""One mass on one spring under four base motions: sine, swept sine, half-sine shock, band-limited random vibration.

    python -m strandspring.examples.shaken_mass [--backend python]

In static equilibrium the mount is in the middle of its range. The shock is simulated in the coordinate of the mount,
q = mass minus base, with the inertia force of the base motion as a load; the others by moving the base of the spring.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..cosimulation import FmuSpring, Iterative, Master, Motion, Plant, energy_balance, one_mass, simulate
from .excitations import GRAVITY, BandLimitedRandom, HalfSine, Sine, Sweep
from .mounts import EQUIPMENT_MOUNT, build_example_fmu, example_arguments

MASS = 5.0  # kg
LOAD = EQUIPMENT_MOUNT.kE[0]  # N: static equilibrium at the mount's offset
MIDDLE = EQUIPMENT_MOUNT.displacement_offset

SINE = Sine(amplitude=0.004, frequency=7.0)
SWEEP = Sweep(amplitude=0.0012, low=3.0, high=25.0, duration=1.0)
SHOCK = HalfSine(peak=20.0 * GRAVITY, duration=0.011)
RANDOM = BandLimitedRandom(density=0.02 * GRAVITY**2, low=15.0, high=80.0, lines=80, seed=810)


@dataclass(frozen=True)
class Case:
    """One excitation, with end and step of the simulation [s]."""

    name: str
    excitation: Sine | Sweep | HalfSine | BandLimitedRandom
    stop: float
    step: float

    @property
    def relative(self) -> bool:
        """Whether q is the deformation of the mount instead of the position of the mass."""
        return isinstance(self.excitation, HalfSine)

    @property
    def plant(self) -> Plant:
        excitation = self.excitation
        if isinstance(excitation, HalfSine):
            return one_mass(MASS, lambda t: LOAD - MASS * excitation.acceleration(t), offset=MIDDLE)
        return one_mass(MASS, LOAD, excitation.displacement, offset=MIDDLE)


CASES = (
    Case("sine 4 mm, 7 Hz", SINE, 0.6, 2.5e-4),
    Case("sweep 1.2 mm, 3 to 25 Hz in 1 s", SWEEP, 1.0, 2.5e-4),
    Case("half-sine shock 20 g, 11 ms", SHOCK, 0.3, 1.25e-4),
    Case("random 0.02 g^2/Hz, 15 to 80 Hz", RANDOM, 0.5, 1.25e-4),
)


def run(case: Case, fmu: Path, step: float, master: Master | None = None) -> Motion:
    """Simulate a case."""
    with FmuSpring(fmu) as spring:
        return simulate(case.plant, [spring], case.stop, step, master or Iterative())


def absolute_acceleration(case: Case, motion: Motion) -> np.ndarray:
    """Of the mass [m/s^2]."""
    acceleration = motion.acceleration[:, 0]
    if not case.relative:
        return acceleration
    return np.asarray(acceleration + [case.excitation.acceleration(t) for t in motion.times.tolist()])


def main() -> None:
    with example_arguments(__doc__) as (folder, backend):
        fmu = build_example_fmu(EQUIPMENT_MOUNT, "mount", folder, backend)
        for case in CASES:
            motion = run(case, fmu, case.step)
            base = np.array([case.excitation.acceleration(t) for t in motion.times.tolist()])
            mass = absolute_acceleration(case, motion)
            half = motion.times >= 0.5 * case.stop
            print(case.name)
            print(
                f"  peak acceleration   {np.abs(mass).max() / GRAVITY:8.2f} g of the mass, "
                f"{np.abs(base).max() / GRAVITY:.2f} g of the base"
            )
            if not case.relative:
                ratio = np.sqrt(np.mean(mass[half] ** 2) / np.mean(base[half] ** 2))
                print(f"  transmissibility    {ratio:8.2f} (rms acceleration, second half)")
            print(f"  stroke used         {1e3 * motion.stroke[0]:8.2f} mm of {1e3 * 0.06:.0f} mm")
            print(
                f"  energy absorbed     {motion.absorbed_energy[-1, 0]:8.2f} J, balance closes within "
                f"{energy_balance(case.plant, motion).relative_error:.0e} of the energy exchanged"
            )


if __name__ == "__main__":
    main()
