"""Parameter studies: the same bytes wherever the runs are done, and nothing lost when that breaks."""

from __future__ import annotations

import gc
import json
import math
import multiprocessing
import os
import re
import resource
import signal
import sqlite3
import struct
import subprocess
import sys
import time
import tracemalloc
import zlib
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import psutil
import pytest
from distributed import LocalCluster

import strandspring
import studies
from journal_content import execute, rows_in, written
from strandspring import StrandspringError, __version__
from strandspring.campaigns.jobs import cluster as cluster_module
from strandspring.campaigns.jobs.cluster import Cluster
from strandspring.campaigns.jobs.rowlog import open_alone
from strandspring.campaigns.jobs.runners import Local
from strandspring.campaigns.studies.definition import Study
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.journal import Journal, journal_path
from strandspring.model.joint import JointCovariance
from strandspring.model.modelfile import ModelFile, save_model
from strandspring.vibration.one_mass.system import Excitation, IsolationError
from studies import CHEAP, COMMAND, ERRORS, SPRING, UNCERTAINTY, Counter, uncertainty_of_hysteresis
from terminal import Terminal

pytestmark = pytest.mark.long


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Terminal:
    monkeypatch.chdir(tmp_path)
    save_model("mount.json", ModelFile("mount", SPRING, uncertainty=UNCERTAINTY))
    return Terminal(capsys)


def journal_of(results: Path, study: Study) -> Journal:
    """The journal of a study, which belongs to it."""
    return Journal(results, study)


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The results of CHEAP, one run after the other."""
    path = tmp_path_factory.mktemp("serial") / "results.csv"
    run_study(CHEAP, path, Local(1))
    return path.read_bytes()


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0") as cluster:
        yield cluster


# Where they are done


def test_several_processes_give_the_same_bytes(expected: bytes, tmp_path: Path) -> None:
    results = tmp_path / "new folder" / "results.csv"
    counter = Counter()
    run_study(CHEAP, results, Local(2), counter)
    assert results.read_bytes() == expected
    assert (counter.first, counter.last) == (0, len(CHEAP))
    assert list(results.parent.iterdir()) == [results]


def test_a_cluster_that_loses_a_worker_gives_the_same_bytes(
    expected: bytes, tmp_path: Path, cluster: LocalCluster
) -> None:
    results = tmp_path / "results.csv"
    victim = cluster.workers[0].process.pid
    counter = Counter(20, lambda: os.kill(victim, signal.SIGKILL))
    run_study(CHEAP, results, Cluster(cluster.scheduler_address), counter)
    assert not psutil.pid_exists(victim)
    assert results.read_bytes() == expected
    assert counter.last == len(CHEAP)


def test_a_cluster_of_another_version_is_refused(
    tmp_path: Path, cluster: LocalCluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = cluster_module._versions()
    monkeypatch.setattr(cluster_module, "_versions", lambda: here | {"strandspring": "0.0.0"})
    with pytest.raises(
        IsolationError, match=f"has strandspring {__version__}, but this computer has strandspring 0.0.0"
    ):
        run_study(CHEAP, tmp_path / "results.csv", Cluster(cluster.scheduler_address))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_cluster_that_goes_away_loses_no_finished_run(expected: bytes, tmp_path: Path) -> None:
    results = tmp_path / "results.csv"
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=":0") as short_lived:
        address = short_lived.scheduler_address
        with pytest.raises(IsolationError, match=r"was lost; .*; \d+ of 60 runs are kept in .*part.sqlite"):
            run_study(CHEAP, results, Cluster(address), Counter(20, short_lived.close))
    counter = Counter()
    run_study(CHEAP, results, Local(1), counter)
    assert counter.first is not None
    assert counter.first >= 20
    assert results.read_bytes() == expected


def test_a_worker_process_that_dies_loses_no_finished_run(expected: bytes, tmp_path: Path) -> None:
    results = tmp_path / "results.csv"
    others = multiprocessing.active_children()  # of the cluster

    def workers() -> list[multiprocessing.process.BaseProcess]:
        return [child for child in multiprocessing.active_children() if child not in others]

    def kill_one() -> None:
        workers()[0].kill()

    with pytest.raises(IsolationError, match=r"A worker process died, .*; \d+ of 60 runs are kept"):
        run_study(CHEAP, results, Local(2), Counter(20, kill_one))
    assert not workers()
    counter = Counter()
    run_study(CHEAP, results, Local(1), counter)
    assert counter.first is not None
    assert counter.first >= 20
    assert results.read_bytes() == expected


@pytest.mark.slow
@pytest.mark.parametrize(
    "end", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM], ids=["killed", "interrupted", "terminated"]
)
def test_a_study_that_is_ended_goes_on(end: signal.Signals, terminal: Terminal) -> None:
    # So many runs that the signal comes before the last one.
    draws, serial = 400, Path("serial.csv")
    run_study(replace(CHEAP, draws=draws), serial, Local(1))
    runs = len(replace(CHEAP, draws=draws))
    results = Path("results.csv")
    journal = journal_path(results)
    command = [*COMMAND, "--draws", str(draws), "-o", str(results)]
    program = subprocess.Popen(
        [sys.executable, "-m", "strandspring", *command, "--workers", "2"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60.0
    while written(journal) < 100_000:
        assert program.poll() is None, program.communicate()
        assert time.monotonic() < deadline
        workers = psutil.Process(program.pid).children(recursive=True)
        time.sleep(0.01)
    program.send_signal(end)
    said, complained = program.communicate(timeout=60)
    assert (said, results.exists()) == ("", False)
    assert len(workers) >= 2
    assert not psutil.wait_procs(workers, timeout=20)[1]  # none is left behind
    kept = rows_in(journal)
    assert kept >= 10
    if end is not signal.SIGKILL:
        assert list(journal.parent.glob("results*")) == [journal]
        assert program.returncode == 128 + end
        assert f"{kept} of {runs} runs are kept in results.csv.part.sqlite; the same command continues" in complained
        assert "Traceback" not in complained
    terminal(*command, "--workers", "1")
    assert f"{kept} of {runs} runs were finished before." in terminal.err
    assert results.read_bytes() == serial.read_bytes()
    assert not list(journal.parent.glob("*.part*"))


def test_a_wait_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("strandspring.campaigns.jobs.runners._REPORT_EVERY", 1e-3)
    messages: list[str] = []
    run_study(CHEAP, tmp_path / "results.csv", Local(2), notify=messages.append)
    assert "Nothing has been finished for 0.001 s; still waiting for the workers." in messages


# The journal


@pytest.fixture
def half_done(tmp_path: Path) -> Path:
    """Where the results of CHEAP belong, of which some runs are finished."""
    results = tmp_path / "results.csv"

    def stop() -> None:
        raise IsolationError("Enough.")

    with pytest.raises(IsolationError, match=r"Enough; 20 of 60 runs are kept"):
        run_study(CHEAP, results, Local(1), Counter(20, stop))
    return results


UNCORRELATED = JointCovariance.from_uncertainty(SPRING, uncertainty_of_hysteresis(SPRING, ERRORS, {}))


@pytest.mark.parametrize(
    ("study", "told"),
    [
        (replace(CHEAP, seed=8), r"\(seed 7 instead of 8\); finish that one with its own options, or remove the file"),
        (replace(CHEAP, draws=19, load=20.0), r"\(draws 20 instead of 19, load null instead of 20.0\)"),
        (replace(CHEAP, excitation=Excitation.FORCE), '"base displacement" instead of "force"'),
        (replace(CHEAP, spring=replace(SPRING, rho=1.01 * SPRING.rho)), r"\(another model\)"),
        (
            replace(
                CHEAP, spread=JointCovariance.from_uncertainty(SPRING, uncertainty_of_hysteresis(SPRING, ERRORS, {}))
            ),
            r"\(another model\)",
        ),
    ],
)
def test_the_journal_of_another_study_is_refused(half_done: Path, study: Study, told: str) -> None:
    before = journal_path(half_done).read_bytes()
    with pytest.raises(IsolationError, match=told):
        run_study(study, half_done, Local(1))
    assert journal_path(half_done).read_bytes() == before


def test_the_journal_of_another_version_is_refused(half_done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("strandspring.campaigns.studies.journal.__version__", "9.9")
    with pytest.raises(IsolationError, match=rf'\(version "{__version__}" instead of "9.9"\)'):
        run_study(CHEAP, half_done, Local(1))


KILLED = """
import os, sys
from pathlib import Path
from strandspring.campaigns.jobs.rowlog import RowLog
from strandspring.campaigns.studies.journal import Journal
from studies import CHEAP

if sys.argv[2] == "manifest":
    RowLog._read = lambda self: os._exit(0)  # after the first transaction
log = Journal(Path(sys.argv[1]), CHEAP)
log.add(CHEAP.rows(range(5)))
log._database.execute("PRAGMA cache_size = 1")  # pages are written before the transaction ends
log._database.execute("UPDATE row SET content = zeroblob(100000)")
os._exit(0)
"""


@pytest.mark.parametrize("place", ["rows", "manifest"])
def test_a_transaction_that_a_kill_cut_off_is_rolled_back(place: str, expected: bytes, tmp_path: Path) -> None:
    results = tmp_path / "results.csv"
    helpers = str(Path(studies.__file__).parent)
    environment = os.pathsep.join([helpers, str(Path(strandspring.__file__).parents[1])])
    command = [sys.executable, "-c", KILLED, str(results), place]
    subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": environment})
    journal = journal_path(results)
    assert {path.name for path in tmp_path.iterdir()} == {journal.name, f"{journal.name}-wal"}
    counter = Counter()
    run_study(CHEAP, results, Local(1), counter)
    assert counter.first == (5 if place == "rows" else 0)
    assert results.read_bytes() == expected
    assert list(tmp_path.iterdir()) == [results]


ROW = list(astuple(CHEAP.rows([5])[0]))


@pytest.mark.parametrize(
    ("change", "dropped"),
    [
        ("UPDATE row SET content = CAST(replace(CAST(content AS TEXT), '0.0001', '0.0002') AS BLOB) WHERE key < 2", 2),
        ("UPDATE row SET checksum = checksum + 1 WHERE key = 3", 1),
        ("UPDATE row SET checksum = NULL, content = NULL WHERE key = 3", 1),
        ("UPDATE row SET content = CAST(content AS TEXT) WHERE key = 3", 1),
        ("UPDATE row SET content = zeroblob(67108865) WHERE key = 3", 1),
        ("UPDATE row SET key = 60 WHERE key = 3", 1),
        ("UPDATE row SET key = -1 WHERE key = 3", 1),
    ],
    ids=["digit", "checksum", "nothing", "text", "huge", "unknown run", "negative run"],
)
def test_damaged_rows_are_dropped_and_reported(half_done: Path, expected: bytes, change: str, dropped: int) -> None:
    execute(journal_path(half_done), change)
    counter = Counter()
    said: list[str] = []
    run_study(CHEAP, half_done, Local(1), counter, said.append)
    assert counter.first == 20 - dropped
    assert re.search(rf"{dropped} damaged rows? w(as|ere) dropped; their runs are executed again", said[0])
    assert half_done.read_bytes() == expected


@pytest.mark.parametrize(
    "row",
    ["nothing", "[1, 2]", "{}", [*ROW, 1], [6, *ROW[1:]], [*ROW[:5], "=1+1", *ROW[6:]], [*ROW[:5], math.nan, *ROW[6:]]],
    ids=["text", "short", "object", "too long", "another run", "wrong type", "no number"],
)
def test_a_row_of_a_knowing_hand_is_dropped_where_it_is_used(
    half_done: Path, expected: bytes, row: str | list[object]
) -> None:
    journal = journal_path(half_done)
    content = (row if isinstance(row, str) else json.dumps(row)).encode()
    ((manifest,),) = execute(journal, "SELECT manifest FROM job")
    checksum = zlib.crc32(content, zlib.crc32(manifest))
    execute(journal, "INSERT OR REPLACE INTO row VALUES (5, ?, ?)", checksum, content)
    with pytest.raises(IsolationError, match=r"had a damaged row, which was dropped; start .*; 59 of 60 runs are kept"):
        run_study(CHEAP, half_done, Local(1))
    assert not half_done.exists()
    counter = Counter()
    run_study(CHEAP, half_done, Local(1), counter)
    assert counter.first == 59
    assert half_done.read_bytes() == expected


def test_a_row_of_another_study_is_damage(half_done: Path, expected: bytes, tmp_path: Path) -> None:
    other = journal_of(tmp_path / "other.csv", replace(CHEAP, seed=8))
    other.add(replace(CHEAP, seed=8).rows([30]))
    other.close(remove=False)
    (stolen,) = execute(other.path, "SELECT * FROM row")
    execute(journal_path(half_done), "INSERT INTO row VALUES (?, ?, ?)", *stolen)
    counter = Counter()
    run_study(CHEAP, half_done, Local(1), counter)
    assert (counter.first, half_done.read_bytes()) == (20, expected)


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: content[:-4096],
        lambda content: content[: len(content) // 2],
        lambda content: content[:8192] + bytes(4096) + content[12288:],
        lambda content: content[:4096] + bytes(range(256)) * 16 + content[8192:],
        lambda content: content.replace(b"CREATE TABLE", b"CREATE \xbdABLE"),
        lambda content: content.replace(b"CREATE TABLE", b"CREATE TABL\xbd").replace(b"table", b"\xbdable"),
    ],
    ids=["cut off", "half", "empty page", "other page", "other statement", "other text"],
)
def test_a_damaged_file_is_refused_and_left_as_it_is(half_done: Path, damage: Callable[[bytes], bytes]) -> None:
    journal = journal_path(half_done)
    changed = damage(journal.read_bytes())
    journal.write_bytes(changed)
    with pytest.raises(IsolationError, match=r"part.sqlite is damaged: .*; remove it to start again"):
        run_study(CHEAP, half_done, Local(1))
    assert journal.read_bytes() == changed
    assert [path for path in half_done.parent.iterdir() if path.name.startswith("results")] == [journal]
    journal.unlink()
    run_study(CHEAP, half_done, Local(1))


@pytest.mark.parametrize(
    "statement",
    [
        "CREATE TRIGGER t AFTER INSERT ON row BEGIN DELETE FROM row; END",
        "CREATE VIEW v AS SELECT randomblob(1000000000)",
        "CREATE INDEX i ON row (length(content))",
        "ALTER TABLE row ADD COLUMN more AS (abs(key))",
        "DROP TABLE row",
        "INSERT INTO job SELECT manifest FROM job",
        "UPDATE job SET manifest = zeroblob(67108865)",
        "UPDATE job SET manifest = '{}'",
        "DELETE FROM job",
        "PRAGMA application_id = 7",
        "PRAGMA user_version = 7",
    ],
)
def test_a_database_with_anything_else_in_it_is_not_used(half_done: Path, statement: str) -> None:
    journal = journal_path(half_done)
    execute(journal, statement)
    before = journal.read_bytes()
    with pytest.raises(IsolationError, match="is not the journal of a study; move it away"):
        run_study(CHEAP, half_done, Local(1))
    assert journal.read_bytes() == before


def test_a_rollback_journal_that_names_another_file_is_not_followed(half_done: Path, tmp_path: Path) -> None:
    # SQLite takes the name for that of a super-journal, which it removes after a rollback.
    journal, precious = journal_path(half_done), tmp_path / "precious"
    precious.write_text("mine")
    name = os.fsencode(precious)
    header = bytes.fromhex("d9d505f920a163d7") + struct.pack(">5I", 0, 0, 1, 512, 4096)
    end = struct.pack(">I", 262145) + name + struct.pack(">II", len(name), sum(name)) + header[:8]
    Path(f"{journal}-journal").write_bytes(header.ljust(512, b"\0") + end)
    with pytest.raises(IsolationError, match=r"part.sqlite-journal was not written by strandspring; move it away"):
        run_study(CHEAP, half_done, Local(1))
    assert precious.read_text() == "mine"


def test_one_journal_is_used_by_one_program_at_a_time(expected: bytes, tmp_path: Path) -> None:
    results = tmp_path / "results.csv"

    def begin_again() -> None:
        with pytest.raises(IsolationError, match="is in use by another run of the same command; wait until"):
            run_study(CHEAP, results, Local(1))

    run_study(CHEAP, results, Local(1), Counter(20, begin_again))
    assert results.read_bytes() == expected


def test_a_journal_that_is_removed_before_it_is_locked_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "journal"
    path.touch()
    connect = sqlite3.connect
    opened: list[sqlite3.Connection] = []

    def connect_early(*arguments: Any, **options: Any) -> sqlite3.Connection:
        opened.append(connect(*arguments, **options))
        if len(opened) == 1:
            path.unlink()
        return opened[-1]

    monkeypatch.setattr(sqlite3, "connect", connect_early)
    with closing(open_alone(path)) as database:
        database.execute("CREATE TABLE mine (x)")
    assert path.stat().st_size > 0
    assert len(opened) == 3  # the removed one, one that creates it, and one of the file that is there then


@pytest.mark.parametrize("kind", ["fifo", "folder", "device"])
@pytest.mark.parametrize("suffix", ["", "-wal", "-journal"])
def test_a_journal_must_be_a_regular_file(suffix: str, kind: str, tmp_path: Path) -> None:
    results = tmp_path / "results.csv"
    journal = Path(f"{journal_path(results)}{suffix}")
    {"fifo": os.mkfifo, "folder": Path.mkdir, "device": lambda path: path.symlink_to("/dev/zero")}[kind](journal)
    with pytest.raises(IsolationError, match="is a folder or a device; move it away, or write elsewhere"):
        run_study(CHEAP, results, Local(1))


def test_a_link_leads_to_the_journal(half_done: Path, expected: bytes, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    journal_path(half_done).rename(elsewhere)
    journal_path(half_done).symlink_to(elsewhere)
    counter = Counter()
    run_study(CHEAP, half_done, Local(1), counter)
    assert (counter.first, half_done.read_bytes()) == (20, expected)
    assert not elsewhere.exists()


@pytest.mark.parametrize("limit", [100, 2000, 6000, 17000, 30000, 60000])
def test_a_full_disk_costs_nothing_that_is_finished(limit: int, expected: bytes, tmp_path: Path) -> None:
    results = tmp_path / "new" / "results.csv"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        with pytest.raises(IsolationError, match=r"cannot be written: (disk I/O error|File too large); "):
            run_study(CHEAP, results, Local(1))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    kept = rows_in(journal_path(results))
    assert kept > 0 or limit < 30000
    left = {path.name.removesuffix("-wal") for path in tmp_path.rglob("*")}
    assert left == ({"new", journal_path(results).name} if kept else set())
    counter = Counter()
    run_study(CHEAP, results, Local(1), counter)
    assert counter.first == kept
    assert results.read_bytes() == expected


def test_a_journal_that_cannot_be_removed_is_reported(
    expected: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unlink = Path.unlink

    def refuse(path: Path, missing_ok: bool = False) -> None:
        if path.suffix == ".sqlite":
            raise PermissionError(13, "Permission denied")
        unlink(path, missing_ok)

    monkeypatch.setattr(Path, "unlink", refuse)
    results = tmp_path / "results.csv"
    with pytest.raises(StrandspringError, match="no longer needed, but cannot be removed: Permission denied; remove"):
        run_study(CHEAP, results, Local(1))
    assert results.read_bytes() == expected
    monkeypatch.undo()
    counter = Counter()
    run_study(CHEAP, results, Local(1), counter)
    assert counter.first == len(CHEAP)
    assert list(tmp_path.iterdir()) == [results]


def test_results_that_cannot_be_written_are_refused_before_the_runs(tmp_path: Path) -> None:
    (tmp_path / "results.csv").symlink_to(tmp_path / "results.csv")
    with pytest.raises(IsolationError, match="cannot be written: it is a link that leads to itself"):
        run_study(CHEAP, tmp_path / "results.csv", Local(1), Counter(0, lambda: pytest.fail("runs have begun")))
    assert len(list(tmp_path.iterdir())) == 1


def test_a_row_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    rows = CHEAP.rows(range(3))
    journal = journal_of(tmp_path / "results.csv", CHEAP)
    journal.add(rows[::-1])
    assert [journal[run] for run in range(3)] == rows
    assert (journal.finished, 2 in journal, 3 in journal) == (3, True, False)
    journal.add([replace(rows[1], outcome="again")])
    journal.close(False)
    again = journal_of(tmp_path / "results.csv", CHEAP)
    assert (again.finished, again[1].outcome, again[2]) == (3, "again", rows[2])
    again.close(False)


def held_by_studies() -> int:
    """Bytes that code of the study room has allocated; other threads of the tests allocate, too."""
    gc.collect()
    snapshot = tracemalloc.take_snapshot().filter_traces(
        [
            tracemalloc.Filter(True, "*/strandspring/campaigns/studies/*"),
            tracemalloc.Filter(True, "*/strandspring/campaigns/jobs/*"),
        ]
    )
    return sum(statistic.size for statistic in snapshot.statistics("filename"))


def test_memory_does_not_grow_with_the_rows(tmp_path: Path) -> None:
    study = replace(CHEAP, draws=1000)  # 3000 runs
    (row,) = study.rows([0])
    journal = journal_of(tmp_path / "results.csv", study)
    tracemalloc.start()
    before = 0
    for run in range(len(study)):
        journal.add([replace(row, run=run)])
        if run == 500:
            before = held_by_studies()
    growth = held_by_studies() - before
    tracemalloc.stop()
    journal.close(True)
    assert growth < 50_000  # 2500 rows in memory take some 1.7 MB


@pytest.mark.parametrize("notes", ["my notes\n", "my notes", '{"format": "notes"}', "[" * 100_000, "\0" * 1000])
def test_a_file_that_is_no_journal_is_left_alone(notes: str, tmp_path: Path) -> None:
    results = tmp_path / "results.csv"
    journal_path(results).write_text(notes)
    with pytest.raises(IsolationError, match="is not the journal of a study"):
        run_study(CHEAP, results, Local(1))
    assert journal_path(results).read_text() == notes


def test_an_empty_file_is_begun_and_one_that_cannot_be_written_refused(expected: bytes, tmp_path: Path) -> None:
    results = tmp_path / "results.csv"
    journal = journal_path(results)
    journal.touch(0o400)
    if os.geteuid() != 0:
        with pytest.raises(IsolationError, match=r"part.sqlite cannot be written: .*; check the path and its rights"):
            run_study(CHEAP, results, Local(1))
    journal.chmod(0o600)
    Path(f"{journal}-wal").write_bytes(b"of a file that was removed" * 100)
    run_study(CHEAP, results, Local(1))
    assert results.read_bytes() == expected
    assert list(tmp_path.iterdir()) == [results]


def test_a_folder_cannot_be_the_results(tmp_path: Path) -> None:
    with pytest.raises(IsolationError, match="it is a folder or a device; give the path of a file"):
        run_study(CHEAP, tmp_path, Local(1))
    (tmp_path / "file").touch()
    with pytest.raises(IsolationError, match="cannot be written"):
        run_study(CHEAP, tmp_path / "file" / "results.csv", Local(1))


@pytest.mark.slow
def test_a_scheduler_that_does_not_answer_is_reported_within_seconds(terminal: Terminal) -> None:
    begin = time.monotonic()
    terminal(*COMMAND, "--scheduler", "tcp://127.0.0.1:1", "-o", "new/nested/results.csv", status=1)
    assert time.monotonic() - begin < 15.0  # it gives up after 5; a busy machine may take its time
    assert "No scheduler answers at 'tcp://127.0.0.1:1'" in terminal.err
    assert not Path("new").exists()


def test_a_missing_package_is_reported_with_the_command(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    terminal(*COMMAND, "--scheduler", "tcp://127.0.0.1:1", "-o", "new/nested/results.csv", status=1)
    assert not Path("new").exists()
    assert 'install it with pip install "strandspring[cluster]"' in terminal.err
