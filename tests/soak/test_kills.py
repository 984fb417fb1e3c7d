"""A small share of the kills: kills.py does the whole."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import kills
from strandspring.cli.main import COMMANDS

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are found through /proc")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "signals", "count"),
    [("study", ["KILL", "TERM", "INT", "HUP"], 4), ("identify", ["KILL", "TERM", "INT", "HUP"], 4)],
)
def test_a_command_that_is_ended_loses_and_leaves_nothing(command: str, signals: list[str], count: int) -> None:
    arguments = ["--only", command, "--count", str(count), *(part for name in signals for part in ("--signal", name))]
    script = Path(__file__).with_name("kills.py")
    done = subprocess.run(
        [sys.executable, script, *arguments], capture_output=True, text=True, timeout=600, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"tried {count:4}" in done.stdout


def test_all_commands_are_ended() -> None:
    assert {command.arguments.split()[0] for command in kills.COMMANDS.values()} == set(COMMANDS)


def test_what_is_neither_old_nor_new_is_noticed() -> None:
    undisturbed = kills.Undisturbed(0, 1.0, {"out/a": "new", "out/b": "new"}, {"out/a": "old", "out/b": "old"})
    assert kills.mixed({"out/a": "new", "out/b": "old"}, undisturbed, undisturbed.old) == []
    assert kills.mixed({"out/b": "old"}, undisturbed, {}) == ["out/b"]
    assert kills.mixed({"out/a": "new", "out/b": "half"}, undisturbed, undisturbed.old) == ["out/b"]
    assert kills.mixed({"out/c": "new"}, undisturbed, {}) == ["out/c"]
