"""Journals of interrupted studies, damaged at random; those of batches are kept by the same code.

Rows of a journal are changed, moved, mixed with those of another study or replaced, with their checksums or without;
tables are added; bytes of the file are changed. The study is then continued. It must end with the bytes of the
undisturbed one, or be refused; following the advice (the same command again, or removing the file) must lead to these
bytes. What is refused must not be changed.
"""

from __future__ import annotations

import json
import random
import re
import sqlite3
import zlib
from collections.abc import Iterable
from contextlib import closing, suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from strandspring import SpringParameters
from strandspring.campaigns.jobs.runners import Local
from strandspring.campaigns.studies.definition import RunRow, Study
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.journal import journal_path
from strandspring.errors import StrandspringError
from strandspring.vibration.one_mass.system import Excitation
from targets.mutator import damaged, kind_of

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


def _results(folder: Path, seed: int = 7, after: int = 10**9) -> dict[str, bytes]:
    """Run or continue a study, which may be interrupted after some runs; its results."""

    def progress(finished: int) -> None:
        if finished >= after:
            raise StrandspringError("Enough.")

    spring = SpringParameters((0.0, 4e3), (1.0,), 15.0, 300.0, 1.0, 0.7, 0.0, -0.02, 0.02)
    masses = tuple(4.0 + 0.1 * k for k in range(42))
    study = QuickStudy(spring, Excitation.BASE_DISPLACEMENT, masses, levels=(1e-4,), seed=seed)
    run_study(study, folder / "results.csv", Local(1), progress)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def _interrupted(folder: Path, seed: int, after: int) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    with suppress(StrandspringError):
        _results(folder, seed, after)
    return journal_path(folder / "results.csv")


@cache
def _undisturbed() -> tuple[dict[str, bytes], bytes]:
    """The results of the study, and the journal of another one."""
    with TemporaryDirectory() as place:
        other = _interrupted(Path(place) / "other", 8, 8).read_bytes()
        (Path(place) / "results").mkdir()
        return _results(Path(place) / "results"), other


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


def _continued(folder: Path, journal: Path) -> tuple[dict[str, bytes] | None, str]:
    """Results of the study that is continued, None if it is refused, with the sentence."""
    before = journal.read_bytes() if journal.is_file() else b""
    try:
        return _results(folder), "accepted"
    except StrandspringError as refusal:
        after = journal.read_bytes() if journal.is_file() else b""
        damage = re.search("is not the journal|of another study|is damaged", str(refusal))
        assert not damage or after == before, "the refused journal was changed"
        kind_of(refusal, folder)
        return None, str(refusal)


def trial(dice: random.Random, folder: Path) -> str:
    """Damage a journal and continue the study."""
    expected, other = _undisturbed()
    (folder / "other").write_bytes(other)
    journal = _interrupted(folder / "results", 7, dice.randrange(1, 40))
    for _ in range(dice.randrange(1, 4)):
        data = journal.read_bytes()
        at = dice.randrange(len(data) + 1)
        if dice.random() < 0.6:
            with suppress(sqlite3.Error):
                _rows_changed(dice, journal, folder / "other")
        else:
            made = (damaged(dice, data), data[:at] + dice.randbytes(2000) + data[at:], data + data[:at])
            journal.write_bytes(dice.choice(made))
    results, sentence = _continued(folder / "results", journal)
    outcome = re.sub("[0-9]+", "0", sentence.replace(str(folder), ""))[:80]
    for _ in range(100):  # the advice is followed
        if results is not None:
            break
        if "start the same command again" not in sentence:
            journal.unlink()
        results, sentence = _continued(folder / "results", journal)
    assert results == expected, f"other results, or never an end: {sentence}"
    return outcome if outcome == "accepted" else f"refused: {outcome}"
