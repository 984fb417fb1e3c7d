"""FE by its forces at knots, fitted with the hysteresis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from strandspring import Record, Spring, SpringParameters
from strandspring.identification.certainty.uncertainty import uncertainty
from strandspring.identification.least_squares.linearised import Linearised
from strandspring.identification.least_squares.projection import Refinement
from strandspring.identification.least_squares.refinement import Samples, refine
from strandspring.identification.least_squares.stages import Hysteresis
from strandspring.identification.points.noise import force_noise
from strandspring.identification.points.polynomials import Basis
from strandspring.identification.points.sample_points import SamplePoints
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.identification.points.table import TableBasis
from strandspring.identification.search.solution import is_positive, spring_of
from strandspring.kernel.path import PathSolver
from synthetic import AMPLITUDE, MEAN, record_of, sine
from synthetic import spring_of as known_spring

LOW, HIGH = MEAN - AMPLITUDE, MEAN + AMPLITUDE


def tabulated(intervals: int, kink: float) -> SpringParameters:
    """A spring whose stiffness changes sixfold at a share of the range."""
    knots = np.linspace(LOW, HIGH, intervals + 1)
    forces = 3000.0 * (knots - MEAN) + 15_000.0 * np.maximum(knots - LOW - kink * (HIGH - LOW), 0.0)
    return replace(known_spring(0.6, 1.5), kE=(), FE_knots=tuple(knots.tolist()), FE_forces=tuple(forces.tolist()))


def fitted(record: Record, basis: Basis, start: Hysteresis) -> tuple[SamplePoints, Refinement]:
    part = find_steady_part(record)
    samples = Samples(part.loops_with(500), (force_noise(part.record.force),))
    return samples.loops, refine(samples, basis, start)


@pytest.mark.parametrize("intervals", [6, 12, 24])
def test_a_table_is_recovered_from_its_own_record(intervals: int) -> None:
    true = tabulated(intervals, 0.7)
    # Shrinking cycles, or FE and FA would be seen at one amplitude only.
    displacement = MEAN + (sine(8, 4000) - MEAN) * np.linspace(1.0, 0.3, 4000)
    displacement[:250] = np.linspace(LOW, HIGH, 250)  # from end to end once
    record = record_of(true, displacement)
    basis = TableBasis(*(float(end) for end in (record.displacement.min(), record.displacement.max())), intervals, 2)
    start = Hysteresis(1.3 * true.rho, 1.2, 0.8)
    _, refinement = fitted(record, basis, start)
    found = spring_of(basis, refinement.backbone, refinement.hysteresis, "record")
    assert is_positive(basis, refinement.backbone)
    assert found.FE_knots == pytest.approx(true.FE_knots, abs=1e-15)
    assert found.FE_forces == pytest.approx(true.FE_forces, abs=1e-6 * np.ptp(true.FE_forces))
    assert (found.rho, found.sigma, found.n) == pytest.approx((true.rho, true.sigma, true.n), rel=1e-5)
    force = Spring(found).response(displacement, float(refinement.omega_start[0]))
    assert np.max(np.abs(force - record.force)) <= 1e-6 * np.ptp(record.force)


def test_a_kink_that_no_polynomial_follows() -> None:
    """Between the knots of the table; the spring that gave the record has far more of them."""
    true = tabulated(24, 0.61)
    record = record_of(true, sine(4, 3000), noise=0.002, seed=7)
    start = Hysteresis(true.rho, true.sigma, true.n)
    low, high = float(record.displacement.min()), float(record.displacement.max())
    misfits = {}
    for name, basis in (("degree 4", Basis(low, high, 4, 2)), ("12 intervals", TableBasis(low, high, 12, 2))):
        loops, refinement = fitted(record, basis, start)
        misfits[name] = loops.rms(refinement.backbone.misfit(loops.force, refinement.omega))
    assert misfits["12 intervals"] < 0.25 * misfits["degree 4"], misfits


def test_columns_are_the_spring_of_each_force() -> None:
    basis = TableBasis(LOW, HIGH, 9, 3)
    displacement = np.linspace(LOW, HIGH, 200)
    polynomial = Basis(LOW, HIGH, 4, 3).columns(displacement).amplifier
    columns = basis.columns(displacement)
    np.testing.assert_array_equal(columns.amplifier, polynomial)
    for k, unit in enumerate(np.eye(10)):
        spring = replace(known_spring(0.6, 1.5), **basis.elastic_parameters(unit))
        force, slope, _ = PathSolver(spring).force_with_partials(displacement, np.zeros(200))
        assert columns.elastic[:, k] == pytest.approx(force, abs=1e-13)
        found, _ = basis.slopes(displacement, unit, np.ones(4))
        assert found == pytest.approx(slope, abs=1e-12 * np.max(np.abs(slope)))


def test_standard_errors_of_the_forces_are_those_of_repeated_records() -> None:
    true = tabulated(8, 0.7)
    basis, start = TableBasis(LOW, HIGH, 8, 2), Hysteresis(true.rho, true.sigma, true.n)
    force = Spring(true).response(sine(4, 3001))
    random = np.random.default_rng(5)
    found, errors = [], []
    for _ in range(40):
        noisy = Record(sine(4, 3001), force + 0.2 * random.standard_normal(force.size), path="noisy.csv")
        loops, refinement = fitted(noisy, basis, start)
        found.append(refinement.backbone.elastic)
        errors.append(uncertainty(Linearised.from_refinement(loops, basis, refinement))["FE_forces"])
    # A standard deviation of 40 values is known to 11 %, and these are nine.
    ratio = np.std(found, axis=0, ddof=1) / np.mean(errors, axis=0)
    assert np.all((ratio > 0.7) & (ratio < 1.3)), ratio
