"""Springs with a second mechanism and Maxwell branches: their paths, model files, isolation and comparison.

Their FMUs are rows of the conformance table, tests/fmi.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from zipfile import ZipFile

import jsonschema
import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from branched_springs import BASE, BRANCHED, BRANCHES, SECOND, uneven_motion
from mounts_with_branches import two_rates
from oracles import OracleSpring, exact_maxwell, oracle_force, rate_of_omega
from springs import EXAMPLES
from strandspring import (
    ModelError,
    Record,
    RefinedOptions,
    Spring,
    SpringParameters,
    StrandspringError,
    compare,
    identify,
)
from strandspring.api.comparing.comparison_words import ComparisonVerdict
from strandspring.api.comparing.differences import parameter_differences
from strandspring.core.branches import MaxwellBranch
from strandspring.core.law import SpringLaw
from strandspring.kernel.branches import as_times, maxwell_columns, maxwell_sums
from strandspring.kernel.path import PathSolver, packed
from strandspring.loops.loop import relaxed_branches, steady_loop
from strandspring.model.joint import JointCovariance
from strandspring.model.modelfile import model_of_text, model_schema
from strandspring.vibration.one_mass.harmonic_balance import linear_motion, mass_balance
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import Excitation, IsolatedMass, static_equilibrium
from tools import slow_but

pytestmark = pytest.mark.long
TIME, PATH = uneven_motion()

# Paths


def test_the_force_is_that_of_an_ode_and_the_energy_that_of_all_parts() -> None:
    p, starts = BRANCHED["both"], (0.3, -0.2)
    spring = Spring(p)
    found, expected = spring.response(PATH, starts, time=TIME), oracle_force(p, PATH, TIME, starts)
    assert found == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())  # table of W: 1e-13; the solver: 1e-11
    parts = [Spring(mechanism).absorbed_energy(PATH) for mechanism in p.mechanisms]
    of_branches = spring.absorbed_energy(PATH, time=TIME) - sum(parts)
    forces = [np.array([float(value) for value in exact_maxwell(b, PATH, TIME)]) for b in p.branches]
    stored = sum(0.5 * force**2 / branch.stiffness for force, branch in zip(forces, p.branches, strict=True))
    assert spring.stored_energy(PATH, TIME) == pytest.approx(stored, rel=1e-11, abs=1e-15)
    dissipated = of_branches - stored
    assert np.diff(dissipated).min() >= -1e-12 * dissipated[-1]  # a branch can only lose energy; rounding
    # Stiffness is that of fast motion: of a small jump onwards after the path.
    stiffness, jump = spring.stiffness(PATH), 1e-9 * np.sign(PATH[-1] - PATH[-2])
    of_mechanisms = sum(Spring(mechanism).stiffness(PATH) for mechanism in p.mechanisms)
    assert stiffness == pytest.approx(of_mechanisms + sum(b.stiffness for b in p.branches), rel=1e-14)
    force = spring.response([*PATH, PATH[-1] + jump], time=[*TIME, TIME[-1]])
    assert (force[-1] - force[-2]) / jump == pytest.approx(stiffness[-1], rel=1e-5)  # of a difference of 1e-9 m


@pytest.mark.parametrize("branch", BRANCHES, ids=str)
def test_a_branch_follows_a_solver_in_time(branch: MaxwellBranch) -> None:
    """Neither closed form nor steps: force, work and loss along the straight pieces."""
    path, time = PATH[:30], np.linspace(0.0, 0.9, 30)
    found, state, rows = maxwell_sums([branch], path, time), np.zeros(3), [np.zeros(3)]
    for k in range(29):
        v = (path[k + 1] - path[k]) / (time[k + 1] - time[k])

        def change(_: float, y: np.ndarray, v: float = v) -> list[float]:
            r, viscosity = y[0], branch.stiffness * branch.time_constant
            return [branch.stiffness * v - r / branch.time_constant, r * v, r * r / viscosity]

        state = solve_ivp(change, (time[k], time[k + 1]), state, method="LSODA", rtol=1e-12, atol=1e-13).y[:, -1]
        rows.append(state)
    force, work, lost = np.transpose(rows)
    # LSODA's error over these steps is below 1e-9 of the largest value.
    assert found[0] == pytest.approx(force, abs=1e-8 * np.abs(force).max())
    assert found[1] == pytest.approx(work, abs=1e-8 * work.max())
    assert found[1] - found[2] == pytest.approx(lost, abs=1e-8 * work.max())


def test_limits_of_a_branch() -> None:
    """Cutting a straight motion changes nothing; times in which nothing decays make a spring, long ones a dashpot."""
    fine = np.unique(np.concatenate([np.linspace(a, b, 7) for a, b in pairwise(TIME)]))
    keep = np.concatenate([[True], np.diff(TIME) > 0.0])
    coarse = maxwell_sums(BRANCHES, PATH[keep], TIME[keep])
    cut = maxwell_sums(BRANCHES, np.interp(fine, TIME[keep], PATH[keep]), fine)[:, np.searchsorted(fine, TIME[keep])]
    assert cut == pytest.approx(coarse, rel=1e-11, abs=1e-11 * np.abs(coarse).max())  # rounding of 700 steps
    at_once = maxwell_sums([MaxwellBranch(500.0, 1e9)], PATH, np.zeros(PATH.size))[0]
    assert at_once == pytest.approx(500.0 * (PATH - PATH[0]), rel=1e-13, abs=1e-13)
    time = np.linspace(0.0, 1.0, PATH.size)
    dashpot = maxwell_sums([MaxwellBranch(20.0 / 1e-9, 1e-9)], PATH, time)[0]
    assert dashpot[1:] == pytest.approx(20.0 * np.diff(PATH) / np.diff(time), rel=1e-10)


@pytest.mark.parametrize("tau", [1e-5, 0.02, 0.7, 60.0])
def test_columns_and_their_derivatives_are_exact(tau: float) -> None:
    columns, by_log = maxwell_columns([tau, 2.0 * tau], PATH, TIME)
    exact = exact_maxwell(MaxwellBranch(1.0, tau), PATH, TIME)
    assert columns[0] == pytest.approx([float(value) for value in exact], rel=1e-12, abs=1e-15 * np.ptp(PATH))
    assert np.array_equal(columns[1], maxwell_columns([2.0 * tau], PATH, TIME)[0][0])
    with mpmath.workdps(60):
        step = mpmath.mpf(10) ** -20  # 60 digits leave 40 of the difference
        low, high = (tau * mpmath.exp(side * step) for side in (-1, 1))
        pairs = zip(*(exact_maxwell(MaxwellBranch(1.0, end), PATH, TIME) for end in (low, high)), strict=True)
        expected = [float((b - a) / (2 * step)) for a, b in pairs]
    assert by_log[0] == pytest.approx(expected, rel=1e-11, abs=1e-14 * np.ptp(PATH))


def test_starts_and_times_of_paths() -> None:
    both, plain = Spring(BRANCHED["both"]), Spring(BASE)
    assert np.array_equal(both.response(PATH, 0.4, TIME), both.response(PATH, (0.4, 0.4), TIME))
    assert not np.array_equal(both.response(PATH, 0.4, TIME), both.response(PATH, (0.4, 0.1), TIME))
    assert np.array_equal(plain.response(PATH), plain.response(PATH, time=TIME))
    assert not plain.stored_energy(PATH).any()
    with pytest.raises(StrandspringError, match=r"3 Maxwell branches .* give them \(`time`\)"):
        both.response(PATH)
    assert np.isfinite(Spring(BRANCHED["second"]).response(PATH)).all()
    for starts in ((0.1, 0.2, 0.3), (0.0, 1.5)):
        with pytest.raises(ValueError, match="`omega_start` must be"):
            Spring(BRANCHED["second"]).response(PATH, starts)
    for time, sentence in (
        ([0.0, 1.0], r"`time` must have shape \(3,\) as the displacement has, got shape \(2,\)"),
        ([0.0, np.nan, 1.0], r"`time` must be finite \[s\], got nan at index 1"),
        ([0.0, 1.0, 0.5], r"`time` must not fall \[s\], got 0.5 after 1.0 at index 2"),
    ):
        with pytest.raises(ValueError, match=sentence):
            as_times(time, 3)


OF_SECOND = {"kA": (1.0,), "kappa_omega": 1.0, "rho": 1e3, "sigma": 1.0, "n": 1.0}
IMPOSSIBLE: list[tuple[dict[str, object], str]] = [
    ({"second": {**OF_SECOND, "kappa_omega": 0.0}}, "`second.kappa_omega` must"),
    ({"second": {**OF_SECOND, "kA": (2.0,)}}, r"`second.kA\[0\]` must"),
    ({"second": {**OF_SECOND, "kA": (1.0, -80.0)}}, "`second.kA`"),
    ({"branches": (MaxwellBranch(-1.0, 1.0),)}, r"`branches\[0\].stiffness` must be within \[0, "),
    ({"branches": (MaxwellBranch(1.0, 1.0), MaxwellBranch(1.0, 0.0))}, r"`branches\[1\].time_constant` must"),
    ({"branches": (MaxwellBranch(float("nan"), 1.0),)}, r"`branches\[0\].stiffness` must be within .* got nan"),
    ({"branches": (MaxwellBranch(1.0, 1.0),) * 4}, "at most 3 Maxwell branches, got 4"),
]


@pytest.mark.parametrize(("change", "sentence"), IMPOSSIBLE)
def test_impossible_parts_are_refused(change: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        replace(BASE, **change)  # type: ignore[arg-type]


# Model files, and what takes such springs


@pytest.mark.parametrize("name", BRANCHED)
def test_a_saved_spring_is_loaded_as_it_was(name: str, tmp_path: Path) -> None:
    p = BRANCHED[name]
    spring = Spring(p, name)
    spring.save(tmp_path / "model.json")
    content = json.loads((tmp_path / "model.json").read_text(encoding="utf-8"))
    assert content["format_version"] == 4
    jsonschema.Draft202012Validator(model_schema()).validate(content)
    assert Spring.load(tmp_path / "model.json") == spring
    assert p.FE_knots or SpringParameters(**p.as_dict()) == p
    field = "second" if p.second else "branches"
    with pytest.raises(
        ModelError, match=f'"parameters.{field}" is for files from format_version 3 on, and this is one'
    ):
        model_of_text(json.dumps({**content, "format_version": 1}), "model.json")
    # What has no room for them refuses them.
    with pytest.raises(StrandspringError, match=r"`second`|`branches`") as refused:
        spring.responses(PATH)
    assert str(refused.value).count("; ") >= 1  # says what to do
    with pytest.raises(StrandspringError, match=r"cannot take a spring with `(second|branches)`"):
        packed(p)
    with pytest.raises(ValueError, match="must be without a second mechanism and branches"):
        SpringLaw(p)
    slow = "Loops of the model are slow: its Maxwell branches have relaxed."
    assert any(slow in caution for caution in spring.info().cautions) == bool(p.branches)


def test_model_files_of_other_versions_and_bad_fields() -> None:
    for p in (BASE, EXAMPLES["table"]):
        content = json.loads(Spring(p).model.to_json())
        assert not {"second", "branches"} & set(content["parameters"])
        for version in (1, 2, 3, 4):
            by_hand = model_of_text(json.dumps({**content, "format_version": version}), "model.json")
            assert by_hand.to_json() == Spring(p).model.to_json()
    for place, value, sentence in (
        (("branches", 0, "time_constant"), -1.0, r"`branches\[0\].time_constant` must be within \[1e-09, 1e\+09\] s"),
        (("branches", 0, "viscosity"), 1.0, r"parameters.branches\[0\]: 'viscosity' is not a key here"),
        (("second", "n"), 0.0, r"`second.n` must be within \[0.01, 100\], got 0.0"),
        (("second", "kE"), [1.0], "parameters.second: 'kE' is not a key here"),
    ):
        content = json.loads(Spring(BRANCHED["both"]).model.to_json())
        table = content["parameters"]
        for key in place[:-1]:
            table = table[key]
        table[place[-1]] = value
        with pytest.raises(ModelError, match=sentence):
            model_of_text(json.dumps(content), "model.json")


def test_predictions_systems_and_synthesized_records(tmp_path: Path) -> None:
    path, time = 0.01 * np.sin(np.linspace(0.0, 9.0, 200)) + 0.05, np.linspace(0.0, 9.0, 200)
    spring, both = Spring(BRANCHED["branches"]), Spring(BRANCHED["both"])
    record = Record(path, spring.response(path, 0.2, time), time)
    assert spring.predict(record).rmse < 1e-6 * np.ptp(record.force)  # omega_start is found to 1e-6
    with pytest.raises(StrandspringError, match=r"depends on the times of the displacements, and none are given"):
        spring.predict(Record(path, record.force))
    made = both.synthesize(frequency=3.0)
    assert made.force == pytest.approx(both.response(made.displacement, time=made.time), rel=1e-12)
    # The branch of 700 N/m and 30 ms follows 20 mm at 3 Hz, and hardly at 0.01 Hz.
    assert np.abs(both.synthesize(frequency=0.01).force - made.force).max() > 5.0
    text = both.info().summary()
    assert "second mechanism: kappa_omega 9 N, rho 2500 1/m, sigma 0.8, n 1.7, FA degree 2" in text
    assert text.count("Maxwell branch: stiffness") == 3
    assert len(relaxed_branches(both.parameters)[0].split()) <= 25
    # A system of the FMU rests where branches have relaxed.
    values = [Spring(BRANCHED[name], "mount").export(tmp_path / name, ssp_mass=2.0)[0] for name in ("second", "both")]
    plants = [_member(file, "resources/plant.ssv") for file in values]
    assert plants[0] == plants[1]


def _member(archive: Path, name: str) -> str:
    with ZipFile(archive) as opened:
        return opened.read(name).decode()


# A mass: branches that bend the response at its resonance of 15 Hz, where omega*tau is 2 and 50.

BENDING = (MaxwellBranch(4000.0, 0.02), MaxwellBranch(900.0, 0.5))
SPRINGS = {
    "second": replace(BASE, second=SECOND),
    "branches": replace(BASE, branches=BENDING),
    "both": replace(BASE, second=SECOND, branches=BENDING),
}
LEVEL, MASS = 5e-4, 2.0


def mounted(p: SpringParameters, parallel: int = 1, series: int = 1) -> IsolatedMass:
    """A mass that rests at the middle of the range, midway in the hysteresis."""
    load = parallel * float(Spring(replace(p, branches=())).response([0.05])[0])
    return IsolatedMass(p, parallel / series * MASS, load, parallel, series)


def simulated(p: SpringParameters, system: IsolatedMass, omega: float, periods: int) -> complex:
    """Absolute over base motion at Omega [rad/s], from the first harmonic of the last period of a simulation."""
    oracles = [OracleSpring(m.as_dict()) for m in p.mechanisms]
    count = len(oracles)

    def change(t: float, y: np.ndarray) -> Sequence[float]:
        z, v, omegas, elongations = y[0], y[1], y[2 : 2 + count], y[2 + count :]
        x = np.array([0.05 + z])
        force = sum(b.stiffness * s for b, s in zip(p.branches, elongations, strict=True))
        for oracle, m, w in zip(oracles, p.mechanisms, omegas, strict=True):
            force += float(oracle.elastic(x)[0] + m.kappa_omega * oracle.amplifier(x)[0] * w)
        slips = [rate_of_omega(m, v, w) for m, w in zip(p.mechanisms, omegas, strict=True)]
        acceleration = (system.static_load - force) / system.mass + LEVEL * omega**2 * np.cos(omega * t)
        stretch = [v - s / b.time_constant for b, s in zip(p.branches, elongations, strict=True)]
        return [v, acceleration, *slips, *stretch]

    period = 2.0 * np.pi / omega
    times, y0 = period * (periods - 1 + np.arange(200) / 200), np.zeros(2 + count + len(p.branches))
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
        expected = simulated(p, system, 2.0 * np.pi * float(response.columns["frequency"][k]), 16)
        # The balance leaves out harmonics above its last: 1e-3 near a corner of the loop.
        assert response.columns["transmissibility"][k] == pytest.approx(abs(expected), rel=3e-3)
        assert response.columns["phase"][k] == pytest.approx(np.degrees(np.angle(expected)), abs=0.3)


@pytest.mark.parametrize("name", SPRINGS)
def test_derivatives_of_the_balance_are_exact(name: str) -> None:
    system = mounted(SPRINGS[name], parallel=4, series=2)
    rest = static_equilibrium(system)
    balance, omega = mass_balance(system, rest, Excitation.BASE_DISPLACEMENT, 1e-3), 2.0 * np.pi * rest.frequency
    z = linear_motion(balance, np.array([rest.stiffness]), np.zeros(1), omega)
    at, step = balance.at(z, omega), 1e-7
    for k, moved in enumerate(step * np.eye(z.size)):
        column = (balance.at(z + moved, omega).residual - balance.at(z - moved, omega).residual) / (2.0 * step)
        # The differences of hysteretic forces are of second order, of 1e-7 m here.
        assert at.jacobian[:, k] == pytest.approx(column, abs=1e-6 * np.abs(at.jacobian).max())
    ends = [balance.at(z, omega * (1.0 + side * 1e-6)).residual for side in (-1, 1)]
    by_frequency = (ends[1] - ends[0]) / (2e-6 * omega)
    assert at.by_frequency == pytest.approx(by_frequency, abs=1e-8 * np.abs(by_frequency).max())


def test_branches_alone_follow_the_transfer_function() -> None:
    """A spring whose friction is lost beside its branches is linear."""
    p = SpringParameters((0.0, 9000.0), (1.0,), 1e-9, 100.0, 1.0, 1.0, 0.0, -0.05, 0.05, branches=BENDING)
    system = IsolatedMass(p, MASS, load=0.0)
    response = frequency_response(system, Excitation.BASE_DISPLACEMENT, LEVEL, np.geomspace(2.0, 60.0, 30))
    omega = 2.0 * np.pi * response.columns["frequency"]
    turns = [(b.stiffness, 1j * omega * b.time_constant) for b in BENDING]
    dynamic = 9000.0 + sum(stiffness * turn / (1.0 + turn) for stiffness, turn in turns)
    expected = dynamic / (dynamic - MASS * omega**2)
    assert response.columns["transmissibility"] == pytest.approx(np.abs(expected), rel=1e-9)  # friction of 1e-9 N
    peak = response.resonance
    at_peak = 9000.0 + sum(branch.dynamic_stiffness(2.0 * np.pi * peak.frequency) for branch in BENDING)
    assert peak.stiffness == pytest.approx(at_peak.real, rel=1e-8)
    assert peak.loss_factor == pytest.approx(at_peak.imag / at_peak.real, rel=1e-6)
    natural = 2.0 * np.pi * static_equilibrium(system).frequency
    elastic = 9000.0 + sum(branch.dynamic_stiffness(natural).real for branch in BENDING)
    assert natural == pytest.approx(np.sqrt(elastic / MASS), rel=1e-10)  # friction adds 1e-7 N/m


def test_springs_in_rows_scale_all_parts_and_slow_loops_leave_branches_out() -> None:
    one, many = (mounted(SPRINGS["both"], *counts) for counts in ((1, 1), (6, 3)))
    band, ratios = [6.0, 12.0, 15.0, 30.0], []
    for system, level in ((one, LEVEL), (many, 3.0 * LEVEL)):
        columns = frequency_response(system, Excitation.BASE_DISPLACEMENT, level, band).columns
        ratios.append(np.interp(band, columns["frequency"], columns["transmissibility"]))
    assert ratios[0] == pytest.approx(ratios[1], rel=1e-6)  # of Newton's method
    slow = steady_loop(PathSolver(SPRINGS["both"]), 0.04, 0.06).figures
    assert slow == steady_loop(PathSolver(SPRINGS["second"]), 0.04, 0.06).figures
    # Of both mechanisms, after cycles that repeat.
    path = np.tile(np.concatenate([np.linspace(0.04, 0.06, 200), np.linspace(0.06, 0.04, 200)[1:-1]]), 12)
    energy = PathSolver(SPRINGS["second"]).absorbed_energy(path)
    assert slow.energy_per_cycle == pytest.approx(energy[-1] - energy[-1 - 398], rel=1e-9)
    spring = Spring(SPRINGS["both"], "mount")
    assert str(spring.isolate(mass=10.0, base_displacement=2e-4, points=8))
    rows = spring.study(mass=[9.0, 10.0], base_displacement=2e-4, draws=0, stiffness=[1.0, 2.0])
    assert "0 refused" in str(rows).splitlines()[0] or "refused" not in str(rows).splitlines()[0]


# Comparison


def of_class(stiffness: float, seed: int, second: bool = False) -> Spring:
    options = RefinedOptions(degrees=(3, 1), mechanisms=1 + second, branches=1)
    return identify(two_rates(branches=[(stiffness, 0.08)], second=second, seed=seed), options).spring()


def test_a_stiffer_branch_is_a_difference_though_slow_loops_are_alike() -> None:
    lot, of_branch = of_class(1500.0, 1), ["branches[0].stiffness", "branches[0].time_constant"]
    comparison = compare(lot, of_class(1800.0, 20), draws=40)
    assert comparison.verdict is ComparisonVerdict.DIFFERENT
    assert not any(figure.differs for figure in comparison.figures)
    names = [difference.quantity for difference in comparison.parameters]
    assert names == ["kappa_omega", "rho", "sigma", "n", *of_branch]
    stiffer = comparison.parameters[4]
    assert stiffer.change == pytest.approx(0.2, abs=0.04)
    assert stiffer.low < 0.2 < stiffer.high
    assert stiffer.z > 5.0
    assert comparison.test is not None
    assert list(comparison.test.parameters[-2:]) == of_branch
    assert "branches[0].stiffness most clearly" in comparison.sentence
    assert any("branches have relaxed" in caution for caution in comparison.cautions)
    assert "branches[0].time_constant" in comparison.summary()
    assert compare(lot, of_class(1500.0, 40), draws=40).verdict is ComparisonVerdict.NOT_FOUND
    plain = identify(two_rates(seed=9), RefinedOptions(degrees=(3, 1), mechanisms=1, branches=0)).spring()
    comparison = compare(lot, plain, draws=40)  # nothing is judged between classes
    assert comparison.verdict is ComparisonVerdict.UNKNOWN
    assert "A has FE of degree 3 and FA of degree 1, 1 mechanism and 1 Maxwell branch, B FE" in comparison.sentence
    assert "with the same `degrees`, `mechanisms` and `branches`" in comparison.sentence


def test_errors_are_those_of_springs_moved_by_the_covariance() -> None:
    """Of all parameters, kappa_omega of both mechanisms at another place than that of the model."""
    spring = of_class(1500.0, 3, second=True)
    model, p = spring.model, spring.parameters
    joint, place, step = JointCovariance.to_draw_from(p, model.uncertainty), p.displacement_offset + 0.004, 1e-6

    def logarithms(direction: np.ndarray) -> np.ndarray:
        moved = joint.moved(p, direction.tolist())
        both, _ = parameter_differences((moved, p), (moved, p), ({}, {}), (None, None), ("A", "B"), place)
        return np.log([difference.a for difference in both])

    size = len(joint.root)
    rows = np.array([logarithms(step * unit) - logarithms(-step * unit) for unit in np.eye(size)]).T / (2.0 * step)
    stated = (model.uncertainty, model.uncertainty)
    known, _ = parameter_differences((p, p), (p, p), stated, (joint, joint), ("A", "B"), place)
    errors = np.array([0.5 * (np.log1p(one.high) - np.log1p(one.low)) for one in known])
    # Of the difference of two such springs, between 5 and 95 %.
    expected, finite = 1.6448536269514722 * np.sqrt(2.0) * np.linalg.norm(rows, axis=1), np.isfinite(errors)
    assert finite.sum() >= 8
    assert errors[finite] == pytest.approx(expected[finite], rel=1e-5)
