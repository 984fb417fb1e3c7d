"""Causes together: what each forbids to be removed, and that clean springs have none."""

from __future__ import annotations

import numpy as np
import pytest

from rig import Case, draw_experiment, draw_spring, simulate
from rig_causes import at_frequencies, band_limited, drawn_case, gapped, humming, less_friction
from strandspring import Outcome
from strandspring.identification.methods.searching import causes_in
from strandspring.identification.points.steady_part import find_steady_part
from strandspring.identification.rig.effect_columns import Effect, Rig
from strandspring.identification.search.search import search


def causes_of(records: Case | tuple) -> tuple[dict[Outcome, str], frozenset[Effect]]:
    group = records.records if isinstance(records, Case) else records
    parts = [find_steady_part(record, seeks_delay=True) for record in group]
    rig = Rig.from_parts(parts, max(24, 1000 // sum(part.strokes.count for part in parts)))
    return causes_in(rig, search(rig.loops))


def test_each_cause_forbids_what_it_looks_like() -> None:
    _, unlike = at_frequencies(np.random.default_rng(3), (0.5, 0.5, 0.5), less_friction(0.15, 2))
    found = {
        Outcome.BAND_LIMITED: causes_of(drawn_case(band_limited(10.0), 31, 0)),
        Outcome.HUM: causes_of(drawn_case(humming(9.0), 51, 0)),
        Outcome.BACKLASH: causes_of(drawn_case(gapped(0.4), 82, 2, amplitudes=(1.0,), cycles=(3,))),
        Outcome.RECORDS_DIFFER: causes_of(unlike),
    }
    for outcome, (findings, forbidden) in found.items():
        assert set(findings) == {outcome}
        assert Effect.DELAY in forbidden


@pytest.mark.slow
def test_clean_springs_have_none() -> None:
    for k in range(60):
        generator = np.random.default_rng([93, k])
        case = simulate(draw_spring(generator), draw_experiment(generator), generator)
        assert causes_of(case) == ({}, frozenset())
