"""The figures of a load case: which there are, and their values in one run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...kernel.arrays import FloatArray
from ..bodies.axis_laws import AxisLaws
from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.run_figures import RunFigures
from ..bodies.simulation import CaseRun, CheckedRun
from ..signals.shock_spectra import RequiredSpectrum
from .courses import SHOCKS
from .draws import DrawnRun
from .range_use import RangeUse, stroke_errors
from .spectrum_shares import spectrum_shares
from .verdicts import FigureKind

_SWAYS = (FigureKind.SWAY_X, FigureKind.SWAY_Y, FigureKind.SWAY_Z)


@dataclass(frozen=True)
class CaseFigures:
    """The figures of a load case in their order, N in number.

    Attributes
    ----------
    subjects : tuple     Kind and subject of each.
    spectra : mapping    Allowed shock response spectra by point, of a case that is a shock.
    laws : AxisLaws      Of the system.
    settles : bool       Whether there are root mean squares.
    """

    subjects: tuple[tuple[FigureKind, str], ...]
    laws: AxisLaws
    settles: bool
    spectra: Mapping[str, RequiredSpectrum] = field(default_factory=dict)

    @classmethod
    def from_case(
        cls, system: MountedSystem, case: LoadCase, spectra: Mapping[str, RequiredSpectrum] | None = None
    ) -> CaseFigures:
        """Of a system in a load case, with allowed shock response spectra by point."""
        points, axes = [point.name for point in system.points], system.axis_names
        along = [f"{point} {letter}" for point in points for letter in "xyz"]
        names: dict[FigureKind, Sequence[str]] = {
            FigureKind.ACCELERATION: points,
            FigureKind.SWAY: points,
            **dict.fromkeys(_SWAYS, points),
            FigureKind.TILT: [body.name for body in system.bodies],
            FigureKind.STROKE: axes,
            FigureKind.FORCE: axes,
            FigureKind.MOUNT_FORCE: [mount.name for mount in system.mounts],
            FigureKind.REACTION: ["base"],
        }
        if case.settling > 0.0:
            names |= {
                FigureKind.RMS_ACCELERATION: along,
                FigureKind.THREE_SIGMA: points,
                FigureKind.RMS_SWAY: along,
            }
        allowed = (spectra or {}) if case.kind in SHOCKS else {}
        if allowed:
            names[FigureKind.SRS] = tuple(allowed)
        subjects = tuple((kind, subject) for kind, subjects in names.items() for subject in subjects)
        return cls(subjects, system.laws, case.settling > 0.0, allowed)

    def of_run(self, run: CaseRun) -> FloatArray:
        """Values in a run, shape (N,), but for those of kind SRS."""
        return self._values(run.figures, RangeUse.from_run(self.laws, run).share)

    def of_draw(self, draw: DrawnRun) -> FloatArray:
        """Values in a draw, shape (N,)."""
        shares = spectrum_shares(self.spectra, draw.system, draw.case, draw.run)
        return np.concatenate([self.of_run(draw.run), shares])

    def errors(self, system: MountedSystem, case: LoadCase, run: CheckedRun) -> FloatArray:
        """Numerical errors of the values in a run, shape (N,): of kind SRS the change with twice the step."""
        fine, coarse = (spectrum_shares(self.spectra, system, case, run, factor) for factor in (1.0, 2.0))
        return np.concatenate(
            [self._values(run.errors, stroke_errors(self.laws, run, run.errors)), np.abs(fine - coarse)]
        )

    def _values(self, figures: RunFigures, strokes: FloatArray) -> FloatArray:
        parts = [
            figures.acceleration, figures.sway, *figures.sway_components.T, figures.tilt, strokes, figures.force,
            figures.mount_force, figures.reaction[:1],
        ]  # fmt: skip
        if self.settles:
            parts += [
                figures.rms_acceleration.ravel(),
                3.0 * figures.rms_acceleration.max(axis=1, initial=0.0),
                figures.rms_sway.ravel(),
            ]
        return np.concatenate(parts)
