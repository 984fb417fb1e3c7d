"""Where tasks are executed: here, or on an existing cluster of dask.distributed."""

from __future__ import annotations

import ipaddress
import logging
import platform
import ssl
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache, partial
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from threadpoolctl import threadpool_limits

from ..._version import __version__
from ...errors import JobError
from .options import Cluster, Workers, protocol_of
from .runners import Pool, Runner, local_pool, timed_rows

if TYPE_CHECKING:
    from distributed.security import Security

_CONNECTING = 5.0  # seconds
_SILENCE = 20.0  # seconds without a sign of life; workers give one every second, or every 7 s where there are 1000
# Of a task that raises; a task whose worker dies is moved by the scheduler (its `allowed-failures`).
_RETRIES = 2
_WINDOW = 2000  # batches, for some 1000 workers
_BATCH = 5.0  # seconds of a batch, so that this process has time for those of 1000 workers
_NAMED = 3  # workers in a sentence
# What the scheduler must have like this computer, to understand what it is sent.
_PROTOCOL = ("python", "distributed", "cloudpickle", "msgpack")
_ENCRYPTED = ("tls", "wss", "inproc")


def runner_of(placing: Workers) -> Runner:
    """Processes of this machine, or the workers of a cluster."""
    if placing.scheduler is None:
        return partial(local_pool, placing.workers)
    cluster = Cluster(placing.scheduler) if isinstance(placing.scheduler, str) else placing.scheduler
    return lambda batches, apart: _cluster_pool(cluster, placing.notify)  # noqa: ARG005


@contextmanager
def _cluster_pool(cluster: Cluster, notify: Callable[[str], None]) -> Iterator[Pool]:
    """The workers of a cluster."""
    try:
        from distributed import Client
        from distributed.scheduler import KilledWorker
    except ImportError:
        raise JobError(
            'A scheduler needs dask.distributed; install it with pip install "strandspring[cluster]".'
        ) from None
    security = secured(cluster.address, cluster.certificates, notify)
    there = _scheduler_versions(cluster, security, notify)
    with _silent_client(), Client(
        cluster.address, timeout=_CONNECTING, set_as_default=False, security=security
    ) as client:  # fmt: skip
        try:
            executor = client.get_executor(pure=False, retries=_RETRIES)
            message = (
                f"Several workers of {cluster.address} died of the same tasks, perhaps for lack of memory; give them "
                "more."
            )
            run = partial(_rows, versions=_versions())
            watch = _Watch(cluster, security)
            yield Pool(executor, _WINDOW, (KilledWorker,), message, run, _BATCH, watch.trouble, cluster.patience)
        except JobError:
            raise
        except CancelledError:
            raise JobError(
                f"The connection to the scheduler at {cluster.address} was lost; start it and its workers again."
            ) from None
        except Exception as problem:  # whatever the cluster raises while it loads or executes a task
            raise JobError(
                f"The cluster of {cluster.address} cannot do the work ({type(problem).__name__}: "
                f"{str(problem).strip()[:300]}); its scheduler ({_in_words(there)}) and workers need strandspring "
                f"{__version__} and the packages of this computer ({_in_words(_protocol_here())})."
            ) from None


def ask(cluster: Cluster, security: Security, operation: str) -> dict[str, Any]:
    """The answer of the scheduler to a request without arguments.

    The client would print why it finds no scheduler, is slow to close then, and waits for one that is suspended.

    Raises
    ------
    OSError   If none answers within some seconds.
    """
    import asyncio

    from distributed.comm.core import connect
    from distributed.core import send_recv

    async def exchange() -> dict[str, Any]:
        comm = await connect(cluster.address, timeout=_CONNECTING, **security.get_connection_args("client"))
        try:
            answer: dict[str, Any] = await send_recv(comm, op=operation)
            return answer
        finally:
            comm.abort()

    async def exchange_in_time() -> dict[str, Any]:
        # Once connected, dask waits for an answer without limit.
        return await asyncio.wait_for(exchange(), 2.0 * _CONNECTING)

    # In a thread of its own, because a notebook has an event loop already.
    with ThreadPoolExecutor(1) as thread:
        try:
            return thread.submit(asyncio.run, exchange_in_time()).result()
        except Exception as problem:  # also of addresses that are none
            raise OSError(str(problem) or f"no answer within {2.0 * _CONNECTING:g} s") from None


def _scheduler_versions(cluster: Cluster, security: Security, notify: Callable[[str], None]) -> dict[str, str]:
    """Versions of what the scheduler needs to understand this computer; refuses an address where there is none."""
    try:
        answer = ask(cluster, security, "versions")
        there = {name: answer["packages"].get(name) or "none" for name in _PROTOCOL}
        if ask(cluster, security, "identity")["type"] != "Scheduler":
            raise OSError("a worker")
    except (OSError, LookupError, TypeError) as problem:
        raise JobError(
            f"No scheduler answers at {cluster.address!r} ({problem}); start one with `dask scheduler`, or correct "
            "the address, which looks like tcp://host:8786, or tls://host:8786 if it has TLS."
        ) from None
    here = _protocol_here()
    different = {name: version for name, version in there.items() if version != here[name]}
    if different:
        notify(
            f"Caution: the scheduler at {cluster.address} has {_in_words(different)}, but this computer has "
            f"{_in_words({name: here[name] for name in different})}; install the same if the work fails."
        )
    return there


class _Watch:
    """What is wrong with a cluster while nothing is finished."""

    def __init__(self, cluster: Cluster, security: Security) -> None:
        self._cluster = cluster
        self._security = security
        self._signs: dict[str, tuple[float, float]] = {}  # of each worker: the last one, and when it was seen [s]

    def trouble(self) -> str:
        """A sentence without its full stop; empty if all is well."""
        address, now = self._cluster.address, time.monotonic()
        try:
            workers = ask(self._cluster, self._security, "identity")["workers"]
        except OSError as problem:
            return f"The scheduler at {address} does not answer ({problem}); resume it, or start it again"
        if not workers:
            return f"The scheduler at {address} has no workers; start some with `dask worker {address}`"
        last_seen = {name: worker["last_seen"] for name, worker in workers.items()}
        before = self._signs
        self._signs = {
            name: before[name] if name in before and before[name][0] == sign else (sign, now)
            for name, sign in last_seen.items()
        }
        silent = [name for name, (_, since) in self._signs.items() if now - since > _SILENCE]
        if not silent:
            return ""
        named = ", ".join([*silent[:_NAMED], "..."] if len(silent) > _NAMED else silent)
        return (
            f"{len(silent)} of {len(workers)} workers of {address} have given no sign of life for {_SILENCE:g} s "
            f"({named}); resume or end them"
        )


@contextmanager
def _silent_client() -> Iterator[None]:
    """Without what a client logs when its scheduler goes away, and its warning of other versions; sentences say so."""
    from distributed.versions import VersionMismatchWarning

    logger = logging.getLogger("distributed.client")
    before = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", VersionMismatchWarning)
            yield
    finally:
        logger.setLevel(before)


@cache
def _versions() -> dict[str, str]:
    """Of what the last bits of a row depend on."""
    packages = {name: _minor(metadata.version(name)) for name in ("numpy", "scipy")}
    return {"strandspring": __version__, "Python": _minor(platform.python_version()), **packages}


def _minor(version: str) -> str:
    return ".".join(version.split(".")[:2])


def _protocol_here() -> dict[str, str]:
    from distributed.versions import get_versions

    packages = get_versions()["packages"]
    return {name: packages[name] for name in _PROTOCOL}


def _in_words(versions: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {version}" for name, version in versions.items())


def _rows(work: Any, tasks: Sequence[Any], versions: dict[str, str]) -> tuple[Sequence[Any], float]:
    """Execute tasks in a worker, which has an installation of its own."""
    here = _versions()
    different = [name for name in versions if versions[name] != here[name]]
    if different:
        raise JobError(
            f"A worker of the cluster has {_in_words({name: here[name] for name in different})}, but this computer "
            f"has {_in_words({name: versions[name] for name in different})}; install the same versions on all."
        )
    _use_one_thread()
    return timed_rows(work, tasks)


@cache
def _use_one_thread() -> None:
    """Permanently, since other threads of the worker may be at other tasks."""
    threadpool_limits(limits=1)


def secured(address: str, certificates: Mapping[str, str], notify: Callable[[str], None]) -> Security:
    """What the connection to a scheduler is made with.

    Parameters
    ----------
    address : str            Of the scheduler.
    certificates : mapping   Paths by the names of dask's `Security`; others are taken from dask's own configuration.
    notify : callable        Called with a caution where there is no TLS on the way to another computer.

    Raises
    ------
    JobError                 If certificates are missing or cannot be used.
    """
    from distributed.security import Security

    protocol = protocol_of(address)
    security = Security(**certificates)
    if protocol != "tls":
        if protocol not in _ENCRYPTED and not _is_local(address):
            notify(
                f"Caution: {address} has no TLS, and anyone who can reach that scheduler can execute code "
                "there and here; use tls:// unless you trust everybody on the network."
            )
        return security
    role = security.get_tls_config_for_role("client")
    authority, certificate, key = role["ca_file"], role["cert"], role["key"]
    if authority is None or certificate is None:
        raise JobError(
            "{address} needs certificates: those of the authority ({to[tls_ca_file]}) and of this client "
            "({to[tls_cert]}, {to[tls_key]}), here or in dask's configuration (distributed.comm.tls).",
            address=address,
        )
    for path in (authority, certificate, key):
        # dask's configuration may hold a certificate itself, which has several lines.
        if path is not None and "\n" not in path and not Path(path).is_file():
            raise JobError(f"{path}: no such file; give the path of a certificate or key in PEM format.")
    try:
        if "\n" not in certificate:
            # With a passphrase, since OpenSSL would ask for that of a key on the terminal.
            ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).load_cert_chain(certificate, key, password="")
        security.get_connection_args("client")
    except (OSError, ValueError) as problem:
        raise JobError(
            f"The certificates for {address} cannot be used ({problem}); they must be in PEM format, and the "
            "key must belong to the certificate and have no passphrase."
        ) from None
    return security


def _is_local(address: str) -> bool:
    """Whether an address is one of this computer that no other reaches."""
    from distributed.comm.addressing import get_address_host

    try:
        host = get_address_host(address)
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name, or no address at all
        return False
