"""Our two-stage method: springs of its class, Table 1, dry friction, and what it says of records."""

from __future__ import annotations

import numpy as np
import pytest

from strandspring import IdentificationError, Outcome, Record, Spring, SpringParameters, synthesize, synthesize_ni
from strandspring.identification.figures import twice
from strandspring.identification.identify import identify_records
from strandspring.identification.samples import Samples
from strandspring.peers.two_stage import TwoStageOptions
from synthetic import AMPLITUDE, MEAN, record_of, sine, spring_of

CUBIC = TwoStageOptions((3, 2))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.slow
@pytest.mark.parametrize("strokes_in_steady", [1.5, 3.0])
@pytest.mark.parametrize("options", [CUBIC, TwoStageOptions()], ids=["given", "chosen"])
def test_known_springs_are_predicted_on_inner_loops(strokes_in_steady: float, options: TwoStageOptions) -> None:
    path = MEAN + AMPLITUDE * np.sin(np.linspace(0, 30, 4000)) * np.cos(np.linspace(0, 7, 4000))
    errors = []
    for n in (0.2, 0.5, 1.0, 2.0, 5.0):
        for sigma in (0.5, 1.0, 5.0):
            known = spring_of(n, sigma, strokes_in_steady)
            found = identify_records([record_of(known, sine())], options)
            force = Spring(known).response(path)
            errors.append(rms(Spring(found.parameters).response(path) - force) / rms(force))
            assert found.rnl >= 0.989  # in the worst case omega saturates late
    # Inner loops were not in the record: before, 4.2 % and 0.3 % at worst for these stroke lengths.
    assert max(errors) <= (0.05 if options.degrees else 0.08)  # leaner degrees than before, chosen by held-out strokes


def test_parameters_come_near_the_known_ones() -> None:
    known = spring_of(1.0, 1.0, 3.0)
    found = identify_records([record_of(known, sine(samples=6000))], CUBIC).parameters
    # Stage 1 takes omega = 1 where it is 0.98 and more, which costs 1 % to 6 %.
    assert (found.rho, found.sigma, found.n) == pytest.approx((known.rho, 1.0, 1.0), rel=0.15)
    assert found.kappa_omega == pytest.approx(known.kappa_omega, rel=0.05)


@pytest.mark.parametrize("n", [0.3, 1.3, 3.0])
def test_noise_of_saturated_branches_biases_little(n: float) -> None:
    """It came out as travel: rho 15 to 26 % too large and n by a third to more than a half too small."""
    true = SpringParameters((0.0, 2e4), (1.0, 10.0), 50.0, 2500.0, 1.0, n, 0.0, -0.01, 0.01)
    records = [synthesize(Spring(true), 0.01, samples=500, noise=0.003, seed=seed) for seed in range(5)]
    found = [identify_records([record], TwoStageOptions((1, 1))).parameters for record in records]
    assert np.median([p.rho for p in found]) == pytest.approx(2500.0, rel=0.1)
    assert np.median([p.n for p in found]) == pytest.approx(n, rel=0.25)


@pytest.mark.parametrize(("samples", "error"), [(1000, 1.4), (128, 3.5)])
def test_one_noisy_period_of_table_1(samples: int, error: float) -> None:
    """The paper has 2.53 N; before, the median of 40 seeds was 1.24 N with 1000 samples, 3.46 N with 128."""
    errors = []
    for seed in range(10):
        record, clean = (synthesize_ni(samples=samples, seed=seed, noise=noise) for noise in (0.03, 0.0))
        path = twice(record)
        rows = Samples.of([path], 10_000, np.arange(len(path)) >= samples, [record])
        spring = Spring(TwoStageOptions().fit(rows, "here").parameters)
        errors.append(rms(spring.response(np.tile(clean.displacement, 5))[-samples:] - clean.force))
    assert np.median(errors) <= error


def test_very_many_cycles_are_fitted_as_well_as_few() -> None:
    """A few samples of each of 900 strokes do not show how omega runs along one."""
    known = Spring(SpringParameters((0.0, 2e4, 0.0, 1e7), (1.0, 10.0), 50.0, 2500.0, 1.0, 1.0, 0.0, -0.01, 0.01))
    found = []
    for cycles in (3, 150):
        record = synthesize(known, (0.01, 0.006, 0.003), cycles=cycles, samples=200, noise=0.01, seed=1)
        found.append(Spring(identify_records([record], TwoStageOptions()).parameters))
    path = sine(amplitude=0.007) - MEAN
    errors = [rms(spring.response(path) - known.response(path)) for spring in found]
    assert errors[1] < errors[0] + 0.1  # N of 120 N; two-fifths of a newton without whole strokes


def test_records_of_several_amplitudes_are_one_spring() -> None:
    known = spring_of(0.6, 1.5, 3.0)
    records = [record_of(known, sine(amplitude=0.6 * AMPLITUDE)), record_of(known, sine(samples=700))]
    found = identify_records(records, TwoStageOptions())
    assert min(fit.rnl for fit in found.fits) >= 0.985
    assert found.options["degrees"] == found.degrees


@pytest.mark.parametrize("samples", [200, 2000])
@pytest.mark.parametrize(("stiffness", "friction"), [(10.0, 0.5), (1e4, 5e3), (1.0, 20.0)])
def test_dry_friction_that_switches_between_two_samples_is_found(
    samples: int, stiffness: float, friction: float
) -> None:
    path = sine(samples=samples)
    side = np.append(1.0, np.sign(np.diff(path)))
    record = Record(path, stiffness * (path - MEAN) / AMPLITUDE + friction * side)
    # It is missed altogether in the sample after each of the 6 reversals, and in no other.
    found = TwoStageOptions((1, 0)).fit(Samples.of([record], 10_000), "here").parameters
    assert rms(Spring(found).response(path)[1:] - record.force[1:]) <= 2.0 * friction * np.sqrt(6.0 / samples)


def test_an_amplifier_that_would_turn_negative_is_lowered_until_positive() -> None:
    """The loop closes and crosses over the last few per cent of the range, too little to be refused."""
    path = sine()
    omega = Spring(spring_of(1.0, 1.0, 3.0)).omega(path)
    record = Record(path, 3000.0 * path + 10.0 * omega * (1.0 - 1.06 * (path - MEAN) / AMPLITUDE))
    found = identify_records([record], TwoStageOptions((3, 1)))
    assert Outcome.AMPLIFIER_REDUCED in found.outcomes
    assert found.options["degrees"] == found.degrees == (3, 0)


def test_short_strokes_are_named() -> None:
    found = identify_records([record_of(spring_of(1.0, 1.0, 0.3), sine(6))], CUBIC)
    assert {Outcome.NO_STEADY_SECTION, Outcome.SIGMA_AT_BOUND} & set(found.outcomes)
    long = identify_records([record_of(spring_of(1.0, 1.0, 3.0), sine(6))], CUBIC)
    assert not {Outcome.NO_STEADY_SECTION, Outcome.N_AT_BOUND, Outcome.SIGMA_AT_BOUND} & set(long.outcomes)


def test_as_many_parameters_as_samples_are_refused() -> None:
    path = MEAN + AMPLITUDE / 3.0 * np.array([0.0, 3.0, -2.0, 2.0, -3.0, 0.0, 3.0])
    samples = Samples.of([record_of(spring_of(1.0, 1.0), path)], 10_000)
    with pytest.raises(
        IdentificationError, match=rf"Found {samples.rows.size} samples to fit; 8 are needed"
    ) as refusal:
        TwoStageOptions((1, 0)).fit(samples, "here")
    assert refusal.value.outcome is Outcome.TOO_FEW_SAMPLES


def test_lower_degrees_are_tried_unless_they_are_given() -> None:
    samples = Samples.of([record_of(spring_of(1.0, 1.0), sine())], 10_000)
    found = [fitted.choices["degrees"] for fitted in TwoStageOptions().candidates(samples, "here")]
    assert found[1:] == [(5, 3), (4, 3), (3, 2), (2, 1), (1, 0)]
    assert len([*CUBIC.candidates(samples, "here")]) == 1
    for wrong in ((0, 0), (3, -1), (3, 9)):
        with pytest.raises(ValueError, match="`degrees` must be"):
            TwoStageOptions(wrong)
