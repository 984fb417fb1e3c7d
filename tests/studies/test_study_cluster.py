"""Studies on schedulers and workers of dask that are encrypted, killed, suspended, missing or of other versions."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from strandspring.campaigns.jobs import cluster as cluster_module
from strandspring.campaigns.jobs import runners
from strandspring.campaigns.jobs.options import Cluster, Workers
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.journal import journal_path
from strandspring.errors import IsolationError, JobError
from studies import CHEAP, Counter

pytestmark = pytest.mark.long

STUDY = replace(CHEAP, draws=60)
Process = subprocess.Popen[bytes]


@contextmanager
def dask(*arguments: str, ready: str) -> Iterator[tuple[Process, str]]:
    """A process of dask, and the last word of the line of its log that says that it is ready."""
    command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard", "--host", "127.0.0.1"]
    with subprocess.Popen(command, stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        try:
            line = next(line for line in process.stderr if ready.encode() in line)
            threading.Thread(target=process.stderr.read, daemon=True).start()  # so that it never waits for us
            yield process, line.decode().split()[-1]
        finally:
            process.kill()


@pytest.fixture
def machines() -> Iterator[tuple[Process, str, Process]]:
    """A scheduler, its address, and a worker."""
    with ExitStack() as stack:
        scheduler, address = stack.enter_context(dask("scheduler", "--port", "0", ready="Scheduler at:"))
        given = ("worker", address, "--no-nanny", "--nthreads", "1")
        yield scheduler, address, stack.enter_context(dask(*given, ready="Registered to:"))[0]


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The results of STUDY, one run after the other."""
    path = tmp_path_factory.mktemp("serial") / "results.csv"
    run_study(STUDY, path, Workers())
    return path.read_bytes()


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """What takes a minute in the field takes seconds."""
    monkeypatch.setattr(runners, "_CHECK_EVERY", 0.3)
    monkeypatch.setattr(cluster_module, "_CONNECTING", 1.0)
    monkeypatch.setattr(cluster_module, "_SILENCE", 8.0)  # of a busy machine


@pytest.mark.slow
@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize(
    ("is_worker", "end", "problem"),
    [
        (False, signal.SIGKILL, "The connection to the scheduler at {} was lost; start it and its workers again. "),
        (False, signal.SIGSTOP, "The scheduler at {} does not answer ("),
        (True, signal.SIGSTOP, "1 of 1 workers of {} have given no sign of life for 8 s ("),
    ],
)
def test_a_study_gives_up_in_words_and_is_finished_elsewhere(
    is_worker: bool, end: signal.Signals, problem: str, machines: Any, expected: bytes, tmp_path: Path
) -> None:
    scheduler, address, worker = machines
    results, notes, counter = tmp_path / "r.csv", list[str](), Counter()
    cluster = Workers(scheduler=Cluster(address, patience=2.0), notify=notes.append)
    disturb = Counter(20, lambda: (worker if is_worker else scheduler).send_signal(end))
    with pytest.raises(IsolationError) as refusal:
        run_study(STUDY, results, cluster, disturb)
    said, told = str(refusal.value), problem.format(address)
    assert told in said
    if end is signal.SIGSTOP:
        assert "given up after 2 s. " in said
        assert [note.startswith(told) for note in notes] == [True]
    assert [results.exists(), journal_path(results).exists()] == [False, True]
    run_study(STUDY, results, Workers(), counter)
    assert (counter.first or 0) >= 20
    assert results.read_bytes() == expected


# ---- TLS ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Files of an authority, of a client that it knows, and what cannot be used."""
    import trustme

    folder, authority = tmp_path_factory.mktemp("certificates"), trustme.CA()
    client = authority.issue_cert("dask.example")
    locked = b"-----BEGIN ENCRYPTED PRIVATE KEY-----\nMIIB\n-----END ENCRYPTED PRIVATE KEY-----\n"
    contents = {
        "ca": authority.cert_pem.bytes(), "cert": client.cert_chain_pems[0].bytes(),
        "key": client.private_key_pem.bytes(), "other": trustme.CA().cert_pem.bytes(), "empty": b"", "locked": locked,
    }  # fmt: skip
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    return {name: str(folder / name) for name in (*contents, "none")}


@pytest.mark.slow
@pytest.mark.usefixtures("hasty")
def test_tls_by_options_and_by_the_configuration_of_dask(
    certificates: dict[str, str], expected: bytes, tmp_path: Path
) -> None:
    import dask
    from distributed import LocalCluster, Security

    ca, cert, key = (certificates[name] for name in ("ca", "cert", "key"))
    ends = {f"tls_{end}_{part}": path for end in ("scheduler", "worker", "client") for part, path in
            (("cert", cert), ("key", key))}  # fmt: skip
    options = {"processes": False, "n_workers": 1, "threads_per_worker": 1, "dashboard_address": ":0"}
    security = Security(tls_ca_file=ca, require_encryption=True, **ends)
    with LocalCluster(protocol="tls://", host="127.0.0.1", security=security, **options) as machines:
        address = machines.scheduler_address
        assert address.startswith("tls://")
        run_study(STUDY, tmp_path / "r.csv", Workers(scheduler=Cluster(address, ca, cert, key)))
        for cluster, told in (
            (Cluster(address), f"{address} needs certificates: those of the authority"),
            (Cluster(address, certificates["other"], cert, key), "No scheduler answers"),
            (Cluster(address.replace("tls://", "tcp://")), "or tls://host:8786 if it has TLS"),
        ):
            with pytest.raises(IsolationError, match=told):
                run_study(STUDY, tmp_path / "none.csv", Workers(scheduler=cluster))
        configured = {"ca-file": ca, "client.cert": cert, "client.key": key}
        with dask.config.set({f"distributed.comm.tls.{name}": path for name, path in configured.items()}):
            run_study(STUDY, tmp_path / "s.csv", Workers(scheduler=address))
    assert (tmp_path / "r.csv").read_bytes() == (tmp_path / "s.csv").read_bytes() == expected


def test_certificates_and_addresses_that_cannot_be_used_are_refused(
    certificates: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for words, names in {
        "no such file": ("ca", "cert", "none"), r"cannot be used \(": ("empty", "cert", "key"),
        "have no passphrase": ("ca", "cert", "locked"), "must belong to the certificate": ("ca", "other", "key"),
    }.items():  # fmt: skip
        placing = Workers(scheduler=Cluster("tls://127.0.0.1:1", *map(certificates.get, names)))
        with pytest.raises(IsolationError, match=words):
            run_study(CHEAP, tmp_path / "r.csv", placing)
    with pytest.raises(JobError, match=r"Certificates need a scheduler with TLS, .*begins with tls://"):
        Cluster("tcp://127.0.0.1:1", certificates["ca"])
    monkeypatch.setattr(cluster_module, "_CONNECTING", 0.2)
    for address, is_open in (("tcp://192.0.2.1:8786", True), ("host.invalid:8786", True), ("tcp://[::1]:1", False)):
        notes: list[str] = []
        with pytest.raises(IsolationError, match="No scheduler answers at"):
            run_study(CHEAP, tmp_path / "new" / "r.csv", Workers(scheduler=address, notify=notes.append))
        assert [f"{address} has no TLS, and anyone who can reach that" in note for note in notes] == [True] * is_open
        assert not (tmp_path / "new").exists()
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(IsolationError, match=r'install it with pip install "strandspring\[cluster\]"'):
        run_study(CHEAP, tmp_path / "r.csv", Workers(scheduler="tcp://127.0.0.1:1"))
