"""Effects of the rig: their true sizes are found, no others, and their columns are derivatives of the exact effect."""

from __future__ import annotations

import re
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from noise_bound import delay_bound, wear_bound
from rig import Case, Experiment, draw_experiment, draw_spring, elastic_force, simulate
from rig_faults import FAULTS
from strandspring import Identification, IdentificationError, Outcome, Record, Spring, identify, read_record
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.identification.rig.effect_columns import Effect, Rig, Sizes
from strandspring.identification.rig.effect_texts import CAUTIONS, with_other_effects
from strandspring.identification.search.search import Candidate, search
from tools import slow_but

ROOT = Path(__file__).resolve().parents[2]
STEPPED = Experiment(amplitudes=(0.4, 0.7, 1.0), cycles=(3, 3, 3), noise=0.002)
REPEATED = Experiment(amplitudes=(0.6, 1.0, 0.6, 1.0), cycles=(2, 2, 2, 2), noise=0.002)


def case_of(fault: str, share: float, experiment: Experiment, seed: int = 1) -> Case:
    """Records of a spring with high loops."""
    generator = np.random.default_rng(seed)
    spring = draw_spring(generator, (0.5, 3.0), (0.6, 3.0), (6.0, 20.0), (0.2, 0.4), degrees=(3, 1))
    return simulate(spring, experiment, generator, replace(FAULTS[fault], large=share), "large")


def fastest(case: Case) -> float:
    """Largest velocity of the sine [m/s]."""
    return 2.0 * np.pi * case.experiment.frequency * case.amplitude


# By fault: its share, the experiment, the effect's name and its true size in SI units.
SIZES = {
    "force lags": (0.003, STEPPED, "delay", lambda c: c.magnitude * c.experiment.period),
    "force leads": (0.01, STEPPED, "delay", lambda c: -c.magnitude * c.experiment.period),
    "viscous damper": (0.5, STEPPED, "viscosity", lambda c: c.magnitude * c.spring.kappa_omega / fastest(c)),
    "play": (0.01, REPEATED, "play", lambda c: c.magnitude * c.amplitude),
    "force zero": (
        0.05, STEPPED, "force_zero", lambda c: c.magnitude * elastic_force(c.spring) * np.array([0.0, 1.0, -0.7])
    ),
    "displacement zero": (
        0.02, STEPPED, "displacement_zero", lambda c: c.magnitude * c.amplitude * np.array([0.0, 1.0, -0.7])
    ),
    "linear drift": (0.1, STEPPED, "drift", lambda c: c.magnitude * elastic_force(c.spring)),
    "wear of friction": (0.3, STEPPED, "friction_wear", lambda c: -c.magnitude),
    "wear of stiffness": (0.1, REPEATED, "stiffness_wear", lambda c: -c.magnitude),
}  # fmt: skip


@pytest.mark.parametrize("fault", slow_but(SIZES, ("force lags", "play", "linear drift", "wear of friction")))
def test_the_size_of_an_effect_is_found(fault: str) -> None:
    share, experiment, name, truth = SIZES[fault]
    case = case_of(fault, share, experiment)
    effects = identify(case.records).effects
    assert name in effects
    # 10 % or, of a delay, 0.3 ms, and 0.1 mm of a shift.
    floor = {"delay": 3e-4, "displacement_zero": 1e-4, "play": 1e-4}.get(name, 0.0)
    floor = min(floor, 0.1 * float(np.max(np.abs(truth(case)))))
    assert effects[name] == pytest.approx(truth(case), rel=0.1, abs=floor)


@pytest.mark.parametrize("fault", ["force lags", "force leads"])
@pytest.mark.parametrize("shape", ["sine", "triangle"])
def test_a_delay_is_placed_exactly_though_points_are_averaged(fault: str, shape: Literal["sine", "triangle"]) -> None:
    # Of some 250 samples in a cycle, and single reversals within averaged ones, only noise may be left.
    experiment = Experiment(shape=shape, amplitudes=(1.0,), cycles=(4,), noise=1e-4)
    case = case_of(fault, 0.005, experiment)
    identification = identify(case.records)
    delay = SIZES[fault][3](case)
    assert identification.effects == {"delay": pytest.approx(delay, rel=0.01)}
    assert identification.lack_of_fit is not None
    assert identification.lack_of_fit.beyond_noise < 0.01


def drawn(fault: str, seed: int, index: int) -> Case:
    """A case of `honesty.py sizes`."""
    generator = np.random.default_rng([seed, zlib.crc32(fault.encode()), index])
    return simulate(draw_spring(generator), draw_experiment(generator), generator, FAULTS[fault], "drawn")


@pytest.mark.parametrize(
    ("fault", "seed", "index"),
    [
        ("force lags", 0, 11),  # a richer FE takes over much of it
        ("force lags", 1, 14),
        ("force leads", 0, 8),  # straight lines between the samples of this sine are further off than the noise
        ("force leads", 1, 0),  # a triangle's velocity jumps where the delay is measured
        ("force leads", 1, 16),  # averaged points show nothing of it: sigma takes it over
        ("force leads", 5, 14),  # the same with an FE of degree 7
    ],
)
def test_delays_that_were_missed_are_found(fault: str, seed: int, index: int) -> None:
    case = drawn(fault, seed, index)
    found = identify(case.records)
    truth = SIZES[fault][3](case)
    assert found.effects == {"delay": pytest.approx(truth, abs=4.0 * delay_bound(case, truth))}


@pytest.mark.parametrize(
    ("fault", "seed", "index", "as_measured"),
    [
        ("force lags", 6, 1, "the loop runs the wrong way round"),
        ("force lags", 5, 4, "the unloading branch lies above the loading branch"),
        ("force leads", 6, 17, "the force collapses while the displacement continues"),
    ],
)
def test_records_that_only_a_delay_explains_are_identified_with_it(
    fault: str, seed: int, index: int, as_measured: str
) -> None:
    case = drawn(fault, seed, index)
    # Without the delay, which an FMU does not have, the spring may be worse than a line.
    found = identify(case.records, save_anyway=True)
    truth = SIZES[fault][3](case)
    assert found.effects == {"delay": pytest.approx(truth, abs=4.0 * delay_bound(case, truth))}
    assert f"; without it, {as_measured}" in found.findings[Outcome.DELAY]
    # Without times no delay can be sought.
    with pytest.raises(IdentificationError, match=as_measured[4:]):
        identify([Record(record.displacement, record.force) for record in case.records])


def test_loops_of_one_amplitude_that_run_backwards_are_refused_with_the_lag() -> None:
    with pytest.raises(IdentificationError, match=r"If the force lags, then by more than 9\.72 ms") as refused:
        identify(drawn("force lags", 0, 14).records)
    assert refused.value.outcome is Outcome.COLUMNS_SWAPPED


@pytest.mark.parametrize("index", range(4))
def test_no_delay_explains_swapped_columns(index: int) -> None:
    generator = np.random.default_rng([0, index])
    amplitudes = {"amplitudes": (1.0,), "cycles": (3,)} if index % 2 else {}
    case = simulate(draw_spring(generator), draw_experiment(generator, **amplitudes), generator)
    swapped = [Record(r.force, r.displacement, r.time, r.path) for r in case.records]
    with pytest.raises(IdentificationError) as refused:
        identify(swapped)
    assert refused.value.outcome is Outcome.COLUMNS_SWAPPED


@pytest.mark.parametrize(("seed", "index"), [(0, 8), (0, 15), (1, 17)])
def test_wear_is_as_large_as_the_records_decide(seed: int, index: int) -> None:
    case = drawn("wear of friction", seed, index)
    wear = -case.magnitude
    # Steps judged by points corrected with another fit ended 4 to 6 of these standard deviations off.
    expected = pytest.approx(wear, abs=2.5 * wear_bound(case, wear))
    assert identify(case.records).effects == {"friction_wear": expected}


def test_effects_that_explain_the_records_as_well_are_named_with_their_sizes() -> None:
    # sigma is large, so that the triangle's reversals look much like those of a play.
    case = drawn("force lags", 0, 12)
    found = identify(case.records)
    truth = SIZES["force lags"][3](case)
    assert list(found.effects) == ["play"]
    told = re.search(r"or, nearly as well, a delay: the force lags by (\S+) ms", found.findings[Outcome.PLAY])
    assert told is not None
    assert 1e-3 * float(told[1]) == pytest.approx(truth, abs=4.0 * delay_bound(case, truth))


def test_where_more_than_noise_is_left_nothing_is_removed() -> None:
    """A Maxwell element beside the spring, which wear imitates best, and viscous damping nearly as well."""
    generator = np.random.default_rng([15, zlib.crc32(b"Maxwell element"), 0])
    case = simulate(draw_spring(generator), draw_experiment(generator), generator, FAULTS["Maxwell element"], "drawn")
    found = identify(case.records)
    assert not found.effects
    assert "relaxation" in found.findings[Outcome.RIG_OR_MOUNT]


def test_every_effect_has_words_as_a_rival() -> None:
    sizes = {effect: np.full(3 if effect is Effect.CURVED_DRIFT else 1, 1e-3) for effect in Effect}
    for effect in Effect:
        own: Sizes = {Effect.VISCOSITY if effect is Effect.DELAY else Effect.DELAY: np.ones(1)}
        outcome = CAUTIONS[next(iter(own))]
        text = with_other_effects({outcome: "as found"}, own, [{effect: sizes[effect]}])[outcome]
        assert re.fullmatch(r"as found; or, nearly as well, [a-z ]+: .*\d.*", text)
        fewer = with_other_effects({outcome: "as found"}, own | {effect: sizes[effect]}, [{effect: sizes[effect]}])
        assert fewer[outcome] == "as found; or, nearly as well, without it"
        # One that has the same effect among others says nothing against it.
        assert with_other_effects({outcome: "as found"}, own, [own | {effect: sizes[effect]}])[outcome] == "as found"


@pytest.mark.parametrize(("shape", "within"), [("sine", 5e-5), ("triangle", 1e-12)])
def test_the_path_between_samples_follows_its_curvature(shape: Literal["sine", "triangle"], within: float) -> None:
    time = np.arange(401) / 100.0
    at = {
        "sine": lambda t: -np.cos(2.0 * np.pi * t),
        "triangle": lambda t: 4.0 * np.abs(t % 1.0 - 0.5) - 1.0,
    }[shape]
    spring = Spring(draw_spring(np.random.default_rng(0), degrees=(1, 0)))
    middle = spring.parameters.displacement_offset
    half = 0.5 * (spring.parameters.displacement_max - spring.parameters.displacement_min)
    x = middle + half * at(time)
    rig = Rig.from_parts([find_steady_part(Record(x, spring.response(x), time))], None)
    late = time - 0.0037
    placed = rig.placed({Effect.DELAY: np.array([0.0037])})
    # A straight line is off by 5e-4 of the amplitude in the middle of an interval.
    apart = np.abs(placed.displacement - middle - half * at(late))[1:] / half
    assert apart.max() < within


def test_a_warm_up_is_a_curved_drift() -> None:
    case = case_of("warm-up", 0.1, STEPPED)
    # What the exponential rises by within the test.
    expected = case.magnitude * elastic_force(case.spring) * -np.expm1(-1.0 / 0.25)
    assert identify(case.records).effects["drift"] == pytest.approx(expected, rel=0.1)


def test_samples_count_in_all_records_where_one_has_no_times() -> None:
    timed, other, *_ = case_of("force zero", 0.05, replace(STEPPED, separate=True)).records
    parts = [find_steady_part(record) for record in (timed, Record(other.displacement, other.force))]
    rig = Rig.from_parts(parts, None)
    last = len(timed) - 1
    assert rig.elapsed(rig.loops)[last] == pytest.approx(last / (last + len(other) - 1))
    both = Rig.from_parts([find_steady_part(record) for record in (timed, other)], None)
    assert both.elapsed(both.loops)[last] == pytest.approx(timed.time[-1] / (timed.time[-1] + other.time[-1]))


@pytest.mark.slow
def test_clean_records_have_no_effects() -> None:
    for seed in range(12):
        generator = np.random.default_rng([0, seed])
        case = simulate(draw_spring(generator), draw_experiment(generator), generator)
        assert identify(case.records).effects == {}, seed


@pytest.mark.parametrize("name", ["hinge", "actuator"])
def test_the_measured_records_have_no_effects(name: str) -> None:
    if name == "hinge":
        record = read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement")
    else:
        record = read_record(ROOT / "tests/data/actuator/circle_3bar.csv", displacement=5, force=7)
    assert identify(record).effects == {}


def fitted(separate: bool) -> tuple[Rig, Candidate]:
    generator = np.random.default_rng(3)
    spring = draw_spring(generator, (1.0, 1.5), (0.8, 1.2), (8.0, 10.0), degrees=(3, 1))
    experiment = replace(REPEATED, noise=0.0, separate=separate, cycles=(2, 2, 2, 2), samples=1600)
    parts = [find_steady_part(record) for record in simulate(spring, experiment, generator).records]
    rig = Rig.from_parts(parts, None)
    return rig, search(rig.loops, (3, 1))[0]


@pytest.mark.parametrize(
    ("effect", "size"),
    [
        (Effect.DELAY, 1e-6),
        (Effect.VISCOSITY, 1.0),
        (Effect.PLAY, 1e-8),
        (Effect.FORCE_ZERO, 1e-3),
        (Effect.DISPLACEMENT_ZERO, 1e-8),
        (Effect.DRIFT, 1e-3),
        (Effect.CURVED_DRIFT, 1e-3),
        (Effect.FRICTION_WEAR, 1e-3),
        (Effect.STIFFNESS_WEAR, 1e-3),
    ],
)
def test_columns_are_derivatives_of_the_exact_effect(effect: Effect, size: float) -> None:
    rig, fit = fitted(separate=effect in (Effect.FORCE_ZERO, Effect.DISPLACEMENT_ZERO))
    columns = rig.columns(effect, fit, rig.loops)
    back = 0.0 if effect is Effect.PLAY else -1.0  # there is no negative play
    for k, column in enumerate(columns.T):
        sizes = np.zeros(columns.shape[1])
        sizes[k] = size
        ahead, behind = (rig.predicted({effect: side * sizes}, fit)[1] for side in (1.0, back))
        difference = (ahead - behind) / ((1.0 - back) * size)
        # A delay moves the first points after a reversal to the stroke before, and the velocity of the column is the
        # difference over seven samples of a sine of 200; the others are exact to the step.
        apart = np.abs(difference - column) / np.abs(column).max()
        assert np.median(apart) < (2e-3 if effect is Effect.DELAY else 1e-4)
        assert np.mean(apart > 0.05) < 0.03


def times_that(record: Record, how: str) -> Record:
    time = record.time
    assert time is not None
    changed = {
        "fall": time[::-1],
        "stand still": np.zeros(time.size),
        "repeat": np.repeat(time[::2], 2)[: time.size],
        "jump back": np.where(np.arange(time.size) > time.size // 2, time - 1.0, time),
    }
    return replace(record, time=changed[how])


def test_times_that_do_not_rise_count_as_none() -> None:
    (record,) = case_of("force lags", 0.003, replace(STEPPED, samples=400)).records
    untimed = identify(replace(record, time=None))
    for how in ("fall", "stand still", "repeat", "jump back"):
        assert same_spring(identify(times_that(record, how)), untimed), how


def same_spring(one: Identification, other: Identification) -> bool:
    return one.parameters == other.parameters and one.effects == other.effects
