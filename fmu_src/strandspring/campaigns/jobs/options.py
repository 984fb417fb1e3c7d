"""Where many tasks are executed, as users say it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from ...errors import JobError, OptionError
from ...ground.options import check, described, option, options_of

PATIENCE = 600.0  # seconds


def protocol_of(address: str) -> str:
    """The protocol of a scheduler's address; dask's default, tcp, if it names none."""
    protocol, separator, _ = address.partition("://")
    return protocol if separator else "tcp"


@described
@dataclass(frozen=True)
class Cluster:
    """Workers of a dask.distributed scheduler, which must have this version of strandspring.

    A scheduler without TLS executes code from anyone who can reach it. Certificates that are not given here are taken
    from dask's own configuration.

    Raises
    ------
    JobError     If there are certificates, but the address is not that of a scheduler with TLS.
    """

    group: ClassVar[str] = "Workers"

    address: str  # of the scheduler, such as tls://host:8786, or tcp://host:8786 without TLS
    tls_ca_file: str | None = option(
        None, "text", "Certificate of the authority that signed the scheduler's, in PEM format",
        otherwise="from dask's configuration", metavar="FILE", rare=True,
    )  # fmt: skip
    tls_cert: str | None = option(None, "text", "Certificate of this client, in PEM format", metavar="FILE", rare=True)
    tls_key: str | None = option(
        None, "text", "Key of this client, in PEM format, without passphrase", metavar="FILE", rare=True
    )
    patience: float = option(
        PATIENCE, "number", "Give up after this time without an answer from the scheduler, without workers, or waiting "
        "for silent ones", unit="s", least=1.0, most=1e6, metavar="S", rare=True,
    )  # fmt: skip

    def __post_init__(self) -> None:
        check(self, JobError)
        if self.certificates and protocol_of(self.address) != "tls":
            raise JobError(
                f"Certificates need a scheduler with TLS, but the address is {self.address}; give one that begins with "
                "tls://."
            )

    @property
    def certificates(self) -> dict[str, str]:
        """What is given of them, by the names of dask's `Security`."""
        given = {"tls_ca_file": self.tls_ca_file, "tls_client_cert": self.tls_cert, "tls_client_key": self.tls_key}
        return {name: path for name, path in given.items() if path is not None}


@described
@dataclass(frozen=True)
class Workers:
    """Where many tasks are executed.

    Raises
    ------
    JobError     If there are workers and a scheduler, or the number of workers is below 1.
    TypeError    If it is not a whole number.
    """

    group: ClassVar[str] = "Workers"
    parts: ClassVar[Mapping[str, type]] = {"cluster": Cluster}

    workers: int | None = option(
        1, "whole", "Number of processes; 1 for none besides this one", least=1, most=1024,
        otherwise="all cores", metavar="N",
    )  # fmt: skip
    scheduler: str | Cluster | None = option(
        None, "text", "Run on the cluster of this dask.distributed scheduler instead. A scheduler without TLS (tcp://) "
        "executes code from anyone who can reach it: use it on a trusted network only", metavar="tls://HOST:PORT",
    )  # fmt: skip
    notify: Callable[[str], None] = lambda _: None  # called with sentences while the work waits

    def __post_init__(self) -> None:
        check(self, JobError)
        if self.scheduler is not None and self.workers not in (None, 1):
            sentence = "{to[workers]} and {to[scheduler]} exclude each other; give one of them."
            raise JobError(sentence, workers=self.workers)

    def with_options(self, **given: Any) -> Workers:
        """These with options of a command, in which those of a cluster stand beside its address."""
        of_cluster = {name: given.pop(name) for name in options_of(Cluster) if name in given}
        if "scheduler" in given:
            given["scheduler"] = Cluster(given["scheduler"], **of_cluster)
        elif of_cluster.keys() - {"patience"}:
            raise OptionError(
                "Certificates are for a scheduler; add {to[scheduler=tls://HOST:PORT]}.", given=of_cluster
            )
        return replace(self, **given)

    def notifying(self, notify: Callable[[str], None]) -> Workers:
        """The same, which tell another function what they wait for."""
        return replace(self, notify=notify)
