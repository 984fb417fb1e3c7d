"""Fuzz targets in Python: files of past findings, a share of the random trials, and a minute of all (run.py)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import run as fuzz
from seeds import SEED

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the harness measures with /proc"),
]


@pytest.mark.parametrize("target", sorted(folder.name for folder in (fuzz.HERE / "corpus").iterdir()))
def test_past_findings(target: str) -> None:
    files = fuzz.corpus_of(target)
    report = fuzz.trials(target, 1, 1, files)
    assert not report.failures
    assert report.outcomes.total() == len(files)


# The target, the number of trials, and whether some must be accepted, and some refused; of these the fewest kinds.
SHARES = [
    ("corners", 1, True, False, 1),
    ("models", 4, False, False, 1),
    ("fmus", 4, False, False, 1),
    ("identify", 2, False, False, 1),
    ("systems", 20, True, True, 5),
    ("records_text", 20, False, True, 4),
    ("records_binary", 16, True, True, 5),
    ("descriptions", 20, True, True, 5),
    ("journals", 6, False, False, 1),
]


@pytest.mark.parametrize(("target", "count", "accepts", "refuses", "kinds"), SHARES)
def test_random_trials(target: str, count: int, accepts: bool, refuses: bool, kinds: int) -> None:
    report = fuzz.trials(target, SEED, count)
    assert not report.failures
    assert report.outcomes.total() == count
    assert not accepts or report.share("accepted") > 0.0
    assert not refuses or report.share("refused") > 0.0
    assert len(report.outcomes) >= kinds, "many kinds of refusal are reached"


@pytest.mark.slow
def test_a_minute_of_all_targets_in_python() -> None:
    """Calls of FMI have tests of their own, test_calls.py."""
    command = [sys.executable, fuzz.__file__, "--minutes", "1", "--scripts"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200, check=False)
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_finding_fails_the_run(capfd: pytest.CaptureFixture[str]) -> None:
    report = fuzz.trials("faulty", 1, 20)
    assert [failure["seed"] for failure in report.failures] == ["2", "5", "8", "11", "14", "17", "20"]
    assert report.outcomes["faulty", "accepted"] == 13
    assert "--only faulty --seed 2 --count 1" in capfd.readouterr().out


def test_a_long_run_goes_on_where_the_last_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fuzz, "NEXT", tmp_path / "next.json")
    begun = []
    monkeypatch.setattr(fuzz, "run", lambda _target, seed, *_: (begun.append(seed), (7, 0))[1])
    monkeypatch.setattr(sys, "argv", ["run.py", "--hours", "1", "--only", "journals"])
    assert fuzz.main() == 0
    assert fuzz.main() == 0
    assert begun == [SEED, SEED + 7]
