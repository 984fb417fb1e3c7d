"""Run a study, or what is left of it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from ..errors import StrandspringError
from ..isolation.system import IsolationError
from .definition import RunRow, Study
from .journal import Journal
from .results import write_results
from .runners import Runner

# A batch of these takes about a second; what is under way when a study is interrupted is lost.
_BATCH = 8
# Fewer make workers wait for each other at the end, more take longer to hand out than to run.
_FEWEST_BATCHES, _MOST_BATCHES = 64, 20_000


def run_study(
    study: Study, results: Path, runner: Runner, done: Callable[[int], None] = lambda _: None
) -> list[RunRow]:
    """Run what is not in the journal beside the results yet, write the results and remove the journal.

    Parameters
    ----------
    study : Study
    results : Path     CSV file.
    runner : Runner
    done : callable    Told how many runs are finished by now; first those of earlier times.

    Returns
    -------
    list of RunRow     In the order of their numbers.

    Raises
    ------
    IsolationError     If the journal is that of another study, or the runs cannot be done; what is finished is kept.
    """
    if results.is_dir():
        raise IsolationError(f"{results} is a directory; give the path of a CSV file.")
    journal = Journal(results, study)
    finished = False
    try:
        done(len(journal.rows))
        left = [run for run in range(len(study)) if run not in journal.rows]
        size = max(1, min(_BATCH, len(left) // _FEWEST_BATCHES), len(left) // _MOST_BATCHES)
        batches = [left[first : first + size] for first in range(0, len(left), size)]
        if left:
            with closing(runner.rows(study, batches)) as finished_batches:
                for rows in finished_batches:
                    journal.add(rows)
                    done(len(journal.rows))
        ordered = [journal.rows[run] for run in range(len(study))]
        write_results(results, ordered, study.excitation)
        finished = True
    except StrandspringError as problem:
        if not journal.rows:
            raise
        raise IsolationError(
            f"{str(problem).rstrip('.')}; {len(journal.rows)} of {len(study)} runs are kept in {journal.path}, and the "
            "same command goes on from there."
        ) from None
    finally:
        journal.close(finished)
    return ordered
