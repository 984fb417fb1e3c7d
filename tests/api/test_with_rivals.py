"""What `with_rivals` hands to the other classes, and what it says of it."""

from __future__ import annotations

import numpy as np
import pytest

from strandspring import Record, RefinedOptions, identify
from strandspring.peers.rivals.ranking import Ranking
from synthetic import record_of, sine, spring_of


@pytest.mark.parametrize("mass", [0.0, 2.0])
def test_rivals_get_the_records_without_the_effects_of_the_rig(mass: float, monkeypatch: pytest.MonkeyPatch) -> None:
    given = []
    monkeypatch.setattr(
        "strandspring.peers.rivals.ranking.rank",
        lambda parts, **_: given.extend(parts) or Ranking((), "cycles", 5, 1.0, 0.0),
    )
    alone = record_of(spring_of(1.0, 1.0), sine())
    times = np.linspace(0.0, 3.0, 1500)
    inertia = -mass * (2.0 * np.pi) ** 2 * (alone.displacement - 0.05)
    found = identify(Record(alone.displacement, alone.force + inertia, times), RefinedOptions((3, 2), moving_mass=mass))
    _, ranking = found.with_rivals()
    (part,) = given
    assert part.record.force == pytest.approx(alone.force, abs=1e-3 * np.ptp(alone.force))
    expected = ("All classes were fitted to the records without the effects of the rig: moving mass.",) if mass else ()
    assert ranking.notes == expected
