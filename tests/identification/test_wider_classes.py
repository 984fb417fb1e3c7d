"""A second mechanism and Maxwell branches are chosen where records show them, and nowhere else."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mounts_with_branches import FIRST, SECOND, maxwell, record, sines, two_rates
from strandspring import Identification, Outcome, Record, RefinedOptions, Spring, identify, read_record
from strandspring.errors import RecordError
from strandspring.identification.classes.problem import is_positive_series, non_negative, positive_rays
from strandspring.kernel.branches import maxwell_columns
from strandspring.model.joint import JointCovariance
from zoo_rig import draw_case

DATA = Path(__file__).parents[1] / "data"
BRANCH = (1500.0, 0.08)  # N/m, s: about a tenth of the force


def kind(found: Identification) -> tuple[int, int]:
    p = found.parameters
    return 1 + (p.second is not None), len(p.branches)


@pytest.fixture(scope="module")
def with_branch() -> Identification:
    return identify(two_rates(branches=[BRANCH]))


@pytest.fixture(scope="module")
def with_both() -> Identification:
    return identify(two_rates(branches=[BRANCH], second=True, seed=7))


def test_a_branch_is_found_with_its_size(with_branch: Identification) -> None:
    assert kind(with_branch) == (1, 1)
    (branch,) = with_branch.parameters.branches
    # Noise of 0.1 N on 12 cycles of a branch of some 10 N.
    assert branch.stiffness == pytest.approx(BRANCH[0], rel=0.02)
    assert branch.time_constant == pytest.approx(BRANCH[1], rel=0.02)
    p = with_branch.parameters
    assert p.kappa_omega == pytest.approx(FIRST.kappa_omega, rel=0.05)
    assert (p.rho, p.sigma, p.n) == pytest.approx((FIRST.rho, FIRST.sigma, FIRST.n), rel=0.1)


def test_it_is_no_effect_of_the_rig_as_well(with_branch: Identification) -> None:
    assert not {"viscosity", "delay", "curved_drift"} & set(with_branch.effects)
    assert Outcome.RATE_DEPENDENT not in with_branch.outcomes
    assert Outcome.RIG_OR_MOUNT not in with_branch.outcomes
    assert "strokes took 0.2 to 1 s" in with_branch.findings[Outcome.RATES]


def test_a_mount_without_friction_is_an_elastic_one_with_a_branch() -> None:
    """Whatever friction is left in the noise, and none without it; figures of the loops count the branch's height."""
    stiffness, time_constant = 2e4, 0.05
    for noise in (0.0, 0.02):
        found = identify([viscoelastic(rate, size, noise) for rate in (0.1, 1.0, 10.0) for size in (1e-3, 2e-3, 4e-3)])
        assert kind(found) == (1, 1)
        (branch,) = found.parameters.branches
        # Straight lines between 400 samples a cycle.
        assert (branch.stiffness, branch.time_constant) == pytest.approx((stiffness, time_constant), rel=1e-3)
        assert found.parameters.kappa_omega < 0.01
        assert found.lack_of_fit is not None
        # The loops are some 80 N high.
        assert 0.0 <= found.lack_of_fit.of_height < 1e-3
        assert abs(found.lack_of_fit.energy) < 1e-3


def viscoelastic(rate: float, size: float, noise: float) -> Record:
    """A cubic spring of 1e4 N/m with a branch of 2e4 N/m and 0.05 s."""
    time = np.linspace(0.0, 4.0 / rate, 1600)
    path = size * np.sin(2.0 * np.pi * rate * time)
    elastic = 1e4 * path + 1e9 * path**3 + noise * np.random.default_rng(1).standard_normal(time.size)
    return Record(path, elastic + maxwell(time, path, 2e4, 0.05), time)


def test_intervals_of_what_was_added_hold_the_truth(with_branch: Identification) -> None:
    further = with_branch.uncertainty["further"]
    for name, true in (("branches[0].stiffness", BRANCH[0]), ("branches[0].time_constant", BRANCH[1])):
        low, high = further[name]["interval_95"]
        # 95 % intervals of one record, widened by half: a miss by chance is then rarer than one in 300.
        assert low - 0.25 * (high - low) <= true <= high + 0.25 * (high - low)
        assert high - low < 0.2 * true


def test_the_saved_spring_gives_the_figures_that_are_printed(with_branch: Identification, tmp_path: Path) -> None:
    with_branch.spring().save(tmp_path / "model.json")
    spring = Spring.load(tmp_path / "model.json")
    for fit, recorded in zip(with_branch.fits, with_branch.records, strict=True):
        force = spring.response(recorded.displacement, fit.omega_start, recorded.time)
        error = (force - recorded.force)[fit.first_sample :]
        assert float(np.sqrt(np.mean(error**2))) == pytest.approx(fit.rmse, rel=1e-9)  # the same sums
        assert fit.rmse < 0.13  # noise of 0.1 N, and what 15 coefficients leave


def test_its_joint_covariance_moves_all_coefficients(with_both: Identification) -> None:
    joint = JointCovariance.from_uncertainty(with_both.parameters, with_both.uncertainty)
    assert joint is not None
    p = with_both.parameters
    assert joint.moved(p, [0.0] * len(joint.root)) == p
    draws = [joint.draw(p, 0, k) for k in range(40)]
    for error, values in (
        (with_both.uncertainty["further"]["branches[0].stiffness"], [d.branches[0].stiffness for d in draws]),
        (with_both.uncertainty["further"]["second.kappa_omega"], [d.second.kappa_omega for d in draws if d.second]),
    ):
        # A standard deviation of 40 draws is known to 11 %; of a logarithm's, here below 0.2, to as much again.
        assert float(np.std(values)) == pytest.approx(error["standard_error"], rel=0.5)


def test_text_and_report_give_their_errors(with_both: Identification, tmp_path: Path) -> None:
    text = with_both.summary()
    assert re.search(r"second mechanism: kappa_omega [\d.]+ \+- [\d.]+ N, rho \d+ \+- \d+ 1/m", text)
    assert re.search(r"Maxwell branch: stiffness [\d.]+ \+- [\d.]+ N/m, time constant 0\.\d+ \+- 0\.\d+ s", text)
    with_both.report(tmp_path / "report.html")
    cells = re.findall(r"<t[dh][^>]*>([^<]*)</t[dh]>", (tmp_path / "report.html").read_text("utf-8"))
    for name in ("second.rho", "branches[0].stiffness", "branches[0].time_constant"):
        assert " to " in cells[cells.index(name) + 5], name
    assert cells[cells.index("second.kA[0]") + 5] == "–"  # 1 by definition


def test_both_are_found(with_both: Identification) -> None:
    assert kind(with_both) == (2, 1)
    p = with_both.parameters
    assert p.second is not None
    rates = sorted([p.rho, p.second.rho])
    assert rates[0] < 1000.0 < rates[1]  # 400 and 3000
    assert p.branches[0].stiffness == pytest.approx(BRANCH[0], rel=0.05)
    assert with_both.wider is not None
    assert "(chosen)" in with_both.wider.sentence
    assert Outcome.OTHER_MOUNT not in with_both.outcomes


def test_a_second_mechanism_needs_no_times() -> None:
    records = [replace(each, time=None) for each in two_rates(second=True, seed=3)]
    found = identify(records)
    assert kind(found) == (2, 0)
    second = found.parameters.second
    assert second is not None
    forces = sorted([found.parameters.kappa_omega, second.kappa_omega])
    assert forces == pytest.approx([SECOND.kappa_omega, FIRST.kappa_omega], rel=0.15)


def test_loading_is_not_foretold_from_unloading_alone() -> None:
    # This actuator is loaded faster than unloaded: groups of strokes of one duration would have one direction each.
    wider = identify(read_record(DATA / "actuator/circle_3bar.csv", displacement=5, force=7)).wider
    assert wider is not None
    assert all(each["held_out_rmse"] < 1.5 * each["rmse"] for each in wider.as_json())


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_chosen_that_is_not_there(seed: int) -> None:
    found = identify(two_rates(seed=10 * seed, noise=0.02 * 5**seed))
    assert kind(found) == (1, 0)
    assert not {Outcome.RATES, Outcome.RATE_OPEN} & set(found.outcomes)


def test_one_amplitude_and_rate_do_not_tell_a_branch_from_friction() -> None:
    found = identify(record(*sines((0.02,), 0.5, cycles=8), branches=[(3000.0, 0.25)]))
    assert kind(found) == (1, 0)
    assert "with one Maxwell branch the error" in found.findings[Outcome.RATE_OPEN]
    forced = identify(found.records, RefinedOptions(mechanisms=1, branches=1)).parameters.branches[0]
    assert (forced.stiffness, forced.time_constant) == pytest.approx((3000.0, 0.25), rel=0.02)


@pytest.mark.parametrize("index", [0, 1])
def test_a_branch_is_open_where_what_was_left_out_does_not_favour_it(index: int) -> None:
    # Of one amplitude, and of several: all was recorded at one rate, what is left out as well.
    found = identify(draw_case("maxwell rubber", 7, index).records)
    assert not found.parameters.branches
    assert "one Maxwell branch the misfit would be" in found.findings[Outcome.RATE_OPEN]


def test_several_amplitudes_at_one_rate_leave_a_branch_open_beside_friction() -> None:
    wave = 1.0 - np.abs(4.0 * ((np.arange(3 * 300) / 300.0 + 0.25) % 1.0) - 2.0)
    path = 0.02 * np.concatenate([share * wave for share in (0.3, 0.6, 1.0)])
    found = identify(record(np.arange(path.size) / 50.0, path, branches=[(2e4, 0.03)]))
    assert kind(found) == (2, 0)
    assert "with one Maxwell branch the error" in found.findings[Outcome.RATE_OPEN]


def test_a_branch_is_asked_for_without_times() -> None:
    bare = replace(record(*sines((0.02,), 0.5)), time=None)
    with pytest.raises(RecordError, match=r"Maxwell branches .* need records of several cycles with rising times"):
        identify(bare, RefinedOptions(branches=1))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"branches": 4}, r"`branches` must be within \[0, 3\], got 4"),
        ({"mechanisms": 0}, r"`mechanisms` must be within \[1, 2\], got 0"),
        ({"branches": 1, "bootstrap": 10}, "give one or the other"),
    ],
)
def test_impossible_options_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        RefinedOptions(**options)


def test_two_branches_can_be_asked_for() -> None:
    mounts = two_rates(branches=[(1500.0, 0.3), (1500.0, 0.02)], noise=0.02)
    found = identify(mounts, RefinedOptions(mechanisms=1, branches=2))
    assert kind(found) == (1, 2)
    assert sorted(b.time_constant for b in found.parameters.branches) == pytest.approx([0.02, 0.3], rel=0.15)


def test_none_can_be_asked_for() -> None:
    found = identify(two_rates(branches=[BRANCH]), RefinedOptions(mechanisms=1, branches=0))
    assert kind(found) == (1, 0)


def test_columns_of_a_branch_are_its_force() -> None:
    """Against the exact steps of the helper, and the derivative against differences of them."""
    time, path = sines((0.01, 0.02), 0.7)
    (deflection,), (by_time,) = maxwell_columns([0.11], path, time)
    assert deflection == pytest.approx(maxwell(time, path, 1.0, 0.11), abs=1e-12 * 0.02 + 1e-15)
    step = 1e-4
    ends = [maxwell(time, path, 1.0, 0.11 * np.exp(side * step)) for side in (1.0, -1.0)]
    # Of a difference with a step of 1e-4 the error is 1e-8 of the third derivative.
    assert by_time == pytest.approx((ends[0] - ends[1]) / (2.0 * step), abs=1e-6 * 0.02)


def test_non_negative_least_squares_meets_its_conditions() -> None:
    """Karush, Kuhn and Tucker: no gradient where a coefficient is free, none that would gain where it is zero."""
    generator = np.random.default_rng(0)
    for _ in range(50):
        matrix, target = generator.standard_normal((12, 7)), generator.standard_normal(12)
        x = non_negative(matrix, target)
        gradient = matrix.T @ (target - matrix @ x)
        assert (x >= 0.0).all()
        assert np.abs(gradient[x > 0.0]).max(initial=0.0) < 1e-9  # rounding
        assert gradient.max() < 1e-9


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4])
def test_sums_of_rays_are_positive_and_many_enough(degree: int) -> None:
    rays = positive_rays(degree)
    assert rays.shape[0] == degree + 1 == np.linalg.matrix_rank(rays)
    generator = np.random.default_rng(degree)
    for _ in range(30):
        assert is_positive_series(rays @ generator.random(rays.shape[1]))


def test_a_record_given_twice_as_fast_is_the_same_spring_with_half_the_time() -> None:
    """The unit of time is free: time constants scale with it, all else stays."""
    mounts = two_rates(branches=[BRANCH], seed=4)
    faster = [Record(r.displacement, r.force, time=0.5 * r.time, path=r.path) for r in mounts if r.time is not None]
    one, other = identify(mounts).parameters, identify(faster).parameters
    assert other.branches[0].time_constant == pytest.approx(0.5 * one.branches[0].time_constant, rel=1e-6)
    assert other.branches[0].stiffness == pytest.approx(one.branches[0].stiffness, rel=1e-6)
