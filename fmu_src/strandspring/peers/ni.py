"""Ni's modified Bouc-Wen model, paper eqs. (26)-(29), which made the data of the paper's simulated experiment.

    r  = F2*(Z + F1)                                                      (26)
    F1 = K1*x + K2*sgn(x)*x^2 + K3*x^3                                    (27)
    F2 = B^(C*x)                                                          (28)
    dZ = dx*{eta - [theta + lambda*sgn(dx)*sgn(Z)]*|Z|^n}                 (29)

With z0 = (eta/(theta + lambda))^(1/n) and omega = Z/z0, eq. (29) is the normalized eq. (11) with

    rho = eta/z0,   sigma = lambda/(theta + lambda),

so that Z has the closed form of `strandspring.core.saturation`: no differential equation is solved.

Units are the paper's own, unlike elsewhere in this package: displacement in mm, force in N. The paper prints
eq. (28) as "BCx" and gives no n. Only the product C*ln(B), here `growth`, can be identified; B and C are kept
apart for the paper's numbers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike

from ..core.parameters import N_RANGE, SIGMA_RANGE, SpringParameters
from ..kernel.arrays import FloatArray
from ..kernel.path import PathSolver, as_path
from ..kernel.steady import steady_omega

_MOST_PERIODS = 1000  # until the memory is steady; one if there are two strokes
_LARGEST_LOG = 200.0  # of z0 and rho, so that their products stay finite


@dataclass(frozen=True)
class NiParameters:
    """Parameters of Ni's model, in mm and N; the force is zero at displacement 0 when Z is.

    Parameters
    ----------
    K1, K2, K3 : float       Elastic part [N/mm], [N/mm^2], [N/mm^3].
    B, C : float             Base [-], > 0, and exponent [1/mm] of the amplifier.
    eta : float              Slope of Z at its zero crossing [N/mm], > 0.
    theta, lambda_ : float   Shape [N^(1-n)/mm]; theta + lambda > 0 (bounded Z) and lambda >= theta, which is
                             sigma >= 1/2 (paper eqs. 6-7).
    n : float                Smoothness [-]; 0.222 reproduces the paper's rms force at the amplitude 5 mm.

    Raises
    ------
    ValueError               If the parameters are not physically possible or outside the closed form's range.
    """

    K1: float
    K2: float
    K3: float
    B: float
    C: float
    eta: float
    theta: float
    lambda_: float
    n: float = 0.222

    def __post_init__(self) -> None:
        for field in fields(self):
            if not math.isfinite(getattr(self, field.name)):
                raise ValueError(f"`{field.name}` must be finite, got {getattr(self, field.name)!r}.")
        checks = (
            ("B", self.B > 0.0, "> 0"),
            ("eta", self.eta > 0.0, "> 0 [N/mm]"),
            ("lambda_", self.theta + self.lambda_ > 0.0, "above -theta (paper eq. 6)"),
            ("lambda_", self.lambda_ >= self.theta, "at least theta (paper eq. 6)"),
            ("n", N_RANGE[0] <= self.n <= N_RANGE[1], f"within [{N_RANGE[0]:g}, {N_RANGE[1]:g}]"),
        )
        for name, holds, condition in checks:
            if not holds:
                raise ValueError(f"`{name}` must be {condition}, got {getattr(self, name)!r}.")
        if self.sigma > SIGMA_RANGE[1]:
            raise ValueError(f"`lambda_`/(theta + lambda_) must be at most {SIGMA_RANGE[1]:g}, got {self.sigma!r}.")
        # In logarithms, since the power itself could overflow.
        log_z0 = math.log(self.eta / (self.theta + self.lambda_)) / self.n
        if max(abs(log_z0), abs(math.log(self.eta) - log_z0)) > _LARGEST_LOG:
            raise ValueError(
                f"`n` must keep z0 = (eta/(theta + lambda))^(1/n) [N] and eta/z0 [1/mm] within 1e-86 and 1e86, got "
                f"{self.n!r} with ln(z0) = {log_z0:.4g}."
            )

    @property
    def growth(self) -> float:
        """C*ln(B), the rate at which the amplifier grows [1/mm]."""
        return self.C * math.log(self.B)

    @property
    def z0(self) -> float:
        """Z when saturated [N]."""
        return float((self.eta / (self.theta + self.lambda_)) ** (1.0 / self.n))

    @property
    def rho(self) -> float:
        """Slope of Z/z0 at its zero crossing [1/mm]."""
        return self.eta / self.z0

    @property
    def sigma(self) -> float:
        """Recovery after a reversal [-]."""
        return self.lambda_ / (self.theta + self.lambda_)

    def elastic(self, displacement: FloatArray) -> FloatArray:
        """F1 of eq. (27) [N]."""
        x = displacement
        return np.asarray(x * (self.K1 + np.abs(x) * self.K2 + x * x * self.K3))

    def amplifier(self, displacement: FloatArray) -> FloatArray:
        """F2 of eq. (28) [-]."""
        return np.exp(self.growth * displacement)

    def steady_force(self, period: ArrayLike) -> FloatArray:
        """Force of eq. (26) over one period of the steady state [N].

        Parameters
        ----------
        period : array_like, shape (K,)   One period [mm]; its first sample follows its last.
        """
        path = as_path(period)
        top = int(np.argmax(path))
        # Begun and ended at its top, so that the memory at the start is that at the end.
        rolled = np.append(np.roll(path, -top), path[top])
        if np.ptp(rolled) == 0.0:
            raise ValueError(f"`period` must move forth and back, got {path.size} samples at {path[0]!r} mm.")
        spring = self._normalized()
        solver, omega = PathSolver(spring), np.array([steady_omega(spring, float(np.ptp(rolled)))])
        for _ in range(_MOST_PERIODS):
            begun, omega = omega[-1], solver.omega(rolled, float(omega[-1]))
            if abs(omega[-1] - begun) < 1e-13:
                break
        Z = np.roll(self.z0 * omega[:-1], top)
        return np.asarray(self.amplifier(path) * (Z + self.elastic(path)))

    def _normalized(self) -> SpringParameters:
        """The spring whose omega is Z/z0, with lengths in mm.

        Beyond these limits of rho, omega stays where it is, or is saturated after any step, within rounding.
        """
        rho = min(max(self.rho, 1e-14), 1e11)
        reach = min(1.0 / rho, 1e5)
        return SpringParameters((0.0,), (1.0,), 1.0, rho, self.sigma, self.n, 0.0, -reach, reach)


# Section 4 of the paper; B and C enter the force through C*ln(B) only.
PAPER_NI = NiParameters(
    K1=39.145, K2=1.360, K3=0.156, B=1.799, C=0.202, eta=147.761, theta=15.512, lambda_=44.726, n=0.222
)


def sine_period(amplitude: float, samples: int) -> FloatArray:
    """One period of x = X*sin(t), paper eq. (30), without the first sample of the next one; X in mm."""
    return np.asarray(amplitude * np.sin(2.0 * np.pi * np.arange(samples) / samples))


def with_noise(force: FloatArray, level: float, seed: int) -> FloatArray:
    """r*(1 + eps*R) of paper eq. (31), eps = `level`; R is standard normal, as the paper does not say."""
    return np.asarray(force * (1.0 + level * np.random.default_rng(seed).standard_normal(force.size)))
