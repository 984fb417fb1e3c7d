"""Programs that this one starts, which end with it whatever ends it.

Between the two stands a Python process, the leader of a process group for the program and all that it starts. It waits
for the end of a pipe, the lifeline, that only this process holds, and then kills the group. (A parent-death signal
would do so when the thread ends that started the program.)
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path

_KEEPER = """
import os, signal, subprocess, sys, threading
child = subprocess.Popen(sys.argv[1:], stdin=subprocess.DEVNULL)
def end_with_lifeline():
    os.read(0, 1)
    if hasattr(os, "killpg"):
        os.killpg(os.getpgrp(), signal.SIGKILL)
    child.kill()
    os._exit(1)
threading.Thread(target=end_with_lifeline, daemon=True).start()
os._exit(child.wait() & 255)
"""

_lifelines: set[int] = set()
_lock = threading.Lock()


def run(command: Sequence[str], folder: Path, environment: Mapping[str, str]) -> subprocess.CompletedProcess[str]:
    """Run a program that reads no input to its end, in a folder; it is killed when this is interrupted.

    Raises
    ------
    OSError   If no process can be started.
    """
    listening, lifeline = os.pipe()
    with _lock:
        _lifelines.add(lifeline)
    try:
        with subprocess.Popen(  # noqa: S603 - commands of the package, without a shell
            [sys.executable, "-I", "-S", "-c", _KEEPER, *command],
            cwd=folder,
            env=environment,
            stdin=listening,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,
        ) as process:
            try:
                output, complaints = process.communicate()
            finally:
                _cut(lifeline)
                process.wait()
        return subprocess.CompletedProcess(command, process.returncode, output, complaints)
    finally:
        _cut(lifeline)
        os.close(listening)


def kill_all() -> None:
    """Kill the programs that threads of this process have started: whoever waits for such threads is interrupted."""
    for lifeline in list(_lifelines):
        _cut(lifeline)


def _cut(lifeline: int) -> None:
    with _lock:
        if lifeline in _lifelines:
            _lifelines.remove(lifeline)
            os.close(lifeline)
