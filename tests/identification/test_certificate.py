"""What is saved is a spring between the samples, too, and on loops that were not recorded."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial.polynomial import polyval
from scipy.interpolate import CubicSpline

from springs import EXAMPLES, FloatArray
from strandspring import (
    Identification,
    IdentificationError,
    Outcome,
    RefinedOptions,
    Spring,
    SpringParameters,
    TwoStageOptions,
    build_fmu,
    identify,
    read_record,
    verify,
)
from strandspring.errors import ModelError
from strandspring.identification.method import Method
from strandspring.model.certificate import Driven, ForceRange, shortcoming
from strandspring.model.modelfile import load_model
from strandspring.records.record import Record
from synthetic import drawn_own_record
from tools import shared_data

SI = {"displacement": "m", "force": "N"}
KNOTS = tuple(np.linspace(-0.02, 0.02, 25).tolist())
# 15 N from knot to knot, ten times as steep as the record, and within its force.
SAW = tuple(2000.0 * knot + 15.0 * (-1.0) ** k for k, knot in enumerate(KNOTS))
MARGIN = 0.25  # of the span of the recorded force, by which the saved spring may leave it


def steps(levels: float) -> FloatArray:
    """A sine of 10 mm whose displacements repeat exactly, 40 in a cycle, with a jitter."""
    exact = 0.01 * np.sin(2.0 * np.pi * np.arange(201) / 40.0).round(9)
    return exact + levels * np.random.default_rng(1).standard_normal(exact.size)


def outside(found: Identification, record: Record) -> list[str]:
    """Where the spring leaves the recorded forces by more than the margin, by formulas of this test's own."""
    p, force = found.parameters, record.force
    margin = (MARGIN + 1e-9) * np.ptp(force)
    places = np.linspace(p.displacement_min, p.displacement_max, 20_001)
    x = places - p.displacement_offset
    elastic = CubicSpline(p.FE_knots, p.FE_forces)(places) if p.FE_knots else polyval(x, p.kE)
    loops = {"FE": elastic}
    count = record.displacement.size
    finer = np.interp(np.linspace(0, count - 1, 20 * (count - 1) + 1), np.arange(count), record.displacement)
    slow = Spring(replace(p, branches=()))
    loops["record"] = slow.response(finer, omega_start=found.fits[0].omega_start)
    middle, half = 0.5 * (p.displacement_max + p.displacement_min), 0.5 * (p.displacement_max - p.displacement_min)
    for at in (-0.6, 0.0, 0.6):
        for share in (1.0, 0.6, 0.3, 0.1):
            path = middle + half * (at + share * np.sin(np.linspace(0.0, 40.0 * np.pi, 40 * 32 + 1)))
            path = np.clip(path, p.displacement_min, p.displacement_max)
            loops[f"loop of {share} at {at}"] = slow.response(path)
            if np.trapezoid(loops[f"loop of {share} at {at}"][-65:], path[-65:]) < -1e-3 * margin * np.ptp(path):
                loops[f"energy of {share} at {at}"] = np.array([np.inf])
    beyond = [name for name, f in loops.items() if f.min() < force.min() - margin or f.max() > force.max() + margin]
    return beyond + ["FA"] * any(polyval(x, mechanism.kA).min() < 0.0 for mechanism in p.mechanisms)


def test_between_samples_is_as_recorded() -> None:
    """FE had as many knots as there are displacements, and 1e13 N between them."""
    found = identify(shared_data("between_samples/explode.csv"))
    fine = read_record(shared_data("between_samples/explode_fine.csv"))
    force = Spring(found.parameters).response(fine.displacement, omega_start=found.fits[0].omega_start)
    # Of the same path without noise; 1.7 % was seen, of which 0.2 % is the noise of the record.
    assert np.sqrt(np.mean((force - fine.force) ** 2)) < 0.03 * np.sqrt(np.mean(fine.force**2))
    assert outside(found, found.records[0]) == []


@pytest.mark.parametrize("jitter", [0.0, 1e-7])
@pytest.mark.parametrize("seed", range(3))
def test_displacements_that_repeat_determine_as_many_coefficients(jitter: float, seed: int) -> None:
    true = SpringParameters((0.0, 8000.0), (1.0, 40.0), 30.0, 600.0, 1.5, 0.4, 0.0, -0.011, 0.011)
    path = steps(jitter)
    force = Spring(true).response(path)
    noisy = force + 0.002 * np.std(force) * np.random.default_rng(seed).standard_normal(path.size)
    found = identify(path, noisy, units=SI)
    assert outside(found, found.records[0]) == []


def test_springs_of_the_class_meet_their_certificate() -> None:
    """On the record of three amplitudes that they give themselves, from corners to cusps."""
    for spring in EXAMPLES.values():
        low, high = spring.displacement_min, spring.displacement_max
        phase = np.linspace(0.0, 6.0 * np.pi, 1501)
        path = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(phase) * np.where(phase < 2 * np.pi, 1.0, 0.5)
        record = Driven(path, Spring(spring).response(path), None, 0.0)
        assert shortcoming(spring, ForceRange.of([record]), [record]) == ""
        assert shortcoming(spring, None) == ""


@pytest.mark.parametrize(
    ("changed", "what"),
    [
        ({"kE": (0.0, 2000.0, 0.0, -3e8)}, "FE reaches"),
        ({"kE": (), "FE_knots": KNOTS, "FE_forces": SAW}, "FE rises or falls by"),
        ({"kappa_omega": 90.0}, "between samples the force reaches"),
        # A record that begins midway shows half of the swing from end to end.
        ({"kE": (0.0,), "rho": 2.0, "kappa_omega": 1000.0}, "on other loops the force reaches"),
    ],
)
def test_what_the_record_does_not_support_is_named(changed: dict[str, object], what: str) -> None:
    true = SpringParameters((0.0, 2000.0), (1.0,), 1.0, 100.0, 1.0, 1.0, 0.0, -0.02, 0.02)
    path = 0.02 * np.sin(np.linspace(0.0, 6.0 * np.pi, 601))
    record = Driven(path, Spring(true).response(path), None, 0.0)
    assert what in shortcoming(replace(true, **changed), ForceRange.of([record]), [record])


class Absurd(Method):
    """Gives springs that leave the record, and at last one that does not, unless degrees are given."""

    name = "absurd"

    def candidates(self, samples, where):  # type: ignore[no-untyped-def]
        """The refined fit with 100 times the force at a degree of its own, twice, before it as it is."""
        fitted = next(RefinedOptions(degrees=(1, 0)).candidates(samples, where))
        p = fitted.parameters
        swing = 100.0 * p.kappa_omega / p.x_max**2
        absurd = replace(fitted, parameters=replace(p, kE=(p.kE[0] - swing * p.x_max**2, *p.kE[1:2], swing)))
        yield from (absurd, absurd)
        if self.degrees is None:
            yield fitted


def test_the_next_class_is_saved_and_said_or_the_records_are_refused() -> None:
    true = SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)
    path = 0.02 * np.sin(np.linspace(0.0, 12.0 * np.pi, 1201)) * np.repeat([1.0, 0.5], [801, 400])
    record = Record(path, Spring(true).response(path), None, "loop.csv")
    found = identify(record, options=Absurd())
    assert len(found.parameters.kE) == 2
    (said,) = (finding for finding in found.findings if finding.kind is Outcome.SIMPLER_CLASS)
    assert "FE reaches" in said.detail
    # No switch saves it.
    with pytest.raises(IdentificationError, match=r"loop.csv: No spring .* \(FE reaches") as refused:
        identify(record, options=Absurd(degrees=(2, 0)), save_anyway=True)
    assert refused.value.outcome is Outcome.UNCERTIFIED


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100))
def test_drawn_springs_keep_to_their_records(seed: int) -> None:
    record = drawn_own_record(seed)
    assert outside(identify(record), record) == []


def changed_file(path: Path, **parameters: object) -> Path:
    """A model file of a record with other parameters, as by hand."""
    true = SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)
    displacement = 0.02 * np.sin(np.linspace(0.0, 12.0 * np.pi, 1201)) * np.repeat([1.0, 0.5], [801, 400])
    spring = identify(displacement, Spring(true).response(displacement), units=SI, options=TwoStageOptions()).spring()
    spring.save(path)
    content = json.loads(path.read_text())
    content["parameters"] |= parameters
    path.write_text(json.dumps(content))
    return path


def test_build_and_verify_hold_the_spring_to_its_certificate(tmp_path: Path) -> None:
    file = changed_file(tmp_path / "spring.json")
    # 2000 N/m over 20 mm and the friction of 10 N, and a quarter of their span.
    stated = load_model(file).certificate
    assert (stated.force_min, stated.force_max, stated.margin) == pytest.approx((-50.0, 50.0, 25.0), rel=1e-3)
    (spoken,) = [
        finding for finding in verify(build_fmu(file, tmp_path / "good")).findings if finding.about == "spring"
    ]
    assert not spoken.is_problem
    assert spoken.text.startswith("Force and FE within -50 to 50 N as recorded, +- 25 N")
    wild = changed_file(tmp_path / "wild.json", kE=[0.0, 2000.0, 4e5])
    with pytest.raises(
        ModelError, match=r"The spring spring does not meet its certificate: FE reaches .* identify it again"
    ):
        build_fmu(wild, tmp_path / "bad")
    assert not list((tmp_path / "bad").glob("*"))


def test_a_file_without_a_certificate_is_said_to_have_none(tmp_path: Path) -> None:
    fmu = Spring(SpringParameters((0.0, 8000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)).build_fmu(tmp_path)
    (said,) = (finding.text for finding in verify(fmu).findings if finding.about == "spring")
    assert said == "Finite and dissipative; not held to a record."
    root = Path(__file__).resolve().parents[2] / "models"
    stated = load_model(root / "rubber_hinge.json").certificate
    force = read_record(root / "records/rubber_stretch.csv", reverse="displacement").force
    assert (stated.force_min, stated.force_max) == (force.min(), force.max())
