"""Faults of records and rigs: refused or named by what they are, taken out as far as known, and else not invented."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig import (
    Case,
    Experiment,
    amplitude_of,
    at_frequencies,
    draw_experiment,
    draw_spring,
    drawn_case,
    elastic_force,
    judge_case,
    simulate,
)  # fmt: skip
from rig_faults import FAULTS, gapped, humming, lagging, less_friction, moving_mass, rubber, wearing
from strandspring import (
    Finding,
    Identification,
    IdentificationError,
    Outcome,
    Record,
    RecordError,
    RefinedOptions,
    Spring,
    SpringParameters,
    TwoStageOptions,
    bundled_record,
    identify,
    read_record,
    select,
)  # fmt: skip
from strandspring.errors import Reader
from strandspring.findings import words
from strandspring.identification.samples import Samples
from synthetic import AMPLITUDE, MEAN, drawn_own_record, record_of, sine, spring_of

pytestmark = pytest.mark.long

PHASE = np.linspace(0.0, 6.0 * np.pi, 1500)
SIDE, PLACE = np.sign(np.gradient(sine())), (sine() - MEAN) / AMPLITUDE
DATA = Path(__file__).resolve().parents[1] / "data"
Given = Record | Sequence[Record] | Callable[[], Record | Sequence[Record]]
# Lean classes, which are quick, and what their springs earn; the second one where the first finds none.
LEAN = (TwoStageOptions((1, 0)), RefinedOptions((1, 0), mechanisms=1, branches=0))
OF_LEAN = {
    Outcome.LOOP_ENERGY, Outcome.POOR_FIT, Outcome.SIGMA_AT_BOUND, Outcome.N_AT_BOUND, Outcome.NO_STEADY_SECTION,
    Outcome.LACK_OF_FIT, Outcome.SMALL_LOOPS, Outcome.SPRING_ALONE, Outcome.FORCE_ZERO,
}  # fmt: skip


@cache
def own(noise: float = 0.0) -> Record:
    """Three cycles of one amplitude of a spring."""
    return record_of(spring_of(1.0, 1.0), sine(), noise)


def said(given: Given) -> dict[Outcome, Finding]:
    """Findings of records without those of the spring."""
    records = given() if callable(given) else given
    try:
        found = identify(records, options=LEAN[0], save_anyway=True)
    except IdentificationError as refusal:
        if refusal.outcome not in (Outcome.NO_STEADY_SECTION, Outcome.UNCERTIFIED):
            raise
        found = identify(records, options=LEAN[1], save_anyway=True)
    return {finding.kind: finding for finding in found.findings if finding.kind not in OF_LEAN}


def named(given: Given) -> dict[Outcome, str]:
    """What is said of records, in words."""
    try:
        return {kind: words(finding, Reader.PYTHON) for kind, finding in said(given).items()}
    except IdentificationError as refusal:
        return {refusal.outcome: str(refusal)}


# -- records


def changed(force: Callable[[np.ndarray], np.ndarray], noise: float = 0.0) -> Record:
    return replace(own(noise), force=force(own(noise).force), path="r.csv")


def spike(size: float) -> Record:
    return changed(lambda r: np.where(np.arange(1500) == 700, size, r), 0.01)


def chatter() -> Record:
    path, friction = np.sin(2.0 * np.pi * np.arange(1601) / 400), np.zeros(1601)
    for k in range(1, path.size):
        moved = friction[k - 1] + 12.0 * (path[k] - path[k - 1])
        friction[k] = moved if abs(moved) <= 1.0 else 0.05 * np.sign(moved)
    return Record(0.01 * path, friction + 0.1 * path)


def turning(samples: float, shape: str = "sine") -> Record:
    phase = 2.0 * np.pi * np.arange(int(8 * samples)) / samples + 0.3
    unit = np.sin(phase) if shape == "sine" else 2.0 / np.pi * np.arcsin(np.sin(phase))
    return record_of(spring_of(1.5, 2.0), MEAN + AMPLITUDE * unit)


def at(frequencies: tuple[float, ...], fault: Any, seed: int = 41) -> Callable[[], tuple[Record, ...]]:
    return lambda: at_frequencies(np.random.default_rng([seed, 4]), frequencies, fault)[1]


def pair(index: int, smaller: float, column: str = "force", factor: float = 1.0) -> tuple[Record, Record]:
    """Two records of a drawn spring, with zeros of their own, the second of another amplitude and unit."""
    generator = np.random.default_rng([29, index])
    experiment = Experiment(shape="sine", amplitudes=(1.0, smaller), cycles=(3, 3), separate=True, samples=1200)
    first, second = simulate(draw_spring(generator), experiment, generator).records
    moved = replace(second, displacement=second.displacement + 0.001, force=second.force - 0.2 * np.ptp(first.force))
    return first, replace(moved, **{column: factor * getattr(moved, column)})


def halves(name: str, factor: float = 1.0) -> list[Record]:
    """Both halves of a measured record, the second with another unit of the force."""
    circle = DATA / "actuator/circle_3bar.csv"
    files: dict[str, tuple[Path, Any]] = {
        "hinge": (bundled_record(), {"reverse": "displacement"}), "actuator": (circle, {"displacement": 5, "force": 7}),
    }  # fmt: skip
    whole = read_record(files[name][0], **files[name][1])
    parts = np.array_split(np.arange(len(whole)), 2)
    return [Record(whole.displacement[p], factor**k * whole.force[p], path=f"{k}.csv") for k, p in enumerate(parts)]


# -- records of which something is said

ONE, THREE = (0.5, 0.5, 0.5), (0.2, 0.7, 2.0)


def faulty() -> list[tuple[str, str, Given]]:
    """Outcome, part of the detail or the refusal, and the record."""
    kept, plastic = np.r_[0:400, 450:900, 960:1500], DATA / "hinge/plastic_compress.csv"
    apart = [record_of(spring_of(1.0, 1.0), centre + 0.004 * np.sin(PHASE), 0.003) for centre in (0.04, 0.06)]
    return [
        *(("UNDERSAMPLED", "12 times per cycle", Record(x, 2.0 * x)) for x in (
            np.tile([-1.0, -1 / 3, 1 / 3, 1.0, 1 / 3, -1 / 3], 4), np.tile([-1.0, 1.0], 20),
            np.random.default_rng(0).normal(size=100),
        )),
        *(("TOO_FEW_STROKES", "", Record(x, 2.0 * x)) for x in (np.ones(30), np.linspace(0, 1, 30), sine()[:100])),
        ("TOO_FEW_SAMPLES", "(6 samples, ", Record(x := np.array([0, 3.0, -2, 2, -3, 0, 3, -2]), x)),
        ("TOO_LITTLE_LEFT", "(700 of 700 samples)", Record(np.sin(PHASE[:700]), np.sign(np.cos(PHASE[:700])))),
        ("TOO_LITTLE_LEFT", "", replace(own(), compared=np.gradient(sine()) > 0.0)),
        ("FORCE_REVERSED", "r.csv: ", changed(lambda r: -r)),
        ("FORCE_REVERSED", "", replace(own(), displacement=-own().displacement)),
        ("FORCE_REVERSED", "", lambda: read_record(bundled_record())),
        ("COLUMNS_SWAPPED", "", Record(own().force, own().displacement)),
        *(("SNAP_THROUGH", "", lambda r=reverse: read_record(plastic, reverse=r)) for reverse in (None, "force")),
        ("STICK_SLIP", "", chatter),
        ("BRANCHES_CROSS", "", changed(lambda _: 3000.0 * sine() + SIDE * (10.0 + 20.0 * PLACE))),
        ("NO_LOOP", "", changed(lambda _: 1e3 * sine())),
        ("NO_LOOP", "", changed(lambda _: 1e3 * sine() + np.random.default_rng(0).standard_normal(1500))),
        ("SPIKES_DECIDE", " N in sample 701", spike(-1e25)), ("SPIKES_DECIDE", " N in sample 701", spike(1e5)),
        ("UNITS_DIFFER", "its force times 9.80665", lambda: halves("hinge", 1 / 9.80665)),
        *(("UNITS_DIFFER", f"its {column} times {1.0 / factor:.6g}", pair(k, 0.98, column, factor))
          for k, column, factor in ((1, "force", 1e3), (1, "force", 4.4482216), (2, "displacement", 25.4))),
        ("UNITS_DIFFER", "its displacement times 1000", pair(3, 0.4, "displacement", 1e-3)),
        ("SPIKES", "force 250 N in sample 701", spike(250.0)),
        ("CLIPPED", "45 of 1500 samples", changed(lambda r: r.clip(-np.inf, np.sort(r)[-45]), 0.01)),
        ("CLIPPED", "90 of 1500 samples", changed(lambda r: r.clip(np.sort(r)[44], np.sort(r)[-45]), 0.01)),
        ("DWELLS", "(by ", lambda: drawn_case(FAULTS["dwells"], 4, 0).records),
        ("GAPS", "3.99 to 4.5, 8.99 to 9.6 s", Record(own().displacement[kept], own().force[kept], 0.01 * kept)),
        ("BACKLASH", " N)", lambda: drawn_case(gapped(0.4), 82, 2, amplitudes=(1.0,), cycles=(3,)).records),
        ("BACKLASH", " mm)", lambda: drawn_case(FAULTS["play"], 83, 0).records),
        *(("DISPLACEMENT_NOISE", "", lambda f=fault: drawn_case(FAULTS[f], 5, 1).records) for fault in (
            "displacement noise", "displacement steps")),
        *(("TURNS_BETWEEN_SAMPLES", f"{n} samples per cycle", turning(n + 0.3)) for n in (10, 24)),
        ("TURNS_BETWEEN_SAMPLES", "", turning(17.3, "triangle")),
        ("TURNS_BETWEEN_SAMPLES", "500 samples", Record(np.sin(PHASE), np.sin(PHASE) + 20.0 * np.sign(np.cos(PHASE)))),
        ("FIRST_CYCLE_DIFFERS", "", lambda: read_record(bundled_record(), reverse="displacement")),
        ("FRICTION_WEAR", "% per cycle", at(ONE, wearing(0.3, 3), 7)),
        ("STIFFNESS_WEAR", "stiffness -", at(ONE, wearing(0.15, 3, True))),
        *(("RECORDS_DIFFER", "record_3.csv: The loops", at(f, less_friction(0.15, 2))) for f in (ONE, THREE)),
        ("RATE_DEPENDENT", "at 2 Hz against 0.2 Hz", at(THREE, rubber(0.05))),
        ("INERTIA", " kg, ", at(THREE, moving_mass(0.1, 2.0))), ("RANGE_WITH_GAPS", "44 to 56 mm", apart),
    ]  # fmt: skip


def test_each_fault_is_named() -> None:
    said_of = [(name, part, named(given).get(Outcome[name], "not named")) for name, part, given in faulty()]
    assert [(name, part, found) for name, part, found in said_of if part not in found] == []


def good() -> Iterator[tuple[str, Given]]:
    """Records of which nothing is said but that they have one amplitude."""
    for samples in (300, 60_000):
        yield "dense or not", record_of(spring_of(1.0, 1.0), sine(3, samples), noise=0.01)
    yield "dry friction", Record(0.004 * np.sin(PHASE), np.sin(PHASE) + 0.05 * np.sign(np.cos(PHASE)))
    yield "coarse force", changed(lambda r: np.round(r / 2.0) * 2.0, 0.01)
    yield "both negated", Record(-own(0.01).displacement, -own(0.01).force)
    yield "crossed a little", changed(lambda _: 3000.0 * sine() + 10.0 * SIDE * (1.0 - 1.06 * PLACE))
    yield "irregular times", replace(own(), time=np.cumsum(np.random.default_rng(0).exponential(0.01, 1500)))
    yield "at samples", record_of(spring_of(1.0, 1.0), MEAN + AMPLITUDE * np.sin(np.pi / 20.0 * np.arange(161)))
    yield "samples twice", replace(own(), displacement=np.repeat(sine(3, 750), 2), force=np.repeat(own().force[::2], 2))
    yield "steps at a small amplitude", lambda: drawn_own_record(83)
    yield "first loading", replace(own(0.01), displacement=sine(1, 500), force=own().force[:500])
    yield "halves of the actuator", lambda: halves("actuator")
    yield "hum", lambda: drawn_case(humming(9.0, 0.005), 51, 0).records
    yield from (("zeros and amplitudes", pair(5, smaller)) for smaller in (0.95, 0.3, 0.15))
    for frequencies in (ONE, THREE):
        yield from (("alike", at(frequencies, less_friction(0.0, 2))), ("lag", at(frequencies, lagging(0.002))))


def test_nothing_is_said_without_a_fault() -> None:
    said_of = [(name, set(named(given)) - {Outcome.ONE_AMPLITUDE}) for name, given in good()]
    assert [(name, found) for name, found in said_of if found] == []


def test_sizes_of_what_changes_are_true() -> None:
    def sizes(frequencies: tuple[float, ...], fault: Any) -> dict[Outcome, float]:
        records = at_frequencies(np.random.default_rng([41, 3]), frequencies, fault)[1]
        return {kind: next(iter(finding.numbers.values())) for kind, finding in said(records).items()}

    for frequencies in (ONE, THREE):
        changes = sizes(frequencies, less_friction(0.15, 2))
        assert changes == {Outcome.RECORDS_DIFFER: pytest.approx(-0.15, abs=0.03)}
    # Of 27 cycles; the first is whole, and a change per cycle is of the mean.
    assert 27.0 * sizes(ONE, wearing(0.3, 3))[Outcome.FRICTION_WEAR] == pytest.approx(-0.3 / 0.85, rel=0.15)
    spring, records = at_frequencies(np.random.default_rng([42, 3]), THREE, moving_mass(0.1, 2.0))
    (found,) = said(records).values()
    mass = 0.1 * elastic_force(spring) / amplitude_of(spring) / (2.0 * np.pi * 2.0) ** 2
    assert (found.kind, found.numbers["mass"]) == (Outcome.INERTIA, pytest.approx(mass, rel=0.08))


def test_samples_that_do_not_tell_of_the_spring_leave_it_as_it_is() -> None:
    """Clipped ones, those beside the range that was selected, and outliers of a robust fit."""
    plain = RefinedOptions((3, 2))
    expected = Spring(identify(own(0.01), plain).parameters).response(sine())
    clipped = changed(lambda r: r.clip(-np.inf, np.sort(r)[-45]), 0.01)
    selected = replace(own(0.01), compared=sine() > 0.04, force=np.where(sine() > 0.035, own(0.01).force, 0.0))
    spoiled = changed(lambda r: r + 60.0 * (np.arange(1500) % 40 == 0), 0.01)
    for record, robust, compared in ((clipped, False, 0.0), (selected, False, 0.04), (spoiled, True, 0.0)):
        force = Spring(identify(record, replace(plain, robust=robust)).parameters).response(sine())
        # Noise of 1 % of up to 100 N over 1 000 samples.
        assert np.abs(force - expected)[sine() > compared].max() < 0.4


@pytest.mark.parametrize(
    ("corners", "path", "tolerance"),
    [
        (False, lambda turns: np.sin(2.0 * np.pi * turns), 3e-4),  # fourth order of a sine beside its parabola
        (True, lambda turns: 1.0 - 4.0 * np.abs(turns % 1.0 - 0.5), 1e-12),
    ],
)
def test_reversals_between_samples_are_restored(corners: bool, path: Callable[[Any], Any], tolerance: float) -> None:
    x = 0.01 * path((np.arange(200) + 0.37) / 20.0)
    samples = Samples.of([Record(x, 1e4 * x)], x.size).restored(corners)
    assert np.abs(samples.displacement[samples.strokes])[1:-1] == pytest.approx(0.01, rel=tolerance)


def test_each_of_six_strokes_is_held_out_once_alone() -> None:
    x = 0.01 * np.sin(2.0 * np.pi * np.linspace(0.0, 2.75, 500))
    samples = Samples.of([Record(x, 1e4 * x)], x.size)
    held = [np.unique(samples.stroke_of_row[fold]).tolist() for fold in samples.folds]
    assert [strokes for strokes in held if len(strokes) == 1] == [[k] for k in range(6)]


def test_what_a_fixture_would_change_is_its_share_of_the_stiffness() -> None:
    spring = SpringParameters((0.0, 1e6), (1.0,), 20.0, 5e3, 1.0, 1.0, 0.0, -2e-3, 2e-3)
    stiff = identify(record_of(spring, 0.05 * (sine() - MEAN)), method="two-stage")
    assert [note for note in stiff.notes if "10 kN/mm would change the stiffness by 10 %" in note]


def test_units_change_nothing_else_and_sizes_that_no_rig_measures_are_noted_or_refused() -> None:
    plain = RefinedOptions((3, 2), mechanisms=1, branches=0)
    usual = identify(own(), plain).parameters
    for scale in (1e-6, 1e3):
        found = identify(Record(scale * own().displacement, scale**2 * own().force), plain)
        p = found.parameters
        # Sums are rounded otherwise.
        same = scale * p.rho, p.sigma, p.n, scale**-2 * p.kappa_omega
        assert same == pytest.approx((usual.rho, usual.sigma, usual.n, usual.kappa_omega), rel=1e-4)
        assert any("check the units" in note or "usual are" in note for note in found.notes)
    for length, force in ((1e-14, 1.0), (1.0, 1e20)):
        with pytest.raises(IdentificationError) as refused:
            identify(Record(length * own().displacement, force * own().force), RefinedOptions(degrees=(1, 0)))
        assert refused.value.outcome is Outcome.BEYOND_LIMITS


# -- what the rig adds

STEPPED = Experiment(amplitudes=(0.4, 0.7, 1.0), cycles=(3, 3, 3), noise=0.002)


def case_of(fault: str, share: float, experiment: Experiment = STEPPED, seed: int = 1) -> Case:
    """Records of a spring with high loops."""
    generator = np.random.default_rng(seed)
    spring = draw_spring(generator, (0.5, 3.0), (0.6, 3.0), (6.0, 20.0), (0.2, 0.4), degrees=(3, 1))
    return simulate(spring, experiment, generator, replace(FAULTS[fault], large=share), "large")


def drawn(fault: str, seed: int, index: int) -> Case:
    """A case of `honesty.py sizes`."""
    generator = np.random.default_rng([seed, zlib.crc32(fault.encode()), index])
    return simulate(draw_spring(generator), draw_experiment(generator), generator, FAULTS[fault], "drawn")


def lag(case: Case, fault: str = "force lags") -> float:
    return (-1.0 if fault == "force leads" else 1.0) * case.magnitude * case.experiment.period


def is_wrong(case: Case, found: Identification) -> bool:
    return judge_case(case, Spring(found.parameters)).wrong


SHIFTS = np.array([0.0, 1.0, -0.7]) - 0.1  # of the zeros of three records, from their mean
SIZES: dict[str, tuple[float, str, Callable[[Case], Any], Outcome]] = {
    "force lags": (0.003, "delay", lag, Outcome.DELAY),
    "force leads": (0.01, "delay", lambda c: lag(c, "force leads"), Outcome.DELAY),
    "force zero": (0.05, "force_zero", lambda c: c.magnitude * elastic_force(c.spring) * SHIFTS, Outcome.FORCE_ZERO),
    "linear drift": (0.1, "drift", lambda c: c.magnitude * elastic_force(c.spring), Outcome.DRIFT_REMOVED),
}


@pytest.mark.parametrize("fault", SIZES)
def test_the_size_of_an_effect_is_found_and_it_is_no_part_of_the_spring(fault: str) -> None:
    share, name, truth, outcome = SIZES[fault]
    case = case_of(fault, share)
    # Arrays are all called the same: of three zeros two were lost.
    found = identify([replace(record, path="<arrays>") for record in case.records])
    assert set(found.effects) == {name}
    size = found.effects[name]
    size = list(size.values()) if isinstance(size, dict) else size
    # A twentieth, or of a delay 0.3 ms: the noise of 0.2 % leaves a tenth of that.
    largest = float(np.abs(truth(case)).max())
    assert size == pytest.approx(truth(case), abs=max(0.05 * largest, min(3e-4 * (name == "delay"), 0.1 * largest)))
    assert outcome in found.outcomes
    assert not is_wrong(case, found)
    # What is left is noise.
    assert found.fitted_figures["rmse"] < 0.003 * case.deviation < found.rmse


@pytest.mark.parametrize(
    ("fault", "size", "named_as"),
    [
        ("displacement zero", 0.1, Outcome.FORCE_ZERO),  # which looks much like it
        ("warm-up", 0.1, Outcome.LACK_OF_FIT), ("play", 0.02, Outcome.BACKLASH),
        ("wear of stiffness", 0.1, Outcome.STIFFNESS_WEAR),
    ],
)  # fmt: skip
def test_what_no_removal_explains_is_named_and_not_removed_as_something_else(
    fault: str, size: float, named_as: Outcome
) -> None:
    found = identify(case_of(fault, size).records)
    assert named_as in found.outcomes
    assert set(found.effects) <= {"force_zero"}


def test_a_lag_that_turns_the_loop_round_is_measured_found_or_given() -> None:
    generator = np.random.default_rng(2)
    spring = draw_spring(generator, (0.8, 1.5), (0.8, 1.5), (8.0, 12.0), (0.02, 0.021), degrees=(2, 1))
    experiment = Experiment(shape="sine", amplitudes=(0.5, 1.0), cycles=(3, 3), noise=0.001)
    case = simulate(spring, experiment, generator, replace(FAULTS["force lags"], large=0.01), "large")
    with pytest.raises(IdentificationError, match="if the force lags, then by more than") as refused:
        identify(case.records, RefinedOptions(delay=0.0))
    least = refused.value.findings[0].numbers["lag"]
    assert 0.3 * lag(case) < least < lag(case)
    assert identify(case.records).effects["delay"] == pytest.approx(lag(case), rel=0.01)
    assert not is_wrong(case, identify(case.records, RefinedOptions(delay=lag(case))))
    # Without times no delay can be sought, and none explains swapped columns.
    swapped = [Record(r.force, r.displacement, r.time, r.path) for r in drawn("force lags", 0, 2).records]
    for records in ([replace(record, time=None) for record in case.records], swapped):
        with pytest.raises(IdentificationError) as refused:
            identify(records)
        assert refused.value.outcome is Outcome.COLUMNS_SWAPPED


@pytest.mark.parametrize("count", [3, pytest.param(40, marks=pytest.mark.slow)])
def test_clean_records_have_no_effects(count: int) -> None:
    for seed in range(count):
        generator = np.random.default_rng([0, seed])
        found = identify(simulate(draw_spring(generator), draw_experiment(generator), generator).records)
        assert found.effects == {}, seed
        assert set(found.outcomes) <= {Outcome.ONE_AMPLITUDE, Outcome.SMALL_LOOPS, Outcome.N_AT_BOUND}, seed


# The acceleration where the amplitude changes is known to a quarter of a tenth of the force; noise is 0.2 %.
@pytest.mark.parametrize(
    ("fault", "size", "left"),
    [("moving mass", 0.1, 0.03), ("fixture compliance", 0.15, 0.005), ("force lags", 0.06, 0.005)],
)
def test_what_is_known_comes_out(fault: str, size: float, left: float) -> None:
    case = case_of(fault, size, replace(STEPPED, shape="sine"), seed=3)
    options = case.options or {"delay": lag(case)}
    found = identify(case.records, RefinedOptions(**options))  # type: ignore[arg-type]
    assert not is_wrong(case, found)
    assert found.effects.items() >= options.items()
    assert found.spring().model.fit["effects"].items() >= options.items()
    # The prediction is of what was measured, and what was given is not in the spring.
    assert found.fits[0].rms_force == pytest.approx(np.sqrt(np.mean(found.records[0].force ** 2)), rel=0.05)
    assert found.fitted_figures["rmse"] < min(left * np.std(case.records[0].force), 0.7 * found.rmse)


def test_times_are_needed_and_those_that_do_not_rise_count_as_none() -> None:
    (record,) = case_of("moving mass", 0.1, replace(STEPPED, samples=400)).records
    wrong = (None, record.time[::-1], np.floor(np.arange(len(record)) / 4.0))
    for options, name in (({"moving_mass": 1.0}, "moving_mass"), ({"delay": 1e-3}, "delay"), ({"branches": 1}, "time")):
        for time in wrong:
            with pytest.raises(RecordError, match="time") as refused:
                identify(replace(record, time=time), RefinedOptions(**options))  # type: ignore[arg-type]
            assert name in str(refused.value)
    with pytest.raises(RecordError, match="longer than a stroke"):
        identify(record, RefinedOptions(delay=50.0))
    untimed, *others = (identify(replace(record, time=time)) for time in wrong)
    for found in others:
        assert (found.parameters, found.effects) == (untimed.parameters, untimed.effects)
        assert any("The time does not rise from sample to sample" in note for note in found.notes)


# -- several records


def test_the_same_samples_twice_are_refused() -> None:
    with pytest.raises(RecordError, match=r"copy\.csv: holds the same samples as synthetic\.csv"):
        identify([own(), replace(own(), path="copy.csv")])
    with pytest.raises(RecordError, match="select parts that do not overlap"):
        identify([select(own(), displacement=ends) for ends in ((None, MEAN), (MEAN - 0.005, None))])
    # A run at another frequency is another measurement, even of a spring that repeats exactly.
    identify([replace(own(), time=rate * np.arange(1500.0)) for rate in (1.0, 2.0)], RefinedOptions((3, 2)))


@pytest.mark.parametrize(("state", "share"), [("first", 0.89), ("mean", 0.743), ("last", 0.60)])
def test_a_state_is_that_of_its_cycles(state: Any, share: float) -> None:
    """Friction that falls to a half over nine cycles: to the fourth, all of them, or from the sixth."""
    known, path = spring_of(1.0, 1.0), sine(9, 3601)
    elastic = Spring(replace(known, kappa_omega=1e-12)).response(path)
    force = elastic + np.linspace(1.0, 0.5, path.size) * (Spring(known).response(path) - elastic)
    found = identify(Record(path, force), RefinedOptions(state=state))
    assert found.parameters.kappa_omega / known.kappa_omega == pytest.approx(share, abs=0.02)
    assert Outcome.FRICTION_WEAR in found.outcomes


def test_a_spring_that_is_worse_than_a_line_is_refused_unless_asked_for() -> None:
    """A sensor that drifts by three times its range: only what was removed follows the record."""
    good = record_of(spring_of(1.0, 1.0), sine(6), noise=0.01)
    drifting = replace(good, force=good.force + np.linspace(0.0, 3.0 * np.ptp(good.force), len(good)))
    first = RefinedOptions((3, 2), state="first")
    with pytest.raises(IdentificationError) as refused:
        identify(drifting, first)
    assert refused.value.outcome is Outcome.WORSE_THAN_LINE
    assert Outcome.WORSE_THAN_LINE in identify(drifting, first, save_anyway=True).outcomes
