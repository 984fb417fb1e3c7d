"""Spread of a load case by the uncertainty of its springs: springs are drawn and the case is run with each of them.

See `drawn_springs` for what a draw is. Each is run from the same static equilibria with the same steps, and the worst
counts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...errors import ModelError, MountedSystemError
from ...kernel.arrays import FloatArray
from ...kernel.motion import MotionSolver
from ...model.joint import Quantiles
from ..bodies.axis_laws import AxisLaws
from ..bodies.mounted import MountedSystem
from ..bodies.rest import rest
from ..bodies.run_figures import Energies, RunFigures
from ..bodies.simulation import CaseRun, check_balance, run_once
from ..bodies.solving import solver
from .answers import CaseAnswer
from .drawn_springs import Drawn
from .range_use import ROUNDING, ways_used
from .verdicts import CaseSpread, FigureKind


class CaseDraws:
    """Runs of drawn springs; its calls may run in many threads.

    Parameters
    ----------
    answer : CaseAnswer     Nominal, and not refused.
    drawn : Drawn
    seed : int
    """

    def __init__(self, answer: CaseAnswer, drawn: Drawn, seed: int) -> None:
        self.answer, self._drawn, self._seed = answer, drawn, seed
        self._laws = AxisLaws(answer.system)
        case = answer.case
        averages = {step: case.averages(step, case.steps(step)) for step in {run.step for run in answer.runs}}
        self._averages = [averages[run.step] for run in answer.runs]

    def figures(self, number: int) -> FloatArray | str:
        """The figures of a draw, in the order of `CaseAnswer.figures` up to the forces, or why there are none."""
        try:
            system = self._drawn.system(self.answer.system, self._seed, number)
            kernel = solver(system)
            runs = [
                self._once(system, kernel, run, averages)
                for run, averages in zip(self.answer.runs, self._averages, strict=True)
            ]
        except (ModelError, MountedSystemError) as problem:
            return str(problem)
        return np.asarray(np.max(runs, axis=0))

    def _once(self, system: MountedSystem, kernel: MotionSolver, run: CaseRun, averages: FloatArray) -> FloatArray:
        """The figures of a draw from one static equilibrium."""
        case = self.answer.case
        start = rest(system, run.start.share, case.weightless, kernel)
        motion = run_once(system, kernel, case, start, run.step, averages)
        check_balance(case, Energies.from_motion_figures(motion), run.step)
        figures = RunFigures.from_motion_figures(motion)
        strokes = np.maximum(
            *ways_used(self._laws, start.displacement, figures.displacement_low, figures.displacement_high)
        )
        return np.concatenate([figures.acceleration, figures.sway, figures.tilt, strokes, figures.force])

    def answered(self, outcomes: Sequence[FloatArray | str]) -> CaseAnswer:
        """The answer with the quantiles of its figures."""
        refusals = [drawn for drawn in outcomes if isinstance(drawn, str)]
        rows = np.array([drawn for drawn in outcomes if not isinstance(drawn, str)])
        reason = Counter(refusals).most_common(1)[0][0] if refusals else ""
        if not rows.size:
            return replace(self.answer, spread=CaseSpread(len(outcomes), self._seed, len(refusals), reason, 1.0))
        figures = self.answer.figures[: rows.shape[1]]
        limits = np.array([np.inf if figure.limit is None else figure.limit for figure in figures])
        is_stroke = np.array([figure.quantity is FigureKind.STROKE for figure in figures])
        bad = (rows > limits).any(axis=1) | (rows[:, is_stroke] > 1.0 + ROUNDING).any(axis=1)
        failing = (int(np.count_nonzero(bad)) + len(refusals)) / len(outcomes)
        ends = np.quantile(rows, (0.05, 0.5, 0.95), axis=0).T.tolist()
        with_spread = (
            *(replace(figure, spread=Quantiles(*quantiles)) for figure, quantiles in zip(figures, ends, strict=True)),
            *self.answer.figures[len(figures) :],
        )
        spread = CaseSpread(len(outcomes), self._seed, len(refusals), reason, failing)
        return replace(self.answer, figures=with_spread, spread=spread)
