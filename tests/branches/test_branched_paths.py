"""Paths of springs with a second mechanism and Maxwell branches, against an ODE solver and closed forms."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from branched_springs import BASE, BRANCHED, BRANCHES, oracle_force, uneven_motion
from oracles import exact_maxwell
from strandspring import Spring, SpringParameters, StrandspringError
from strandspring.core.branches import MaxwellBranch
from strandspring.kernel.branches import as_times, maxwell_columns, maxwell_sums
from tools import slow_but

TIME, PATH = uneven_motion()


@pytest.mark.parametrize("name", slow_but(["branches", "both"], ("both",)))
def test_the_force_is_that_of_an_independent_ode(name: str) -> None:
    p = BRANCHED[name]
    starts = (0.3, -0.2)
    found = Spring(p).response(PATH, starts, time=TIME)
    expected = oracle_force(p, PATH, TIME, starts)
    assert found == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())  # table of W: 1e-13; the solver: 1e-11


@pytest.mark.parametrize("name", ["both", "table"])
def test_one_start_is_that_of_both_mechanisms(name: str) -> None:
    spring = Spring(BRANCHED[name])
    assert np.array_equal(spring.response(PATH, 0.4, TIME), spring.response(PATH, (0.4, 0.4), TIME))
    assert not np.array_equal(spring.response(PATH, 0.4, TIME), spring.response(PATH, (0.4, 0.1), TIME))


@pytest.mark.parametrize("branch", BRANCHES, ids=str)
def test_a_branch_follows_a_solver_in_time(branch: MaxwellBranch) -> None:
    # Neither closed form nor steps: dr/dt along the straight pieces.
    path, time = PATH[:30], np.linspace(0.0, 0.9, 30)
    found = maxwell_sums([branch], path, time)
    state, rows = np.zeros(3), [np.zeros(3)]
    for k in range(29):
        v = (path[k + 1] - path[k]) / (time[k + 1] - time[k])

        def change(_: float, y: np.ndarray, v: float = v) -> list[float]:
            r = y[0]
            lost = r * r / (branch.stiffness * branch.time_constant)
            return [branch.stiffness * v - r / branch.time_constant, r * v, lost]

        span = (time[k], time[k + 1])
        state = solve_ivp(change, span, state, method="LSODA", rtol=1e-12, atol=1e-13).y[:, -1]
        rows.append(state)
    force, work, lost = np.transpose(rows)
    # LSODA's error over these steps is below 1e-9 of the largest value.
    assert found[0] == pytest.approx(force, abs=1e-8 * np.abs(force).max())
    assert found[1] == pytest.approx(work, abs=1e-8 * work.max())
    assert found[1] - found[2] == pytest.approx(lost, abs=1e-8 * work.max())


def test_cutting_a_straight_motion_into_steps_changes_nothing() -> None:
    fine = np.unique(np.concatenate([np.linspace(a, b, 7) for a, b in pairwise(TIME)]))
    keep = np.searchsorted(fine, TIME)
    jumps = np.diff(TIME) > 0.0
    time, path = TIME[np.concatenate([[True], jumps])], PATH[np.concatenate([[True], jumps])]
    coarse = maxwell_sums(BRANCHES, path, time)
    cut = maxwell_sums(BRANCHES, np.interp(fine, time, path), fine)[:, np.unique(keep)]
    assert cut == pytest.approx(coarse, rel=1e-11, abs=1e-11 * np.abs(coarse).max())  # rounding of 700 steps


def test_times_in_which_nothing_decays_make_a_branch_a_spring_and_long_ones_a_dashpot() -> None:
    stiff = MaxwellBranch(500.0, 1e9)
    at_once = maxwell_sums([stiff], PATH, np.zeros(PATH.size))[0]
    assert at_once == pytest.approx(500.0 * (PATH - PATH[0]), rel=1e-13, abs=1e-13)
    viscosity, time = 20.0, np.linspace(0.0, 1.0, PATH.size)
    dashpot = MaxwellBranch(viscosity / 1e-9, 1e-9)
    velocity = np.diff(PATH) / np.diff(time)
    assert maxwell_sums([dashpot], PATH, time)[0][1:] == pytest.approx(viscosity * velocity, rel=1e-10)


@pytest.mark.parametrize("tau", [1e-5, 0.02, 0.7, 60.0])
def test_columns_and_their_derivatives_are_exact(tau: float) -> None:
    columns, by_log = maxwell_columns([tau, 2.0 * tau], PATH, TIME)
    exact = exact_maxwell(MaxwellBranch(1.0, tau), PATH, TIME)
    assert columns[0] == pytest.approx([float(value) for value in exact], rel=1e-12, abs=1e-15 * np.ptp(PATH))
    assert np.array_equal(columns[1], maxwell_columns([2.0 * tau], PATH, TIME)[0][0])
    with mpmath.workdps(60):
        step = mpmath.mpf(10) ** -20
        low, high = (tau * mpmath.exp(side * step) for side in (-1, 1))
        # 60 digits leave 40 of the difference.
        pairs = zip(*(exact_maxwell(MaxwellBranch(1.0, end), PATH, TIME) for end in (low, high)), strict=True)
        expected = [float((b - a) / (2 * step)) for a, b in pairs]
    assert by_log[0] == pytest.approx(expected, rel=1e-11, abs=1e-14 * np.ptp(PATH))


@pytest.mark.parametrize("name", ["branches", "both"])
def test_energies_are_those_of_all_parts(name: str) -> None:
    p = BRANCHED[name]
    spring = Spring(p)
    parts = [Spring(mechanism).absorbed_energy(PATH) for mechanism in p.mechanisms]
    of_branches = spring.absorbed_energy(PATH, time=TIME) - sum(parts)
    forces = [np.array([float(value) for value in exact_maxwell(b, PATH, TIME)]) for b in p.branches]
    stored = sum(0.5 * force**2 / branch.stiffness for force, branch in zip(forces, p.branches, strict=True))
    assert spring.stored_energy(PATH, TIME) == pytest.approx(stored, rel=1e-11, abs=1e-15)
    dissipated = of_branches - stored
    assert np.diff(dissipated).min() >= -1e-12 * dissipated[-1]  # a branch can only lose energy; rounding


def test_stiffness_is_that_of_fast_motion() -> None:
    p = BRANCHED["both"]
    found = Spring(p).stiffness(PATH)
    parts = sum(Spring(mechanism).stiffness(PATH) for mechanism in p.mechanisms)
    assert found == pytest.approx(parts + sum(branch.stiffness for branch in p.branches), rel=1e-14)
    # A small jump onwards after the path.
    jump = 1e-9 * np.sign(PATH[-1] - PATH[-2])
    force = Spring(p).response([*PATH, PATH[-1] + jump], time=[*TIME, TIME[-1]])
    assert (force[-1] - force[-2]) / jump == pytest.approx(found[-1], rel=1e-5)  # of a difference of 1e-9 m


def test_plain_springs_do_not_depend_on_times() -> None:
    spring = Spring(BASE)
    assert np.array_equal(spring.response(PATH), spring.response(PATH, time=TIME))
    assert not spring.stored_energy(PATH).any()


def test_a_spring_with_branches_wants_times() -> None:
    with pytest.raises(StrandspringError, match=r"3 Maxwell branches .* give them \(`time`\)"):
        Spring(BRANCHED["branches"]).response(PATH)
    assert np.isfinite(Spring(BRANCHED["second"]).response(PATH)).all()


@pytest.mark.parametrize(
    ("time", "sentence"),
    [
        ([0.0, 1.0], r"`time` must have shape \(3,\) as the displacement has, got shape \(2,\)"),
        ([0.0, np.nan, 1.0], r"`time` must be finite \[s\], got nan at index 1"),
        ([0.0, 1.0, 0.5], r"`time` must not fall \[s\], got 0.5 after 1.0 at index 2"),
    ],
)
def test_bad_times_are_refused(time: list[float], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        as_times(time, 3)


@pytest.mark.parametrize("starts", [(0.1, 0.2, 0.3), (0.0, 1.5)])
def test_bad_starts_are_refused(starts: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="`omega_start` must be"):
        Spring(BRANCHED["second"]).response(PATH, starts)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (
            {"second": {"kA": (1.0,), "kappa_omega": 0.0, "rho": 1.0, "sigma": 1.0, "n": 1.0}},
            "`second.kappa_omega` must",
        ),
        ({"second": {"kA": (2.0,), "kappa_omega": 1.0, "rho": 1e3, "sigma": 1.0, "n": 1.0}}, r"`second.kA\[0\]` must"),
        ({"second": {"kA": (1.0, -80.0), "kappa_omega": 1.0, "rho": 1e3, "sigma": 1.0, "n": 1.0}}, "`second.kA`"),
        ({"branches": (MaxwellBranch(-1.0, 1.0),)}, r"`branches\[0\].stiffness` must be within \[0, "),
        ({"branches": (MaxwellBranch(1.0, 1.0), MaxwellBranch(1.0, 0.0))}, r"`branches\[1\].time_constant` must"),
        ({"branches": (MaxwellBranch(float("nan"), 1.0),)}, r"`branches\[0\].stiffness` must be within .* got nan"),
        ({"branches": (MaxwellBranch(1.0, 1.0),) * 4}, "at most 3 Maxwell branches, got 4"),
    ],
)
def test_impossible_parts_are_refused(change: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        replace(BASE, **change)  # type: ignore[arg-type]


def test_mappings_stand_for_parts() -> None:
    p = BRANCHED["both"]
    assert SpringParameters(**p.as_dict()) == p
    assert not {"second", "branches"} & set(BASE.as_dict())
