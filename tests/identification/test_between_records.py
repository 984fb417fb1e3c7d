"""Records of one spring that differ by friction, inertia or rate are told apart from wear, delays and damping."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from rig import Fault
from rig_causes import at_frequencies, lagging, less_friction, moving_mass, rubber, wearing
from strandspring import Outcome
from strandspring.identification.causes.between_records import RecordDifference, differences
from strandspring.identification.rig.effect_columns import Effect

ONE, THREE = (0.5, 0.5, 0.5), (0.2, 0.7, 2.0)
STEPS = [(1.0,), (0.4, 0.7, 1.0)]
Faults = Callable[[int, float], Fault]


def found_in(fault: Faults, frequencies: tuple[float, ...], amplitudes: tuple[float, ...] = (1.0,)) -> list:
    """What is found of 16 drawn springs each."""
    found = []
    for k in range(16):
        generator = np.random.default_rng([41, k])
        shape = "sine" if fault.__qualname__.startswith("moving") or k % 2 else "triangle"
        _, records = at_frequencies(generator, frequencies, fault, amplitudes, shape)
        found.append(differences(records))
    return found


def only(found: list[list[RecordDifference]]) -> list[RecordDifference]:
    assert [len(each) for each in found] == [1] * len(found)
    return [each[0] for each in found]


@pytest.mark.parametrize("amplitudes", STEPS)
@pytest.mark.parametrize("frequencies", [ONE, THREE])
def test_a_record_with_less_friction_is_named(frequencies: tuple[float, ...], amplitudes: tuple[float, ...]) -> None:
    for difference in only(found_in(less_friction(0.15, 2), frequencies, amplitudes)):
        assert difference.outcome is Outcome.RECORDS_DIFFER
        assert difference.size == pytest.approx(-0.15, abs=max(0.03, 3.0 * difference.error))
        assert "height of the loops in record_3.csv" in difference.detail
        assert Effect.DELAY in difference.forbidden
        assert Effect.FRICTION_WEAR in difference.forbidden


@pytest.mark.parametrize("amplitudes", STEPS)
def test_a_moving_mass_is_estimated(amplitudes: tuple[float, ...]) -> None:
    for k in range(16):
        generator = np.random.default_rng([42, k])
        spring, records = at_frequencies(generator, THREE, moving_mass(0.1, 2.0), amplitudes)
        (difference,) = differences(records)
        assert difference.outcome is Outcome.INERTIA
        elastic = 0.5 * np.ptp(np.polyval(spring.kE[::-1], [spring.x_min, spring.x_max]))
        amplitude = 0.5 * (spring.displacement_max - spring.displacement_min)
        mass = 0.1 * elastic / amplitude / (2.0 * np.pi * 2.0) ** 2
        assert difference.size == pytest.approx(mass, rel=0.06)
        assert Effect.STIFFNESS_WEAR in difference.forbidden


@pytest.mark.parametrize("amplitudes", STEPS)
def test_rubber_depends_on_the_rate(amplitudes: tuple[float, ...]) -> None:
    for difference in only(found_in(rubber(0.05), THREE, amplitudes)):
        assert difference.outcome is Outcome.RATE_DEPENDENT
        assert difference.size > 0.0
        assert "stiffness" in difference.detail


@pytest.mark.parametrize("frequencies", [ONE, THREE])
@pytest.mark.parametrize("fault", [lagging(0.01), wearing(0.3, 3), wearing(0.15, 3, True), less_friction(0.0, 2)])
def test_delays_wear_and_clean_records_are_left_to_the_effects(fault: Faults, frequencies: tuple[float, ...]) -> None:
    for amplitudes in STEPS:
        assert found_in(fault, frequencies, amplitudes) == [[]] * 16
