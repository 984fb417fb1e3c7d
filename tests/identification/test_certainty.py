"""How certain a spring is said to be, against differences, numerical integration, SciPy and repeated noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.optimize import least_squares
from scipy.signal import lfilter
from scipy.stats import t as student

from rig import draw_experiment, draw_spring, simulate
from strandspring import Record, RefinedOptions, Spring, SpringParameters, identify
from strandspring.core.branches import MaxwellBranch, Mechanism
from strandspring.identification.certainty import Certainty, certainty, resolution
from strandspring.identification.choice import Choice, Judged
from strandspring.identification.fit import Fit, Problem, SpringClass
from strandspring.identification.noise import autocorrelation_time, growing_variance
from strandspring.identification.predictions import student_95
from strandspring.identification.samples import Samples
from strandspring.identification.spring import spring_of
from strandspring.model.joint import JointCovariance, names_of
from strandspring.model.outcomes import Outcome
from synthetic import AMPLITUDE, MEAN, sine
from synthetic import record_of as plain_record
from synthetic import spring_of as known

NAMES = ("kappa_omega", "rho", "sigma", "n")
KNOWN, PLAIN = known(1.0, 1.0), SpringClass((3, 0), (2,))  # a spring and its class
WITH_TABLE = (known(2.0, 0.8), SpringClass((3, 3), (2,)), 1.0)
WIDE = replace(KNOWN, second=Mechanism((1.0,), 6.0, 2000.0, 1.2, 0.8), branches=(MaxwellBranch(500.0, 0.1),))


def record_of(spring: SpringParameters, noise: float, seed: int = 0, cycles: int = 3, samples: int = 900) -> Record:
    """0.5 Hz, the amplitude falling to 0.3 of it."""
    time = np.linspace(0.0, 2.0 * cycles, samples)
    path = 0.05 + (sine(cycles, samples) - 0.05) * (1.0 - 0.7 * time / time[-1])
    force = Spring(spring).response(path, time=time if spring.branches else None)
    return Record(path, force + noise * np.random.default_rng(seed).standard_normal(samples), time)


def fitted(record: Record, c: SpringClass, q: list[float]) -> tuple[Problem, Fit]:
    """The minimum near q by SciPy, whose derivatives are differences."""
    problem = Problem(Samples.of([record], 2000))
    low, high = problem.bounds(c)
    start = np.clip(q, low, high)
    found = least_squares(lambda q: problem.linear(c, q).residuals, start, bounds=(low, high), x_scale=0.1)
    return problem, Fit(c, found.x, 2.0 * found.cost / problem.samples.rows.size)


def logarithms(spring: SpringParameters) -> list[float]:
    both = [spring, *([spring.second] if spring.second else [])]
    own = [np.log([s.rho * AMPLITUDE, s.sigma - 0.5 + 1e-3, s.n]) for s in both]
    return [*np.concatenate(own), *(np.log(branch.time_constant) for branch in spring.branches)]


def judged(problem: Problem, fit: Fit) -> tuple[SpringParameters, Certainty]:
    choice = Choice(Judged(fit, problem.held_out(fit)), (), problem)
    spring = spring_of(problem, fit)
    return spring, certainty(choice, problem, spring)


@pytest.mark.parametrize(
    ("truth", "c", "noise"), [(KNOWN, PLAIN, 0.05), (WIDE, SpringClass((3, 0), (2, 0), 1), 0.05), WITH_TABLE]
)
def test_joint_covariance_is_that_of_the_saved_spring(truth, c, noise):
    record = record_of(truth, noise)
    problem, fit = fitted(record, c, logarithms(truth))
    spring, found = judged(problem, fit)
    joint = JointCovariance.from_uncertainty(spring, found.uncertainty)
    assert found.uncertainty["joint"]["parameters"] == names_of(spring)
    root = np.array([[*row, *[0.0] * (len(joint.root) - len(row))] for row in joint.root])
    errors, time = np.linalg.norm(root, axis=1), record.time if spring.branches else None
    each = JointCovariance(tuple(map(tuple, np.diag(errors))))

    def force(direction):
        moved = each.moved(spring, direction)
        return Spring(moved).response(record.displacement, time=time)[problem.samples.rows]

    J = np.stack([(force(0.01 * unit) - force(-0.01 * unit)) / 0.02 for unit in np.eye(errors.size)], axis=1)
    residuals = force(0.0 * errors) - record.force[problem.samples.rows]
    variance = residuals @ residuals / (residuals.size - errors.size) * autocorrelation_time(residuals)
    expected = variance * np.linalg.inv(J.T @ J) * np.outer(errors, errors)
    # Differences over a hundredth of a standard error; the pull of the small penalty is in ours alone.
    np.testing.assert_allclose(errors, np.sqrt(np.diag(expected)), rtol=0.05)
    correlation = root @ root.T / np.outer(errors, errors)
    np.testing.assert_allclose(correlation, expected / np.sqrt(np.outer(*[np.diag(expected)] * 2)), atol=0.1)


def test_errors_are_the_scatter_of_repeated_noise():
    values, errors, held = [], [], []
    for seed in range(60):
        problem, fit = fitted(record_of(KNOWN, 0.5, seed, samples=400), PLAIN, logarithms(KNOWN))
        spring, found = judged(problem, fit) if seed < 20 else (spring_of(problem, fit), None)
        values.append([np.log(getattr(spring, name)) for name in NAMES])
        if found is not None:
            errors.append([found.uncertainty[name] / getattr(spring, name) for name in NAMES])
            # FA is 1 in the middle of the range, which is not the spring's own.
            middle = np.polyval(KNOWN.kA[::-1], spring.displacement_offset - KNOWN.displacement_offset)
            right = [KNOWN.kappa_omega * middle, KNOWN.rho, KNOWN.sigma, KNOWN.n]
            intervals = found.uncertainty["interval_95"].values()
            held += [low <= value <= high for value, (low, high) in zip(right, intervals, strict=True)]
    # The scatter of 60 is known to 9 %, and T is 1 at least where noise alone would give 1 in the mean.
    np.testing.assert_allclose(np.median(errors, axis=0), np.std(values, axis=0), rtol=0.25)
    assert np.mean(held) > 0.85  # of 80 that belong together in fours, 95 % expected


def test_what_bounds_one_side_only_is_said_so():
    """A sharp knee in few, noisy samples: n may be anything above some value."""
    found = identify(plain_record(known(12.0, 0.6, 3.0), sine(3, 90), 0.02, 1), RefinedOptions(degrees=(3, 2)))
    low, high = found.uncertainty["interval_95"]["n"]
    assert high is None
    assert 1.0 < low < 12.0
    assert any(sentence.startswith("n > ") for sentence in found.uncertainty["indistinct"])


def test_no_correlation_is_beyond_1_and_strong_ones_are_said():
    phase = np.linspace(0.0, 8.0 * np.pi, 32)
    growing = MEAN + AMPLITUDE * np.sin(phase) * phase / phase[-1]
    for n, path, noise in ((1.0, growing, 0.01), (8.0, growing, 0.01), (0.2, sine(), 0.03)):
        found = identify(plain_record(known(n, 2.0, 2.0 if n < 1.0 else 200.0), path, noise))
        pairs = found.uncertainty["correlation"]
        assert set(pairs) == {f"{a},{b}" for k, a in enumerate(NAMES) for b in NAMES[k + 1 :]}
        assert max((abs(value) for value in pairs.values() if value is not None), default=0.0) <= 1.0
    assert any("strongly correlated" in sentence for sentence in found.uncertainty["indistinct"])


def small_energy(spring: SpringParameters, middle: float, amplitude: float) -> float:
    """Of a steady loop [J]."""
    path = middle + amplitude * np.sin(np.linspace(0.0, 20.0 * np.pi, 10 * 1000 + 1))
    return float(trapezoid(Spring(spring).response(path)[-1001:], path[-1001:]))


@pytest.mark.parametrize("count", [4, pytest.param(60, marks=pytest.mark.slow)])
def test_the_range_of_small_loops_of_one_amplitude_holds_the_truth(count):
    """Where a spring errs by a tenth, the range of the energy says so; where it is narrow, it is right."""
    held, decided = [], 0
    for index in range(count):
        draw = np.random.default_rng([1, index])
        spring = draw_spring(draw)
        records = simulate(spring, draw_experiment(draw, noise=0.005, amplitudes=(1.0,), cycles=(3,)), draw).records
        found = identify(records)
        unrecorded, p = found.certainty.unrecorded, found.parameters
        energy = small_energy(spring, 0.5 * (p.displacement_min + p.displacement_max), unrecorded.amplitude)
        held.append(unrecorded.low <= energy <= unrecorded.high)
        decided += unrecorded.high < 1.25 * unrecorded.low
        assert Outcome.ONE_AMPLITUDE in found.outcomes
        assert abs(unrecorded.energy / energy - 1.0) < 0.1 or unrecorded.high > 1.25 * unrecorded.low
    assert sum(held) >= 0.93 * count  # 95 %, of few
    assert decided > count // 2


def test_small_loops_take_the_energy_of_the_saved_spring():
    spring, found = judged(*fitted(record_of(known(0.7, 0.9), 0.5), PLAIN, logarithms(known(0.7, 0.9))))
    phase = 2.0 * np.pi * np.arange(10 * 2000 + 1) / 2000
    small = spring.displacement_offset + found.unrecorded.amplitude * np.sin(phase)
    energy = trapezoid(Spring(spring).response(small)[-2001:], small[-2001:])
    assert found.unrecorded.energy == pytest.approx(energy, rel=5e-3)  # 60 steps of a stroke
    assert found.unrecorded.low < energy < found.unrecorded.high
    assert not found.unrecorded.one_amplitude
    (above, *_), (below, *_) = found.unrecorded.beyond
    assert below < spring.displacement_min < spring.displacement_max < above


@pytest.mark.parametrize(("sigma", "strokes"), [(0.5, 2.0), (1.0, 0.3)])
def test_intervals_are_open_where_nothing_bounds_a_parameter(sigma, strokes):
    truth = known(1.0, sigma, strokes)
    _, found = judged(*fitted(record_of(truth, 1.0), PLAIN, logarithms(truth)))
    intervals = found.uncertainty["interval_95"]
    for name in NAMES:
        low, high = intervals[name]
        # Of one record; widened by a twentieth, a miss by chance is rare.
        assert 0.95 * (low or 0.0) <= getattr(truth, name) <= 1.05 * (high or np.inf), name
    if strokes < 1.0:  # never near saturation: a spring with any larger kappa_omega and smaller rho is as good
        assert intervals["kappa_omega"][1] is None or intervals["kappa_omega"][1] > 1.5 * truth.kappa_omega


@pytest.mark.parametrize("growing", [0.0, 0.03])
def test_prediction_interval_holds_new_samples(growing):
    clean, draw = record_of(KNOWN, 0.0, cycles=6, samples=1500), np.random.default_rng(1)
    spread = np.hypot(0.3, growing * clean.force)
    record, new = (replace(clean, force=clean.force + spread * draw.standard_normal(1500)) for _ in range(2))
    spring, found = judged(*fitted(record, PLAIN, logarithms(KNOWN)))
    given = found.uncertainty["prediction_interval"]
    predicted = Spring(spring).response(clean.displacement)
    reach = given["factor"] * np.hypot(given["additive"], given["relative"] * predicted)
    assert np.mean(np.abs(new.force - predicted) <= reach) == pytest.approx(0.95, abs=0.02)  # 3.5 standard errors
    assert given["held_out_coverage"] == pytest.approx(0.95, abs=0.02)
    assert given["relative"] == pytest.approx(growing, rel=0.3)


def test_quantile_is_students():
    for nu in (4.0, 5.0, 8.0, 30.0, 1e6):
        assert student_95(nu) == pytest.approx(student.ppf(0.975, nu), rel=0.02)


def test_lack_of_fit_names_where_it_lies():
    record = record_of(KNOWN, 0.3)
    y, time = (record.displacement - 0.05) / AMPLITUDE, record.time
    ripple = np.where(np.abs(y) > 0.8 * np.abs(y).max(), 4.0 * np.sin(600.0 * y), 0.0)
    for force, place in ((0.0, None), (ripple, "ends"), (6.0 * (time / time[-1] - 0.5), "cycles")):
        problem, fit = fitted(replace(record, force=record.force + force), PLAIN, logarithms(KNOWN))
        lack = judged(problem, fit)[1].lack
        left = record.force + force - Spring(spring_of(problem, fit)).response(record.displacement)
        expected = np.sqrt(max(np.mean(left[problem.samples.rows] ** 2) - 0.3**2, 0.0)) / problem.deviation
        assert lack.missed == pytest.approx(expected, rel=0.2, abs=0.003)
        assert lack.where[:1] == ([] if place is None else [place]), lack.places


def test_noise_and_steps():
    white = np.random.default_rng(0).standard_normal(20_000)
    coloured = lfilter([1.0], [1.0, -0.8], white)
    assert autocorrelation_time(white) == pytest.approx(1.0, abs=0.1)
    assert autocorrelation_time(coloured) == pytest.approx(1.8 / 0.2, rel=0.2)  # (1 + phi)/(1 - phi)
    force = np.linspace(-3.0, 3.0, white.size)
    assert growing_variance(force, np.hypot(0.5, 0.2 * force) * white) == pytest.approx((0.25, 0.04), rel=0.2)
    assert growing_variance(force, white)[1] == 0.0
    assert resolution(np.round(np.sin(np.arange(900.0)), 2)) == pytest.approx(0.01)
