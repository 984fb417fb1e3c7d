"""How certain a spring is said to be: against differences, repeated noise, springs of other classes and SciPy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rig import Experiment, draw_experiment, draw_spring, simulate
from springs import TABLE
from strandspring import (
    Outcome,
    Record,
    RefinedOptions,
    Spring,
    SpringParameters,
    bundled_record,
    identify,
    read_record,
)  # fmt: skip
from strandspring.core.branches import MaxwellBranch, Mechanism
from strandspring.identification.predictions import student_95
from strandspring.model.joint import JointCovariance, names_of
from synthetic import AMPLITUDE, MEAN, record_of, sine
from synthetic import spring_of as known
from tools import slow_but

pytestmark = pytest.mark.long

NAMES = ("kappa_omega", "rho", "sigma", "n")
KNOWN, PLAIN = known(1.0, 1.0), RefinedOptions((3, 2), mechanisms=1, branches=0)  # a spring and its class
WIDE = replace(KNOWN, second=Mechanism((1.0,), 6.0, 2000.0, 1.2, 0.8), branches=(MaxwellBranch(1500.0, 0.1),))


def falling(spring: SpringParameters, noise: float, seed: int = 0, cycles: int = 3, samples: int = 900) -> Record:
    """At 2 to 0.3 Hz, the amplitude falling to 0.3 of it."""
    share = np.linspace(0.0, 1.0, samples)
    time = 2.0 * cycles * share * (0.25 + 0.75 * share)
    path = MEAN + (sine(cycles, samples) - MEAN) * (1.0 - 0.7 * share)
    record = Record(path, path, time)
    return replace(record, force=along(spring, record) + noise * np.random.default_rng(seed).standard_normal(samples))


def along(spring: SpringParameters, record: Record) -> np.ndarray:
    """The force of a spring along a record."""
    return Spring(spring).response(record.displacement, time=record.time if spring.branches else None)


# -- of parameters


@pytest.mark.parametrize(
    ("truth", "options", "noise"),
    [
        (KNOWN, PLAIN, 0.5), (WIDE, RefinedOptions((3, 2), mechanisms=2, branches=1), 0.2),
        (TABLE, RefinedOptions(), 1.0),
    ],
)  # fmt: skip
def test_joint_covariance_is_that_of_the_saved_spring(truth: SpringParameters, options: Any, noise: float) -> None:
    record = falling(truth, noise, cycles=6)
    found = identify(record, options)
    spring, rows = found.parameters, slice(found.fits[0].first_sample, None)
    joint = JointCovariance.from_uncertainty(spring, found.uncertainty)
    assert found.uncertainty["joint"]["parameters"] == names_of(spring)
    root = np.array([[*row, *[0.0] * (len(joint.root) - len(row))] for row in joint.root])
    errors = np.linalg.norm(root, axis=1)
    each = JointCovariance(tuple(map(tuple, np.diag(errors))))

    def residuals(direction: np.ndarray) -> np.ndarray:
        return (along(each.moved(spring, direction), record) - record.force)[rows]

    J = np.stack([(residuals(0.01 * unit) - residuals(-0.01 * unit)) / 0.02 for unit in np.eye(errors.size)], axis=1)
    left = residuals(0.0 * errors)
    expected = left @ left / (left.size - errors.size) * np.linalg.inv(J.T @ J) * np.outer(errors, errors)
    # Differences over a hundredth of a standard error; the pull of the small penalty is in ours alone.
    np.testing.assert_allclose(errors, np.sqrt(np.diag(expected)), rtol=0.05)
    correlation = root @ root.T / np.outer(errors, errors)
    np.testing.assert_allclose(correlation, expected / np.sqrt(np.outer(*[np.diag(expected)] * 2)), atol=0.1)


def test_errors_grow_with_the_time_that_noise_is_correlated_over_and_with_steps_of_the_displacement() -> None:
    from scipy.signal import lfilter

    clean, white = falling(KNOWN, 0.0), 0.5 * np.random.default_rng(0).standard_normal(900)
    coloured = 0.6 * lfilter([1.0], [1.0, -0.8], white)  # of the same variance
    quiet = falling(KNOWN, 0.1)
    stepped = replace(quiet, displacement=np.round(quiet.displacement, 4))
    given = *(replace(clean, force=clean.force + noise) for noise in (white, coloured)), quiet, stepped
    first, second, fine, coarse = (identify(record, PLAIN) for record in given)
    ratios = [second.uncertainty[name] / first.uncertainty[name] for name in NAMES]
    # (1 + phi)/(1 - phi) = 9 times the variance, of which the fit takes what is slow.
    assert 1.5 < min(ratios) <= max(ratios) < 3.5
    # Turns between steps of 0.1 mm move what follows by more than the noise.
    assert min(coarse.uncertainty[name] / fine.uncertainty[name] for name in NAMES) > 3.0
    unrecorded = coarse.certainty.unrecorded
    assert unrecorded.low <= small_energy(KNOWN, MEAN, unrecorded.amplitude) <= unrecorded.high


def test_what_bounds_one_side_only_or_hangs_together_is_said_so() -> None:
    """A sharp knee in few, noisy samples: n may be anything above some value. One never near saturation."""
    found = identify(record_of(known(12.0, 0.6, 3.0), sine(3, 90), 0.02, 1), RefinedOptions(degrees=(3, 2)))
    low, high = found.uncertainty["interval_95"]["n"]
    assert high is None
    assert 1.0 < low < 12.0
    assert any(sentence.startswith("n > ") for sentence in found.uncertainty["indistinct"])
    truth = known(1.0, 1.0, 0.3)
    intervals = identify(falling(truth, 1.0), PLAIN).uncertainty["interval_95"]
    for name in NAMES:
        # Of one record; widened by a twentieth, a miss by chance is rare.
        low, high = intervals[name]
        assert 0.95 * (low or 0.0) <= getattr(truth, name) <= 1.05 * (high or np.inf), name
    # A spring with any larger kappa_omega and smaller rho is as good.
    assert intervals["kappa_omega"][1] is None or intervals["kappa_omega"][1] > 1.5 * truth.kappa_omega
    pairs = identify(record_of(known(0.2, 2.0), sine(), 0.03)).uncertainty
    assert max(abs(value) for value in pairs["correlation"].values() if value is not None) <= 1.0
    assert any("strongly correlated" in sentence for sentence in pairs["indistinct"])


@pytest.mark.parametrize(("nu", "rel"), [(4.0, 0.02), (8.0, 0.0025), (30.0, 6e-5), (1e6, 1e-6)])
def test_quantile_is_students(nu: float, rel: float) -> None:
    from scipy.stats import t as student

    assert student_95(nu) == pytest.approx(student.ppf(0.975, nu), rel=rel)  # a series in 1/nu up to its square


# -- of what was not recorded, and of new samples


def small_energy(spring: SpringParameters, middle: float, amplitude: float) -> float:
    """Of a steady loop [J]."""
    path = middle + amplitude * np.sin(np.linspace(0.0, 20.0 * np.pi, 10 * 1000 + 1))
    return float(np.trapezoid(Spring(spring).response(path)[-1001:], path[-1001:]))


@pytest.mark.parametrize("count", [4, pytest.param(40, marks=pytest.mark.slow)])
def test_the_range_of_small_loops_of_one_amplitude_holds_the_truth(count: int) -> None:
    """Where a spring errs by a tenth, the range of the energy says so; where it is narrow, it is right."""
    held, decided = [], 0
    for index in range(count):
        draw = np.random.default_rng([1, index])
        spring = draw_spring(draw)
        found = identify(
            simulate(spring, draw_experiment(draw, noise=0.005, amplitudes=(1.0,), cycles=(3,)), draw).records
        )
        unrecorded, p = found.certainty.unrecorded, found.parameters
        middle = 0.5 * (p.displacement_min + p.displacement_max)
        energy, saved = (small_energy(each, middle, unrecorded.amplitude) for each in (spring, p))
        assert unrecorded.energy == pytest.approx(saved, rel=5e-3)  # 60 steps of a stroke
        held.append(unrecorded.low <= energy <= unrecorded.high)
        decided += unrecorded.high < 1.25 * unrecorded.low
        assert Outcome.ONE_AMPLITUDE in found.outcomes
        assert abs(unrecorded.energy / energy - 1.0) < 0.1 or unrecorded.high > 1.25 * unrecorded.low
    assert sum(held) >= 0.93 * count - 1  # 95 %, of few
    assert decided > count // 2 - 1


@pytest.mark.parametrize("growing", [0.0, 0.03])
def test_prediction_interval_holds_new_samples(growing: float) -> None:
    clean, draw = falling(KNOWN, 0.0, cycles=6, samples=1500), np.random.default_rng(1)
    spread = np.hypot(0.3, growing * clean.force)
    record, new = (replace(clean, force=clean.force + spread * draw.standard_normal(1500)) for _ in range(2))
    found = identify(record, PLAIN)
    given, predicted = found.uncertainty["prediction_interval"], along(found.parameters, record)
    reach = given["factor"] * np.hypot(given["additive"], given["relative"] * predicted)
    assert np.mean(np.abs(new.force - predicted) <= reach) == pytest.approx(0.95, abs=0.02)  # 3.5 standard errors
    assert given["held_out_coverage"] == pytest.approx(0.95, abs=0.02)
    assert given["relative"] == pytest.approx(growing, rel=0.3)
    assert not found.certainty.unrecorded.one_amplitude
    (above, *_), (below, *_) = found.certainty.unrecorded.beyond
    assert below < found.parameters.displacement_min < found.parameters.displacement_max < above


def test_lack_of_fit_names_where_it_lies() -> None:
    record = falling(KNOWN, 0.3)
    y, share = (record.displacement - MEAN) / AMPLITUDE, np.linspace(0.0, 1.0, 900)
    ripple = np.where(np.abs(y) > 0.8 * np.abs(y).max(), 4.0 * np.sin(600.0 * y), 0.0)
    changing = 4.0 * np.sign(np.sin(2.0 * np.pi * share))
    for added, place in ((np.zeros(900), None), (ripple, "ends"), (changing, "cycles")):
        force = record.force + added
        found = identify(replace(record, force=force), PLAIN)
        lack, rows = found.certainty.lack, slice(found.fits[0].first_sample, None)
        left = (force - along(found.parameters, record))[rows]
        expected = np.sqrt(max(np.mean(left**2) - 0.3**2, 0.0)) / np.std(force[rows])
        assert lack.missed == pytest.approx(expected, rel=0.2, abs=0.003)
        assert lack.where[:1] == ([] if place is None else [place]), lack.places


@pytest.mark.parametrize("name", slow_but(["hinge", "wide", "iwan"], ["wide"]))
def test_figures_are_those_of_the_saved_spring_along_the_record(name: str) -> None:
    """Recomputed from the model file alone by an ODE solver."""
    from oracles import OracleSpring
    from zoo_mounts import draw_mount

    draw = np.random.default_rng(0)
    records: Any = {"hinge": [read_record(bundled_record(), reverse="displacement")], "wide": [falling(WIDE, 0.2)]}
    if name == "iwan":
        records[name] = simulate(draw_mount(draw, name), Experiment(separate=True), draw).records
    records = records[name]
    found = identify(records, save_anyway=True)
    model = found.model_file()
    spring = OracleSpring(model.parameters.as_dict())
    for each, figures, fit in zip(records, model.fit["records"], found.fits, strict=True):
        chosen = slice(figures["first_sample"], None)
        x, r = each.displacement[chosen], each.force[chosen]
        p = spring.force(each.displacement, figures["omega_start"], each.time)[chosen]
        assert figures["samples"] == r.size
        # 1e-5 is ten times the solver's error of omega; no average over samples can err by more.
        tolerance = 1e-5 * sum(m.kappa_omega * np.abs(m.kA).sum() for m in found.parameters.mechanisms)
        rmse, way = float(np.sqrt(np.mean((r - p) ** 2))), np.abs(np.diff(x)).sum()
        assert figures["rmse"] == pytest.approx(rmse, abs=tolerance)
        assert figures["rnl"] == pytest.approx(1.0 - rmse / np.sqrt(np.mean(r**2)), abs=tolerance / np.std(r))
        FE, rounding = spring.elastic(x), 1e-9 * np.abs(r).max() * way
        assert fit.energy == pytest.approx(np.trapezoid(r - FE, x), abs=rounding)
        assert fit.predicted_energy == pytest.approx(np.trapezoid(p - FE, x), abs=tolerance * way + rounding)
