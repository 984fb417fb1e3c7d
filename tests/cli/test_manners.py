"""How the command line behaves towards shells and terminals: status, JSON of refusals, signals, outputs, completion."""

from __future__ import annotations

import json
import os
import pty
import re
import shlex
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from springs import MOUNT
from strandspring import Spring, bundled_record
from strandspring.api.common.text_table import table_lines
from strandspring.cli.main import COMMANDS
from strandspring.cli.shared.output import progress, reporting_kept
from strandspring.errors import StrandspringError
from strandspring.ground.files import refuse_unwritable, write_text
from terminal import Terminal
from tools import program as found

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = [sys.executable, "-W", "error", "-m", "strandspring"]


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Terminal:
    monkeypatch.chdir(tmp_path)
    Spring(MOUNT, "mount").save("mount.json")
    return Terminal(capsys)


def on_terminal(command: list[str], columns: int, **environment: str) -> str:
    """What a program writes to a terminal of so many columns."""
    main, side = pty.openpty()
    settings = {**os.environ, "TERM": "xterm-256color", "COLUMNS": str(columns), **environment}
    with subprocess.Popen(command, stdout=side, stderr=side, stdin=side, env=settings) as process:
        os.close(side)
        content = b""
        while True:
            try:
                part = os.read(main, 65536)
            except OSError:  # Linux says so when nobody writes any more
                break
            content += part
            if not part:
                break
    os.close(main)
    assert process.returncode == 0, content
    return content.decode().replace("\r\n", "\n")


# Status and JSON


@pytest.mark.parametrize(
    ("arguments", "status", "error"),
    [
        ("isolate mount.json --mass -3", 2,
         {"type": "UsageError", "message": "Invalid value for '--mass': must be a finite number > 0 [kg], got -3."}),
        ("study mount.json --mass abc -o s.csv", 2,
         {"type": "UsageError", "message": "Invalid value for '--mass': must be a finite number > 0 [kg], got abc."}),
        ("isolate mount.json", 2, {"type": "UsageError", "message": "Missing option '--mass'."}),
        ("nonsense", 2, {"type": "UsageError", "message": "No such command 'nonsense'."}),
        ("identfy", 2, {"type": "UsageError", "message": "No such command 'identfy'. Did you mean 'identify'?"}),
        ("info missing.json", 1,
         {"type": "ModelError", "message": "missing.json: no such file; check the path."}),
        ("predict mount.json missing.csv", 1,
         {"type": "RecordError", "message": "missing.csv: no such file; check the path."}),
    ],
)  # fmt: skip
def test_a_refusal_is_json_too(terminal: Terminal, arguments: str, status: int, error: dict[str, str]) -> None:
    assert terminal(*arguments.split(), status=status) == ""
    said = terminal.err
    assert error["message"] in said.splitlines()[-1]
    assert json.loads(terminal(*arguments.split(), "--json", status=status)) == {"error": error}
    assert terminal.err == said
    assert terminal(*arguments.split(), "--", "--json", status=status if status == 2 else 1) == ""


def test_an_outcome_is_named_in_json(terminal: Terminal) -> None:
    Path("one_way.csv").write_text("x [mm],F [N]\n" + "".join(f"{k},{k}\n" for k in range(50)), encoding="utf-8")
    error = json.loads(terminal("identify", "one_way.csv", "-o", "m.json", "--json", status=1))["error"]
    assert error["type"] == "IdentificationError"
    assert error["outcome"] == "too_few_strokes"
    assert error["message"].startswith("one_way.csv")


SLOW = """
import sys, time
from pathlib import Path
import click
from strandspring.cli import main as program
from strandspring.ground.files import replacing

@click.command()
@click.option("--json", is_flag=True)
def slow(json):
    with replacing(Path("out.json")) as part:
        part.write_text("{")
        print("working", file=sys.stderr, flush=True)
        for _ in range(6000):  # not one long sleep: a signal just before it began would be handled only after it
            time.sleep(0.01)

program.LazyGroup.get_command = lambda *_: slow
program.main(["slow", "--json"])
"""


@pytest.mark.parametrize(
    ("number", "word"),
    [(signal.SIGINT, "interrupted"), (signal.SIGTERM, "terminated"), (signal.SIGHUP, "terminated")],
)
def test_a_signal_gives_the_status_of_shells_and_leaves_nothing(tmp_path: Path, number: int, word: str) -> None:
    command = [sys.executable, "-c", SLOW]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == "working\n"
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert err.strip() == f"strandspring: {word}; no output file is half written."
    assert json.loads(out)["error"] == {"type": "Interrupt", "message": f"{word}; no output file is half written."}
    assert list(tmp_path.iterdir()) == []


def test_modules_beside_records_are_not_run(tmp_path: Path) -> None:
    for name in ("numpy", "attrs", "click"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('a file beside the records was run')")
    done = subprocess.run([*PROGRAM, "info", "none.json"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stderr == "strandspring: none.json: no such file; check the path.\n"


FAILING = """
import errno, os
import click
from strandspring.cli import main as program

@click.command()
@click.option("--json", is_flag=True)
def failing(json):
    raise {fault}

program.LazyGroup.get_command = lambda *_: failing
program.main(["failing", "--json"])
"""


@pytest.mark.parametrize(
    ("fault", "kind", "sentence"),
    [
        ("OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))", "OSError", "No space left on device; check the path"),
        ("OSError(errno.EIO, os.strerror(errno.EIO), 'a\\x1b[2Jb')", "OSError", "a\ufffd[2Jb: Input/output error; "),
        ("OSError()", "OSError", "OSError; check the path"),
        ("MemoryError()", "MemoryError", "There is not enough memory for this; "),
    ],
)
def test_whatever_the_system_refuses_is_a_sentence(fault: str, kind: str, sentence: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", FAILING.format(fault=fault)], capture_output=True, encoding="utf-8", check=False
    )
    assert done.returncode == 1
    assert done.stderr.startswith(f"strandspring: {sentence}")
    assert done.stderr.count("\n") == 1
    error = json.loads(done.stdout)["error"]
    assert error["type"] == kind
    assert error["message"].startswith(sentence)


def test_a_closed_standard_output_is_refused_before_work_begins(tmp_path: Path) -> None:
    Spring(MOUNT, "mount").save(tmp_path / "mount.json")
    command = f"{shlex.join(PROGRAM)} info mount.json --save copy.json --json >&-"
    done = subprocess.run(["sh", "-c", command], cwd=tmp_path, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "strandspring: Standard output is closed; send it to a file or to /dev/null.\n"
    assert not (tmp_path / "copy.json").exists()


def test_odd_arguments_are_refused_without_a_traceback(terminal: Terminal) -> None:
    for argument in ("x" * 100_000, "a\nb", "\udcff.json", "/" * 5000):
        terminal("info", argument, status=1)
        terminal("isolate", "mount.json", "--mass", argument, status=2)
    terminal("docs", "limits", "--text", "-o", "limits.html", status=2)
    done = subprocess.run([*PROGRAM, "info", "mount.json", "--save", b"\xff.json"], capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert b"Model file: \\udcff.json" in done.stdout


# Outputs


@pytest.fixture
def open_folder() -> Iterator[Path]:
    """A folder that every user may enter, unlike `tmp_path`."""
    with tempfile.TemporaryDirectory() as name:
        Path(name).chmod(0o777)
        yield Path(name)


@contextmanager
def ordinary_user() -> Iterator[None]:
    """Without the superuser's right to write everywhere."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


@contextmanager
def umask(mask: int) -> Iterator[None]:
    before = os.umask(mask)
    try:
        yield
    finally:
        os.umask(before)


def test_outputs_are_checked_before_work_begins(terminal: Terminal, open_folder: Path) -> None:
    (open_folder / "locked").mkdir(mode=0o500)
    Path("file").touch()
    for output in (open_folder / "locked/m.json", open_folder / "locked/new/m.json", "file/m.json", "/dev/null", "."):
        with ordinary_user(), pytest.raises(StrandspringError, match="cannot be written"):
            refuse_unwritable(Path(output))
    for output in ("file/m.json", "/dev/null", f"{'x' * 300}.json"):
        terminal("identify", "missing.csv", "-o", output, status=1)  # the record would be missed next
        assert f"{output} cannot be written: " in terminal.err
    assert sorted(path.name for path in Path().iterdir()) == ["file", "mount.json"]
    refuse_unwritable(Path("new/folder/m.json"))
    assert not Path("new").exists()


@pytest.mark.parametrize(
    ("command", "written"),
    [
        ("show loop.csv -o page.csv", ".html"),
        ("identify loop.csv -o model.xlsx", ".json"),
        ("info mount.json --save mount.fmu", ".json"),
        ("predict mount.json loop.csv -o out.xlsx", ".csv"),
        ("isolate mount.json --mass 5 -o out.json", ".csv"),
        ("study mount.json --mass 5 -o out.PARQUET", ".csv"),
        ("synthesize spring mount.json -o record.mat", ".csv"),
        ("synthesize ni -o record.h5", ".csv"),
        ("synthesize ni -o record.csv --clean clean.xlsx", ".csv"),
    ],
)
def test_a_name_that_promises_another_format_is_refused(terminal: Terminal, command: str, written: str) -> None:
    terminal(*command.split(), status=2)
    assert f"would be written as {written}; give a name that ends in {written}." in terminal.err
    assert [path.name for path in Path().iterdir()] == ["mount.json"]


def test_files_are_written_as_by_other_programs(open_folder: Path) -> None:
    with umask(0o027):
        write_text(open_folder / "new", "a")
    assert (open_folder / "new").stat().st_mode & 0o777 == 0o640
    (open_folder / "new").chmod(0o604)
    write_text(open_folder / "new", "b")
    assert (open_folder / "new").stat().st_mode & 0o777 == 0o604
    (open_folder / "folder").mkdir()
    (open_folder / "link").symlink_to("folder/target")
    for text in ("created", "changed"):
        write_text(open_folder / "link", text)
        assert (open_folder / "link").is_symlink()
        assert (open_folder / "folder/target").read_text(encoding="utf-8") == text
    (open_folder / "new").chmod(0o444)
    with ordinary_user(), pytest.raises(StrandspringError, match=r"new cannot be written: Permission denied; check "):
        write_text(open_folder / "new", "c")
    assert (open_folder / "new").read_text(encoding="utf-8") == "b"
    assert sorted(path.name for path in open_folder.iterdir()) == ["folder", "link", "new"]


# Terminals


def test_tables_fit_the_terminal_and_keep_their_lines_in_a_pipe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("rubber_hinge.json", "records/rubber_stretch.csv"):
        (tmp_path / Path(name).name).write_bytes((ROOT / "models" / name).read_bytes())
    command = [*PROGRAM, "info", "rubber_hinge.json", "rubber_stretch.csv", "--reverse", "displacement", "--verbose"]
    lines = on_terminal(command, 80).partition("as in the FMU.\n")[2].splitlines()
    assert len(lines) > 8
    assert max(map(len, lines)) <= 80
    assert sum("rubber_stretch.csv" in line for line in lines) == 2  # one table below the other
    piped = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    table = piped.partition("as in the FMU.\n")[2].splitlines()
    assert table[0].split()[:2] == ["amplitude", "mm"]
    assert table[1].endswith("rubber_stretch.csv (2 cycles, 0.0152 Hz)")
    numbers = {word for line in table for word in line.split() if word.replace(".", "").lstrip("+-").isdigit()}
    assert numbers <= {word for line in lines for word in line.split()}
    assert "\x1b" not in piped


def test_narrow_tables_lose_nothing() -> None:
    rng = np.random.default_rng(0)
    headings = [*(f"heading {k} mm" for k in range(12)), "source"]
    sources = ("model", "a/long/path/to/the/record.csv (3 cycles)", "弹簧.csv")
    rows = [[*(f"{value:.4g}" for value in rng.standard_normal(12)), source] for source in sources]
    assert max(map(len, table_lines(headings, rows, ["source"], 300))) > 180
    for width in (30, 60, 80, 120):
        lines = table_lines(headings, rows, ["source"], width)
        assert max(map(len, lines)) <= width
        words = " ".join(lines).split()
        assert all(cell in words for row in rows for cell in row[:-1])


@pytest.mark.parametrize(
    "command", [(), *((name,) for name in COMMANDS), ("synthesize", "spring"), ("synthesize", "ni")]
)
def test_help_fits_80_columns(terminal: Terminal, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...]) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    assert [line for line in terminal(*command, "--help").splitlines() if len(line) > 80] == []


BARS = """
import time
from strandspring.cli.shared.output import progress
for _ in progress(range(4), "Reading records"):
    time.sleep(0.3)
"""


def test_bars_move_on_a_terminal_only() -> None:
    shown = on_terminal([sys.executable, "-c", BARS], 80)
    for part in ("Reading records", "0/4", "1/4", "3/4", "0:00:01"):
        assert part in shown, shown
    spinner = {character for character in shown if "⠀" <= character <= "⣿"}
    assert len(spinner) > 3  # it moves while one part takes long
    assert "\x1b[3" in shown
    assert "\x1b[3" not in on_terminal([sys.executable, "-c", BARS], 80, NO_COLOR="1")
    piped = subprocess.run([sys.executable, "-c", BARS], capture_output=True, check=True)
    assert piped.stdout + piped.stderr == b""


def test_a_terminal_shows_the_stage_of_an_identification(tmp_path: Path) -> None:
    record = ["identify", str(bundled_record()), "--reverse", "displacement"]
    shown = on_terminal([*PROGRAM, *record, "-o", str(tmp_path / "spring.json")], 80)
    assert re.search(r"Identifying: [a-z ]+ \([1-5] of 5\)", shown), shown


def test_items_pass_through_without_a_terminal() -> None:
    assert list(progress([1, 2, 3], "Counting")) == [1, 2, 3]


# Completion


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """What bash offers for the last word of a command line; `compopt -o default` are the names of files."""
    program = tmp_path / "bin" / "strandspring"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {shlex.join(PROGRAM)} "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.chdir(tmp_path)
    settings = {**os.environ, "_STRANDSPRING_COMPLETE": "bash_source"}
    source = subprocess.run(["strandspring"], env=settings, capture_output=True, text=True, check=True).stdout
    return lambda line: offered(source, line)


def offered(source: str, line: str) -> list[str]:
    script = f"""
        {source}
        COMP_WORDS=({line.removesuffix(" ")}{' ""' if line.endswith(" ") else ""})
        COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
        compopt() {{ echo "compopt $@"; }}  # works only for the Tab key
        $(complete -p strandspring | sed 's/.*-F \\([^ ]*\\).*/\\1/') strandspring
        printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    bash = found("bash", package="bash")
    done = subprocess.run([bash, "-c", script], capture_output=True, text=True, timeout=60, check=True)
    assert done.stderr == ""
    return done.stdout.split()


def test_bash_completes_commands_options_choices_and_files(shell: Any) -> None:
    assert shell("strandspring i") == ["identify", "identify-many", "info", "isolate"]
    assert shell("strandspring synthesize ") == ["ni", "spring"]
    assert shell("strandspring identify --re") == ["--reverse", "--report", "--report-mass"]
    assert shell("strandspring identify --method ") == ["refined", "two-stage", "paper", "ni"]
    assert (
        shell("strandspring identify r") == shell("strandspring identify loop.csv -o r") == ["compopt", "-o", "default"]
    )


@pytest.mark.parametrize("name", ["bash", "zsh", "fish"])
def test_every_shell_has_its_script(name: str) -> None:
    settings = {**os.environ, "_STRANDSPRING_COMPLETE": f"{name}_source"}
    done = subprocess.run(PROGRAM, env=settings, capture_output=True, text=True, check=True)
    assert "_STRANDSPRING_COMPLETE" in done.stdout
    words = {"COMP_WORDS": "strandspring ide", "COMP_CWORD": "1" if name != "fish" else "ide"}
    settings = {**os.environ, **words, "_STRANDSPRING_COMPLETE": f"{name}_complete"}
    done = subprocess.run(PROGRAM, env=settings, capture_output=True, text=True, check=True)
    assert "identify" in done.stdout


@pytest.mark.parametrize(
    ("finished", "is_there", "expected"),
    [
        (3, True, "3 of 8 runs are kept in runs.sqlite; the same command continues from there."),
        (0, True, "Finished runs are kept in runs.sqlite; the same command continues from there."),
        (8, False, ""),
    ],
)
def test_what_is_kept_is_said_whenever_it_is_there(
    finished: int, is_there: bool, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)

    def run() -> None:
        with reporting_kept("runs", Path("runs.sqlite")) as progress:
            if finished:
                progress("Running", finished, 8)
            if is_there:
                Path("runs.sqlite").touch()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run()
    assert capsys.readouterr().err.replace("\n  ", " ").strip() == expected
