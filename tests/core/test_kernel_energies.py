"""Absorbed energies of the C kernel along adversarial paths, against W in closed form and FA without rounding."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from kernel_tools import Kernel
from strandspring import SpringParameters
from strandspring.kernel.path import PathSolver

RANGE, KAPPA = 0.02, 25.0  # [m], [N]
EPSILON = float(np.finfo(float).eps)


def wild(n: float, sigma: float, saturations: float, degree: int) -> SpringParameters:
    """FA as wild as a positive polynomial may be, 1 + 0.9*T(x~) but for its scale; rho*range is `saturations`."""
    wave = np.polynomial.chebyshev.cheb2poly([1.0, *(0.0,) * (degree - 1), 0.9] if degree else [1.0])
    kA = tuple(wave / wave[0] * (2.0 / RANGE) ** np.arange(degree + 1))
    return SpringParameters((0.0,), kA, KAPPA, saturations / RANGE, sigma, n, 0.0, -RANGE / 2, RANGE / 2)


def chebyshev_series(kA: tuple[float, ...]) -> np.ndarray:
    """Of FA over x~ in [-1, 1], converted in fractions, so that it can be evaluated without cancellation."""
    half, series = Fraction(RANGE / 2), [Fraction(0)] * (len(kA) + 2)
    for k in range(len(kA) - 1, -1, -1):
        # Multiplied by x~: T_0 becomes T_1, T_m the mean of its neighbours.
        shifted = [Fraction(0)] * len(series)
        for m, c in enumerate(series[:-1]):
            if m == 0:
                shifted[1] += c
            else:
                shifted[m - 1] += c / 2
                shifted[m + 1] += c / 2
        series = shifted
        series[0] += Fraction(kA[k]) * half**k
    return np.array([float(c) for c in series[: len(kA)]])


def saturation(n: float, sigma: float, xi: np.ndarray) -> np.ndarray:
    """W in closed form for n = 1 and 2."""
    curvature = 2.0 * sigma - 1.0
    z = np.minimum(xi, 0.0)
    if n == 1.0:
        falling = np.expm1(-curvature * z) / curvature if curvature else -z
        return np.where(xi >= 0.0, -np.expm1(-np.maximum(xi, 0.0)), -falling)
    root = np.sqrt(curvature)
    return np.where(xi >= 0.0, np.tanh(xi), np.tan(root * z) / root if curvature else z)


def inverse(n: float, sigma: float, u: float) -> float:
    curvature = 2.0 * sigma - 1.0
    if u >= 0.0:
        u = min(u, 1.0 - 1e-16)
        return float(-np.log1p(-u) if n == 1.0 else np.arctanh(u))
    if not curvature:
        return u
    root = np.sqrt(curvature)
    return float(-np.log1p(-curvature * u) / curvature if n == 1.0 else np.arctan(root * u) / root)


def works(
    parameters: SpringParameters, path: np.ndarray, omega: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each step the work, what full saturation would do, and the work that is rounded.

    The latter is that of FA with all its terms of one sign, and of the ends of the step, whose xi is rounded. Each
    step is a stroke of its own, which begins with the omega given.
    """
    p, (node, weight) = parameters, np.polynomial.legendre.leggauss(40)
    series, sizes = chebyshev_series(p.kA), np.abs(p.kA)
    steps = []
    for before, after, u in zip(path[:-1], path[1:], omega[:-1], strict=True):
        way, begin = np.sign(after - before), before
        first = inverse(p.n, p.sigma, float(way * u))
        last = first + p.rho * abs(after - before)
        ends = [first + way * p.rho * (x - begin) for x in (p.x_min, p.x_max)]
        scale = [0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, *np.linspace(min(first, 0.0), 0.0, 30)]
        cuts = np.array([first, *sorted(cut for cut in (*ends, *scale) if first < cut < last), last])
        middle, half = 0.5 * (cuts[1:] + cuts[:-1])[:, None], 0.5 * np.diff(cuts)[:, None]
        xi = middle + half * node
        x = np.clip(begin + way * (xi - first) / p.rho, p.x_min, p.x_max)
        FA = np.polynomial.chebyshev.chebval(x / (RANGE / 2), series)
        shares = p.kappa_omega / p.rho * half * weight
        terms = np.polynomial.polynomial.polyval(np.abs(x), sizes)
        u_there = saturation(p.n, p.sigma, xi)
        at_ends = p.kappa_omega / p.rho * (abs(first) + abs(last)) * np.max(FA)
        steps.append((np.sum(shares * u_there * FA), np.sum(shares * FA), np.sum(shares * terms) + at_ends))
    done = np.array(steps).T
    return done[0], done[1], done[2]


def turning_path(random: np.random.Generator, count: int) -> np.ndarray:
    """A turn at every step, of all sizes, over the range and beyond."""
    far = RANGE * random.uniform(0.0, 1.0, count) * (-1.0) ** np.arange(count)
    near = far[-1] + np.cumsum(RANGE * 10.0 ** random.uniform(-5.0, -1.0, count) * (-1.0) ** np.arange(count))
    return np.concatenate([far, near])


@pytest.mark.parametrize("degree", [0, 2, 5, 8])
@pytest.mark.parametrize(("n", "sigma"), [(1.0, 0.5), (1.0, 1.0), (2.0, 10.0), (1.0, 1000.0), (2.0, 1000.0)])
@pytest.mark.parametrize("saturations", [0.1, 3.0, 50.0, 1e4])
def test_energies_where_every_step_turns(n: float, sigma: float, saturations: float, degree: int) -> None:
    parameters = wild(n, sigma, saturations, degree)
    path = turning_path(np.random.default_rng(int(1e3 * saturations) + degree), 60)
    kernel = Kernel(parameters)
    omega, _, _, energy = kernel.path(path, 0.3)
    expected, saturated, rounding = works(parameters, path, omega)
    alone = [kernel.path(path[k : k + 2], float(omega[k]))[3, 1] for k in range(path.size - 1)]
    error = np.abs(np.array(alone) - expected)
    # FA's terms are up to 1e3 times FA at degree 8.
    assert np.all(error <= 1e-13 * saturated + EPSILON * rounding), np.max(error / saturated)
    # The steps add up.
    most = np.max(np.abs(energy)) + np.max(rounding)
    tolerance = path.size * (EPSILON * most + 1e-13 * np.max(saturated))
    np.testing.assert_allclose(energy[1:], np.cumsum(alone), rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(PathSolver(parameters).absorbed_energy(path, 0.3), energy, rtol=0.0, atol=1e-12 * most)
