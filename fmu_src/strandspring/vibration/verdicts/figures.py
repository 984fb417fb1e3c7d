"""The figures of a load case: which there are, and their values in one run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...kernel.arrays import FloatArray
from ..bodies.axis_laws import AxisLaws
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.run_figures import RunFigures
from ..bodies.simulation import CaseRun, CheckedRun
from .verdicts import FigureKind

_SWAYS = (FigureKind.SWAY_X, FigureKind.SWAY_Y, FigureKind.SWAY_Z)
_ROUNDING = 1e-9  # of the way, beyond which a spring is outside its range


@dataclass(frozen=True, eq=False)
class RangeUse:
    """How far the springs of each axis moved in one run, within their identified ranges and against their stops.

    The share used is that of the way from the displacement at rest to the end of the identified range, on the side
    where it is larger: 0 at rest, 1 at the end, more beyond it. Each array is of shape (A,).

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
        return np.asarray(self.share > 1.0 + _ROUNDING)

    @property
    def beyond(self) -> FloatArray:
        """How far each spring moved beyond its range [m]; 0 where it did not."""
        return np.maximum(np.maximum(self.highest - self.high, self.low - self.lowest), 0.0)


@dataclass(frozen=True, eq=False)
class CaseFigures:
    """The figures of a system in a load case in their order, N in number.

    Parameters
    ----------
    system : MountedSystem
    case : LoadCase
    """

    system: MountedSystem
    case: LoadCase

    @cached_property
    def subjects(self) -> tuple[tuple[FigureKind, str], ...]:
        """Kind and subject of each."""
        system, points = self.system, [point.name for point in self.system.points]
        along = [f"{point} {letter}" for point in points for letter in "xyz"]
        names: dict[FigureKind, Sequence[str]] = {
            FigureKind.ACCELERATION: points,
            FigureKind.SWAY: points,
            **dict.fromkeys(_SWAYS, points),
            FigureKind.TILT: [body.name for body in system.bodies],
            FigureKind.STROKE: system.axis_names,
            FigureKind.FORCE: system.axis_names,
            FigureKind.MOUNT_FORCE: [mount.name for mount in system.mounts],
            FigureKind.REACTION: ["base"],
            FigureKind.RMS_ACCELERATION: along,
            FigureKind.THREE_SIGMA: points,
            FigureKind.RMS_SWAY: along,
            FigureKind.SRS: [name for name, _ in self.case.allowed],
        }
        return tuple((kind, subject) for kind in names if kind.is_of(self.case) for subject in names[kind])

    def of_run(self, run: CaseRun) -> FloatArray:
        """Values in a run, shape (N,)."""
        return self._values(run.figures, RangeUse.from_run(self.system.laws, run).share)

    def errors(self, run: CheckedRun) -> FloatArray:
        """Numerical errors of the values in a run, shape (N,); of strokes where more is used or errs more."""
        rest, laws = run.start.displacement, self.system.laws
        strokes = np.maximum(
            _shares(run.errors.displacement_high, laws.high - rest),
            _shares(run.errors.displacement_low, rest - laws.low),
        )
        return self._values(run.errors, strokes)

    def _values(self, figures: RunFigures, strokes: FloatArray) -> FloatArray:
        parts = [
            figures.acceleration, figures.sway, *figures.sway_components.T, figures.tilt, strokes, figures.force,
            figures.mount_force, figures.reaction[:1],
        ]  # fmt: skip
        if self.case.settling > 0.0:
            parts += [
                figures.rms_acceleration.ravel(),
                3.0 * figures.rms_acceleration.max(axis=1, initial=0.0),
                figures.rms_sway.ravel(),
            ]
        return np.concatenate([*parts, figures.spectra])


def _shares(way: FloatArray, free: FloatArray) -> FloatArray:
    """Ways as shares of the free strokes; infinite where a spring moved that has no free stroke."""
    return np.divide(way, free, out=np.where(way > 0.0, np.inf, 0.0), where=free > 0.0)
