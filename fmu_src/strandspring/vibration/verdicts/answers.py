"""Answers about candidates: static pose and modes of each, and a verdict on each load case with its figures.

Every case is run once with the springs as identified and omega 0 at rest, and then as often as `draws` asks for with
all that is unknown drawn; the range of a figure holds both and the numerical error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from ...model.modelfile import ModelFile
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.simulation import CaseRun, simulate_case
from .case_cautions import Caution, case_cautions, system_cautions
from .catalogue_cautions import catalogue_cautions, overloads, swings_apart
from .coupled_friction import coupled_friction
from .courses import Courses, courses
from .draws import DrawnRun, Draws, Unknowns, drawn_case, ranges, shares_beyond
from .figures import CaseFigures
from .range_use import RangeUse
from .static_answer import StaticAnswer, static_answer
from .verdicts import CaseVerdict, Figure, FigureKind, Limits, judged

_MOST_OUTSIDE = 0.5  # share of the draws that leave identified ranges, from which nothing else is judged


@dataclass(frozen=True, eq=False)
class CaseAnswer:
    """A candidate under a load case.

    Attributes
    ----------
    candidate : str
    system : MountedSystem
    case : LoadCase
    verdict : CaseVerdict
    figures : tuple of Figure       Acceleration and sway of each point, tilt of each body, stroke and force of each
                                    axis, and root mean squares where it settles.
    runs : tuple of CaseRun         The nominal one, and those of the draws; empty if it was refused.
    uses : tuple of RangeUse        Of each run.
    courses : Courses or None       None unless they were asked for.
    cautions : tuple of Caution
    draws : int                     How many were asked for.
    refused : int                   Of them, those that could not be simulated.
    beyond : float                  Share of the draws beyond some limit or identified range, refused ones included.
    refusal : str                   Why it could not be simulated, or why draws could not, most often; empty if it was.
    """

    candidate: str
    system: MountedSystem
    case: LoadCase
    verdict: CaseVerdict
    figures: tuple[Figure, ...] = ()
    runs: tuple[CaseRun, ...] = ()
    uses: tuple[RangeUse, ...] = ()
    courses: Courses | None = None
    cautions: tuple[Caution, ...] = ()
    draws: int = 0
    refused: int = 0
    beyond: float = 0.0
    refusal: str = ""

    def figures_of(self, quantity: FigureKind) -> tuple[Figure, ...]:
        """The figures of a quantity."""
        return tuple(figure for figure in self.figures if figure.quantity is quantity)

    def worst(self, quantity: FigureKind) -> Figure | None:
        """The figure of a quantity that is nearest to its limit or beyond it; the largest where none has a limit."""
        figures = self.figures_of(quantity)
        limited = [figure for figure in figures if figure.limit is not None]
        if limited:
            return max(limited, key=lambda figure: figure.high / (figure.limit or 1.0))
        return max(figures, key=lambda figure: figure.high, default=None)


@dataclass(frozen=True, eq=False)
class CandidateAnswer:
    """A candidate.

    Attributes
    ----------
    name : str
    system : MountedSystem
    static : StaticAnswer or None   None if it cannot rest.
    cautions : tuple of str         About its description.
    refusal : str                   Why it cannot rest; empty if it does.
    """

    name: str
    system: MountedSystem
    static: StaticAnswer | None
    cautions: tuple[str, ...]
    refusal: str = ""


def answer_candidate(
    name: str, system: MountedSystem, models: Mapping[str, ModelFile], unknowns: Unknowns
) -> CandidateAnswer:
    """Static pose and modes of a candidate."""
    cautions = (*system_cautions(system, models), *catalogue_cautions(system), *unknowns.springs.missing)
    try:
        static = static_answer(system, unknowns)
    except MountedSystemError as problem:
        return CandidateAnswer(name, system, None, cautions, str(problem))
    return CandidateAnswer(name, system, static, (*cautions, *overloads(system, static), *static.refusals))


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
    try:
        nominal = simulate_case(system, case, unknowns.share, step)
        draws = drawn_case(system, case, nominal, unknowns, step is not None)
        known = CaseFigures.from_case(system, case, limits.spectra)
        values = np.array([known.of_draw(draw) for draw in draws.runs]).reshape(-1, len(known.subjects))
        bounds = [limits.of(*subject) for subject in known.subjects]
        value, errors = known.of_draw(DrawnRun(system, case, nominal)), known.errors(system, case, draws.nominal)
        drawn = None
        if with_courses:
            worst = _deciding(values, bounds)
            run = DrawnRun(system, case, nominal) if worst is None else draws.runs[worst]
            drawn = courses(run.system, run.case, run.run, limits.spectra)
    except MountedSystemError as problem:
        return CaseAnswer(name, system, case, CaseVerdict.REFUSED, refusal=str(problem))
    runs = (nominal, *(draw.run for draw in draws.runs))
    uses = tuple(RangeUse.from_run(known.laws, run) for run in runs)
    cautions = (
        *case_cautions(system, case, runs, uses, limits.of_all.get(FigureKind.TILT)),
        *coupled_friction(system, nominal, draws.runs),
        *swings_apart(system, uses),
        *(drawn.cautions if drawn else ()),
    )
    exhaustive = unknowns.is_exhaustive(system, case)
    figures = tuple(_figures(known, draws, value, errors, values, bounds, exhaustive))
    outside = np.array([use.is_outside.any() for use in uses])
    verdict = judged(figures, bool(outside[0]) or float(outside.mean()) > _MOST_OUTSIDE)
    if draws.refused and verdict is CaseVerdict.PASSES:
        verdict = CaseVerdict.UNDECIDED
    return CaseAnswer(
        candidate=name,
        system=system,
        case=case,
        verdict=verdict,
        figures=figures,
        runs=runs,
        uses=uses,
        courses=drawn,
        cautions=cautions,
        draws=draws.count,
        refused=draws.refused,
        beyond=_share_beyond(values, bounds, outside[1:], draws),
        refusal=draws.reason,
    )


def _figures(
    known: CaseFigures,
    draws: Draws,
    nominal: FloatArray,
    errors: FloatArray,
    values: FloatArray,
    bounds: Sequence[float | None],
    is_exhaustive: bool,
) -> list[Figure]:
    """All figures of a case with their ranges."""
    low, high, value = nominal, nominal, nominal
    if len(values):
        coupled = [draw.system.coupled for draw in draws.runs]
        low, high = ranges(values, coupled, is_exhaustive)
        if draws.runs[0].case.is_random:
            value = values[np.logical_not(coupled)].mean(axis=0)
        low, high = np.minimum(low, value), np.maximum(high, value)
    low, high = np.maximum(low - errors, 0.0), high + errors
    columns = zip(value.tolist(), errors.tolist(), low.tolist(), high.tolist(), strict=True)
    return [
        Figure(*subject, *column, limit, beyond)
        for subject, column, limit, beyond in zip(
            known.subjects, columns, bounds, shares_beyond(values, bounds), strict=True
        )
    ]


def _deciding(values: FloatArray, bounds: Sequence[float | None]) -> int | None:
    """The draw that is nearest to a limit or farthest beyond one; None without draws."""
    if not len(values):
        return None
    limits = np.array([np.inf if bound is None else bound for bound in bounds])
    return int(np.argmax((values / limits).max(axis=1)))


def _share_beyond(
    values: FloatArray, bounds: Sequence[float | None], outside: NDArray[np.bool_], draws: Draws
) -> float:
    """`CaseAnswer.beyond`."""
    if not draws.count:
        return 0.0
    limits = np.array([np.inf if bound is None else bound for bound in bounds])
    return (int(np.count_nonzero((values > limits).any(axis=1) | outside)) + draws.refused) / draws.count
