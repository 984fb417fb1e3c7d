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
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO

import pytest
import trustme

from strandspring.campaigns.jobs import cluster as cluster_module
from strandspring.campaigns.jobs import runners
from strandspring.campaigns.jobs.cluster import Cluster
from strandspring.campaigns.jobs.runners import JobError, Local
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.journal import journal_path
from strandspring.model.modelfile import ModelFile, save_model
from strandspring.vibration.one_mass.system import IsolationError
from studies import CHEAP, COMMAND, SPRING, UNCERTAINTY, Counter
from terminal import Terminal

STARTING = 60.0  # seconds
STUDY = replace(CHEAP, draws=60)


@contextmanager
def dask(*arguments: str, ready: str) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A process of dask, and the line of its log that says that it is ready."""
    command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard", "--host", "127.0.0.1"]
    with tempfile.TemporaryFile("w+") as log:
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=log)
        try:
            deadline = time.monotonic() + STARTING
            while not (lines := [line for line in _read(log) if ready in line]):
                assert process.poll() is None, _read(log)
                assert time.monotonic() < deadline, _read(log)
                time.sleep(0.05)
            yield process, lines[0]
        finally:
            process.kill()
            process.wait()


def _read(log: IO[str]) -> list[str]:
    return os.pread(log.fileno(), 1_000_000, 0).decode().splitlines()


@dataclass
class Machines:
    """A scheduler with workers, each a process."""

    stack: ExitStack
    options: tuple[str, ...] = ()
    protocol: str = "tcp"
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def __post_init__(self) -> None:
        given = ("scheduler", "--port", "0", "--protocol", self.protocol, *self.options)
        self.scheduler, line = self.stack.enter_context(dask(*given, ready="Scheduler at:"))
        self.address = line.split()[-1]

    def start_worker(self, *options: str) -> None:
        given = ("worker", self.address, "--no-nanny", "--nthreads", "1", *self.options, *options)
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
    monkeypatch.setattr(cluster_module, "_SILENCE", 2.0)


@pytest.fixture
def notes() -> list[str]:
    return []


def given_up(results: Path, cluster: Cluster, disturb: Callable[[], object], expected: bytes) -> str:
    """What a study says that is disturbed and gives up; it is finished here with the same bytes."""
    with pytest.raises(IsolationError) as refusal:
        run_study(STUDY, results, cluster, Counter(20, disturb), cluster.notify)
    assert not results.exists()
    assert journal_path(results).exists()
    counter = Counter()
    run_study(STUDY, results, Local(1), counter)
    assert counter.first is not None
    assert counter.first >= 20
    assert results.read_bytes() == expected
    return str(refusal.value)


@pytest.mark.slow
@pytest.mark.usefixtures("hasty")
def test_a_scheduler_that_is_killed_is_reported_at_once(
    machines: Machines, expected: bytes, tmp_path: Path, notes: list[str]
) -> None:
    machines.start_worker()
    began: list[float] = []

    def kill() -> None:
        machines.scheduler.kill()
        began.append(time.monotonic())

    said = given_up(tmp_path / "r.csv", Cluster(machines.address, notify=notes.append), kill, expected)
    assert f"The connection to the scheduler at {machines.address} was lost; start it and its workers again; " in said
    assert notes == []


@pytest.mark.slow
@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize("suspended", ["scheduler", "worker"])
def test_suspended_processes_are_reported_and_given_up(
    suspended: str, machines: Machines, expected: bytes, tmp_path: Path, notes: list[str]
) -> None:
    machines.start_worker()
    victim = machines.scheduler if suspended == "scheduler" else machines.workers[0]
    said = given_up(
        tmp_path / "r.csv",
        Cluster(machines.address, patience=2.0, notify=notes.append),
        lambda: victim.send_signal(signal.SIGSTOP),
        expected,
    )
    problem = {
        "scheduler": f"The scheduler at {machines.address} does not answer (",
        "worker": f"1 of 1 workers of {machines.address} have given no sign of life for 2 s (",
    }[suspended]
    assert problem in said
    assert "given up after 2 s; " in said
    assert [note.startswith(problem) for note in notes] == [True]
    assert notes[0].endswith("; giving up after 2 s.")


@pytest.mark.slow
@pytest.mark.usefixtures("hasty")
def test_a_worker_that_is_resumed_finishes_the_study(machines: Machines, expected: bytes, tmp_path: Path) -> None:
    machines.start_worker()
    worker = machines.workers[0]

    def resume(note: str) -> None:
        assert "no sign of life" in note
        worker.send_signal(signal.SIGCONT)

    cluster = Cluster(machines.address, notify=resume)
    suspend = Counter(20, lambda: worker.send_signal(signal.SIGSTOP))
    run_study(STUDY, tmp_path / "r.csv", cluster, suspend, cluster.notify)
    assert (tmp_path / "r.csv").read_bytes() == expected


@pytest.mark.slow
@pytest.mark.usefixtures("hasty")
def test_a_cluster_without_workers_is_reported_and_waited_for(
    machines: Machines, expected: bytes, tmp_path: Path, notes: list[str]
) -> None:
    with pytest.raises(IsolationError, match=r"has no workers; start some with `dask worker tcp.*given up after 1 s"):
        run_study(STUDY, tmp_path / "r.csv", Cluster(machines.address, patience=1.0), notify=notes.append)
    assert [note.endswith("; giving up after 1 s.") for note in notes] == [True]
    assert not list(tmp_path.iterdir())
    run_study(STUDY, tmp_path / "r.csv", Cluster(machines.address), notify=lambda _: machines.start_worker())
    assert (tmp_path / "r.csv").read_bytes() == expected


PRELOADED = """
import platform
from importlib import metadata

import distributed.versions

changed = {"numpy": "1.0.0", "cloudpickle": "0.1"}
known = metadata.distribution
metadata.version = distributed.versions.version = lambda name: changed.get(name) or known(name).version
"""


@pytest.mark.slow
def test_other_versions_are_told_in_words(tmp_path: Path, notes: list[str]) -> None:
    (tmp_path / "other.py").write_text(PRELOADED)
    preload = ("--preload", str(tmp_path / "other.py"))
    with ExitStack() as stack:
        machines = Machines(stack, preload)
        machines.start_worker()
        with pytest.raises(IsolationError, match=r"A worker of the cluster has numpy 1.0, but this computer"):
            run_study(STUDY, tmp_path / "r.csv", Cluster(machines.address, notify=notes.append))
    assert [note.partition(", but")[0] for note in notes] == [
        f"Caution: the scheduler at {machines.address} has cloudpickle 0.1"
    ]


@pytest.mark.slow
def test_a_scheduler_without_the_package_is_told_what_it_needs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, notes: list[str]
) -> None:
    monkeypatch.delenv("PYTHONPATH", raising=False)
    (tmp_path / "hidden.py").write_text("import sys\nsys.modules['strandspring'] = None\n")
    with ExitStack() as stack:
        machines = Machines(stack, ("--preload", str(tmp_path / "hidden.py")))
        machines.start_worker()
        with pytest.raises(IsolationError, match=r"its scheduler \(python .*\) and workers need strandspring 0"):
            run_study(STUDY, tmp_path / "r.csv", Cluster(machines.address, notify=notes.append))


# TLS


@pytest.fixture(scope="module")
def certificates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files of an authority (ca.pem), and of a client (cert.pem, key.pem) that it knows."""
    folder = tmp_path_factory.mktemp("certificates")
    authority = trustme.CA()
    client = authority.issue_cert("dask.example")
    authority.cert_pem.write_to_path(folder / "ca.pem")
    client.cert_chain_pems[0].write_to_path(folder / "cert.pem")
    client.private_key_pem.write_to_path(folder / "key.pem")
    trustme.CA().cert_pem.write_to_path(folder / "other.pem")
    return folder


@pytest.mark.slow
@pytest.mark.usefixtures("hasty")
def test_tls_by_options_and_by_the_configuration_of_dask(
    certificates: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    save_model("mount.json", ModelFile("mount", SPRING, uncertainty=UNCERTAINTY))
    terminal = Terminal(capsys)
    ca, cert, key = (str(certificates / f"{name}.pem") for name in ("ca", "cert", "key"))
    with ExitStack() as stack:
        machines = Machines(stack, ("--tls-ca-file", ca, "--tls-cert", cert, "--tls-key", key), "tls")
        machines.start_worker()
        assert machines.address.startswith("tls://")
        to = [*COMMAND, "--scheduler", machines.address]
        terminal(*to, "--tls-ca-file", ca, "--tls-cert", cert, "--tls-key", key, "-o", "options.csv")
        assert "Caution" not in terminal.err
        terminal(*to, "-o", "none.csv", status=1)
        assert f"{machines.address} needs certificates: those of the authority (--tls-ca-file)" in terminal.err
        other = str(certificates / "other.pem")
        terminal(*to, "--tls-ca-file", other, "--tls-cert", cert, "--tls-key", key, "-o", "none.csv", status=1)
        assert "No scheduler answers" in terminal.err
        without = machines.address.replace("tls://", "tcp://")
        terminal(*COMMAND, "--scheduler", without, "-o", "none.csv", status=1)
        assert "or tls://host:8786 if it has TLS" in terminal.err
        # A program that reads the configuration when it starts.
        configured = {
            "DASK_DISTRIBUTED__COMM__TLS__CA_FILE": ca,
            "DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT": cert,
            "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY": key,
        }
        subprocess.run(
            [sys.executable, "-m", "strandspring", *to, "-o", "configured.csv"],
            env={**os.environ, **configured},
            check=True,
        )
    run_study(CHEAP, Path("local.csv"), Local(1))
    assert Path("options.csv").read_bytes() == Path("configured.csv").read_bytes() == Path("local.csv").read_bytes()


def test_certificates_that_cannot_be_used_are_refused(certificates: Path, tmp_path: Path) -> None:
    ca, cert, key = (str(certificates / f"{name}.pem") for name in ("ca", "cert", "key"))
    (tmp_path / "empty.pem").touch()
    locked = tmp_path / "locked.pem"
    locked.write_text("-----BEGIN ENCRYPTED PRIVATE KEY-----\nMIIB\n-----END ENCRYPTED PRIVATE KEY-----\n")
    wrong = {
        "no such file": (ca, cert, str(tmp_path / "none.pem")),
        r"cannot be used \(": (str(tmp_path / "empty.pem"), cert, key),
        "have no passphrase": (ca, cert, str(locked)),
        "must belong to the certificate": (ca, str(certificates / "other.pem"), key),
    }
    for words, files in wrong.items():
        with pytest.raises(IsolationError, match=words):
            run_study(CHEAP, tmp_path / "r.csv", Cluster("tls://127.0.0.1:1", *files))
    for address in ("tcp://127.0.0.1:1", "127.0.0.1:1"):
        with pytest.raises(JobError, match=r"Certificates need a scheduler with TLS, .*begins with tls://"):
            Cluster(address, ca)


@pytest.mark.parametrize(
    ("address", "cautions"),
    [("tcp://192.0.2.1:8786", 1), ("host.invalid:8786", 1), ("tcp://127.0.0.1:1", 0), ("tcp://localhost:1", 0),
     ("tcp://[::1]:1", 0)],
)  # fmt: skip
def test_an_address_without_encryption_is_cautioned_of(
    address: str, cautions: int, tmp_path: Path, notes: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster_module, "_CONNECTING", 0.2)
    with pytest.raises(IsolationError, match="No scheduler answers at"):
        run_study(CHEAP, tmp_path / "r.csv", Cluster(address, notify=notes.append))
    assert [f"{address} has no TLS, and anyone who can reach that scheduler can" in note for note in notes] == [
        True
    ] * cautions


@pytest.mark.parametrize(
    "options",
    [("--tls-ca-file", "ca.pem"), ("--scheduler", "tcp://a:1", "--tls-cert", "c.pem"), ("--patience", "nan")],
)
def test_wrong_options_of_a_cluster_are_wrong_usage(
    options: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    Terminal(capsys)(*COMMAND, *options, "-o", "r.csv", status=2)
