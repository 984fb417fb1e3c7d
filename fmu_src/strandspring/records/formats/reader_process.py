"""Files that libraries read, in a process of its own: damaged bytes make some of them crash or take all memory.

The process, see `reader_worker`, reads one file after the other, and ends with this one, which closes its standard
input; a compiler, which would not notice that, is run by `children` instead. Where the system knows such limits
(Linux), the process may take `_MEMORY` and four times the size of the file, and a few seconds of processor time.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import os
import signal
import subprocess
import sys
import weakref
from collections.abc import Mapping
from typing import IO, Any

import numpy as np

from ...errors import RecordError
from ...ground.files import reason_of
from ...ground.isolated import ISOLATED
from ...ground.scratch import TemporaryFolder
from ..channels import Channel
from ..content import FileContent
from ..record import FloatArray

_MEMORY = 900 * 1024**2  # two channels of the most values that a record may have
_SECONDS, _BYTES_PER_SECOND = 6.0, 5e6  # of processor time, and more of it for large files
_LARGE = 50 * 1024**2  # a process that holds such a file is not kept
_PROGRAM = (
    f"import json, sys; sys.path[:] = json.loads(sys.argv[1]); from {__package__}.reader_worker import serve; serve()"
)
# Threads of libraries would take room of which little is used.
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "ARROW_IO_THREADS": "1", "MALLOC_ARENA_MAX": "2"}


def read_in_process(module: str, kind: str, content: FileContent) -> tuple[dict[str, bytes], list[Channel]]:
    """What a module of this folder reads in a file, in another process, where values of channels stay until wanted.

    Parameters
    ----------
    module : str        Name of the module.
    kind : str          Of the file, with its article, for messages.
    content : FileContent

    Returns
    -------
    (dict, list of Channel)   Texts of sheets by their names, and channels; one of them is empty.

    Raises
    ------
    RecordError   As the module raises it, or if the library crashes, or needs too much memory or time.
    """
    try:
        reader = _Reader(kind, content)
    except OSError as problem:
        raise RecordError(
            f"{content.path}: is {kind}, and the process that reads such files cannot be started "
            f"({reason_of(problem)}); free some memory, or export the record as CSV."
        ) from None
    size = len(content.data)
    limits = {"memory": _MEMORY + 4 * size, "seconds": _SECONDS + size / _BYTES_PER_SECOND}
    header, parts = reader.ask({"module": module, "path": content.path, "size": size, **limits}, content.data)
    sheets = {name: bytes(text) for name, text in zip(header.get("sheets", ()), parts, strict=True)}
    return sheets, [_channel(reader, number, fields) for number, fields in enumerate(header.get("channels", ()))]


def _channel(reader: _Reader, number: int, fields: Mapping[str, Any]) -> Channel:
    """A channel of which all but the values has been read."""

    def load() -> tuple[FloatArray, FloatArray | None]:
        values, times = (np.frombuffer(part) for part in reader.ask({"channel": number})[1])
        return values, times if fields["timed"] else None

    return Channel(**fields, load=load)


class _Reader:
    """A process that holds one file; when the last of its channels is gone, it may read another.

    Parameters
    ----------
    kind : str
    content : FileContent

    Raises
    ------
    OSError             If no process can be started.
    """

    def __init__(self, kind: str, content: FileContent) -> None:
        self._kind, self._path = kind, content.path
        self._process = _idle_process()
        weakref.finalize(self, _give_back, self._process, len(content.data))

    def ask(self, request: Mapping[str, Any], data: bytes = b"") -> tuple[dict[str, Any], list[bytearray]]:
        """The answer to a request, and what follows it; raises RecordError if it is a refusal, or the process ends."""
        process = self._process
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
        except OSError:
            _stop(process)
            is_slow = process.returncode == -getattr(signal, "SIGXCPU", 0) != 0
            raise self._damaged(
                "reading it takes too long" if is_slow else "the library that reads it crashed"
            ) from None
        except BaseException:
            _stop(process)  # it may be in the midst of an answer
            raise
        if "refusal" in header:
            raise RecordError(header["refusal"])
        if "missing" in header:
            raise RecordError(
                f"{self._path}: is {self._kind}, which needs {header['missing']} to be read; "
                'install it with pip install "strandspring[formats]".'
            )
        if "damage" in header:
            raise self._damaged(header["damage"])
        return header, parts

    def _damaged(self, reason: str) -> RecordError:
        return RecordError(
            f"{self._path}: is {self._kind} that is damaged or cut off, or of a kind that cannot be read ({reason}); "
            "export the record again, or as CSV."
        )


def _received(stream: IO[bytes], size: int) -> bytearray:
    data = bytearray(size)
    if stream.readinto(data) != size:  # type: ignore[attr-defined]
        raise BrokenPipeError
    return data


_idle: list[subprocess.Popen[bytes]] = []
_running: dict[subprocess.Popen[bytes], TemporaryFolder] = {}  # with that of its temporary files
_of_parent: list[subprocess.Popen[bytes]] = []  # neither used nor ended here


def _idle_process() -> subprocess.Popen[bytes]:
    """A process that waits for a file."""
    while _idle:
        process = _idle.pop()
        if process.poll() is None:
            return process
        _stop(process)
    # Of its own, so that nothing is left behind by a process that crashed.
    folder = TemporaryFolder()
    try:
        process = subprocess.Popen(  # noqa: S603 - this module, without a shell
            [sys.executable, "-W", "ignore", *ISOLATED, "-c", _PROGRAM, json.dumps(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            env=os.environ | _ONE_THREAD | dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder.path)),
        )
    except OSError:
        folder.close()
        raise
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
