"""omega along paths that turn often, against the hypergeometric form evaluated with 30 digits."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from strandspring import SpringParameters
from strandspring.kernel.path import PathSolver

mpmath.mp.dps = 30
_CLOSE = mpmath.mpf(10) ** -24


class ExactSpring:
    """omega along a path by S(u) = u*2F1(1, 1/n; 1 + 1/n; u^n), T(w) = w*2F1(1, 1/n; 1 + 1/n; -(2 sigma - 1)*w^n)."""

    def __init__(self, rho: float, sigma: float, n: float) -> None:
        self.rho, self.curvature, self.n = mpmath.mpf(rho), 2 * mpmath.mpf(sigma) - 1, mpmath.mpf(n)

    def xi(self, u: mpmath.mpf) -> mpmath.mpf:
        """W^-1(u)."""
        factor = 1 if u >= 0 else -self.curvature
        return u * mpmath.hyp2f1(1, 1 / self.n, 1 + 1 / self.n, factor * abs(u) ** self.n)

    def u(self, xi: mpmath.mpf, guess: float) -> mpmath.mpf:
        """W(xi) by Newton's method."""
        u = mpmath.mpf(guess)
        for _ in range(50):
            slope = 1 - u**self.n if u >= 0 else 1 + self.curvature * (-u) ** self.n
            step = (xi - self.xi(u)) * slope
            # Neither to the other branch nor beyond saturation.
            u_next = u + step if (u + step) / u > 0 and u + step < 1 else (u / 2 if step * u < 0 else (1 + u) / 2)
            if abs(u_next - u) < _CLOSE:
                return u_next
            u = u_next
        raise AssertionError(f"no convergence at xi = {xi}")

    def omega(self, path: list[float], omega_start: float, guesses: list[float]) -> list[mpmath.mpf]:
        """omega at each sample; the samples must differ from their neighbours."""
        omega, direction, start, xi_start = mpmath.mpf(omega_start), 0, mpmath.mpf(path[0]), mpmath.mpf(0)
        found = [omega]
        for before, here, guess in zip(path[:-1], path[1:], guesses[1:], strict=True):
            way = 1 if here > before else -1
            if way != direction:
                direction, start, xi_start = way, mpmath.mpf(before), self.xi(way * omega)
            omega = way * self.u(xi_start + self.rho * abs(mpmath.mpf(here) - start), way * guess)
            found.append(omega)
        return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rho", "sigma", "n"),
    [
        (400.0, 1.0, 0.22),
        (120.0, 13.6, 5.1),
        (50.0, 0.5, 3.9),
        (90.0, 2.4, 8.8),
        (30.0, 1.9, 100.0),
        (200.0, 40.0, 0.7),
    ],
)
def test_omega_along_many_reversals(rho: float, sigma: float, n: float) -> None:
    drawn = np.random.default_rng(20).uniform(-1.0, 1.0, 150)
    # Large strokes, and small ones that drift.
    path = np.concatenate([0.01 * drawn, np.cumsum(1e-4 * drawn * (-1.0) ** np.arange(drawn.size))])
    solver = PathSolver(SpringParameters((0.0,), (1.0,), 1.0, rho, sigma, n, 0.0, -0.02, 0.02))
    omega = solver.omega(path, 0.3)
    # Newton's method needs a guess on the right side of zero and below saturation.
    guesses = np.where(np.abs(omega) < 1e-9, 1e-9, np.clip(omega, -1.0, 1.0 - 1e-12))
    exact = ExactSpring(rho, sigma, n).omega(path.tolist(), 0.3, guesses.tolist())
    errors = [abs(float(a - mpmath.mpf(b))) for a, b in zip(exact, omega.tolist(), strict=True)]
    # The table's 3e-14, and the rounding of xi = rho*distance times the slope, at most 2 sigma.
    assert max(errors) <= 5e-14 + 2.0 * sigma * rho * 4e-18 + 2.0 * sigma * 4e-16
