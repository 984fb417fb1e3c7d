"""The runs of a study on an existing cluster of dask.distributed."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

from threadpoolctl import threadpool_limits

from .._version import __version__
from ..isolation.system import IsolationError
from .definition import RunRow, Study

_CONNECTING = 5.0  # seconds
# For what a task raises; a task whose worker dies is given to another by the scheduler (its `allowed-failures`).
_RETRIES = 2


@dataclass(frozen=True)
class Cluster:
    """Workers of a scheduler, which must have this version of strandspring.

    Parameters
    ----------
    address : str     Of the scheduler, such as tcp://host:8786.
    tell : callable   Told a sentence when there is something to wait for.
    """

    address: str
    tell: Callable[[str], None] = lambda _: None

    def rows(self, study: Study, batches: Sequence[Sequence[int]]) -> Generator[list[RunRow], None, None]:
        """See `runners.Runner`."""
        try:
            from distributed import Client, as_completed
            from distributed.scheduler import KilledWorker
        except ImportError:
            raise IsolationError(
                "A scheduler needs the package dask.distributed; install it with: pip install distributed"
            ) from None
        self._knock()
        with _quiet(), Client(self.address, timeout=_CONNECTING, set_as_default=False) as client:
            if not client.nthreads():
                self.tell(f"The scheduler at {self.address} has no workers yet; waiting for them.")
            futures = [
                client.submit(_rows, study, batch, __version__, pure=False, retries=_RETRIES) for batch in batches
            ]
            try:
                for future in as_completed(futures, loop=client.loop):
                    rows = future.result()
                    future.release()
                    yield rows
            except IsolationError:
                raise
            except KilledWorker as problem:
                raise IsolationError(
                    f"Several workers of {self.address} died of the same runs, perhaps for want of memory ({problem})."
                ) from None
            except CancelledError:
                raise IsolationError(f"The connection to the scheduler at {self.address} was lost.") from None
            except Exception as problem:
                raise IsolationError(
                    f"The workers of {self.address} cannot run the study ({type(problem).__name__}: {problem}); they "
                    f"need strandspring {__version__}."
                ) from None

    def _knock(self) -> None:
        """Refuse an address where no scheduler answers.

        A client that finds none may not be disposed of without waiting, and prints why.
        """
        from distributed.comm.core import connect
        from distributed.security import Security

        async def knock() -> None:
            comm = await connect(self.address, timeout=_CONNECTING, **Security().get_connection_args("client"))
            await comm.close()

        try:
            # A notebook's own thread has a loop already.
            with ThreadPoolExecutor(1) as thread:
                thread.submit(asyncio.run, knock()).result()
        except Exception as problem:
            raise IsolationError(
                f"No scheduler answers at {self.address!r} ({problem}); start one with `dask scheduler`, or correct "
                "the address, which looks like tcp://host:8786."
            ) from None


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the traceback that a client logs when its scheduler goes away; it is told in a sentence."""
    logger = logging.getLogger("distributed.client")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)


def _rows(study: Study, runs: Sequence[int], version: str) -> list[RunRow]:
    """What a worker does."""
    if version != __version__:
        raise IsolationError(
            f"A worker of the cluster has strandspring {__version__}, but the study is run by {version}; install the "
            "same version on all."
        )
    _one_thread()
    return study.rows(runs)


@cache
def _one_thread() -> None:
    """For good, since the worker's other threads may be at other runs."""
    threadpool_limits(limits=1)
