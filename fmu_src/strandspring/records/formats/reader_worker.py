"""The other side of `reader_process`: a process that reads one file after the other for the program that started it.

A request is a line of JSON, followed by the bytes of the file if it is a new one; so is an answer, followed by the
values of channels or the text of sheets. The process ends when its standard input is closed.
"""

from __future__ import annotations

import gc
import json
import os
import re
import signal
import sys
import time
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import IO, Any

import numpy as np

from ...errors import RecordError
from ...ground.quoting import quoted
from ..channels import Channel
from ..content import FileContent

_OBJECT = re.compile(r"<[\w.]+ object at 0x[0-9a-fA-F]+>")  # the bytes of the file, as libraries name them


def serve() -> None:
    """Answer requests until there are no more."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1):  # libraries print from C too
        os.dup2(nothing, descriptor)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the program that started it handles Ctrl-C
    reader = _Reader()
    while line := requests.readline():
        header, parts = reader.answer(json.loads(line), requests)
        if "damage" in header:
            gc.collect()  # what libraries leave open
        views = [memoryview(part) for part in parts]
        answers.write(json.dumps({**header, "sizes": [view.nbytes for view in views]}).encode() + b"\n")
        for view in views:
            answers.write(view)
        answers.flush()


class _Reader:
    """Reads a file, and keeps its channels until the next."""

    def __init__(self) -> None:
        self._channels: Sequence[Channel] = ()

    def answer(self, request: dict[str, Any], data: IO[bytes]) -> tuple[dict[str, Any], Sequence[Any]]:
        """What a request asks for, or why there is none: a header, and buffers that follow it."""
        try:
            if "module" in request:
                self._channels = ()
                return self._read(request, data.read(request["size"]))
            return {}, self._values(request["channel"])
        except RecordError as refusal:
            return {"refusal": str(refusal)}, ()
        except ImportError as problem:
            return {"missing": problem.name or "a library"}, ()
        except MemoryError:
            return {"damage": "it declares more data than fits into memory"}, ()
        # Libraries report damaged files by exceptions of every kind, those in Rust by a BaseException.
        except BaseException as problem:
            text = " ".join(_OBJECT.sub("the file", str(problem)).split())
            return {"damage": quoted(text) if text else type(problem).__name__}, ()

    def _read(self, request: dict[str, Any], data: bytes) -> tuple[dict[str, Any], Sequence[bytes]]:
        """Names and texts of the sheets of a file, or its channels without their values."""
        module = _imported(f"{__package__}.{request['module']}")
        _limit(request["memory"], request["seconds"])
        read = module.read_tables(FileContent(request["path"], data, ""))
        if isinstance(read, dict):
            return {"sheets": list(read)}, list(read.values())
        self._channels = read
        return {"channels": [_described(channel) for channel in read]}, ()

    def _values(self, number: int) -> Sequence[Any]:
        """Values and times of a channel, ndarrays of shape (K,); no times have shape (0,)."""
        arrays = self._channels[number].load()
        return [np.ascontiguousarray([] if part is None else part, dtype=np.float64) for part in arrays]


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
