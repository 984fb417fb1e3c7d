"""What a spring may have beside the paper's: a second friction mechanism, and Maxwell branches.

    F = FE(x) + sum over one or two mechanisms of kappa_omega*FA(x)*omega + sum over at most three branches of r,
    dr/dt = c dx/dt - r/tau.

The second mechanism has an omega of its own by the paper's equation, with its own parameters. A Maxwell branch is a
spring of stiffness c and a dashpot of viscosity c*tau in series; where tau is small it is that dashpot alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

# How many friction mechanisms and Maxwell branches a spring may have.
MECHANISMS, BRANCHES = 2, 3
# Of a time constant [s].
TIME_CONSTANT_RANGE = (1e-9, 1e9)


def as_coefficients(name: str, values: Any) -> tuple[float, ...]:
    """A sequence of numbers as floats; raises TypeError for what is taken apart into characters, or has no order."""
    if isinstance(values, (str, bytes, set, frozenset)):
        raise TypeError(f"`{name}` must be a sequence of numbers, got {values!r}.")
    return tuple(map(float, values))


@dataclass(frozen=True)
class Mechanism:
    """A second friction mechanism kappa_omega*FA(x)*omega, in the symbols and within the limits of `SpringParameters`.

    Parameters
    ----------
    kA : tuple of float     Amplifier coefficients of ascending powers of displacement - displacement_offset [1/m^i];
                            kA[0] = 1.
    kappa_omega : float     Hysteretic force at the offset when saturated [N], > 0.
    rho : float             Slope of omega at its zero crossing [1/m], > 0.
    sigma : float           Recovery after a reversal [-], >= 1/2.
    n : float               Smoothness exponent [-], > 0.

    Raises
    ------
    TypeError               If coefficients are text or a set.
    """

    kA: tuple[float, ...]
    kappa_omega: float
    rho: float
    sigma: float
    n: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "kA", as_coefficients("second.kA", self.kA))


@dataclass(frozen=True)
class MaxwellBranch:
    """A branch r with dr/dt = stiffness*dx/dt - r/time_constant.

    Parameters
    ----------
    stiffness : float       c, what it adds to the stiffness of fast motion [N/m], >= 0.
    time_constant : float   tau, in which its force decays to 1/e at rest [s], > 0.
    """

    stiffness: float
    time_constant: float

    def dynamic_stiffness(self, frequency: float) -> complex:
        """Force over displacement of harmonic motion at Omega [rad/s]: c*i*Omega*tau/(1 + i*Omega*tau) [N/m]."""
        turns = 1j * frequency * self.time_constant
        return self.stiffness * turns / (1.0 + turns)
