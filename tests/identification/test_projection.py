"""Springs fitted to points by variable projection, against NumPy's and SciPy's least squares."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from strandspring.identification.least_squares import projection
from strandspring.identification.least_squares.projection import Problem, Refinement, vector
from strandspring.identification.least_squares.stages import Hysteresis
from strandspring.identification.points.polynomials import Basis
from strandspring.identification.points.sample_points import SamplePoints
from strandspring.kernel.arrays import FloatArray

DIRECTION, LENGTH = np.array([1, -1, 1, -1]), np.array([1.0, 1.7, 1.3, 2.0])
PER_STROKE = 60
STROKE = np.repeat(np.arange(4), PER_STROKE)
TRAVEL = LENGTH[STROKE] * np.tile(np.linspace(0.01, 1.0, PER_STROKE), 4)
BEGIN = np.cumsum([0.0, *(DIRECTION * LENGTH)])[:-1]
PLACE = BEGIN[STROKE] + DIRECTION[STROKE] * TRAVEL
START = Hysteresis(3.0, 1.7, 0.6)
ONES = np.ones(STROKE.size)
FEW = [0, 1]  # records up to which omega_start is a variable like the others; beyond it is eliminated


def loops(force: FloatArray, record: tuple[int, ...] = (0, 0, 0, 0)) -> SamplePoints:
    return SamplePoints(
        PLACE, force, ONES, TRAVEL, STROKE, np.arange(float(PLACE.size)), DIRECTION, BEGIN, LENGTH, np.array(record)
    )


def problem(force: FloatArray, fixed: int = 4, moving: int = 3, further: FloatArray | None = None) -> Problem:
    return Problem(loops(force), Basis(PLACE.min(), PLACE.max(), fixed - 1, moving - 1), START, further)


def linear(given: Problem, root: FloatArray = ONES) -> Refinement:
    """The linear problem alone: one evaluation, at the start."""
    fit = given.solve(START, np.array([0.4]), root**2, 1e-5, 1)
    assert fit.hysteresis.rho == pytest.approx(START.rho, rel=1e-15)
    assert not fit.converged
    return fit


def coefficients(fit: Refinement) -> FloatArray:
    return np.concatenate([fit.backbone.elastic, fit.backbone.amplified])


@pytest.mark.parametrize(("fixed", "moving"), [(1, 1), (4, 3), (9, 1), (20, 5)])
def test_coefficients(fixed: int, moving: int) -> None:
    generator = np.random.default_rng(fixed + 10 * moving)
    force, root = generator.standard_normal(ONES.size), generator.uniform(0.5, 2.0, ONES.size)
    given = problem(force, fixed, moving)
    fit = linear(given, root)
    matrix = np.hstack([given.columns.elastic, fit.omega[:, None] * given.columns.amplifier])
    expected, *_ = np.linalg.lstsq(matrix * root[:, None], force * root, rcond=None)
    np.testing.assert_allclose(coefficients(fit), expected, rtol=1e-9, atol=1e-10)  # condition below 1e4


def test_a_column_that_depends_on_others_gets_no_share() -> None:
    force = np.random.default_rng(3).standard_normal(ONES.size)
    elastic = problem(force).columns.elastic
    twice, lean = linear(problem(force, further=(elastic[:, 1] - 2.0 * elastic[:, 3])[:, None])), linear(problem(force))
    assert twice.backbone.elastic[4] == 0.0
    np.testing.assert_allclose(np.delete(coefficients(twice), 4), coefficients(lean), rtol=1e-10)
    # FA is a part of what never changes.
    alike = linear(problem(force, moving=1, further=lean.omega[:, None]))
    np.testing.assert_array_equal(alike.backbone.amplified, 0.0)
    assert alike.backbone.elastic[4] != 0.0


def test_a_force_within_the_columns_is_met() -> None:
    given = problem(ONES)
    wanted = np.arange(1.0, 8.0)
    matrix = np.hstack([given.columns.elastic, linear(given).omega[:, None] * given.columns.amplifier])
    np.testing.assert_allclose(coefficients(linear(problem(matrix @ wanted))), wanted, rtol=1e-12)


@pytest.mark.parametrize("few", FEW)
def test_minimum_against_scipy(few: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(projection, "_FEW", few)
    generator = np.random.default_rng(11)
    true, root = vector(Hysteresis(4.0, 2.0, 1.5), np.array([-0.2])), generator.uniform(0.5, 2.0, ONES.size)
    columns = problem(ONES).columns
    omega, _ = problem(ONES).omega(true)
    force = columns.elastic @ [1.0, 2.0, 0.3, 0.2] + omega * (columns.amplifier @ [1.0, 0.1, 0.2])
    given = problem(force + 0.02 * generator.standard_normal(ONES.size))

    def left(theta: FloatArray) -> FloatArray:
        matrix = np.hstack([columns.elastic, given.omega(theta)[0][:, None] * columns.amplifier]) * root[:, None]
        target = given.loops.force * root
        return matrix @ np.linalg.lstsq(matrix, target, rcond=None)[0] - target

    fit = given.solve(START, np.array([0.4]), root**2, 1e-12)
    assert fit.converged
    start = vector(START, np.array([0.4]))
    expected = least_squares(left, start, bounds=(given.low, given.high), xtol=1e-12, ftol=1e-15, gtol=1e-12)
    theta = vector(fit.hysteresis, fit.omega_start)
    assert np.sum(left(theta) ** 2) == pytest.approx(2.0 * expected.cost, rel=1e-9)
    np.testing.assert_allclose(theta, expected.x, rtol=0.0, atol=1e-4)  # its differences are not exact
    np.testing.assert_allclose(fit.omega, given.omega(theta)[0], rtol=0.0, atol=1e-12)


def test_records_have_their_omega_start_whether_few_or_many(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two records that begin at different omega, which are variables like the others or eliminated."""
    columns, true = problem(ONES).columns, vector(Hysteresis(4.0, 2.0, 1.5), np.array([-0.5, 0.6]))
    basis, record = Basis(PLACE.min(), PLACE.max(), 3, 2), (0, 0, 1, 1)
    omega, _ = Problem(loops(ONES, record), basis, START).omega(true)
    force = columns.elastic @ [1.0, 2.0, 0.3, 0.2] + omega * (columns.amplifier @ [1.0, 0.1, 0.2])
    force += 0.003 * np.random.default_rng(12).standard_normal(ONES.size)
    fits = []
    for few in (0, 2):
        monkeypatch.setattr(projection, "_FEW", few)
        fits.append(Problem(loops(force, record), basis, START).solve(START, np.zeros(2), ONES, 1e-13))
    eliminated, shared = fits
    assert eliminated.converged
    assert shared.converged
    # The sum of squares is level at its least: its last digits tell a parameter to their root.
    np.testing.assert_allclose(
        vector(shared.hysteresis, shared.omega_start),
        vector(eliminated.hysteresis, eliminated.omega_start),
        rtol=0.0,
        atol=1e-5,
    )
    np.testing.assert_allclose(shared.omega_start, [-0.5, 0.6], rtol=0.0, atol=0.05)


@settings(deadline=None, max_examples=200)
@given(
    st.tuples(*(st.floats(0.0, 1.0) for _ in range(4))),
    st.integers(0, 2**32 - 1),
    st.sampled_from([0.0, 0.01, 1.0, 100.0]),
    st.integers(1, 40),
    st.booleans(),
    st.sampled_from(FEW),
)
def test_from_any_start_the_fit_ends_within_the_bounds_and_no_worse(
    share: tuple[float, ...], seed: int, noise: float, evaluations: int, coarse: bool, few: int
) -> None:
    generator = np.random.default_rng(seed)
    columns = problem(ONES).columns
    drawn = Problem(loops(ONES), Basis(PLACE.min(), PLACE.max(), 3, 2), START)
    omega, _ = drawn.omega(generator.uniform(drawn.low, drawn.high))
    force = columns.elastic @ [1.0, 2.0, 0.3, 0.2] + omega * (columns.amplifier @ [1.0, 0.1, 0.2])
    force += noise * generator.standard_normal(ONES.size)
    given = Problem(loops(force), Basis(PLACE.min(), PLACE.max(), 3, 2), START, coarse=coarse)
    start = given.low + (given.high - given.low) * np.array(share)
    law, omega_start = Hysteresis(*np.exp(start[:3]).tolist()), start[3:]

    def square(fit: Refinement) -> float:
        return float(np.sum(fit.backbone.misfit(force, fit.omega) ** 2))

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(projection, "_FEW", few)
        fit = given.solve(law, omega_start, ONES, 1e-9, evaluations)
    theta = vector(fit.hysteresis, fit.omega_start)
    rounding = 1e-14 * np.maximum(np.abs(given.low), np.abs(given.high))
    assert np.all((theta >= given.low - rounding) & (theta <= given.high + rounding))
    # omega that is nearly level makes coefficients of FA huge, which roundings then count for.
    before = square(given.solve(law, omega_start, ONES, 1e-9, 1))
    assert square(fit) <= before * (1.0 + 1e-9) + 1e-20 * float(force @ force) or np.abs(coefficients(fit)).max() > 1e6
