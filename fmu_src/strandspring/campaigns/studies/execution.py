"""Execute the runs of a study, or what is left of them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from ...errors import StrandspringError
from ...ground.files import refuse_unwritable, write_csv
from ..jobs.cluster import runner_of
from ..jobs.options import Workers
from ..jobs.runners import finished_rows
from .journal import EncodedRuns, Journal
from .runs import Runs


def run_study(
    study: Runs[Any],
    results: Path,
    placing: Workers,
    progress: Callable[[int], None] = lambda _: None,
) -> None:
    """Execute the runs that are not yet in the journal beside the results, write the results and remove the journal.

    Parameters
    ----------
    study : Runs
    results : Path        CSV file.
    placing : Workers
    progress : callable   Called with the number of finished runs; first with that of earlier times.

    Raises
    ------
    StrandspringError     As `study.refusal`, if the journal is that of another study, or the runs cannot be executed;
                          finished ones are kept. If the journal cannot be removed; the results are written.
    """
    try:
        refuse_unwritable(results)
        journal = Journal(results, study)
    except StrandspringError as problem:
        raise study.refusal("{problem}", problem=problem) from None
    is_complete = False
    try:
        if journal.dropped:
            placing.notify(f"{journal.name}: {journal.dropped_sentence}; their runs are executed again.")
        if journal.finished:
            placing.notify(f"{journal.finished} of {len(study)} runs were finished before.")
        progress(journal.finished)
        with closing(
            finished_rows(EncodedRuns(study), journal.missing(), runner_of(placing), placing.notify)
        ) as batches:
            for rows in batches:
                journal.add_encoded(rows)
                progress(journal.finished)
        cells = (study.cells(journal[run]) for run in range(len(study)))
        write_csv(results, [column.file_heading for column in study.columns], cells)
        is_complete = True
    except StrandspringError as problem:
        if not journal.finished:
            raise study.refusal("{problem}", problem=problem) from None
        raise study.refusal(
            "{problem} {finished} of {runs} runs are kept in {journal}, and the same command continues from there.",
            problem=problem, finished=journal.finished, runs=len(study), journal=journal.name,
        ) from None  # fmt: skip
    finally:
        journal.close(is_complete)
