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
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType

import psutil
import pytest

from fmu_tools import SPRING
from strandspring import Spring
from strandspring.errors import StrandspringError
from strandspring.ground import scratch
from strandspring.ground.children import kill_all, run
from strandspring.ground.endings import kept_endings
from strandspring.ground.scratch import TemporaryFolder

pytestmark = pytest.mark.long

PATIENCE = 30.0  # seconds, for a busy machine


def wait_for(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts a Python process, and returns when it has printed a line."""
    with ExitStack() as stack:

        def started(program: str, *arguments: str) -> subprocess.Popen[str]:
            command = [sys.executable, "-c", program, *arguments]
            process = stack.enter_context(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
            stack.callback(process.kill)
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            return process

        yield started


# Temporary folders


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the system has temporary files, for this process and those that it starts."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    scratch._remove_abandoned.cache_clear()
    return tmp_path


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


def test_a_folder_ends_with_its_block_its_object_and_its_process(place: Path) -> None:
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


@pytest.mark.parametrize(("module", "function"), [(os, "mkdir"), (shutil, "rmtree"), (os, "rmdir"), (os, "close")])
def test_an_interrupt_while_a_folder_is_made_or_removed_does_not_leave_it(
    module: ModuleType, function: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted = False
    usual = getattr(module, function)

    def interrupt(*arguments: object, **options: object) -> object:
        nonlocal interrupted
        if not interrupted:
            interrupted = True
            if function in ("mkdir", "close"):
                usual(*arguments, **options)
            raise KeyboardInterrupt
        return usual(*arguments, **options)

    monkeypatch.setattr(module, function, interrupt)
    with pytest.raises(KeyboardInterrupt), TemporaryFolder() as folder:
        (folder / "file").touch()
    assert interrupted
    gc.collect()
    assert list(place.iterdir()) == []


def test_folders_of_killed_processes_are_removed_and_those_of_others_are_not(place: Path, start: Start) -> None:
    killed, living = start(HOLDER), start(HOLDER)
    killed.kill()
    killed.wait()
    (abandoned,) = place.glob(f"strandspring-{killed.pid}-*")
    elsewhere = place / "precious"
    elsewhere.mkdir()
    (elsewhere / "file").touch()
    (place / "strandspring-1-abcdefgh").symlink_to(elsewhere)
    (abandoned / "link").symlink_to(elsewhere)
    (place / "strandspring-results").mkdir()
    (place / "strandspring-2-abcdefgh").touch()
    (place / "strandspring-3-abcdefgh").mkdir()
    if os.geteuid() == 0:
        os.chown(place / "strandspring-3-abcdefgh", 12345, 12345)  # of another user
    with TemporaryFolder() as folder:
        left = {path.name for path in place.iterdir()}
        (held,) = place.glob(f"strandspring-{living.pid}-*")
        kept = {"precious", "strandspring-1-abcdefgh", "strandspring-2-abcdefgh", "strandspring-results"}
        kept |= {"strandspring-3-abcdefgh"} if os.geteuid() == 0 else set()
        assert left == {held.name, folder.name, *kept}
    assert (elsewhere / "file").exists()
    assert (held / "file").exists()
    living.kill()
    living.wait()


CROWD = """
import sys
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


def test_without_a_place_for_temporary_files_a_sentence_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "none"))
    with pytest.raises(StrandspringError, match=r"No temporary folder can be made in .*; set TMPDIR to a folder that"):
        TemporaryFolder()


# Programs that are started

SLEEPER = "import subprocess; subprocess.run(['sleep', '600'])"
PARENT = f"""
import os, sys, threading
from pathlib import Path
from strandspring.ground.children import run
command = [sys.executable, "-c", {SLEEPER!r}]
threading.Thread(target=run, args=(command, Path(), os.environ), daemon=True).start()
print("ready", flush=True)
threading.Event().wait()
"""


def descendants(process: int) -> list[psutil.Process]:
    """The keeper, the program, and what that has started."""
    return psutil.Process(process).children(recursive=True)


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM])
def test_a_program_ends_with_the_process_that_started_it(end: signal.Signals, start: Start) -> None:
    parent = start(PARENT)
    wait_for(lambda: len(descendants(parent.pid)) == 3)
    left = descendants(parent.pid)
    parent.send_signal(end)
    parent.wait(PATIENCE)
    assert not psutil.wait_procs(left, PATIENCE)[1]


def test_programs_of_threads_are_killed_on_request(tmp_path: Path) -> None:
    others = {process.pid for process in descendants(os.getpid())}

    def mine() -> list[psutil.Process]:
        return [process for process in descendants(os.getpid()) if process.pid not in others]

    with ThreadPoolExecutor() as pool:
        futures = [pool.submit(run, [sys.executable, "-c", SLEEPER], tmp_path, os.environ) for _ in range(2)]
        wait_for(lambda: len(mine()) == 6)
        left = mine()
        kill_all()
        assert all(future.result(PATIENCE).returncode != 0 for future in futures)
    assert not psutil.wait_procs(left, PATIENCE)[1]


def test_a_program_that_ends_by_itself_is_as_without_a_keeper(tmp_path: Path) -> None:
    program = "import os, sys; print(os.getcwd()); print(os.environ['MINE'], file=sys.stderr); sys.exit(3)"
    done = run([sys.executable, "-c", program], tmp_path, {**os.environ, "MINE": "yours"})
    assert (done.returncode, done.stdout, done.stderr) == (3, f"{tmp_path}\n", "yours\n")


# Signals

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


def test_signals_that_follow_each_other_at_once_do_not_disturb_the_ending(start: Start) -> None:
    process = start(BUSY)
    for number in (signal.SIGTERM, signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        process.send_signal(number)
        time.sleep(0.05)
    assert process.communicate(timeout=PATIENCE)[0] == "tidied up\n"
    assert process.returncode in (128 + signal.SIGTERM, 128 + signal.SIGHUP)


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


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
@pytest.mark.parametrize("program", [LOADING, LEAVING], ids=["loading", "leaving"])
def test_a_signal_while_the_command_is_loaded_is_answered_and_does_not_change_its_end(
    program: str, number: signal.Signals, start: Start
) -> None:
    process = start(program)
    process.send_signal(number)
    assert process.communicate(timeout=PATIENCE)[0] == ""
    assert process.returncode == (128 + number if program is LOADING else 0)


def test_a_kept_signal_follows_the_block_that_did_not_look() -> None:
    before = signal.getsignal(signal.SIGTERM)
    done = []

    def block() -> None:
        with kept_endings():
            signal.raise_signal(signal.SIGTERM)
            done.append("the block")

    with pytest.raises(KeyboardInterrupt) as end:
        block()
    assert done == ["the block"]
    assert end.value.args == (signal.SIGTERM,)
    assert signal.getsignal(signal.SIGTERM) is before


INTERRUPTED_CHECK = """
import signal, sys
from pathlib import Path
import strandspring
from strandspring.fmu.checks import check
by_steps = check._by_steps

def interrupting(*arguments):
    signal.raise_signal(signal.SIGINT)
    yield from by_steps(*arguments)

check._by_steps = interrupting
from strandspring.cli.main import main
main(["build", sys.argv[1], "-o", "dist", "--backend", "python"])
"""


def test_an_interrupt_while_an_fmu_is_checked_is_not_its_fault(tmp_path: Path) -> None:
    Spring(SPRING, "mount").save(tmp_path / "mount.json")
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED_CHECK, "mount.json"],
        cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 130
    assert done.stderr.strip() == "strandspring: interrupted; no output file is half written."
    assert [path.name for path in tmp_path.iterdir()] == ["mount.json"]
