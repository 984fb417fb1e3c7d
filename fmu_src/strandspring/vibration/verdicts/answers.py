"""Answers about candidates: static pose and modes of each, and a verdict on each load case with its figures.

Every case is run from three static equilibria, in which omega of all springs is 0, 1 and -1 times the sign of their
static force, as it is unknown; a figure is the worst of them. Vibration that settles forgets omega in its root mean
squares, but not in its sway, which is counted from rest: so it is run from all three, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from ...model.modelfile import ModelFile
from ..bodies.axis_names import axis_names
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.rest import SHARES
from ..bodies.run_figures import Limits, RunFigures
from ..bodies.simulation import CaseResult, CaseRun, simulate_case
from .case_cautions import Caution, case_cautions, system_cautions
from .catalogue_cautions import catalogue_cautions, overloads, swings_apart
from .courses import Courses, courses
from .range_use import RangeUse
from .static_answer import StaticAnswer, static_answer
from .verdicts import CaseSpread, CaseVerdict, Figure, FigureKind, judged


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
    runs : tuple of CaseRun         From each static equilibrium; empty if it was refused.
    uses : tuple of RangeUse        Of each run.
    courses : Courses or None       None unless they were asked for.
    cautions : tuple of Caution
    spread : CaseSpread or None     None if nothing was drawn.
    refusal : str                   Why it could not be simulated; empty if it was.
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
    spread: CaseSpread | None = None
    refusal: str = ""

    def figures_of(self, quantity: FigureKind) -> tuple[Figure, ...]:
        """The figures of a quantity."""
        return tuple(figure for figure in self.figures if figure.quantity is quantity)

    def worst(self, quantity: FigureKind) -> Figure | None:
        """The figure of a quantity that is nearest to its limit or beyond it; the largest where none has a limit."""
        figures = self.figures_of(quantity)
        limited = [figure for figure in figures if figure.limit is not None]
        if limited:
            return max(limited, key=lambda figure: figure.value / (figure.limit or 1.0))
        return max(figures, key=lambda figure: figure.value, default=None)


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
    name: str, system: MountedSystem, models: Mapping[str, ModelFile], shares: tuple[float, ...] = SHARES
) -> CandidateAnswer:
    """Static pose and modes of a candidate."""
    cautions = (*system_cautions(system, models), *catalogue_cautions(system))
    try:
        static = static_answer(system, shares)
    except MountedSystemError as problem:
        return CandidateAnswer(name, system, None, cautions, str(problem))
    return CandidateAnswer(name, system, static, (*cautions, *overloads(system, static), *static.refusals))


def answer_case(
    name: str,
    system: MountedSystem,
    case: LoadCase,
    limits: Limits,
    shares: Sequence[float] = SHARES,
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
    shares : sequence of float   omega at rest, see `rest`.
    step : float or None         See `simulate_case`.
    with_courses : bool          Whether histories and spectra are wanted, too.
    """
    try:
        result = simulate_case(system, case, shares, step)
        uses = tuple(RangeUse.from_run(system, run) for run in result.runs)
        figures = tuple(_figures(result, uses, limits))
        drawn = courses(system, case, governing(result)) if with_courses else None
    except MountedSystemError as problem:
        return CaseAnswer(name, system, case, CaseVerdict.REFUSED, refusal=str(problem))
    return CaseAnswer(
        candidate=name,
        system=system,
        case=case,
        verdict=judged(figures, bool(np.any([use.is_outside for use in uses]))),
        figures=figures,
        runs=result.runs,
        uses=uses,
        courses=drawn,
        cautions=(
            *case_cautions(system, case, result.runs, uses, limits.tilt),
            *swings_apart(system, uses),
            *(drawn.cautions if drawn else ()),
        ),
    )


def governing(result: CaseResult) -> CaseRun:
    """The run with the largest acceleration of a point, or of the largest stroke where there are no points."""
    if result.system.points:
        return max(result.runs, key=lambda run: float(run.figures.acceleration.max()))
    return max(result.runs, key=lambda run: float((run.figures.displacement_high - run.figures.displacement_low).max()))


def _figures(result: CaseResult, uses: Sequence[RangeUse], limits: Limits) -> Iterator[Figure]:
    """All figures of a case, each the worst of its runs."""
    points = [point.name for point in result.system.points]
    bodies = [body.name for body in result.system.bodies]
    shares = [run.start.share for run in result.runs]

    def of_runs(name: str) -> tuple[FloatArray, FloatArray]:
        """Figures and errors, each of shape (runs, subjects)."""

        def stacked(figures_of: Callable[[CaseRun], RunFigures]) -> FloatArray:
            return np.array([getattr(figures_of(run), name).ravel() for run in result.runs])

        return stacked(lambda run: run.figures), stacked(lambda run: run.errors)

    axes = axis_names(result.system)
    strokes = np.array([use.share for use in uses]), np.array([use.error for use in uses])
    kinds: list[tuple[FigureKind, Sequence[str], tuple[FloatArray, FloatArray], Mapping[str, float | None]]] = [
        (FigureKind.ACCELERATION, points, of_runs("acceleration"), limits.acceleration),
        (FigureKind.SWAY, points, of_runs("sway"), limits.sway),
        (FigureKind.TILT, bodies, of_runs("tilt"), dict.fromkeys(bodies, limits.tilt)),
        (FigureKind.STROKE, axes, strokes, dict.fromkeys(axes, limits.stroke)),
        (FigureKind.FORCE, axes, of_runs("force"), {}),
    ]
    if result.case.settling > 0.0:
        along = [f"{point} {letter}" for point in points for letter in "xyz"]
        kinds += [
            (FigureKind.RMS_ACCELERATION, along, of_runs("rms_acceleration"), {}),
            (FigureKind.RMS_SWAY, along, of_runs("rms_sway"), {}),
        ]
    for quantity, subjects, (values, errors), bounds in kinds:
        for k, subject in enumerate(subjects):
            worst = int(np.argmax(values[:, k]))
            yield Figure(
                quantity, subject, float(values[worst, k]), float(errors[worst, k]), float(values[:, k].min()),
                shares[worst], bounds.get(subject),
            )  # fmt: skip
