"""The refined method: exact recovery, the statistical limit, honest errors; and the derivatives it rests on."""

from __future__ import annotations

import numpy as np
import pytest

from strandspring import Outcome, Record, RefinedOptions, Spring, TwoStageOptions, identify
from strandspring.identification.figures import rmse
from strandspring.identification.noise import force_noise
from strandspring.model.path import tables
from strandspring.model.sensitivity import omega_with_derivatives
from synthetic import AMPLITUDE, MEAN, record_of, sine, spring_of

CUBIC = RefinedOptions(degrees=(3, 2))


@pytest.mark.parametrize("n", [0.222, 0.6, 1.0, 4.0])
@pytest.mark.parametrize("sigma", [0.6, 1.0, 3.0])
def test_derivatives_of_omega_are_those_of_differences(n: float, sigma: float) -> None:
    rng = np.random.default_rng(3)
    length = rng.uniform(0.005, 0.04, 6)
    direction = np.array([1, -1] * 3)
    stroke = np.repeat(np.arange(6), 40)
    travel = np.concatenate([np.sort(rng.uniform(0.0, span, 40)) for span in length])

    def omega(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rho, s, exponent, start = (float(v) for v in theta)
        return omega_with_derivatives(tables(exponent, s), rho, direction, length, start, stroke, travel)

    at = np.array([150.0, sigma, n, 0.2])
    _, exact = omega(at)
    for k, step in enumerate(1e-5 * np.maximum(1.0, np.abs(at))):
        change = np.zeros(4)
        change[k] = step
        difference = (omega(at + change)[0] - omega(at - change)[0]) / (2.0 * step)
        # Central differences of step h err by h^2*f'''/6 and by 1e-13/h: 1e-6 relative at n = 0.222.
        assert difference == pytest.approx(exact[k], abs=2e-6 * np.abs(exact[k]).max())


@pytest.mark.parametrize("strokes_in_steady", [1.5, 3.0])
def test_noise_free_data_give_every_parameter_back(strokes_in_steady: float) -> None:
    for n in (0.2, 0.5, 1.0, 5.0):
        for sigma in (0.5, 1.0, 5.0):
            known = spring_of(n, sigma, strokes_in_steady)
            p = identify(record_of(known, sine()), CUBIC).parameters
            assert (p.rho, p.sigma, p.n) == pytest.approx((known.rho, sigma, n), rel=1e-9)
            # The record's mid-stroke is not quite 50 mm, so FA = 1 elsewhere: the forces must agree instead.
            path = MEAN + AMPLITUDE * np.sin(np.linspace(0, 30, 2000)) * np.cos(np.linspace(0, 7, 2000))
            truth = Spring(known).response(path)
            found = identify(record_of(known, sine()), CUBIC).spring().response(path)
            assert found == pytest.approx(truth, abs=2e-5 * np.ptp(truth))  # the path goes beyond the samples


def test_unknown_omega_at_the_start_is_found() -> None:
    """A first stroke too short to be forgotten: the memory is a parameter too."""
    known = spring_of(1.0, 1.0, 0.6)
    path = MEAN + AMPLITUDE * np.cos(np.linspace(0.9 * np.pi, 7.0 * np.pi, 1500))
    record = Record(path, Spring(known).response(path, omega_start=0.8))
    found = identify(record, CUBIC)
    assert found.rnl > 0.9999
    assert found.fits[0].omega_start == pytest.approx(0.8, abs=1e-3)


def test_error_is_near_the_cramer_rao_bound_and_intervals_cover() -> None:
    """Additive noise on the model's own data."""
    known = spring_of(1.0, 1.0, 2.0)
    clean = record_of(known, sine())
    squares, covered = [], []
    for seed in range(20):
        force = clean.force + np.random.default_rng(seed).standard_normal(clean.force.size)
        found = identify(Record(clean.displacement, force), CUBIC)
        first = found.fits[0].first_sample
        squares.append(np.mean((found.fits[0].predicted - clean.force)[first:] ** 2))
        for name in ("kappa_omega", "rho", "sigma", "n"):
            covered.append(abs(getattr(found.parameters, name) - getattr(known, name)) < 1.96 * found.uncertainty[name])
    # The bound on the mean squared error of a prediction with p parameters from K samples of noise 1 N is p/K: four
    # of FE, three of FA and kappa_omega, three of omega.
    bound = np.sqrt(10.0 / (clean.force.size - first))
    # 20 seeds of a chi-square with 10 degrees of freedom: the root scatters by 5 %.
    assert np.sqrt(np.mean(squares)) < 1.15 * bound
    assert 0.88 <= np.mean(covered) <= 1.0


def test_refined_is_better_than_its_start() -> None:
    known = spring_of(0.5, 2.0, 2.0)
    truth = record_of(known, sine()).force
    for seed in range(4):
        record = record_of(known, sine(), noise=0.03, seed=seed)
        errors = [
            rmse(truth[125:], identify(record, options).fits[0].predicted[125:])
            for options in (CUBIC, TwoStageOptions(degrees=(3, 2)))
        ]
        assert errors[0] < errors[1]


def test_outliers_hardly_move_the_robust_fit() -> None:
    known = spring_of(1.0, 1.0, 2.0)
    record = record_of(known, sine(), noise=0.01)
    spoiled = record.force.copy()
    spoiled[200::40] += 60.0
    truth = record_of(known, sine()).force
    plain, robust = (
        rmse(truth, identify(Record(record.displacement, spoiled), RefinedOptions((3, 2), robust)).fits[0].predicted)
        for robust in (False, True)
    )
    assert robust < 0.5 * plain


def test_noise_is_split_into_additive_and_relative() -> None:
    rng = np.random.default_rng(0)
    force = record_of(spring_of(1.0, 1.0), sine(samples=20_000)).force
    relative = force_noise(force * (1.0 + 0.03 * rng.standard_normal(force.size)))
    # Group variances from medians scatter by a few per cent.
    assert relative.relative == pytest.approx(0.03, rel=0.1)
    assert relative.additive < 0.3
    additive = force_noise(force + 2.0 * rng.standard_normal(force.size))
    assert additive.additive == pytest.approx(2.0, rel=0.1)
    assert additive.relative < 0.01
    assert force_noise(force[:20]).relative == 0.0


def test_what_cannot_be_told_apart_is_said() -> None:
    known = spring_of(0.2, 2.0, 2.0)
    found = identify(record_of(known, sine(), noise=0.03), CUBIC)
    assert Outcome.INDISTINCT in found.outcomes
    assert found.uncertainty["indistinct"]
    assert set(found.uncertainty["correlation"]) == {
        "kappa_omega,rho", "kappa_omega,sigma", "kappa_omega,n", "rho,sigma", "rho,n", "sigma,n"
    }  # fmt: skip


def test_uncertainty_goes_into_the_model_file() -> None:
    spring = identify(record_of(spring_of(1.0, 1.0), sine(), noise=0.01), CUBIC).spring("a")
    assert spring.model.uncertainty["rho"] > 0.0
    assert spring.model.provenance["method"] == "refined"
    assert len(spring.model.uncertainty["kE"]) == 4


def test_dense_records_are_refined_too() -> None:
    known = spring_of(0.5, 1.0, 2.0)
    found = identify(record_of(known, sine(samples=60_000)), CUBIC)
    # Averaging over fine cells: what it costs is far below any noise.
    assert (found.parameters.rho, found.parameters.n) == pytest.approx((known.rho, known.n), rel=1e-3)


def test_options_check_themselves() -> None:
    with pytest.raises(ValueError, match="degrees"):
        RefinedOptions(degrees=(0, 1))
