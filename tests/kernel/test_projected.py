"""The projected least-squares problem and points of several records, against NumPy and against each record alone."""

from __future__ import annotations

import numpy as np
import pytest

from strandspring.kernel.points import RecordPoints, omega_with_derivatives
from strandspring.kernel.projected import ProjectedColumns

POINTS = 203


def problem(fixed: int = 4, moving: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Fixed and moving columns, target, omega, and derivatives of omega by two parameters."""
    generator = np.random.default_rng(fixed + 10 * moving)
    place = np.linspace(-1.0, 1.0, POINTS)
    columns = np.polynomial.legendre.legvander(place, max(fixed, moving) - 1)
    omega = np.tanh(3.0 * np.sin(40.0 * place))
    return (
        columns[:, :fixed],
        columns[:, :moving],
        generator.standard_normal(POINTS),
        omega,
        generator.standard_normal((2, POINTS)),
    )


@pytest.mark.parametrize(("fixed", "moving"), [(1, 1), (4, 3), (9, 1), (25, 5)])
def test_least_squares(fixed: int, moving: int) -> None:
    elastic, amplifier, target, omega, derivatives = problem(fixed, moving)
    matrix = np.hstack([elastic, omega[:, None] * amplifier])
    expected, *_ = np.linalg.lstsq(matrix, target, rcond=None)
    found = ProjectedColumns(elastic, amplifier, target).at(omega)
    residuals = target - matrix @ expected
    np.testing.assert_allclose(found.coefficients, expected, rtol=1e-10, atol=1e-11)  # condition below 1e3
    assert found.cost == pytest.approx(0.5 * residuals @ residuals, rel=1e-13)

    steepest = derivatives.T * (amplifier @ expected[fixed:])[:, None]
    jacobian = matrix @ np.linalg.lstsq(matrix, steepest, rcond=None)[0] - steepest
    triangle = found.triangle(derivatives)
    whole = np.column_stack([jacobian, residuals])
    assert np.all(np.tril(triangle, -1) == 0.0)
    np.testing.assert_allclose(triangle.T @ triangle, whole.T @ whole, rtol=1e-10, atol=1e-10)


def test_a_column_that_depends_on_others_gets_no_share() -> None:
    elastic, amplifier, target, omega, derivatives = problem()
    twice = np.column_stack([elastic, elastic[:, 1] - 2.0 * elastic[:, 3]])
    found, lean = (ProjectedColumns(columns, amplifier, target).at(omega) for columns in (twice, elastic))
    assert found.coefficients[4] == 0.0
    np.testing.assert_allclose(np.delete(found.coefficients, 4), lean.coefficients, rtol=1e-10)
    assert found.cost == pytest.approx(lean.cost, rel=1e-13)
    # omega that does not vary makes FA a part of FE.
    flat = ProjectedColumns(elastic, amplifier, target).at(np.ones(POINTS))
    assert np.all(flat.coefficients[4:] == 0.0)
    assert np.isfinite(flat.triangle(derivatives)).all()


def test_a_target_within_the_columns_is_met() -> None:
    elastic, amplifier, _, omega, _ = problem()
    wanted = np.arange(1.0, 8.0)
    target = np.hstack([elastic, omega[:, None] * amplifier]) @ wanted
    found = ProjectedColumns(elastic, amplifier, target).at(omega)
    np.testing.assert_allclose(found.coefficients, wanted, rtol=1e-12)
    assert found.cost < POINTS * (1e-15 * np.abs(target).max()) ** 2  # rounding of each sample


def test_records_are_as_each_alone() -> None:
    direction, length = np.array([1, -1, 1, -1, 1]), np.array([1.0, 1.6, 0.7, 0.9, 2.0])
    stroke = np.repeat(np.arange(5), 7)
    travel = length[stroke] * np.tile(np.linspace(0.1, 1.0, 7), 5)
    first_stroke, first_point, starts = [0, 3, 5], [0, 21, 35], np.array([0.4, -0.7])
    law = (3.0, 1.7, 0.6)
    both = RecordPoints(np.array(first_stroke), np.array(first_point), direction, length, stroke, travel)
    omega, derivatives = both.omega(*law, starts)
    for k in range(2):
        strokes, at = (slice(first[k], first[k + 1]) for first in (first_stroke, first_point))
        own, by = omega_with_derivatives(
            *law, starts[k], direction[strokes], length[strokes], stroke[at] - strokes.start, travel[at]
        )
        np.testing.assert_array_equal(omega[at], own)
        natural = np.array([law[0], law[1], law[2]])[:, None]
        np.testing.assert_allclose(derivatives[:3, at], by[:3] * natural, rtol=1e-15, atol=0.0)
        np.testing.assert_array_equal(derivatives[3 + k, at], by[3])
        assert np.all(derivatives[4 - k, at] == 0.0)
