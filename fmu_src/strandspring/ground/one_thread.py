"""Linear algebra in one thread: of small matrices more threads only cost, and their number changes the last bits."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from threading import Lock

from threadpoolctl import ThreadpoolController

_lock, _limit = Lock(), ExitStack()
_users: list[None] = []


@contextmanager
def one_thread() -> Iterator[None]:
    """BLAS of the whole process uses one thread until the last of those who asked for it, in any thread, has left."""
    with _lock:
        if not _users:
            _limit.enter_context(_controller().limit(limits=1, user_api="blas"))
        _users.append(None)
    try:
        yield
    finally:
        with _lock:
            _users.pop()
            if not _users:
                _limit.close()


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()
