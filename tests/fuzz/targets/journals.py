"""Journals of interrupted studies and batches, damaged at random.

Rows and manifest of a journal are changed, repeated, moved, mixed with those of another job, or replaced, with their
checksums or without; tables are added; bytes of the file are flipped, cut off and added. The job is then continued. It
must end with the bytes of the undisturbed one, or be refused in words; following the advice (the same command again, or
removing the file) must lead to these bytes. What is refused must not be changed.
"""

from __future__ import annotations

import json
import random
import re
import shutil
import sqlite3
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from hashlib import sha256
from pathlib import Path

import numpy as np

from journal_content import execute
from many_springs import one_of
from strandspring import TwoStageOptions
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
from targets.made import damaged, damaged_text, numpy_of

Job = Callable[[Path, Callable[[int], None]], dict[str, bytes]]
_ABSURD = (
    b"1e400", b"-0", b"1e-400", b"9223372036854775808", b"99999999999999999999999999", b"NaN", b"null", b"true",
    b'"=1+1"',     b"[]", b"{}", b"0x10", b"1_0", b"", b"-1", b"0.1",
)  # fmt: skip
_NUMBER = re.compile(rb"-?\d+(\.\d+)?(e[+-]?\d+)?")


class QuickStudy(Study):
    """Runs whose results are numbers at random."""

    def rows(self, runs: Iterable[int]) -> list[RunRow]:
        return [self._quick(run) for run in runs]

    def _quick(self, run: int) -> RunRow:
        number, index = divmod(run, self.grid_size)
        point = self.grid_point(index)
        values = np.random.default_rng((self.seed, run)).standard_normal(12).tolist()
        row = RunRow(run, number, point.mass, point.level, point.stiffness_factor, *values[:4])
        if run % 7 == 3:
            return replace(row, outcome=f'=The load of {values[4]} N, "{{[\\", must lie within\n0 and 1 N; µ.')
        return replace(
            row, static_equilibrium=values[4], frequency=values[5], transmissibility=values[6], inside=run % 2 == 0
        )


class QuickWork(BatchWork):
    """Springs that are known before."""

    def rows(self, tasks: Sequence[SpringFile]) -> list[Finished]:
        return [self._quick(spring, int(re.sub(r"\D", "", spring.name))) for spring in tasks]

    def _quick(self, spring: SpringFile, seed: int) -> Finished:
        row = SpringRow(spring.file, *digest(spring.path), self.settings, spring.name, REFUSED, '=It is ["{no}.')
        if seed % 3 == 2:
            return Finished(row, None)
        text = ModelFile(spring.name, one_of(seed)).to_json()
        known = {"rho": (0.1, None, 0.2)}
        row = replace(row, status=IDENTIFIED, reason="", model_sha256=sha256(text.encode()).hexdigest())
        parameters = one_of(seed).as_dict()
        return Finished(
            replace(row, parameters=parameters, uncertainty=known, rmse=0.1 * seed, notes=("=a", "µ")), text
        )


def _study(seed: int, draws: int) -> Job:
    named = {name: getattr(CHEAP, name) for name in CHEAP.__dataclass_fields__}
    study = QuickStudy(**{**named, "seed": seed, "draws": draws})

    def job(folder: Path, progress: Callable[[int], None]) -> dict[str, bytes]:
        run_study(study, folder / "results.csv", Local(1), progress)
        return {path.name: path.read_bytes() for path in folder.iterdir()}

    return job


def _batch(seed: int) -> Job:
    def job(folder: Path, progress: Callable[[int], None]) -> dict[str, bytes]:
        source = folder.parent / "records"
        source.mkdir(exist_ok=True)
        for number in range(seed, seed + 9):
            (source / f"s{number}.csv").write_text(f"{number}")
        given, _ = find_springs([source / f"s{number}.csv" for number in range(seed, seed + 9)], folder)
        springs = [spring._replace(file=Path(spring.file).name) for spring in given]
        identify_batch(springs, folder, QuickWork(TwoStageOptions(), Wanted()), Local(1), progress=progress)
        return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != JOURNAL}

    return job


# Of each group the job, another one of the same kind, and where the journal is.
_JOBS: dict[str, tuple[Job, Job, Callable[[Path], Path]]] = {
    "study": (_study(7, 14), _study(8, 14), lambda folder: journal_path(folder / "results.csv")),
    "batch": (_batch(0), _batch(20), lambda folder: folder / JOURNAL),
}


def _unseen(finished: int) -> None:
    """Progress that nobody looks at."""


class _EnoughError(StrandspringError):
    pass


def _interrupted(job: Job, after: int, folder: Path, journal: Callable[[Path], Path]) -> bytes:
    """The journal of a job that was interrupted."""

    def stop(finished: int) -> None:
        if finished >= after:
            raise _EnoughError("Enough.")

    folder.mkdir(parents=True, exist_ok=True)
    with suppress(StrandspringError):
        job(folder, stop)
    return journal(folder).read_bytes()


@cache
def _undisturbed(group: str, place: str) -> tuple[dict[str, bytes], bytes]:
    """The results of a job, and the whole journal of the other one."""
    job, other, journal = _JOBS[group]
    folder = Path(place) / "undisturbed"
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "results").mkdir(parents=True)
    results = job(folder / "results", _unseen)
    return results, _interrupted(other, 8, folder / "other", journal)


def _with_absurd_number(line: object, generator: np.random.Generator) -> object:
    """A row with another number; what is no row, since it was damaged before, stays as it is."""
    numbers = list(_NUMBER.finditer(line)) if isinstance(line, bytes) else []
    if not numbers:
        return line
    one = numbers[generator.integers(len(numbers))]
    return line[: one.start()] + _ABSURD[generator.integers(len(_ABSURD))] + line[one.end() :]


def _forged(content: bytes, generator: np.random.Generator) -> bytes:
    """A row with another content; raises ValueError for what is none."""
    values = json.loads(content)
    wrong = (["x"], {"a": 1}, float("inf"), float("nan"), [[]])
    if generator.random() < 0.3:
        values.append(1)
    else:
        values[generator.integers(len(values))] = wrong[generator.integers(len(wrong))]
    return json.dumps(values).encode()


def _rows_changed(journal: Path, other: Path, generator: np.random.Generator) -> None:
    """Change one thing in the rows or tables of a journal; raises sqlite3.Error if it was damaged before."""

    def replace_row(key: object, checksum: object, content: object) -> None:
        execute(journal, "INSERT OR REPLACE INTO row VALUES (?, ?, ?)", key, checksum, content)

    rows = execute(journal, "SELECT key, checksum, content FROM row") or [(0, 0, b"[]")]
    others = execute(other, "SELECT key, checksum, content FROM row")
    (key, checksum, content), (to, *_) = (rows[k] for k in generator.integers(len(rows), size=2))
    match generator.integers(10):
        case 0:
            execute(journal, "DELETE FROM row WHERE key = ?", key)
        case 1:
            replace_row(to, checksum, content)
        case 2:
            replace_row([60, -1, 2**62, None][generator.integers(4)], checksum, content)
        case 3:
            replace_row(*others[generator.integers(len(others))])
        case 4:
            replace_row(key, checksum, _with_absurd_number(content, generator))
        case 5:
            (manifest,) = execute(journal, "SELECT manifest FROM job LIMIT 1")[0]
            with suppress(ValueError, TypeError, RecursionError):  # damaged before
                forged = _forged(content, generator)
                replace_row(key, zlib.crc32(forged, zlib.crc32(manifest)), forged)
        case 6:
            junk = (b"", b"\0" * 4096, b"[" * 50_000, b'{"a":' * 20_000, b"x" * 1_000_000, "text", 1.5, None)
            replace_row(key, checksum, junk[generator.integers(len(junk))])
        case 7:
            execute(journal, "DELETE FROM row WHERE key > ?", key)
        case 8:
            name = ["manifest", "'[' || manifest", "NULL", "1", "x'00'", "zeroblob(70000000)"][generator.integers(6)]
            execute(journal, f"UPDATE job SET manifest = {name}")  # noqa: S608 (of the list above)
        case 9:
            statements = (
                "CREATE TABLE more (x)", "CREATE VIEW more AS SELECT randomblob(1000000000)", "DROP TABLE row",
                "CREATE TRIGGER more BEFORE INSERT ON row BEGIN DELETE FROM row; END", "PRAGMA user_version = 9",
                "CREATE INDEX more ON row (checksum)", "PRAGMA application_id = 9", "PRAGMA journal_mode = DELETE",
            )  # fmt: skip
            execute(journal, statements[generator.integers(len(statements))])


def _bytes_changed(dice: random.Random, content: bytes) -> bytes:
    """A journal with one thing changed, whatever its rows."""
    at = dice.randrange(1 + len(content))
    match dice.randrange(6):
        case 0:
            return content[:at] + dice.randbytes(dice.choice((20, 2000))) + content[at + dice.choice((0, 20)) :]
        case 1:
            return content[:at] + b"\0" * dice.randrange(5000) + content[at:]
        case 2:
            return damaged_text(dice, content.decode("latin-1")) if dice.random() < 0.3 else content + content[:at]
        case _:
            return damaged(dice, content)


def _continued(job: Job, folder: Path, journal: Path) -> tuple[dict[str, bytes] | None, str]:
    """Results of a job that is continued, None if it is refused, with the sentence."""
    before = journal.read_bytes() if journal.is_file() else None
    try:
        return job(folder, _unseen), "accepted"
    except StrandspringError as refusal:
        after = journal.read_bytes() if journal.is_file() else None
        if before is not None and not (after or b"").startswith(before.rstrip(b"\0")[:1]):
            raise AssertionError("the refused journal was changed") from refusal
        sentence = str(refusal)
        if re.search("is not the journal|of another study|is damaged", sentence):
            assert after == before, "the refused journal was changed"
        assert "; " in sentence, f"no advice: {sentence}"
        assert len(sentence) < 1500, f"long: {sentence}"
        return None, sentence


def trial(dice: random.Random, folder: Path) -> Iterator[str]:
    """Damage a journal and continue the job."""
    generator = numpy_of(dice)
    group = str(generator.choice(list(_JOBS)))
    job, _, journal_of = _JOBS[group]
    expected, other = _undisturbed(group, str(folder.parent))
    (folder / "results").mkdir()
    journal = journal_of(folder / "results")
    _interrupted(job, int(generator.integers(1, 40 if group == "study" else 9)), folder / "results", journal_of)
    yield group
    (folder / "other").write_bytes(other)
    for _ in range(generator.integers(1, 4)):
        if generator.random() < 0.6:
            with suppress(sqlite3.Error):
                _rows_changed(journal, folder / "other", generator)
        else:
            journal.write_bytes(_bytes_changed(dice, journal.read_bytes()))
    results, sentence = _continued(job, folder / "results", journal)
    outcome = "accepted"
    if results is None:
        kind = re.sub(r"\(.*?\)|\d+", "#", sentence.replace(str(folder), ""))
        outcome = f"refused: {kind[:150]}"
    # The advice is followed.
    for _ in range(100):
        if results is not None:
            break
        if "start the same command again" not in sentence:
            journal.unlink()
        results, sentence = _continued(job, folder / "results", journal)
    assert results == expected, f"other results, or never an end: {sentence}"
    yield outcome
