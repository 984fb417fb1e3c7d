"""Classic and normalized Bouc-Wen models, and their conversion to parameters of this package, paper eqs. (1)-(5)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..core.parameters import SpringParameters


@dataclass(frozen=True)
class ClassicBoucWen:
    """The classic model, paper eqs. (1)-(2); different parameter sets can give the same response.

    r = alpha*k*x + (1 - alpha)*D*k*z,
    D*dz/dt = A*dx/dt - beta*|dx/dt|*|z|^(n-1)*z - gamma*dx/dt*|z|^n.

    Parameters
    ----------
    alpha : float        Ratio of post-yield to pre-yield stiffness [-], 0 < alpha < 1.
    k : float            Stiffness [N/m], > 0.
    D : float            Yield displacement [m], > 0.
    A, beta, gamma, n : float   Shape parameters [-]; A > 0, n > 0, beta + gamma > 0, beta >= gamma.
    """

    alpha: float
    k: float
    D: float
    A: float
    beta: float
    gamma: float
    n: float

    def __post_init__(self) -> None:
        checks = (
            ("alpha", 0.0 < self.alpha < 1.0, "within (0, 1)"),
            ("k", self.k > 0.0, "> 0 [N/m]"),
            ("D", self.D > 0.0, "> 0 [m]"),
            ("A", self.A > 0.0, "> 0"),
            ("n", self.n > 0.0, "> 0"),
            ("beta", self.beta + self.gamma > 0.0, "above -gamma (paper eq. 6)"),
            ("beta", self.beta - self.gamma >= 0.0, "at least gamma (paper eq. 6)"),
        )
        for name, satisfied, condition in checks:
            if not (satisfied and math.isfinite(getattr(self, name))):
                raise ValueError(f"`{name}` must be {condition}, got {getattr(self, name)!r}.")

    def to_normalized(self) -> NormalizedBoucWen:
        """The normalized model with the same response, paper eqs. (3)-(5)."""
        z0 = (self.A / (self.beta + self.gamma)) ** (1.0 / self.n)
        return NormalizedBoucWen(
            kappa_x=self.alpha * self.k,
            kappa_omega=(1.0 - self.alpha) * self.D * self.k * z0,
            rho=self.A / (self.D * z0),
            sigma=self.beta / (self.beta + self.gamma),
            n=self.n,
        )


@dataclass(frozen=True)
class NormalizedBoucWen:
    """The normalized model of Ikhouane, paper eqs. (3)-(4); each response has one parameter set.

    r = kappa_x*x + kappa_omega*omega, with omega of eq. (11).

    Parameters
    ----------
    kappa_x : float       Elastic stiffness [N/m], > 0.
    kappa_omega : float   Saturated hysteretic force [N], > 0.
    rho : float           [1/m], > 0.
    sigma, n : float      [-], sigma >= 1/2, n > 0.
    """

    kappa_x: float
    kappa_omega: float
    rho: float
    sigma: float
    n: float

    def __post_init__(self) -> None:
        if not (self.kappa_x > 0.0 and math.isfinite(self.kappa_x)):
            raise ValueError(f"`kappa_x` must be > 0 [N/m], got {self.kappa_x!r}.")

    def to_classic(self, D: float, A: float = 1.0) -> ClassicBoucWen:
        """The classic model with the same response and the given D [m] and A.

        Both can be chosen freely, as the classic model has two redundant parameters; A = 1 and D = 1/rho give z0 = 1.
        """
        z0 = A / (D * self.rho)
        beta_plus_gamma = A / z0**self.n  # eq. (5)
        # From kappa_x = alpha*k and kappa_omega = (1 - alpha)*D*k*z0.
        k = self.kappa_x + self.kappa_omega / (D * z0)
        return ClassicBoucWen(
            alpha=self.kappa_x / k,
            k=k,
            D=D,
            A=A,
            beta=self.sigma * beta_plus_gamma,
            gamma=(1.0 - self.sigma) * beta_plus_gamma,
            n=self.n,
        )

    def to_parameters(self, displacement_min: float, displacement_max: float) -> SpringParameters:
        """Parameters of this package for the same response, valid over a range of displacement [m]."""
        offset = 0.5 * (displacement_min + displacement_max)
        return SpringParameters(
            kE=(self.kappa_x * offset, self.kappa_x),
            kA=(1.0,),
            kappa_omega=self.kappa_omega,
            rho=self.rho,
            sigma=self.sigma,
            n=self.n,
            displacement_offset=offset,
            displacement_min=displacement_min,
            displacement_max=displacement_max,
        )
