"""Records in, springs out: known springs come back, with degrees, mechanisms and branches, and the file says so."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mounts_with_branches import FIRST, SECOND, maxwell, record, sines, two_rates
from oracles import OracleSpring
from springs import TABLE
from strandspring import (
    IdentificationError,
    Outcome,
    Record,
    RecordError,
    RefinedOptions,
    Spring,
    SpringParameters,
    bundled_record,
    identify,
    read_record,
    select,
    synthesize_ni,
)
from synthetic import AMPLITUDE, MEAN, record_of, sine, spring_of
from tools import slow_but
from zoo_rig import draw_case

pytestmark = pytest.mark.long

CUBIC = RefinedOptions(degrees=(3, 2))
FALLING = MEAN + (sine(6, 1800) - MEAN) * np.linspace(1.0, 0.3, 1800)
BRANCH = (1500.0, 0.08)  # N/m, s: about a tenth of the force


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def laws(spring: SpringParameters) -> tuple[float, float, float]:
    return spring.rho, spring.sigma, spring.n


def kind(spring: SpringParameters) -> tuple[int, int]:
    return len(spring.mechanisms), len(spring.branches)


# -- springs of the own class


LAWS = [(0.2, 5.0, 1.5), (0.5, 0.5, 3.0), (5.0, 5.0, 3.0)]
MORE = [law for law in product((0.2, 0.5, 1.0, 2.0, 5.0, 10.0), (0.5, 2.0, 5.0), (1.5, 3.0)) if law not in LAWS]


@pytest.mark.parametrize("law", slow_but([*LAWS, *MORE], LAWS))
def test_without_noise_every_parameter_comes_back(law: tuple[float, float, float]) -> None:
    known = spring_of(*law)
    found = identify(record_of(known, FALLING))
    assert found.degrees == (3, 2)
    # sigma ends 1e-3 above its bound of 1/2.
    assert laws(found.parameters) == pytest.approx(laws(known), rel=3e-3)
    # Inner loops that were not recorded, where the record was.
    path = MEAN + 0.9 * AMPLITUDE * np.sin(np.linspace(0, 30, 4000)) * np.cos(np.linspace(0, 7, 4000))
    truth = Spring(known).response(path)
    assert Spring(found.parameters).response(path) == pytest.approx(truth, abs=5e-4 * np.ptp(truth))
    assert str(found.verdict).startswith("usable: 0.0")


@pytest.mark.slow
def test_the_error_is_near_the_cramer_rao_bound() -> None:
    clean, squares = record_of(spring_of(1.0, 1.0), sine()), []
    for seed in range(10):
        noisy = replace(clean, force=clean.force + np.random.default_rng(seed).standard_normal(len(clean)))
        fit = identify(noisy, CUBIC).fits[0]
        squares.append(np.mean((fit.predicted - clean.force)[fit.first_sample :] ** 2))
    # p/K for p parameters and K samples of noise 1 N: four of FE, three of FA, three of omega. The root of the mean of
    # 10 chi-squares of 10 scatters by 7 %.
    assert np.sqrt(np.mean(squares)) < 1.2 * np.sqrt(10.0 / fit.samples)


SMALLER = record_of(spring_of(0.6, 1.5, 3.0), sine(amplitude=0.6 * AMPLITUDE))


@pytest.mark.parametrize(
    ("known", "records"),
    [
        (spring_of(1.0, 1.0), [record_of(spring_of(1.0, 1.0), sine())]),
        (spring_of(1.0, 1.0), [record_of(spring_of(1.0, 1.0), sine(samples=150_000))]),
        (spring_of(1.0, 1.0), [record_of(spring_of(1.0, 1.0), sine(1, 500))]),  # a first loading
        (spring_of(1.0, 1.0, 0.3), [record_of(spring_of(1.0, 1.0, 0.3), sine(6))]),  # never saturated
        (spring_of(0.6, 1.5, 3.0), [SMALLER, record_of(spring_of(0.6, 1.5, 3.0), sine(samples=700))]),
    ],
)
def test_without_noise_degrees_are_its_own_whatever_was_recorded(
    known: SpringParameters, records: list[Record]
) -> None:
    found = identify(records)
    assert found.degrees == (3, 2)
    assert set(found.outcomes) <= {Outcome.ONE_AMPLITUDE}
    assert laws(found.parameters) == pytest.approx(laws(known), rel=5e-3)
    assert min(fit.rnl for fit in found.fits) >= 0.999
    assert found.parameters.displacement_max == pytest.approx(MEAN + AMPLITUDE, rel=1e-4)


def test_one_period_that_closes_follows_itself() -> None:
    known, two = spring_of(1.0, 1.0), sine(2, 2001)
    (fit,) = identify(Record(two[1000:], record_of(known, two).force[1000:]), CUBIC).fits
    assert fit.samples == 1001
    assert fit.omega_start == pytest.approx(float(Spring(known).omega(two)[1000]), abs=1e-4)


# -- shapes of FE


def test_a_shape_that_no_polynomial_follows_gets_a_table() -> None:
    """A step and a kink, on knots elsewhere than those of the fit."""
    path = MEAN + (sine(6, 2400) - MEAN) * np.repeat([1.0, 0.6, 0.3], 800)
    clean = Spring(TABLE).response(path)
    noise = 0.002 * np.std(clean) * np.random.default_rng(7).standard_normal(path.size)
    errors = {}
    for degrees in (None, (3, 2)):
        found = identify(Record(path, clean + noise), RefinedOptions(degrees=degrees)).parameters
        errors[degrees] = np.std(Spring(found).response(path) - clean) / np.std(clean)
        assert bool(found.FE_knots) is (degrees is None)
    assert errors[None] < 0.01
    assert errors[(3, 2)] > 2.0 * errors[None]


# -- mechanisms and branches


def test_a_branch_is_found_with_its_size_and_range() -> None:
    found = identify(two_rates(branches=[BRANCH]))
    assert kind(found.parameters) == (1, 1)
    assert not found.effects
    (branch,) = found.parameters.branches
    # Noise of 0.1 N on 12 cycles of a branch of some 10 N.
    assert (branch.stiffness, branch.time_constant) == pytest.approx(BRANCH, rel=0.02)
    assert laws(found.parameters) == pytest.approx(laws(FIRST), rel=0.02)
    for name, true in zip(("stiffness", "time_constant"), BRANCH, strict=True):
        low, high = found.uncertainty["further"][f"branches[0].{name}"]["interval_95"]
        # Widened by half, a miss by chance is rarer than one in 300.
        assert low - 0.25 * (high - low) <= true <= high + 0.25 * (high - low)
        assert high - low < 0.2 * true
    # The unit of time is free: time constants scale with it, all else stays.
    faster = [replace(each, time=0.5 * each.time) for each in found.records]
    (other,) = identify(faster).parameters.branches
    assert other.time_constant == pytest.approx(0.5 * branch.time_constant, rel=1e-5)
    assert other.stiffness == pytest.approx(branch.stiffness, rel=1e-5)


@pytest.mark.parametrize("noise", slow_but([0.0, 0.02], [0.02]))
def test_a_mount_without_friction_is_an_elastic_one_with_a_branch(noise: float) -> None:
    def viscoelastic(rate: float, size: float) -> Record:
        time = np.linspace(0.0, 4.0 / rate, 1600)
        path = size * np.sin(2.0 * np.pi * rate * time)
        elastic = 1e4 * path + 1e9 * path**3 + noise * np.random.default_rng(1).standard_normal(time.size)
        return Record(path, elastic + maxwell(time, path, 2e4, 0.05), time)

    found = identify([viscoelastic(rate, size) for rate in (0.1, 1.0, 10.0) for size in (1e-3, 2e-3, 4e-3)])
    assert kind(found.parameters) == (1, 1)
    (branch,) = found.parameters.branches
    # Straight lines between 400 samples a cycle; of a force of 100 N.
    assert (branch.stiffness, branch.time_constant) == pytest.approx((2e4, 0.05), rel=1e-3)
    assert found.parameters.kappa_omega < 0.02


@pytest.mark.parametrize("seed", slow_but(range(4), (0, 3)))
def test_nothing_is_chosen_that_is_not_there(seed: int) -> None:
    found = identify(two_rates(seed=10 * seed, noise=0.02 * 5**seed))
    assert kind(found.parameters) == (1, 0)
    assert not {Outcome.RATE_OPEN, Outcome.RATE_DEPENDENT, Outcome.LACK_OF_FIT} & set(found.outcomes)


def test_a_branch_at_one_rate_is_taken_and_said_to_be_open() -> None:
    found = identify(record(*sines((0.02,), 0.5, cycles=8), branches=[(3000.0, 0.25)]))
    (branch,) = found.parameters.branches
    assert (branch.stiffness, branch.time_constant) == pytest.approx((3000.0, 0.25), rel=0.02)
    assert Outcome.RATE_OPEN in found.outcomes


def test_what_is_asked_for_is_found_and_nothing_else() -> None:
    two = identify(two_rates(branches=[(1500.0, 0.3), (1500.0, 0.02)], noise=0.02), RefinedOptions(branches=2))
    assert kind(two.parameters) == (1, 2)
    assert sorted(b.time_constant for b in two.parameters.branches) == pytest.approx([0.02, 0.3], rel=0.05)
    both = identify(two_rates(branches=[BRANCH], second=True), RefinedOptions(mechanisms=2, branches=1)).parameters
    assert sorted(mechanism.rho for mechanism in both.mechanisms) == pytest.approx([FIRST.rho, SECOND.rho], rel=0.05)
    assert both.branches[0].stiffness == pytest.approx(BRANCH[0], rel=0.05)
    none = identify(two_rates(branches=[BRANCH]), RefinedOptions(mechanisms=1, branches=0))
    assert kind(none.parameters) == (1, 0)
    assert identify(two_rates(), RefinedOptions(degrees=(4, 3))).degrees == (4, 3)


def test_a_second_mechanism_is_found_without_times_too() -> None:
    records = two_rates(second=True, seed=3)
    for given in (records, [replace(each, time=None) for each in records]):
        found = identify(given).parameters
        assert kind(found) == (2, 0)
        forces = sorted(mechanism.kappa_omega for mechanism in found.mechanisms)
        assert forces == pytest.approx([SECOND.kappa_omega, FIRST.kappa_omega], rel=0.15)


# -- several records, states, outliers


def test_a_campaign_of_amplitudes_and_frequencies_is_one_spring() -> None:
    """The paper's section 5, synthesized: 13-46 mm about 57 mm, 0.13-2.12 Hz, noise, drift, coarse sensors."""
    known = SpringParameters((320.0, 6500.0, 9e4, 1.2e6), (1.0, 9.0, 60.0), 35.0, 110.0, 1.2, 0.6, 0.057, 0.011, 0.103)
    plan = [(13, 0.13, 50), (20, 0.3, 100), (26, 0.6, 200), (33, 1.0, 500), (40, 1.5, 1000), (46, 2.12, 1000)]
    records, clean = [], []
    for seed, (amplitude, frequency, rate) in enumerate(plan):
        times = np.arange(int(5 * rate / frequency)) / rate
        path = 0.057 + 1e-3 * amplitude * np.sin(2.0 * np.pi * frequency * times)
        clean.append(Spring(known).response(path))
        noise = 1.0 + 0.03 * np.random.default_rng(seed).standard_normal(path.size)
        drift = 1.0 + 0.02 * np.arange(path.size) / path.size
        # Sensors of 0.02 mm and 0.5 N.
        records.append(Record(np.round(path / 2e-5) * 2e-5, np.round(clean[-1] * noise * drift / 0.5) * 0.5, times))
    found = identify([record for k, record in enumerate(records) if k != 3])
    forces = [Spring(found.parameters).response(record.displacement) for record in records]
    reached = [1.0 - rms(force - c) / rms(c) for force, c in zip(forces, clean, strict=True)]
    # Against the noise-free force, one record held back; the drift alone costs 0.01.
    assert min(reached) >= 0.98, reached
    assert kind(found.parameters) == (1, 0)


@pytest.mark.parametrize("state", ["first", "mean", "last"])
def test_a_state_is_that_of_its_cycles(state: Any) -> None:
    """Friction that falls to a half over nine cycles: to the fourth, all of them, or from the sixth."""
    known, path = spring_of(1.0, 1.0), sine(9, 3601)
    worn = np.linspace(1.0, 0.5, path.size)
    elastic = Spring(replace(known, kappa_omega=1e-12)).response(path)
    force = elastic + worn * (Spring(known).response(path) - elastic)
    found = identify(Record(path, force), RefinedOptions(state=state))
    share = found.parameters.kappa_omega / known.kappa_omega
    assert share == pytest.approx({"first": 0.89, "mean": 0.743, "last": 0.60}[state], abs=0.02)
    assert Outcome.FRICTION_WEAR in found.outcomes


def test_outliers_hardly_move_the_robust_fit() -> None:
    truth = record_of(spring_of(1.0, 1.0), sine()).force
    noisy = record_of(spring_of(1.0, 1.0), sine(), noise=0.01)
    errors, spoiled = [], noisy.force.copy()
    spoiled[200::40] += 60.0
    for robust in (False, True):
        found = identify(replace(noisy, force=spoiled), RefinedOptions((3, 2), robust=robust))
        errors.append(rms((found.fits[0].predicted - truth)[200:]))
        assert {Outcome.BACKLASH, Outcome.STICK_SLIP, Outcome.LACK_OF_FIT}.isdisjoint(found.outcomes) or not robust
    # Outliers of 60 N in every fortieth sample shift a plain fit by 60/40 N on the mean.
    assert errors[1] < 0.1 * errors[0]
    single = replace(noisy, force=np.where(np.arange(1500) == 700, 250.0, noisy.force))
    assert Outcome.SPIKES in identify(single, CUBIC).outcomes
    assert identify(single, RefinedOptions((3, 2), robust=True)).outcomes == (Outcome.ONE_AMPLITUDE,)


def test_noise_that_drowns_a_loop_is_no_stick_slip() -> None:
    clean, noisy = (synthesize_ni(0.00545, 1.0, noise=noise) for noise in (0.0, 0.03))
    steady = Spring(identify(noisy).parameters).response(np.tile(clean.displacement, 5))[-len(clean) :]
    # Twelve parameters, 1 000 samples, 7.5 N: 0.8 N.
    assert rms(steady - clean.force) < 1.2


@pytest.mark.parametrize(
    ("wave", "samples"), [("sine", 11.3), ("sine", 24.6), ("sine", 39.7), ("triangle", 17.3), ("triangle", 41.3)]
)
def test_few_samples_in_a_cycle_are_no_effect_of_the_rig(wave: str, samples: float) -> None:
    """Reversals lie between samples; the energy of small loops is right, or its range holds it."""
    known, finer = spring_of(1.5, 2.0), 64
    phase = 2.0 * np.pi * np.arange(int(8 * samples) * finer) / (samples * finer)
    unit = np.sin(phase) if wave == "sine" else 2.0 / np.pi * np.arcsin(np.sin(phase))
    path = MEAN + AMPLITUDE * (0.3 + 0.1 * np.floor(phase / (2.0 * np.pi))) * unit
    force = Spring(known).response(path)[::finer]
    noise = 0.1 * np.random.default_rng(5).standard_normal(force.size)
    found = identify(Record(path[::finer], force + noise, 0.1 * np.arange(force.size)))
    assert not found.effects
    assert Outcome.TURNS_BETWEEN_SAMPLES in found.outcomes or laws(found.parameters) == pytest.approx(laws(known), 0.05)
    # Three standard errors; with reversals at samples sigma and n of the triangles are several times too large.
    assert samples < 12.0 or laws(found.parameters) == pytest.approx(laws(known), 0.03)
    unrecorded = found.certainty.unrecorded
    small = MEAN + unrecorded.amplitude * np.sin(np.linspace(0.0, 20.0 * np.pi, 4001))
    energy = np.trapezoid(Spring(known).response(small)[-401:], small[-401:])
    assert unrecorded.energy == pytest.approx(energy, rel=0.1) or unrecorded.low <= energy <= unrecorded.high


# -- what is refused, and what is asked for wrongly


def test_the_same_samples_twice_are_refused() -> None:
    one = record_of(spring_of(1.0, 1.0), sine())
    with pytest.raises(RecordError, match=r"copy\.csv: holds the same samples as synthetic\.csv"):
        identify([one, replace(one, path="copy.csv")])
    parts = [select(one, displacement=ends) for ends in ((None, MEAN), (MEAN - 0.005, None))]
    with pytest.raises(RecordError, match="select parts that do not overlap"):
        identify(parts)
    # A run at another frequency is another measurement, even of a spring that repeats exactly.
    identify([replace(one, time=rate * np.arange(1500.0)) for rate in (1.0, 2.0)], CUBIC)


def test_a_spring_that_is_worse_than_a_line_is_refused_unless_asked_for() -> None:
    """A sensor that drifts by three times its range: only what was removed follows the record."""
    good = record_of(spring_of(1.0, 1.0), sine(6), noise=0.01)
    drifting = replace(good, force=good.force + np.linspace(0.0, 3.0 * np.ptp(good.force), len(good)))
    first, mean = (RefinedOptions((3, 2), state=state) for state in ("first", "mean"))
    with pytest.raises(IdentificationError) as refused:
        identify(drifting, first)
    assert refused.value.outcome is Outcome.WORSE_THAN_LINE
    found = identify(drifting, first, save_anyway=True)
    assert Outcome.WORSE_THAN_LINE in found.outcomes
    # That of the mean moment is as good as one can be without the drift.
    assert identify(drifting, mean, save_anyway=True).rnl > found.rnl


@pytest.mark.parametrize(
    ("error", "options"),
    [
        *((ValueError, {"degrees": degrees}) for degrees in ((0, 0), (3, 99), (3, -1), 3, (3,), "12")),
        *((ValueError, {"branches": count}) for count in (-1, 4)),
        *((ValueError, {"mechanisms": count}) for count in (0, 3)),
        (ValueError, {"state": "worn"}), (ValueError, {"moving_mass": -1.0}), (ValueError, {"moving_mass": np.nan}),
        (ValueError, {"moving_mass": np.inf}), (ValueError, {"fixture_stiffness": 0.0}),
        (ValueError, {"fixture_stiffness": np.nan}), (ValueError, {"delay": np.nan}), (ValueError, {"delay": np.inf}),
        (TypeError, {"moving_mass": True}), (TypeError, {"moving_mass": "1"}), (TypeError, {"delay": [0.1]}),
        (TypeError, {"branches": 1.5}), (TypeError, {"robust": 1}),
    ],
)  # fmt: skip
def test_options_check_themselves(error: type[Exception], options: dict[str, Any]) -> None:
    (name,) = options
    with pytest.raises(error, match=f"`{name}` must be"):
        RefinedOptions(**options)
    with pytest.raises(ValueError, match="at least one record"):
        identify([])


# -- the model file


# By number: one, two and three amplitudes in turn, without a fault and with one.
@pytest.mark.parametrize("name", slow_but(["hinge", "iwan 0", "two mechanisms 2", "maxwell rubber 2"], ["iwan 0"]))
def test_figures_are_those_of_the_saved_spring_along_the_record(name: str, tmp_path: Path) -> None:
    """Recomputed from the file alone by an ODE solver."""
    mount, _, index = name.rpartition(" ")
    hinge = read_record(bundled_record(), reverse="displacement")
    records = draw_case(mount, 0, int(index)).records if mount else (hinge,)
    found = identify(records, save_anyway=True)
    found.spring().save(tmp_path / "spring.json")
    content = json.loads((tmp_path / "spring.json").read_text(encoding="utf-8"))
    spring = OracleSpring(content["parameters"])
    assert len(content["fit"]["records"]) == len(records)
    for each, figures, fit in zip(records, content["fit"]["records"], found.fits, strict=True):
        chosen = slice(figures["first_sample"], None)
        x, r = each.displacement[chosen], each.force[chosen]
        p = spring.force(each.displacement, figures["omega_start"], each.time)[chosen]
        assert figures["samples"] == r.size
        # 1e-5 is ten times the solver's error of omega; no average over samples can err by more.
        mechanisms = [spring.values, *filter(None, [spring.values.get("second")])]
        amplifiers = [OracleSpring({**spring.values, **each}).amplifier(x).max() for each in mechanisms]
        tolerance = 1e-5 * sum(m["kappa_omega"] * a for m, a in zip(mechanisms, amplifiers, strict=True))
        assert figures["rmse"] == pytest.approx(rms(r - p), abs=tolerance)
        assert figures["rnl"] == pytest.approx(1.0 - rms(r - p) / rms(r), abs=tolerance / np.std(r))
        FE, way = spring.elastic(x), np.abs(np.diff(x)).sum()
        rounding = 1e-9 * np.abs(r).max() * way
        assert fit.energy == pytest.approx(np.trapezoid(r - FE, x), abs=rounding)
        assert fit.predicted_energy == pytest.approx(np.trapezoid(p - FE, x), abs=tolerance * way + rounding)


def test_the_file_says_what_was_found_and_of_what(tmp_path: Path) -> None:
    one = replace(record_of(spring_of(1.0, 1.0), sine(), noise=0.01), path="m\udcfc\x1b.csv")
    found = identify(one, CUBIC)
    paths = [tmp_path / name for name in ("a.json", "b.json")]
    for path, identification in zip(paths, (found, identify(one, CUBIC)), strict=True):
        identification.spring("a").save(path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    loaded = Spring.load(paths[0])
    fit, provenance = loaded.model.fit, loaded.model.provenance
    assert loaded.parameters == found.parameters
    assert fit["rnl"] == found.rnl
    assert fit["verdict"]["sentence"] == str(found.verdict)
    assert [finding["name"] for finding in fit["outcomes"]] == [outcome.name.lower() for outcome in found.outcomes]
    assert {"degrees", "fitted", "recorded_loops", "small_loops", "lack_of_fit", "records"} <= set(fit)
    assert provenance["records"][0]["file"] == "m\ufffd\ufffd.csv"  # a name that is not UTF-8
    assert provenance["records"][0]["sha256"] == one.sha256
    assert provenance["method"] == "refined"
    assert provenance["options"]["degrees"] in ([3, 2], (3, 2))
    assert len(loaded.model.uncertainty["kE"]) == 4


# -- notes


def test_rests_and_sizes_that_no_rig_measures_are_noted() -> None:
    one, repeats = record_of(spring_of(1.0, 1.0), sine(3, 601)), np.ones(601, dtype=int)
    repeats[[250, 350]] += 80
    rests = Record(np.repeat(one.displacement, repeats), np.repeat(one.force, repeats), path="rests.csv")
    found = identify(rests, CUBIC)
    assert Outcome.DWELLS not in found.outcomes
    assert any(note.startswith("rests.csv: 1") and "rests there" in note for note in found.notes)
    assert not any("rest" in note or "units" in note for note in identify(one, CUBIC).notes)
    for column, factor, words in (
        ("displacement", 1e3, "mm read as m would explain it"),
        ("force", 1e6, "usual are 0.001 to 1e+07"),
        ("displacement", 1e-6, "usual are 1e-06 to 0.5; stiffness"),
    ):
        scaled = replace(one, **{column: factor * getattr(one, column)})
        (note,) = (note for note in identify(scaled, CUBIC).notes if "units" in note)
        assert words in note
