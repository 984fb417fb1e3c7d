"""Fuzz targets: files of past findings, a share of the random trials, and a minute of all of them (run.py)."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import harness

HERE = Path(__file__).resolve().parent
SCRIPTS = HERE / "targets"

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the harness measures with /proc"),
]


@pytest.mark.parametrize("target", sorted(folder.name for folder in (HERE / "corpus").iterdir()))
def test_past_findings(target: str) -> None:
    files = sorted((HERE / "corpus" / target).iterdir())
    report = harness.run(SCRIPTS / f"{target}.py", 1, 1, files=files)
    assert not report.failures
    assert sum(report.outcomes.values()) == len(files)


# The script, the number of trials, and the least share of them that is accepted, and refused.
SHARES = [
    ("corners", 3, 1.0, 0.0),
    ("models", 10, 0.2, 0.1),
    ("models_fmus", 8, 0.3, 0.1),
    ("identify", 6, 0.02, 0.1),
    ("systems", 40, 0.1, 0.1),
    ("records_text", 20, 0.02, 0.1),
    ("records_binary", 25, 0.02, 0.1),
    ("records_descriptions", 20, 0.02, 0.1),
    ("journals", 20, 0.02, 0.1),
]


@pytest.mark.parametrize(("script", "count", "accepted", "refused"), SHARES)
def test_random_trials(script: str, count: int, accepted: float, refused: float) -> None:
    report = harness.run(SCRIPTS / f"{script}.py", 1, count)
    assert not report.failures
    outcomes = report.outcomes.items()
    assert sum(n for (_, outcome), n in outcomes if outcome.startswith("accepted")) >= accepted * count
    assert sum(n for (_, outcome), n in outcomes if "refused" in outcome) >= refused * count
    assert refused == 0.0 or len(report.outcomes) >= 5, "many kinds of refusal are reached"


FAULTY = """
import sys
sys.path.insert(0, {folder!r})
import harness

def trial(generator, folder):
    yield "target"
    assert generator.random() < 0.5
    yield "accepted"

harness.main(__file__, trial, 10)
"""


@pytest.mark.slow
def test_a_minute_of_all_scripts() -> None:
    """Calls of FMI have tests of their own, test_calls.py."""
    command = [sys.executable, HERE / "run.py", "--minutes", "1", "--scripts", "--seed", "1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200, check=False)
    print(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_finding_fails_the_run(tmp_path: Path) -> None:
    script = tmp_path / "target.py"
    script.write_text(FAULTY.format(folder=str(SCRIPTS)))
    report = harness.run(script, 1, 40)
    assert 5 < len(report.failures) < 35
    assert report.outcomes["target", "accepted"] + len(report.failures) == 40
