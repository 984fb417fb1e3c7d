"""A small share of the trials of `journals`."""

from __future__ import annotations

from pathlib import Path

import harness


def test_damaged_journals_are_refused_or_lead_to_the_same_bytes() -> None:
    report = harness.run(Path(__file__).with_name("journals.py"), seed=1, count=40)
    assert not report.failures
    assert len(report.outcomes) >= 5
