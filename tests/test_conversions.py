"""The classic and the normalized Bouc-Wen model, paper eqs. (1)-(5)."""

from __future__ import annotations

from dataclasses import asdict, replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from strandspring import ClassicBoucWen, NormalizedBoucWen, Spring

LAW = settings(max_examples=100)

CLASSIC = {
    "n below 1": ClassicBoucWen(alpha=0.1, k=2e4, D=0.003, A=1.0, beta=0.7, gamma=0.2, n=0.4),
    "n is 1": ClassicBoucWen(alpha=0.3, k=5e4, D=0.002, A=1.5, beta=0.5, gamma=0.5, n=1.0),
    "negative gamma": ClassicBoucWen(alpha=0.05, k=1e4, D=0.004, A=0.8, beta=2.0, gamma=-0.6, n=1.7),
    "n is 2": ClassicBoucWen(alpha=0.5, k=3e3, D=0.01, A=2.0, beta=1.0, gamma=0.0, n=2.0),
}
TURNS = (0.0, 0.012, -0.008, 0.004, -0.015, 0.015)  # [m]
RANGE = (-0.02, 0.02)  # [m]

classic_models = pytest.mark.parametrize("classic", CLASSIC.values(), ids=CLASSIC)


def integrate_equations_1_and_2(model: ClassicBoucWen) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and force by Runge-Kutta of order 8 from the equations as printed."""
    m = model
    displacement, force, z = [TURNS[0]], [m.alpha * m.k * TURNS[0]], 0.0
    for begin, end in pairwise(TURNS):
        velocity = float(np.sign(end - begin))

        def rate(_time: float, state: np.ndarray, velocity: float = velocity) -> float:
            # |z|^(n-1)*z of the paper is singular as written for n < 1 at z = 0; this is its limit.
            odd = np.sign(state[0]) * abs(state[0]) ** m.n
            return (m.A * velocity - m.beta * abs(velocity) * odd - m.gamma * velocity * abs(state[0]) ** m.n) / m.D

        times = np.linspace(0.0, abs(end - begin), 60)
        solution = solve_ivp(
            rate, (0.0, times[-1]), [z], method="DOP853", t_eval=times[1:], rtol=1e-11, atol=1e-13, max_step=1e-4
        )
        assert solution.success
        z = solution.y[0, -1]
        x = begin + velocity * times[1:]
        displacement.extend(x)
        force.extend(m.alpha * m.k * x + (1.0 - m.alpha) * m.D * m.k * solution.y[0])
    return np.array(displacement), np.array(force)


@classic_models
def test_the_spring_of_a_classic_model_has_its_response(classic: ClassicBoucWen) -> None:
    displacement, force = integrate_equations_1_and_2(classic)
    response = Spring(classic.to_normalized().to_parameters(*RANGE)).response(displacement)
    # The integrator's accuracy where a step crosses the cusp of n = 0.4.
    assert np.max(np.abs(response - force)) <= 1e-8 * np.max(np.abs(force))


@classic_models
def test_normalized_and_classic_undo_each_other(classic: ClassicBoucWen) -> None:
    back = classic.to_normalized().to_classic(classic.D, classic.A)
    # A power 1/n and its inverse, n = 0.4 at the worst: rounding times 1/n.
    assert tuple(asdict(back).values()) == pytest.approx(tuple(asdict(classic).values()), rel=1e-14)


@LAW
@given(
    kappa_x=st.floats(1e-3, 1e6),
    kappa_omega=st.floats(1e-3, 1e4),
    rho=st.floats(1.0, 1e5),
    sigma=st.floats(0.5, 50.0),
    n=st.floats(0.2, 10.0),
    D=st.floats(1e-4, 1.0),
    A=st.floats(0.1, 10.0),
)
def test_every_classic_model_of_a_normalized_one_is_the_same_model(
    kappa_x: float, kappa_omega: float, rho: float, sigma: float, n: float, D: float, A: float
) -> None:
    normalized = NormalizedBoucWen(kappa_x, kappa_omega, rho, sigma, n)
    back = normalized.to_classic(D, A).to_normalized()
    # z0^n and its root, and 1 - alpha where alpha is nearly 1: 1e-16*k/(k - kappa_x).
    cancelled = 1.0 + kappa_x * A / (kappa_omega * rho)
    assert tuple(asdict(back).values()) == pytest.approx(tuple(asdict(normalized).values()), rel=1e-13 * cancelled)


@classic_models
@pytest.mark.parametrize(("c", "mu"), [(1.0, 3.0), (0.4, 1.0), (2.5, 0.2)])
def test_different_classic_parameters_have_one_response(classic: ClassicBoucWen, c: float, mu: float) -> None:
    # Scaling eq. (2) by c and writing it for z' = mu*z leaves r the same, if k gives way.
    k = classic.alpha * classic.k + (1.0 - classic.alpha) * classic.k / c
    other = ClassicBoucWen(
        alpha=classic.alpha * classic.k / k,
        k=k,
        D=c * classic.D / mu,
        A=c * classic.A,
        beta=c * classic.beta / mu**classic.n,
        gamma=c * classic.gamma / mu**classic.n,
        n=classic.n,
    )
    one, two = classic.to_normalized(), other.to_normalized()
    # Rounding of a dozen operations and of a power 1/n.
    assert tuple(asdict(two).values()) == pytest.approx(tuple(asdict(one).values()), rel=1e-13)
    path = np.array(TURNS)
    forces = [Spring(m.to_parameters(*RANGE)).response(path) for m in (one, two)]
    assert forces[0] == pytest.approx(forces[1], rel=0.0, abs=1e-12 * np.max(np.abs(forces[0])))  # the same rounding


def test_the_normalized_spring_is_exact_beyond_its_range_too() -> None:
    # A straight line and a constant amplifier continue as themselves.
    normalized = CLASSIC["n is 2"].to_normalized()
    path = np.array([0.0, 0.015, -0.03, 0.05])
    narrow, wide = normalized.to_parameters(-0.001, 0.003), normalized.to_parameters(-0.1, 0.1)
    expected = Spring(wide).response(path)
    # The offset of 1 mm rounds differently.
    assert Spring(narrow).response(path) == pytest.approx(expected, rel=0.0, abs=1e-12 * np.max(np.abs(expected)))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"alpha": 0.0}, "`alpha` must be within (0, 1), got 0.0."),
        ({"alpha": 1.0}, "`alpha` must be within (0, 1), got 1.0."),
        ({"k": 0.0}, "`k` must be > 0 [N/m], got 0.0."),
        ({"k": float("inf")}, "`k` must be > 0 [N/m], got inf."),
        ({"D": -0.1}, "`D` must be > 0 [m], got -0.1."),
        ({"A": 0.0}, "`A` must be > 0, got 0.0."),
        ({"A": float("nan")}, "`A` must be > 0, got nan."),
        ({"n": 0.0}, "`n` must be > 0, got 0.0."),
        ({"beta": -0.5}, "`beta` must be above -gamma (paper eq. 6), got -0.5."),
        ({"beta": 0.4}, "`beta` must be at least gamma (paper eq. 6), got 0.4."),
    ],
)
def test_impossible_classic_models_are_refused(change: dict[str, float], sentence: str) -> None:
    with pytest.raises(ValueError, match=r"^`") as refusal:
        replace(CLASSIC["n is 1"], **change)
    assert str(refusal.value) == sentence


@pytest.mark.parametrize("kappa_x", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_normalized_models_are_refused(kappa_x: float) -> None:
    with pytest.raises(ValueError, match=r"^`") as refusal:
        NormalizedBoucWen(kappa_x=kappa_x, kappa_omega=1.0, rho=1.0, sigma=1.0, n=1.0)
    assert str(refusal.value) == f"`kappa_x` must be > 0 [N/m], got {kappa_x!r}."


@pytest.mark.parametrize(
    "change", [{"sigma": 0.4}, {"rho": -1.0}, {"kappa_omega": 0.0}, {"n": 0.0}], ids=lambda change: next(iter(change))
)
def test_a_spring_of_an_impossible_normalized_model_is_refused(change: dict[str, float]) -> None:
    normalized = replace(CLASSIC["n is 1"].to_normalized(), **change)
    with pytest.raises(ValueError, match=f"^`{next(iter(change))}` must be"):
        normalized.to_parameters(*RANGE)
