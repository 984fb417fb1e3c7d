"""A small share of the soak: run.py does the whole."""

from __future__ import annotations

import mmap
import subprocess
import sys
from pathlib import Path

import pytest

from soak import run as soak
from strandspring.cli.main import COMMANDS

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes and memory are read from /proc")
SCRIPT = Path(soak.__file__)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "count"),
    [("study", 4), ("identify", 4), ("native-steps", 50_000), ("native-lives", 5000), ("python-steps", 5000)],
)
def test_nothing_is_lost_left_or_leaked(name: str, count: int) -> None:
    command = [sys.executable, SCRIPT, "--only", name, "--count", str(count)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 failures" in done.stdout
    assert count > 4 or ", ended" in done.stdout  # some of them before they were done


def test_all_commands_are_ended() -> None:
    assert {command.split()[0] for command in soak.COMMANDS.values()} == set(COMMANDS)


def test_what_is_neither_old_nor_new_is_noticed() -> None:
    new, old = {"out/a": "new", "out/b": "new"}, {"out/a": "old", "out/b": "old"}
    assert soak.spoilt({"out/a": "new", "out/b": "old"}, new, old) == []
    assert soak.spoilt({"out/b": "old"}, new, {}) == ["out/b is neither old nor new"]
    assert soak.spoilt({"out/a": "new", "out/b": "half"}, new, old) == ["out/b is neither old nor new"]
    assert soak.spoilt({"out/a": "new"}, new, old) == ["out/b was there and is lost"]


def test_growth_of_memory_is_noticed() -> None:
    kept = []

    def grow(_: int) -> None:
        # From the system, whatever else this process has freed.
        kept.append(mmap.mmap(-1, 300_000))
        kept[-1].write(b"x" * 300_000)

    assert soak.grown(grow, 200) == pytest.approx(100 * 300_000 / 1024, rel=0.2)
    assert soak.grown(lambda _: bytearray(7300), 2000) < 200
