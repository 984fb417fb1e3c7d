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


def drawn_own_record(seed: int) -> Record:
    """The record of a drawn spring of the model's class: 40 to 800 samples a cycle, noise of 0 to 3 % of the force's
    standard deviation, and a displacement as it is, in 300 or in 65 536 steps.
    """
    draw = np.random.default_rng(seed)
    amplitude, kappa = 10.0 ** draw.uniform(-3.0, -1.5), 10.0 ** draw.uniform(0.0, 2.0)
    reach = 1.3 * amplitude
    elastic = [draw.uniform(*ends) for ends in ((-3.0, 3.0), (2.0, 12.0), (-2.0, 2.0), (0.0, 5.0))]
    spring = SpringParameters(
        kE=tuple(kappa * value / amplitude**i for i, value in enumerate(elastic)),
        kA=(1.0, draw.uniform(-0.4, 0.4) / amplitude, draw.uniform(-0.2, 0.4) / amplitude**2),
        kappa_omega=kappa * draw.uniform(0.2, 4.0),
        rho=60.0 ** draw.uniform() / amplitude,
        sigma=0.5 * 10.0 ** draw.uniform(),
        n=0.1 * 40.0 ** draw.uniform(),
        displacement_offset=0.0,
        displacement_min=-reach,
        displacement_max=reach,
    )
    samples, cycles = int(40.0 * 20.0 ** draw.uniform()), int(draw.integers(3, 7))
    time = np.arange(samples * cycles + 1) / samples
    courses = [
        np.ones(time.size), np.minimum(1.0, time / cycles + 0.1), 1.0 - 0.85 * time / cycles,
        np.where(time < 0.5 * cycles, 1.0, 0.5),
    ]  # fmt: skip
    path = amplitude * courses[draw.integers(4)] * np.sin(2.0 * np.pi * time)
    force = Spring(spring).response(path)
    noisy = force + draw.choice([0.0, 0.002, 0.01, 0.03]) * np.std(force) * draw.standard_normal(force.size)
    levels = draw.choice([0, 300, 65_536])
    step = 2.0 * reach / levels if levels else 0.0
    return Record(np.round(path / step) * step if levels else path, noisy, time, f"drawn_{seed}.csv")
