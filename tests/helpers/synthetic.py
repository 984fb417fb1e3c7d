"""Records of known springs for the tests of identification."""

from __future__ import annotations

import numpy as np

from strandspring import Record, Spring, SpringParameters
from strandspring.core.saturation import Saturation, inverse_saturation

AMPLITUDE = 0.02
MEAN = 0.05


def spring_of(n: float, sigma: float, strokes_in_steady: float = 2.0) -> SpringParameters:
    """A hardening, asymmetric spring whose full stroke is so many times as long as saturation takes.

    Saturation is counted from omega = -1 to omega = 0.98.
    """
    table = Saturation(n, sigma)
    needed = inverse_saturation(table, 0.98) - inverse_saturation(table, -1.0)
    return SpringParameters(
        kE=(5.0, 3000.0, 2e4, 1e6),
        kA=(1.0, 10.0, 100.0),
        kappa_omega=25.0,
        rho=strokes_in_steady * needed / (2.0 * AMPLITUDE),
        sigma=sigma,
        n=n,
        displacement_offset=MEAN,
        displacement_min=MEAN - AMPLITUDE,
        displacement_max=MEAN + AMPLITUDE,
    )


def sine(cycles: int = 3, samples: int = 1500, amplitude: float = AMPLITUDE) -> np.ndarray:
    """Displacement that starts at mid-stroke [m]."""
    return MEAN + amplitude * np.sin(np.linspace(0.0, 2.0 * np.pi * cycles, samples))


def record_of(parameters: SpringParameters, displacement: np.ndarray, noise: float = 0.0, seed: int = 0) -> Record:
    """The record a spring gives, with multiplicative noise (paper eq. 31)."""
    force = Spring(parameters).response(displacement)
    if noise:
        force = force * (1.0 + noise * np.random.default_rng(seed).standard_normal(force.size))
    return Record(displacement, force, path="synthetic.csv")
