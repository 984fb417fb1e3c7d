"""The command line as a process: shells, terminals, signals, full disks, completion."""

from __future__ import annotations

import json
import os
import pty
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from strandspring import bundled_record
from strandspring.cli.main import COMMANDS
from terminal import Terminal

pytestmark = pytest.mark.long

PROGRAM = [sys.executable, "-W", "error", "-m", "strandspring"]
SHORT = """
import os, signal
from pathlib import Path
import click
from strandspring.cli import main as program
from strandspring.ground.files import replacing

@click.command()
@click.option("--json", is_flag=True)
def short(json):
    {body}

program.LazyGroup.get_command = lambda *_: short
program.main(["short", "--json"])
"""


def ran(*arguments: str | bytes, **options: Any) -> subprocess.CompletedProcess[str]:
    """The program run to its end, which says nothing but one sentence where it fails."""
    kept = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "encoding": "utf-8", **options}
    done = subprocess.run([*PROGRAM, *arguments], check=False, **kept)
    assert "Traceback" not in done.stderr
    return done


def on_terminal(command: list[str], **environment: str) -> str:
    """What a program writes to a terminal of 80 columns."""
    shown: list[bytes] = []

    def read(terminal: int) -> bytes:
        shown.append(os.read(terminal, 65536))
        return shown[-1]

    settings = {"TERM": "xterm-256color", "COLUMNS": "80", **environment}
    words = ["env", *(f"{name}={value}" for name, value in settings.items()), *command]
    assert pty.spawn(words, read, lambda _: b"") == 0, shown
    return b"".join(shown).decode().replace("\r\n", "\n")


HALF = "with replacing(Path('out.json')) as part: part.write_text('{'), os.kill(os.getpid(), signal.SIG%s)"
ENDED = "%s; no output file is half written."
FAULTS = [
    ("raise OSError(28, os.strerror(28))", 1, "OSError", "No space left on device; check the path"),
    ("raise OSError(5, os.strerror(5), 'a\\x1b[2Jb')", 1, "OSError", "a\ufffd[2Jb: Input/output error; "),
    ("raise OSError()", 1, "OSError", "OSError; check the path"),
    ("raise MemoryError()", 1, "MemoryError", "There is not enough memory for this; "),
    (HALF % "INT", 128 + signal.SIGINT, "Interrupt", ENDED % "interrupted"),
    (HALF % "TERM", 128 + signal.SIGTERM, "Interrupt", ENDED % "terminated"),
    (HALF % "HUP", 128 + signal.SIGHUP, "Interrupt", ENDED % "terminated"),
]


@pytest.mark.parametrize(("body", "status", "kind", "sentence"), FAULTS)
def test_whatever_the_system_refuses_or_ends_is_a_sentence(
    body: str, status: int, kind: str, sentence: str, tmp_path: Path
) -> None:
    command = [sys.executable, "-c", SHORT.format(body=body)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, encoding="utf-8", check=False)
    (said,) = done.stderr.strip().splitlines()
    assert (done.returncode, said.startswith(f"strandspring: {sentence}")) == (status, True)
    error = json.loads(done.stdout)["error"]
    assert error["type"] == kind
    assert error["message"].startswith(sentence)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("terminal")
def test_standard_output_that_cannot_be_written_is_one_sentence() -> None:
    for command in ("info mount.json", "info mount.json --json", "--help"):
        with Path("/dev/full").open("w") as full:
            done = ran(*command.split(), stdout=full)
        assert done.returncode == 1
        assert done.stderr.splitlines()[-1] == (
            "strandspring: Standard output cannot be written: No space left on device; send it elsewhere."
        )
    closed = f"{shlex.join(PROGRAM)} info mount.json --save copy.json --json >&-"
    done = subprocess.run(["sh", "-c", closed], stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "strandspring: Standard output is closed; send it to a file or to /dev/null.\n"
    assert not Path("copy.json").exists()
    with subprocess.Popen([*PROGRAM, "info", "mount.json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as early:
        assert early.stdout is not None
        assert early.stderr is not None
        early.stdout.close()  # a reader that leaves is no error to tell
        assert early.stderr.read() == b""


def test_a_terminal_shows_what_is_being_done_and_a_pipe_does_not(tmp_path: Path) -> None:
    record = ["identify", str(bundled_record()), "--reverse", "displacement", "-o", str(tmp_path / "spring.json")]
    shown = on_terminal([*PROGRAM, *record])
    assert re.search(r"Identifying: [a-z ]+ \([1-5] of 5\)", shown), shown
    assert len({character for character in shown if "⠀" <= character <= "⣿"}) > 3  # it moves
    assert "\x1b[3" in shown
    assert "\x1b[3" not in on_terminal([*PROGRAM, *record], NO_COLOR="1")
    piped = ran(*record)
    assert "\x1b" not in piped.stdout + piped.stderr


def test_shells_complete_commands_options_choices_and_files() -> None:
    for line, offered in (
        ("i", "identify identify-many info isolate"),
        ("synthesize ", "ni spring"),
        ("identify --re", "--reverse --report --report-mass"),
        ("identify --method ", "refined two-stage paper ni"),
        ("identify loop.csv -o r", "r"),
    ):
        words = {"COMP_WORDS": f"strandspring {line}", "COMP_CWORD": str(len(line.split(" ")))}
        told = ran(env={**os.environ, **words, "_STRANDSPRING_COMPLETE": "bash_complete"}).stdout
        assert re.findall(r"^(?:plain|file),(\S+)", told, re.M) == offered.split()
    for shell in ("bash", "zsh", "fish"):
        assert f"{shell}_complete" in ran(env={**os.environ, "_STRANDSPRING_COMPLETE": f"{shell}_source"}).stdout


def test_help_fits_80_columns_and_has_an_example(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    for command in ([], *([name] for name in COMMANDS), ["synthesize", "spring"], ["synthesize", "ni"]):
        text = terminal(*command, "--help")
        assert [line for line in text.splitlines() if len(line) > 80] == []
        assert command == ["synthesize"] or "strandspring " in text.split("Example", 1)[1]
    text = terminal("--help")
    assert all(f"  {name}" in text for name in COMMANDS)


def test_help_groups_options_and_waits_for_nothing(terminal: Terminal) -> None:
    text = terminal("identify", "--help")
    places = [text.index(f"{name} options:") for name in ("Reading", "Fitting", "Rig", "Report", "Output")]
    assert places == sorted(places)
    everything = terminal("identify", "--help-all")
    assert {"--steady", "--label"} & set(re.findall(r"--\w+", text)) == set()
    assert {"--steady", "--label"} <= set(re.findall(r"--\w+", everything))
    slow = "print({'numpy', 'scipy', 'pydantic'} & {*sys.modules})"
    code = f"import atexit, sys, strandspring.cli.main as program; atexit.register(lambda: {slow}); program.main()"
    for command in COMMANDS:
        program = [sys.executable, "-c", code, command, "--help"]
        done = subprocess.run(program, capture_output=True, text=True, check=True)
        assert done.stdout.splitlines()[-1] == "set()", command
