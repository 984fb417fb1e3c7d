"""The balance of a mass on springs: its derivatives, Newton's method, the sweep."""

from __future__ import annotations

import numpy as np
import pytest

from periodic_spring import PeriodicSpring
from springs import MOUNT, TABLE
from strandspring import SpringParameters
from strandspring.kernel.balance import BalancedSystem
from strandspring.kernel.periodic import fourier_basis
from strandspring.kernel.structures import rows

BASIS = fourier_basis(7, 128)
ANYWHERE = (-np.inf, np.inf)


def mass_on(spring: SpringParameters, limits: tuple[float, float] = ANYWHERE) -> BalancedSystem:
    """Three rows of two springs."""
    axes = rows("BalancedAxis", 1, parallel=3.0, series=2.0, position=MOUNT.displacement_offset, damping=15.0)
    axes["stop_low"], axes["stop_high"] = ANYWHERE
    axes["low"], axes["high"] = limits
    return BalancedSystem(
        springs=[spring], axes=axes, basis=BASIS, mass=5.0, along=np.ones((1, 1)), bend=np.zeros((1, 1, 1)),
        load=np.array([150.0]), forcing=np.array([[20.0], [1e-3], [7e3]]), level_text="",
    )  # fmt: skip


def motion(amplitude: float) -> np.ndarray:
    z = amplitude * np.random.default_rng(1).normal(0.0, 1.0, BASIS.order.size) / (1.0 + BASIS.order**3)
    z[0] = 0.0
    return z


def test_the_residual_is_that_of_the_equation_of_motion() -> None:
    z, omega = motion(5e-3), 60.0
    found = mass_on(MOUNT).at(z, omega)
    of_spring = 0.5 * z
    of_spring[0] += MOUNT.displacement_offset
    spring = PeriodicSpring(MOUNT, BASIS).respond(of_spring)
    functions, order = BASIS.functions.T, BASIS.order
    half = BASIS.harmonics
    speed = omega * np.concatenate([[0.0], order[half + 1 :] * z[half + 1 :], -order[1 : half + 1] * z[1 : half + 1]])
    acting = 150.0 + (20.0 + 1e-3 * omega**2 + 7e3 / omega**2) * functions[:, 1]
    linear = 15.0 * speed - 5.0 * omega**2 * order**2 * z
    unbalanced = 3.0 * spring.force + functions @ linear - acting
    share = np.where(order > 0.0, 2.0, 1.0) / BASIS.samples
    assert found.residual == pytest.approx(share * (functions.T @ unbalanced), abs=1e-12 * found.scale)
    low, high, start, cosine, sine = found.motion.figures[0].tolist()
    assert (low, high, start) == (spring.turns.min(), spring.turns.max(), spring.omega[0])
    of_force = 3.0 * spring.coefficients + 15.0 * speed
    assert [cosine, sine] == pytest.approx([of_force[1], of_force[1 + half]], rel=1e-12)
    assert found.motion.force[0] == pytest.approx(3.0 * spring.force + 15.0 * functions @ speed, rel=1e-12)


@pytest.mark.parametrize("amplitude", [1e-3, 1e-2])
@pytest.mark.parametrize("spring", [MOUNT, TABLE], ids=["polynomial", "table"])
def test_derivatives_are_those_of_finite_differences(spring: SpringParameters, amplitude: float) -> None:
    mass, z, omega = mass_on(spring), motion(amplitude), 60.0
    found, step = mass.at(z, omega), 1e-5 * amplitude
    for k, unit in enumerate(np.eye(z.size)):
        more, less = (mass.at(z + sign * step * unit, omega).residual for sign in (1.0, -1.0))
        # Samples beside a kink of omega (n < 1), as in test_periodic.py.
        tolerance = 2e-5 * np.abs(found.jacobian).max()
        assert (more - less) / (2.0 * step) == pytest.approx(found.jacobian[:, k], abs=tolerance)
    more, less = (mass.at(z, omega + sign * 1e-4).residual for sign in (1.0, -1.0))
    # Differences of numbers of the scale's size, 1e-16 of it over 1e-4.
    assert (more - less) / 2e-4 == pytest.approx(found.by_frequency, abs=1e-11 * found.scale)


def test_a_sweep_ends_where_the_motion_goes_beyond_the_limits() -> None:
    mass, logs = mass_on(MOUNT), np.log(np.linspace(30.0, 80.0, 41))
    start = np.zeros(BASIS.order.size)
    start[1] = 1e-3
    solved = mass.solve(start, float(np.exp(logs[0])))
    assert solved is not None
    everything = mass.sweep(float(logs[0]), solved.z, logs[1:])
    assert len(everything) == 40
    highest = np.array([motion.high[0] for motion in everything])
    limit = 0.5 * (solved.high[0] + highest.max())
    limited = mass_on(MOUNT, (-np.inf, limit))
    some = limited.sweep(float(logs[0]), solved.z, logs[1:])
    assert len(some) == np.flatnonzero(highest > limit)[0] + 1
    assert [limited.is_beyond(motion) for motion in some] == [False] * (len(some) - 1) + [True]
    for steady, log in zip(everything[::8], logs[1::8], strict=True):
        found = mass.at(steady.z, float(np.exp(log)))
        assert np.abs(found.residual).max() <= 1e-9 * found.scale  # what Newton's method is stopped at
        # Newton's method from there stays there.
        again = mass.solve(steady.z, float(np.exp(log)))
        assert again is not None
        assert again.z == pytest.approx(steady.z, abs=1e-15)


def test_what_does_not_move_has_no_balance() -> None:
    mass, z = mass_on(MOUNT), np.zeros(BASIS.order.size)
    with pytest.raises(ValueError, match="got constant displacements"):
        mass.at(z, 60.0)
    assert mass.solve(z, 60.0) is None
    assert mass.sweep(4.0, z, np.array([4.1, 4.2])) == []
