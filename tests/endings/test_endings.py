"""Whatever ends a program: its children and temporary folders end with it; tests/soak ends whole commands."""

from __future__ import annotations

import gc
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType

import psutil
import pytest

from strandspring.errors import StrandspringError
from strandspring.ground import scratch
from strandspring.ground.scratch import TemporaryFolder

pytestmark = pytest.mark.long
PATIENCE = 30.0  # seconds, for a busy machine
Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts a Python process, and returns when it has printed a line."""
    with ExitStack() as stack:

        def started(program: str, *arguments: str) -> subprocess.Popen[str]:
            command = [sys.executable, "-c", program, *arguments]
            pipe = subprocess.PIPE
            process = stack.enter_context(subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True))
            stack.callback(process.kill)
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            return process

        yield started


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the system has temporary files, for this process and those that it starts."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    scratch._remove_abandoned.cache_clear()
    return tmp_path


# Temporary folders

HOLDER = """
import os, sys, time
from strandspring.ground.scratch import TemporaryFolder
folder = TemporaryFolder()
(folder.path / "file").touch()
print("ready", flush=True)
if len(sys.argv) == 1:
    time.sleep(600)
if os.fork() == 0:
    raise SystemExit
os.wait()
assert folder.path.is_dir()
"""


def test_a_folder_ends_with_its_block_its_object_and_its_process(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with TemporaryFolder() as folder:
        (folder / "file").touch()
        assert folder.parent == place
        assert folder.stat().st_mode & 0o777 == 0o700
    held = TemporaryFolder()
    assert held.path.is_dir()
    del held
    assert list(place.iterdir()) == []
    # A fork leaves the folder of its parent, which ends with that.
    subprocess.run([sys.executable, "-c", HOLDER, "and leave"], check=True, capture_output=True)
    assert list(place.iterdir()) == []
    monkeypatch.setattr("tempfile.tempdir", str(place / "none"))
    with pytest.raises(StrandspringError, match=r"No temporary folder can be made in .*; set TMPDIR to a folder that"):
        TemporaryFolder()


@pytest.mark.parametrize(("module", "function"), [(os, "mkdir"), (shutil, "rmtree"), (os, "rmdir"), (os, "close")])
def test_an_interrupt_while_a_folder_is_made_or_removed_does_not_leave_it(
    module: ModuleType, function: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual, calls = getattr(module, function), list[object]()

    def interrupt(*arguments: object, **options: object) -> object:
        calls.append(arguments)
        if len(calls) == 1:
            if function in ("mkdir", "close"):
                usual(*arguments, **options)
            raise KeyboardInterrupt
        return usual(*arguments, **options)

    monkeypatch.setattr(module, function, interrupt)
    with pytest.raises(KeyboardInterrupt), TemporaryFolder() as folder:
        (folder / "file").touch()
    assert calls
    gc.collect()
    assert list(place.iterdir()) == []


def test_folders_of_killed_processes_are_removed_and_those_of_others_are_not(place: Path, start: Start) -> None:
    killed, living = start(HOLDER), start(HOLDER)
    killed.kill()
    killed.wait()
    (abandoned,) = place.glob(f"strandspring-{killed.pid}-*")
    kept = {"precious", "strandspring-1-abcdefgh", "strandspring-2-abcdefgh", "strandspring-results"}
    for name in ("precious", "strandspring-results", "strandspring-3-abcdefgh"):
        (place / name).mkdir()
    (place / "precious" / "file").touch()
    (place / "strandspring-2-abcdefgh").touch()
    for link in (place / "strandspring-1-abcdefgh", abandoned / "link"):
        link.symlink_to(place / "precious")
    if os.geteuid() == 0:
        os.chown(place / "strandspring-3-abcdefgh", 12345, 12345)  # of another user
        kept.add("strandspring-3-abcdefgh")
    with TemporaryFolder() as folder:
        (held,) = place.glob(f"strandspring-{living.pid}-*")
        assert {path.name for path in place.iterdir()} == {held.name, folder.name, *kept}
    assert (place / "precious" / "file").exists()
    assert (held / "file").exists()


CROWD = """
from strandspring.ground import scratch
print("ready", flush=True)
for _ in range(300):
    scratch._remove_abandoned.cache_clear()
    with scratch.TemporaryFolder() as folder:
        (folder / "file").touch()
        scratch._remove_abandoned.cache_clear()
        with scratch.TemporaryFolder():
            assert (folder / "file").exists()
"""


def test_processes_that_tidy_up_at_once_never_remove_what_is_in_use(place: Path, start: Start) -> None:
    crowd = [start(CROWD) for _ in range(3)]
    assert [process.wait(PATIENCE) for process in crowd] == [0, 0, 0]
    assert list(place.iterdir()) == []


# Programs that are started

PARENT = """
import os, sys, threading
from pathlib import Path
from strandspring.ground.children import kill_all, run
sleeper = "import subprocess; subprocess.run(['sleep', '600'])"
for _ in range(2):
    threading.Thread(target=run, args=([sys.executable, "-c", sleeper], Path(), os.environ), daemon=True).start()
print("ready", flush=True)
sys.stdin.readline()
kill_all()
threading.Event().wait()
"""


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM, None])
def test_programs_of_threads_end_with_the_process_that_started_them_or_on_request(
    end: int | None, start: Start
) -> None:
    parent = start(PARENT)
    # Twice the keeper, the program, and what that has started.
    deadline, left = time.monotonic() + PATIENCE, list[psutil.Process]()
    while len(left) < 6 and time.monotonic() < deadline:
        left = psutil.Process(parent.pid).children(recursive=True)
    assert len(left) == 6
    if end is None:
        assert parent.stdin is not None
        parent.stdin.close()
    else:
        parent.send_signal(end)
        parent.wait(PATIENCE)
    assert not psutil.wait_procs(left, PATIENCE)[1]


# Signals: programs, the signals that they get, their possible ends, and what they print

BUSY = """
import sys, time
from strandspring.cli import main as program
import click

@click.command()
def busy():
    try:
        print("ready", flush=True)
        for _ in range(6000):  # not one long sleep: a signal just before it began would be handled only after it
            time.sleep(0.01)
    finally:
        time.sleep(0.3)
        print("tidied up", flush=True)

program.LazyGroup.get_command = lambda *_: busy
program.main(["busy"])
"""
LOADING = """
import sys, time
from strandspring.__main__ import main

class Slow:
    def find_spec(self, name, *_):
        if name == "strandspring.cli.main":
            print("ready", flush=True)
            time.sleep(0.5)

sys.meta_path.insert(0, Slow())
sys.argv = ["strandspring", "--version"]
main()
"""
LEAVING = """
import atexit, sys, time
from strandspring.__main__ import main

def leave():
    print("ready", flush=True)
    time.sleep(0.5)

atexit.register(leave)
sys.argv = ["strandspring", "info", "--help"]
sys.stdout.write = lambda text: len(text)
try:
    main()
finally:
    del sys.stdout.write
"""
TERM, HUP, INT = signal.SIGTERM, signal.SIGHUP, signal.SIGINT
SIGNALS = [(BUSY, [TERM, TERM, HUP, INT], {128 + TERM, 128 + HUP}, "tidied up\n")]
SIGNALS += [(LOADING, [number], {128 + number}, "") for number in (TERM, HUP, INT)]
SIGNALS += [(LEAVING, [number], {0}, "") for number in (TERM, HUP, INT)]


@pytest.mark.parametrize(("program", "numbers", "ends", "printed"), SIGNALS)
def test_signals_at_any_time_are_answered_and_do_not_disturb_the_ending(
    program: str, numbers: list[int], ends: set[int], printed: str, start: Start
) -> None:
    process = start(program)
    for number in numbers:
        process.send_signal(number)
        time.sleep(0.05)
    assert process.communicate(timeout=PATIENCE)[0] == printed
    assert process.returncode in ends
