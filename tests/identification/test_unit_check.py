"""Units of one record that differ from the others' are named; loops that differ otherwise are not taken for that."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig import Case, Experiment, amplitude_of, draw_spring, simulate
from strandspring import IdentificationError, Outcome, Record, Spring, bundled_record, identify, read_record
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.identification.points.unit_check import implausible_sizes, refuse_differing_units
from synthetic import record_of, sine, spring_of

ROOT = Path(__file__).resolve().parents[2]
FACTORS = [
    ("force", 1e3), ("force", 1e-3), ("force", 9.80665), ("force", 1.0 / 9.80665), ("force", 4.4482),
    ("force", 1.0 / 4.4482), ("displacement", 1e3), ("displacement", 1e-3), ("displacement", 25.4),
    ("displacement", 1.0 / 25.4),
]  # fmt: skip


def drawn_pair(index: int, smaller: float) -> tuple[Record, Record]:
    """Two records of a drawn spring, the second of a smaller amplitude, with zeros of their own."""
    generator = np.random.default_rng([29, index])
    spring = draw_spring(generator)
    experiment = Experiment(
        shape="sine" if generator.random() < 0.5 else "triangle",
        amplitudes=(1.0, smaller), cycles=(3, 3), separate=True, samples=1200,
    )  # fmt: skip
    case: Case = simulate(spring, experiment, generator)
    first, second = case.records
    force_zero = 0.3 * generator.uniform(-1.0, 1.0) * float(np.ptp(first.force))
    zero = 0.2 * generator.uniform(-1.0, 1.0) * amplitude_of(spring)
    return first, replace(second, displacement=second.displacement + zero, force=second.force + force_zero)


def scaled(record: Record, column: str, factor: float) -> Record:
    return replace(record, **{column: factor * getattr(record, column)})


def mistake(*records: Record) -> str:
    """What is said of the units; empty for nothing."""
    parts = [find_steady_part(record) for record in records]
    try:
        refuse_differing_units(parts)
    except IdentificationError as refusal:
        return str(refusal)
    return ""


@pytest.mark.parametrize("smaller", [0.95, 0.6, 0.3, 0.15])
def test_loops_of_other_amplitudes_and_zeros_have_the_same_units(smaller: float) -> None:
    assert [k for k in range(50) if mistake(*drawn_pair(k, smaller))] == []


@pytest.mark.parametrize(("column", "factor"), FACTORS)
def test_a_factor_between_units_is_named(column: str, factor: float) -> None:
    for index in range(20):
        first, second = drawn_pair(index, 0.98)
        said = mistake(first, scaled(second, column, factor))
        assert said.startswith(f"{second.path}: ")
        assert f"Its {column} times {1.0 / factor:.4g}"[:20] in said
        assert f"agrees with {first.path}" in said
        assert f"{column}_unit" in said


@pytest.mark.parametrize(("column", "factor"), [each for each in FACTORS if each[1] in (1e3, 1e-3)])
def test_a_factor_of_1000_is_named_at_other_amplitudes_too(column: str, factor: float) -> None:
    named = [
        mistake(first, scaled(second, column, factor)) for first, second in (drawn_pair(k, 0.4) for k in range(20))
    ]
    assert sum(f"Its {column} times {1.0 / factor:g}" in said for said in named) >= 18


def test_of_three_records_the_one_that_differs_is_named() -> None:
    spring = spring_of(1.0, 1.0)
    records = [replace(record_of(spring, 0.99**k * (sine() - 0.05) + 0.05, 0.01), path=f"{k}.csv") for k in range(3)]
    for k in range(3):
        group = [scaled(record, "force", 4.4482216) if k == n else record for n, record in enumerate(records)]
        assert mistake(*group).startswith(f"{k}.csv: This record agrees with the others only after")


def test_identify_refuses_them_with_the_unit() -> None:
    spring = spring_of(1.0, 1.0)
    one, other = (replace(record_of(spring, sine(), 0.01 * k), path=f"{k}.csv") for k in (1, 2))
    with pytest.raises(IdentificationError, match=r"^2\.csv: .* Its force times 1000 .* \(kN read as N\)") as refused:
        identify([one, scaled(other, "force", 1e-3)])
    assert refused.value.outcome is Outcome.UNITS_DIFFER


def test_measured_records_are_no_mistake() -> None:
    record = read_record(bundled_record(), reverse="displacement")
    actuator = read_record(ROOT / "tests/data/actuator/circle_3bar.csv", displacement=5, force=7)
    for whole in (record, actuator):
        half = len(whole) // 2
        first, second = (
            Record(whole.displacement[part], whole.force[part], path=f"{part.start}.csv")
            for part in (slice(0, half), slice(half, len(whole)))
        )
        assert mistake(first, second) == ""
        assert "times 9.80665" in mistake(first, scaled(second, "force", 1.0 / 9.80665))
        assert implausible_sizes([find_steady_part(whole)]) == ()


@pytest.mark.parametrize(
    ("column", "factor", "words"),
    [
        ("displacement", 1e3, "amplitude 19.8 m, usual are 1e-06 to 0.5; mm read as m would explain it"),
        ("force", 1e6, "force amplitude 9.31e+07 N, usual are 0.001 to 1e+07"),
        ("displacement", 1e-6, "amplitude 1.98e-08 m, usual are 1e-06 to 0.5; stiffness"),
    ],
)
def test_implausible_sizes_are_noted(column: str, factor: float, words: str) -> None:
    record = record_of(spring_of(1.0, 1.0), sine())
    assert implausible_sizes([find_steady_part(record)]) == ()
    (note,) = implausible_sizes([find_steady_part(scaled(record, column, factor))])
    assert words in note


def test_a_drawn_spring_has_usual_sizes() -> None:
    for index in range(50):
        generator = np.random.default_rng([30, index])
        spring = draw_spring(generator)
        path = spring.displacement_offset + amplitude_of(spring) * np.sin(np.linspace(0.0, 20.0, 600))
        assert implausible_sizes([find_steady_part(Record(path, Spring(spring).response(path)))]) == ()
