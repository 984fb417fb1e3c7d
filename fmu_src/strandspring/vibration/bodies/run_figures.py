"""Figures and energies of a run, named, and the limits to which they are held."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np

from ...kernel.arrays import FloatArray
from ...kernel.motion import MotionFigures


@dataclass(frozen=True, eq=False)
class RunFigures:
    """Extremes and means of a run; as errors, the standard of each [same unit].

    Attributes
    ----------
    acceleration : ndarray, shape (P,)              Largest absolute acceleration of each point [m/s^2].
    acceleration_time : ndarray, shape (P,)         When [s].
    acceleration_components : ndarray, shape (P, 3) Largest magnitude of each component [m/s^2].
    sway : ndarray, shape (P,)                      Largest distance from rest, relative to the base [m].
    sway_components : ndarray, shape (P, 3)         Largest magnitude of each component [m].
    rms_acceleration, rms_sway : ndarray, shape (P, 3)   From the settling on; of the sway about its mean [m/s^2], [m].
    tilt : ndarray, shape (B,)                      Largest angle of each body from rest [rad].
    displacement_low, displacement_high : ndarray, shape (A,)   Of one spring of each axis [m].
    force : ndarray, shape (A,)                     Largest magnitude of the axis' force, damper and stops included [N].
    mount_force : ndarray, shape (M,)               Largest magnitude of each mount's force, its axes together [N].
    reaction : ndarray, shape (4,)                  Of the force of all mounts on the base, weight included but not what
                                                    guides of bodies that are held take: largest magnitude, and largest
                                                    magnitude of each component [N].
    rate : ndarray, shape (A,)                      Largest speed of the axis [m/s].
    omega_low, omega_high : ndarray, shape (A,)     [-].
    absorbed : ndarray, shape (A,)                  By all springs of the axis [J].
    spectra : ndarray, shape (S,)                   Largest share of each allowed shock response spectrum that the
                                                    accelerations along x, y and z take, over all frequencies.
    """

    acceleration: FloatArray
    acceleration_time: FloatArray
    acceleration_components: FloatArray
    sway: FloatArray
    sway_components: FloatArray
    rms_acceleration: FloatArray
    rms_sway: FloatArray
    tilt: FloatArray
    displacement_low: FloatArray
    displacement_high: FloatArray
    force: FloatArray
    mount_force: FloatArray
    reaction: FloatArray
    rate: FloatArray
    omega_low: FloatArray
    omega_high: FloatArray
    absorbed: FloatArray
    spectra: FloatArray

    @classmethod
    def from_motion_figures(cls, figures: MotionFigures, spectra: Sequence[float] = ()) -> RunFigures:
        """From what the kernel gives, in its order."""
        points, axes = figures.of_points, figures.of_axes
        return cls(
            acceleration=points[:, 0],
            acceleration_time=points[:, 1],
            acceleration_components=points[:, 2:5],
            sway=points[:, 5],
            sway_components=points[:, 6:9],
            rms_acceleration=np.sqrt(points[:, 9:12]),
            rms_sway=_deviation(points[:, 12:15], points[:, 15:18]),
            tilt=figures.of_bodies[:, 0],
            displacement_low=axes[:, 0],
            displacement_high=axes[:, 1],
            force=axes[:, 2],
            mount_force=figures.of_mounts,
            reaction=figures.of_base,
            rate=axes[:, 7],
            omega_low=axes[:, 3],
            omega_high=axes[:, 4],
            absorbed=axes[:, 5],
            spectra=np.array(spectra),
        )

    def combined(self, other: RunFigures, how: Callable[[FloatArray, FloatArray], FloatArray]) -> RunFigures:
        """Each figure of this and of another, combined."""
        names = (part.name for part in fields(self))
        return RunFigures(**{name: how(getattr(self, name), getattr(other, name)) for name in names})


def _deviation(mean: FloatArray, square: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.maximum(square - mean**2, 0.0)))


@dataclass(frozen=True)
class Energies:
    """Energy balance of a run [J].

    Attributes
    ----------
    kinetic_before, kinetic_after : float   Relative to the base's origin.
    absorbed : float                        By the springs, stored energy included.
    damped : float                          By viscous dampers.
    stops : float                           Stored in bump stops.
    gravity_work, base_work, load_work : float   Done by weight, base motion and forces from outside.
    exchanged : float                       Sum of the magnitudes of the latter two, and the kinetic energy before.
    """

    kinetic_before: float
    kinetic_after: float
    absorbed: float
    damped: float
    stops: float
    gravity_work: float
    base_work: float
    load_work: float
    exchanged: float

    @classmethod
    def from_motion_figures(cls, figures: MotionFigures) -> Energies:
        """From what the kernel gives, in its order."""
        before, after, absorbed, damped, stops, gravity, base, load, exchanged = figures.energies.tolist()
        return cls(before, after, absorbed, damped, stops, gravity, base, load, exchanged + before)

    @property
    def residual(self) -> float:
        """What the integration has generated [J]."""
        gained = self.kinetic_after - self.kinetic_before + self.absorbed + self.damped + self.stops
        return gained - self.gravity_work - self.base_work - self.load_work

    @property
    def relative_residual(self) -> float:
        """Its magnitude over what was exchanged; 0 if nothing was."""
        return abs(self.residual) / self.exchanged if self.exchanged > 0.0 else 0.0
