"""`compare`: verdicts on springs whose difference is known, and what must not be passed over in silence."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from strandspring import RefinedOptions, Spring, SpringParameters, StrandspringError, compare, identify
from strandspring.api.comparison import ComparisonVerdict, loop_figures
from strandspring.kernel.path import PathSolver
from strandspring.model.joint import HYSTERETIC_UNITS
from strandspring.model.modelfile import ModelFile
from studies import joint_of
from synthetic import AMPLITUDE, MEAN, record_of, sine, spring_of

pytestmark = pytest.mark.long

TRUE = spring_of(1.0, 1.0)
DRAWS = 40  # enough for a standard deviation to 11 %
SIZES = (AMPLITUDE / 2.0, AMPLITUDE)
PATH = sine()


@cache
def identified(kappa_omega: float, seed: int, degrees: tuple[int, int] | None = (3, 2), zero: float = 0.0) -> Spring:
    """The spring with this hysteretic force as a record with 2 % noise shows it."""
    record = record_of(replace(TRUE, kappa_omega=kappa_omega), PATH, 0.02, seed)
    moved = replace(record, displacement=record.displacement - zero)
    return identify(moved, options=RefinedOptions(degrees=degrees)).spring()


def by_hand(p: SpringParameters, deviation: float, root: Any = None) -> Spring:
    """A model whose coefficients err independently by so many of their sizes, or by a root of a covariance."""
    elastic, values = getattr(p, p.elastic_name), {name: getattr(p, name) for name in HYSTERETIC_UNITS}
    if root is None:
        root = np.diag(deviation * np.array([*(abs(c) for c in (*elastic, *p.kA[1:])), 1.0, 1.0, 1.0, 1.0]))
    content = {
        **{name: deviation * value for name, value in values.items()},
        "interval_95": {n: [(1 - 1.96 * deviation) * v, (1 + 1.96 * deviation) * v] for n, v in values.items()},
        "joint": joint_of(p, root),
    }
    return Spring.from_model(ModelFile("hand", p, uncertainty=content))


def test_a_known_difference_is_found_with_its_size() -> None:
    a, b = identified(25.0, 1), identified(22.5, 2)
    comparison = compare(a, b, draws=DRAWS, amplitudes=SIZES)
    assert comparison.verdict is ComparisonVerdict.DIFFERENT
    before, after = (
        loop_figures(replace(TRUE, kappa_omega=kappa), 0.5 * (comparison.low + comparison.high), SIZES)
        for kappa in (25.0, 22.5)
    )
    frame = comparison.to_frame()
    for j, name in enumerate(("secant_stiffness", "energy_per_cycle")):
        for k, amplitude in enumerate(SIZES):
            (row,) = frame[(frame["quantity"] == name) & (frame["amplitude"] == amplitude)].to_dict("records")
            # Four standard deviations: passed in 1 of 16000 cases.
            assert row["change"] == pytest.approx(
                after[k, j] / before[k, j] - 1.0, abs=4 * abs(row["change"] / row["z"])
            )
            assert row["low"] < row["change"] < row["high"]
    assert "energy per cycle at 20 mm is 10 %" in comparison.sentence
    assert "lower in B" in comparison.sentence
    assert compare(b, a, draws=DRAWS).to_frame()["change"].dropna().iloc[0] > 0.0  # kappa_omega grows the other way


def test_degrees_chosen_differently_are_no_difference_of_the_springs() -> None:
    # Without the common form the energy at 5 mm differs by 25 % and z = 5.
    rich, plain = identified(25.0, 1052), identified(25.0, 1053, (3, 1))
    comparison = compare(rich, plain, draws=DRAWS)
    assert comparison.verdict is ComparisonVerdict.NOT_FOUND
    assert "FA of degree 2, B FE of degree 3 and FA of degree 1" in comparison.notes[0]
    assert compare(rich, identified(20.0, 1053, (3, 1)), draws=DRAWS).verdict is ComparisonVerdict.DIFFERENT


def test_the_joint_test_is_the_quadratic_form() -> None:
    generator = np.random.default_rng(5)
    size = len(TRUE.kE) + len(TRUE.kA) - 1 + 4
    roots = [np.tril(generator.normal(size=(size, size))) * 0.01 for _ in range(2)]
    other = replace(TRUE, rho=1.05 * TRUE.rho, n=1.02)
    comparison = compare(by_hand(TRUE, 0.01, roots[0]), by_hand(other, 0.01, roots[1]), draws=20)
    test = comparison.test
    assert test is not None
    covariance = 1.15**2 * sum((root @ root.T)[-4:, -4:] for root in roots)
    change = np.array([0.0, np.log(1.05), 0.0, np.log(1.02)])
    assert test.chi_square == pytest.approx(change @ np.linalg.solve(covariance, change), rel=1e-8)
    # Of chi-square with 4 degrees of freedom: exp(-x/2)*(1 + x/2).
    half = 0.5 * test.chi_square
    assert test.p == pytest.approx(np.exp(-half) * (1.0 + half), rel=1e-9)


def test_parameters_are_judged_together_and_compared_at_one_displacement() -> None:
    """However small its probability, kappa_omega alone neither differs nor is the same."""
    a, b = (by_hand(replace(TRUE, kappa_omega=kappa), 0.001) for kappa in (25.0, 30.0))
    content = compare(a, b, draws=20).as_json()
    told = {row["quantity"]: row["differs"] for row in (*content["parameters"], *content["figures"])}
    assert next(row for row in content["parameters"] if row["quantity"] == "kappa_omega")["p"] < 1e-100
    assert [told[name] for name in ("kappa_omega", "loss_factor", "energy_per_cycle")] == [None, None, True]
    assert content["hysteresis_test"]["differs"]
    moved = 0.005
    kA, kE = (np.polynomial.Polynomial(c)(np.polynomial.Polynomial([moved, 1.0])).coef for c in (TRUE.kA, TRUE.kE))
    other = replace(
        TRUE, kE=tuple(kE), kA=(1.0, *(kA[1:] / kA[0])), kappa_omega=TRUE.kappa_omega * kA[0],
        displacement_offset=MEAN + moved,
    )  # fmt: skip
    assert PathSolver(other).force(PATH) == pytest.approx(PathSolver(TRUE).force(PATH), rel=1e-9, abs=1e-9)
    comparison = compare(by_hand(TRUE, 0.01), by_hand(other, 0.01), draws=DRAWS)
    assert comparison.parameters[0].change == pytest.approx(0.0, abs=1e-12)
    assert comparison.verdict is ComparisonVerdict.NOT_FOUND


def test_a_model_is_the_same_as_itself_and_a_seed_gives_one_result() -> None:
    a, b = identified(25.0, 1), identified(22.5, 2)
    assert compare(a, a, draws=DRAWS).verdict is ComparisonVerdict.IDENTICAL
    first, second, other = (compare(a, b, draws=20, seed=seed).to_frame() for seed in (3, 3, 4))
    assert first.equals(second)
    assert not first.equals(other)


def test_ranges_that_lie_apart_are_refused_or_aligned_and_a_moved_zero_is_suspected() -> None:
    a, b = identified(25.0, 1), identified(25.0, 2, zero=0.1)
    with pytest.raises(StrandspringError, match=r"30 to 70 mm and B from -70 to -30 mm.*`align=\"middle\"`"):
        compare(a, b)
    comparison = compare(a, b, align="middle", draws=DRAWS)
    assert comparison.verdict is ComparisonVerdict.NOT_FOUND
    assert (comparison.low, comparison.high) == pytest.approx((-AMPLITUDE, AMPLITUDE), rel=1e-3)
    comparison = compare(a, identified(25.0, 2, zero=0.004), draws=DRAWS)
    assert comparison.verdict is ComparisonVerdict.DIFFERENT
    (suspected,) = [sentence for sentence in comparison.cautions if "different middles" in sentence]
    assert "-4 mm apart" in suspected
