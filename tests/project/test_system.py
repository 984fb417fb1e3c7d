"""The FMU inside a larger system: the documentation's mass on the spring against a monolithic solution."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pages import program_with
from springs import MOUNT
from strandspring import Spring
from strandspring.core.law import SpringLaw
from strandspring.core.restoring import restoring_force
from strandspring.fmu.python_backed import build_python_fmu

MASS, LOAD, MIDDLE = 5.0, 50.0, 0.05
AMPLITUDE, CIRCULAR = 0.004, 2.0 * np.pi * 7.0
STOP = 0.5
STEPS = (1e-3, 5e-4, 2.5e-4)


def base(t: float) -> float:
    return float(AMPLITUDE * np.sin(CIRCULAR * t))


def base_speed(t: Any) -> Any:
    return AMPLITUDE * CIRCULAR * np.cos(CIRCULAR * t)


def monolithic(times: np.ndarray) -> np.ndarray:
    """Position, speed, omega and absorbed energy by one solver, restarted at each reversal of the spring.

    omega is integrated by eq. (22), so nothing of the closed form enters.
    """
    law, p = SpringLaw(MOUNT), MOUNT
    state, now = np.zeros(4), 0.0
    direction = -np.sign(base_speed(0.0))
    found = [state]
    while len(found) < times.size:

        def rate(t: float, z: np.ndarray, direction: float = direction) -> list[float]:
            position, speed, omega, _ = z
            force = restoring_force(law, position - base(t), omega)
            slip = speed - base_speed(t)
            u = direction * omega
            slope = 1.0 - u**p.n if u >= 0.0 else 1.0 + (2.0 * p.sigma - 1.0) * (-u) ** p.n
            return [speed, (LOAD - force) / MASS, p.rho * slope * slip, force * slip]

        def reversal(t: float, z: np.ndarray, begin: float = now, direction: float = direction) -> float:
            # At the start of a stroke the slip is zero and must not end it at once.
            return float(z[1] - base_speed(t)) if t > begin + 1e-6 else float(direction)

        reversal.terminal = True  # type: ignore[attr-defined]
        piece = solve_ivp(
            rate, (now, STOP), state, "DOP853", dense_output=True, events=reversal, rtol=1e-10, atol=1e-13
        )
        now, state, direction = piece.t[-1], piece.y[:, -1], -direction
        found += [piece.sol(t) for t in times[len(found) :] if t <= now]
    return np.array(found).T


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[np.ndarray]:
    namespace: dict[str, Any] = {}
    exec(compile(program_with("def simulate"), "coupling.md", "exec"), namespace)
    fmu = build_python_fmu(Spring(MOUNT, "mount").model, tmp_path_factory.mktemp("system"), zero=0.0)
    return [namespace["simulate"](str(fmu), MASS, LOAD, base, MIDDLE, step, STOP) for step in STEPS]


@pytest.mark.slow
def test_displacement_force_and_energy_agree_with_the_expected_order(runs: list[np.ndarray]) -> None:
    times = np.linspace(0.0, STOP, round(STOP / STEPS[0]) + 1)
    position, speed, omega, energy = monolithic(times)
    slip = position - np.array([base(t) for t in times])
    force = Spring(MOUNT).response(MIDDLE + slip)  # only for its scale
    expected = {
        "position": position,
        "force": np.array([restoring_force(SpringLaw(MOUNT), x, w) for x, w in zip(slip, omega, strict=True)]),
        "energy": energy,
    }
    scale = {"position": np.ptp(position), "force": np.ptp(force), "energy": energy[-1]}
    assert np.ptp(speed) > 0.1  # the mass does move
    for row, name in ((1, "position"), (3, "force"), (4, "energy")):
        errors = [np.max(np.abs(run[row, :: 2**k] - expected[name])) / scale[name] for k, run in enumerate(runs)]
        # Velocity Verlet is of second order and the force's kinks at reversals do not lower it: each halving of
        # the step divides the error by four. Measured: 4.0 to 4.2.
        orders = np.log2(np.array(errors[:-1]) / errors[1:])
        assert orders == pytest.approx(2.0, abs=0.15), (name, errors)
        assert errors[-1] < 5e-4, (name, errors)


def test_absorbed_energy_balances_the_work(runs: list[np.ndarray]) -> None:
    """Both sides by the trapezoidal rule over the steps, whose error is of second order too."""
    gaps = []
    for run in runs:
        times, position, speed, force, energy = run
        slip = position - np.array([base(t) for t in times])
        work = np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(slip))
        power_of_base = force * base_speed(times)
        by_base = np.sum(0.5 * (power_of_base[1:] + power_of_base[:-1]) * np.diff(times))
        # d(m v^2/2) = (load - force) dy and dy = d(slip) + d(base).
        balance = 0.5 * MASS * speed[-1] ** 2 - LOAD * position[-1] + energy[-1] + by_base
        gaps.append((abs(work - energy[-1]) / energy[-1], abs(balance) / energy[-1]))
    assert max(gaps[-1]) < 1e-4, gaps
    ratios = np.array(gaps[0]) / np.array(gaps[-1])
    # Two halvings of the step: sixteen times less, up to how the last sample falls.
    assert (ratios > 8.0).all(), gaps
