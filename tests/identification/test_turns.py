"""Reversals between the samples: named with the samples per cycle, and only where they matter."""

from __future__ import annotations

import numpy as np
import pytest

from strandspring import Outcome, Record, Spring, TwoStageOptions, identify
from strandspring.identification.identify_records import samples_per_cycle, turns_between_samples
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.loops.strokes import find_strokes
from synthetic import record_of, sine, spring_of


@pytest.mark.parametrize(("samples", "lost"), [(10, True), (30, True), (100, False)])
def test_reversals_at_samples_are_named_by_how_few_they_are(samples: int, lost: bool) -> None:
    """Halfway between two samples: 1 - cos(pi/N) of the amplitude, half of that of a stroke."""
    phase = 2.0 * np.pi * (np.arange(5 * samples) + 0.5) / samples + 0.5 * np.pi
    spring = spring_of(1.0, 1.0)
    part = find_steady_part(record_of(spring, np.sin(phase) * 0.02))
    found = turns_between_samples([part], [], spring)
    assert set(found) == ({Outcome.TURNS_BETWEEN_SAMPLES} if lost else set())
    assert all(f"{samples} samples per cycle" in detail for detail in found.values())


@pytest.mark.parametrize("samples", [150.3, 236.7, 741.1])
def test_dense_records_whose_reversals_were_estimated_go_without_a_caution(samples: float) -> None:
    """The corners of a triangle between samples are found so well that nothing is left to caution about."""
    spring, fine = spring_of(1.5, 2.0), 40
    phase = 2.0 * np.pi * np.arange(int(6 * samples) * fine) / (samples * fine)
    path = 0.02 * (0.4 + 0.1 * np.floor(phase / (2.0 * np.pi))) * 2.0 / np.pi * np.arcsin(np.sin(phase))
    force = Spring(spring).response(path)[::fine]
    found = identify(Record(path[::fine], force + 0.05 * np.random.default_rng(3).standard_normal(force.size)))
    assert found.fitted[0].compared.endswith("with reversals between the samples")
    assert not {Outcome.TURNS_RESTORED, Outcome.TURNS_BETWEEN_SAMPLES} & set(found.outcomes)
    for name in ("rho", "sigma", "n"):
        error = getattr(found.parameters, name) - getattr(spring, name)
        assert abs(error) < max(4.0 * found.uncertainty[name], 0.01 * getattr(spring, name))


def test_dense_samples_at_steep_knees_are_cautioned_by_what_the_estimate_moves() -> None:
    spring = spring_of(1.5, 2.0, 40.0)
    phase = 2.0 * np.pi * np.arange(6 * 150) / 150.37 + 1.0
    part = find_steady_part(record_of(spring, 0.02 * 2.0 / np.pi * np.arcsin(np.sin(phase))))
    detail = turns_between_samples([part], [part.turning_between_samples(True)], spring)[Outcome.TURNS_RESTORED]
    assert "150 samples per cycle" in detail


def test_methods_that_estimate_no_reversals_caution_about_those_between_samples() -> None:
    spring = spring_of(1.5, 2.0)
    phase = 2.0 * np.pi * np.arange(8 * 20) / 20.3
    found = identify(record_of(spring, 0.05 + 0.02 * np.sin(phase)), TwoStageOptions())
    assert "20 samples per cycle" in found.findings[Outcome.TURNS_BETWEEN_SAMPLES]


@pytest.mark.parametrize("cycles", [1, 2, 5])
def test_samples_per_cycle_leave_rests_and_short_strokes_aside(cycles: int) -> None:
    path = np.concatenate([sine(cycles, 120 * cycles + 1), 0.05 + 1e-3 * np.sin(np.linspace(0.0, 60.0, 500))])
    strokes = find_strokes(path)
    used = np.ones(path.size, dtype=bool)
    assert samples_per_cycle(strokes, used) == pytest.approx(120.0, abs=60.0 if cycles == 1 else 2.0)
