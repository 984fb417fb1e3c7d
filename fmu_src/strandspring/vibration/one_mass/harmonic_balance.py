"""Steady periodic motion of a mass on a mount by harmonic balance with alternating frequency and time.

The motion is a Fourier series; the springs' force is taken in time, where the closed form gives a whole period at
once, and brought back by its projection. The balance of each harmonic,

    -m*(k*Omega)^2*z_k + i*c*k*Omega*z_k + P*[r(z/S)]_k = L*[k = 0] + (excitation)*[k = 1],

is solved by Newton's method with exact derivatives, in the compiled kernel.
"""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray
from ...kernel.balance import BalancedMass
from ...kernel.periodic import fourier_basis
from .system import Excitation, IsolatedMass, StaticEquilibrium

# The force has kinks at the reversals, so that its harmonics fall with k^2 and those of the motion with k^4.
HARMONICS = 11
SAMPLES = 256


class HarmonicBalance(BalancedMass):
    """The balance of one system under one level of excitation.

    Parameters
    ----------
    system : IsolatedMass
    excitation : Excitation
    level : float              Amplitude [m], [m/s^2] or [N], > 0.
    harmonics, samples : int   H of the Fourier series and K per period; H >= 1, K > 2H.
    """

    def __init__(
        self,
        system: IsolatedMass,
        excitation: Excitation,
        level: float,
        harmonics: int = HARMONICS,
        samples: int = SAMPLES,
    ) -> None:
        self.system = system
        self.excitation = excitation
        self.level = level
        force = level if excitation is Excitation.FORCE else 0.0
        self.degrees = 1
        self._forcing = force if excitation is not Excitation.BASE_ACCELERATION else -system.mass * level
        self._forcing_by_square = system.mass * level if excitation is Excitation.BASE_DISPLACEMENT else 0.0
        super().__init__(
            system.spring,
            fourier_basis(harmonics, samples),
            parallel=system.parallel,
            series=system.series,
            mass=system.mass,
            damping=system.damping,
            static_load=system.static_load,
            forcing=self._forcing,
            forcing_by_square=self._forcing_by_square,
            force_on_mass=force,
        )

    def at_level(self, level: float) -> HarmonicBalance:
        """The same balance at another level."""
        return HarmonicBalance(self.system, self.excitation, level, self.basis.harmonics, self.basis.samples)

    @property
    def level_text(self) -> str:
        """The level in the unit that people read."""
        return self.excitation.level_text(self.level)

    def linear_motion(self, equilibrium: StaticEquilibrium, omega: float) -> FloatArray:
        """Coefficients of the motion with the stiffness of small motion, at resonance with a loss factor of a tenth."""
        system = self.system
        z = np.zeros(self.basis.order.size)
        z[0] = system.series * equilibrium.displacement
        dynamic = equilibrium.stiffness - system.mass * omega**2 + 1j * omega * system.damping
        size = max(abs(dynamic), 0.1 * equilibrium.stiffness)
        forcing = self._forcing + self._forcing_by_square * omega**2
        z[1] = forcing / size * (1.0 if dynamic.real >= 0.0 else -1.0)
        return z
