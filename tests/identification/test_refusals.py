"""Faults of records and hard numbers are refused or named by what they are, and nothing else is."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from rig import Experiment, amplitude_of, draw_spring, elastic_force, simulate
from rig_causes import at_frequencies, drawn_case, gapped, humming, lagging, less_friction, moving_mass, rubber, wearing
from rig_faults import FAULTS
from strandspring import (
    Finding,
    IdentificationError,
    Outcome,
    Record,
    RecordError,
    RefinedOptions,
    Spring,
    TwoStageOptions,
    bundled_record,
    identify,
    read_record,
)
from synthetic import AMPLITUDE, MEAN, drawn_own_record, record_of, sine, spring_of

pytestmark = pytest.mark.long

OWN = record_of(spring_of(1.0, 1.0), sine())
NOISY = record_of(spring_of(1.0, 1.0), sine(), noise=0.01)
PHASE = np.linspace(0.0, 6.0 * np.pi, 1500)
SIDE, PLACE = np.sign(np.gradient(sine())), (sine() - MEAN) / AMPLITUDE
Given = Record | Sequence[Record] | Callable[[], Record | Sequence[Record]]
# Lean classes, which are quick, and what their springs earn; the second one where the first finds none.
LEAN = (TwoStageOptions((1, 0)), RefinedOptions((1, 0), mechanisms=1, branches=0))
OF_LEAN = {
    Outcome.LOOP_ENERGY, Outcome.POOR_FIT, Outcome.SIGMA_AT_BOUND, Outcome.N_AT_BOUND, Outcome.NO_STEADY_SECTION,
    Outcome.LACK_OF_FIT, Outcome.SMALL_LOOPS, Outcome.SPRING_ALONE, Outcome.FORCE_ZERO,
}  # fmt: skip


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
    """What is said of records, with the detail; of a refusal its whole sentence."""
    try:
        return {kind: finding.detail for kind, finding in said(given).items()}
    except IdentificationError as refusal:
        return {refusal.outcome: str(refusal)}


def triangle(samples: int) -> np.ndarray:
    return MEAN + AMPLITUDE * np.interp(np.linspace(0, 3, samples) % 1, [0, 0.25, 0.75, 1], [0.0, 1.0, -1.0, 0.0])


def changed(force: Callable[[np.ndarray], np.ndarray], record: Record = OWN) -> Record:
    return replace(record, force=force(record.force), path="r.csv")


def chatter() -> Record:
    path, friction = np.sin(2.0 * np.pi * np.arange(1601) / 400), np.zeros(1601)
    for k in range(1, path.size):
        moved = friction[k - 1] + 12.0 * (path[k] - path[k - 1])
        friction[k] = moved if abs(moved) <= 1.0 else 0.05 * np.sign(moved)
    return Record(0.01 * path, friction + 0.1 * path)


def rested(relaxation: float, dense: int = 1) -> Record:
    """Rests at two reversals of a triangle, in which the force relaxes by so many N."""
    record = record_of(spring_of(1.0, 1.0), triangle(600 * dense + 1), noise=0.002)
    pause, repeats = 80 * dense, np.ones(len(record), dtype=int)
    repeats[[250 * dense, 350 * dense]] += pause
    force = np.repeat(record.force, repeats)
    for k, begin in enumerate((250 * dense, 350 * dense + pause)):
        force[begin : begin + pause + 1] += (2 * k - 1) * relaxation * np.linspace(0.0, 1.0, pause + 1)
    return Record(np.repeat(record.displacement, repeats), force)


def with_rests_outside() -> Record:
    path = np.concatenate([np.full(250, MEAN), sine(), np.full(190, MEAN)])
    ramp = np.sin(0.5 * np.pi * np.clip((np.arange(path.size) - 250) / 500, 0.0, 1.0)) ** 4
    return record_of(spring_of(1.0, 1.0), np.round((MEAN + ramp * (path - MEAN)) / 1e-6) * 1e-6, noise=0.01)


def turning(samples: float, shape: str = "sine") -> Record:
    phase = 2.0 * np.pi * np.arange(int(8 * samples)) / samples + 0.3
    unit = np.sin(phase) if shape == "sine" else 2.0 / np.pi * np.arcsin(np.sin(phase))
    return record_of(spring_of(1.5, 2.0), MEAN + AMPLITUDE * unit)


def at(frequencies: tuple[float, ...], fault: object, seed: int = 41) -> Callable[[], tuple[Record, ...]]:
    return lambda: at_frequencies(np.random.default_rng([seed, 4]), frequencies, fault, (0.4, 0.7, 1.0))[1]


def beating(seed: int) -> Record:
    """A spring that softens in a beat, whose force was called crossed or backwards."""
    draw = np.random.default_rng([184, seed])
    spring = draw_spring(draw, friction=(0.03, 0.3))
    ratio, duration, share = draw.uniform(0.7, 0.97), draw.uniform(2, 25), draw.uniform(0.2, 0.8)
    time = np.arange(0.0, duration, 0.01)
    phases = [draw.uniform(0, 6) for _ in range(2)]
    beat = share * np.sin(2.0 * np.pi * time + phases[0])
    beat += (1.0 - share) * np.sin(2.0 * np.pi * ratio * time + phases[1])
    record = record_of(spring, spring.displacement_offset + amplitude_of(spring) * beat)
    noise = 0.005 * np.std(record.force) * draw.standard_normal(time.size)
    return replace(record, force=record.force * (1.0 - 0.4 * time / duration) + noise, time=time)


def pair(index: int, smaller: float, column: str = "force", factor: float = 1.0) -> tuple[Record, Record]:
    """Two records of a drawn spring, with zeros of their own, the second of another amplitude and unit."""
    generator = np.random.default_rng([29, index])
    experiment = Experiment(shape="sine", amplitudes=(1.0, smaller), cycles=(3, 3), separate=True, samples=1200)
    first, second = simulate(draw_spring(generator), experiment, generator).records
    moved = replace(second, displacement=second.displacement + 0.001, force=second.force - 0.2 * np.ptp(first.force))
    return first, replace(moved, **{column: factor * getattr(moved, column)})


def halves(name: str, factor: float = 1.0) -> list[Record]:
    """Both halves of a measured record, the second with another unit of the force."""
    hinge = name == "hinge"
    whole = read_record(bundled_record(), reverse="displacement") if hinge else read_record(CIRCLE, **COLUMNS)
    parts = np.array_split(np.arange(len(whole)), 2)
    return [Record(whole.displacement[p], factor**k * whole.force[p], path=f"{k}.csv") for k, p in enumerate(parts)]


DATA = Path(__file__).resolve().parents[1] / "data"
CIRCLE, COLUMNS = DATA / "actuator/circle_3bar.csv", {"displacement": 5, "force": 7}
THREE_UNITS = [
    replace(record_of(spring_of(1.0, 1.0), 0.99**k * (sine() - MEAN) + MEAN, 0.01), path=f"{k}.csv") for k in range(3)
]
THREE_UNITS[1] = replace(THREE_UNITS[1], force=4.4482216 * THREE_UNITS[1].force)
ONE, THREE = (0.5, 0.5, 0.5), (0.2, 0.7, 2.0)
KEPT = np.r_[0:400, 450:900, 960:1500]
APART = [record_of(spring_of(1.0, 1.0), centre + 0.004 * np.sin(PHASE), 0.003) for centre in (0.04, 0.06)]
PLASTIC = DATA / "hinge/plastic_compress.csv"
FAULTY: list[tuple[str, str, Given]] = [
    *(("UNDERSAMPLED", "12 times per cycle", Record(x, 2.0 * x)) for x in (
        np.tile([-1.0, -1 / 3, 1 / 3, 1.0, 1 / 3, -1 / 3], 4), np.tile([-1.0, 1.0], 20),
        np.tile([-1.0, -1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0], 2), np.random.default_rng(0).normal(size=100),
    )),
    *(("TOO_FEW_STROKES", "", Record(x, 2.0 * x)) for x in (np.ones(30), np.linspace(0, 1, 30), sine()[:100])),
    ("TOO_FEW_STROKES", "", Record(-sine()[:60], OWN.force[:60])),
    ("TOO_FEW_SAMPLES", "Found 6 samples", Record(x := np.array([0, 3.0, -2, 2, -3, 0, 3, -2]), x)),
    ("TOO_LITTLE_LEFT", "(<arrays>: 700 samples)", Record(np.sin(PHASE[:700]), np.sign(np.cos(PHASE[:700])))),
    ("TOO_LITTLE_LEFT", "", replace(OWN, compared=np.gradient(sine()) > 0.0)),
    ("FORCE_REVERSED", "r.csv: ", changed(lambda r: -r)),
    ("FORCE_REVERSED", "", replace(OWN, displacement=-OWN.displacement)),
    ("FORCE_REVERSED", "", replace(OWN, displacement=-OWN.displacement, compared=np.abs(SIDE * PLACE) < 0.02)),
    ("FORCE_REVERSED", "", lambda: read_record(bundled_record())),
    ("COLUMNS_SWAPPED", "", Record(OWN.force, OWN.displacement)),
    *(("SNAP_THROUGH", "", read_record(PLASTIC, reverse=reverse)) for reverse in (None, "displacement", "force")),
    ("STICK_SLIP", "", chatter),
    ("BRANCHES_CROSS", "", changed(lambda _: 3000.0 * sine() + SIDE * (10.0 + 20.0 * PLACE))),
    ("NO_LOOP", "", changed(lambda _: 1e3 * sine())),
    ("NO_LOOP", "", changed(lambda _: 1e3 * sine() + np.random.default_rng(0).standard_normal(1500))),
    ("SPIKES_DECIDE", "sample 701 (force", changed(lambda r: np.where(np.arange(1500) == 700, -1e25, r), NOISY)),
    ("SPIKES_DECIDE", "sample 701 (force", changed(lambda r: np.where(np.arange(1500) == 700, 1e5, r), NOISY)),
    ("UNITS_DIFFER", "Its force times 9.80665", lambda: halves("hinge", 1 / 9.80665)),
    ("UNITS_DIFFER", "1.csv: ", THREE_UNITS),
    *(("UNITS_DIFFER", f"Its {column} times {1.0 / factor:.6g}", pair(k, 0.98, column, factor)) for k in (1, 2)
      for column, factor in (("force", 1e3), ("force", 1 / 9.80665), ("force", 4.4482216), ("displacement", 25.4))),
    ("UNITS_DIFFER", "Its displacement times 1000", pair(3, 0.4, "displacement", 1e-3)),
    ("SPIKES", "sample 701 (force 250 N)", changed(lambda r: np.where(np.arange(1500) == 700, 250.0, r), NOISY)),
    ("CLIPPED", "45 of 1500 samples", changed(lambda r: r.clip(-np.inf, np.sort(r)[-45]), NOISY)),
    ("CLIPPED", "90 of 1500 samples", changed(lambda r: r.clip(np.sort(r)[44], np.sort(r)[-45]), NOISY)),
    ("DWELLS", "by ", rested(3.0)), ("DWELLS", "by ", rested(3.0, 30)),
    ("GAPS", "3.99 to 4.5 s; 8.99 to 9.6 s", Record(OWN.displacement[KEPT], OWN.force[KEPT], 0.01 * KEPT)),
    ("BACKLASH", " N", lambda: drawn_case(gapped(0.4), 82, 2, amplitudes=(1.0,), cycles=(3,)).records),
    ("BACKLASH", "after each reversal", lambda: drawn_case(FAULTS["play"], 83, 0).records),
    ("DISPLACEMENT_NOISE", "", lambda: drawn_case(FAULTS["displacement noise"], 5, 1).records),
    ("DISPLACEMENT_NOISE", "", lambda: drawn_case(FAULTS["displacement steps"], 5, 1).records),
    *(("TURNS_BETWEEN_SAMPLES", f"{n} samples per cycle", turning(n + 0.3)) for n in (10, 20, 24)),
    ("TURNS_BETWEEN_SAMPLES", "", turning(17.3, "triangle")),
    ("TURNS_BETWEEN_SAMPLES", "500 samples", Record(np.sin(PHASE), np.sin(PHASE) + 20.0 * np.sign(np.cos(PHASE)))),
    ("FIRST_CYCLE_DIFFERS", "", lambda: read_record(bundled_record(), reverse="displacement")),
    ("FRICTION_WEAR", "% per cycle", at(ONE, wearing(0.3, 3), 7)),
    ("STIFFNESS_WEAR", "stiffness -", at(ONE, wearing(0.15, 3, True))),
    *(("RECORDS_DIFFER", "in record_3.csv -1", at(f, less_friction(0.15, 2))) for f in (ONE, THREE)),
    ("RATE_DEPENDENT", "at 2 Hz against 0.2 Hz", at(THREE, rubber(0.05))),
    ("INERTIA", " kg, ", at(THREE, moving_mass(0.1, 2.0))),
    ("RANGE_WITH_GAPS", "44 to 56 mm", APART),
]  # fmt: skip


@pytest.mark.parametrize(("name", "words", "given"), FAULTY)
def test_a_fault_is_named(name: str, words: str, given: Given) -> None:
    assert words in named(given).get(Outcome[name], "not named")


def good() -> Iterator[tuple[str, Given]]:
    """Records of which nothing is said but that they have one amplitude."""
    for samples in (300, 1500, 60_000):
        yield "dense or not", record_of(spring_of(1.0, 1.0), sine(3, samples), noise=0.01)
        yield "triangle", record_of(spring_of(1.0, 1.0), triangle(samples), noise=0.01)
    yield "dry friction", Record(0.004 * np.sin(PHASE), np.sin(PHASE) + 0.05 * np.sign(np.cos(PHASE)))
    yield "coarse force", changed(lambda r: np.round(r / 2.0) * 2.0, NOISY)
    yield "both negated", Record(-NOISY.displacement, -NOISY.force)
    yield "crossed a little", changed(lambda _: 3000.0 * sine() + 10.0 * SIDE * (1.0 - 1.06 * PLACE))
    yield "rests without relaxation", rested(0.0)
    yield "rests before and after", with_rests_outside
    yield "irregular times", replace(OWN, time=np.cumsum(np.random.default_rng(0).exponential(0.01, 1500)))
    yield "at samples", record_of(spring_of(1.0, 1.0), MEAN + AMPLITUDE * np.sin(np.pi / 20.0 * np.arange(161)))
    yield "samples twice", replace(OWN, displacement=np.repeat(sine(3, 750), 2), force=np.repeat(OWN.force[::2], 2))
    yield "steps at a small amplitude", lambda: drawn_own_record(83)
    yield "first loading", replace(NOISY, displacement=sine(1, 500), force=OWN.force[:500])
    yield "halves of the actuator", halves("actuator")
    yield "hum", lambda: drawn_case(humming(9.0, 0.005), 51, 0).records
    yield from (("zeros and amplitudes", pair(5, smaller)) for smaller in (0.95, 0.6, 0.3, 0.15))
    for frequencies in (ONE, THREE):
        yield from (("alike", at(frequencies, less_friction(0.0, 2))), ("lag", at(frequencies, lagging(0.002))))


@pytest.mark.parametrize("given", [pytest.param(given, id=name) for name, given in good()])
def test_nothing_is_said_without_a_fault(given: Given) -> None:
    assert set(named(given)) <= {Outcome.ONE_AMPLITUDE}


def softening() -> Record:
    """A record without two cycles alike, by whose area the direction is judged."""
    time = np.linspace(0.0, 1.0, 4000)
    path = MEAN + AMPLITUDE * np.sin(60.0 * time) * np.cos(17.0 * time + 1.0)
    return changed(lambda r: r * (1.0 - 0.4 * time), record_of(spring_of(1.0, 1.0), path))


@pytest.mark.parametrize("given", [*(partial(beating, seed) for seed in (25, 67, 109)), softening])
def test_full_strokes_of_different_cycles_of_a_beat_need_not_meet(given: Callable[[], Record]) -> None:
    said(given)  # not refused
    turned = replace(given(), displacement=-given().displacement)
    assert set(named(turned)) == {Outcome.FORCE_REVERSED}


def sizes(frequencies: tuple[float, ...], fault: object, seed: int) -> dict[Outcome, float]:
    """What findings of a drawn spring say of a size."""
    records = at_frequencies(np.random.default_rng([41, seed]), frequencies, fault, (0.4, 0.7, 1.0))[1]
    return {kind: next(iter(finding.numbers.values())) for kind, finding in said(records).items()}


@pytest.mark.parametrize("seed", [1, 3, 4])  # whose loops are high enough for a change to be seen
def test_sizes_of_what_changes_are_true(seed: int) -> None:
    for frequencies in (ONE, THREE):
        assert sizes(frequencies, less_friction(0.15, 2), seed) == {
            Outcome.RECORDS_DIFFER: pytest.approx(-0.15, abs=0.03)
        }
    # Of 27 cycles; the first is whole, and a change per cycle is of the mean.
    wear = sizes(ONE, wearing(0.3, 3), seed)[Outcome.FRICTION_WEAR]
    assert 27.0 * wear == pytest.approx(-0.3 / 0.85, rel=0.15)
    spring, records = at_frequencies(np.random.default_rng([42, seed]), THREE, moving_mass(0.1, 2.0), (0.4, 0.7, 1.0))
    (found,) = said(records).values()
    mass = 0.1 * elastic_force(spring) / amplitude_of(spring) / (2.0 * np.pi * 2.0) ** 2
    assert (found.kind, found.numbers["mass"]) == (Outcome.INERTIA, pytest.approx(mass, rel=0.08))


def test_samples_that_do_not_tell_of_the_spring_leave_it_as_it_is() -> None:
    """Clipped ones, those beside the range that was selected, and those at rest."""
    plain = RefinedOptions((3, 2))
    expected = Spring(identify(NOISY, plain).parameters).response(sine())
    clipped = changed(lambda r: r.clip(-np.inf, np.sort(r)[-45]), NOISY)
    selected = replace(NOISY, compared=sine() > 0.04, force=np.where(sine() > 0.035, NOISY.force, 0.0))
    for record, left, compared in ((clipped, 1455, sine() > 0.0), (selected, 1000, sine() > 0.04)):
        found = identify(record, plain)
        assert found.fits[0].samples == left
        # Noise of 1 % of up to 100 N over 1 000 samples.
        force = Spring(found.parameters).response(sine())
        assert np.abs(force - expected)[compared].max() < 0.3
    resting, moving = (identify(rested(relaxation), plain).parameters for relaxation in (3.0, 0.0))
    assert resting == moving


@pytest.mark.parametrize(("strokes", "samples"), [(3, 7), (3, 8), (4, 5), (3, 13)])
def test_few_samples_make_a_spring(strokes: int, samples: int) -> None:
    corners = np.interp(
        np.linspace(0.0, strokes, strokes * samples + 1), range(strokes + 1), np.resize([-1.0, 1.0], strokes + 1)
    )
    found = identify(record_of(spring_of(1.0, 1.0), MEAN + AMPLITUDE * corners, 0.01))
    assert found.rnl > 0.9


@pytest.mark.parametrize("options", [RefinedOptions(), TwoStageOptions((1, 0))])
@pytest.mark.parametrize("samples", [200, 2000])
@pytest.mark.parametrize(("stiffness", "friction"), [(10.0, 0.5), (1e4, 5e3), (1.0, 20.0)])
def test_dry_friction_that_switches_between_two_samples_is_found(
    stiffness: float, friction: float, samples: int, options: RefinedOptions | TwoStageOptions
) -> None:
    """In the search it switches within a hundredth of the amplitude at least."""
    phase = np.linspace(0.0, 20.0, samples)
    record = Record(0.004 * np.sin(phase), stiffness * np.sin(phase) + friction * np.sign(np.cos(phase)))
    # It is missed altogether in the sample after each of the 6 reversals, and in no other.
    assert identify(record, options).rmse <= max(2.0 * friction * np.sqrt(6.0 / samples), 0.2 * friction)


@pytest.mark.parametrize("scale", [1e-200, 1e-100, 1e-31, 1e31, 1e100, 1e200])
def test_absurd_sizes_and_times_are_refused(scale: float) -> None:
    with pytest.raises(RecordError, match="check its unit"):
        identify(Record(scale * OWN.displacement, scale * OWN.force))
    with pytest.raises(RecordError, match="`time` must be within"):
        replace(OWN, time=1e300 ** np.sign(np.log(scale)) * np.arange(len(OWN)))


@pytest.mark.parametrize("scale", [1e-6, 1e5])
def test_the_unit_of_length_and_force_changes_nothing_else(scale: float) -> None:
    found, usual = (identify(Record(s * OWN.displacement, s**2 * OWN.force)).parameters for s in (scale, 1.0))
    # Sums are rounded otherwise.
    assert (scale * found.rho, found.sigma, found.n) == pytest.approx((usual.rho, usual.sigma, usual.n), rel=1e-4)
    assert found.kappa_omega == pytest.approx(scale**2 * usual.kappa_omega, rel=1e-4)


@pytest.mark.parametrize(("length", "force", "shift"), [(1e-14, 1, 0), (1, 1e-20, 0), (1, 1e20, 0), (1, 1, 1e14)])
def test_a_spring_beyond_the_limits_is_refused_in_words(length: float, force: float, shift: float) -> None:
    far = Record(length * OWN.displacement + shift * np.ptp(OWN.displacement), force * OWN.force)
    with pytest.raises(IdentificationError) as refused:
        identify(far, RefinedOptions(degrees=(1, 0)))
    assert refused.value.outcome in (Outcome.BEYOND_LIMITS, Outcome.UNDERSAMPLED)
