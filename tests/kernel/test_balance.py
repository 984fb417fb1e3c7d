"""The balance of a mass on springs: derivatives, Newton's method, the sweep."""

from __future__ import annotations

import numpy as np
import pytest

from kernel_tools import FloatArray
from springs import EXAMPLES, MOUNT, TABLE
from strandspring import SpringParameters
from strandspring.kernel.balance import BalancedSystem
from strandspring.kernel.periodic import FourierBasis, fourier_basis
from strandspring.kernel.structures import rows

OMEGA = 60.0  # rad/s


def mass_on(
    spring: SpringParameters, basis: FourierBasis, limits: tuple[float, float] = (-np.inf, np.inf), bend: float = 0.0
) -> BalancedSystem:
    """Three rows of two springs, moved by z + bend*z^2/2."""
    axes = rows("BalancedAxis", 1, parallel=3.0, series=2.0, position=spring.displacement_offset, damping=15.0)
    axes["stop_low"], axes["stop_high"] = -np.inf, np.inf
    axes["low"], axes["high"] = limits
    return BalancedSystem(
        springs=[spring], axes=axes, basis=basis, mass=5.0, along=np.ones((1, 1)), bend=np.full((1, 1, 1), bend),
        load=np.array([150.0]), forcing=np.array([[20.0], [1e-3]]), level_text="",
    )  # fmt: skip


def motion(basis: FourierBasis, amplitude: float) -> FloatArray:
    z = amplitude * np.random.default_rng(1).normal(0.0, 1.0, basis.order.size) / (1.0 + basis.order**3)
    z[0] = 0.0
    return z


@pytest.mark.parametrize("bend", [0.0, 0.002])  # products beyond the basis are left out of the Jacobian
@pytest.mark.parametrize("amplitude", [1e-4, 1e-3, 1e-2, 0.3])  # the last saturates on every stroke
@pytest.mark.parametrize("spring", [MOUNT, TABLE, EXAMPLES["hardening"]], ids=["cusp", "table", "smooth"])
def test_derivatives_are_those_of_finite_differences(spring: SpringParameters, amplitude: float, bend: float) -> None:
    basis = fourier_basis(7, 128)
    mass, z = mass_on(spring, basis, bend=bend / amplitude), motion(basis, amplitude)
    found, step = mass.at(z, OMEGA), 1e-5 * amplitude
    errors = []
    for k, unit in enumerate(np.eye(z.size)):
        more, less = (mass.at(z + sign * step * unit, OMEGA).residual for sign in (1.0, -1.0))
        errors.append(np.abs((more - less) / (2.0 * step) - found.jacobian[:, k]) / np.abs(found.jacobian).max())
    # Samples at a reversal, a cusp of omega (n < 1) or the end of the identified range see a kink within the step,
    # which is 1e-5 of the motion; the others leave 1e-9.
    assert np.median(errors) < 1e-6
    assert np.max(errors) < 2e-5
    more, less = (mass.at(z, OMEGA + sign * 1e-4).residual for sign in (1.0, -1.0))
    # Differences of numbers of the scale's size, 1e-16 of it over 1e-4.
    assert (more - less) / 2e-4 == pytest.approx(found.by_frequency, abs=1e-11 * found.scale)


def test_a_sweep_ends_where_the_motion_goes_beyond_the_limits() -> None:
    basis = fourier_basis(7, 128)
    mass, logs = mass_on(MOUNT, basis), np.log(np.linspace(30.0, 80.0, 41))
    solved = mass.solve(1e-3 * np.eye(basis.order.size)[1], float(np.exp(logs[0])))
    assert solved is not None
    everything = mass.sweep(float(logs[0]), solved.z, logs[1:])
    assert len(everything) == 40
    highest = np.array([motion.high[0] for motion in everything])
    limit = 0.5 * (solved.high[0] + highest.max())
    limited = mass_on(MOUNT, basis, (-np.inf, limit))
    some = limited.sweep(float(logs[0]), solved.z, logs[1:])
    assert len(some) == np.flatnonzero(highest > limit)[0] + 1
    assert [limited.is_beyond(motion) for motion in some] == [False] * (len(some) - 1) + [True]
    for steady, log in zip(everything[::8], logs[1::8], strict=True):
        found = mass.at(steady.z, float(np.exp(log)))
        assert np.abs(found.residual).max() <= 1e-9 * found.scale  # what Newton's method is stopped at


def test_what_does_not_move_has_no_balance_and_impossible_bases_are_refused() -> None:
    basis = fourier_basis(7, 128)
    mass, z = mass_on(MOUNT, basis), np.zeros(basis.order.size)
    with pytest.raises(ValueError, match="got constant displacements"):
        mass.at(z, OMEGA)
    assert mass.solve(z, OMEGA) is None
    assert mass.sweep(4.0, z, np.array([4.1, 4.2])) == []
    for harmonics, samples in ((0, 16), (1, 7), (8, 16), (3, 10)):
        with pytest.raises(ValueError, match="`harmonics` must be >= 1 and `samples`"):
            FourierBasis(harmonics, samples)
