"""A share of the random trials of records; each script does thousands (see there, and `harness`)."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from harness import run


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the harness measures with /proc")
@pytest.mark.parametrize(("script", "count"), [("text", 40), ("binary", 50), ("descriptions", 30)])
def test_random_records_are_read_or_refused_in_a_sentence(script: str, count: int) -> None:
    report = run(Path(__file__).with_name(f"records_{script}.py"), 1, count)
    assert not report.failures
    outcomes = {outcome for _, outcome in report.outcomes}
    assert "accepted" in outcomes
    assert len(outcomes) > 5, "many kinds of refusal are reached"
