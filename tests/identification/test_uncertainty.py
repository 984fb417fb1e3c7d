"""Errors of coefficients under correlated noise, 95 % intervals, the joint covariance and the prediction interval."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.fft import dct
from scipy.linalg import toeplitz
from scipy.signal import lfilter

from strandspring import (
    Identification,
    Outcome,
    Record,
    RefinedOptions,
    Spring,
    SpringParameters,
    identify,
    read_record,
    select,
    synthesize,
)
from strandspring.api.common.text import brief_parameter_lines
from strandspring.identification.certainty.figures import predict_record
from strandspring.identification.certainty.intervals import quantile_95
from strandspring.identification.certainty.posterior import _drawn, disagreement
from strandspring.identification.certainty.prediction_interval import ForceInterval, prediction_error
from strandspring.identification.least_squares.coloured_noise import _cosine_transform, coefficient_covariance
from strandspring.identification.points.residuals import repeated_share
from strandspring.identification.points.sample_points import gather
from strandspring.kernel.path import PathSolver
from strandspring.loops.strokes import find_strokes
from strandspring.model.joint import JointCovariance, joint_names
from synthetic import record_of, sine, spring_of

ROOT = Path(__file__).resolve().parents[2]
CUBIC = RefinedOptions(degrees=(3, 2))
NAMES = ("kappa_omega", "rho", "sigma", "n")


@pytest.mark.parametrize("samples", [1, 2, 3, 4, 5, 916, 1001])
def test_cosine_transform(samples: int) -> None:
    columns = np.random.default_rng(samples).standard_normal((samples, 3))
    expected = dct(columns, axis=0, norm="ortho")
    np.testing.assert_allclose(_cosine_transform(columns), expected, rtol=0.0, atol=1e-13)


def autoregressive(samples: int, correlation: float, seed: int) -> np.ndarray:
    """Stationary noise of variance 1."""
    shocks = np.random.default_rng(seed).standard_normal(samples) * np.sqrt(1.0 - correlation**2)
    shocks[0] /= np.sqrt(1.0 - correlation**2)
    return np.asarray(lfilter([1.0], [1.0, -correlation], shocks))


@pytest.mark.parametrize("correlation", [0.0, 0.9, 0.97])
def test_errors_are_those_of_the_true_covariance_of_the_noise(correlation: float) -> None:
    """On a linear model: the covariance of least squares under C is (J'J)^-1 J'C J (J'J)^-1."""
    size = 1500
    time = np.linspace(0.0, 1.0, size)
    jacobian = np.column_stack([np.ones(size), time, *(np.sin(2 * np.pi * k * time) for k in (3, 6, 20, 60))])
    bread = np.linalg.inv(jacobian.T @ jacobian)
    true = bread @ jacobian.T @ toeplitz(correlation ** np.arange(size)) @ jacobian @ bread
    ratios, times = [], []
    for seed in range(30):
        noise = autoregressive(size, correlation, seed)
        residuals = noise - jacobian @ (bread @ (jacobian.T @ noise))
        found = coefficient_covariance(jacobian, np.zeros(size), residuals, [slice(0, size)])
        ratios.append(np.linalg.norm(found.root, axis=1) / np.sqrt(np.diag(true)))
        times.append(found.time)
    means = np.mean(ratios, axis=0)
    assert means[2:] == pytest.approx(np.ones(4), rel=0.15)
    # The mean and the slope depend on the slowest noise, which the residuals hardly show: rather too large than not.
    assert np.all((means[:2] > 0.85) & (means[:2] < 1.5))
    assert np.mean(times) == pytest.approx((1.0 + correlation) / (1.0 - correlation), rel=0.3)


def test_several_records_are_series_of_their_own() -> None:
    """Two records in turn say the same as the two the other way round, and twice as much as one."""
    rng = np.random.default_rng(0)
    jacobian = np.column_stack([np.ones(1000), rng.standard_normal(1000)])
    noise = np.concatenate([autoregressive(600, 0.8, 1), autoregressive(400, 0.8, 2)])
    none = np.zeros(1000)
    first = coefficient_covariance(jacobian, none, noise, [slice(0, 600), slice(600, 1000)])
    order = np.r_[600:1000, 0:600]
    second = coefficient_covariance(jacobian[order], none, noise[order], [slice(0, 400), slice(400, 1000)])
    assert np.linalg.norm(first.root, axis=1) == pytest.approx(np.linalg.norm(second.root, axis=1), rel=1e-9)


def test_a_coefficient_that_a_record_has_for_itself_counts_like_any_other() -> None:
    rng = np.random.default_rng(2)
    records = [slice(0, 400), slice(400, 900)]
    both = np.column_stack([np.ones(900), rng.standard_normal(900)])
    own = np.where(np.arange(900) % 400 < 60, 1.0 + rng.uniform(size=900), 0.0)
    of_record = np.column_stack([own * (np.arange(900) < 400), own * (np.arange(900) >= 400)])
    noise = np.concatenate([autoregressive(400, 0.7, 1), autoregressive(500, 0.7, 2)])
    dense = np.hstack([both, of_record])
    residuals = noise - dense @ np.linalg.lstsq(dense, noise, rcond=None)[0]
    expected = coefficient_covariance(dense, np.zeros(900), residuals, records)
    length = np.linalg.norm(of_record, axis=0)
    unit = of_record / length
    found = coefficient_covariance(both - unit @ (unit.T @ both), unit.sum(axis=1), residuals, records)
    assert np.linalg.norm(found.root, axis=1) == pytest.approx(np.linalg.norm(expected.root, axis=1)[:2], rel=1e-9)
    # Of its value, from the noise along its column and from the other coefficients.
    change = np.hstack([-(unit.T @ both) / length[:, None], np.diag(1.0 / length)])
    for k in range(2):
        cross = found.scale @ found.with_own[k, :-1]
        joint = np.zeros((4, 4))
        joint[:2, :2] = found.root @ found.root.T
        joint[:2, 2 + k] = joint[2 + k, :2] = cross
        joint[2 + k, 2 + k] = found.with_own[k, -1]
        assert change[k] @ joint @ change[k] == pytest.approx(np.sum(expected.root[2 + k] ** 2), rel=1e-9)


def test_a_column_that_nothing_depends_on_has_no_error() -> None:
    rng = np.random.default_rng(0)
    jacobian = np.column_stack([np.ones(300), np.zeros(300), rng.standard_normal(300)])
    found = coefficient_covariance(jacobian, np.zeros(300), rng.standard_normal(300), [slice(0, 300)])
    errors = np.linalg.norm(found.root, axis=1)
    assert errors[1] == 0.0
    assert np.all(errors[[0, 2]] > 0.0)


def test_the_quantile_is_that_of_student() -> None:
    nu = np.array([4.0, 5.0, 8.0, 30.0, 1e6])
    expected = stats.t.ppf(0.975, nu) * np.sqrt((nu - 2.0) / nu)
    assert quantile_95(nu) == pytest.approx(expected, rel=0.02)


def test_misfit_of_every_cycle_is_distinguished_from_noise() -> None:
    path = sine(6, 3000)
    strokes = find_strokes(path)
    loops = gather(strokes, path, 1)
    place = np.sin(8.0 * np.pi * (loops.displacement - path.min()) / np.ptp(path)) * loops.side
    assert repeated_share(loops, place) == pytest.approx(1.0, abs=0.02)
    noise = [repeated_share(loops, autoregressive(loops.force.size, c, 0)) for c in (0.0, 0.9)]
    assert max(noise) < 0.2


def covered(correlation: float, runs: int) -> dict[str, float]:
    """Share of 95 % intervals of a spring that hold the truth."""
    known = spring_of(1.0, 1.0, 2.0)
    clean = record_of(known, sine(3, 1000))
    held = dict.fromkeys(NAMES, 0)
    for seed in range(runs):
        force = clean.force + 0.3 * autoregressive(clean.force.size, correlation, 1000 + seed)
        found = identify(Record(clean.displacement, force), CUBIC)
        x = found.parameters.displacement_offset - known.displacement_offset
        there = float(np.polynomial.polynomial.polyval(x, known.kA))
        for name in NAMES:
            true = getattr(known, name) * (there if name == "kappa_omega" else 1.0)
            low, high = found.uncertainty["interval_95"][name]
            held[name] += (low is None or low <= true) and (high is None or true <= high)
    return {name: count / runs for name, count in held.items()}


@pytest.mark.slow
@pytest.mark.parametrize("correlation", [0.0, 0.99])
def test_intervals_hold_the_truth(correlation: float) -> None:
    shares = covered(correlation, 120)
    # 120 runs scatter by 2 % (one standard deviation of the binomial distribution); no interval may be sure, either.
    assert all(0.9 <= share <= 0.995 for share in shares.values()), shares


def test_what_bounds_one_side_only_is_reported_so() -> None:
    """A sharp knee in few, noisy samples: n may be anything above some value."""
    known = spring_of(12.0, 0.6, 3.0)
    found = identify(record_of(known, sine(3, 90), noise=0.02, seed=1), CUBIC)
    low, high = found.uncertainty["interval_95"]["n"]
    assert high is None
    assert low is not None
    assert 1.0 < low < 12.0
    assert any(sentence.startswith("n > ") for sentence in found.uncertainty["indistinct"])


@pytest.fixture(scope="module")
def smooth() -> Identification:
    return identify(record_of(spring_of(1.0, 1.0), sine(5, 2000), noise=0.003), CUBIC)


def test_the_joint_covariance_has_the_standard_errors(smooth: Identification) -> None:
    content = smooth.uncertainty
    names = content["joint"]["parameters"]
    assert names == joint_names("kE", 4, 2)
    root = np.zeros((len(names), len(names)))
    for k, row in enumerate(content["joint"]["root"]):
        root[k, : k + 1] = row
    covariance = root @ root.T
    errors = np.sqrt(np.diag(covariance))
    own = [getattr(smooth.parameters, name) for name in NAMES]
    assert errors[:4] == pytest.approx(content["kE"], rel=1e-6)
    assert errors[4:6] == pytest.approx(content["kA"][1:], rel=1e-6)
    assert errors[6:] * own == pytest.approx([content[name] for name in NAMES], rel=1e-6)
    correlation = covariance[7, 9] / (errors[7] * errors[9])
    assert correlation == pytest.approx(content["correlation"]["rho,n"], rel=1e-6)


def test_drawn_springs_scatter_in_force_as_the_band_says(smooth: Identification) -> None:
    """FE and FA are drawn with rho and n: alone, each would scatter far more than the force does."""
    spring = smooth.parameters
    joint = JointCovariance.from_uncertainty(spring, smooth.uncertainty)
    assert joint is not None
    path = sine(2, 200)
    rng = np.random.default_rng(0)
    drawn = [joint.moved(spring, rng.standard_normal(len(joint.root)).tolist()) for _ in range(300)]
    forces = np.array([PathSolver(one).force(path, 0.0) for one in drawn])
    error = prediction_error(spring, joint, path, 0.0)
    # 300 draws scatter by 4 %; the force is not quite linear in the coefficients.
    assert forces.std(axis=0)[40:] == pytest.approx(error[40:], rel=0.2)
    fit = smooth.fits[0]
    steady = prediction_error(spring, joint, sine(5, 2000), fit.omega_start)[fit.first_sample :]
    assert np.sqrt(np.mean(steady**2)) == pytest.approx(smooth.uncertainty["force_rms"], rel=0.1)


def cut(record: Record, first: int, last: int) -> Record:
    """Strokes first to last - 1."""
    turning = find_strokes(record.displacement).turning
    piece = slice(turning[first], turning[last] + 1)
    return Record(record.displacement[piece], record.force[piece])


def held_out(found: Identification, record: Record) -> float:
    """Share of the samples inside the prediction interval."""
    spring, content = found.parameters, found.uncertainty
    interval, joint = ForceInterval.from_uncertainty(content), JointCovariance.from_uncertainty(spring, content)
    assert interval is not None
    assert joint is not None
    fit = predict_record(PathSolver(spring), record)
    path = find_strokes(record.displacement).displacement
    reach = interval.reach(fit.predicted, prediction_error(spring, joint, path, fit.omega_start))
    return float(np.mean(np.abs(record.force - fit.predicted) <= reach))


@pytest.mark.slow
def test_the_prediction_interval_holds_other_cycles_of_measured_records() -> None:
    hinge = read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement")
    actuator = read_record(ROOT / "tests/data/actuator/circle_3bar.csv", displacement=5, force=7)
    shares = [
        held_out(identify(cut(record, *fitted)), cut(record, *others))
        for record, fitted, others in (
            (hinge, (0, 5), (3, 6)),
            (actuator, (0, 10), (10, 20)),
            (actuator, (0, 15), (15, 20)),
        )
    ]
    assert all(0.9 <= share <= 0.98 for share in shares), shares
    for record in (hinge, actuator):
        content = identify(record).uncertainty["prediction_interval"]
        assert 0.9 <= content["held_out_coverage"] <= 0.98


def test_the_prediction_interval_of_a_range_is_not_that_of_what_other_cycles_do_not_show() -> None:
    """Within the range of the small loops the large ones are saturated: without the small ones, rho, sigma and n are
    unknown there."""
    spring = SpringParameters((0.0, 12000.0, 0.0, 3e6), (1.0, 5.0), 60.0, 900.0, 1.2, 0.9, 0.0, -0.02, 0.02)
    record = synthesize(Spring(spring), amplitudes=[0.005, 0.01, 0.018], mean=0.0, samples=300, noise=0.01, seed=1)
    found = identify(select(record, displacement=(-0.005, 0.005))).uncertainty["prediction_interval"]
    assert found["half_width"] < 3.0  # 1 % of noise in forces up to 120 N
    assert 0.85 < found["held_out_coverage"] < 1.0


@pytest.mark.parametrize("samples", [2000, 150_000], ids=["all samples", "averaged over cells"])
def test_the_prediction_interval_is_as_wide_as_the_noise(samples: int) -> None:
    """Noise of 1 N."""
    clean = record_of(spring_of(1.0, 1.0), sine(5, samples))
    force = clean.force + np.random.default_rng(0).standard_normal(samples)
    interval = identify(Record(clean.displacement, force), CUBIC).uncertainty["prediction_interval"]
    assert interval["half_width"] == pytest.approx(1.96, rel=0.06)
    assert interval["held_out_coverage"] == pytest.approx(0.95, abs=0.015)


def test_the_prediction_interval_counts_all_cycles_where_none_can_be_left_out() -> None:
    """Large cycles first, small ones last: these do not show where the large ones go; noise of 1 N and 2 N."""
    displacement = np.concatenate([size * np.sin(np.linspace(0.0, 6.0 * np.pi, 1500)) for size in (0.02, 0.006)])
    clean = record_of(spring_of(1.0, 1.0), displacement)
    noise = np.random.default_rng(0).standard_normal(displacement.size) * np.repeat([1.0, 2.0], 1500)
    found = identify(Record(displacement, clean.force + noise), CUBIC)
    interval = ForceInterval.from_uncertainty(found.uncertainty)
    assert interval is not None
    assert interval.held_out_coverage is None
    assert interval.sentence.endswith("because half of the cycles does not show what the others need")
    # 95 % of both: P(|N| < h)/2 + P(|N| < h/2)/2 = 0.95 at h = 3.29 N.
    assert interval.half_width == pytest.approx(3.29, rel=0.06)


def test_an_interval_that_misses_held_out_cycles_is_cautioned() -> None:
    record = record_of(spring_of(1.0, 1.0), sine(6, 1800))
    noise = np.random.default_rng(0).standard_normal(1800) * np.where(np.arange(1800) < 900, 0.1, 1.0)
    found = identify(Record(record.displacement, record.force + noise), CUBIC)
    assert found.uncertainty["prediction_interval"]["held_out_coverage"] < 0.8
    assert Outcome.INTERVAL_TOO_NARROW in found.outcomes
    sentence = ForceInterval.from_uncertainty(found.uncertainty).sentence
    assert sentence.endswith("(each half of the 6 in turn): it is too narrow")
    even = identify(record_of(spring_of(1.0, 1.0), sine(6, 1800), noise=0.01), CUBIC)
    assert Outcome.INTERVAL_TOO_NARROW not in even.outcomes


def test_one_cycle_leaves_the_coverage_open() -> None:
    interval = ForceInterval.from_uncertainty(
        identify(record_of(spring_of(1.0, 1.0), sine(1, 500), noise=0.01)).uncertainty
    )
    assert interval is not None
    assert interval.held_out_coverage is None
    assert "there is one only" in interval.sentence
    # A file may leave it out.
    content = {name: value for name, value in interval.as_json().items() if name != "held_out_coverage"}
    assert ForceInterval.from_uncertainty({"prediction_interval": content}) == interval


def test_a_posterior_needs_emcee(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "emcee", None)
    with pytest.raises(ValueError, match=r'install it with pip install "strandspring\[posterior\]"'):
        RefinedOptions((3, 2), posterior=200)


@pytest.mark.parametrize("inside", [0.0, 0.02, 1.0])
def test_draws_beyond_the_bounds_weigh_nothing(inside: float) -> None:
    # Of many records with unknown omega_start hardly a draw is within all bounds: then the sampler takes over.
    generator = np.random.default_rng(1)

    class Target:
        start, root_of_covariance = np.zeros(3), np.eye(3)

        def __call__(self, theta: np.ndarray) -> tuple[float, float, float]:
            return (-0.5 * float(theta @ theta) if generator.random() < inside else -np.inf), 1.0, 0.1

    _, values, weight = _drawn(Target(), np.random.default_rng(0))  # type: ignore[arg-type]
    assert np.isfinite(values).all()
    assert np.isfinite(weight).all()
    effective = weight.sum() ** 2 / max(float((weight**2).sum()), 1e-300)
    assert (effective > 1000.0) == (inside == 1.0)


@pytest.mark.slow
def test_the_posterior_agrees_with_the_intervals_where_the_records_tell_all() -> None:
    record = record_of(spring_of(1.0, 1.0), sine(3, 1000), noise=0.003)
    found = identify(record, RefinedOptions((3, 2), posterior=400, seed=1))
    content = found.uncertainty
    sampled = content["posterior"]
    assert disagreement(sampled, found.parameters) == ""
    shifted = replace(found.parameters, rho=1.001 * sampled["rho"][-1])
    assert disagreement(sampled, shifted).startswith("The posterior excludes the rho of the fit")
    assert "excludes the rho of the fit" in "\n".join(brief_parameter_lines(shifted, content))
    for name in NAMES:
        low, high = content["interval_95"][name]
        # More than 1000 independent draws: the ends of 95 % scatter by 4 % of their distance from the middle.
        assert sampled[name][2] == pytest.approx(0.5 * (low + high), abs=0.1 * (high - low))
        assert sampled[name][-1] - sampled[name][0] == pytest.approx(high - low, rel=0.25)
    assert sampled["long_enough"]
    assert sampled["effective_draws"] > 1000.0
    again = identify(record, RefinedOptions((3, 2), posterior=100, seed=1)).uncertainty["posterior"]
    assert again == identify(record, RefinedOptions((3, 2), posterior=100, seed=1)).uncertainty["posterior"]
