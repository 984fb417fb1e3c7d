"""The refined method: exact recovery, the statistical limit, honest errors; and the derivatives it rests on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from strandspring import (
    IdentificationError,
    Outcome,
    Record,
    RefinedOptions,
    Spring,
    SpringParameters,
    TwoStageOptions,
    identify,
    read_record,
)
from strandspring.identification.certainty.figures import predict_record, rmse, rnl
from strandspring.identification.points.noise import force_noise
from strandspring.identification.unrecorded.small_loops import loop_energy
from strandspring.kernel.path import PathSolver
from strandspring.loops.strokes import find_strokes
from stroke_points import omega_with_derivatives
from synthetic import AMPLITUDE, MEAN, record_of, sine, spring_of

ROOT = Path(__file__).resolve().parents[2]
CUBIC = RefinedOptions(degrees=(3, 2))


@pytest.mark.parametrize("n", [0.222, 0.6, 1.0, 4.0])
@pytest.mark.parametrize("sigma", [0.6, 1.0, 3.0])
@pytest.mark.parametrize(
    ("rho", "omega_start"), [(150.0, 0.2), (4000.0, 0.2), (4000.0, -1.0)], ids=["gradual", "saturated", "from -1"]
)
def test_derivatives_of_omega_are_those_of_differences(n: float, sigma: float, rho: float, omega_start: float) -> None:
    rng = np.random.default_rng(3)
    length = rng.uniform(0.005, 0.04, 6)
    direction = np.array([1, -1] * 3)
    stroke = np.repeat(np.arange(6), 40)
    travel = np.concatenate([np.sort(rng.uniform(0.0, span, 40)) for span in length])

    def omega(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rho, s, exponent, start = (float(v) for v in theta)
        return omega_with_derivatives(rho, s, exponent, start, direction, length, stroke, travel)

    at = np.array([rho, sigma, n, omega_start])
    _, exact = omega(at)
    # At omega_start = -1 the derivative by it is one-sided, and the other three are tried.
    for k, step in enumerate((1e-5 * np.maximum(1.0, np.abs(at)))[: 4 if omega_start > -1.0 else 3]):
        change = np.zeros(4)
        change[k] = step
        difference = (omega(at + change)[0] - omega(at - change)[0]) / (2.0 * step)
        # Central differences of step h err by h^2*f'''/6 and by 1e-13/h: 1e-6 relative at n = 0.222.
        assert difference == pytest.approx(exact[k], abs=2e-6 * np.abs(exact[k]).max())


@pytest.mark.slow
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
    errors = []
    for robust in (False, True):
        fit = identify(Record(record.displacement, spoiled), RefinedOptions((3, 2), robust)).fits[0]
        errors.append(rmse(truth[fit.first_sample :], fit.predicted[fit.first_sample :]))
    # Outliers of 60 N in every fortieth sample shift a plain fit by 60/40 N on the mean; measured 1.46 and 0.05 N.
    assert errors[1] < 0.1 * errors[0]


@pytest.mark.slow
@pytest.mark.parametrize("outliers", [0.0, 0.1])
def test_standard_errors_of_the_robust_fit(outliers: float) -> None:
    known = spring_of(1.0, 1.0, 2.0)
    clean = record_of(known, sine())
    deviations = []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        noise = rng.standard_normal(clean.force.size)
        noise += 20.0 * rng.standard_normal(noise.size) * (rng.random(noise.size) < outliers)
        found = identify(Record(clean.displacement, clean.force + noise), RefinedOptions((3, 2), robust=True))
        deviations += [
            (getattr(found.parameters, name) - getattr(known, name)) / found.uncertainty[name]
            for name in ("rho", "sigma", "n")
        ]
    # 75 deviations, of which n's and rho's go together, should have the mean square 1 to within some 30 %.
    assert 0.6 < np.mean(np.square(deviations)) < 1.5


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


def test_strong_correlations_are_reported() -> None:
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


def test_bootstrap_and_jacobian_agree_on_independent_noise() -> None:
    record = record_of(spring_of(1.0, 1.0), sine(12, 4000), noise=0.03)
    uncertainty = identify(record, RefinedOptions((3, 2), bootstrap=60, seed=1)).uncertainty
    for name in ("kappa_omega", "rho", "sigma", "n"):
        # 60 repetitions scatter by 9 %, and 23 strokes are few: a factor of 1.7 either way.
        assert uncertainty["bootstrap"][name] == pytest.approx(uncertainty[name], rel=0.7)
    few = identify(record_of(spring_of(1.0, 1.0), sine(), noise=0.03), RefinedOptions((3, 2), bootstrap=30)).uncertainty
    assert few["bootstrap"]["kappa_omega"] < 10.0 * few["kappa_omega"]
    with pytest.raises(ValueError, match=r"`bootstrap` must be 0 or within \[2, 10000\] repetitions, got 1"):
        RefinedOptions(bootstrap=1)
    again = identify(record, RefinedOptions((3, 2), bootstrap=60, seed=1)).uncertainty
    assert again["bootstrap"] == uncertainty["bootstrap"]
    with pytest.raises(
        IdentificationError, match=r"synthetic\.csv: A bootstrap draws from at least two steady strokes"
    ):
        identify(record_of(spring_of(1.0, 1.0), sine(1, 500), noise=0.03), RefinedOptions((3, 2), bootstrap=30))


def test_the_band_holds_the_true_force() -> None:
    known = spring_of(1.0, 1.0)
    inside = []
    for seed in range(6):
        band = identify(record_of(known, sine(), noise=0.03, seed=seed), CUBIC).prediction_band
        assert band is not None
        # The points of the band are the samples of the last closed loop, in their order.
        windows = np.lib.stride_tricks.sliding_window_view(sine(), band.force.size)
        first = int(np.abs(windows - band.displacement).max(axis=1).argmin())
        truth = Spring(known).response(sine())[first : first + band.force.size]
        inside.append(np.mean((band.low <= truth) & (truth <= band.high)))
    # Points of one band err together, so that its share inside is 95 % only in the mean over many records.
    assert np.mean(inside) > 0.8


def test_dense_records_are_refined_too() -> None:
    known = spring_of(0.5, 1.0, 2.0)
    found = identify(record_of(known, sine(samples=60_000)), CUBIC)
    # Averaging over fine cells: what it costs is far below any noise.
    assert (found.parameters.rho, found.parameters.n) == pytest.approx((known.rho, known.n), rel=1e-3)


def test_a_campaign_of_amplitudes_and_frequencies_is_one_spring() -> None:
    """The paper's section 5, synthesized: 13-46 mm about 57 mm, 0.13-2.12 Hz, noise, drift, coarse sensors."""
    known = SpringParameters(
        (320.0, 6500.0, 9e4, 1.2e6), (1.0, 9.0, 60.0), 35.0, 110.0, 1.2, 0.6, 0.057, 0.011, 0.103
    )  # fmt: skip
    plan = [(13, 0.13, 50), (20, 0.3, 100), (26, 0.6, 200), (33, 1.0, 500), (40, 1.5, 1000), (46, 2.12, 1000)]
    records, clean = [], []
    for seed, (amplitude, frequency, rate) in enumerate(plan):
        times = np.arange(int(5 * rate / frequency)) / rate
        path = 0.057 + 1e-3 * amplitude * np.sin(2.0 * np.pi * frequency * times)
        force = Spring(known).response(path)
        noise = 1.0 + 0.03 * np.random.default_rng(seed).standard_normal(path.size)
        drift = 1.0 + 0.02 * np.arange(path.size) / path.size
        # Sensors of 0.02 mm and 0.5 N.
        records.append(Record(np.round(path / 2e-5) * 2e-5, np.round(force * noise * drift / 0.5) * 0.5, times))
        clean.append(force)
    held_back = 3
    found = identify([r for k, r in enumerate(records) if k != held_back])
    solver = PathSolver(found.parameters)
    reached = [
        rnl(force, predict_record(solver, record).predicted) for force, record in zip(clean, records, strict=True)
    ]
    # Against the noise-free force; against the noisy one 3 % noise leaves 0.97 at most. Drift alone costs 0.01.
    assert min(reached) >= 0.98, reached
    assert reached[held_back] >= np.mean(reached) - 0.002, reached
    assert found.rnl >= 0.965


def test_the_hinge_is_predicted_from_another_cycle() -> None:
    record = read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement")
    turning = find_strokes(record.displacement).turning
    second, third = (
        Record(record.displacement[a : b + 1], record.force[a : b + 1])
        for a, b in ((turning[1], turning[3]), (turning[3], turning[5]))
    )
    found = identify(second)
    assert found.rnl >= 0.96
    assert predict_record(PathSolver(found.parameters), third).rnl >= 0.95


def test_options_check_themselves() -> None:
    with pytest.raises(ValueError, match="degrees"):
        RefinedOptions(degrees=(0, 1))


@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_sigma_at_its_physical_bound_is_certain_in_dense_records(noise: float) -> None:
    """The classic Bouc-Wen model with beta = 0 lies on the bound sigma = 1/2."""
    known = SpringParameters((0.0, 3000.0), (1.0,), 25.0, 500.0, 0.5, 1.5, 0.0, -AMPLITUDE, AMPLITUDE)
    found = identify(record_of(known, sine(3, 3001) - MEAN, noise))
    assert found.parameters.sigma == pytest.approx(0.5, rel=0.02)
    assert Outcome.SIGMA_AT_BOUND not in found.outcomes


def test_sigma_that_few_samples_leave_open_is_cautioned() -> None:
    known = SpringParameters((0.0, 3000.0), (1.0,), 25.0, 500.0, 0.5, 1.5, 0.0, -AMPLITUDE, AMPLITUDE)
    found = identify(record_of(known, sine(3, 61) - MEAN, 0.03))
    assert Outcome.SIGMA_AT_BOUND in found.outcomes


@pytest.mark.parametrize(
    ("wave", "samples"), [("sine", 11.3), ("sine", 24.6), ("sine", 39.7), ("triangle", 17.3), ("triangle", 41.3)]
)
def test_few_samples_in_a_cycle_look_like_no_effect_of_the_rig(wave: str, samples: float) -> None:
    spring, cycles, finer = spring_of(1.5, 2.0), 8, 64
    phase = 2.0 * np.pi * np.arange(int(cycles * samples) * finer) / (samples * finer)
    unit = np.sin(phase) if wave == "sine" else 2.0 / np.pi * np.arcsin(np.sin(phase))
    path = MEAN + AMPLITUDE * (0.3 + 0.1 * np.floor(phase / (2.0 * np.pi))) * unit
    force = Spring(spring).response(path)[::finer]
    force = force + 0.1 * np.random.default_rng(5).standard_normal(force.size)
    found = identify(Record(path[::finer], force, 0.1 * np.arange(force.size)))
    assert not found.effects
    assert f"{2 * round(0.5 * samples)} samples per cycle" in found.findings[Outcome.TURNS_RESTORED]
    assert Outcome.TURNS_BETWEEN_SAMPLES not in found.findings
    assert loop_energy(found.parameters) == pytest.approx(loop_energy(spring), rel=0.03)  # ten standard errors
    # The spring alone turns at the samples: the displacement as recorded has no reversals between them.
    assert found.fitted_figures["rmse"] < min(0.15, found.rmse)


def test_reversals_at_samples_stay_there() -> None:
    spring = spring_of(1.5, 2.0)
    found = identify(record_of(spring, sine(cycles=6, samples=240)))
    assert Outcome.TURNS_RESTORED not in found.findings
    assert found.parameters.rho == pytest.approx(spring.rho, rel=1e-6)
