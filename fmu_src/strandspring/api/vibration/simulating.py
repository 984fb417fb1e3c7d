"""`simulate`: a SYSTEM.toml in, a verdict on every candidate in every load case out."""

from __future__ import annotations

import math
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, count
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from ...campaigns.jobs.threads import in_threads
from ...errors import MountedSystemError
from ...findings import Finding
from ...ground.arguments import flag, optional_number, optional_whole, workers_of
from ...ground.files import refuse_unwritable, write_csv
from ...vibration.description.system_file import SystemFile, load_system_file
from ...vibration.verdicts.answers import (
    CandidateAnswer,
    CaseAnswer,
    answer_candidate,
    answer_case,
    findings_of,
    overall_verdicts,
    untested,
)
from ...vibration.verdicts.drawn_springs import Drawn
from ...vibration.verdicts.draws import LEAST_DRAWS, Unknowns
from ...vibration.verdicts.verdicts import CaseVerdict, Figure, FigureKind
from ..common.progress import Progress, unseen
from ..common.result import PlottedResult
from ..common.table import table_lines
from ..common.text import counted
from .simulation_details import detail_lines
from .simulation_json import candidate_json, case_json, figure_json

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

_MOST_NUMBERS = 50_000_000  # of the histories of all answers
_COLUMNS = (
    "candidate", "case", "verdict", "quantity", "subject", "unit", "value", "error", "low", "high", "limit", "margin",
    "beyond",
)  # fmt: skip
_LONGEST = 100  # of the name of a file
_NOTHING = 1e-9  # of rounding, in the unit for people
_NEAR = 0.01  # of a limit, within which its share is printed in full
_IN_TABLE = {FigureKind.ACCELERATION: "accel. g", FigureKind.SWAY: "sway mm", FigureKind.STROKE: "stroke %"}


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(PlottedResult):
    """Candidates under load cases.

    Attributes
    ----------
    file : SystemFile
    candidates : tuple of CandidateAnswer   Static pose and modes of each.
    answers : tuple of CaseAnswer           Of each candidate in each case, in their order.
    """

    _size = (9.0, 6.0)

    file: SystemFile
    candidates: tuple[CandidateAnswer, ...]
    answers: tuple[CaseAnswer, ...]

    def to_frame(self) -> pd.DataFrame:
        """One row for each figure of each case, in SI units; a refused case has one row without a figure, and a limit
        that no case tests one for each candidate without a case.
        """
        import pandas as pd

        return pd.DataFrame(self._rows(), columns=list(_COLUMNS))

    def verdicts(self) -> pd.DataFrame:
        """Candidates down, cases across, and the verdict of each; "all cases" is that on all of them together."""
        import pandas as pd

        cases = list(dict.fromkeys(answer.case.name for answer in self.answers))
        table = {name: {"all cases": verdict.value} for name, verdict in overall_verdicts(self.answers).items()}
        for answer in self.answers:
            table[answer.candidate][answer.case.name] = answer.verdict.value
        return pd.DataFrame.from_dict(table, orient="index", columns=[*cases, "all cases"])

    def save_csv(self, path: str | os.PathLike[str]) -> None:
        """Write the rows of `to_frame`.

        Raises
        ------
        StrandspringError   If the file cannot be written.
        """
        write_csv(Path(path), _COLUMNS, (row.values() for row in self._rows()))

    def report(self, path: str | os.PathLike[str]) -> None:
        """Write a report: a page that opens offline (.html), or a document (.pdf).

        Raises
        ------
        StrandspringError   If the ending is another, a package for PDF is missing, or the file cannot be written.
        """
        from ...report.simulation_page import write_simulation

        file = self.file
        source = PurePath(file.path).name
        write_simulation(os.fspath(path), file.name, file.description, source, self.candidates, self.answers)

    def save_histories(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write the histories of each answer into a CSV file of its own, with units in the header.

        Returns
        -------
        list of Path         The files, "candidate_case.csv".

        Raises
        ------
        StrandspringError    If there are none, or a file cannot be written.
        """
        kept = [answer for answer in self.answers if answer.courses is not None]
        if not kept:
            raise MountedSystemError("No histories were kept; simulate with `courses`, and fewer cases or candidates.")
        target = Path(folder)
        refuse_unwritable(target, is_folder=True)
        target.mkdir(parents=True, exist_ok=True)
        names = unique_names([f"{answer.candidate}_{answer.case.name}" for answer in kept])
        written = []
        for name, answer in zip(names, kept, strict=True):
            path = target / f"{name}.csv"
            header, rows = history_table(answer)
            write_csv(path, header, rows)
            written.append(path)
        return written

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw acceleration against stroke of all answers, with verdicts, into axes of matplotlib, new ones if None."""
        from ...report.charts.verdict_charts import acceleration_against_stroke
        from ...report.rendering.drawing import draw

        (axis,) = self._axes(ax)
        return draw(acceleration_against_stroke(self.answers), axis, scale=1.4)

    def as_json(self) -> dict[str, Any]:
        """Everything as an object for JSON, in SI units."""
        limits, overall = self.file.limits, overall_verdicts(self.answers)
        tested = limits.tested([answer.case for answer in self.answers if answer.candidate == self.candidates[0].name])
        return {
            "system": self.file.name,
            "limits": {
                **{kind.name.lower(): limit for kind, limit in limits.of_all.items()},
                **{kind.name.lower(): dict(of_subjects) for kind, of_subjects in limits.of_kind.items()},
            },
            "tested": {kind.name.lower(): names for kind, names in tested.items()},
            "candidates": [candidate_json(candidate, overall[candidate.name]) for candidate in self.candidates],
            "cases": [case_json(answer) for answer in self.answers],
        }

    def _rows(self) -> list[dict[str, Any]]:
        rows = []
        for answer in self.answers:
            head = {"candidate": answer.candidate, "case": answer.case.name, "verdict": answer.verdict.value}
            figures = [figure_json(figure) for figure in answer.figures] or [{}]
            rows += [dict.fromkeys(_COLUMNS) | head | figure for figure in figures]
        for kind in untested(self.answers):
            left: dict[str, Any] = {"verdict": CaseVerdict.NOT_TESTED.value, "quantity": kind.value, "unit": kind.unit}
            left["limit"] = self.file.limits.of_all.get(kind)
            rows += [dict.fromkeys(_COLUMNS) | {"candidate": one.name} | left for one in self.candidates]
        return rows

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Limits that are not tested, and what is to be known of candidates, and of each in each case."""
        not_tested = (kind.untested for kind in untested(self.answers))
        return (*not_tested, *findings_of(self.candidates, self.answers))

    def brief(self, width: int | None = None) -> list[str]:
        """Verdicts, the range of the worst figures, and refusals."""
        return [
            headline(self.file.name, self.answers),
            *verdict_lines(self.answers, width, brief=True),
            *refusal_lines(self.candidates, self.answers),
        ]

    def text_lines(self, width: int | None = None) -> list[str]:
        """The same with static poses, modes, the error of each figure and energy balances."""
        return [
            headline(self.file.name, self.answers),
            *verdict_lines(self.answers, width),
            *refusal_lines(self.candidates, self.answers),
            *detail_lines(self.candidates, self.answers, width),
        ]

    def _overview(self) -> pd.DataFrame:
        return self.verdicts()


def refuse_wrong_run(draws: int | None, seed: int | None, step: float | None) -> None:
    """Refuse draws, a seed or a time step [s] that are none; raises MountedSystemError or TypeError."""
    for name, given, least in (("draws", draws, LEAST_DRAWS), ("seed", seed, 0)):
        if (number := optional_whole(name, given)) is not None and number < least:
            raise MountedSystemError(f"`{name}` must be >= {least}, got {given!r}.")
    seconds = optional_number("step", step, "s")
    if seconds is not None and not (math.isfinite(seconds) and seconds > 0.0):
        raise MountedSystemError(f"`step` must be finite and > 0 [s], got {step!r}.")


def simulate(
    system: str | os.PathLike[str] | SystemFile,
    cases: str | Sequence[str] | None = None,
    candidates: str | Sequence[str] | None = None,
    *,
    draws: int | None = None,
    seed: int | None = None,
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
    draws, seed : int or None  Of everything unknown, for the ranges of the figures: omega at rest, springs by the
                               uncertainty of their model files, scatter of mounts, realisations of random vibration
                               (a quarter of the draws). At least 16; by default as the file says, or 64.
    step : float or None       Time step of the coarser of two runs [s]; by default as the file says, or found so that
                               the errors are within 0.1 %, and in the draws within 0.3 %; of random
                               vibration 0.5 and 2 %.
    workers : int or None      Threads; as many as cores if None.
    courses : bool             Whether histories and spectra are kept, of the first cases as far as memory allows
                               (400 MB); the others have None.
    progress : callable        Is called with what is being done, the number of runs done, and how many there are.

    Returns
    -------
    Simulation

    Raises
    ------
    MountedSystemError         If the file is wrong, a name is unknown, or no candidate can be simulated in any case.
    """
    refuse_wrong_run(draws, seed, step)
    workers, courses = workers_of(workers), flag("courses", courses)
    file = system if isinstance(system, SystemFile) else load_system_file(system)
    chosen = file.chosen_candidates(candidates)
    loads = file.chosen_cases(cases)
    drawn = file.options.draws if draws is None else draws
    chosen_seed = file.options.seed if seed is None else seed
    unknowns = {
        name: Unknowns(Drawn.from_models(mounted, file.models), drawn, chosen_seed, file.options.rest_omega)
        for name, mounted in chosen
    }
    statics = tuple(answer_candidate(name, mounted, file.models, unknowns[name]) for name, mounted in chosen)
    tasks = [
        partial(
            answer_case, name, mounted, case, file.limits, unknowns[name], step or file.options.step,
            with_courses=courses,
        )
        for name, mounted in chosen
        for case in loads
    ]  # fmt: skip
    answers: list[CaseAnswer] = []
    room = _MOST_NUMBERS
    for answer in in_threads(tasks, workers):
        if answer.courses is not None:
            room -= answer.courses.size
        answers.append(answer if room >= 0 else replace(answer, courses=None))
        progress(answer.where, len(answers), len(tasks))
    if all(answer.verdict is CaseVerdict.REFUSED for answer in answers):
        raise MountedSystemError(answers[0].refusal)
    refusals = [candidate.refusal for candidate in statics if candidate.refusal]
    if len(refusals) == len(statics):
        raise MountedSystemError(refusals[0])
    return Simulation(file, statics, tuple(answers))


def history_table(answer: CaseAnswer) -> tuple[list[str], Iterable[Iterable[object]]]:
    """Headings and rows: time, base, points and axes of mounts, in SI units.

    Raises
    ------
    MountedSystemError   If the histories were not kept.
    """
    courses = answer.courses
    if courses is None:
        raise MountedSystemError(f"The histories of {answer.candidate} in {answer.case.name} were not kept.")
    histories = courses.histories
    header = ["time [s]", *(f"base acceleration {letter} [m/s^2]" for letter in "xyz")]
    columns = [histories.time[:, None], courses.base]
    for k, point in enumerate(answer.system.points):
        header += [f"{point.name} acceleration {letter} [m/s^2]" for letter in "xyz"]
        header += [f"{point.name} displacement {letter} [m]" for letter in "xyz"]
        columns += [histories.acceleration[:, k], histories.sway[:, k]]
    for k, name in enumerate(answer.system.axis_names):
        header += [f"{name} displacement of a spring [m]", f"{name} force [N]"]
        columns += [histories.displacement[:, k : k + 1], histories.force[:, k : k + 1]]
    return header, np.hstack(columns).tolist()


def unique_names(texts: Sequence[str]) -> list[str]:
    """Names of files made of texts: letters, digits, signs and underscores, each once.

    Examples
    --------
    >>> unique_names(["softer_shock +x", "softer_shock -x", "a/b", "a b"])
    ['softer_shock_+x', 'softer_shock_-x', 'a_b', 'a_b_2']
    """
    names: list[str] = []
    taken: set[str] = set()
    for text in texts:
        name = re.sub(r"[^\w+-]+", "_", text)[:_LONGEST]
        chosen = next(
            variant for variant in chain([name], (f"{name}_{k}" for k in count(2))) if variant.lower() not in taken
        )
        taken.add(chosen.lower())
        names.append(chosen)
    return names


def headline(name: str, answers: Sequence[CaseAnswer]) -> str:
    """The verdicts counted, and limits that are not tested."""
    candidates = len({answer.candidate for answer in answers})
    cases = len({answer.case.name for answer in answers})
    counts = Counter(answer.verdict for answer in answers)
    verdicts = ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in CaseVerdict if counts[verdict])
    where = f"{counted(candidates, 'candidate')} in {counted(cases, 'load case')}"
    left = ", ".join(kind.value for kind in untested(answers))
    return f"{name}: {where}: {verdicts}{'; limits not tested: ' if left else ''}{left}"


def verdict_lines(answers: Sequence[CaseAnswer], width: int | None = None, brief: bool = False) -> list[str]:
    """A table of verdicts, with the range of the figure of each kind that is nearest to its limit."""
    rows: list[list[str]] = []
    candidate, overall = "", overall_verdicts(answers)
    for answer in answers:
        if answer.candidate != candidate:
            candidate = answer.candidate
            rows.append([f"{candidate}:", overall[candidate].value, *[""] * (len(_IN_TABLE) + 1)])
        ranges = [range_words(answer.worst(quantity)) for quantity in _IN_TABLE]
        nearest = answer.nearest_limit
        limit = "-" if nearest is None else f"{share_words(nearest)} {nearest.quantity.value}"
        if not brief and nearest is not None:
            limit += f" of {nearest.subject}"
        rows.append([f"  {answer.case.name}", answer.verdict.value, *ranges, limit])
    headings = ["case", "verdict", *_IN_TABLE.values(), "nearest limit"]
    return table_lines(headings, rows, {*headings[:2], headings[-1]}, width)


def range_words(figure: Figure | None) -> str:
    """The range of a figure in the unit for people, "-" if there is none.

    Examples
    --------
    >>> from strandspring.vibration.verdicts.verdicts import Figure, FigureKind
    >>> range_words(Figure(FigureKind.SWAY, "board", 0.024, 1e-6, 0.0222, 0.0266))
    '22.2-26.6'
    """
    if figure is None:
        return "-"
    low, high = (f"{figure.quantity.column.factor * end:#.3g}".removesuffix(".") for end in (figure.low, figure.high))
    if float(high) < _NOTHING:
        return "0"
    return high if low == high else f"{low}-{high}"


def share_words(figure: Figure) -> str:
    """How much of its limit a figure takes, with more digits near to it."""
    share = figure.share
    return f"{100.0 * share:.{2 if abs(share - 1.0) < _NEAR else 0}f} %"


def refusal_lines(candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer]) -> Iterator[str]:
    """Why candidates, or cases of them, or draws of these were refused, each once."""
    for candidate in candidates:
        if candidate.refusal:
            yield f"{candidate.name}: refused: {candidate.refusal}"
    refused = {(candidate.name, candidate.refusal) for candidate in candidates}
    for answer in answers:
        if answer.refusal and (answer.candidate, answer.refusal) not in refused:
            draws = f"{answer.refused} of {answer.draws} draws refused, most often" if answer.draws else "refused"
            yield f"{answer.where}: {draws}: {answer.refusal}"
