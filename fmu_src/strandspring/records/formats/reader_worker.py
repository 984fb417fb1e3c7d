"""The other side of `reader_process`: a process that reads one file after the other for the program that started it.

A request is a file, whose sheets or channels are the answer, or the number of a channel whose values are wanted. The
process ends when its standard input is closed.
"""

from __future__ import annotations

import gc
import os
import pickle
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ...errors import RecordError
from ..channels import Channel, FloatArray
from .guarding import guarded


def serve() -> None:
    """Answer requests until there are no more."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1):  # libraries print from C too
        os.dup2(nothing, descriptor)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the program that started it handles Ctrl-C
    kind, path = "", ""
    channels: Sequence[Channel] = ()
    while True:
        try:
            request = pickle.load(requests)  # noqa: S301 - of the program that started it
        except EOFError:
            return
        answer: Any
        try:
            if isinstance(request, int):
                with guarded(kind, path):
                    answer = tuple(_plain(part) for part in channels[request].load())
            else:
                kind, path, channels = request["kind"], request["content"].path, ()
                with guarded(kind, path):
                    module = _imported(f"{__package__}.{request['module']}")
                    _limit(request["memory"], request["seconds"])
                    answer = module.read_tables(request["content"])
                if answer and isinstance(answer[0], Channel):
                    channels, answer = answer, [replace(channel, load=_elsewhere) for channel in answer]
            del request
        except RecordError as refusal:
            answer = refusal
        pickle.dump(answer, answers, protocol=5)
        answers.flush()


def _elsewhere() -> tuple[FloatArray, FloatArray | None]:
    """Stands for the values of a channel that has been sent without them."""
    raise AssertionError


def _plain(values: Any) -> FloatArray | None:
    return None if values is None else np.ascontiguousarray(values, dtype=np.float64)


def _imported(name: str) -> ModuleType:
    """A module of this folder, and with it the library that it uses."""
    if name not in sys.modules:
        _limit(None, None)  # those of the file before
        import_module(name)
        gc.collect()
        gc.freeze()  # which makes the collections after damaged files quick
    return sys.modules[name]


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
