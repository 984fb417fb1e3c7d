"""Where the runs of a study are done: in this process or on the cores of this machine; see `cluster` for others.

A run is a pure function of the study and its number, so that it does not matter where, or in which order. Linear
algebra takes one thread everywhere, because more of them may round differently.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Generator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Protocol

from threadpoolctl import threadpool_limits

from ..isolation.system import IsolationError
from .definition import RunRow, Study

_MOST_WORKERS = 61  # Windows waits for no more processes


class Runner(Protocol):
    """Does batches of runs."""

    def rows(self, study: Study, batches: Sequence[Sequence[int]]) -> Generator[list[RunRow], None, None]:
        """Rows of each batch as it finishes, in any order.

        Raises
        ------
        IsolationError   If the means to run them fail; what was yielded before stays good.
        """
        ...


@dataclass(frozen=True)
class InProcess:
    """One run after the other in this process."""

    def rows(self, study: Study, batches: Sequence[Sequence[int]]) -> Generator[list[RunRow], None, None]:
        """See `Runner`."""
        for batch in batches:
            with threadpool_limits(limits=1):
                rows = study.rows(batch)
            yield rows


@dataclass(frozen=True)
class LocalProcesses:
    """Several processes of this machine.

    Parameters
    ----------
    workers : int or None   Processes; as many as cores if None.
    """

    workers: int | None = None

    def rows(self, study: Study, batches: Sequence[Sequence[int]]) -> Generator[list[RunRow], None, None]:
        """See `Runner`."""
        workers = min(self.workers or _cores(), len(batches), _MOST_WORKERS)
        if workers <= 1:
            yield from InProcess().rows(study, batches)
            return
        # A fork would inherit the threads' locks, of the progress bar for one.
        context = multiprocessing.get_context("spawn")
        listening, lifeline = context.Pipe(duplex=False)
        pool = ProcessPoolExecutor(workers, context, initializer=_begin, initargs=(listening,))
        try:
            for future in as_completed([pool.submit(study.rows, batch) for batch in batches]):
                yield future.result()
        except BrokenProcessPool:
            raise IsolationError(
                "A worker process died, perhaps for want of memory; study again with fewer workers."
            ) from None
        except BaseException:
            # Nobody waits for what is under way.
            lifeline.close()
            raise
        finally:
            pool.shutdown(cancel_futures=True)
            lifeline.close()
            listening.close()


def _cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _begin(listening: Connection) -> None:
    """Prepare a worker process: an interrupt is the parent's to handle, and without the parent it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threadpool_limits(limits=1)
    threading.Thread(target=_end_with_lifeline, args=(listening,), daemon=True).start()


def _end_with_lifeline(listening: Connection) -> None:
    """Leave when the parent drops its end, also by being killed; the queue it fed would be waited on for ever."""
    listening.poll(None)
    os._exit(1)
