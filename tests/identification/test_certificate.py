"""What is saved is a spring between the samples, too, and on loops that were not recorded; the file says all of it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from springs import EXAMPLES
from strandspring import (
    IdentificationError,
    Outcome,
    Record,
    RefinedOptions,
    Spring,
    SpringParameters,
    TwoStageOptions,
    build_fmu,
    identify,
    read_record,
    verify,
)  # fmt: skip
from strandspring.errors import ModelError
from strandspring.identification import refined
from strandspring.identification.options import Method
from strandspring.model.certificate import Driven, ForceRange, shortcoming
from strandspring.model.modelfile import load_model
from synthetic import drawn_own_record
from tools import shared_data

pytestmark = pytest.mark.long

KNOTS = tuple(np.linspace(-0.02, 0.02, 25).tolist())
# 15 N from knot to knot, ten times as steep as the record, and within its force.
SAW = tuple(2000.0 * knot + 15.0 * (-1.0) ** k for k, knot in enumerate(KNOTS))
TRUE = SpringParameters((0.0, 2000.0), (1.0,), 10.0, 500.0, 1.0, 1.0, 0.0, -0.02, 0.02)


def loop() -> Record:
    path = 0.02 * np.sin(np.linspace(0.0, 12.0 * np.pi, 1201)) * np.repeat([1.0, 0.5], [801, 400])
    return Record(path, Spring(TRUE).response(path), None, "loop.csv")


def beyond(found: Any, record: Record) -> float:
    """How far the spring leaves the recorded forces, share of their span, between samples and on loops of any size."""
    p, force, count = replace(found.parameters, branches=()), record.force, len(record)
    finer = np.interp(np.linspace(0, count - 1, 20 * (count - 1) + 1), np.arange(count), record.displacement)
    forces = [Spring(p).response(finer, omega_start=found.fits[0].omega_start)]
    middle, half = 0.5 * (p.displacement_max + p.displacement_min), 0.5 * (p.displacement_max - p.displacement_min)
    for at in (-0.6, 0.0, 0.6):
        for share in (1.0, 0.3, 0.1):
            path = middle + half * (at + share * np.sin(np.linspace(0.0, 40.0 * np.pi, 40 * 32 + 1)))
            forces.append(Spring(p).response(np.clip(path, p.displacement_min, p.displacement_max)))
    every = np.concatenate(forces)
    return float(max(every.max() - force.max(), force.min() - every.min()) / np.ptp(force))


def test_springs_keep_to_their_records_between_samples() -> None:
    """FE had as many knots as there are displacements, and 1e13 N between them."""
    path = 0.01 * np.sin(2.0 * np.pi * np.arange(201) / 40.0).round(9)  # repeats exactly
    true = SpringParameters((0.0, 8000.0), (1.0, 40.0), 30.0, 600.0, 1.5, 0.4, 0.0, -0.011, 0.011)
    for jitter in (0.0, 1e-7):
        draw = np.random.default_rng(1)
        moved = path + jitter * draw.standard_normal(path.size)
        force = Spring(true).response(moved)
        record = Record(moved, force + 0.002 * np.std(force) * draw.standard_normal(path.size))
        assert beyond(identify(record), record) < 0.25
    found = identify(shared_data("between_samples/explode.csv"))
    fine = read_record(shared_data("between_samples/explode_fine.csv"))
    force = Spring(found.parameters).response(fine.displacement, omega_start=found.fits[0].omega_start)
    # Of the same path without noise; 1.7 % was seen, of which 0.2 % is the noise of the record.
    assert np.sqrt(np.mean((force - fine.force) ** 2)) < 0.03 * np.sqrt(np.mean(fine.force**2))
    assert beyond(found, found.records[0]) < 0.25


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(50))
def test_drawn_springs_keep_to_their_records(seed: int) -> None:
    record = drawn_own_record(seed)
    assert beyond(identify(record), record) < 0.25


def test_springs_of_the_class_meet_their_certificate_and_what_a_record_does_not_support_is_named() -> None:
    for spring in EXAMPLES.values():
        low, high, phase = spring.displacement_min, spring.displacement_max, np.linspace(0.0, 6.0 * np.pi, 1501)
        path = 0.5 * (low + high) + 0.5 * (high - low) * np.sin(phase) * np.where(phase < 2 * np.pi, 1.0, 0.5)
        record = Driven(path, Spring(spring).response(path), None, 0.0)
        assert shortcoming(spring, ForceRange.of([record]), [record]) == {}
        assert shortcoming(spring, None) == {}
    true = replace(TRUE, kappa_omega=1.0, rho=100.0)
    path = 0.02 * np.sin(np.linspace(0.0, 6.0 * np.pi, 601))
    record = Driven(path, Spring(true).response(path), None, 0.0)
    changes: list[tuple[dict[str, Any], str]] = [
        ({"kE": (0.0, 2000.0, 0.0, -3e8)}, "elastic"), ({"kappa_omega": 90.0}, "between"),
        ({"kE": (), "FE_knots": KNOTS, "FE_forces": SAW}, "slope"),
        # A record that begins midway shows half of the swing from end to end.
        ({"kE": (0.0,), "rho": 2.0, "kappa_omega": 1000.0}, "elsewhere"),
    ]  # fmt: skip
    for changed, what in changes:
        assert what in shortcoming(replace(true, **changed), ForceRange.of([record]), [record])


class Absurd(Method):
    name, module = "absurd", __name__


def candidates(options: Absurd, samples: Any, where: str) -> Iterator[Any]:
    """The refined fit with 100 times the force, twice, and as it is unless degrees are given."""
    fitted = next(refined.candidates(RefinedOptions(degrees=(1, 0)), samples, where))
    p = fitted.parameters
    swing = 100.0 * p.kappa_omega / p.x_max**2
    absurd = replace(fitted, parameters=replace(p, kE=(p.kE[0] - swing * p.x_max**2, *p.kE[1:2], swing)))
    yield from (absurd, absurd)
    if options.degrees is None:
        yield fitted


def test_the_next_class_is_saved_and_said_or_the_records_are_refused() -> None:
    found = identify(loop(), options=Absurd())
    assert len(found.parameters.kE) == 2
    (said,) = (finding for finding in found.findings if finding.kind is Outcome.SIMPLER_CLASS)
    assert "elastic" in said.numbers
    # No switch saves it.
    with pytest.raises(IdentificationError, match=r"loop.csv: No spring .* \(FE reaches") as refused:
        identify(loop(), options=Absurd(degrees=(2, 0)), save_anyway=True)
    assert refused.value.outcome is Outcome.UNCERTIFIED


def test_build_and_verify_hold_the_spring_to_its_certificate(tmp_path: Path) -> None:
    file = tmp_path / "spring.json"
    identify(loop(), options=TwoStageOptions()).spring().save(file)
    # 2000 N/m over 20 mm and the friction of 10 N, and a quarter of their span.
    stated = load_model(file).certificate
    assert (stated.force_min, stated.force_max, stated.margin) == pytest.approx((-50.0, 50.0, 25.0), rel=1e-3)
    free = Spring(TRUE).build_fmu(tmp_path / "free", backend="python")
    held = build_fmu(file, tmp_path / "held", backend="python")
    for fmu, words in (
        (held, "Force and FE within -50 to 50 N as recorded, +- 25 N"),
        (free, "Finite and dissipative; not"),
    ):
        (spoken,) = (finding for finding in verify(fmu).checks if finding.about == "spring")
        assert not spoken.is_problem
        assert spoken.text.startswith(words)
    content = json.loads(file.read_text())
    content["parameters"]["kE"] = [0.0, 2000.0, 4e5]  # as by hand
    file.write_text(json.dumps(content))
    with pytest.raises(ModelError, match=r"does not meet its certificate: FE reaches .* identify it again"):
        build_fmu(file, tmp_path / "bad")
    assert not list((tmp_path / "bad").glob("*"))
