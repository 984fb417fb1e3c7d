"""Parameter studies: what is drawn and varied, what a run gives, the same bytes wherever and however often they run,
and nothing lost when that breaks.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import re
import resource
import signal
import struct
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from journal_content import execute, rows_in
from strandspring.campaigns.jobs.options import Workers
from strandspring.campaigns.studies.definition import Study
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.journal import journal_path
from strandspring.campaigns.studies.runs import DONE
from strandspring.campaigns.studies.system_planning import planned_study
from strandspring.campaigns.studies.system_study import SystemStudy
from strandspring.errors import IsolationError
from strandspring.examples.system_models import SYSTEMS
from strandspring.model.joint import HYSTERETIC_UNITS, JointCovariance
from strandspring.vibration.description.named_files import FilesOfFolder
from strandspring.vibration.description.system_file import read_description
from strandspring.vibration.one_mass.options import Curve, Excitation, Mount
from strandspring.vibration.one_mass.response import frequency_response
from strandspring.vibration.one_mass.system import IsolatedMass, static_equilibrium
from strandspring.vibration.options import Part, Run
from studies import CHEAP, CORRELATION, ERRORS, SPREAD, SPRING, Counter, correlations, uncertainty_of_hysteresis

pytestmark = pytest.mark.long

DRAWN = tuple(HYSTERETIC_UNITS)
CONTENT = read_description(SYSTEMS / "electronics_box.toml")
CONTENT["units"] |= {"mass": "kg", "damping": "N s/m"}
PATHS = Path(__file__).with_name("paths.txt")
SQL_OF_OTHERS = Path(__file__).with_name("foreign.sql")  # what makes a journal that of another program
MASSES = {"body.box.mass": "15 kg:25 kg:3"}


def system_study(vary: dict[str, Any] = MASSES, **options: Any) -> SystemStudy:
    given = {"draws": 16, "seed": 0, "cases": "drop", "step": 5e-4, **options}
    part = Part(given.pop("cases", None), given.pop("candidates", None))
    return planned_study(CONTENT, FilesOfFolder(SYSTEMS), vary, part, Run(**given))


# ---- what is drawn and varied ---------------------------------------------------------------------


def test_draws_scatter_as_the_uncertainty_says_and_stay_possible() -> None:
    number = 4000
    drawn = [SPREAD.draw(SPRING, 0, k) for k in range(number)]
    logs = np.log([[getattr(one, name) for name in DRAWN] for one in drawn])
    relative = np.array([ERRORS[name] / getattr(SPRING, name) for name in DRAWN])
    covariance = np.outer(relative, relative) * correlations(CORRELATION)
    # Five standard errors of a mean and of a covariance of normal numbers: one in 1e6 by chance, and the seed is fixed.
    middle = np.log([getattr(SPRING, name) for name in DRAWN])
    assert np.all(np.abs(logs.mean(axis=0) - middle) < 5.0 * relative / np.sqrt(number))
    error = np.sqrt((np.outer(relative, relative) ** 2 + covariance**2) / number)
    assert np.all(np.abs(np.cov(logs.T) - covariance) < 5.0 * error)
    # A draw is the same whatever was drawn before, and only of the hysteresis.
    assert SPREAD.draw(SPRING, 0, 77) == drawn[77] != SPREAD.draw(SPRING, 1, 77)
    assert replace(drawn[0], **{name: getattr(SPRING, name) for name in DRAWN}) == SPRING
    errors = {name: 5.0 * getattr(SPRING, name) for name in DRAWN}
    wide = JointCovariance.to_draw_from(SPRING, uncertainty_of_hysteresis(errors, {}))
    ends = [wide.draw(SPRING, 0, k) for k in range(300)]  # a spring that is not possible raises
    assert {0.5, 1000.0} <= {one.sigma for one in ends}


@pytest.mark.parametrize("row", PATHS.read_text(encoding="utf-8").splitlines()[1:])
def test_paths_lead_to_their_values(row: str) -> None:
    path, given, place, expected = row.split(" | ")
    planned, found = system_study({path: given}), []
    for file in map(planned.described, range(planned.grid_size)):
        found.append(eval(place, {"system": file.candidates[0][1], "file": file}))  # noqa: S307
    assert found == pytest.approx(json.loads(expected), rel=1e-12)


# ---- what a run gives, and what is said of them all -----------------------------------------------


def test_a_run_tells_what_isolate_does() -> None:
    study = Study(
        SPRING, Excitation.BASE_ACCELERATION, (4.0, 5.0), (0.5,), (0.9, 1.2), draws=2, seed=1, spread=SPREAD,
        mount=Mount(30.0, 2, 3, 8.0), curve=Curve(points=12),
    )  # fmt: skip
    (row,) = study.rows([7])
    drawn = SPREAD.draw(SPRING, 1, 1)
    assert (row.run, row.draw, row.mass, row.level, row.stiffness_factor) == (7, 1, 5.0, 0.5, 1.2)
    assert [getattr(row, name) for name in DRAWN] == [getattr(drawn, name) for name in DRAWN]
    stiff = replace(drawn, kE=tuple(1.2 * c for c in SPRING.kE), kappa_omega=1.2 * drawn.kappa_omega)
    system = IsolatedMass(stiff, 5.0, Mount(30.0, 2, 3, 8.0))
    rest = static_equilibrium(system)
    band = np.geomspace(0.23 * rest.frequency, 5.0 * rest.frequency, 12)
    resonance = frequency_response(system, Excitation.BASE_ACCELERATION, 0.5, band).resonance
    assert (row.static_equilibrium, row.sag, row.outcome) == (rest.displacement, rest.sag, DONE)
    assert {name: getattr(row, name) for name in asdict(resonance)} == asdict(resonance)


# ---- where they are done, and how they go on ------------------------------------------------------


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The results of CHEAP, one run after the other."""
    path = tmp_path_factory.mktemp("serial") / "results.csv"
    run_study(CHEAP, path, Workers())
    return path.read_bytes()


@pytest.fixture
def results(tmp_path: Path) -> Path:
    return tmp_path / "results.csv"


@pytest.fixture
def half_done(results: Path) -> Path:
    """Where the results of CHEAP belong, of which some runs are finished."""

    def stop() -> None:
        raise IsolationError("Enough.")

    with pytest.raises(IsolationError, match=r"Enough\. 20 of 60 runs are kept"):
        run_study(CHEAP, results, Workers(), Counter(20, stop))
    return results


def goes_on(results: Path, kept: int | None, expected: bytes) -> list[str]:
    """The study is finished from so many runs, with the same bytes, and leaves nothing beside its results."""
    counter, notes = Counter(), list[str]()
    run_study(CHEAP, results, Workers(notify=notes.append), counter)
    assert counter.first is not None
    assert (counter.first >= 20) if kept is None else (counter.first == kept)
    assert counter.last == len(CHEAP)
    assert results.read_bytes() == expected
    assert [path.name for path in results.parent.iterdir() if path.name.startswith("results")] == [results.name]
    return notes


def test_processes_and_a_cluster_that_loses_a_worker_give_the_same_bytes(expected: bytes, tmp_path: Path) -> None:
    from distributed import LocalCluster

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        victim = cluster.workers[0].process.pid
        here_or_there = [
            (Workers(2), Counter()),
            (Workers(scheduler=cluster.scheduler_address), Counter(20, lambda: os.kill(victim, signal.SIGKILL))),
        ]
        for k, (placing, counter) in enumerate(here_or_there):
            results = tmp_path / f"new {k}" / "results.csv"
            run_study(CHEAP, results, placing, counter)
            assert (counter.first, counter.last) == (0, len(CHEAP))
            assert results.read_bytes() == expected
            assert list(results.parent.iterdir()) == [results]
        drawn, found = system_study({"body.box.mass": "15 kg:25 kg:2"}, candidates="standard"), []
        for placing in (Workers(), Workers(scheduler=cluster.scheduler_address)):
            run_study(drawn, tmp_path / "system.csv", placing)
            found.append((tmp_path / "system.csv").read_bytes())
        assert found[0] == found[1]


def test_a_worker_process_that_dies_costs_no_finished_run(expected: bytes, results: Path) -> None:
    others = multiprocessing.active_children()

    def kill_one() -> None:
        next(child for child in multiprocessing.active_children() if child not in others).kill()

    with pytest.raises(IsolationError, match=r"A worker process died, .*\. \d+ of 60 runs are kept in .*part.sqlite"):
        run_study(CHEAP, results, Workers(2), Counter(20, kill_one))
    assert multiprocessing.active_children() == others
    goes_on(results, None, expected)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (
            {"draws": 19, "mount": Mount(20.0)},
            r"\(draws 20 instead of 19, load null instead of 20.0\); finish",
        ),
        ({"spring": replace(SPRING, rho=1.01 * SPRING.rho)}, r"\(another model\)"),
    ],
)
def test_the_journal_of_another_study_is_refused(half_done: Path, change: dict[str, Any], told: str) -> None:
    before = journal_path(half_done).read_bytes()
    with pytest.raises(IsolationError, match=told):
        run_study(replace(CHEAP, **change), half_done, Workers())
    assert journal_path(half_done).read_bytes() == before


SQL = "UPDATE row SET content = "


@pytest.mark.parametrize(
    ("change", "dropped"),
    [
        (f"{SQL}CAST(replace(CAST(content AS TEXT), '0.0001', '0.0002') AS BLOB) WHERE key < 2", 2),
        ("UPDATE row SET checksum = NULL, content = NULL WHERE key = 3", 1),
        (f"{SQL}zeroblob(67108865) WHERE key = 3", 1),
        ("UPDATE row SET key = 60 WHERE key = 3", 1),
    ],
)
def test_damaged_rows_are_dropped_and_reported(half_done: Path, expected: bytes, change: str, dropped: int) -> None:
    execute(journal_path(half_done), change)
    (said, *_) = goes_on(half_done, 20 - dropped, expected)
    assert re.search(rf"{dropped} damaged rows? w(as|ere) dropped; their runs are executed again", said)


FOREIGN = "is not the journal of a study"


@pytest.mark.parametrize(
    ("damage", "told"),
    [
        (lambda content: content[:-4096], "is damaged: .*; remove it to start again"),
        (lambda content: content[:8192] + bytes(4096) + content[12288:], "is damaged"),
        (lambda content: content.replace(b"CREATE TABLE", b"CREATE \xbdABLE"), "is damaged"),
        *((lambda _, text=text: text, FOREIGN) for text in (b"my notes", b"[" * 100_000)),
        *((line, f"{FOREIGN}; move it away") for line in SQL_OF_OTHERS.read_text(encoding="utf-8").splitlines()),
    ],
)
def test_a_damaged_or_foreign_file_is_refused_and_left_as_it_is(half_done: Path, damage: Any, told: str) -> None:
    journal = journal_path(half_done)
    if isinstance(damage, str):
        execute(journal, damage)
    else:
        journal.write_bytes(damage(journal.read_bytes()))
    changed = journal.read_bytes()
    with pytest.raises(IsolationError, match=told):
        run_study(CHEAP, half_done, Workers())
    assert journal.read_bytes() == changed
    assert [path for path in half_done.parent.iterdir() if path.name.startswith("results")] == [journal]


def test_a_rollback_journal_that_names_another_file_is_not_followed(half_done: Path, tmp_path: Path) -> None:
    # SQLite takes the name for that of a super-journal, which it removes after a rollback.
    journal, precious = journal_path(half_done), tmp_path / "precious"
    precious.write_text("mine")
    name = os.fsencode(precious)
    header = bytes.fromhex("d9d505f920a163d7") + struct.pack(">5I", 0, 0, 1, 512, 4096)
    end = struct.pack(">I", 262145) + name + struct.pack(">II", len(name), sum(name)) + header[:8]
    Path(f"{journal}-journal").write_bytes(header.ljust(512, b"\0") + end)
    with pytest.raises(IsolationError, match=r"part.sqlite-journal was not written by strandspring; move it away"):
        run_study(CHEAP, half_done, Workers())
    assert precious.read_text() == "mine"


@pytest.mark.parametrize("kind", [os.mkfifo, Path.mkdir, lambda path: path.symlink_to("/dev/zero")])
@pytest.mark.parametrize("suffix", ["", "-wal", "-journal"])
def test_a_journal_must_be_a_regular_file(suffix: str, kind: Callable[[Path], object], results: Path) -> None:
    kind(Path(f"{journal_path(results)}{suffix}"))
    with pytest.raises(IsolationError, match="is a folder or a device; move it away, or write elsewhere"):
        run_study(CHEAP, results, Workers())


@pytest.mark.parametrize("limit", [100, 6000, 30000, 60000])
def test_a_full_disk_costs_nothing_that_is_finished(limit: int, expected: bytes, results: Path) -> None:
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        with pytest.raises(IsolationError, match=r"cannot be written: (disk I/O error|File too large); "):
            run_study(CHEAP, results, Workers())
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    kept = rows_in(journal_path(results))
    assert kept > 0 or limit < 30000
    goes_on(results, kept, expected)
