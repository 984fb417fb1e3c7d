"""A small share of the soak and of the kills: soak.py and kills.py do the whole."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import kills
import soak

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory and processes are read from /proc")


def run(script: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, Path(__file__).with_name(script), *arguments]
    return subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=600, check=False)


def test_growth_of_memory_is_noticed() -> None:
    kept: list[bytes] = []
    # Large enough to be asked from the system, whatever else this process has freed.
    growing = soak.soak(lambda _: kept.append(b"x" * 300_000), 200)
    assert growing.second_half > soak.LIMIT
    assert growing.per_thousand == pytest.approx(300_000.0, rel=0.2)
    assert soak.soak(lambda _: bytearray(7300), 2000).second_half < 200


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "count"), [("native-steps", 100_000), ("native-lives", 1000), ("python-steps", 10_000)]
)
def test_memory_stays_flat(task: str, count: int) -> None:
    done = run("soak.py", task, "--count", count)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_a_killed_study_loses_nothing() -> None:
    done = run("kills.py", "--only", "study", "--count", 3)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "tried    3" in done.stdout


def test_what_is_neither_old_nor_new_is_noticed() -> None:
    undisturbed = kills.Undisturbed(0, 1.0, {"out/a": "new", "out/b": "new"}, {"out/a": "old", "out/b": "old"})
    assert kills.mixed({"out/a": "new", "out/b": "old"}, undisturbed, undisturbed.old) == []
    assert kills.mixed({"out/b": "old"}, undisturbed, {}) == ["out/b"]
    assert kills.mixed({"out/a": "new", "out/b": "half"}, undisturbed, undisturbed.old) == ["out/b"]
    assert kills.mixed({"out/c": "new"}, undisturbed, {}) == ["out/c"]
