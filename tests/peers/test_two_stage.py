"""The paper's method as printed and our two-stage method: closed forms, springs of the class, Table 1, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.polynomial.polynomial import polyval

from strandspring import (
    IdentificationError,
    Outcome,
    PaperOptions,
    Record,
    RecordError,
    Spring,
    SpringParameters,
    TwoStageOptions,
    synthesize,
    synthesize_ni,
)
from strandspring.examples.paper import campaign
from strandspring.identification.identify import identify_records
from synthetic import AMPLITUDE, MEAN, record_of, sine, spring_of
from terminal import Terminal

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


@pytest.mark.parametrize("amplitudes", [(1.0,), (0.6, 1.0)])
def test_parameters_come_near_the_known_ones(amplitudes: tuple[float, ...]) -> None:
    known = spring_of(1.0, 1.0, 3.0)
    records = [record_of(known, sine(samples=6000, amplitude=share * AMPLITUDE)) for share in amplitudes]
    found = identify_records(records, CUBIC).parameters
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
    steep = replace(spring_of(1.0, 1.0), kappa_omega=500.0)
    with pytest.raises(IdentificationError, match=r"Found \d+ samples to fit; 18 are needed") as refusal:
        identify_records([record_of(steep, sine(1, 17))], TwoStageOptions((8, 3)))
    assert refusal.value.outcome is Outcome.TOO_FEW_SAMPLES


def test_degrees_that_are_given_are_taken_and_check_themselves() -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    assert identify_records([record], CUBIC).degrees == (3, 2)
    assert identify_records([record], TwoStageOptions()).degrees == (3, 2)
    for wrong in ((0, 0), (3, -1), (3, 9)):
        with pytest.raises(ValueError, match="`degrees` must be"):
            TwoStageOptions(wrong)


KAPPA, RHO = 20.0, 800.0
FE, FA = np.array([5.0, 2e3, 4e4]), np.array([1.0, 12.0])  # of displacement - MEAN, at whose MEAN FA is 1


def tanh_record(samples: int = 4000, periods: int = 2, sigma: float = 1.0) -> Record:
    """A steady loop of n = 2: omega = tanh(xi), and before it crosses 0, tan(xi) or, below sigma = 1/2, tanh again."""
    phase = 2.0 * np.pi * np.arange(samples) / samples
    x, is_rising = AMPLITUDE * np.sin(phase), np.cos(phase) >= 0.0
    bend = np.sqrt(abs(2.0 * sigma - 1.0))
    bent, straightened = (np.tan, np.arctan) if sigma > 0.5 else (np.tanh, np.arctanh)
    # xi counts from where omega crosses 0; the stroke begins at omega = -1.
    xi = RHO * np.where(is_rising, AMPLITUDE + x, AMPLITUDE - x) - straightened(bend) / bend
    u = np.where(xi < 0.0, bent(bend * np.minimum(xi, 0.0)) / bend, np.tanh(xi))
    force = polyval(x, FE) + KAPPA * np.where(is_rising, u, -u) * polyval(x, FA)
    return Record(np.tile(MEAN + x, periods), np.tile(force, periods), path="tanh.csv")


@pytest.mark.parametrize("branch", ["loading", "unloading"])
def test_a_spring_with_a_closed_form_is_found(branch: str) -> None:
    """Without noise and smoothing only difference quotients err, by the square of a step: 1 % of 1/rho at most."""
    options = PaperOptions(degrees=(2, 1), steady=0.5, smoothing=0, branch=branch)  # type: ignore[arg-type]
    p = identify_records([tanh_record()], options).parameters
    assert p.kE == pytest.approx(FE, rel=1e-6)
    assert p.kA == pytest.approx(FA, rel=1e-6)
    assert (p.kappa_omega, p.displacement_offset) == pytest.approx((KAPPA, MEAN), rel=1e-6)
    assert (p.rho, p.sigma, p.n) == pytest.approx((RHO, 1.0, 2.0), rel=2e-4)


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    return Terminal(capsys)


@pytest.mark.parametrize(
    ("options", "samples", "noise", "expected"),
    [
        # The paper has 2.5337 N and does not say K; a literal implementation of ours has 2.62 N at K = 1000.
        (PaperOptions(), 1000, 0.0, (2.34, 2.44)), (PaperOptions(), 1000, 0.03, (2.3, 2.9)),
        # Before, the median of 40 seeds was 1.24 N with 1000 samples, 3.46 N with 128.
        (TwoStageOptions(), 1000, 0.03, (0.0, 1.4)), (TwoStageOptions(), 128, 0.03, (0.0, 3.5)),
    ],
)  # fmt: skip
def test_table_1(options: Any, samples: int, noise: float, expected: tuple[float, float]) -> None:
    """RMSE against the response without noise [N], of the steady state that the saved spring settles in."""
    errors, clean = [], synthesize_ni(samples=samples, noise=0.0)
    for seed in range(10 if noise else 1):
        found = identify_records([synthesize_ni(samples=samples, seed=seed, noise=noise)], options)
        steady = Spring(found.parameters).response(np.tile(clean.displacement, 5))[-samples:]
        errors.append(rms(steady - clean.force))
    assert expected[0] <= np.median(errors) <= expected[1]


def test_periods_are_averaged_and_choices_kept() -> None:
    clean = synthesize_ni(noise=0.0)
    errors = []
    for cycles in (2, 4):
        record = synthesize_ni(seed=1, cycles=cycles, samples=1000)
        found = identify_records([record], PaperOptions((4, 4), levels=(-0.4, 0.3, 0.6)))
        errors.append(Spring(found.parameters).response(np.tile(clean.displacement, 3))[-1000:] - clean.force)
    assert np.std(errors[1]) < 1.1 * np.std(errors[0])
    assert found.outcomes == (Outcome.PAPER_DEGREES, Outcome.ONE_AMPLITUDE)
    kept = found.options
    assert (kept["samples_per_period"], kept["periods"], kept["smoothing"]) == (1000, 4, 21)
    settings = kept["degrees"], kept["steady"], kept["levels"], kept["branch"]
    assert settings == ((4, 4), 0.9, (-0.4, 0.3, 0.6), "loading")
    assert kept["x_H1"] < kept["x_H0"] < kept["x_H2"] < kept["x_H3"]
    assert kept["steady_section"] == pytest.approx([-4.5e-3, 4.5e-3], rel=1e-3)
    assert kept["x0"] == pytest.approx(0.0, abs=1e-9)
    assert kept["kappa"] * kept["FA_at_x0"] == pytest.approx(found.parameters.kappa_omega, rel=1e-12)


def test_degrees_above_3_and_a_raised_sigma_are_named() -> None:
    assert Outcome.PAPER_DEGREES in identify_records([tanh_record()], PaperOptions()).outcomes
    found = identify_records([tanh_record(sigma=0.25)], PaperOptions((2, 1), steady=0.5, smoothing=0))
    assert found.options["sigma_of_eq_25"] == pytest.approx(0.25, rel=1e-3)
    assert found.parameters.sigma == 0.5
    assert Outcome.SIGMA_RAISED in found.outcomes


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"steady": 1e-4}, "the steady section has too few samples"),
        ({"smoothing": 60}, r"no sample .* can be H1, Omega/kappa >= -0\.5"),
        ({"smoothing": 120}, "Omega does not cross 0"),
        ({"smoothing": 200}, "a window of 401 samples is longer than the period of 400"),
    ],
)
def test_formulas_without_a_value_are_refused_with_the_reason(options: dict[str, Any], reason: str) -> None:
    with pytest.raises(IdentificationError, match=reason) as refusal:
        identify_records([tanh_record(400)], PaperOptions((2, 1), **options))
    assert refusal.value.outcome is Outcome.PAPER_FORMULAS


def test_only_one_periodic_record_is_taken() -> None:
    records = campaign()
    with pytest.raises(RecordError, match=r"the paper's method takes one periodic record"):
        identify_records([tanh_record(), tanh_record(1000)], PaperOptions())
    with pytest.raises(RecordError, match="must repeat itself from period to period"):
        identify_records([records["slow"]], PaperOptions())
    assert identify_records([records["held_out"]], PaperOptions()).rnl > 0.97


def test_options_check_themselves() -> None:
    wrong = (("steady", 0.0), ("steady", 1.5), ("smoothing", -1), ("branch", "both"), ("levels", (-0.5, 0.7, 0.35)))
    for name, value in wrong:
        with pytest.raises(ValueError, match=f"`{name}` must be"):
            PaperOptions(**{name: value})  # type: ignore[arg-type]


def test_the_command(terminal: Terminal) -> None:
    synthesize_ni(seed=1, cycles=2).save("table1.csv", "mm")
    line = "identify table1.csv --method paper --degrees 3,3 --steady 0.8 --smoothing 10 --branch unloading"
    printed = terminal(*line.split(), "--levels", "-0.4,0.3,0.6", "-o", "spring.json", "--json")
    options = json.loads(printed)["options"]
    assert (options["steady"], options["branch"], options["levels"]) == (0.8, "unloading", [-0.4, 0.3, 0.6])
    for wrong, sentence in (("1,2", "`levels` must be three"), ("a,b,c", "must be H1,H2,H3")):
        terminal("identify", "table1.csv", "--method", "paper", "--levels", wrong, "-o", "other.json", status=2)
        assert sentence in terminal.err
    terminal("identify", "table1.csv", "--branch", "unloading", "-o", "other.json", status=2)
    assert "--branch belongs to --method paper" in terminal.err
    assert sorted(path.name for path in Path().iterdir()) == ["spring.json", "table1.csv"]
