"""Which samples are fitted."""

from __future__ import annotations

import numpy as np
import pytest

from strandspring import Record
from strandspring.identification.usable import usable_samples
from strandspring.loops.strokes import find_strokes


@pytest.mark.parametrize("samples", [1_000, 10_000, 100_000])
def test_densely_sampled_sine_does_not_rest(samples: int) -> None:
    """The steps of 100 000 samples are all far below what counts as a rest, and a whole cycle ends where it began."""
    x = 0.02 * np.sin(np.linspace(0.0, 6.0 * np.pi, samples))
    used, cautions = usable_samples(Record(x, 1000.0 * x), find_strokes(x))
    assert used.all()
    assert not cautions


@pytest.mark.parametrize("samples", [1_000, 100_000])
def test_dwells_are_left_out_at_any_rate_of_sampling(samples: int) -> None:
    phase = np.linspace(0.0, 6.0 * np.pi, samples)
    # A rest of a fifth of a stroke at each upper reversal.
    for turn in (8.5 * np.pi, 4.5 * np.pi, 0.5 * np.pi):
        phase = np.where(phase > turn, np.maximum(phase - 0.2 * np.pi, turn), phase)
    x = 0.02 * np.sin(phase)
    resting = np.concatenate([[False], np.diff(x) == 0.0])
    used, _ = usable_samples(Record(x, 1000.0 * x), find_strokes(x))
    assert np.mean(used[resting]) < 0.05  # their ends, since dense records are thinned
    assert np.mean(~used) == pytest.approx(np.mean(resting), abs=0.04)  # beside each rest the sine is nearly at rest
