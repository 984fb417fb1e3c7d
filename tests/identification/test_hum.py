"""Hum is told from delays, play and what no polynomial follows, by what a spring leaves in the residuals."""

from __future__ import annotations

import numpy as np
import pytest

from rig import Case, draw_experiment, draw_spring, simulate
from rig_causes import drawn_case, humming
from rig_faults import FAULTS
from strandspring.identification.causes.hum import Hum, hum_beside
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.identification.rig.effect_columns import Rig
from strandspring.identification.search.search import search


def found_in(case: Case) -> Hum | None:
    parts = [find_steady_part(record, seeks_delay=True) for record in case.records]
    rig = Rig.from_parts(parts, max(24, 1000 // sum(part.strokes.count for part in parts)))
    candidates = search(rig.loops)
    return hum_beside(rig, candidates[0]) if candidates else None


@pytest.mark.slow
@pytest.mark.parametrize(("harmonic", "share"), [(5.0, 0.01), (7.0, 0.03), (9.0, 0.01), (25.0, 0.01), (37.3, 0.01)])
def test_hum_is_found_with_its_frequency_and_amplitude(harmonic: float, share: float) -> None:
    cases = [drawn_case(humming(harmonic, share), 51, k) for k in range(16)]
    pairs = [(case, found) for case in cases if (found := found_in(case)) is not None]
    # Of low harmonics the spring may take over too much.
    assert len(pairs) >= (13 if harmonic < 9.0 else 15)
    shares = []
    for case, found in pairs:
        assert found.harmonic == pytest.approx(harmonic, rel=0.01)
        assert found.frequency == pytest.approx(harmonic * case.experiment.frequency, rel=0.01)
        largest = max(float(np.std(record.force)) for record in case.records)
        true = share * np.sqrt(2.0) * largest
        # Of a fifth harmonic the spring may take over one of the two components of the wave but for 0.016 of it: the
        # standard error of that component, by white noise, is as much larger, and two of them are allowed.
        error = case.experiment.noise * largest * np.sqrt(2.0 / case.experiment.samples) / 0.016
        assert found.amplitude < (true + 2.0 * error if harmonic == 5.0 else 1.3 * true)
        shares.append(found.amplitude / true)
    assert 0.6 < np.median(shares) < 1.1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["", "force lags", "play", "viscous damper", "tanh", "bump stop", "wear of friction"])
def test_nothing_else_is_taken_for_hum(name: str) -> None:
    for k in range(12):
        generator = np.random.default_rng([52, k])
        spring, experiment = draw_spring(generator), draw_experiment(generator)
        fault = (FAULTS[name],) if name else ()
        assert found_in(simulate(spring, experiment, generator, *fault, **({"size": "large"} if name else {}))) is None
