"""Derivatives by the single steps of the C kernel against difference quotients, whole strokes and analytic cases."""

from __future__ import annotations

from dataclasses import replace

import mpmath
import numpy as np
import pytest

from fmu_tools import SPRING
from kernel_tools import Kernel, c_parameters
from springs import EXAMPLES, along, force_scale
from strandspring import SpringParameters
from strandspring.core.parameters import N_RANGE, SCALARS, SIGMA_RANGE
from stroke_points import omega_with_derivatives


def response_to(
    parameters: SpringParameters, path: np.ndarray, omega: float, name: str, index: int, change: float
) -> np.ndarray:
    """Force and stiffness at the end of the path after one quantity has been changed."""
    changed = c_parameters(parameters)
    path = path.copy()
    if name == "displacement":
        path[-1] += change
    elif name == "omega_start":
        omega += change
    elif name in SCALARS:
        setattr(changed, name, getattr(changed, name) + change)
    else:
        getattr(changed, name)[index] += change
    return Kernel(changed).path(path, omega)[1:3, -1]


def quantities(parameters: SpringParameters) -> list[tuple[str, int, float]]:
    """Whatever there is a derivative by: name, index and over what the response changes."""
    p = parameters
    span = p.displacement_max - p.displacement_min
    found = [("displacement", 0, min(span, 1.0 / p.rho)), ("omega_start", 0, 1.0)]
    # A knot may move by a share of the distance to the next.
    found += [("FE_knots", i, 0.1 * span) for i in range(len(p.FE_knots))]
    for name in ("kE", "kA", "FE_forces"):
        found += [(name, i, abs(c) or p.kappa_omega / span**i) for i, c in enumerate(getattr(p, name))]
    return found + [(name, 0, span if name.startswith("displacement") else getattr(p, name)) for name in SCALARS]


# Strokes that end while omega recovers, near saturation, below and above the range; the last is the first motion.
PATHS = {
    "recovering": [0.0, 0.3, -0.2, 0.15, 0.1403],
    "saturating": [0.0, 0.6, -0.5, 0.1, -0.02, 0.31],
    "below": [0.4, 0.9, -0.3, -0.25, -1.3],
    "above": [0.0, -0.5, 1.2, 1.1, 1.25],
    "first": [0.1, 0.17],
}


@pytest.mark.parametrize("way", PATHS)
@pytest.mark.parametrize("name", EXAMPLES)
def test_gradient_equals_difference_quotients_of_the_kernel(name: str, way: str) -> None:
    parameters = EXAMPLES[name]
    path = along(parameters, PATHS[way])
    kernel = Kernel(parameters)
    response = kernel.path(path, 0.3)
    of_force, of_stiffness = (gradients[-1] for gradients in kernel.gradients(path, 0.3))
    scales = force_scale(parameters, path), np.max(np.abs(response[2]))
    for quantity, index, size in quantities(parameters):
        # Tables of neighbouring n and sigma differ by rounding, 1e-13 over a step of 1e-4: 1e-9. A formula of order 4
        # leaves (1e-4*rho*travel)^4, or 1e-9 for the longest stroke, 60 in xi, but there omega is saturated.
        step = 1e-4 * size
        at = {k: response_to(parameters, path, 0.3, quantity, index, k * step) for k in (-2, -1, 1, 2)}
        expected = (8.0 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12.0 * step)
        for gradient, scale, quotient in zip((of_force, of_stiffness), scales, expected, strict=True):
            value = getattr(gradient, quantity)
            value = value[index] if quantity in {"kE", "kA", "FE_knots", "FE_forces"} else value
            assert abs(value - quotient) * size <= 1e-7 * scale, (quantity, index, value, quotient)


def omega_gradients(
    n: float, sigma: float, rho: float, path: np.ndarray, omega: float
) -> tuple[np.ndarray, np.ndarray]:
    """omega, and its derivatives by rho, sigma, n and omega_start, shape (4, K): of a spring whose force is omega."""
    pure = SpringParameters((0.0,), (1.0,), 1.0, rho, sigma, n, 0.0, -1.0, 1.0)
    kernel = Kernel(pure)
    of_force, _ = kernel.gradients(path, omega)
    rows = [[g.rho, g.sigma, g.n, g.omega_start] for g in of_force]
    return kernel.path(path, omega)[0], np.array(rows).T


@pytest.mark.parametrize(("n", "sigma"), [(0.22, 3.0), (0.7, 0.5), (1.0, 1.0), (2.5, 1.4), (9.0, 40.0)])
def test_gradient_equals_the_derivatives_at_points_of_strokes(n: float, sigma: float) -> None:
    random = np.random.default_rng(11)
    turns = np.array([0.1, 0.8, -0.2, 0.1, -0.05, 0.02, -0.9, 0.3, 0.29, 0.6])
    shares = np.sort(random.uniform(0.01, 1.0, (turns.size - 1, 20)), axis=1)
    shares[:, -1] = 1.0
    path = np.concatenate([turns[:1], (turns[:-1, None] + shares * np.diff(turns)[:, None]).ravel()])
    rho = 4.0
    omega, derivatives = omega_gradients(n, sigma, rho, path, 0.35)
    stroke = np.repeat(np.arange(turns.size - 1), shares.shape[1])
    length = np.diff(turns)
    travel = np.abs(path[1:] - turns[stroke])
    expected_omega, expected = omega_with_derivatives(
        rho, sigma, n, 0.35, np.sign(length).astype(int), np.abs(length), stroke, travel
    )
    np.testing.assert_allclose(omega[1:], expected_omega, rtol=0.0, atol=1e-13)  # rounding of nine strokes
    # The same sums in another order: rounding, magnified where a stroke begins near saturation.
    scale = np.max(np.abs(expected), axis=1, keepdims=True)
    assert np.all(np.abs(derivatives[:, 1:] - expected) <= 1e-10 * scale)


@pytest.mark.parametrize(("n", "sigma"), [(0.22, 3.0), (2.5, 0.7), (9.0, 40.0)])
def test_derivatives_by_n_and_sigma_over_one_stroke(n: float, sigma: float) -> None:
    """From u0 to u1, where d(omega) = -slope(u1)*(d(xi)(u1) - d(xi)(u0)), with xi(u; n, sigma) in 30 digits."""
    rho, curvature = 4.0, 2.0 * sigma - 1.0
    for u_0, u_1 in ((-0.95, -0.3), (-0.7, 0.4), (0.1, 0.9)):
        travel, by_n, by_curvature = (
            float(at_1 - at_0) for at_0, at_1 in zip(xi_of(u_0, n, sigma), xi_of(u_1, n, sigma), strict=True)
        )
        slope = 1.0 - u_1**n if u_1 >= 0.0 else 1.0 + curvature * (-u_1) ** n
        omega, derivatives = omega_gradients(n, sigma, rho, np.array([0.0, travel / rho]), u_0)
        assert omega[1] == pytest.approx(u_1, abs=1e-10)  # the accuracy asked of W
        expected = np.array([slope * travel / rho, -2.0 * slope * by_curvature, -slope * by_n])
        # W' and the integrals at an omega off by 1e-13 to 1e-12.
        np.testing.assert_allclose(derivatives[:3, 1], expected, rtol=1e-10, atol=1e-14)


def xi_of(u: float, n: float, sigma: float) -> tuple[mpmath.mpf, mpmath.mpf, mpmath.mpf]:
    """W^-1(u) and its derivatives by n and by 2 sigma - 1."""

    def xi(n: mpmath.mpf, curvature: mpmath.mpf) -> mpmath.mpf:
        power = mpmath.mpf(u) ** n if u >= 0.0 else -curvature * mpmath.mpf(-u) ** n
        return u * mpmath.hyp2f1(1, 1 / n, 1 + 1 / n, power)

    with mpmath.workdps(30):
        at = mpmath.mpf(n), 2 * mpmath.mpf(sigma) - 1
        return xi(*at), mpmath.diff(xi, at, (1, 0)), mpmath.diff(xi, at, (0, 1))


@pytest.mark.parametrize("sigma", [0.8, 3.0])
@pytest.mark.parametrize("start", [0.9, 1.0])  # 1: a stroke that follows saturation
def test_gradient_of_exponential_recovery(start: float, sigma: float) -> None:
    """n = 1: on a falling branch -omega = w obeys dw/ds = -rho*(1 + c*w), c = 2 sigma - 1."""
    rho, s = 4.0, np.linspace(0.01, 0.08, 10)
    c = 2.0 * sigma - 1.0
    decay = np.exp(-c * rho * s)
    w = ((1.0 + c * start) * decay - 1.0) / c
    assert np.all(w > 0.0)
    omega, derivatives = omega_gradients(1.0, sigma, rho, np.concatenate([[0.0], s]), -start)
    by_c = (start * decay - (1.0 + c * start) * rho * s * decay) / c - w / c
    np.testing.assert_allclose(omega[1:], -w, rtol=0.0, atol=1e-12)  # W's interpolation, as below
    np.testing.assert_allclose(derivatives[0, 1:], (1.0 + c * start) * s * decay, rtol=1e-11)
    np.testing.assert_allclose(derivatives[1, 1:], -2.0 * by_c, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(derivatives[3, 1:], decay, rtol=1e-11)


def test_gradient_of_tanh() -> None:
    """n = 2: omega = tanh(artanh(omega_start) + rho*s) while omega is positive."""
    rho, start, s = 4.0, 0.2, np.linspace(0.01, 1.0, 10)
    omega, derivatives = omega_gradients(2.0, 1.7, rho, np.concatenate([[0.0], s]), start)
    expected = np.tanh(np.arctanh(start) + rho * s)
    np.testing.assert_allclose(omega[1:], expected, rtol=0.0, atol=1e-12)  # W's interpolation, as below
    np.testing.assert_allclose(derivatives[0, 1:], (1.0 - expected**2) * s, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(derivatives[1, 1:], 0.0, rtol=0.0, atol=0.0)
    by_start = (1.0 - expected**2) / (1.0 - start**2)
    np.testing.assert_allclose(derivatives[3, 1:], by_start, rtol=0.0, atol=1e-11)


def test_gradient_at_the_cusp_is_finite() -> None:
    for n in (N_RANGE[0], 0.22, 0.9):
        kernel = Kernel(replace(SPRING, n=n, sigma=SIGMA_RANGE[1]))
        path = along(SPRING, [0.0, 1e-14, 0.5, 0.5, 0.1])
        for gradients in kernel.gradients(path, 0.0):
            values = [np.ctypeslib.as_array(getattr(g, name)) for g in gradients for name in ("kE", "kA")]
            values += [
                np.array([getattr(g, name) for name in ("displacement", "omega_start", *SCALARS)]) for g in gradients
            ]
            assert all(np.all(np.isfinite(value)) for value in values)
