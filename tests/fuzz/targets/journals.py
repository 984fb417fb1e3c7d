"""Journals of interrupted studies and batches, damaged at random.

Rows and manifest of a journal are changed, repeated, moved, mixed with those of another job, or replaced, with their
checksums or without; tables are added; bytes of the file are changed. The job is then continued. It must end with the
bytes of the undisturbed one, or be refused in words; following the advice (the same command again,
or removing the file)
must lead to these bytes. What is refused must not be changed.
"""

from __future__ import annotations

import json
import random
import re
import sqlite3
import zlib
from collections.abc import Callable, Iterable, Sequence
from contextlib import closing, suppress
from dataclasses import fields, replace
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from strandspring import SpringParameters, TwoStageOptions
from strandspring.campaigns.batches.batch import identify_batch
from strandspring.campaigns.batches.sources import JOURNAL, SpringFile, find_springs
from strandspring.campaigns.batches.spring_row import IDENTIFIED, REFUSED, BatchWork, Finished, SpringRow, digest
from strandspring.campaigns.jobs.runners import Local
from strandspring.campaigns.studies.definition import RunRow, Study
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.journal import journal_path
from strandspring.errors import StrandspringError
from strandspring.loops.selection import Wanted
from strandspring.model.modelfile import ModelFile
from studies import CHEAP
from targets.mutator import damaged, kind_of

Job = Callable[[Path, Callable[[int], None]], dict[str, bytes]]
_ABSURD = (b"1e400", b"-0", b"9" * 26, b"NaN", b"null", b"true", b'"=1+1"', b"[]", b"{}", b"0x10", b"", b"-1", b"0.1")
_JUNK = (b"", b"\0" * 4096, b"[" * 50_000, b'{"a":' * 20_000, b"x" * 1_000_000, "text", 1.5, None)
_STATEMENTS = (
    "CREATE TABLE more (x)", "CREATE VIEW more AS SELECT randomblob(1000000000)", "DROP TABLE row",
    "CREATE TRIGGER more BEFORE INSERT ON row BEGIN DELETE FROM row; END", "PRAGMA user_version = 9",
    "CREATE INDEX more ON row (checksum)", "PRAGMA application_id = 9", "PRAGMA journal_mode = DELETE",
    "DELETE FROM row WHERE key % 2 = 0", "UPDATE row SET key = key + 1000", "UPDATE row SET key = -1 WHERE key = 1",
    "UPDATE job SET manifest = '[' || manifest", "UPDATE job SET manifest = NULL", "UPDATE job SET manifest = x'00'",
    "UPDATE job SET manifest = zeroblob(70000000)",
)  # fmt: skip


class QuickStudy(Study):
    """Runs whose results are numbers at random."""

    def rows(self, runs: Iterable[int]) -> list[RunRow]:
        return [self._quick(run) for run in runs]

    def _quick(self, run: int) -> RunRow:
        number, index = divmod(run, self.grid_size)
        point = self.grid_point(index)
        values = np.random.default_rng((self.seed, run)).standard_normal(7).tolist()
        row = RunRow(run, number, point.mass, point.level, point.stiffness_factor, *values[:4])
        if run % 7 == 3:
            return replace(row, outcome=f'=The load of {values[4]} N, "{{[\\", must lie within\n0 and 1 N; µ.')
        more = {"static_equilibrium": values[4], "frequency": values[5], "transmissibility": values[6]}
        return replace(row, **more, inside=run % 2 == 0)


class QuickWork(BatchWork):
    """Springs that are known before."""

    def rows(self, tasks: Sequence[SpringFile]) -> list[Finished]:
        return [self._quick(spring, int(spring.name[1:])) for spring in tasks]

    def _quick(self, spring: SpringFile, seed: int) -> Finished:
        row = SpringRow(spring.file, *digest(spring.path), self.settings, spring.name, REFUSED, '=It is ["{no}.')
        if seed % 3 == 2:
            return Finished(row, None)
        parameters = SpringParameters((0.0, 1e3 + seed), (1.0,), 5.0, 300.0, 1.0, 0.7, 0.0, -0.01, 0.01)
        text = ModelFile(spring.name, parameters).to_json()
        row = replace(row, status=IDENTIFIED, reason="", model_sha256=sha256(text.encode()).hexdigest())
        known = {"parameters": parameters.as_dict(), "uncertainty": {"rho": (0.1, None, 0.2)}, "notes": ("=a", "µ")}
        return Finished(replace(row, **known, rmse=0.1 * seed), text)


def _study(seed: int) -> Job:
    study = QuickStudy(**{each.name: getattr(CHEAP, each.name) for each in fields(CHEAP)} | {"seed": seed, "draws": 14})

    def job(folder: Path, progress: Callable[[int], None]) -> dict[str, bytes]:
        run_study(study, folder / "results.csv", Local(1), progress)
        return {path.name: path.read_bytes() for path in folder.iterdir()}

    return job


def _batch(seed: int) -> Job:
    def job(folder: Path, progress: Callable[[int], None]) -> dict[str, bytes]:
        source = folder.parent / "records"
        source.mkdir(exist_ok=True)
        files = [source / f"s{number}.csv" for number in range(seed, seed + 9)]
        for file in files:
            file.write_text(file.name)
        springs = [spring._replace(file=Path(spring.file).name) for spring in find_springs(files, folder)[0]]
        identify_batch(springs, folder, QuickWork(TwoStageOptions(), Wanted()), Local(1), progress=progress)
        return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != JOURNAL}

    return job


# The job, another one of the same kind, where the journal is, and how many rows it may hold.
_JOBS: tuple[tuple[Job, Job, Callable[[Path], Path], int], ...] = (
    (_study(7), _study(8), lambda folder: journal_path(folder / "results.csv"), 40),
    (_batch(0), _batch(20), lambda folder: folder / JOURNAL, 9),
)


def _interrupted(job: Job, after: int, folder: Path) -> None:
    def stop(finished: int) -> None:
        if finished >= after:
            raise StrandspringError("Enough.")

    folder.mkdir(parents=True)
    with suppress(StrandspringError):
        job(folder, stop)


@cache
def _undisturbed(kind: int) -> tuple[dict[str, bytes], bytes]:
    """The results of a job, and the journal of the other one."""
    job, other, journal, _ = _JOBS[kind]
    with TemporaryDirectory() as place:
        (Path(place) / "results").mkdir()
        results = job(Path(place) / "results", lambda _: None)
        _interrupted(other, 8, Path(place) / "other")
        return results, journal(Path(place) / "other").read_bytes()


def _execute(journal: Path, statement: str, *values: Any) -> list[tuple[Any, ...]]:
    with closing(sqlite3.connect(journal)) as database, database:
        return database.execute(statement, values).fetchall()


def _rows_changed(dice: random.Random, journal: Path, other: Path) -> None:
    """Change one thing in the rows or tables of a journal; raises sqlite3.Error if it was damaged before."""
    rows = _execute(journal, "SELECT key, checksum, content FROM row") or [(0, 0, b"[]")]
    (key, checksum, content), (to, *_) = dice.choice(rows), dice.choice(rows)
    ((manifest,),) = _execute(journal, "SELECT manifest FROM job LIMIT 1")
    match dice.randrange(6):
        case 0:
            row = (dice.choice((to, 60, -1, 2**62, None)), checksum, content)
        case 1:
            row = dice.choice(_execute(other, "SELECT key, checksum, content FROM row"))
        case 2:
            row = (key, checksum, dice.choice(_JUNK))
        case 3 if isinstance(content, bytes) and (numbers := [*re.finditer(rb"-?\d+(\.\d+)?(e[+-]?\d+)?", content)]):
            one = dice.choice(numbers)
            row = (key, checksum, content[: one.start()] + dice.choice(_ABSURD) + content[one.end() :])
        case 4 if isinstance(content, bytes) and isinstance(manifest, bytes):
            with suppress(ValueError, RecursionError):  # damaged before
                values = json.loads(content)
                if isinstance(values, list):
                    values[dice.randrange(len(values)) :] = dice.choice(([["x"]], [np.inf], [{"a": 1}, 1], values))
                content = json.dumps(values).encode()
            row = (key, zlib.crc32(content, zlib.crc32(manifest)), content)
        case _:
            _execute(journal, dice.choice(_STATEMENTS))
            return
    _execute(journal, "INSERT OR REPLACE INTO row VALUES (?, ?, ?)", *row)


def _continued(job: Job, folder: Path, journal: Path) -> tuple[dict[str, bytes] | None, str]:
    """Results of a job that is continued, None if it is refused, with the sentence."""
    before = journal.read_bytes() if journal.is_file() else b""
    try:
        return job(folder, lambda _: None), "accepted"
    except StrandspringError as refusal:
        after = journal.read_bytes() if journal.is_file() else b""
        if re.search("is not the journal|of another study|is damaged", str(refusal)):
            assert after == before, "the refused journal was changed"
        kind_of(refusal, folder)
        return None, str(refusal)


def trial(dice: random.Random, folder: Path) -> str:
    """Damage a journal and continue the job."""
    kind = dice.randrange(2)
    job, _, journal_of, most = _JOBS[kind]
    expected, other = _undisturbed(kind)
    (folder / "other").write_bytes(other)
    _interrupted(job, dice.randrange(1, most), folder / "results")
    journal = journal_of(folder / "results")
    for _ in range(dice.randrange(1, 4)):
        if dice.random() < 0.6:
            with suppress(sqlite3.Error):
                _rows_changed(dice, journal, folder / "other")
        else:
            data = journal.read_bytes()
            at = dice.randrange(len(data) + 1)
            cut = data[:at] + dice.randbytes(dice.choice((20, 2000))) + data[at:]
            journal.write_bytes(dice.choice((damaged(dice, data), damaged(dice, data), cut, data + data[:at])))
    results, sentence = _continued(job, folder / "results", journal)
    outcome = (
        "accepted"
        if results is not None
        else f"refused: {re.sub('[0-9]+', '0', sentence.replace(str(folder), ''))[:80]}"
    )
    for _ in range(100):  # the advice is followed
        if results is not None:
            break
        if "start the same command again" not in sentence:
            journal.unlink()
        results, sentence = _continued(job, folder / "results", journal)
    assert results == expected, f"other results, or never an end: {sentence}"
    return outcome
