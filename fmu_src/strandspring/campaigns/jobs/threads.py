"""Work in threads, for functions of the kernel, which release the interpreter's lock."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")

_WAITING = 4  # calls handed over per thread, so that many of them take no memory


def in_threads(calls: Iterable[Callable[[], T]], workers: int | None = None) -> Iterator[T]:
    """The results of calls in their order.

    Parameters
    ----------
    calls : iterable of callables
    workers : int or None           Threads; as many as cores if None.
    """
    count = workers or usable_cores()
    waiting: deque[Future[T]] = deque()
    pool = ThreadPoolExecutor(count)
    try:
        for call in calls:
            waiting.append(pool.submit(call))
            if len(waiting) >= _WAITING * count:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def usable_cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
