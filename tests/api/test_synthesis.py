"""`synthesize`, `synthesize_ni`, and records that are saved."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from strandspring import Record, Spring, read_record, synthesize, synthesize_ni
from synthetic import MEAN, spring_of

SPRING = Spring(spring_of(1.0, 1.0), "mount")


def test_the_record_is_the_response_of_the_spring() -> None:
    record = synthesize(SPRING, amplitudes=[0.01, 0.02], cycles=2, samples=100, frequency=0.5)
    assert len(record) == 401
    assert record.force == pytest.approx(SPRING.response(record.displacement), rel=1e-12, abs=1e-10)  # of 1 ulp in mm
    assert np.ptp(record.displacement) == pytest.approx(0.04, rel=1e-12)
    assert record.time is not None
    assert record.time[-1] == pytest.approx(8.0)
    assert record.notes == ()
    assert np.array_equal(SPRING.synthesize([0.01, 0.02], cycles=2, samples=100).force, record.force)


def test_noise_and_what_lies_outside_the_range_are_noted() -> None:
    record = synthesize(SPRING, amplitudes=[0.03], noise=0.02, seed=4)
    assert record.notes[0] == "noise level 0.02, seed 4"
    assert "outside the identified range" in record.notes[1]
    clean = synthesize(SPRING, amplitudes=[0.03])
    # The standard deviation of 3001 standard normal numbers is 1 within 5 % (nearly 4 of its standard errors).
    assert np.std(record.force / clean.force - 1.0) == pytest.approx(0.02, rel=0.05)
    assert np.array_equal(record.force, synthesize(SPRING, amplitudes=[0.03], noise=0.02, seed=4).force)


def test_sensors_are_coarse_and_drift() -> None:
    plain = synthesize(SPRING)
    coarse = synthesize(SPRING, drift=0.02, displacement_resolution=2e-5, force_resolution=0.5)
    assert np.max(np.abs(coarse.displacement - plain.displacement)) <= 1e-5 * (1.0 + 1e-9)  # half a step
    growth = 1.0 + 0.02 * np.arange(len(plain)) / len(plain)
    assert np.max(np.abs(coarse.force - growth * plain.force)) <= 0.25 * (1.0 + 1e-9)


def test_impossible_numbers_are_refused() -> None:
    for wrong in (
        {"amplitudes": [0.0]}, {"amplitudes": []}, {"amplitudes": [np.nan]}, {"mean": np.inf}, {"frequency": 0.0},
        {"noise": -1.0}, {"cycles": 0}, {"samples": 7}, {"force_resolution": -1.0}, {"drift": np.nan},
    ):  # fmt: skip
        (name,) = wrong
        with pytest.raises(ValueError, match=f"`{name}` must be"):
            synthesize(SPRING, **wrong)  # type: ignore[arg-type]
    for make in (lambda: synthesize(SPRING, cycles=100_000), lambda: synthesize_ni(cycles=100_000)):
        with pytest.raises(ValueError, match="more than 20000000; use fewer"):
            make()
    with pytest.raises(ValueError, match="`amplitude` must be"):
        synthesize_ni(amplitude=5.0)


def test_the_papers_experiment_has_the_papers_rms_force() -> None:
    # 248.2 N in each row of the paper's Table 1; n was chosen to reproduce it, with three digits.
    assert np.sqrt(np.mean(synthesize_ni(noise=0.0).force ** 2)) == pytest.approx(248.2, rel=1e-3)
    assert len(synthesize_ni(cycles=2, samples=50)) == 100


def test_a_saved_record_is_read_bit_for_bit(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    for record in (
        synthesize(SPRING, noise=0.1, seed=2),
        Record(np.array([0.1, 1 / 3, -7e-5]) + MEAN, [1e-7, 2 / 3, 3e5]),
    ):
        record.save(path)
        read = read_record(path)
        assert np.array_equal(read.displacement, record.displacement)
        assert np.array_equal(read.force, record.force)
        assert (read.time is None) == (record.time is None)
        if read.time is not None and record.time is not None:
            assert np.array_equal(read.time, record.time)
        record.save(path, "mm")
        assert read_record(path).displacement == pytest.approx(record.displacement, rel=1e-15)
    synthesized = synthesize(SPRING, displacement_resolution=2e-5)
    synthesized.save(path, "mm")
    assert np.array_equal(read_record(path).displacement, synthesized.displacement)
