"""Tasks in this process or on the cores of this machine; see `cluster` for other places.

All of them are executors of `concurrent.futures`, so that one loop serves them. The row of a task is a pure function of
the work and the task: neither the place nor the order matters. Linear algebra uses one thread everywhere, because
several may round differently.
"""

from __future__ import annotations

import math
import multiprocessing
import os
import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from threadpoolctl import threadpool_limits

from ...errors import JobError
from ...ground.endings import held_endings, kept_endings, leave_interrupts_to_parent
from ...ground.isolated import isolated_processes
from ...ground.one_thread import one_thread
from .threads import usable_cores

_MOST_WORKERS = 61  # Windows waits for no more processes
_SHARE = 64  # of what is left is a batch at most, or workers wait for each other at the end
_LARGEST = 4096  # tasks in a batch
_REPORT_EVERY = 60.0  # seconds without a finished task until this is reported
_MOST_CRASHES = 20  # where so many tasks end their process and none does not, it is not the tasks' fault
_CHECK_EVERY = 10.0  # seconds between two looks at executors while nothing is finished
_POLL_EVERY = 0.1  # seconds between two looks whether the program was interrupted

Task = TypeVar("Task")
Row = TypeVar("Row")
TaskIn = TypeVar("TaskIn", contravariant=True)
RowOut = TypeVar("RowOut", covariant=True)


class Work(Protocol[TaskIn, RowOut]):
    """What is done with every task; it travels to the workers as a pickle."""

    def rows(self, tasks: Sequence[TaskIn]) -> Sequence[RowOut]:
        """Execute tasks, and give the row of each."""
        ...


def timed_rows(work: Work[Task, Row], tasks: Sequence[Task]) -> tuple[Sequence[Row], float]:
    """Execute tasks; gives their rows and the time that it took [s]."""
    begin = time.perf_counter()
    rows = work.rows(tasks)
    return rows, time.perf_counter() - begin


class Pool(NamedTuple):
    """An executor.

    Attributes
    ----------
    executor : Executor
    window : int                    Batches it should have at a time.
    broken : tuple of exceptions    What a batch ends with whose worker process died.
    broken_message : str            What to tell the user then.
    run : callable                  Executes tasks of a work in the worker, as `timed_rows`.
    seconds : float                 A batch should take; an interrupt loses the batches in execution.
    trouble : callable              Why no batch may ever finish, as a sentence without full stop; empty if all is well.
    patience : float                Time after which the work is given up for such trouble [s].
    """

    executor: Executor
    window: int
    broken: tuple[type[BaseException], ...] = ()
    broken_message: str = ""
    run: Callable[[Any, Sequence[Any]], tuple[Sequence[Any], float]] = timed_rows
    seconds: float = 1.0
    trouble: Callable[[], str] = str
    patience: float = math.inf


class Runner(Protocol):
    """Provides an executor."""

    def __call__(self, batches: int, apart: bool) -> AbstractContextManager[Pool]:
        """An executor for so many batches at most, to be used in a with statement.

        Parameters
        ----------
        batches : int
        apart : bool    Never in this process, which a fatal fault would end.

        Raises
        ------
        JobError   On leaving, if the executor fails.
        """
        ...


def finished_rows(
    work: Work[Task, Row],
    tasks: Sequence[Task],
    runner: Runner,
    notify: Callable[[str], None],
    fatal: Callable[[Task], Row] | None = None,
) -> Generator[Sequence[Row], None, None]:
    """Rows of all tasks, batch by batch as they finish, in any order.

    Parameters
    ----------
    work : Work
    tasks : sequence of tasks
    runner : Runner
    notify : callable         Called with a sentence while no batch finishes.
    fatal : callable or None  The row of a task that ends the worker process. The tasks that were under way when a
                              process died are executed again, one at a time, to find it. Without it such a death ends
                              everything.

    Raises
    ------
    JobError                  If the tasks cannot be executed; what was yielded before is valid.
    KeyboardInterrupt         Between two batches, if the process is interrupted or asked to terminate.
    """
    batches = _Batches(tasks)
    suspects: list[Task] = []
    with kept_endings() as interrupted:
        while True:  # a pool whose process died is of no more use
            lost: list[Sequence[Task]] = []
            with runner(len(tasks), False) as pool:
                yield from _executed(work, batches, pool, notify, interrupted, lost)
                if lost and fatal is None:
                    raise JobError(pool.broken_message)
            if not lost:
                break
            suspects += [task for batch in lost for task in batch]
        deaths, survivors = 0, 0
        singles = _Batches(suspects, largest=1)
        while suspects:
            lost = []
            with runner(1, True) as pool:
                for rows in _executed(work, singles, pool._replace(window=1), notify, interrupted, lost):
                    survivors += 1
                    yield rows
                deaths += len(lost)
                if deaths >= _MOST_CRASHES and not survivors:
                    raise JobError(pool.broken_message)
            if not lost:
                break
            if fatal is not None:
                yield [fatal(task) for batch in lost for task in batch]


class _Batches(Generic[Task]):
    """Tasks in batches that take as long as they should, as far as is known from those that are finished.

    Parameters
    ----------
    tasks : sequence
    largest : int      Tasks in a batch.
    """

    def __init__(self, tasks: Sequence[Task], largest: int = _LARGEST) -> None:
        self._tasks, self._largest = tasks, largest
        self._taken, self._finished, self._seconds = 0, 0, 0.0

    def next(self, seconds: float) -> Sequence[Task]:
        """Tasks that take so long together; none if there are none left."""
        begin, left = self._taken, len(self._tasks) - self._taken
        size = int(min(seconds * self._finished / max(self._seconds, 1e-9), left / _SHARE, self._largest))
        self._taken = min(begin + max(size, 1), len(self._tasks))
        return self._tasks[begin : self._taken]

    def learn(self, count: int, seconds: float) -> None:
        """So many tasks were finished in this time."""
        self._finished += count
        self._seconds += seconds


def _executed(
    work: Work[Task, Row],
    batches: _Batches[Task],
    pool: Pool,
    notify: Callable[[str], None],
    interrupted: list[int],
    lost: list[Sequence[Task]],
) -> Generator[Sequence[Row], None, None]:
    """Rows of batches until there are none left or a worker process dies, which adds those under way to `lost`."""
    pending: dict[Future[tuple[Sequence[Row], float]], Sequence[Task]] = {}
    finished: SimpleQueue[Future[tuple[Sequence[Row], float]]] = SimpleQueue()
    patience = _Patience(pool, notify)
    while True:
        if interrupted:
            raise KeyboardInterrupt(*interrupted)
        while not lost and len(pending) < pool.window and (batch := batches.next(pool.seconds)):
            try:
                future = pool.executor.submit(pool.run, work, batch)
            except pool.broken:
                lost.append(batch)
                break
            pending[future] = batch
            future.add_done_callback(finished.put)
        if not pending:
            return
        try:
            future = finished.get(timeout=_POLL_EVERY)
        except Empty:
            patience.wait()
            continue
        if not future.cancelled():
            patience.begin()
        batch = pending.pop(future)
        try:
            rows, seconds = future.result()
        except pool.broken:
            lost.append(batch)
            continue
        batches.learn(len(batch), seconds)
        yield rows


class _Patience:
    """Reports while nothing is finished, and ends that if the executor's trouble lasts."""

    def __init__(self, pool: Pool, notify: Callable[[str], None]) -> None:
        self._pool, self._notify = pool, notify
        self._looked = -math.inf
        self.begin()

    def begin(self) -> None:
        """Something was finished just now."""
        self._reported = time.monotonic()
        self._trouble, self._since = "", self._reported

    def wait(self) -> None:
        """Nothing was finished since; raises JobError if that is hopeless."""
        now = time.monotonic()
        if now - self._looked > _CHECK_EVERY:
            self._looked = now
            trouble = self._pool.trouble()
            if trouble and not self._trouble:
                self._since = self._reported = now
                self._notify(f"{trouble}; giving up after {self._pool.patience:g} s.")
            self._trouble = trouble
        if self._trouble and now - self._since > self._pool.patience:
            raise JobError(f"{self._trouble}; given up after {self._pool.patience:g} s.")
        if now - self._reported > _REPORT_EVERY:
            self._reported = now
            reason = f" {self._trouble}." if self._trouble else ""
            self._notify(f"Nothing has been finished for {_REPORT_EVERY:g} s; still waiting for the workers.{reason}")


class _InlineExecutor(Executor):
    """Executes a batch when it is submitted."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_result(fn(*args, **kwargs))
        return future


class _Processes(ProcessPoolExecutor):
    """Processes that know nothing of the program that starts them."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        with held_endings(), isolated_processes():  # they are started here
            return super().submit(fn, *args, **kwargs)


@contextmanager
def local_pool(most: int | None, batches: int, apart: bool) -> Iterator[Pool]:
    """Processes of this machine, see `Runner`.

    Parameters
    ----------
    most : int or None   Number of processes; 1 for this one alone, as many as cores if None.
    batches, apart
    """
    workers = min(most or usable_cores(), batches, _MOST_WORKERS)
    if workers <= 1 and not apart:
        with one_thread():
            yield Pool(_InlineExecutor(), 1)
        return
    # A fork would inherit locks of other threads, such as that of the progress bar.
    context = multiprocessing.get_context("spawn")
    listening, lifeline = context.Pipe(duplex=False)
    # Starts the process that looks after semaphores, which a closing terminal must not end.
    with held_endings(), isolated_processes():
        executor = _Processes(workers, context, initializer=_start_worker, initargs=(listening,))
    message = "A worker process died, perhaps for lack of memory; use fewer workers."
    try:
        yield Pool(executor, 2 * workers, (BrokenProcessPool,), message)
    except BaseException:
        lifeline.close()  # the workers leave without finishing their batches
        raise
    finally:
        executor.shutdown(cancel_futures=True)
        lifeline.close()
        listening.close()


def _start_worker(listening: Connection) -> None:
    """Prepare a worker process: the parent handles signals to the group, and the worker ends with the parent."""
    leave_interrupts_to_parent()
    threadpool_limits(limits=1)
    threading.Thread(target=_leave_with_lifeline, args=(listening,), daemon=True).start()


def _leave_with_lifeline(listening: Connection) -> None:
    """Leave when the parent's end closes, also because it was killed: the queue would be waited on for ever."""
    listening.poll(None)
    os._exit(1)
