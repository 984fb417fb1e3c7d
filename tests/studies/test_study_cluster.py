"""Studies on schedulers and workers of dask that are encrypted, killed, suspended, missing or of other versions."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from strandspring.campaigns.jobs import cluster as cluster_module
from strandspring.campaigns.jobs import runners
from strandspring.campaigns.jobs.cluster import Cluster
from strandspring.campaigns.jobs.runners import JobError, Local
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.journal import journal_path
from strandspring.vibration.one_mass.system import IsolationError
from studies import CHEAP, Counter

pytestmark = pytest.mark.long

STUDY = replace(CHEAP, draws=60)
Process = subprocess.Popen[bytes]


@contextmanager
def dask(*arguments: str, ready: str) -> Iterator[tuple[Process, str]]:
    """A process of dask, and the line of its log that says that it is ready."""
    command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard", "--host", "127.0.0.1"]
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=log)
        try:
            lines: list[str] = []
            while not lines:
                text = os.pread(log.fileno(), 1_000_000, 0).decode()
                assert process.poll() is None, text
                lines = [line for line in text.splitlines() if ready in line]
                time.sleep(0.05)
            yield process, lines[0]
        finally:
            process.kill()
            process.wait()


class Machines:
    """A scheduler with workers, each a process."""

    def __init__(self, stack: ExitStack, *options: str, protocol: str = "tcp") -> None:
        self.stack, self.options, self.workers = stack, options, list[Process]()
        given = ("scheduler", "--port", "0", "--protocol", protocol, *options)
        self.scheduler, line = stack.enter_context(dask(*given, ready="Scheduler at:"))
        self.address = line.split()[-1]

    def start_worker(self) -> None:
        given = ("worker", self.address, "--no-nanny", "--nthreads", "1", *self.options)
        self.workers.append(self.stack.enter_context(dask(*given, ready="Registered to:"))[0])


@pytest.fixture
def machines() -> Iterator[Machines]:
    with ExitStack() as stack:
        yield Machines(stack)


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The results of STUDY, one run after the other."""
    path = tmp_path_factory.mktemp("serial") / "results.csv"
    run_study(STUDY, path, Local(1))
    return path.read_bytes()


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    """What takes a minute in the field takes seconds."""
    monkeypatch.setattr(runners, "_CHECK_EVERY", 0.3)
    monkeypatch.setattr(cluster_module, "_CONNECTING", 1.0)
    monkeypatch.setattr(cluster_module, "_SILENCE", 8.0)  # of a busy machine


def kill(machines: Machines) -> None:
    machines.scheduler.kill()


def suspend(machines: Machines) -> None:
    machines.scheduler.send_signal(signal.SIGSTOP)


def suspend_worker(machines: Machines) -> None:
    machines.workers[0].send_signal(signal.SIGSTOP)


@pytest.mark.slow
@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize(
    ("disturb", "problem"),
    [
        (kill, "The connection to the scheduler at {} was lost; start it and its workers again; "),
        (suspend, "The scheduler at {} does not answer ("),
        (suspend_worker, "1 of 1 workers of {} have given no sign of life for 8 s ("),
    ],
)
def test_a_study_gives_up_in_words_and_is_finished_elsewhere(
    disturb: Callable[[Machines], None], problem: str, machines: Machines, expected: bytes, tmp_path: Path
) -> None:
    machines.start_worker()
    results, notes = tmp_path / "r.csv", list[str]()
    cluster = Cluster(machines.address, patience=2.0, notify=notes.append)
    with pytest.raises(IsolationError) as refusal:
        run_study(STUDY, results, cluster, Counter(20, lambda: disturb(machines)), cluster.notify)
    said = str(refusal.value)
    assert problem.format(machines.address) in said
    if disturb is not kill:
        assert "given up after 2 s; " in said
        assert [note.startswith(problem.format(machines.address)) for note in notes] == [True]
    assert not results.exists()
    assert journal_path(results).exists()
    counter = Counter()
    run_study(STUDY, results, Local(1), counter)
    assert counter.first is not None
    assert counter.first >= 20
    assert results.read_bytes() == expected


# ---- TLS ------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Files of an authority, of a client that it knows, and what cannot be used."""
    import trustme

    folder, authority = tmp_path_factory.mktemp("certificates"), trustme.CA()
    client = authority.issue_cert("dask.example")
    files = {name: folder / f"{name}.pem" for name in ("ca", "cert", "key", "other", "empty", "locked", "none")}
    authority.cert_pem.write_to_path(files["ca"])
    client.cert_chain_pems[0].write_to_path(files["cert"])
    client.private_key_pem.write_to_path(files["key"])
    trustme.CA().cert_pem.write_to_path(files["other"])
    files["empty"].touch()
    files["locked"].write_text("-----BEGIN ENCRYPTED PRIVATE KEY-----\nMIIB\n-----END ENCRYPTED PRIVATE KEY-----\n")
    return {name: str(path) for name, path in files.items()}


@pytest.mark.slow
@pytest.mark.usefixtures("hasty")
def test_tls_by_options_and_by_the_configuration_of_dask(
    certificates: dict[str, str], expected: bytes, tmp_path: Path
) -> None:
    ca, cert, key = (certificates[name] for name in ("ca", "cert", "key"))
    notes: list[str] = []
    with ExitStack() as stack:
        options = ("--tls-ca-file", ca, "--tls-cert", cert, "--tls-key", key)
        machines = Machines(stack, *options, protocol="tls")
        machines.start_worker()
        assert machines.address.startswith("tls://")
        run_study(STUDY, tmp_path / "r.csv", Cluster(machines.address, ca, cert, key, notify=notes.append))
        assert notes == []
        for cluster, told in (
            (Cluster(machines.address), f"{machines.address} needs certificates: those of the authority"),
            (Cluster(machines.address, certificates["other"], cert, key), "No scheduler answers"),
            (Cluster(machines.address.replace("tls://", "tcp://")), "or tls://host:8786 if it has TLS"),
        ):
            with pytest.raises(IsolationError, match=told):
                run_study(STUDY, tmp_path / "none.csv", cluster)
        import dask

        configured = {"ca-file": ca, "client.cert": cert, "client.key": key}
        with dask.config.set({f"distributed.comm.tls.{name}": path for name, path in configured.items()}):
            run_study(STUDY, tmp_path / "s.csv", Cluster(machines.address))
    assert (tmp_path / "r.csv").read_bytes() == (tmp_path / "s.csv").read_bytes() == expected


def test_certificates_and_addresses_that_cannot_be_used_are_refused(
    certificates: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for words, names in {
        "no such file": ("ca", "cert", "none"),
        r"cannot be used \(": ("empty", "cert", "key"),
        "have no passphrase": ("ca", "cert", "locked"),
        "must belong to the certificate": ("ca", "other", "key"),
    }.items():
        with pytest.raises(IsolationError, match=words):
            run_study(CHEAP, tmp_path / "r.csv", Cluster("tls://127.0.0.1:1", *(certificates[name] for name in names)))
    with pytest.raises(JobError, match=r"Certificates need a scheduler with TLS, .*begins with tls://"):
        Cluster("tcp://127.0.0.1:1", certificates["ca"])
    monkeypatch.setattr(cluster_module, "_CONNECTING", 0.2)
    for address, is_open in (("tcp://192.0.2.1:8786", True), ("host.invalid:8786", True), ("tcp://[::1]:1", False)):
        notes: list[str] = []
        with pytest.raises(IsolationError, match="No scheduler answers at"):
            run_study(CHEAP, tmp_path / "new" / "r.csv", Cluster(address, notify=notes.append))
        assert [f"{address} has no TLS, and anyone who can reach that" in note for note in notes] == [True] * is_open
        assert not (tmp_path / "new").exists()
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(IsolationError, match=r'install it with pip install "strandspring\[cluster\]"'):
        run_study(CHEAP, tmp_path / "r.csv", Cluster("tcp://127.0.0.1:1"))
