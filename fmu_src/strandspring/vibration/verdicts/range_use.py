"""How far the springs of each axis moved within their identified ranges and against their stops in one run.

The share used is that of the way from the displacement at rest to the end of the identified range, on the side where
it is larger: 0 at rest, 1 at the end, more beyond it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernel.arrays import FloatArray
from ..bodies.axis_laws import AxisLaws
from ..bodies.run_figures import RunFigures
from ..bodies.simulation import CaseRun

ROUNDING = 1e-9  # of the way, beyond which a spring is outside its range


@dataclass(frozen=True, eq=False)
class RangeUse:
    """How far the springs of each axis moved, each array of shape (A,).

    Attributes
    ----------
    low, high : ndarray              Ends of the identified range [m].
    rest : ndarray                   Displacement at rest [m].
    lowest, highest : ndarray        Reached [m].
    share : ndarray                  Of the way from rest to the end of the range that was used.
    stop_deflection : ndarray        Of the stop that was pressed most [m of the axis]; 0 where none was touched.
    stop_force : ndarray             Of that stop [N].
    """

    low: FloatArray
    high: FloatArray
    rest: FloatArray
    lowest: FloatArray
    highest: FloatArray
    share: FloatArray
    stop_deflection: FloatArray
    stop_force: FloatArray

    @classmethod
    def from_run(cls, laws: AxisLaws, run: CaseRun) -> RangeUse:
        """Of a run."""
        rest, lowest, highest = run.start.displacement, run.figures.displacement_low, run.figures.displacement_high
        pressed = [laws.stops(ends) for ends in (lowest, highest)]
        forces = np.max([np.abs(force) for force, _ in pressed], axis=0)
        stiffness = np.max([stiffness for _, stiffness in pressed], axis=0)
        deflection = np.divide(forces, stiffness, out=np.zeros_like(forces), where=stiffness > 0.0)
        share = np.maximum(_shares(highest - rest, laws.high - rest), _shares(rest - lowest, rest - laws.low))
        return cls(laws.low, laws.high, rest, lowest, highest, share, deflection, forces)

    @property
    def is_outside(self) -> np.ndarray:
        """Whether the springs of each axis left their identified range."""
        return np.asarray(self.share > 1.0 + ROUNDING)

    @property
    def beyond(self) -> FloatArray:
        """How far each spring moved beyond its range [m]; 0 where it did not."""
        return np.maximum(np.maximum(self.highest - self.high, self.low - self.lowest), 0.0)


def stroke_errors(laws: AxisLaws, run: CaseRun, errors: RunFigures) -> FloatArray:
    """Numerical errors of the shares, on the side where more is used or errs more, shape (A,)."""
    rest = run.start.displacement
    ends = ((errors.displacement_high, laws.high - rest), (errors.displacement_low, rest - laws.low))
    return np.maximum(*(_shares(error, free) for error, free in ends))


def _shares(way: FloatArray, free: FloatArray) -> FloatArray:
    """way/free; infinite where a spring that rests at the end of its range moved beyond it."""
    return np.divide(way, free, out=np.where(way > 0.0, np.inf, 0.0), where=free > 0.0)
