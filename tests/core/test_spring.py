"""One spring along its path, by Python's steps, by whole paths and by the steps in C: the equations, and invariants."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernel_tools import FloatArray, Kernel, by_path, by_stepper, by_steps_in_c, in_each_way
from oracles import OracleSpring, travel_to
from springs import EXAMPLES, along, energy_scale, force_scale, fractions, omegas, spring, springs
from strandspring import SpringParameters
from strandspring.core import parameters as limits
from strandspring.core.parameters import LARGEST_DISPLACEMENT
from strandspring.core.saturation import Saturation, inverse_saturation
from strandspring.kernel.path import PathSolver
from strandspring.kernel.steady import steady_omega

Respond = Callable[[SpringParameters, FloatArray, float], FloatArray]
EPSILON = float(np.finfo(float).eps)
PANELS = 30  # of a stroke
LARGEST = spring(
    n=1.3, sigma=2.0, saturations=6.0, elastic=tuple(np.cos(3.0 * np.arange(21.0))),
    amplifier=tuple(0.11 * np.cos(2.0 * np.arange(8.0))),
)  # fmt: skip
SPRINGS = {**EXAMPLES, "of the largest degrees": LARGEST}
examples = pytest.mark.parametrize("p", SPRINGS.values(), ids=SPRINGS)


@cache
def by_the_equation(p: SpringParameters) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A path within the range and outside it, the force by the solver, and the energy at its turns by Gauss's rule."""
    node, weight = np.polynomial.legendre.leggauss(5)
    turns = along(p, [0.1, 0.9, -0.6, 0.2, 0.05, 1.3, -1.4, -0.1])
    x, shares = [turns[:1]], 0.5 * (np.repeat(2.0 * np.arange(PANELS), 5) + 1.0 + np.tile(node, PANELS)) / PANELS
    for begin, end in pairwise(turns.tolist()):
        x.append(begin + (end - begin) * np.append(shares, 1.0))
    path = np.concatenate(x)
    force = OracleSpring(p.as_dict(), rtol=1e-10, atol=1e-12).force(path, -0.8)
    means = force[1:].reshape(len(x) - 1, -1)[:, :-1] @ np.tile(0.5 * weight, PANELS) / PANELS
    return path, force, np.append(0.0, np.cumsum(means * np.diff(turns)))


@examples
@in_each_way
def test_force_and_energy_are_those_of_the_differential_equation(p: SpringParameters, respond: Respond) -> None:
    path, expected, works = by_the_equation(p)
    _, force, _, energy = respond(p, path, -0.8)
    # What the solver leaves where it crosses the cusp at omega = 0.
    assert np.abs(force - expected).max() <= 1e-8 * force_scale(p, path)
    # Panels that hold a kink: at the ends of the range, at omega = 0 and at knots.
    assert energy[:: 5 * PANELS + 1] == pytest.approx(works, abs=1e-5 * energy_scale(p, path))


@pytest.mark.long
@settings(max_examples=25)
@given(springs(), fractions(minimum=2, maximum=60, reach=1.5), omegas())
def test_the_three_agree_over_drawn_springs(p: SpringParameters, shares: list[float], start: float) -> None:
    path = along(p, [0.0, *shares, shares[-1], shares[-1] + 1e-6, shares[-1] - 1e-12])
    expected = by_stepper(p, path, start)
    # By how much of itself the stiffness may change when xi is rounded, and over what way the energy: u changes by W'
    # roundings, near u = -1 by 2 sigma of them, there |u|^n by n times that; the origin of xi may lie far away.
    of_stiffness = 8.0 * EPSILON * p.n * p.sigma
    origin = inverse_saturation(Saturation(p.n, p.sigma), abs(start)) / p.rho
    of_energy = EPSILON * (origin + np.ptp(path)) * np.arange(path.size)
    scale, way = force_scale(p, path), np.cumsum(np.abs(np.diff(path, prepend=path[0])))
    for found in (by_path(p, path, start), by_steps_in_c(p, path, start)):
        omega, force, stiffness, energy = np.abs(found - expected)
        # Python's W through logarithms, the kernel's by polynomials fitted to it: both within some 1e-13.
        assert omega.max() <= 1e-12
        assert force.max() <= 1e-12 * scale
        assert stiffness.max() <= (1e-12 + of_stiffness) * np.abs(expected[2]).max()
        # What work.py claims for its quadrature.
        assert np.all(energy <= scale * (1e-12 * way + of_energy))


def springs_at_the_limits(n: float, sigma: float) -> Iterator[SpringParameters]:
    """Of all sizes that are allowed, with the largest terms that cancel or do not; FA > 0 where x >= 0."""
    ends = limits.WIDTH_RANGE, limits.SATURATION_RANGE, limits.FORCE_RANGE
    for (width, saturations, force), is_table in product(product(*ends), (False, True)):
        low = -LARGEST_DISPLACEMENT if width > 1.0 else 0.0
        elastic = [0.9e15 * (-1.0) ** i / width**i for i in range(21)]
        knots = low + width * np.linspace(0.0, 1.0, 25)
        yield SpringParameters(
            kE=() if is_table else tuple(elastic), kA=(1.0, *(0.9e9 / width**i for i in range(1, 9))),
            kappa_omega=force, rho=saturations / width, sigma=sigma, n=n, displacement_offset=low,
            displacement_min=low, displacement_max=low + width, FE_knots=tuple(knots) if is_table else (),
            FE_forces=(1e15, -1e15, *(1e15,) * 23) if is_table else (),
        )  # fmt: skip


@in_each_way
@pytest.mark.parametrize("pair", list(product(limits.N_RANGE, limits.SIGMA_RANGE)), ids=str)
def test_whatever_is_computed_within_the_limits_is_finite(pair: tuple[float, float], respond: Respond) -> None:
    random = np.random.default_rng(1)
    for p in springs_at_the_limits(*pair):
        inside = random.uniform(p.displacement_min, p.displacement_max, 8)
        near = inside + random.standard_normal(8) * 10.0 ** random.uniform(-12.0, 3.0, 8) / p.rho
        ends = [-LARGEST_DISPLACEMENT, 0.0, LARGEST_DISPLACEMENT, p.displacement_min, p.displacement_max]
        path = np.clip(random.permutation([*inside, *near, *ends]), -LARGEST_DISPLACEMENT, LARGEST_DISPLACEMENT)
        response = respond(p, path, float(random.choice([-1.0, 1e-300, 1.0])))
        assert np.isfinite(response).all(), p
        assert np.abs(response[0]).max() <= 1.0
        if respond is by_steps_in_c:
            assert np.isfinite(Kernel(p).along(path, 0.0)[1].view(np.float64)).all(), p


@in_each_way
@examples
def test_cutting_a_stroke_or_standing_still_changes_no_bit(p: SpringParameters, respond: Respond) -> None:
    random = np.random.default_rng(7)
    corners = along(p, random.uniform(-1.3, 1.3, 25))
    path, kept = [corners[:1]], [0]
    for start, end in pairwise(corners.tolist()):
        shares = np.repeat(np.sort(random.uniform(0.0, 1.0, random.integers(0, 6))), 2)
        path.append(np.append(start + shares * (end - start), [end] * random.integers(1, 3)))
        kept.append(kept[-1] + path[-1].size)
    cut, whole = respond(p, np.concatenate(path), 0.2)[:, kept], respond(p, corners, 0.2)
    np.testing.assert_array_equal(cut[:3], whole[:3])
    # The energy is a sum over the pieces: other pieces of the quadrature, 1e-12 of the force times the way.
    assert np.abs(cut[3] - whole[3]).max() <= 1e-12 * energy_scale(p, corners)


@settings(max_examples=25)
@given(springs(), st.lists(st.floats(-1.0, 1.0), max_size=8))
def test_steady_closed_loops_only_dissipate(p: SpringParameters, shares: list[float]) -> None:
    # A full swing that saturates nearly, so often that the loop becomes steady.
    p = replace(p, rho=max(p.rho, 4.0 / (p.x_max - p.x_min)), n=max(p.n, 0.1))
    path = along(p, np.append(np.tile([-1.0, 1.0, *shares], 25), -1.0))
    energy = PathSolver(p).absorbed_energy(path, 0.3)
    # 1e-12 of the force times the way is the accuracy of the quadrature.
    assert energy[-1] - energy[-3 - len(shares)] >= -1e-12 * energy_scale(p, path)


# Energies


@cache
def exact_stroke(p: SpringParameters, start: float) -> tuple[float, float]:
    """Where a stroke from omega = -1 comes to 0.9, and its work, by quadrature over omega in 20 digits."""
    import mpmath as mp

    with mp.workdps(20):
        n, curvature = mp.mpf(p.n), 2 * mp.mpf(p.sigma) - 1

        begin = start - travel_to(-1.0, p.n, p.sigma) / p.rho

        def rate(u: mp.mpf) -> mp.mpf:
            amplifier = mp.polyval(p.kA, begin + travel_to(u, p.n, p.sigma) / p.rho - p.displacement_offset, asc=True)
            return u * amplifier / (1 - u**n if u >= 0 else 1 + curvature * (-u) ** n)

        work = p.kappa_omega / p.rho * mp.quad(rate, [-1, -0.95, -0.9, -0.5, 0, 0.5, 0.9])
        return float(begin + travel_to(0.9, p.n, p.sigma) / p.rho), float(work)


@in_each_way
@pytest.mark.parametrize(
    ("n", "sigma", "degree", "saturations"),
    [(0.22, 3.0, 2, 10.0), (2.5, 0.7, 6, 3.0), (47.0, 1000.0, 1, 2.0), (1.3, 2.0, 8, 4.0)],
)
def test_energy_of_one_stroke(n: float, sigma: float, degree: int, saturations: float, respond: Respond) -> None:
    weights = 0.9 / degree * (-1.0) ** np.arange(degree)
    p = spring(n, sigma, saturations, elastic=(0.0,), amplifier=tuple(weights))
    start = float(along(p, -0.9))
    end, work = exact_stroke(p, start)
    omega, _, _, energy = respond(p, np.array([start, end]), -1.0)[:, -1]
    assert omega == pytest.approx(0.9, abs=1e-10)  # the accuracy asked of W
    # 300 roundings, which the sum of moments may cost; Python's error is that of W's interpolant.
    assert energy == pytest.approx(work, rel=2e-13 if respond is by_stepper else 300.0 * EPSILON)


@in_each_way
@pytest.mark.parametrize("n", [0.5, 1.0, 2.0])
def test_the_energy_of_small_loops_has_all_its_digits(n: float, respond: Respond) -> None:
    """Of loops far below saturation, whose energy falls with the power 2 + n of their length."""
    p = SpringParameters((0.0,), (1.0, 5.0), 10.0, 500.0, 1.0, n, 0.0, -0.02, 0.02)
    means = []
    for length in (1e-6, 1e-7):
        omega, lows = -steady_omega(p, length), np.linspace(-0.019, 0.019, 20)
        loops = np.array([respond(p, np.array([low, low + length, low]), omega)[3, -1] for low in lows])
        energies = loops / (1.0 + 5.0 * (lows + 0.5 * length))
        means.append(energies.mean())
        # FA changes by 5e-6 of itself over the loop; rounding of the displacement, 3e-18 of 1e-7 m.
        assert energies == pytest.approx(means[-1], rel=1e-5)
    # The next term of W is below rho*length of the first, to the power n at most.
    assert means[0] / means[1] == pytest.approx(10.0 ** (2.0 + n), rel=max(1e-4, 3.0 * (500.0 * 1e-6) ** n))


@in_each_way
@pytest.mark.parametrize(("n", "sigma", "omega"), [(0.22, 3.0, 0.62), (0.05, 50.0, -0.61), (0.5, 1000.0, -0.3)])
def test_many_small_reversals_do_not_add_up(n: float, sigma: float, omega: float, respond: Respond) -> None:
    import mpmath as mp

    p = replace(spring(n, sigma, 1.0), displacement_offset=0.05)
    path = 0.05 + 1e-10 / p.rho * (np.arange(1001) % 2)
    with mp.workdps(20):
        expected, curvature = mp.mpf(omega), 2 * mp.mpf(sigma) - 1

        def rate(u: mp.mpf, step: float) -> mp.mpf:
            return 1 + (-1 if step * u >= 0 else curvature) * abs(u) ** n

        for step in (p.rho * np.diff(path)).tolist():
            # Second order in the step leaves 1e-24 of each.
            expected += step * rate(expected + step / 2 * rate(expected, step), step)
    # Rounding of the strokes, and the accuracy of W once.
    assert respond(p, path, omega)[0, -1] == pytest.approx(float(expected), abs=1e-12)
