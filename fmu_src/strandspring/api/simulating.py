"""`simulate`: a SYSTEM.toml in, a verdict on every candidate in every load case out."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..files import write_csv
from ..systems.answers import CandidateAnswer, CaseAnswer, answer_all, answer_candidate, answer_case
from ..systems.chosen import chosen_candidates, chosen_cases
from ..systems.mounted import MountedSystemError
from ..systems.rest import SHARES
from ..systems.system_file import SystemFile, load_system_file
from ..systems.verdicts import Figure, Verdict
from .progress import Progress, unseen
from .result import Result
from .simulation_json import candidate_json, case_json
from .simulation_words import detail_lines, headline, verdict_table
from .text_table import table_lines

if TYPE_CHECKING:
    import pandas as pd

_COLUMNS = (
    "candidate", "case", "verdict", "quantity", "subject", "unit", "value", "error", "least", "rest_omega", "limit",
    "margin",
)  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Result):
    """Candidates under load cases.

    Attributes
    ----------
    file : SystemFile
    candidates : tuple of CandidateAnswer   Static pose and modes of each.
    answers : tuple of CaseAnswer           Of each candidate in each case, in their order.
    """

    file: SystemFile
    candidates: tuple[CandidateAnswer, ...]
    answers: tuple[CaseAnswer, ...]

    def to_frame(self) -> pd.DataFrame:
        """One row for each figure of each case, in SI units; a refused case has one row without a figure."""
        import pandas as pd

        return pd.DataFrame([_row(*pair) for pair in self._figures()], columns=list(_COLUMNS))

    def verdicts(self) -> pd.DataFrame:
        """Candidates down, cases across, and the verdict of each."""
        import pandas as pd

        cases = list(dict.fromkeys(answer.case.name for answer in self.answers))
        table = {one.name: dict.fromkeys(cases, "") for one in self.candidates}
        for answer in self.answers:
            table[answer.candidate][answer.case.name] = answer.verdict.value
        return pd.DataFrame.from_dict(table, orient="index", columns=cases)

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the rows of `to_frame`.

        Raises
        ------
        StrandspringError   If the file cannot be written.
        """
        write_csv(Path(path), _COLUMNS, (_row(*pair) for pair in self._figures()))

    def as_json(self) -> dict[str, Any]:
        """Everything as an object for JSON, in SI units."""
        limits = self.file.limits
        return {
            "system": self.file.name,
            "limits": {
                "acceleration": dict(limits.acceleration),
                "sway": dict(limits.sway),
                "tilt": limits.tilt,
                "stroke": limits.stroke,
            },
            "candidates": [candidate_json(one) for one in self.candidates],
            "cases": [case_json(answer) for answer in self.answers],
        }

    def _figures(self) -> list[tuple[CaseAnswer, Figure | None]]:
        return [(answer, figure) for answer in self.answers for figure in (answer.figures or (None,))]

    def lines(self, width: int | None = None) -> list[str]:
        """Verdicts, static poses, modes, figures and cautions in words, in tables of at most a width."""
        headings, rows, left = verdict_table(self.answers)
        return [
            headline(self.file.name, self.answers),
            *table_lines(headings, rows, left, width),
            *detail_lines(self.candidates, self.answers, width),
        ]

    def summary(self) -> str:
        """Verdicts, static poses, modes, figures and cautions in words."""
        return "\n".join(self.lines())

    def _repr_html_(self) -> str:
        from html import escape

        heading = escape(headline(self.file.name, self.answers))
        return f"<p><strong>{heading}</strong></p>{self.verdicts().to_html(escape=True)}"


def simulate(
    system: str | os.PathLike[str] | SystemFile,
    cases: str | Sequence[str] | None = None,
    candidates: str | Sequence[str] | None = None,
    *,
    step: float | None = None,
    workers: int | None = None,
    courses: bool = True,
    progress: Progress = unseen,
) -> Simulation:
    """Simulate bodies on hysteretic mounts under the load cases of a SYSTEM.toml.

    Parameters
    ----------
    system : path or SystemFile
    cases, candidates : str, sequence of str or None   Names of those to simulate; all if None. The name of a case with
                                                       several directions stands for all of them.
    step : float or None       Time step of the coarser of two runs [s]; by default as the file says, or found so that
                               the errors are within 0.1 %.
    workers : int or None      Threads; as many as cores if None.
    courses : bool             Whether histories and spectra are kept.
    progress : callable        Is called with what is being done, the number of cases done, and how many there are.

    Returns
    -------
    Simulation

    Raises
    ------
    MountedSystemError         If the file is wrong, a name is unknown, or no candidate can be simulated in any case.
    """
    file = system if isinstance(system, SystemFile) else load_system_file(system)
    chosen = chosen_candidates(file, candidates)
    loads = chosen_cases(file, cases)
    omega = file.options.rest_omega
    shares = SHARES if omega is None else (omega,)
    statics = tuple(answer_candidate(name, one, file.models, shares) for name, one in chosen)
    tasks = [
        partial(answer_case, name, one, case, file.limits, shares, step or file.options.step, with_courses=courses)
        for name, one in chosen
        for case in loads
    ]
    answers = []
    for answer in answer_all(tasks, workers):
        answers.append(answer)
        progress(f"{answer.candidate}, {answer.case.name}", len(answers), len(tasks))
    if answers and all(answer.verdict is Verdict.REFUSED for answer in answers):
        raise MountedSystemError(answers[0].refusal)
    refusals = [one.refusal for one in statics if one.refusal]
    if len(refusals) == len(statics):
        raise MountedSystemError(refusals[0])
    return Simulation(file, statics, tuple(answers))


def _row(answer: CaseAnswer, figure: Figure | None) -> tuple[object, ...]:
    head = (answer.candidate, answer.case.name, answer.verdict.value)
    if figure is None:
        return (*head, None, None, None, None, None, None, None, None, None)
    return (
        *head, figure.quantity.value, figure.subject, figure.quantity.unit, figure.value, figure.error, figure.least,
        figure.share, figure.limit, figure.margin,
    )  # fmt: skip
