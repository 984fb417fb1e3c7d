"""The methods of `identify` beside each other, on the paper's simulated experiment and on springs."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest

from strandspring import (
    NiOptions,
    Outcome,
    PaperOptions,
    Record,
    RecordError,
    RefinedOptions,
    ScanOptions,
    Spring,
    SpringParameters,
    TwoStageOptions,
    identify,
    synthesize,
)
from strandspring.identification.methods.method import Method
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.peers.ni import PAPER_NI, sine_period, with_noise
from synthetic import record_of, sine, spring_of

SEEDS = range(5)


def errors(options: Method, amplitude: float, exponent: float) -> list[float]:
    """RMSE against the noise-free response over a few seeds; the benchmark methods.py has more."""
    truth = replace(PAPER_NI, n=exponent)
    x = sine_period(amplitude, 1000)
    clean = truth.steady_force(x)
    found = (identify(Record(1e-3 * x, with_noise(clean, 0.03, seed)), options) for seed in SEEDS)
    return [float(np.sqrt(np.mean((one.fits[0].predicted - clean) ** 2))) for one in found]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "mark", "drowned"),
    [
        # The paper's two-stage 2.5337 and Ni's method from exact values 2.0494; medians over 20 seeds measured here
        # 1.24, 1.06, 0.98 and where the loop drowns in the noise 1.48, 0.91, 0.97.
        (TwoStageOptions(), 2.5337, 2.5337),
        (ScanOptions(), 1.8, 2.5),
        (RefinedOptions(), 1.1, 1.2),
    ],
    ids=["two-stage", "scan", "refined"],
)
def test_table_1_without_start_values(options: Method, mark: float, drowned: float) -> None:
    assert np.median(errors(options, 5.0, 0.222)) <= mark
    assert np.median(errors(options, 5.45, 1.0)) <= drowned


def test_nis_method_gives_a_spring_too() -> None:
    x = sine_period(5.0, 1000)
    found = identify(Record(1e-3 * x, PAPER_NI.steady_force(x)), NiOptions())
    # The record is Ni's model itself; what is left is the polynomials that stand for its exponential and the kink of
    # its sgn(x)*x^2 at zero.
    assert found.method == "ni"
    assert found.rnl > 0.999
    assert found.parameters.n == pytest.approx(0.222, rel=1e-3)


def test_nis_method_says_when_its_model_does_not_fit() -> None:
    record = record_of(spring_of(1.0, 1.0), sine(4, 2000))
    assert Outcome.NI_MODEL in identify(record, NiOptions()).outcomes
    with pytest.raises(RecordError, match="one periodic record"):
        identify([record, record_of(spring_of(1.0, 1.0), sine(5, 2000))], NiOptions())


# One row for each method: its name, fields of its own, and whether it gives standard errors.
METHODS = {
    RefinedOptions: (
        "refined",
        (
            "degrees",
            "robust",
            "bootstrap",
            "seed",
            "posterior",
            "moving_mass",
            "fixture_stiffness",
            "delay",
            "keep",
            "state",
            "mechanisms",
            "branches",
        ),
        True,
    ),
    TwoStageOptions: ("two-stage", ("degrees",), False),
    ScanOptions: ("scan", ("degrees",), False),
    PaperOptions: ("paper", ("degrees", "steady", "smoothing", "branch", "levels"), False),
    NiOptions: ("ni", ("degrees", "start"), False),
}


@pytest.mark.parametrize("method", METHODS, ids=[name for name, _, _ in METHODS.values()])
def test_all_methods_have_one_interface(method: type[Method]) -> None:
    name, names, with_errors = METHODS[method]
    assert issubclass(method, Method)
    options = method(degrees=(4, 3))
    assert tuple(field.name for field in fields(options)) == names
    with pytest.raises(FrozenInstanceError):
        options.degrees = None  # type: ignore[misc]
    for wrong in ((0, 0), (3, -1), (3, 9)):
        with pytest.raises(ValueError, match="`degrees` must be"):
            method(degrees=wrong)
    x = sine_period(5.0, 1000)
    record = Record(1e-3 * x, PAPER_NI.steady_force(x))
    assert options.prepare(record) is record
    result = options.fit([find_steady_part(record)], "here")
    assert (len(result.parameters.kE) - 1, len(result.parameters.kA) - 1) == (4, 3)
    assert bool(result.uncertainty) is (result.band is not None) is with_errors
    assert options.withstands_outliers is False
    found = identify(record, options)
    assert found.method == name
    assert found.parameters == result.parameters
    assert found.options["degrees"] == (4, 3)
    assert set(found.options) == {*names, *result.choices}


def test_only_the_robust_fit_withstands_outliers() -> None:
    assert RefinedOptions(robust=True).withstands_outliers
    assert not RefinedOptions().withstands_outliers


def test_scan_is_a_method_of_its_own() -> None:
    found = identify(record_of(spring_of(0.5, 1.0), sine()), ScanOptions((3, 2)))
    assert found.method == "scan"
    assert found.rnl >= 0.97
    with pytest.raises(ValueError, match="degrees"):
        ScanOptions((0, 0))


@pytest.mark.parametrize("n", [0.3, 1.3, 3.0])
def test_noise_of_saturated_branches_biases_two_stages_little(n: float) -> None:
    """It came out as travel: rho 15 to 26 % too large and n by a third to more than a half too small."""
    true = SpringParameters((0.0, 2e4), (1.0, 10.0), 50.0, 2500.0, 1.0, n, 0.0, -0.01, 0.01)
    found = []
    for seed in SEEDS:
        record = synthesize(Spring(true), 0.01, samples=500, noise=0.003, seed=seed)
        found.append(identify(record, TwoStageOptions((1, 1))).parameters)
    assert np.median([p.rho for p in found]) == pytest.approx(2500.0, rel=0.1)
    assert np.median([p.n for p in found]) == pytest.approx(n, rel=0.25)


@pytest.mark.slow
def test_every_record_inside_the_model_converges() -> None:
    """Noise-free, and strokes that barely or not at all reach a steady section."""
    for n in (0.2, 1.0, 5.0):
        for sigma in (0.5, 1.0, 5.0):
            known = spring_of(n, sigma, 1.0)
            p = identify(record_of(known, sine()), RefinedOptions((3, 2))).parameters
            assert (p.rho, p.sigma, p.n) == pytest.approx((known.rho, sigma, n), rel=1e-6)
