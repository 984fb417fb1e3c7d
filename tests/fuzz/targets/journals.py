"""Journals of interrupted studies, damaged at random; those of batches are kept by the same code.

Rows of a journal, tables or bytes of the file are changed, and the study is then continued. It must end with the bytes
of the undisturbed one, or be refused; following the advice (the same command again, or removing the file) must lead to
these bytes. What is refused must not be changed.
"""

from __future__ import annotations

import random
import re
import sqlite3
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from journal_content import execute
from strandspring import SpringParameters
from strandspring.campaigns.jobs.options import Workers
from strandspring.campaigns.studies.definition import RunRow, Study
from strandspring.campaigns.studies.execution import run_study
from strandspring.campaigns.studies.journal import journal_path
from strandspring.errors import StrandspringError
from strandspring.vibration.one_mass.options import Excitation
from targets.mutator import ABSURD, damaged, kind_of

_SPRING = SpringParameters((0.0, 4e3), (1.0,), 15.0, 300.0, 1.0, 0.7, 0.0, -0.02, 0.02)


class QuickStudy(Study):
    """Runs whose results are numbers at random."""

    def rows(self, runs: Iterable[int]) -> list[RunRow]:
        made = []
        for run in runs:
            number, index = divmod(run, self.grid_size)
            point, random_numbers = self.grid_point(index), np.random.default_rng((self.seed, run))
            values = random_numbers.standard_normal(4).tolist()
            made.append(RunRow(run, number, point.mass, point.level, point.stiffness_factor, *values))
        return made


def _results(folder: Path, after: int = 10**9) -> dict[str, bytes]:
    """Run or continue a study, which may be interrupted after some runs; its results."""

    def progress(finished: int) -> None:
        if finished >= after:
            raise StrandspringError("Enough.")

    masses = tuple(4.0 + 0.1 * k for k in range(42))
    study = QuickStudy(_SPRING, Excitation.BASE_DISPLACEMENT, masses, levels=(1e-4,), seed=7)
    folder.mkdir(exist_ok=True)
    run_study(study, folder / "results.csv", Workers(), progress)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@cache
def _undisturbed() -> dict[str, bytes]:
    with TemporaryDirectory() as place:
        return _results(Path(place) / "results")


def trial(dice: random.Random, folder: Path) -> str:
    """Damage a journal and continue the study; the advice of refusals is followed."""
    results, journal, refusals = folder / "results", journal_path(folder / "results" / "results.csv"), list[str]()
    with suppress(StrandspringError):
        _results(results, dice.randrange(1, 40))
    for _ in range(dice.randrange(1, 4)):
        data, at = journal.read_bytes(), dice.random()
        with suppress(sqlite3.Error):  # damaged before
            if dice.random() < 0.4:
                execute(journal, dice.choice(ABSURD["statements"]))
            else:
                inserted = data[: int(at * len(data))] + dice.randbytes(2000) + data[int(at * len(data)) :]
                journal.write_bytes(dice.choice((damaged(dice, data), inserted)))
    while len(refusals) < 100:
        before = journal.read_bytes() if journal.is_file() else b""
        try:
            assert _results(results) == _undisturbed(), "other results"
            return f"refused: {refusals[0]}" if refusals else "accepted"
        except StrandspringError as refusal:
            is_damaged = re.search("is not the journal|of another study|is damaged", str(refusal))
            assert not is_damaged or journal.read_bytes() == before, "the refused journal was changed"
            refusals.append(kind_of(refusal, folder))
            if "start the same command again" not in str(refusal):
                journal.unlink()
    raise AssertionError(f"never an end: {refusals[-1]}")
