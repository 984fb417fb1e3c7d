"""Harmonic balance of rigid bodies on mounts, to second order in their rotations from static equilibrium.

The coordinates are the D free ones of the bodies (`small_motion`), on which the axes of the mounts act (see
`kernel/c/balance/balance.h`). What is left out is of third order in the rotations, and of second where the base turns
or a force turns with its body.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ...kernel.balance import BalancedSystem
from ...kernel.periodic import fourier_basis
from ...kernel.structures import rows
from ..one_mass.harmonic_balance import HARMONICS, displacement_limits, forcing, linear_motion
from .shaking import Shaking
from .small_motion import SmallMotion

_SAMPLES = 128  # of a period; 512 of them change gains by 1e-5


class ShakenSystem:
    """A system under one level of excitation.

    Parameters
    ----------
    motion : SmallMotion       About static equilibrium, the springs' hysteresis midway.
    shaking : Shaking
    level : float              In its unit, > 0.
    extrapolate : bool         Whether springs may leave their identified ranges.

    Attributes
    ----------
    system : MountedSystem
    balance : BalancedSystem
    linear_motion : callable   Coefficients of the motion of the linearized system at an Omega [rad/s].
    """

    def __init__(self, motion: SmallMotion, shaking: Shaking, level: float, extrapolate: bool = True) -> None:
        self.motion, self.shaking, self.level, self.system = motion, shaking, level, motion.system
        laws, springs = self.system.laws, [axis.spring for axis in self.system.axes]
        low, high = displacement_limits(laws.low, laws.high, extrapolate)
        axes = rows(
            "BalancedAxis",
            len(springs),
            parallel=laws.parallel,
            series=laws.series,
            position=motion.springs,
            damping=laws.damping,
            stop_low=laws.stop_low,
            stop_high=laws.stop_high,
            stop_stiffness=laws.stop_stiffness,
            low=low,
            high=high,
        )
        self.balance = BalancedSystem(
            springs=springs,
            axes=axes,
            basis=fourier_basis(HARMONICS, _SAMPLES),
            mass=motion.mass,
            along=motion.along,
            bend=motion.bend,
            load=motion.weight,
            forcing=forcing(shaking.kind, level, *shaking.forcing(motion)),
            level_text=shaking.level_text(level),
        )
        forces = laws.forces(motion.springs, np.zeros(len(springs)))
        self.linear_motion = partial(linear_motion, self.balance, laws.tangents(motion.springs), forces)

    @property
    def moves(self) -> bool:
        """Whether some body is free to follow the excitation."""
        return bool(np.any(self.balance.forcing))
