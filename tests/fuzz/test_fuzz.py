"""Fuzz targets in Python: past findings, some random trials of each, and what the harness calls a failure (run.py)."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest

from fuzz import run as fuzz

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the harness measures with /proc"),
]
SEED = fuzz.seed_of_commit()
# Random trials of each target, and for how many kinds of refusal at least.
SHARES = {
    "models": (4, 0), "fmus": (4, 0), "identify": (3, 0), "systems": (12, 3), "records_text": (20, 4),
    "records_binary": (12, 3), "descriptions": (10, 3), "journals": (5, 0), "options": (2, 0),
}  # fmt: skip


@pytest.fixture(scope="module")
def trials() -> Iterator[fuzz.Trials]:
    with fuzz.Trials() as made:
        yield made


def test_a_finding_fails_the_run(trials: fuzz.Trials, capsys: pytest.CaptureFixture[str]) -> None:
    trials.do("no_such_module", 2)
    assert trials.failures == ["--only no_such_module --seed 2 --count 1"]
    assert "--only no_such_module --seed 2 --count 1" in capsys.readouterr().out
    trials.failures.clear()


@pytest.mark.parametrize("times", [1, pytest.param(8, marks=pytest.mark.slow)])
@pytest.mark.parametrize("target", fuzz.TARGETS)
def test_past_findings_and_random_trials(target: str, times: int, trials: fuzz.Trials) -> None:
    count, kinds = SHARES[target]
    for file in fuzz.corpus_of(target):
        trials.do(target, 0, file)
    if target == "records_binary":  # whose files are sound ones of each format, written by other libraries
        assert trials.outcomes[target, "accepted"] >= len(fuzz.corpus_of(target))
    for k in range(times * count):
        trials.do(target, SEED + k)
    assert not [failure for failure in trials.failures if f"--only {target} " in failure]
    assert sum(of == target and "refused" in outcome for of, outcome in trials.outcomes) >= kinds
