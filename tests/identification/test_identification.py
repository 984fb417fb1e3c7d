"""The two-stage identification: recovery of known springs, real records, and named refusals."""

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
    TwoStageOptions,
    identify,
    read_record,
)
from strandspring.core.polynomials import least_value
from strandspring.errors import RecordError
from strandspring.identification.certainty.figures import predict_record, rmse, rnl
from strandspring.identification.points.direction import backwards
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.kernel.path import PathSolver
from synthetic import AMPLITUDE, MEAN, record_of, sine, spring_of

ROOT = Path(__file__).resolve().parents[2]
CUBIC = TwoStageOptions(degrees=(3, 2))


def hinge() -> Record:
    return read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement")


def friction() -> Record:
    return read_record(ROOT / "tests/data/actuator/circle_3bar.csv", displacement=5, force=7)


@pytest.mark.slow
@pytest.mark.parametrize("strokes_in_steady", [1.5, 2.0, 3.0])
@pytest.mark.parametrize("options", [CUBIC, TwoStageOptions()], ids=["given", "auto"])
def test_known_springs_are_predicted(strokes_in_steady: float, options: TwoStageOptions) -> None:
    """Noise-free records with a steady section: RNL >= 0.99 each and 0.995 in the median."""
    reached = []
    for n in (0.2, 0.35, 0.5, 1.0, 2.0, 5.0):
        for sigma in (0.5, 1.0, 2.0, 5.0):
            known = spring_of(n, sigma, strokes_in_steady)
            found = identify(record_of(known, sine()), options)
            # Judged on a path it has not seen, with inner loops.
            path = MEAN + AMPLITUDE * np.sin(np.linspace(0, 30, 4000)) * np.cos(np.linspace(0, 7, 4000))
            truth = Spring(known).response(path)
            reached.append((rnl(truth, Spring(found.parameters).response(path)), found.rnl, n, sigma))
    own = np.array([r[1] for r in reached])
    unseen = np.array([r[0] for r in reached])
    assert own.min() >= 0.99, min(reached, key=lambda r: r[1])
    assert np.median(own) >= 0.995
    # Inner loops were not in the record; measured: 0.958, 0.983, 0.997 at worst for the three stroke
    # lengths, 0.968, 0.987, 0.998 in the median.
    assert unseen.min() >= 0.95, min(reached)
    assert np.median(unseen) >= 0.96


@pytest.mark.parametrize("n", [0.2, 1.0, 5.0])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_noise_of_three_percent_costs_little(n: float, seed: int) -> None:
    known = spring_of(n, 1.0)
    found = identify(record_of(known, sine(), noise=0.03, seed=seed), CUBIC)
    predicted = PathSolver(found.parameters).force(sine())
    # Half the noise: 1500 samples average it to below 1 %, the rest is the method's own error.
    assert rnl(Spring(known).response(sine()), predicted) >= 0.985


def test_parameters_come_near_the_known_ones() -> None:
    known = spring_of(1.0, 1.0, 3.0)
    found = identify(record_of(known, sine(samples=6000)), CUBIC).parameters
    # Stage 1 takes omega = 1 where it is 0.98 and more; what that costs, measured: 1 % to 6 %.
    assert found.n == pytest.approx(known.n, rel=0.15)
    assert found.rho == pytest.approx(known.rho, rel=0.15)
    assert found.sigma == pytest.approx(known.sigma, rel=0.15)
    assert found.kappa_omega == pytest.approx(known.kappa_omega, rel=0.05)


@pytest.mark.slow
def test_the_result_is_physically_possible_and_normalised() -> None:
    for record in (hinge(), friction(), record_of(spring_of(0.3, 4.0), sine())):
        p = identify(record).parameters
        assert p.kA[0] == 1.0
        assert p.sigma >= 0.5
        assert min(p.rho, p.kappa_omega, p.n) > 0.0
        assert least_value(p.kA, p.x_min, p.x_max)[0] > 0.0
        assert p.displacement_offset == pytest.approx(0.5 * (p.displacement_min + p.displacement_max))


def test_hinge_record_reaches_its_mark() -> None:
    found = identify(hinge())
    assert found.rnl >= 0.93
    assert found.fits[0].samples > 1900
    assert Outcome.FIRST_CYCLE_DIFFERS in found.outcomes


def test_friction_record_is_identified() -> None:
    found = identify(friction())
    assert found.fitted_figures["rnl"] >= 0.997
    # The last digits of the displacement's sensor turn back and forth, which moves the spring alone.
    assert found.rnl >= 0.985


def test_several_records_are_one_spring() -> None:
    known = spring_of(0.6, 1.5, 3.0)
    small = record_of(known, sine(amplitude=0.6 * AMPLITUDE))
    large = record_of(known, sine(samples=700))
    found = identify([small, large], CUBIC)
    assert len(found.fits) == 2
    assert min(fit.rnl for fit in found.fits) >= 0.985
    assert found.parameters.displacement_max == pytest.approx(MEAN + AMPLITUDE, rel=1e-4)


def test_one_closed_period_is_used_whole() -> None:
    known = spring_of(1.0, 1.0)
    two = Spring(known).response(sine(2, 2001))
    record = Record(sine(2, 2001)[1000:], two[1000:])
    steady = find_steady_part(record)
    assert steady.periodic
    found = identify(record, CUBIC)
    assert found.fits[0].samples == 1001
    assert found.rnl >= 0.99
    assert found.fits[0].omega_start == pytest.approx(float(Spring(known).omega(sine(2, 2001))[1000]), abs=0.05)


def test_dense_records_give_what_thin_ones_give() -> None:
    known = spring_of(0.5, 1.0)
    thin = identify(record_of(known, sine(samples=1500)), CUBIC)
    dense = identify(record_of(known, sine(samples=150_000)), CUBIC)
    # Averaging over cells of travel must not cost accuracy.
    assert dense.rnl >= thin.rnl - 0.001


@pytest.mark.slow
def test_order_of_a_tie_and_repetition_do_not_matter() -> None:
    record = hinge()
    assert identify(record).parameters == identify(record).parameters


def test_the_identified_spring_carries_its_figures_and_provenance(tmp_path: Path) -> None:
    found = identify(hinge())
    found.spring("hinge").save(tmp_path / "hinge.json")
    loaded = Spring.load(tmp_path / "hinge.json")
    assert loaded.parameters == found.parameters
    assert loaded.model.fit["rnl"] == found.rnl
    assert loaded.model.provenance["records"][0]["file"] == "rubber_stretch.csv"
    assert loaded.model.provenance["records"][0]["sha256"] == hinge().sha256


def test_omega_start_of_a_prediction_is_estimated() -> None:
    known = spring_of(1.0, 1.0)
    path = sine(2, 1000)
    fit = predict_record(PathSolver(known), Record(path, Spring(known).response(path, omega_start=-0.7)))
    assert fit.omega_start == pytest.approx(-0.7, abs=1e-4)
    assert fit.rnl > 0.9999


def test_figures_of_the_papers_table_1_need_the_root() -> None:
    force = np.array([3.0, -4.0])
    predicted = np.array([3.0, -3.0])
    assert rmse(force, predicted) == pytest.approx(np.sqrt(0.5))
    assert rnl(force, predicted) == pytest.approx(1.0 - 1.0 / 5.0)
    # All three rows of Table 1 have one rms force only if RNL = 1 - RMSE/rms.
    rows = [(2.5337, 0.98979), (6.0202, 0.97575), (2.0494, 0.99174)]
    assert [e / (1.0 - q) for e, q in rows] == pytest.approx([248.2] * 3, rel=1e-3)


@pytest.mark.parametrize(
    ("outcome", "record"),
    [
        (Outcome.FORCE_REVERSED, lambda r: Record(-r.displacement, r.force, path="r.csv")),
        (Outcome.FORCE_REVERSED, lambda r: Record(r.displacement, -r.force, path="r.csv")),
        (Outcome.COLUMNS_SWAPPED, lambda r: Record(r.force, r.displacement, path="r.csv")),
        (Outcome.TOO_FEW_STROKES, lambda r: Record(r.displacement[:100], r.force[:100], path="r.csv")),
        (Outcome.TOO_FEW_STROKES, lambda r: Record(np.full_like(r.displacement, 0.01), r.force, path="r.csv")),
        (Outcome.NO_LOOP, lambda r: Record(r.displacement, 1e3 * r.displacement, path="r.csv")),
    ],
)
def test_refusals_name_the_record_and_the_reason(outcome: Outcome, record) -> None:
    with pytest.raises(IdentificationError) as refusal:
        identify(record(record_of(spring_of(1.0, 1.0), sine())))
    assert refusal.value.outcome is outcome
    assert str(refusal.value).startswith("r.csv: ")


def test_snap_through_is_refused_whatever_the_sign() -> None:
    for reverse in (None, "displacement", "force"):
        record = read_record(ROOT / "tests/data/hinge/plastic_compress.csv", reverse=reverse)
        with pytest.raises(IdentificationError, match="snap-through"):
            identify(record)


def test_crossed_branches_are_refused() -> None:
    path = sine()
    side = np.sign(np.gradient(path))
    x = (path - MEAN) / AMPLITUDE
    record = Record(path, 3000.0 * path + side * (10.0 + 20.0 * x))
    with pytest.raises(IdentificationError) as refusal:
        identify(record)
    assert refusal.value.outcome is Outcome.BRANCHES_CROSS


def test_short_strokes_are_cautioned() -> None:
    known = spring_of(1.0, 1.0, 0.3)
    outcomes = identify(record_of(known, sine(6)), CUBIC).outcomes
    assert Outcome.NO_STEADY_SECTION in outcomes or Outcome.SIGMA_AT_BOUND in outcomes


def test_strokes_within_a_digit_of_the_sensor_are_no_drift() -> None:
    """All samples at three displacements: some strokes begin and end at one of them."""
    path = 0.01 * np.random.default_rng(1).integers(-1, 2, 200)
    assert Outcome.DRIFT not in identify(record_of(spring_of(1.0, 1.0), path, noise=0.01), CUBIC).outcomes


def test_drift_between_cycles_is_cautioned() -> None:
    record = record_of(spring_of(1.0, 1.0), sine(8, 4000))
    drifting = Record(record.displacement, record.force + np.linspace(0.0, 15.0, 4000))
    assert Outcome.DRIFT in identify(drifting, CUBIC).outcomes
    assert Outcome.DRIFT not in identify(record, CUBIC).outcomes


def test_options_check_themselves() -> None:
    for wrong in ({"degrees": (0, 0)}, {"degrees": (3, 9)}):
        with pytest.raises(ValueError, match="must be"):
            TwoStageOptions(**wrong)
    with pytest.raises(ValueError, match="at least one record"):
        identify([])


def test_an_amplifier_that_would_turn_negative_is_lowered_until_positive() -> None:
    """The loop closes and crosses over the last few per cent of the range, too little to be refused."""
    path = sine(3, 1500)
    z = (path - MEAN) / AMPLITUDE
    record = Record(path, 3000.0 * path + 10.0 * np.sign(np.gradient(path)) * (1.0 - 1.06 * z))
    found = identify(record, TwoStageOptions(degrees=(3, 1)))
    assert Outcome.AMPLIFIER_REDUCED in found.outcomes
    assert found.degrees == (3, 0)


def spoiled(value: float) -> Record:
    """A record with one bad force sample, the 701st."""
    record = record_of(spring_of(1.0, 1.0), sine(), noise=0.01)
    force = record.force.copy()
    force[700] = value
    return Record(record.displacement, force, path="r.csv")


@pytest.mark.slow
def test_a_bad_sample_is_cautioned_unless_the_fit_is_robust() -> None:
    record = spoiled(250.0)
    assert Outcome.SPIKES in identify(record).outcomes
    assert Outcome.SPIKES not in identify(record, RefinedOptions(robust=True)).outcomes
    for good in (hinge(), friction(), record_of(spring_of(1.0, 1.0), sine(), noise=0.03)):
        assert Outcome.SPIKES not in identify(good, TwoStageOptions()).outcomes


@pytest.mark.parametrize("value", [1e5, 1e8, -1e25])
def test_a_bad_sample_that_decides_all_is_named(value: float) -> None:
    with pytest.raises(IdentificationError, match=r"r\.csv, sample 701 \(force .* N\): ") as refusal:
        identify(spoiled(value))
    assert refusal.value.outcome is Outcome.SPIKES_DECIDE


def test_the_same_samples_twice_are_refused() -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    again = Record(record.displacement, record.force, path="copy.csv")
    with pytest.raises(RecordError, match=r"copy\.csv: holds the same samples as synthetic\.csv"):
        identify([record, again])
    # A run at another frequency is another measurement, even of a spring that repeats exactly.
    times = np.arange(record.force.size, dtype=float)
    identify([Record(record.displacement, record.force, rate * times) for rate in (1.0, 2.0)], CUBIC)


@pytest.mark.parametrize("scale", [1e-200, 1e-100, 1e-31, 1e31, 1e100, 1e200])
def test_absurd_sizes_are_refused(scale: float) -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    with pytest.raises(RecordError, match="check its unit"):
        identify(Record(scale * record.displacement, scale * record.force))


@pytest.mark.parametrize("scale", [1e-10, 1e7])
def test_sizes_far_from_any_rig_are_identified_all_the_same(scale: float) -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    assert identify(Record(scale * record.displacement, scale * record.force)).rnl > 0.999


def test_loops_that_run_backwards_are_named_as_identify_does() -> None:
    record = record_of(spring_of(1.0, 1.0), sine(), noise=0.03)
    x, r = record.displacement, record.force
    assert backwards(record) is None
    assert backwards(Record(-x, -r)) is None
    for turned in (Record(-x, r), Record(x, -r)):
        assert backwards(turned) is Outcome.FORCE_REVERSED
    assert "`reverse=force`" in Outcome.FORCE_REVERSED.value
    assert backwards(Record(r, x)) is Outcome.COLUMNS_SWAPPED
    for real in (hinge(), friction()):
        assert backwards(real) is None
        assert backwards(Record(-real.displacement, real.force)) is Outcome.FORCE_REVERSED
    # No loop, and no way round.
    assert backwards(Record(x, 1e3 * x + np.random.default_rng(0).standard_normal(x.size))) is None


def test_a_path_without_cycles_can_run_backwards_too() -> None:
    time = np.linspace(0.0, 1.0, 4000)
    path = MEAN + AMPLITUDE * np.sin(60.0 * time) * np.cos(17.0 * time + 1.0)
    force = Spring(spring_of(1.0, 1.0)).response(path)
    assert backwards(Record(path, force)) is None
    assert backwards(Record(-path, force)) is Outcome.FORCE_REVERSED
    # Half a stroke tells nothing.
    assert backwards(Record(-path[:60], force[:60])) is None


def test_a_name_that_is_not_utf_8_goes_into_the_model_file(tmp_path: Path) -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    found = identify(Record(record.displacement, record.force, path="m\udcfc\x1b.csv"), CUBIC)
    found.spring("a").save(tmp_path / "a.json")
    assert Spring.load(tmp_path / "a.json").model.provenance["records"][0]["file"] == "m\ufffd\ufffd.csv"


def test_records_without_a_displacement_in_common_are_cautioned() -> None:
    spring = spring_of(1.0, 1.0)
    low, middle, high = (
        record_of(spring, centre + 0.004 * np.sin(np.linspace(0.0, 6.0 * np.pi, 600)), noise=0.003, seed=seed)
        for seed, centre in enumerate((0.04, 0.05, 0.06))
    )
    found = identify([low, high], RefinedOptions((3, 2)))
    assert "(44 to 56 mm)" in found.cautions[found.outcomes.index(Outcome.RANGE_WITH_GAPS)]
    wide = record_of(spring, sine(), noise=0.003)
    assert Outcome.RANGE_WITH_GAPS not in identify([middle, wide], RefinedOptions((3, 2))).outcomes
