"""Options that say where many tasks are executed."""

from __future__ import annotations

from typing import Any

import click

from ...campaigns.jobs.cluster import PATIENCE, Cluster
from ...campaigns.jobs.runners import JobError
from .option_types import FiniteRange, together

worker_options = together(
    click.option("--workers", type=click.IntRange(1, 1024), metavar="N",
                 help="Number of processes; 1 for none besides this one.  [default: all cores]"),
    click.option("--scheduler", metavar="tls://HOST:PORT",
                 help="Run on the cluster of this dask.distributed scheduler instead. A scheduler without TLS (tcp://) "
                 "executes code from anyone who can reach it: use it on a trusted network only."),
    click.option("--tls-ca-file", metavar="FILE",
                 help="Certificate of the authority that signed the scheduler's, in PEM format.  "
                 "[default: from dask's configuration]"),
    click.option("--tls-cert", metavar="FILE", help="Certificate of this client, in PEM format."),
    click.option("--tls-key", metavar="FILE", help="Key of this client, in PEM format, without passphrase."),
    click.option("--patience", type=FiniteRange(1.0, 1e6, unit="s"), default=PATIENCE, show_default=True, metavar="S",
                 help="Give up after this time [s] without an answer from the scheduler, without workers, or waiting "
                 "for silent ones."),
)  # fmt: skip


def cluster_option(workers: int | None, options: dict[str, Any]) -> Cluster | None:
    """Take what `worker_options` say of a cluster out of a command's options; raises click.UsageError."""
    scheduler, patience = options.pop("scheduler"), options.pop("patience")
    certificates = {name: options.pop(name) for name in ("tls_ca_file", "tls_cert", "tls_key")}
    if workers is not None and scheduler is not None:
        raise click.UsageError("--workers and --scheduler exclude each other; give one of them.")
    if scheduler is not None:
        try:
            return Cluster(scheduler, **certificates, patience=patience)
        except JobError as problem:
            raise click.UsageError(str(problem)) from None
    if any(certificates.values()):
        raise click.UsageError("Certificates are for a scheduler; add --scheduler tls://HOST:PORT.")
    return None
