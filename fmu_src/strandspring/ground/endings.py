"""Signals that end a program: what they are here, and how a block handles them or holds them back."""

from __future__ import annotations

import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import NoReturn

# SIGHUP, which Windows lacks, comes when a terminal is closed.
_ENDINGS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
_BURST = 0.5  # [s]
_burst = [-math.inf]  # when the last signal came


def interrupt(number: int, frame: FrameType | None) -> NoReturn:  # noqa: ARG001
    """Let SIGTERM and SIGHUP end the program as Ctrl-C does, so that nothing is left behind."""
    raise KeyboardInterrupt(number)


def status_and_sentence(end: BaseException) -> tuple[int, str]:
    """The exit status of a program that a signal ends, as of shells, and what there is to say.

    What raises KeyboardInterrupt for another signal than SIGINT names it.
    """
    cause = end if isinstance(end, KeyboardInterrupt) else end.__cause__
    number = cause.args[0] if isinstance(cause, KeyboardInterrupt) and cause.args else signal.SIGINT
    word = "interrupted" if number == signal.SIGINT else "terminated"
    return 128 + number, f"{word}; no output file is half written."


@contextmanager
def handled_endings(handler: Callable[[int, FrameType | None], None], to_the_end: bool = False) -> Iterator[None]:
    """Call a handler for the signals that end the program, except those that it was set to ignore, as by `nohup`.

    Signals that follow each other at once count as one: `timeout` sends two, and so do shells whose terminal is closed.
    Nothing happens outside the main thread, which alone handles signals. After the block they do what they did before;
    or nothing, if the program has come to its end and said how: Python takes a while to leave.
    """

    def handle_burst(number: int, frame: FrameType | None) -> None:
        now = time.monotonic()
        is_first, _burst[:] = now - _burst[0] > _BURST, [now]
        if is_first:
            handler(number, frame)

    before = {}
    if threading.current_thread() is threading.main_thread():
        before = {number: signal.getsignal(number) for number in _ENDINGS}
    before = {number: old for number, old in before.items() if old not in (signal.SIG_IGN, None)}
    for number in before:
        signal.signal(number, handle_burst)
    try:
        yield
    finally:
        for number, old in before.items():
            signal.signal(number, signal.SIG_IGN if to_the_end else old)


@contextmanager
def kept_endings() -> Iterator[list[int]]:
    """Keep the number of the first signal, which would otherwise strike anywhere; a second one strikes at once.

    The block may end early for it; in any case KeyboardInterrupt follows the block, unless that raised something else.
    An exception inside an executor may leave a lock behind, and so hang the program, or be lost in a callback.
    """
    kept: list[int] = []

    def keep(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
        if kept:
            raise KeyboardInterrupt(number)
        kept.append(number)

    with handled_endings(keep):
        yield kept
    if kept:
        raise KeyboardInterrupt(*kept)


@contextmanager
def held_endings() -> Iterator[None]:
    """Hold back signals that end the program; processes that are started meanwhile never get them unless they ask to.

    Nothing is held back on Windows.
    """
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDINGS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def leave_interrupts_to_parent() -> None:
    """In a process that was started with endings held back: get them, but for those that its parent answers.

    These go to all processes of a group, such as Ctrl-C, and this one becomes a group of its own.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if sys.platform != "win32":
        os.setpgrp()
        signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDINGS)
