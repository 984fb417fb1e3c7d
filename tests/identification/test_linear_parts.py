"""The linear parts of an identification: Legendre bases against NumPy's, misfits of the scan against least squares."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import legendre

from strandspring.identification.points.polynomials import Basis
from strandspring.identification.search.scan import _squared_misfits

LOW, HIGH = 0.012, 0.047
X = np.linspace(LOW, HIGH, 61)
Z = (X - 0.5 * (LOW + HIGH)) / (0.5 * (HIGH - LOW))


@pytest.mark.parametrize(("elastic", "amplifier"), [(0, 0), (1, 0), (3, 2), (8, 4), (0, 2)])
def test_columns_and_slopes_are_those_of_legendre_polynomials(elastic: int, amplifier: int) -> None:
    basis = Basis(LOW, HIGH, elastic, amplifier)
    for found, degree in zip(basis.columns(X), (elastic, amplifier), strict=True):
        np.testing.assert_allclose(found, legendre.legvander(Z, degree), rtol=0.0, atol=1e-14)  # rounding
    series = [np.arange(1.0, degree + 2.0) for degree in (elastic, amplifier)]
    for found, own in zip(basis.slopes(X, *series), series, strict=True):
        expected = legendre.legval(Z, legendre.legder(own)) / basis.half
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-9)  # rounding, of 1e5 at most


def test_misfits_of_the_scan_are_those_of_least_squares() -> None:
    generator = np.random.default_rng(0)
    elastic, amplifier = Basis(LOW, HIGH, 3, 2).columns(X)
    omega = generator.uniform(-1.0, 1.0, (5, X.size))
    target = elastic @ [40.0, 900.0, 3.0, -8.0] + generator.standard_normal(X.size)
    misfits = _squared_misfits(elastic, amplifier, np.vstack([omega, np.zeros(X.size)]), target)
    for found, own in zip(misfits, omega, strict=False):
        matrix = np.hstack([elastic, own[:, None] * amplifier])
        left = target - matrix @ np.linalg.lstsq(matrix, target, rcond=None)[0]
        assert found == pytest.approx(left @ left, rel=1e-8)  # of squares 1e6 times as large
    assert np.isinf(misfits[-1])
