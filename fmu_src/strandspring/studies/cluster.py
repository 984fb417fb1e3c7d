"""The runs of a study on an existing cluster of dask.distributed."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial

from threadpoolctl import threadpool_limits

from .._version import __version__
from ..isolation.system import IsolationError
from .definition import RunRow, Study
from .runners import Pool

_CONNECTING = 5.0  # seconds
# Of a task that raises; a task whose worker dies is moved by the scheduler (its `allowed-failures`).
_RETRIES = 2
_WINDOW = 2000  # batches, for some 1000 workers


@dataclass(frozen=True)
class Cluster:
    """Workers of a scheduler, which must have this version of strandspring.

    Parameters
    ----------
    address : str       Of the scheduler, such as tcp://host:8786.
    notify : callable   Called with a sentence if there are no workers yet.
    """

    address: str
    notify: Callable[[str], None] = lambda _: None

    @contextmanager
    def pool(self, batches: int) -> Iterator[Pool]:  # noqa: ARG002
        """See `runners.Runner`."""
        try:
            from distributed import Client
            from distributed.scheduler import KilledWorker
        except ImportError:
            raise IsolationError(
                "A scheduler needs the package dask.distributed; install it with: pip install distributed"
            ) from None
        self._check_scheduler()
        with _silent_client(), Client(self.address, timeout=_CONNECTING, set_as_default=False) as client:
            if not client.nthreads():
                self.notify(f"The scheduler at {self.address} has no workers yet; waiting for them.")
            try:
                executor = client.get_executor(pure=False, retries=_RETRIES)
                yield Pool(executor, _WINDOW, partial(_rows, version=__version__))
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

    def _check_scheduler(self) -> None:
        """Refuse an address where no scheduler answers; a client that finds none prints why and is slow to close."""
        from distributed.comm.core import connect
        from distributed.security import Security

        async def connect_once() -> None:
            comm = await connect(self.address, timeout=_CONNECTING, **Security().get_connection_args("client"))
            await comm.close()

        try:
            # In a thread of its own, because a notebook has an event loop already.
            with ThreadPoolExecutor(1) as thread:
                thread.submit(asyncio.run, connect_once()).result()
        except Exception as problem:
            raise IsolationError(
                f"No scheduler answers at {self.address!r} ({problem}); start one with `dask scheduler`, or correct "
                "the address, which looks like tcp://host:8786."
            ) from None


@contextmanager
def _silent_client() -> Iterator[None]:
    """Without the traceback that a client logs when its scheduler goes away; an error says so."""
    logger = logging.getLogger("distributed.client")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(before)


def _rows(study: Study, runs: Sequence[int], version: str) -> list[RunRow]:
    """Execute runs in a worker, which has an installation of its own."""
    if version != __version__:
        raise IsolationError(
            f"A worker of the cluster has strandspring {__version__}, but the study is run by {version}; install the "
            "same version on all."
        )
    _use_one_thread()
    return study.rows(runs)


@cache
def _use_one_thread() -> None:
    """Permanently, since other threads of the worker may be at other runs."""
    threadpool_limits(limits=1)
