"""The classic and the normalized Bouc-Wen model, paper eqs. (1)-(5), and where displacement is counted from."""

from __future__ import annotations

import math
import zipfile
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from springs import EXAMPLES, MOUNT, TABLE
from strandspring import ClassicBoucWen, NormalizedBoucWen, Spring, SpringParameters, StrandspringError
from strandspring.model.coordinates import chosen_zero, counted_from, sensible_zero

CLASSIC = {
    "n below 1": ClassicBoucWen(alpha=0.1, k=2e4, D=0.003, A=1.0, beta=0.7, gamma=0.2, n=0.4),
    "n is 1": ClassicBoucWen(alpha=0.3, k=5e4, D=0.002, A=1.5, beta=0.5, gamma=0.5, n=1.0),
    "negative gamma": ClassicBoucWen(alpha=0.05, k=1e4, D=0.004, A=0.8, beta=2.0, gamma=-0.6, n=1.7),
    "n is 2": ClassicBoucWen(alpha=0.5, k=3e3, D=0.01, A=2.0, beta=1.0, gamma=0.0, n=2.0),
}
TURNS = (0.0, 0.012, -0.008, 0.004, -0.015, 0.015)  # [m]
RANGE = (-0.02, 0.02)  # [m]


def equations_1_and_2(m: ClassicBoucWen) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and force by Runge-Kutta of order 8 from the equations as printed."""
    from scipy.integrate import solve_ivp

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
        z = solution.y[0, -1]
        x = begin + velocity * times[1:]
        displacement.extend(x)
        force.extend(m.alpha * m.k * x + (1.0 - m.alpha) * m.D * m.k * solution.y[0])
    return np.array(displacement), np.array(force)


@pytest.mark.parametrize("classic", CLASSIC.values(), ids=CLASSIC)
def test_the_spring_of_a_classic_model_has_its_response(classic: ClassicBoucWen) -> None:
    displacement, force = equations_1_and_2(classic)
    normalized = classic.to_normalized()
    # A straight line and a constant amplifier continue as themselves: the range does not matter.
    for ends in (RANGE, (-0.001, 0.003)):
        response = Spring(normalized.to_parameters(*ends)).response(displacement)
        # The integrator's accuracy where a step crosses the cusp of n = 0.4.
        assert np.max(np.abs(response - force)) <= 1e-8 * np.max(np.abs(force))
    back = normalized.to_classic(classic.D, classic.A)
    # A power 1/n and its inverse, n = 0.4 at the worst: rounding times 1/n.
    assert tuple(asdict(back).values()) == pytest.approx(tuple(asdict(classic).values()), rel=1e-14)


@settings(max_examples=50)
@given(
    st.floats(1e-3, 1e6), st.floats(1e-3, 1e4), st.floats(1.0, 1e5), st.floats(0.5, 50.0), st.floats(0.2, 10.0),
    st.floats(1e-4, 1.0), st.floats(0.1, 10.0),
)  # fmt: skip
def test_every_classic_model_of_a_normalized_one_is_the_same_model(
    kappa_x: float, kappa_omega: float, rho: float, sigma: float, n: float, D: float, A: float
) -> None:
    normalized = NormalizedBoucWen(kappa_x, kappa_omega, rho, sigma, n)
    back = normalized.to_classic(D, A).to_normalized()
    # z0^n and its root, and 1 - alpha where alpha is nearly 1: 1e-16*k/(k - kappa_x).
    cancelled = 1.0 + kappa_x * A / (kappa_omega * rho)
    assert tuple(asdict(back).values()) == pytest.approx(tuple(asdict(normalized).values()), rel=1e-13 * cancelled)


# -- where displacement is counted from


@pytest.mark.long
def test_the_rig_s_zero_counts_if_it_lies_within_the_range_unless_another_is_chosen(tmp_path: Path) -> None:
    middle = 0.5 * (MOUNT.displacement_min + MOUNT.displacement_max)
    assert sensible_zero(replace(MOUNT, displacement_min=0.0)) == 0.0
    for choice, zero in ((None, middle), ("rig", 0.0), ("middle", middle), (-0.0125, -0.0125)):
        assert chosen_zero(choice, MOUNT) == pytest.approx(zero, rel=1e-15)
    for value in ("Rig", math.nan, math.inf, 1e10):
        with pytest.raises(StrandspringError, match=r'`zero` must be "rig", "middle" or a displacement of the record'):
            chosen_zero(value, MOUNT)
    narrow = replace(MOUNT, displacement_min=0.05 - 1e-9, displacement_max=0.05 + 1e-9)
    fmu = Spring(MOUNT, "mount").build_fmu(tmp_path, backend="python", zero=-0.02)
    with zipfile.ZipFile(fmu) as archive:
        page = " ".join(archive.read("documentation/index.html").decode().split())
    assert "is -20 mm of the record from which the spring was identified: FMU = record + 0.02" in page
    with pytest.raises(StrandspringError, match=r"Counted from 1e\+12 mm, .* is lost in rounding"):
        counted_from(1e9, narrow)


@pytest.mark.parametrize("spring", [MOUNT, EXAMPLES["dry_friction"], TABLE], ids=["mount", "dry", "table"])
@pytest.mark.parametrize("zero", [-0.3, 0.0123456789, 0.27])
def test_the_force_is_the_same_wherever_displacement_is_counted_from(spring: SpringParameters, zero: float) -> None:
    path = np.linspace(spring.displacement_min - 0.01, spring.displacement_max + 0.01, 50)
    path = np.concatenate([path, path[::-1]])
    found = Spring(counted_from(zero, spring)).response(path - zero)
    # Differences of the order of 0.3 m are rounded to 5e-17 m; the steepest spring has some 1e5 N/m.
    np.testing.assert_allclose(found, Spring(spring).response(path), rtol=0.0, atol=1e-10)
