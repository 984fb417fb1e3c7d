"""Engineering figures of a spring by amplitude: measured with their scatter, modelled with their 95 % interval."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...identification.certainty.intervals import NORMAL_95
from ...identification.identified_model import IdentifiedModel
from ...kernel.arrays import FloatArray
from ...kernel.path import PathSolver
from ...loops.cycles import Cycle
from ...loops.loop import PANELS, LoopFigures, group_by_amplitude, mean_figures
from ...loops.measured import FigureSpread, spread_of
from ...loops.modelled import steady_loop_figures
from ...model.joint import JointCovariance
from ...model.outcomes import Outcome
from .evaluation import Evaluation

NAMES = tuple(column.key for column in PANELS)
KINDS = ("stiffness", "energy", "")  # of their units; empty of pure numbers
_NEARLY = 0.9  # share of an amplitude that counts as that amplitude
_STEP = 0.01  # of the differences for the model's intervals, in standard deviations
_SHARES = np.linspace(0.05, 1.0, 20)  # amplitudes of the model's curve, of half the identified range
_MOST = 12  # amplitudes in the table


@dataclass(frozen=True)
class MeasuredFigures:
    """Cycles of about one amplitude.

    Attributes
    ----------
    figures : LoopFigures          Of the mean cycle.
    spread : FigureSpread or None  From cycle to cycle; None for a single one.
    cycles : int
    frequencies : tuple of float   Least and greatest [Hz]; empty without times.
    """

    figures: LoopFigures
    spread: FigureSpread | None
    cycles: int
    frequencies: tuple[float, ...]


@dataclass(frozen=True)
class AmplitudeComparison:
    """One amplitude.

    Attributes
    ----------
    low, high : float                  Turning points [m].
    model : LoopFigures                The model's steady loop between them.
    reach : tuple of float or None     Half of the 95 % interval of the model's `NAMES`; None if unknown.
    measured : MeasuredFigures or None None where nothing was measured.
    """

    low: float
    high: float
    model: LoopFigures
    reach: tuple[float, ...] | None
    measured: MeasuredFigures | None


class EngineeringFigures:
    """Stiffness, energy and loss factor of a spring.

    Parameters
    ----------
    evaluation : Evaluation
    """

    def __init__(self, evaluation: Evaluation) -> None:
        self._evaluation = evaluation

    @cached_property
    def measured(self) -> tuple[MeasuredFigures, ...]:
        """All amplitudes measured, rising; cycles of all records whose turning points agree are one."""
        cycles = (cycle for view in self._evaluation.views for cycle in view.measured_cycles)
        return tuple(map(_together, group_by_amplitude(cycles)))

    @cached_property
    def table(self) -> tuple[AmplitudeComparison, ...]:
        """The measured amplitudes, evenly chosen of many, and quarters of the identified range where none is near."""
        p = self._evaluation.identification.parameters
        chosen = np.unique(np.linspace(0, len(self.measured) - 1, min(len(self.measured), _MOST)).round().astype(int))
        rows: list[tuple[float, float, MeasuredFigures | None]] = [
            (self.measured[k].figures.low, self.measured[k].figures.high, self.measured[k]) for k in chosen
        ]
        half = 0.5 * (p.displacement_max - p.displacement_min)
        middle = 0.5 * (p.displacement_max + p.displacement_min)
        for share in (0.25, 0.5, 0.75, 1.0):
            if all(abs(0.5 * (high - low) / (share * half) - 1.0) > 0.1 for low, high, _ in rows):
                rows.append((middle - share * half, middle + share * half, None))
        rows.sort(key=lambda row: row[1] - row[0])
        ends = [(low, high) for low, high, _ in rows]
        reach = self._reach(ends)
        return tuple(
            AmplitudeComparison(low, high, steady_loop_figures(self._evaluation.solver, low, high),
                       None if reach is None or np.isnan(reach[k]).any() else tuple(reach[k].tolist()), measured)
            for k, (low, high, measured) in enumerate(rows)
        )  # fmt: skip

    @cached_property
    def smallest_measured(self) -> float:
        """Amplitude below which loops are extrapolated [m]; infinite if none was measured."""
        return _NEARLY * min((row.figures.amplitude for row in self.measured), default=math.inf)

    @property
    def largest(self) -> AmplitudeComparison:
        """The largest amplitude that was measured; of the model only if there is none."""
        return max(self.table, key=lambda row: (row.measured is not None, row.high - row.low))

    @cached_property
    def _curve_ends(self) -> list[tuple[float, float]]:
        p = self._evaluation.identification.parameters
        middle = 0.5 * (p.displacement_max + p.displacement_min)
        half = 0.5 * (p.displacement_max - p.displacement_min)
        return [(middle - share * half, middle + share * half) for share in _SHARES.tolist()]

    @cached_property
    def curve(self) -> tuple[LoopFigures, ...]:
        """The model's figures over the amplitude, about the middle of the identified range."""
        return tuple(steady_loop_figures(self._evaluation.solver, *ends) for ends in self._curve_ends)

    @cached_property
    def curve_reach(self) -> FloatArray | None:
        """Half of their 95 % intervals, shape (A, 3); None if unknown."""
        return self._reach(self._curve_ends)

    def _reach(self, ends: list[tuple[float, float]]) -> FloatArray | None:
        """Half of the 95 % interval of `NAMES` for loops between these turning points, shape (L, 3).

        NaN for loops smaller than the recorded ones where the records do not decide them: another minimum may fit about
        as well, of which the covariance at this one says nothing.
        """
        whole: IdentifiedModel = self._evaluation.identification
        joint = JointCovariance.from_uncertainty(whole.parameters, whole.uncertainty)
        if joint is None:
            return None
        variance = np.zeros((len(ends), len(NAMES)))
        try:
            for unit in np.eye(len(joint.root)) * _STEP:
                up, down = (_figures(PathSolver(joint.moved(whole.parameters, side * unit)), ends) for side in (1, -1))
                variance += ((up - down) / (2.0 * _STEP)) ** 2
        except ValueError:  # a hundredth of a standard deviation away there is no spring any more
            return None
        reach = np.asarray(NORMAL_95 * np.sqrt(variance))
        if {Outcome.SMALL_LOOPS, Outcome.ONE_AMPLITUDE} & {*whole.outcomes}:
            amplitudes = np.array([0.5 * (high - low) for low, high in ends])
            reach[amplitudes < self.smallest_measured] = np.nan
        return reach


def _figures(solver: PathSolver, ends: list[tuple[float, float]]) -> FloatArray:
    loops = [steady_loop_figures(solver, *pair) for pair in ends]
    return np.array([[getattr(figures, name) for name in NAMES] for figures in loops])


def _together(group: list[Cycle]) -> MeasuredFigures:
    frequencies = [cycle.frequency for cycle in group if cycle.frequency is not None]
    ends = (min(frequencies), max(frequencies)) if frequencies else ()
    return MeasuredFigures(mean_figures(group), spread_of(group), len(group), ends)
