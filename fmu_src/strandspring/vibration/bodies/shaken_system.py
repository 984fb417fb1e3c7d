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
from ..one_mass.harmonic_balance import HARMONICS, SAMPLES, displacement_limits, forcing, linear_motion
from .axis_laws import AxisLaws
from .mounted import MountedSystem
from .shaking import Shaking
from .small_motion import Pose, SmallMotion


class ShakenSystem:
    """A system under one level of excitation.

    Parameters
    ----------
    system : MountedSystem
    pose : Pose                Of static equilibrium, the springs' hysteresis midway.
    shaking : Shaking
    level : float              In its unit, > 0.
    extrapolate : bool         Whether springs may leave their identified ranges.

    Attributes
    ----------
    motion : SmallMotion       About the pose.
    laws : AxisLaws
    balance : BalancedSystem
    linear_motion : callable   Coefficients of the motion of the linearized system at an Omega [rad/s].
    """

    def __init__(
        self, system: MountedSystem, pose: Pose, shaking: Shaking, level: float, extrapolate: bool = True
    ) -> None:
        self.system, self.shaking, self.level = system, shaking, level
        self.motion, self.laws = SmallMotion.about(system, pose), AxisLaws(system)
        motion, laws, springs = self.motion, self.laws, [axis.spring for _, axis in system.axes()]
        low, high = displacement_limits(laws.low, laws.high, extrapolate)
        axes = rows(
            "BalancedAxis",
            len(springs),
            parallel=laws.parallel,
            series=laws.series,
            position=motion.springs,
            damping=[axis.damping for _, axis in system.axes()],
            stop_low=laws.stop_low,
            stop_high=laws.stop_high,
            stop_stiffness=laws.stop_stiffness,
            low=low,
            high=high,
        )
        self.balance = BalancedSystem(
            springs=springs,
            axes=axes,
            basis=fourier_basis(HARMONICS, SAMPLES),
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
