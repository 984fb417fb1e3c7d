"""What is refused is named by what it is: chatter is no snap-through, and strokes that do not meet do not cross."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rig import amplitude_of, draw_spring
from strandspring import IdentificationError, Outcome, Record, Spring, read_record
from strandspring.identification.points.steady_part import find_steady_part

ROOT = Path(__file__).resolve().parents[2]


def chattering_brace(generator: np.random.Generator, share: float) -> Record:
    """A friction brace on a spring that slips by this share of its friction at a time."""
    path = np.sin(2.0 * np.pi * np.arange(1601) / 400)
    contact, parallel = np.exp(generator.uniform(np.log(5.0), np.log(30.0))), generator.uniform(0.02, 0.3)
    friction = np.zeros(path.size)
    for k in range(1, path.size):
        friction[k] = friction[k - 1] + contact * (path[k] - path[k - 1])
        if abs(friction[k]) > 1.0:
            friction[k] = np.sign(friction[k]) * (1.0 - share)
    return Record(0.01 * path, friction + parallel * path + 0.005 * generator.standard_normal(path.size))


@pytest.mark.parametrize("seed", range(16))
def test_chatter_is_stick_slip(seed: int) -> None:
    with pytest.raises(IdentificationError) as refusal:
        find_steady_part(chattering_brace(np.random.default_rng([91, seed]), 0.95))
    assert refusal.value.outcome is Outcome.STICK_SLIP


@pytest.mark.parametrize("reverse", [None, "displacement"])
def test_a_snap_stays_one(reverse: str | None) -> None:
    with pytest.raises(IdentificationError) as refusal:
        find_steady_part(read_record(ROOT / "tests/data/hinge/plastic_compress.csv", reverse=reverse))
    assert refusal.value.outcome is Outcome.SNAP_THROUGH


@pytest.mark.parametrize("seed", [25, 67, 109])
def test_full_strokes_of_different_cycles_of_a_beat_need_not_meet(seed: int) -> None:
    """A spring that softens in a beat, whose force was called crossed or backwards."""
    generator = np.random.default_rng([184, seed])
    spring = draw_spring(generator, friction=(0.03, 0.3))
    ratio, duration, share = generator.uniform(0.7, 0.97), generator.uniform(2, 25), generator.uniform(0.2, 0.8)
    time = np.arange(0.0, duration, 0.01)
    phases = [generator.uniform(0, 6) for _ in range(2)]
    beat = share * np.sin(2.0 * np.pi * time + phases[0])
    beat += (1.0 - share) * np.sin(2.0 * np.pi * ratio * time + phases[1])
    path = spring.displacement_offset + amplitude_of(spring) * beat
    force = Spring(spring).response(path)
    noise = 0.005 * np.std(force) * generator.standard_normal(force.size)
    assert find_steady_part(Record(path, force * (1.0 - 0.4 * time / duration) + noise, time)).strokes.count > 2
