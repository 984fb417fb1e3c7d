"""How far the springs of each axis moved within their identified ranges and against their stops in one run.

The share used is that of the way from the displacement at rest to the end of the identified range, on the side where
it is larger: 0 at rest, 1 at the end, more beyond it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kernel.arrays import FloatArray
from ..bodies.axis_laws import AxisLaws
from ..bodies.mounted import MountedSystem
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
    share, error : ndarray           Of the way from rest to the end of the range that was used, and its numerical
                                     error.
    stop_deflection : ndarray        Of the stop that was pressed most [m of the axis]; 0 where none was touched.
    stop_force : ndarray             Of that stop [N].
    """

    low: FloatArray
    high: FloatArray
    rest: FloatArray
    lowest: FloatArray
    highest: FloatArray
    share: FloatArray
    error: FloatArray
    stop_deflection: FloatArray
    stop_force: FloatArray

    @classmethod
    def from_run(cls, system: MountedSystem, run: CaseRun) -> RangeUse:
        """Of a run."""
        laws, figures, errors = AxisLaws(system), run.figures, run.errors
        rest, lowest, highest = run.start.displacement, figures.displacement_low, figures.displacement_high
        ups, downs = ways_used(laws, rest, lowest, highest)
        up_errors = _shares(errors.displacement_high, laws.high - rest)
        down_errors = _shares(errors.displacement_low, rest - laws.low)
        pressed = [laws.stops(ends) for ends in (lowest, highest)]
        forces = np.max([np.abs(force) for force, _ in pressed], axis=0)
        stiffness = np.max([stiffness for _, stiffness in pressed], axis=0)
        deflection = np.divide(forces, stiffness, out=np.zeros_like(forces), where=stiffness > 0.0)
        return cls(
            laws.low, laws.high, rest, lowest, highest, np.maximum(ups, downs),
            np.where(ups >= downs, up_errors, down_errors), deflection, forces,
        )  # fmt: skip

    @property
    def is_outside(self) -> np.ndarray:
        """Whether the springs of each axis left their identified range."""
        return np.asarray(self.share > 1.0 + ROUNDING)

    @property
    def beyond(self) -> FloatArray:
        """How far each spring moved beyond its range [m]; 0 where it did not."""
        return np.maximum(np.maximum(self.highest - self.high, self.low - self.lowest), 0.0)


def ways_used(
    laws: AxisLaws, rest: FloatArray, lowest: FloatArray, highest: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Shares of the ways from rest to the upper and to the lower ends of the ranges that were used, each shape (A,)."""
    return _shares(highest - rest, laws.high - rest), _shares(rest - lowest, rest - laws.low)


def _shares(way: FloatArray, free: FloatArray) -> FloatArray:
    """way/free; infinite where a spring that rests at the end of its range moved beyond it."""
    return np.divide(way, free, out=np.where(way > 0.0, np.inf, 0.0), where=free > 0.0)
