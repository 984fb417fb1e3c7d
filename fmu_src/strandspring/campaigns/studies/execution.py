"""Execute the runs of a study, or what is left of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Protocol, TypeVar

from ...errors import StrandspringError
from ...ground.files import refuse_unwritable, write_csv
from ..jobs.runners import Runner, finished_rows
from .journal import Journal, Row

Summary = TypeVar("Summary")


class Runs(Protocol[Row]):
    """A study: runs by their numbers."""

    def __len__(self) -> int: ...

    def rows(self, runs: Sequence[int]) -> list[Row]:
        """Execute runs."""
        ...


def run_all(
    study: Runs[Row],
    row_type: type[Row],
    manifest: dict[str, Any],
    results: Path,
    header: Sequence[str],
    cells: Callable[[Row], Iterable[object]],
    sum_up: Callable[[Journal[Row]], Summary],
    runner: Runner,
    refusal: type[StrandspringError],
    largest_batch: int,
    progress: Callable[[int], None] = lambda _: None,
    notify: Callable[[str], None] = lambda _: None,
) -> Summary:
    """Execute the runs that are not yet in the journal beside the results, write the results and remove the journal.

    Parameters
    ----------
    study : Runs
    row_type, manifest       See `Journal`.
    results : Path           CSV file.
    header : sequence of str
    cells : callable         The cells of a row under the header.
    sum_up : callable        Makes the summary of all rows.
    runner : Runner
    refusal : type           Of the error that is raised.
    largest_batch : int      Runs, of about a second together.
    progress : callable      Called with the number of finished runs; first with that of earlier times.
    notify : callable        Called with a sentence while no run finishes.

    Raises
    ------
    StrandspringError        As `refusal`, if the journal is that of another study, or the runs cannot be executed;
                             finished ones are kept. If the journal cannot be removed; the results are written.
    """
    try:
        refuse_unwritable(results)
        journal = Journal(results, row_type, len(study), manifest)
    except StrandspringError as problem:
        raise refusal(str(problem)) from None
    is_complete = False
    try:
        if journal.dropped:
            notify(f"{journal.name}: {journal.dropped_sentence}; their runs are executed again.")
        progress(journal.finished)
        with closing(finished_rows(study, journal.missing(), largest_batch, runner, notify)) as batches:
            for rows in batches:
                journal.add(rows)
                progress(journal.finished)
        summary = sum_up(journal)
        write_csv(results, header, (cells(journal[run]) for run in range(len(study))))
        is_complete = True
    except StrandspringError as problem:
        if not journal.finished:
            raise refusal(str(problem)) from None
        raise refusal(
            f"{str(problem).rstrip('.')}; {journal.finished} of {len(study)} runs are kept in {journal.name}, and the "
            "same command continues from there."
        ) from None
    finally:
        journal.close(is_complete)
    return summary
