"""Steady periodic motion of a mass on a mount by harmonic balance with alternating frequency and time.

The motion is a Fourier series; the springs' force is taken in time, where the closed form gives a whole period at
once, and brought back by its projection. The balance of each harmonic,

    -m*(k*Omega)^2*z_k + i*c*k*Omega*z_k + P*[r(z/S)]_k = L*[k = 0] + (excitation)*[k = 1],

is solved by Newton's method with exact derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernel.arrays import FloatArray
from .periodic import FourierBasis, PeriodicForce, PeriodicSpring
from .system import Excitation, IsolatedMass

# The force has kinks at the reversals, so that its harmonics fall with k^2 and those of the motion with k^4.
HARMONICS = 11
SAMPLES = 256
_STEPS = 40
_TOLERANCE = 1e-8  # of the largest term of the balance
_ROUNDING = 1e-7  # of the same: good enough where no step comes nearer
_HALVINGS = 8


@dataclass(frozen=True, eq=False)
class Balance:
    """The balance at one motion and frequency.

    Attributes
    ----------
    residual : ndarray, shape (2H + 1,)            Unbalanced force per Fourier coefficient [N].
    jacobian : ndarray, shape (2H + 1, 2H + 1)     Its derivatives by the coefficients of z [N/m].
    by_frequency : ndarray, shape (2H + 1,)        Its derivative by Omega [N s].
    scale : float                                  Largest term [N].
    spring : PeriodicForce                         What one spring does.
    """

    residual: FloatArray
    jacobian: FloatArray
    by_frequency: FloatArray
    scale: float
    spring: PeriodicForce


class HarmonicBalance:
    """The balance of one system under one level of excitation.

    Parameters
    ----------
    system : IsolatedMass
    excitation : Excitation
    level : float              Amplitude [m], [m/s^2] or [N], > 0.
    harmonics, samples : int
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
        self.basis = FourierBasis(harmonics, samples)
        self._spring = PeriodicSpring(system.spring, self.basis)
        self._order = np.concatenate([[0], self.basis.order, self.basis.order]).astype(np.float64)

    def at_level(self, level: float) -> HarmonicBalance:
        """The same balance at another level."""
        return HarmonicBalance(self.system, self.excitation, level, self.basis.harmonics, self.basis.phase.size)

    def forcing(self, omega: float) -> tuple[float, float]:
        """Amplitude of the force cos(Omega t) on the mass in relative coordinates [N], and its derivative by Omega."""
        m = self.system.mass
        if self.excitation is Excitation.BASE_DISPLACEMENT:
            return m * omega**2 * self.level, 2.0 * m * omega * self.level
        return (-m * self.level if self.excitation is Excitation.BASE_ACCELERATION else self.level), 0.0

    def at(self, z: FloatArray, omega: float) -> Balance:
        """The balance of a motion with coefficients z of shape (2H + 1,) [m] at Omega [rad/s]."""
        system, basis = self.system, self.basis
        spring = self._spring.respond(z / system.series)
        of_spring = system.parallel * (basis.projection @ spring.force)
        jacobian = system.stiffness_scale * (basis.projection @ spring.derivatives)
        mass = -system.mass * (self._order * omega) ** 2
        speed = basis.differentiate(z)
        damping = system.damping * omega * speed
        inertia = mass * z
        residual = of_spring + inertia + damping
        residual[0] -= system.static_load
        force, by_omega = self.forcing(omega)
        residual[1] -= force
        at = np.arange(z.size)
        jacobian[at, at] += mass
        half = basis.harmonics
        cosine, sine = at[1 : half + 1], at[half + 1 :]
        jacobian[cosine, sine] += system.damping * omega * basis.order
        jacobian[sine, cosine] -= system.damping * omega * basis.order
        by_frequency = 2.0 * inertia / omega + system.damping * speed
        by_frequency[1] -= by_omega
        # The static part, which may be far larger, is balanced as finely.
        scale = max(abs(force), *(float(np.abs(part[1:]).max()) for part in (of_spring, inertia, damping)))
        return Balance(residual, jacobian, by_frequency, scale, spring)

    def solve(self, guess: FloatArray, omega: float) -> tuple[FloatArray, Balance] | None:
        """Newton's method at a fixed frequency; None if it does not converge."""
        z, found = guess, self.at(guess, omega)
        for _ in range(_STEPS):
            size = float(np.abs(found.residual).max())
            if size <= _TOLERANCE * found.scale:
                return z, found
            try:
                step = np.linalg.solve(found.jacobian, -found.residual)
            except np.linalg.LinAlgError:
                return None
            share = 1.0
            for _ in range(_HALVINGS):
                trial = z + share * step
                if np.any(trial[1:]):
                    there = self.at(trial, omega)
                    if float(np.abs(there.residual).max()) < size:
                        break
                share *= 0.5
            else:
                return (z, found) if size <= _ROUNDING * found.scale else None
            z, found = trial, there
        return None
