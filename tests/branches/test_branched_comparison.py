"""`compare` with springs that have a second mechanism and branches."""

from __future__ import annotations

import numpy as np
import pytest

from mounts_with_branches import two_rates
from strandspring import RefinedOptions, Spring, compare, identify
from strandspring.api.comparing.comparison_words import ComparisonVerdict
from strandspring.api.comparing.differences import parameter_differences
from strandspring.model.joint import JointCovariance

DRAWS = 40
NAMES = ("kappa_omega", "rho", "sigma", "n")
OF_BRANCH = ("branches[0].stiffness", "branches[0].time_constant")


def of_class(stiffness: float, seed: int, second: bool = False) -> Spring:
    options = RefinedOptions(degrees=(3, 1), mechanisms=1 + second, branches=1)
    return identify(two_rates(branches=[(stiffness, 0.08)], second=second, seed=seed), options).spring()


@pytest.fixture(scope="module")
def lot() -> Spring:
    return of_class(1500.0, 1)


def test_a_stiffer_branch_is_a_difference_though_slow_loops_are_alike(lot: Spring) -> None:
    comparison = compare(lot, of_class(1800.0, 20), draws=DRAWS)
    assert comparison.verdict is ComparisonVerdict.DIFFERENT
    assert not any(figure.differs for figure in comparison.figures)
    assert [difference.quantity for difference in comparison.parameters] == [*NAMES, *OF_BRANCH]
    stiffer = comparison.parameters[4]
    assert stiffer.change == pytest.approx(0.2, abs=0.04)
    assert stiffer.low < 0.2 < stiffer.high
    assert stiffer.z > 5.0
    assert comparison.test is not None
    assert comparison.test.parameters[-2:] == OF_BRANCH
    assert "branches[0].stiffness most clearly" in comparison.sentence
    assert any("branches have relaxed" in caution for caution in comparison.cautions)
    assert "branches[0].time_constant" in comparison.summary()


def test_one_mount_twice_is_no_difference(lot: Spring) -> None:
    assert compare(lot, of_class(1500.0, 40), draws=DRAWS).verdict is ComparisonVerdict.NOT_FOUND


def test_nothing_is_judged_between_classes(lot: Spring) -> None:
    plain = identify(two_rates(seed=9), RefinedOptions(degrees=(3, 1), mechanisms=1, branches=0)).spring()
    comparison = compare(lot, plain, draws=DRAWS)
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
    errors = [0.5 * (np.log1p(one.high) - np.log1p(one.low)) for one in known]
    # Of the difference of two such springs, between 5 and 95 %.
    expected = 1.6448536269514722 * np.sqrt(2.0) * np.linalg.norm(rows, axis=1)
    known_ones = np.isfinite(errors)
    assert known_ones.sum() >= 8
    assert np.array(errors)[known_ones] == pytest.approx(expected[known_ones], rel=1e-5)
