"""Where the runs of a study are executed: in this process or on the cores of this machine; see `cluster` for others.

All of them are executors of `concurrent.futures`, so that one loop serves them. A run is a pure function of the study
and its number: neither the place nor the order matters. Linear algebra uses one thread everywhere, because several may
round differently.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from itertools import islice
from multiprocessing.connection import Connection
from types import FrameType
from typing import Any, NamedTuple, Protocol

from threadpoolctl import threadpool_limits

from ..isolation.system import IsolationError
from .definition import RunRow, Study

_MOST_WORKERS = 61  # Windows waits for no more processes
# Runs in a batch, about a second; an interrupt loses the batches in execution.
_BATCH = 8
_FEWEST_BATCHES = 64  # with fewer, workers wait for each other at the end
_PATIENCE = 60.0  # seconds without a finished run until this is reported
_GLANCE = 0.1  # seconds between two looks whether the study was interrupted


class Pool(NamedTuple):
    """An executor, the number of batches it should have at a time, and the function that runs one of them."""

    executor: Executor
    window: int
    run: Callable[[Study, Sequence[int]], list[RunRow]] = Study.rows


class Runner(Protocol):
    """Provides an executor."""

    def pool(self, batches: int) -> AbstractContextManager[Pool]:
        """An executor for so many batches, to be used in a with statement.

        Raises
        ------
        IsolationError   On leaving, if the executor fails.
        """
        ...


def finished_rows(
    study: Study, runs: Sequence[int], runner: Runner, notify: Callable[[str], None]
) -> Generator[list[RunRow], None, None]:
    """Rows of these runs, batch by batch as they finish, in any order.

    Parameters
    ----------
    study : Study
    runs : sequence of int
    runner : Runner
    notify : callable        Called with a sentence while no run finishes.

    Raises
    ------
    IsolationError           If the runs cannot be executed; what was yielded before is valid.
    KeyboardInterrupt        Between two batches, if the process is interrupted or asked to terminate.
    """
    size = max(1, min(_BATCH, len(runs) // _FEWEST_BATCHES))
    batches = (runs[first : first + size] for first in range(0, len(runs), size))
    with _interrupts_kept() as interrupted, runner.pool(-(-len(runs) // size)) as pool:
        pending: set[Future[list[RunRow]]] = set()
        waiting_since = time.monotonic()
        while True:
            if interrupted:
                raise KeyboardInterrupt(*interrupted)
            new = islice(batches, pool.window - len(pending))
            pending |= {pool.executor.submit(pool.run, study, batch) for batch in new}
            if not pending:
                return
            done, pending = wait(pending, _GLANCE, FIRST_COMPLETED)
            if done:
                waiting_since = time.monotonic()
            elif time.monotonic() - waiting_since > _PATIENCE:
                notify(f"No run has finished for {_PATIENCE:g} s; still waiting for the workers.")
                waiting_since = time.monotonic()
            for future in done:
                yield future.result()


@contextmanager
def _interrupts_kept() -> Iterator[list[int]]:
    """Keep the number of the first signal, which would otherwise strike anywhere.

    An exception inside an executor may leave a lock behind, and so hang the program, or be lost in a callback. A second
    interrupt strikes at once.
    """
    interrupted: list[int] = []

    def keep(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
        if interrupted:
            raise KeyboardInterrupt(number)
        interrupted.append(number)

    if threading.current_thread() is not threading.main_thread():
        yield interrupted  # signals are handled in the main thread
        return
    before = {number: signal.signal(number, keep) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield interrupted
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _InlineExecutor(Executor):
    """Executes a batch when it is submitted."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@dataclass(frozen=True)
class Local:
    """Processes of this machine.

    Parameters
    ----------
    workers : int or None   Number of processes; 1 for this one alone, as many as cores if None.
    """

    workers: int | None = None

    @contextmanager
    def pool(self, batches: int) -> Iterator[Pool]:
        """See `Runner`."""
        workers = min(self.workers or _usable_cores(), batches, _MOST_WORKERS)
        if workers <= 1:
            with threadpool_limits(limits=1):
                yield Pool(_InlineExecutor(), 1)
            return
        # A fork would inherit locks of other threads, such as that of the progress bar.
        context = multiprocessing.get_context("spawn")
        listening, lifeline = context.Pipe(duplex=False)
        executor = ProcessPoolExecutor(workers, context, initializer=_start_worker, initargs=(listening,))
        try:
            yield Pool(executor, 2 * workers)
        except BrokenProcessPool:
            raise IsolationError(
                "A worker process died, perhaps for want of memory; run the study with fewer workers."
            ) from None
        except BaseException:
            lifeline.close()  # the workers leave without finishing their batches
            raise
        finally:
            executor.shutdown(cancel_futures=True)
            lifeline.close()
            listening.close()


def _usable_cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _start_worker(listening: Connection) -> None:
    """Prepare a worker process: the parent handles interrupts, and the worker ends with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(limits=1)
    threading.Thread(target=_leave_with_lifeline, args=(listening,), daemon=True).start()


def _leave_with_lifeline(listening: Connection) -> None:
    """Leave when the parent's end closes, also because it was killed: the queue would be waited on for ever."""
    listening.poll(None)
    os._exit(1)
