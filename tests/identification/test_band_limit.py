"""Filtered records are told by the spectrum of their forces, and unfiltered ones are not taken for such."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig import Case, draw_experiment, draw_spring, simulate
from rig_causes import band_limited, drawn_case
from strandspring import Record, read_record
from strandspring.identification.causes.band_limit import band_limit
from strandspring.identification.points.steady_part import SteadyRecord, find_steady_part

ROOT = Path(__file__).resolve().parents[2]


def steady_parts(case: Case) -> list[SteadyRecord]:
    return [find_steady_part(record, seeks_delay=True) for record in case.records]


@pytest.mark.parametrize("harmonic", [10.0, 20.0, 40.0])
@pytest.mark.parametrize("order", [2, 4])
def test_a_common_filter_is_found_with_its_cutoff(harmonic: float, order: int) -> None:
    found = [band_limit(steady_parts(drawn_case(band_limited(harmonic, order), 31, k))) for k in range(16)]
    limits = [limit for limit in found if limit is not None]
    # Of sines that are blurred by less than 0.2 % of a stroke, not every one shows it.
    assert len(limits) >= (15 if harmonic < 40.0 else 9)
    for limit in limits:
        assert 0.6 * harmonic < limit.harmonic < 2.0 * harmonic
        assert limit.frequency is not None
        assert f"{limit.harmonic:.2g} times the test's frequency" in limit.sentence
        assert limit.is_common


@pytest.mark.parametrize("noise", [0.0, 0.005])
@pytest.mark.parametrize("samples", [1000, 20_000])
def test_unfiltered_records_have_no_band_limit(noise: float, samples: int) -> None:
    for k in range(30):
        generator = np.random.default_rng([32, k])
        experiment = draw_experiment(generator, noise=noise, samples=samples)
        assert band_limit(steady_parts(simulate(draw_spring(generator), experiment, generator))) is None


def test_noise_of_the_displacement_shows_that_only_the_force_was_filtered() -> None:
    case = drawn_case(band_limited(10.0), 31, 1, shape="sine")
    generator = np.random.default_rng(0)
    noisy = [
        Record(r.displacement + 1e-3 * case.amplitude * generator.standard_normal(len(r)), r.force, r.time)
        for r in case.records
    ]
    limit = band_limit([find_steady_part(record) for record in noisy])
    assert limit is not None
    assert not limit.is_common


def test_measured_records_are_not_filtered() -> None:
    for record in (
        read_record(ROOT / "models/records/rubber_stretch.csv", reverse="displacement"),
        read_record(ROOT / "tests/data/actuator/circle_3bar.csv", displacement=5, force=7),
    ):
        assert band_limit([find_steady_part(record)]) is None
