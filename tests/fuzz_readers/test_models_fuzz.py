"""A share of the random model files, FMUs and records for identification; the scripts make as many as are asked for."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

import harness


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the harness measures with /proc")
@pytest.mark.parametrize(
    ("script", "count", "accepted"), [("models", 20, 0.2), ("models_fmus", 20, 0.3), ("identify", 20, 0.02)]
)
def test_nothing_fails(script: str, count: int, accepted: float) -> None:
    report = harness.run(Path(__file__).with_name(f"{script}.py"), 1, count)
    assert not report.failures
    outcomes = report.outcomes.items()
    assert sum(n for (_, outcome), n in outcomes if outcome.startswith("accepted")) > accepted * count
    assert sum(n for (_, outcome), n in outcomes if "refused" in outcome) > 0.1 * count
