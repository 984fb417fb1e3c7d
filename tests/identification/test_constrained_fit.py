"""What the fit may not break, whatever the record: against SciPy's least squares, differences and drawn springs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.polynomial.polynomial import polyval

from mounts_with_branches import two_rates
from strandspring import Record
from strandspring.identification.bases import AMPLIFIER, ELASTIC, Shape, amplifier_columns, b_splines, elastic_columns
from strandspring.identification.bases import inner_knots as knots_of
from strandspring.identification.constrained import nonnegative
from strandspring.identification.fit import Problem, SpringClass
from strandspring.identification.samples import Samples
from strandspring.identification.spring import spring_of
from synthetic import drawn_own_record

Y = np.linspace(-1.0, 1.0, 201)
SEEDS = st.integers(0, 2**32 - 1)


@settings(max_examples=50)
@given(SEEDS, st.integers(1, 9), st.integers(0, 3))
def test_nonnegative_least_squares_is_scipys(seed: int, columns: int, free: int) -> None:
    draw = np.random.default_rng(seed)
    A, b = draw.standard_normal((12, columns)), draw.standard_normal(12)
    is_free = np.arange(columns) < free
    c, inside = nonnegative(A.T @ A, A.T @ b, is_free)
    from scipy.optimize import lsq_linear

    expected = lsq_linear(A, b, (np.where(is_free, -np.inf, 0.0), np.inf), method="bvls", tol=1e-14)
    assert np.sum((A @ c - b) ** 2) == pytest.approx(2.0 * expected.cost, rel=1e-9)
    np.testing.assert_allclose(c, expected.x, atol=1e-6)  # the squared condition of normal equations
    assert (c[~is_free] >= 0.0).all()
    assert (c[~inside] == 0.0).all()


@pytest.mark.parametrize("number", [0, 1, 5])
@pytest.mark.parametrize("degree", [1, 3, 8])
def test_columns_are_scipys_splines_and_a_spring_has_the_fe_and_fa_of_its_fit(degree: int, number: int) -> None:
    from scipy.interpolate import BSpline, CubicSpline

    knots, draw = np.linspace(-1.0, 1.0, number + 2)[1:-1], np.random.default_rng(degree)
    t = np.r_[[-1.0] * (degree + 1), knots, [1.0] * (degree + 1)]
    expected = BSpline.design_matrix(Y, t, degree).toarray()
    np.testing.assert_allclose(b_splines(Y, degree, knots), expected, atol=1e-13)
    # Increments of the coefficients; beyond the range the tangent at its end, and FA's value there.
    spline = BSpline(t, np.eye(degree + number + 1), degree)
    ends = [spline(end) + (y - end) * spline(end, 1) for end, y in ((-1.0, -1.3), (1.0, 1.2))]
    steps = np.cumsum(np.vstack([ends[0], expected, ends[1]])[:, ::-1], axis=1)[:, ::-1]
    wide = np.r_[-1.3, Y, 1.2]
    np.testing.assert_allclose(elastic_columns(wide, degree, knots), steps, atol=1e-11)
    np.testing.assert_allclose(amplifier_columns(wide, degree)[[0, -1]], np.eye(degree + 1)[[0, -1]], atol=1e-14)
    inner = knots_of(number, Y)
    if (degree, inner.size) in ELASTIC:
        shape = Shape(0.02, 0.09, degree, inner, draw.standard_normal(degree + inner.size + 1))
        saved, x = shape.elastic_parameters(), 0.055 + 0.035 * Y
        FE = CubicSpline(saved["FE_knots"], saved["FE_forces"])(x) if inner.size else polyval(x - 0.055, saved["kE"])
        np.testing.assert_allclose(FE, elastic_columns(Y, degree, inner) @ shape.elastic, atol=1e-9)
        coefficients = draw.uniform(0.1, 1.0, degree + 1)
        FA = shape.amplifier_parameters(coefficients)
        found = FA["kappa_omega"] * polyval(x - 0.055, FA["kA"])
        np.testing.assert_allclose(found, amplifier_columns(Y, degree) @ coefficients, atol=1e-9)


def test_the_linear_problem_is_the_least_in_its_bounds_and_its_derivatives_those_of_differences() -> None:
    """Two rates with a branch, a second mechanism, zeros and a drift, at q where some coefficients are at 0."""
    records = two_rates(branches=[(1500.0, 0.08)], second=True)
    shifted = [Record(r.displacement, r.force + 3.0 * k, r.time) for k, r in enumerate(records)]
    c, q = SpringClass((3, 3), (2, 1), 1, zeros=True, drift=True), np.log([6.0, 0.6, 0.8, 70.0, 0.4, 2.0, 0.06])
    problem = Problem(Samples.of(shifted, 900))
    solved = problem.linear(c, q)
    # No coefficient that may move gains by it, within the small penalty of the fit.
    gradient = solved.columns.T @ solved.residuals / len(solved.residuals)
    nuisances = solved.coefficients.size - 2  # zeros of one record, and the drift
    bounded = np.ones(gradient.size, bool)
    bounded[nuisances:] = bounded[: solved.terms] = False  # FE is bounded above, too
    free = solved.inside & (np.arange(gradient.size) >= solved.terms)
    assert np.abs(gradient[free]).max() < 1e-4
    assert gradient[bounded & ~solved.inside].min(initial=0.0) > -1e-9
    assert solved.coefficients[bounded].min() >= 0.0
    misfit = np.sqrt(np.mean(solved.residuals**2))
    for k, own in enumerate(problem.derivatives(c, q, solved).T):
        step = 1e-5 * np.eye(q.size)[k]
        difference = (problem.linear(c, q + step).residuals - problem.linear(c, q - step).residuals) / 2e-5
        # Kaufman's derivatives leave out what is as small as the residuals, which here are not.
        assert np.linalg.norm(difference - own) < 1e-5 * np.linalg.norm(own) + 3.0 * misfit * np.sqrt(own.size)
        # Along the residuals, which is what the gradient is made of, they are exact but for the penalty.
        assert solved.residuals @ own == pytest.approx(solved.residuals @ difference, rel=0.02, abs=1e-3)


@settings(max_examples=30)
@given(
    SEEDS, st.sampled_from(ELASTIC), st.lists(st.sampled_from(AMPLIFIER), min_size=1, max_size=2), st.integers(0, 2),
    st.booleans(),
)  # fmt: skip
def test_whatever_is_fitted_is_a_spring(
    seed: int, elastic: tuple[int, int], amplifiers: list[int], branches: int, may_fall: bool
) -> None:
    """Any class at any q, to a drawn record or to noise: the constraints hold in the saved spring."""
    from scipy.interpolate import CubicSpline

    draw, record = np.random.default_rng(seed), drawn_own_record(seed % 50)
    if draw.random() < 0.3:
        record = Record(record.displacement, draw.standard_normal(len(record)), record.time)
    problem, c = Problem(Samples.of([record], 400)), SpringClass(elastic, tuple(amplifiers), branches, may_fall)
    low, high = problem.bounds(c)
    fit = problem.local(c, draw.uniform(low, high), 3)
    assert ((low <= fit.q) & (fit.q <= high)).all()
    spring = spring_of(problem, fit)
    assert all(m.sigma >= 0.5 and m.kappa_omega > 0.0 for m in spring.mechanisms)
    assert all(branch.stiffness > 0.0 for branch in spring.branches)
    x = np.linspace(spring.displacement_min, spring.displacement_max, 2001)
    offset, span = x - spring.displacement_offset, np.ptp(record.force)
    assert min(polyval(offset, mechanism.kA).min() for mechanism in spring.mechanisms) > 0.0
    FE = CubicSpline(spring.FE_knots, spring.FE_forces)(x) if spring.FE_knots else polyval(offset, spring.kE)
    # 5 % of the span at either end, and what rounding and the weight of the upper end leave.
    assert record.force.min() - 0.06 * span < FE.min() <= FE.max() < record.force.max() + 0.06 * span
    assert may_fall or np.max(np.maximum.accumulate(FE) - FE) < 0.021 * span
