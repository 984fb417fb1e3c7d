"""Files that libraries read, in a process of its own: damaged bytes make some of them crash or take all memory.

The process reads one file after the other, and ends with this one, which closes its standard input. A request and its
answer are a line of JSON each, followed by bytes. Where the system knows such limits
(Linux), the process may take `_MEMORY` and four times the size of the file, and a few seconds of processor time.
"""

from __future__ import annotations

import atexit
import contextlib
import gc
import json
import os
import signal
import subprocess
import sys
import time
import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import IO, Any

import numpy as np

from ...errors import RecordError
from ...scratch import TemporaryFolder
from ..channels import Channel, FloatArray
from ..content import Content
from .guarding import damaged, guarded

_MEMORY = 900 * 1024**2  # two channels of the most values that a record may have
_SECONDS, _BYTES_PER_SECOND = 6.0, 5e6  # of processor time, and more of it for large files
_LARGE = 50 * 1024**2  # a process that holds such a file is not kept
_PROGRAM = "import json, sys; sys.path[:] = json.loads(sys.argv[1]); from {0} import answer; answer()"
# Threads of libraries would take room of which little is used.
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "ARROW_IO_THREADS": "1", "MALLOC_ARENA_MAX": "2"}


@dataclass(frozen=True)
class Sheet:
    """A sheet of a workbook as text.

    Attributes
    ----------
    name : str
    data : bytes   UTF-8, a line per row, tabs between the cells.
    """

    name: str
    data: bytes


def read_apart(module: str, kind: str, content: Content) -> list[Channel] | list[Sheet]:
    """What a module of this folder reads in a file, in another process, where values of channels stay until wanted.

    Parameters
    ----------
    module : str        Name of the module.
    kind : str          Of the file, with its article, for messages.
    content : Content

    Raises
    ------
    RecordError   As the module raises it, or if the library crashes, or needs too much memory or time.
    """
    loan = _Loan(kind, content)
    size = len(content.data)
    limits = {"memory": _MEMORY + 4 * size, "seconds": _SECONDS + size / _BYTES_PER_SECOND}
    reply = loan.ask({"module": module, "kind": kind, "path": content.path, "size": size, **limits}, content.data)
    if "sheets" in reply.header:
        return [Sheet(name, bytes(data)) for name, data in zip(reply.header["sheets"], reply.parts, strict=True)]
    return [_channel(loan, number, one) for number, one in enumerate(reply.header["channels"])]


def _channel(loan: _Loan, number: int, found: Mapping[str, Any]) -> Channel:
    def load() -> tuple[FloatArray, FloatArray | None]:
        values, times = (np.frombuffer(part) for part in loan.ask({"load": number}).parts)
        return values, times if found["timed"] else None

    return Channel(**found, load=load)


@dataclass(frozen=True)
class _Reply:
    header: dict[str, Any]
    parts: list[bytearray]


class _Loan:
    """A process as long as the channels of one file live, of which it then may read another."""

    def __init__(self, kind: str, content: Content) -> None:
        self.kind, self.where = kind, content.path
        self.process = _process()
        self._end = weakref.finalize(self, _give_back, self.process, len(content.data))

    def ask(self, request: Mapping[str, Any], data: bytes = b"") -> _Reply:
        """The reply to a request."""
        process = self.process
        assert process.stdin is not None  # noqa: S101 - both are pipes
        assert process.stdout is not None  # noqa: S101
        try:
            process.stdin.write(json.dumps(request).encode() + b"\n")
            process.stdin.write(data)
            process.stdin.flush()
            line = process.stdout.readline()
            if not line.endswith(b"\n"):
                raise BrokenPipeError
            header = json.loads(line)
            parts = [_received(process.stdout, size) for size in header["sizes"]]
        except BaseException as problem:
            _stop(process)  # it may be in the midst of an answer
            if isinstance(problem, OSError):
                raise damaged(self.kind, self.where, _reason(process.returncode)) from None
            raise
        if "refusal" in header:
            raise RecordError(header["refusal"])
        return _Reply(header, parts)


def _received(stream: IO[bytes], size: int) -> bytearray:
    data = bytearray(size)
    if stream.readinto(data) != size:  # type: ignore[attr-defined]
        raise BrokenPipeError
    return data


def _reason(status: int) -> str:
    limits = {-getattr(signal, "SIGXCPU", 0): "reading it takes too long"}
    return limits.get(status, "its library stops working")


# ------------------------------------------------------------------------------ processes

_idle: list[subprocess.Popen[bytes]] = []
_running: dict[subprocess.Popen[bytes], TemporaryFolder] = {}  # with that of its temporary files
_of_parent: list[subprocess.Popen[bytes]] = []  # neither used nor ended here


def _process() -> subprocess.Popen[bytes]:
    """A process that waits for a file."""
    while _idle:
        process = _idle.pop()
        if process.poll() is None:
            return process
        _stop(process)
    # Of its own, so that nothing is left behind by a process that crashed.
    folder = TemporaryFolder()
    process = subprocess.Popen(  # noqa: S603 - this module, without a shell
        [sys.executable, "-c", _PROGRAM.format(__name__), json.dumps(sys.path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
        env=os.environ | _ONE_THREAD | dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder.path)),
    )
    _running[process] = folder
    return process


def _give_back(process: subprocess.Popen[bytes], size: int) -> None:
    if process not in _running:
        return
    if _idle or size > _LARGE:
        _stop(process)
    else:
        _idle.append(process)


def _stop(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    for stream in (process.stdin, process.stdout):
        assert stream is not None  # noqa: S101 - both are pipes
        with contextlib.suppress(OSError):  # what was not yet written is lost with the process
            stream.close()
    process.wait()
    if process in _running:
        _running.pop(process).close()


@atexit.register
def _stop_all() -> None:
    _idle.clear()
    for process in [*_running]:
        _stop(process)


def _leave_to_parent() -> None:
    """After a fork."""
    _of_parent.extend(_running)
    _idle.clear()
    _running.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_leave_to_parent)


# ------------------------------------------------------------------------------ the other side


def answer() -> None:
    """Answer requests until there are no more."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1):  # libraries print from C too
        os.dup2(nothing, descriptor)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    channels: list[Channel] = []
    kind = where = ""
    while line := requests.readline():
        request = json.loads(line)
        parts: list[Any] = []
        try:
            if "module" in request:
                kind, where = request["kind"], request["path"]
                channels = []
                content = Content(where, requests.read(request["size"]), "")
                with guarded(kind, where):
                    module = _imported(f"{__package__}.{request['module']}")
                    _limit(request["memory"], request["seconds"])
                    found = module.read_tables(content)
                if found and isinstance(found[0], Sheet):
                    header: dict[str, Any] = {"sheets": [sheet.name for sheet in found]}
                    parts = [sheet.data for sheet in found]
                else:
                    channels = found
                    header = {"channels": [_described(channel) for channel in channels]}
            else:
                with guarded(kind, where):
                    arrays = channels[request["load"]].load()
                    parts = [np.ascontiguousarray([] if part is None else part, dtype=np.float64) for part in arrays]
                header = {}
        except RecordError as refusal:
            header, parts = {"refusal": str(refusal)}, []
        views = [memoryview(part) for part in parts]
        answers.write(json.dumps(header | {"sizes": [view.nbytes for view in views]}).encode() + b"\n")
        for view in views:
            answers.write(view)
        answers.flush()


def _imported(name: str) -> ModuleType:
    """A module of this folder, and with it the library that it uses."""
    if name not in sys.modules:
        _limit(None, None)  # those of the file before
        import_module(name)
        gc.collect()
        gc.freeze()  # which makes the collections after damaged files quick
    return sys.modules[name]


def _described(channel: Channel) -> dict[str, Any]:
    return {name: getattr(channel, name) for name in ("group", "name", "unit", "size", "timed")}


def _limit(memory: int | None, seconds: float | None) -> None:
    """Limit what may be taken from now on of memory [B] and processor time [s]; None for no limit."""
    if not sys.platform.startswith("linux"):
        return
    import resource

    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limits = (
        (resource.RLIMIT_AS, None if memory is None else pages * resource.getpagesize() + memory),
        (resource.RLIMIT_CPU, None if seconds is None else int(time.process_time() + seconds) + 1),
        (resource.RLIMIT_CORE, 0),
    )
    for limit, most in limits:
        _, hard = resource.getrlimit(limit)
        soft = hard if most is None or (hard != resource.RLIM_INFINITY and most > hard) else most
        resource.setrlimit(limit, (soft, hard))
