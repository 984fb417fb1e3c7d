"""Whatever spring the limits allow, nothing that is computed of it overflows; both kernels have the same limits."""

from __future__ import annotations

import re

import numpy as np
import pytest

from kernel_tools import KERNEL, FloatArray, Kernel
from strandspring import SpringParameters
from strandspring.core import parameters as limits
from strandspring.core import stepper
from strandspring.core.branches import TIME_CONSTANT_RANGE
from strandspring.core.law import SpringLaw
from strandspring.core.parameters import LARGEST_DISPLACEMENT
from tools import slow_but

pytestmark = pytest.mark.long

# A third of these is also computed by the stepper of Python, which is what takes the time.
SEEDS = slow_but(range(300), range(25))


def log_uniform(random: np.random.Generator, low: float, high: float) -> float:
    """Within [low, high], at an end one time in three."""
    share = random.choice([0.0, 1.0, random.random()], p=[1 / 6, 1 / 6, 2 / 3])
    return float(np.clip(low * (high / low) ** share, low, high))


def extreme_spring(random: np.random.Generator) -> SpringParameters:
    """A spring anywhere within the limits, often at them; with terms that cancel or do not."""
    width = log_uniform(random, *limits.WIDTH_RANGE)
    low = float(random.choice([-0.5 * width, 0.0, -LARGEST_DISPLACEMENT if width > 1.0 else -width]))
    high = low + width
    offset = float(random.choice([low, high, 0.5 * (low + high)]))
    # Rounding may have moved the ends.
    width, reach = high - low, max(offset - low, high - offset)

    def terms(count: int, largest: float) -> list[float]:
        """Coefficients of terms that reach up to the largest value."""
        sizes = [0.9 * largest * random.choice([1.0, 1e-3, 0.0, 1e-30]) / reach**i for i in range(count)]
        return [float(size * random.choice([-1.0, 1.0])) for size in sizes]

    is_table = random.random() < 0.3
    knots = low + width * np.linspace(0.0, 1.0, int(random.integers(7, 26)))
    knots[1:-1] += 0.4 * (knots[1] - knots[0]) * random.uniform(-1.0, 1.0, len(knots) - 2)
    knots[[0, -1]] = low, high
    # FA > 0: terms of one sign where x is.
    side = 1.0 if offset == low else -1.0
    amplifier = [abs(term) * side**i for i, term in enumerate(terms(int(random.integers(1, 10)), 1e9))]
    if offset not in (low, high):
        amplifier = [abs(term) if i % 2 == 0 else 0.0 for i, term in enumerate(amplifier)]
    return SpringParameters(
        kE=() if is_table else tuple(terms(int(random.integers(1, 22)), 1e15)),
        kA=(1.0, *amplifier[1:]),
        kappa_omega=log_uniform(random, *limits.FORCE_RANGE),
        rho=log_uniform(random, limits.SATURATION_RANGE[0] / width, limits.SATURATION_RANGE[1] / width),
        sigma=log_uniform(random, *limits.SIGMA_RANGE),
        n=log_uniform(random, *limits.N_RANGE),
        displacement_offset=offset,
        displacement_min=low,
        displacement_max=high,
        FE_knots=tuple(knots) if is_table else (),
        FE_forces=tuple(terms(1, 1e15)[0] for _ in knots) if is_table else (),
    )


def extreme_path(random: np.random.Generator, p: SpringParameters) -> FloatArray:
    """Steps of all sizes within and far beyond the range, and to the ends of the world."""
    inside = random.uniform(p.displacement_min, p.displacement_max, 20)
    near = inside + random.standard_normal(20) * 10.0 ** random.uniform(-12.0, 3.0, 20) / p.rho
    ends = random.choice([-LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT, 0.0], 8)
    path = np.concatenate([inside, near, ends, [p.displacement_min, p.displacement_max, p.displacement_offset]])
    return np.clip(random.permutation(path), -LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT)


@pytest.mark.parametrize("seed", SEEDS)
def test_whatever_is_computed_within_the_limits_is_finite(seed: int) -> None:
    random = np.random.default_rng(seed)
    spring = extreme_spring(random)
    path = extreme_path(random, spring)
    omega_start = float(random.choice([-1.0, 0.0, 1e-300, 1.0]))
    kernel = Kernel(spring)
    assert np.all(np.isfinite(kernel.path(path, omega_start))), spring
    for gradients in kernel.gradients(path, omega_start):
        assert all(np.all(np.isfinite(np.frombuffer(bytes(gradient)))) for gradient in gradients), spring
    if seed % 3 == 0:
        assert np.all(np.isfinite(by_the_stepper(spring, path, omega_start))), spring


def by_the_stepper(spring: SpringParameters, path: FloatArray, omega_start: float) -> FloatArray:
    law = SpringLaw(spring)
    memory = stepper.start(float(path[0]), omega_start)
    rows = []
    for displacement in path.tolist():
        memory = stepper.trial(law, memory, displacement)
        energy = stepper.absorbed_energy(law, memory)
        rows.append([*memory, stepper.force(law, memory), stepper.stiffness(law, memory), energy])
    return np.array(rows)


def test_both_kernels_have_the_same_limits() -> None:
    text = (KERNEL / "spring_limits.h").read_text()
    found = {name: float(value) for name, value in re.findall(r"([A-Z][A-Z_]+) = ([-+.e\d]+)", text)}
    assert found == {
        "SPRING_COEFFICIENTS": limits.MAXIMUM_DEGREE + 1,
        "SPRING_AMPLIFIERS": limits.MAXIMUM_AMPLIFIER_DEGREE + 1,
        "SPRING_KNOTS": limits.KNOTS[1],
        "N_LOW": limits.N_RANGE[0],
        "N_HIGH": limits.N_RANGE[1],
        "SIGMA_LOW": limits.SIGMA_RANGE[0],
        "SIGMA_HIGH": limits.SIGMA_RANGE[1],
        "LEAST_SPACING": limits.LEAST_SPACING,
        "LEAST_TIME_CONSTANT": TIME_CONSTANT_RANGE[0],
        "LARGEST_TIME_CONSTANT": TIME_CONSTANT_RANGE[1],
        "LARGEST_DISPLACEMENT": limits.LARGEST_DISPLACEMENT,
        "LEAST_WIDTH": limits.WIDTH_RANGE[0],
        "LARGEST_WIDTH": limits.WIDTH_RANGE[1],
        "LEAST_FORCE": limits.FORCE_RANGE[0],
        "LARGEST_FORCE": limits.FORCE_RANGE[1],
        "LEAST_SATURATION": limits.SATURATION_RANGE[0],
        "LARGEST_SATURATION": limits.SATURATION_RANGE[1],
        "LARGEST_AMPLIFIER": limits.LARGEST_AMPLIFIER,
        "LEAST_AMPLIFIER": limits.LEAST_AMPLIFIER,
        "LARGEST_VELOCITY": 1e9,  # only the native FMU has derivatives of its input
        "LARGEST_START_XI": limits.LARGEST_START_XI,
        "LARGEST_SUM": limits.LARGEST_SUM,
    }


def test_the_least_value_of_what_overflows_is_not_skipped() -> None:
    # Horner's rule makes no NaN of finite coefficients.
    assert limits.least_value((1.0, 1e308, -1e308), 0.0, 1e3) == (-np.inf, 1e3)
    assert np.isnan(limits.least_value((1.0, np.nan, 1.0), -1.0, 1.0)[0])
