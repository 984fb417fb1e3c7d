"""Answers about candidates: static pose and modes of each, and a verdict on each load case with its figures.

Every case is run once with the springs as identified and omega 0 at rest, and then as often as `draws` asks for with
all that is unknown drawn; the range of a figure holds both and the numerical error.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import MountedSystemError
from ...findings import Finding
from ...kernel.arrays import FloatArray
from ...model.modelfile import ModelFile
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.simulation import CaseRun, simulate_case
from .cautions import case_cautions, overloads, system_cautions
from .courses import Courses, courses
from .draws import DrawnRun, Unknowns, drawn_case, ranges
from .figures import CaseFigures, RangeUse
from .static_answer import StaticAnswer, static_answer
from .verdicts import CaseVerdict, Figure, FigureKind, Limits, judged, of_all_cases

_MOST_OUTSIDE = 0.5  # share of the draws that leave identified ranges, from which nothing else is judged
_MOST_REFUSED = 0.5  # share of the draws that cannot be simulated, from which those that can say nothing


@dataclass(frozen=True, eq=False)
class CaseAnswer:
    """A candidate under a load case.

    Attributes
    ----------
    candidate : str
    system : MountedSystem
    case : LoadCase
    verdict : CaseVerdict
    limits : Limits
    figures : tuple of Figure       Acceleration and sway of each point, tilt of each body, stroke and force of each
                                    axis, and root mean squares where it settles.
    runs : tuple of CaseRun         The nominal one, and those of the draws; empty if it was refused.
    uses : tuple of RangeUse        Of each run.
    courses : Courses or None       None unless they were asked for.
    findings : tuple of Finding
    draws : int                     How many were asked for.
    refused : int                   Of them, those that could not be simulated.
    beyond : float                  Share of the draws beyond some limit or identified range, refused ones included.
    refusal : str                   Why it could not be simulated, or why draws could not, most often; empty if it was.
    """

    candidate: str
    system: MountedSystem
    case: LoadCase
    verdict: CaseVerdict
    limits: Limits = field(default_factory=Limits)
    figures: tuple[Figure, ...] = ()
    runs: tuple[CaseRun, ...] = ()
    uses: tuple[RangeUse, ...] = ()
    courses: Courses | None = None
    findings: tuple[Finding, ...] = ()
    draws: int = 0
    refused: int = 0
    beyond: float = 0.0
    refusal: str = ""

    @property
    def where(self) -> str:
        """The candidate and the load case."""
        return f"{self.candidate}, {self.case.name}"

    def figures_of(self, quantity: FigureKind) -> tuple[Figure, ...]:
        """The figures of a quantity."""
        return tuple(figure for figure in self.figures if figure.quantity is quantity)

    def worst(self, quantity: FigureKind) -> Figure | None:
        """The figure of a quantity that is nearest to its limit or beyond it; the largest where none has a limit."""
        figures = self.figures_of(quantity)
        return _nearest_limit(figures) or max(figures, key=lambda figure: figure.high, default=None)

    @property
    def nearest_limit(self) -> Figure | None:
        """The figure that is nearest to its limit or furthest beyond it; None if none has a limit."""
        return _nearest_limit(self.figures)

    @property
    def severity(self) -> float:
        """Share of the nearest limit that is taken; 0 without one."""
        return 0.0 if self.nearest_limit is None else self.nearest_limit.share

    @property
    def relative_error(self) -> float:
        """The largest numerical error of acceleration, sway or stroke, relative to the largest figure of its kind."""
        errors = [0.0]
        for quantity in (FigureKind.ACCELERATION, FigureKind.SWAY, FigureKind.STROKE):
            figures = self.figures_of(quantity)
            largest = max((figure.high for figure in figures), default=0.0)
            errors += [figure.error / largest for figure in figures if largest > 0.0]
        return max(errors)


@dataclass(frozen=True, eq=False)
class CandidateAnswer:
    """A candidate.

    Attributes
    ----------
    name : str
    system : MountedSystem
    static : StaticAnswer or None   None if it cannot rest.
    findings : tuple of Finding     About its description.
    refusal : str                   Why it cannot rest; empty if it does.
    """

    name: str
    system: MountedSystem
    static: StaticAnswer | None
    findings: tuple[Finding, ...]
    refusal: str = ""


def answer_candidate(
    name: str, system: MountedSystem, models: Mapping[str, ModelFile], unknowns: Unknowns
) -> CandidateAnswer:
    """Static pose and modes of a candidate."""
    findings = (*system_cautions(system, models), *unknowns.springs.missing)
    try:
        static = static_answer(system, unknowns)
    except MountedSystemError as problem:
        return CandidateAnswer(name, system, None, findings, str(problem))
    return CandidateAnswer(name, system, static, (*findings, *overloads(system, static), *static.findings))


def answer_case(
    name: str,
    system: MountedSystem,
    case: LoadCase,
    limits: Limits,
    unknowns: Unknowns | None = None,
    step: float | None = None,
    with_courses: bool = False,
) -> CaseAnswer:
    """A candidate under a load case; a refusal is an answer, too.

    Parameters
    ----------
    name : str
    system : MountedSystem
    case : LoadCase
    limits : Limits
    unknowns : Unknowns or None   What is drawn; omega at rest alone if None.
    step : float or None          See `simulate_case`.
    with_courses : bool           Whether histories and spectra are wanted, too.
    """
    unknowns = unknowns or Unknowns()
    case = replace(case, allowed=tuple(limits.spectra.items())) if case.is_shock else case
    try:
        nominal = simulate_case(system, case, unknowns.share, step)
        draws = drawn_case(system, case, nominal, unknowns, step is not None)
        if draws.refused > _MOST_REFUSED * draws.count:
            raise MountedSystemError(f"{draws.refused} of {draws.count} draws are refused, most often: {draws.reason}")
        known = CaseFigures(system, case)
        bounds = np.array(
            [np.inf if (limit := limits.limit_of(*subject)) is None else limit for subject in known.subjects]
        )
        identified = DrawnRun(system, case, nominal)
        value, errors = known.of_run(nominal), known.errors(draws.nominal)
        values = np.array([known.of_run(draw.run) for draw in draws.runs]).reshape(-1, bounds.size)
        drawn = None
        if with_courses:
            # Of the draw that is nearest to a limit or farthest beyond one.
            worst = draws.runs[int(np.argmax((values / bounds).max(axis=1)))] if draws.runs else identified
            drawn = courses(worst.system, worst.case, worst.run, limits.spectra)
    except MountedSystemError as problem:
        return CaseAnswer(name, system, case, CaseVerdict.REFUSED, limits, refusal=str(problem))
    runs = (nominal, *(draw.run for draw in draws.runs))
    uses = tuple(RangeUse.from_run(system.laws, run) for run in runs)
    findings = case_cautions(system, case, nominal, draws.runs, uses, limits.of_all.get(FigureKind.TILT))
    low, high, middle = value, value, value
    if draws.runs:
        coupled = [draw.system.coupled for draw in draws.runs]
        low, high = ranges(values, coupled, unknowns.is_exhaustive(system, case))
        if case.is_random:
            middle = values[np.logical_not(coupled)].mean(axis=0)
    low, high = np.maximum(np.minimum(low, middle) - errors, 0.0), np.maximum(high, middle) + errors
    figures = _figures(known.subjects, np.array([middle, errors, low, high]), bounds, values)
    outside = np.array([use.is_outside.any() for use in uses])
    beyond = np.count_nonzero(outside[1:] | (values > bounds).any(axis=1)) + draws.refused
    is_limited = any(limits.tested([case]).values())
    verdict = judged(figures, bool(outside[0]) or float(outside.mean()) > _MOST_OUTSIDE, is_limited)
    if draws.refused and verdict in (CaseVerdict.PASSES, CaseVerdict.NO_LIMITS):
        verdict = CaseVerdict.UNDECIDED
    return CaseAnswer(
        candidate=name,
        system=system,
        case=case,
        verdict=verdict,
        limits=limits,
        figures=figures,
        runs=runs,
        uses=uses,
        courses=drawn,
        findings=(*findings, *(drawn.findings if drawn else ())),
        draws=draws.count,
        refused=draws.refused,
        beyond=beyond / draws.count if draws.count else 0.0,
        refusal=draws.reason,
    )


def untested(answers: Sequence[CaseAnswer]) -> tuple[FigureKind, ...]:
    """The kinds of figures whose limits none of the load cases tests."""
    return answers[0].limits.untested([answer.case for answer in answers])


def overall_verdicts(answers: Sequence[CaseAnswer]) -> dict[str, CaseVerdict]:
    """The verdict on each candidate in all load cases together, by its name."""
    names = dict.fromkeys(answer.candidate for answer in answers)
    left = untested(answers)
    return {
        name: of_all_cases((answer.verdict for answer in answers if answer.candidate == name), left) for name in names
    }


def shared(of_candidates: Mapping[str, Sequence[Finding]]) -> Iterator[Finding]:
    """What is to be known of candidates, each once; without a place where it is of all of them."""
    found = [finding for findings in of_candidates.values() for finding in findings]
    for finding in (finding for k, finding in enumerate(found) if finding not in found[:k]):
        names = [name for name, findings in of_candidates.items() if finding in findings]
        yield finding if len(names) == len(of_candidates) else replace(finding, where=", ".join(names))


def findings_of(candidates: Sequence[CandidateAnswer], answers: Sequence[CaseAnswer]) -> list[Finding]:
    """What is to be known of candidates, and of each in each case."""
    of_cases = (replace(finding, where=answer.where) for answer in answers for finding in answer.findings)
    return [*shared({candidate.name: candidate.findings for candidate in candidates}), *of_cases]


def _nearest_limit(figures: Sequence[Figure]) -> Figure | None:
    limited = [figure for figure in figures if figure.limit is not None]
    return max(limited, key=lambda figure: figure.share, default=None)


def _figures(
    subjects: Sequence[tuple[FigureKind, str]], columns: FloatArray, bounds: FloatArray, values: FloatArray
) -> tuple[Figure, ...]:
    """All figures of a case: of each value, error, low and high, its limit, and its values in the draws."""
    figures = []
    for subject, column, bound, drawn in zip(subjects, columns.T.tolist(), bounds.tolist(), values.T, strict=True):
        value, error, low, high = column
        beyond = float(np.mean(drawn > bound)) if drawn.size and bound < np.inf else None
        figures.append(Figure(*subject, value, error, low, high, None if bound == np.inf else bound, beyond))
    return tuple(figures)
