"""A share of the random SYSTEM.toml files; the script makes as many as are asked for."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import harness


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the harness measures with /proc")
def test_random_systems_are_read_or_refused_in_a_sentence() -> None:
    report = harness.run(Path(__file__).with_name("systems.py"), 1, 150)
    assert not report.failures
    outcomes = report.outcomes.items()
    assert sum(count for (_, outcome), count in outcomes if outcome == "accepted") > 15
    assert len(report.outcomes) > 20, "many kinds of refusal are reached"
