"""The single steps of the C kernel, and its whole paths, against those of scalar Python."""

from __future__ import annotations

from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from fmu_tools import SPRING
from kernel_tools import Kernel, random_path, random_spring, random_table
from springs import EXAMPLES, along, energy_scale, force_scale, spring
from strandspring import SpringParameters
from strandspring.core import stepper
from strandspring.core.law import SpringLaw
from strandspring.core.saturation import Saturation, inverse_saturation
from strandspring.kernel.path import PathSolver

pytestmark = pytest.mark.long


def stepped(parameters: SpringParameters, path: np.ndarray, omega: float) -> np.ndarray:
    """omega, force, stiffness and absorbed energy of Python's stepper at each sample."""
    law = SpringLaw(parameters)
    memory = stepper.start(float(path[0]), omega)
    rows = []
    for displacement in path.tolist():
        memory = stepper.integrate(law, stepper.trial(law, memory, displacement))
        rows.append((memory.omega, stepper.force(law, memory), stepper.stiffness(law, memory), memory.energy))
    return np.array(rows).T


def rounding_of_stiffness(parameters: SpringParameters) -> float:
    """By how much of itself the stiffness may change when xi is rounded.

    u changes by W' roundings, near u = -1 by 2 sigma of them, and there |u|^n by n times that.
    """
    return 4.0 * np.finfo(float).eps * parameters.n * 2.0 * parameters.sigma


@pytest.mark.parametrize(
    ("draw", "seed"),
    [
        pytest.param(draw, seed, marks=[pytest.mark.slow] if seed >= quick else [])
        for draw, quick, count in ((random_spring, 15, 60), (random_table, 5, 20))
        for seed in range(count)
    ],
)
def test_steps_equal_those_of_the_stepper(draw: Callable[[np.random.Generator], SpringParameters], seed: int) -> None:
    random = np.random.default_rng(seed)
    parameters = draw(random)
    path = random_path(random, parameters, 500)
    omega = float(random.choice([-1.0, -0.4, 0.0, 1e-9, 0.7, 1.0]))
    solver = PathSolver(parameters)
    whole = (solver.omega, solver.force, solver.stiffness, solver.absorbed_energy)
    steps = Kernel(parameters).path(path, omega)
    expected = stepped(parameters, path, omega)
    for got in (steps, np.array([along_path(path, omega) for along_path in whole])):
        check_response(parameters, path, omega, got, expected)


def check_response(
    parameters: SpringParameters, path: np.ndarray, omega: float, got: np.ndarray, expected: np.ndarray
) -> None:
    scales = 1.0, force_scale(parameters, path), np.max(np.abs(expected[2]))
    # Python's W through logarithms, the kernel's by polynomials fitted to it: both within some 1e-13.
    tolerances = 1e-12, 1e-12, 1e-12 + rounding_of_stiffness(parameters)
    for name, ours, theirs, scale, tolerance in zip(
        ("omega", "force", "stiffness"), got[:3], expected[:3], scales, tolerances, strict=True
    ):
        assert np.max(np.abs(ours - theirs)) <= tolerance * scale, (name, parameters)
    way = np.cumsum(np.abs(np.diff(path, prepend=path[0])))
    # The accuracy that work.py claims for its quadrature, 1e-12 of the force times the path; and for short steps the
    # rounding of xi, whose origin may lie far away.
    origin = inverse_saturation(Saturation(parameters.n, parameters.sigma), abs(omega)) / parameters.rho
    rounding = np.finfo(float).eps * (origin + np.ptp(path)) * np.arange(path.size)
    assert np.all(np.abs(got[3] - expected[3]) <= scales[1] * (1e-12 * way + rounding)), parameters


@pytest.mark.parametrize(
    ("n", "sigma", "degree", "saturations"),
    [(0.22, 3.0, 2, 10.0), (2.5, 0.7, 6, 3.0), (9.7, 68.0, 4, 3.0), (47.0, 1000.0, 1, 2.0), (1.3, 2.0, 8, 4.0)],
)
def test_energy_of_one_stroke(n: float, sigma: float, degree: int, saturations: float) -> None:
    """From omega = -1 to 0.9, against quadrature over omega in 20 digits."""
    weights = 0.9 / degree * (-1.0) ** np.arange(degree)
    parameters = spring(n, sigma, saturations, elastic=(0.0,), amplifier=tuple(weights))
    start = along(parameters, -0.9)
    end, work = stroke_to(0.9, parameters, float(start))
    got = Kernel(parameters).path(np.array([start, end]), -1.0)
    assert got[0, -1] == pytest.approx(0.9, abs=1e-10)  # the accuracy asked of W
    # 300 roundings, which the sum of moments may cost.
    assert got[3, -1] == pytest.approx(work, rel=300.0 * np.finfo(float).eps)
    # The error of W's interpolant (test_saturation).
    assert stepped(parameters, np.array([start, end]), -1.0)[3, -1] == pytest.approx(work, rel=2e-13)


def stroke_to(omega: float, parameters: SpringParameters, start: float) -> tuple[float, float]:
    """Where a loading stroke from omega = -1 at `start` reaches `omega` [m], and its hysteretic work [J].

    xi and the work are integrals over omega, of 1/slope and of kappa_omega*omega*FA/(rho*slope).
    """
    p = parameters
    with mpmath.workdps(20):
        n, curvature = mpmath.mpf(p.n), 2 * mpmath.mpf(p.sigma) - 1

        def xi(u: mpmath.mpf) -> mpmath.mpf:
            power = u**n if u >= 0 else -curvature * (-u) ** n
            return u * mpmath.hyp2f1(1, 1 / n, 1 + 1 / n, power)

        def rate(u: mpmath.mpf) -> mpmath.mpf:
            slope = 1 - u**n if u >= 0 else 1 + curvature * (-u) ** n
            x = mpmath.mpf(start) - p.displacement_offset + (xi(u) - xi(mpmath.mpf(-1))) / p.rho
            return u * mpmath.polyval(p.kA, x, asc=True) / slope

        end = mpmath.mpf(start) + (xi(mpmath.mpf(omega)) - xi(mpmath.mpf(-1))) / p.rho
        assert end < p.displacement_max
        work = p.kappa_omega / p.rho * mpmath.quad(rate, [-1, -0.95, -0.9, -0.5, 0, 0.5, omega])
        return float(end), float(work)


@pytest.mark.parametrize(("degree", "saturations", "distance"), [(6, 1.75, 34.0), (8, 0.05, 0.1)])
def test_energy_where_the_amplifier_is_hard_to_integrate(degree: int, saturations: float, distance: float) -> None:
    """n = 1, W = 1 - exp(-xi), over the whole range: with xi = 0 many times the range away, where an expansion of FA
    about it cancels; and with all of the range on one piece of W."""
    wave = np.polynomial.chebyshev.cheb2poly([1.0, *(0.0,) * (degree - 1), 0.9])
    parameters = spring(1.0, 1.0, saturations, elastic=(0.0,), amplifier=tuple(wave[1:] / wave[0]))
    low, high = parameters.displacement_min, parameters.displacement_max
    start = low - distance / parameters.rho
    response = Kernel(parameters).path(np.array([start, low, high]), 0.0)[3]
    nodes, weights = np.polynomial.legendre.leggauss(60)
    x = parameters.x_max * nodes
    xi = parameters.rho * (x + parameters.displacement_offset - start)
    force = parameters.kappa_omega * -np.expm1(-xi) * np.polynomial.polynomial.polyval(x, parameters.kA)
    # Rounding of FA itself, whose coefficients are 1e4 times its values and alternate.
    assert response[2] - response[1] == pytest.approx(parameters.x_max * float(weights @ force), rel=2e-12)


@pytest.mark.slow
def test_a_million_steps_equal_the_vectorised_path() -> None:
    random = np.random.default_rng(5)
    turns = along(SPRING, random.uniform(-1.3, 1.3, 20_001))
    shares = np.sort(random.uniform(0.0, 1.0, (20_000, 50)), axis=1)
    path = (turns[:-1, None] + shares * np.diff(turns)[:, None]).ravel()
    omega, force, stiffness, energy = Kernel(SPRING).path(path, 0.3)
    solver = PathSolver(SPRING)
    np.testing.assert_allclose(omega, solver.omega(path, 0.3), rtol=0.0, atol=1e-12)
    assert np.max(np.abs(force - solver.force(path, 0.3))) <= 1e-12 * force_scale(SPRING, path)
    expected = solver.stiffness(path, 0.3)
    assert np.max(np.abs(stiffness - expected)) <= 1e-12 * np.max(np.abs(expected))
    # Sums of a million pieces of work, each rounded by 1e-16 of itself, in a different order.
    assert np.max(np.abs(energy - solver.absorbed_energy(path, 0.3))) <= 1e-12 * energy_scale(SPRING, path)


@pytest.mark.parametrize(("n", "sigma", "omega"), [(0.22, 3.0, 0.62), (0.05, 50.0, -0.61), (0.5, 1000.0, -0.3)])
@pytest.mark.parametrize("turns", [4_000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_many_small_reversals_do_not_add_up(n: float, sigma: float, omega: float, turns: int) -> None:
    parameters = spring(n, sigma, 1.0)
    small = 1e-10 / parameters.rho
    path = parameters.displacement_offset + small * (np.arange(turns + 1) % 2)
    with mpmath.workdps(20):
        expected, curvature = mpmath.mpf(omega), 2 * mpmath.mpf(sigma) - 1
        for step in parameters.rho * np.diff(path):
            # Second order in the step leaves 1e-24 of each.
            rate = 1 - abs(expected) ** n if step * expected >= 0 else 1 + curvature * abs(expected) ** n
            ahead = expected + step * rate / 2
            expected += step * (1 - abs(ahead) ** n if step * ahead >= 0 else 1 + curvature * abs(ahead) ** n)
    # Rounding of the strokes, and the accuracy of W once.
    assert Kernel(parameters).path(path, omega)[0, -1] == pytest.approx(float(expected), abs=1e-12)
    assert PathSolver(parameters).omega(path, omega)[-1] == pytest.approx(float(expected), abs=1e-12)
    law, memory = SpringLaw(parameters), stepper.start(float(path[0]), omega)
    for displacement in path.tolist():
        memory = stepper.trial(law, memory, displacement)
    assert memory.omega == pytest.approx(float(expected), abs=1e-12)


@pytest.mark.parametrize("name", EXAMPLES)
def test_cutting_a_stroke_changes_no_bit(name: str) -> None:
    parameters = EXAMPLES[name]
    random = np.random.default_rng(7)
    corners = along(parameters, random.uniform(-1.3, 1.3, 40))
    kernel = Kernel(parameters)
    whole = kernel.path(corners, 0.2)
    pieces = [np.sort(random.uniform(0.0, 1.0, random.integers(0, 20))) for _ in corners[1:]]
    path = [corners[:1]]
    for start, end, shares in zip(corners[:-1], corners[1:], pieces, strict=True):
        path += [start + shares * (end - start), [end]]
    ends = np.cumsum([len(part) for part in path])[0::2] - 1
    cut = kernel.path(np.concatenate(path), 0.2)[:, ends]
    np.testing.assert_array_equal(cut[:3], whole[:3])
    # The energy is a sum over the pieces: equal but for rounding.
    assert np.max(np.abs(cut[3] - whole[3])) <= 1e-14 * energy_scale(parameters, corners)


def test_an_input_that_stands_still_changes_nothing() -> None:
    path = np.repeat(along(SPRING, [0.0, 0.7, -0.4]), 3)
    got = Kernel(SPRING).path(path, 0.2)
    np.testing.assert_array_equal(got[:, ::3], got[:, 2::3])
