"""The steady force of a period: against many periods in time, and its Jacobian against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from periodic_spring import PeriodicSpring, functions_at
from strandspring import Spring, SpringParameters
from strandspring.kernel.periodic import FourierBasis
from synthetic import spring_of

SPRINGS = [(0.22, 0.6), (1.0, 1.0), (2.5, 3.0)]


def coefficients(basis: FourierBasis, mean: float, amplitude: float, wild: float) -> np.ndarray:
    """A motion with inner loops where `wild` is large."""
    c = np.zeros(basis.order.size)
    c[0], c[1], c[basis.harmonics + 2] = mean, amplitude, 0.3 * wild * amplitude
    c[3], c[basis.harmonics + 4] = wild * amplitude, 0.2 * amplitude * wild
    return c


@pytest.mark.parametrize(("n", "sigma"), SPRINGS)
@pytest.mark.parametrize(("wild", "turns"), [(0.0, 2), (0.6, 6)])
def test_the_steady_force_is_that_of_many_periods(n: float, sigma: float, wild: float, turns: int) -> None:
    p, basis, fine = spring_of(n, sigma), FourierBasis(9, 256), 16
    motion = coefficients(basis, p.displacement_offset, 0.01, wild)
    found = PeriodicSpring(p, basis).respond(motion)
    phase = 2.0 * np.pi * np.arange(10 * 256 * fine) / (256 * fine)
    force = Spring(p).response(functions_at(basis, phase) @ motion)[-256 * fine :: fine]
    assert found.turns.size == turns
    # The path misses the turning points by up to an 8192th of a period, (2 pi/8192)^2/2 = 3e-7 of the amplitude, and
    # half of that of the inner loops' curvature; a cusp of omega (n < 1) makes ten times as much of it.
    assert found.force == pytest.approx(force, abs=1e-5 * np.ptp(force))


@pytest.mark.parametrize(("harmonics", "samples"), [(11, 256), (5, 128), (7, 100), (1, 8), (3, 12)])
def test_samples_and_coefficients_belong_to_the_series(harmonics: int, samples: int) -> None:
    """Also where the samples of a quarter are not a multiple of what is computed at once."""
    p, basis = spring_of(1.0, 1.0), FourierBasis(harmonics, samples)
    motion = np.random.default_rng(harmonics).normal(0.0, 0.003, basis.order.size)
    motion[0] = p.displacement_offset
    found = PeriodicSpring(p, basis).respond(motion)
    functions = basis.functions.T
    assert found.displacement == pytest.approx(functions @ motion, abs=1e-15)
    # The turning points alternate, the highest first, and enclose all samples.
    assert found.turns.size % 2 == 0
    assert np.all(np.diff(found.turns) * (-1.0) ** np.arange(found.turns.size - 1) < 0.0)
    assert found.turns[0] == found.turns.max() >= found.displacement.max() - 1e-15
    assert found.turns.min() <= found.displacement.min() + 1e-15


def jacobian_by_differences(p: SpringParameters, basis: FourierBasis, motion: np.ndarray, step: float) -> np.ndarray:
    """Central differences of the force's coefficients."""
    spring, columns = PeriodicSpring(p, basis), []
    for unit in np.eye(motion.size):
        more, less = (spring.respond(motion + sign * step * unit).coefficients for sign in (1.0, -1.0))
        columns.append((more - less) / (2.0 * step))
    return np.array(columns).T


# The last amplitude saturates the hysteresis on every stroke: each begins at omega = -1 or 1.
@pytest.mark.parametrize(("n", "sigma"), SPRINGS)
@pytest.mark.parametrize("wild", [0.0, 0.6])
@pytest.mark.parametrize("amplitude", [1e-4, 1e-3, 1e-2, 0.3])
def test_the_jacobian_is_that_of_finite_differences(n: float, sigma: float, wild: float, amplitude: float) -> None:
    p, basis = spring_of(n, sigma), FourierBasis(5, 128)
    motion = coefficients(basis, p.displacement_offset, amplitude, wild)
    exact = PeriodicSpring(p, basis).respond(motion).jacobian
    numeric = jacobian_by_differences(p, basis, motion, 1e-5 * amplitude)
    error = np.abs(numeric - exact) / np.abs(exact).max()
    # Samples at a reversal, a cusp of omega (n < 1) or the end of the identified range see a kink within the step,
    # which is 1e-5 of the motion; the others leave 1e-9.
    assert np.median(error) < 1e-6
    assert error.max() < 2e-5


def test_a_constant_displacement_is_refused() -> None:
    p, basis = spring_of(1.0, 1.0), FourierBasis(5, 128)
    motion = np.zeros(basis.order.size)
    motion[0] = p.displacement_offset
    with pytest.raises(ValueError, match="got a constant displacement"):
        PeriodicSpring(p, basis).respond(motion)


@pytest.mark.parametrize(("harmonics", "samples"), [(0, 16), (1, 7), (8, 16), (3, 10)])
def test_impossible_bases_are_refused(harmonics: int, samples: int) -> None:
    with pytest.raises(ValueError, match="`harmonics` must be >= 1 and `samples`"):
        FourierBasis(harmonics, samples)
