"""Run a study, or what is left of it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import fields
from operator import attrgetter
from pathlib import Path

from ..errors import StrandspringError
from ..files import refuse_unwritable, write_csv
from ..isolation.system import IsolationError
from ..jobs.runners import Runner, finished_rows
from .definition import RunRow, Study
from .journal import Journal
from .quantiles import Summaries

_LARGEST_BATCH = 32  # runs; the parent needs some 25 us for a run, of batches of 8 twice as much

# Of the fields of a row, with the unit of the level to be filled in.
_HEADINGS = (
    "run", "draw", "mass [kg]", "level [{}]", "stiffness factor [1]", "kappa_omega [N]", "rho [1/m]", "sigma [1]",
    "n [1]", "rest [m]", "sag [m]", "resonance frequency [Hz]", "transmissibility [1]", "amplitude [m]",
    "stiffness [N/m]", "loss factor [1]", "isolation frequency [Hz]", "resonance inside the band",
    "beyond the identified range", "outcome",
)  # fmt: skip
_cells = attrgetter(*(field.name for field in fields(RunRow)))


def run_study(
    study: Study,
    results: Path,
    runner: Runner,
    progress: Callable[[int], None] = lambda _: None,
    notify: Callable[[str], None] = lambda _: None,
) -> Summaries:
    """Execute the runs that are not yet in the journal beside the results, write the results and remove the journal.

    Parameters
    ----------
    study : Study
    results : Path           CSV file.
    runner : Runner
    progress : callable      Called with the number of finished runs; first with that of earlier times.
    notify : callable        Called with a sentence while no run finishes.

    Returns
    -------
    Summaries

    Raises
    ------
    IsolationError           If the journal is that of another study, or the runs cannot be executed; finished ones are
                             kept.
    StrandspringError        If the journal cannot be removed; the results are written.
    """
    try:
        refuse_unwritable(results)
        journal = Journal(results, study)
    except StrandspringError as problem:
        raise IsolationError(str(problem)) from None
    is_complete = False
    try:
        if journal.dropped:
            notify(f"{journal.name}: {journal.dropped_sentence}; their runs are executed again.")
        progress(journal.finished)
        with closing(finished_rows(study, journal.missing(), _LARGEST_BATCH, runner, notify)) as batches:
            for rows in batches:
                journal.add(rows)
                progress(journal.finished)
        summaries = Summaries(study, journal)
        header = [heading.format(study.excitation.unit) for heading in _HEADINGS]
        write_csv(results, header, (_cells(journal[run]) for run in range(len(study))))
        is_complete = True
    except StrandspringError as problem:
        if not journal.finished:
            raise IsolationError(str(problem)) from None
        raise IsolationError(
            f"{str(problem).rstrip('.')}; {journal.finished} of {len(study)} runs are kept in {journal.name}, and the "
            "same command continues from there."
        ) from None
    finally:
        journal.close(is_complete)
    return summaries
