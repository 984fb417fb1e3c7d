"""A mass on a spring with a second mechanism and Maxwell branches: harmonic balance against an ODE solver in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from branched_springs import BASE, SECOND
from spring_oracle import OracleSpring
from strandspring import Spring, SpringParameters
from strandspring.core.branches import MaxwellBranch
from strandspring.kernel.path import PathSolver
from strandspring.loops.loop import steady_loop
from strandspring.vibration.one_mass.harmonic_balance import linear_motion, mass_balance
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass, static_equilibrium
from tools import slow_but

# Branches that bend the response at its resonance of 15 Hz: omega*tau is 2 and 50 there.
BRANCHES = (MaxwellBranch(4000.0, 0.02), MaxwellBranch(900.0, 0.5))
SPRINGS = {
    "second": replace(BASE, second=SECOND),
    "branches": replace(BASE, branches=BRANCHES),
    "both": replace(BASE, second=SECOND, branches=BRANCHES),
}
LEVEL, MASS = 5e-4, 2.0


def mounted(p: SpringParameters, parallel: int = 1, series: int = 1) -> IsolatedMass:
    """A mass that rests at the middle of the range, midway in the hysteresis."""
    load = parallel * float(Spring(replace(p, branches=())).response([0.05])[0])
    return IsolatedMass(p, parallel / series * MASS, load, parallel, series)


def simulated(p: SpringParameters, system: IsolatedMass, omega: float, periods: int) -> complex:
    """Absolute over base motion at Omega [rad/s], from the first harmonic of the last period of a simulation."""
    mechanisms = [(OracleSpring(m.as_dict()), m) for m in p.mechanisms]
    count = len(mechanisms)

    def change(t: float, y: np.ndarray) -> Sequence[float]:
        z, v, omegas, elongations = y[0], y[1], y[2 : 2 + count], y[2 + count :]
        x = np.array([0.05 + z])
        force = sum(b.stiffness * s for b, s in zip(p.branches, elongations, strict=True))
        rates = []
        for (oracle, m), w in zip(mechanisms, omegas, strict=True):
            force += float(oracle.elastic(x)[0] + m.kappa_omega * oracle.amplifier(x)[0] * w)
            sign = np.sign(v) * np.sign(w)
            # Paper eq. (11)
            rates.append(m.rho * v * (1.0 - (m.sigma * sign - m.sigma + 1.0) * min(abs(w), 1.0) ** m.n))
        acceleration = (system.static_load - force) / system.mass + LEVEL * omega**2 * np.cos(omega * t)
        return [
            v,
            acceleration,
            *rates,
            *(v - s / b.time_constant for b, s in zip(p.branches, elongations, strict=True)),
        ]

    period = 2.0 * np.pi / omega
    times = period * (periods - 1 + np.arange(200) / 200)
    y0 = np.zeros(2 + count + len(p.branches))
    run = solve_ivp(change, (0.0, period * periods), y0, t_eval=times, rtol=1e-6, atol=1e-9, max_step=period / 30)
    first = 2.0 * np.mean(run.y[0] * np.exp(-1j * omega * times))
    return complex((first + LEVEL) / LEVEL)


@pytest.mark.parametrize("name", slow_but(SPRINGS, ("both",)))
def test_the_steady_motion_is_that_of_a_simulation_in_time(name: str) -> None:
    p = SPRINGS[name]
    system = mounted(p)
    natural = static_equilibrium(system).frequency
    response = frequency_response(system, Excitation.BASE_DISPLACEMENT, LEVEL, natural * np.geomspace(0.3, 3.0, 25))
    place = int(np.argmax(response.columns["transmissibility"]))
    for k in (place, place + 3):
        frequency = float(response.columns["frequency"][k])
        expected = simulated(p, system, 2.0 * np.pi * frequency, 16)
        # The balance leaves out harmonics above its last: 1e-3 near a corner of the loop.
        assert response.columns["transmissibility"][k] == pytest.approx(abs(expected), rel=3e-3)
        assert response.columns["phase"][k] == pytest.approx(np.degrees(np.angle(expected)), abs=0.3)


@pytest.mark.parametrize("name", SPRINGS)
def test_derivatives_of_the_balance_are_exact(name: str) -> None:
    system = mounted(SPRINGS[name], parallel=4, series=2)
    rest = static_equilibrium(system)
    balance = mass_balance(system, rest, Excitation.BASE_DISPLACEMENT, 1e-3)
    omega = 2.0 * np.pi * rest.frequency
    z = linear_motion(balance, np.array([rest.stiffness]), np.zeros(1), omega)
    at, step = balance.at(z, omega), 1e-7
    for k in range(z.size):
        moved = np.zeros(z.size)
        moved[k] = step
        column = (balance.at(z + moved, omega).residual - balance.at(z - moved, omega).residual) / (2.0 * step)
        # The differences of hysteretic forces are of second order, of 1e-7 m here.
        assert at.jacobian[:, k] == pytest.approx(column, abs=1e-6 * np.abs(at.jacobian).max())
    share = 1e-6
    ends = [balance.at(z, omega * (1.0 + side * share)).residual for side in (-1, 1)]
    by_frequency = (ends[1] - ends[0]) / (2.0 * share * omega)
    assert at.by_frequency == pytest.approx(by_frequency, abs=1e-8 * np.abs(by_frequency).max())


def test_branches_alone_follow_the_transfer_function() -> None:
    # A spring whose friction is lost beside its branches is linear.
    p = SpringParameters((0.0, 9000.0), (1.0,), 1e-9, 100.0, 1.0, 1.0, 0.0, -0.05, 0.05, branches=BRANCHES)
    system = IsolatedMass(p, MASS, load=0.0)
    response = frequency_response(system, Excitation.BASE_DISPLACEMENT, LEVEL, np.geomspace(2.0, 60.0, 30))
    omega = 2.0 * np.pi * response.columns["frequency"]
    turns = [(b.stiffness, 1j * omega * b.time_constant) for b in BRANCHES]
    dynamic = 9000.0 + sum(stiffness * turn / (1.0 + turn) for stiffness, turn in turns)
    expected = dynamic / (dynamic - MASS * omega**2)
    assert response.columns["transmissibility"] == pytest.approx(np.abs(expected), rel=1e-9)  # friction of 1e-9 N
    peak = response.resonance
    turning = 2.0 * np.pi * peak.frequency
    at_peak = 9000.0 + sum(branch.dynamic_stiffness(turning) for branch in BRANCHES)
    assert peak.stiffness == pytest.approx(at_peak.real, rel=1e-8)
    assert peak.loss_factor == pytest.approx(at_peak.imag / at_peak.real, rel=1e-6)
    natural = 2.0 * np.pi * static_equilibrium(system).frequency
    elastic = 9000.0 + sum(branch.dynamic_stiffness(natural).real for branch in BRANCHES)
    assert natural == pytest.approx(np.sqrt(elastic / MASS), rel=1e-10)  # friction adds 1e-7 N/m


def test_springs_side_by_side_and_in_series_scale_all_parts() -> None:
    one, many = (mounted(SPRINGS["both"], *counts) for counts in ((1, 1), (6, 3)))
    band = [6.0, 12.0, 15.0, 30.0]
    single = frequency_response(one, Excitation.BASE_DISPLACEMENT, LEVEL, band)
    several = frequency_response(many, Excitation.BASE_DISPLACEMENT, 3.0 * LEVEL, band)
    ratios = [
        np.interp(band, response.columns["frequency"], response.columns["transmissibility"])
        for response in (single, several)
    ]
    assert ratios[0] == pytest.approx(ratios[1], rel=1e-6)  # of Newton's method


def test_slow_loops_are_those_without_branches() -> None:
    p = SPRINGS["both"]
    slow = steady_loop(PathSolver(p), 0.04, 0.06).figures
    assert slow == steady_loop(PathSolver(SPRINGS["second"]), 0.04, 0.06).figures
    # Of both mechanisms, after cycles that repeat.
    path = np.tile(np.concatenate([np.linspace(0.04, 0.06, 200), np.linspace(0.06, 0.04, 200)[1:-1]]), 12)
    energy = PathSolver(SPRINGS["second"]).absorbed_energy(path)
    cycle = energy[-1] - energy[-1 - 398]
    assert slow.energy_per_cycle == pytest.approx(cycle, rel=1e-9)


def test_isolate_and_study_take_such_springs() -> None:
    spring = Spring(SPRINGS["both"], "mount")
    result = spring.isolate(mass=10.0, base_displacement=2e-4, points=8)
    assert result.systems if hasattr(result, "systems") else str(result)
    rows = spring.study(mass=[9.0, 10.0], base_displacement=2e-4, draws=0, stiffness=[1.0, 2.0])
    assert "refused" not in str(rows).splitlines()[0] or "0 refused" in str(rows).splitlines()[0]
