"""Journals of interrupted studies, damaged at random; those of batches are kept by the same code.

Rows of a journal are changed, with their checksums or without, and tables; bytes of the file are changed, or come from
the journal of another study. The study is then continued. It must end with the bytes of the undisturbed one, or be
refused; following the advice (the same command again, or removing the file) must lead to these bytes. What is refused
must not be changed.
"""

from __future__ import annotations

import json
import random
import re
import sqlite3
import zlib
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from journal_content import execute
from strandspring import SpringParameters
from strandspring.campaigns.jobs.runners import Local
from strandspring.campaigns.studies.definition import RunRow, Study
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.journal import journal_path
from strandspring.errors import StrandspringError
from strandspring.vibration.one_mass.system import Excitation
from targets.mutator import ABSURD, damaged, kind_of

_SPRING = SpringParameters((0.0, 4e3), (1.0,), 15.0, 300.0, 1.0, 0.7, 0.0, -0.02, 0.02)


class QuickStudy(Study):
    """Runs whose results are numbers at random."""

    def rows(self, runs: Iterable[int]) -> list[RunRow]:
        made = []
        for run in runs:
            number, index = divmod(run, self.grid_size)
            point = self.grid_point(index)
            values = np.random.default_rng((self.seed, run)).standard_normal(7).tolist()
            row = RunRow(run, number, point.mass, point.level, point.stiffness_factor, *values[:4])
            more = {"static_equilibrium": values[4], "frequency": values[5], "transmissibility": values[6]}
            why = f'=The load of {values[4]} N, "{{[\\", must lie within\n0 and 1 N; µ.'
            made.append(replace(row, outcome=why) if run % 7 == 3 else replace(row, **more, inside=run % 2 == 0))
        return made


def _results(folder: Path, seed: int = 7, after: int = 10**9) -> dict[str, bytes]:
    """Run or continue a study, which may be interrupted after some runs; its results."""

    def progress(finished: int) -> None:
        if finished >= after:
            raise StrandspringError("Enough.")

    masses = tuple(4.0 + 0.1 * k for k in range(42))
    study = QuickStudy(_SPRING, Excitation.BASE_DISPLACEMENT, masses, levels=(1e-4,), seed=seed)
    folder.mkdir(exist_ok=True)
    run_study(study, folder / "results.csv", Local(1), progress)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def _interrupted(folder: Path, seed: int, after: int) -> Path:
    with suppress(StrandspringError):
        _results(folder, seed, after)
    return journal_path(folder / "results.csv")


@cache
def _undisturbed() -> tuple[dict[str, bytes], bytes]:
    """The results of the study, and the journal of another one."""
    with TemporaryDirectory() as place:
        other = _interrupted(Path(place) / "other", 8, 8).read_bytes()
        return _results(Path(place) / "results"), other


def _craft(dice: random.Random, journal: Path) -> None:
    """Give a row absurd content under its right checksum."""
    ((manifest,),) = execute(journal, "SELECT manifest FROM job LIMIT 1")
    key, content = dice.choice(execute(journal, "SELECT key, content FROM row"))
    values = json.loads(content)
    values[dice.randrange(len(values)) :] = dice.choice((["x"], [np.inf], [{"a": 1}, 1], []))
    content = json.dumps(values).encode()
    checksum = zlib.crc32(content, zlib.crc32(manifest))
    execute(journal, "INSERT OR REPLACE INTO row VALUES (?, ?, ?)", key, checksum, content)


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
    journal = _interrupted(folder / "results", 7, dice.randrange(1, 40))
    for _ in range(dice.randrange(1, 4)):
        data = journal.read_bytes()
        at = dice.randrange(len(data) + 1)
        with suppress(sqlite3.Error, ValueError, TypeError, IndexError, RecursionError):  # damaged before
            match dice.randrange(4):
                case 0:
                    _craft(dice, journal)
                case 1:
                    execute(journal, dice.choice(ABSURD["statements"]))
                case 2:
                    journal.write_bytes(damaged(dice, data))
                case _:
                    journal.write_bytes(data[:at] + dice.choice((dice.randbytes(2000) + data[at:], other[at:])))
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
