"""The balance of a mass on springs: the steady force of a period, derivatives, Newton's method, the sweep."""

from __future__ import annotations

import numpy as np
import pytest

from kernel_tools import FloatArray
from springs import EXAMPLES, MOUNT, TABLE
from strandspring import Spring, SpringParameters
from strandspring.kernel.balance import BalancedSystem
from strandspring.kernel.periodic import FourierBasis, fourier_basis
from strandspring.kernel.structures import rows

OMEGA = 60.0  # rad/s
FINE = 512  # points of a path between samples


def mass_on(
    spring: SpringParameters, basis: FourierBasis, limits: tuple[float, float] = (-np.inf, np.inf)
) -> BalancedSystem:
    """Three rows of two springs."""
    axes = rows("BalancedAxis", 1, parallel=3.0, series=2.0, position=spring.displacement_offset, damping=15.0)
    axes["stop_low"], axes["stop_high"] = -np.inf, np.inf
    axes["low"], axes["high"] = limits
    return BalancedSystem(
        springs=[spring], axes=axes, basis=basis, mass=5.0, along=np.ones((1, 1)), bend=np.zeros((1, 1, 1)),
        load=np.array([150.0]), forcing=np.array([[20.0], [1e-3], [7e3]]), level_text="",
    )  # fmt: skip


def motion(basis: FourierBasis, amplitude: float) -> FloatArray:
    z = amplitude * np.random.default_rng(1).normal(0.0, 1.0, basis.order.size) / (1.0 + basis.order**3)
    z[0] = 0.0
    return z


# Also where the samples of a quarter are not a multiple of what is computed at once.
@pytest.mark.parametrize(("harmonics", "samples"), [(7, 128), (9, 256), (7, 100), (1, 8), (3, 8)])
@pytest.mark.parametrize("name", ["stranded_wire", "hardening"])
def test_the_residual_is_that_of_the_equation_of_motion(name: str, harmonics: int, samples: int) -> None:
    """With the force of the spring along one period in time, after which it is where it was."""
    p, basis = EXAMPLES[name], FourierBasis(harmonics, samples)
    z, order, functions = motion(basis, 2e-2), basis.order, basis.functions.T
    found = mass_on(p, basis).at(z, OMEGA)
    low, high, start, cosine, sine = found.motion.figures[0].tolist()
    angle = 2.0 * np.pi * np.arange(FINE * samples + 1)[:, None] / (FINE * samples) * order[1 : harmonics + 1]
    path = p.displacement_offset + 0.5 * np.hstack([np.ones((len(angle), 1)), np.cos(angle), np.sin(angle)]) @ z
    of_spring, omega = Spring(p).response(path, start)[:-1:FINE], Spring(p).omega(path, start)
    speed = OMEGA * order * np.concatenate([z[:1], z[harmonics + 1 :], -z[1 : harmonics + 1]])
    # The path misses the turning points by up to half a 512th of a sample, which a cusp of omega feels most.
    assert omega[-1] == pytest.approx(start, abs=1e-5)
    assert found.motion.force[0] == pytest.approx(3.0 * of_spring + 15.0 * functions @ speed, abs=1e-6 * found.scale)
    assert (low, high) == pytest.approx((path.min(), path.max()), abs=1e-6 * np.ptp(path))
    forcing = 20.0 + 1e-3 * OMEGA**2 + 7e3 / OMEGA**2
    assert mass_on(p, basis).forcing_at(OMEGA) == pytest.approx([forcing])
    acting = 150.0 + forcing * functions[:, 1]
    unbalanced = found.motion.force[0] - 5.0 * OMEGA**2 * functions @ (order**2 * z) - acting
    share = np.where(order > 0.0, 2.0, 1.0) / samples
    assert found.residual == pytest.approx(share * (functions.T @ unbalanced), abs=1e-12 * found.scale)
    first = share[1] * functions[:, [1, 1 + harmonics]].T @ found.motion.force[0]
    assert [cosine, sine] == pytest.approx(first, rel=1e-12, abs=1e-12 * found.scale)


@pytest.mark.parametrize("amplitude", [1e-4, 1e-3, 1e-2, 0.3])  # the last saturates on every stroke
@pytest.mark.parametrize("spring", [MOUNT, TABLE, EXAMPLES["hardening"]], ids=["cusp", "table", "smooth"])
def test_derivatives_are_those_of_finite_differences(spring: SpringParameters, amplitude: float) -> None:
    basis = fourier_basis(7, 128)
    mass, z = mass_on(spring, basis), motion(basis, amplitude)
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
        # Newton's method from there stays there.
        again = mass.solve(steady.z, float(np.exp(log)))
        assert again is not None
        assert again.z == pytest.approx(steady.z, abs=1e-15)


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
