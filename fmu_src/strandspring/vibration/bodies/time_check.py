"""Steady motions against the exact equations: integrated in time, with finite rotations, until periodic.

A motion of the harmonic balance gives displacement, velocity and hysteresis at phase 0; from there the time integration
of `simulate` runs until one period is like the one before. Its samples are those of the balance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...kernel.arrays import FloatArray
from ...kernel.motion import Histories
from ..one_mass.harmonic_balance import SAMPLES
from ..one_mass.options import Excitation
from .loads import ChannelKind, LoadChannel, channel_rows
from .mounted import MountedSystem
from .parts import Point
from .shaking import Shaking
from .small_motion import SmallMotion

MOST_PERIODS = 400
_PERIODIC = 2e-4  # of the largest acceleration: change from one period to the next, and all that are to come
_NOTHING = 1e-6  # such a change is that of rounding
_STEPS = 2  # per sample of a period, at least
_OF_STABLE = 0.1  # of the largest stable step
_SMALL = 0.1  # of the largest of its kind: a smaller figure errs by a share of this


@dataclass(frozen=True)
class _Cosine:
    """amplitude*cos(omega*t + phase)."""

    amplitude: float
    omega: float
    phase: float = 0.0

    @property
    def shortest(self) -> float:
        return math.inf

    def averages(self, step: float, count: int) -> FloatArray:
        angle = self.omega * step * np.arange(count + 1) + self.phase
        return np.asarray(self.amplitude * np.diff(np.sin(angle)) / (self.omega * step))


@dataclass(frozen=True, eq=False)
class PeakFigures:
    """The largest values over a period, of P points and B bodies.

    Attributes
    ----------
    acceleration : ndarray, shape (P, 3)   [m/s^2]
    sway : ndarray, shape (P,)             [m]
    tilt : ndarray, shape (B,)             [rad]
    """

    acceleration: FloatArray
    sway: FloatArray
    tilt: FloatArray


@dataclass(frozen=True)
class MeasuredError:
    """Difference of a steady motion from time integration at one frequency.

    Each is the largest relative difference, of a figure or of a tenth of the largest of its kind if that is more.

    Attributes
    ----------
    frequency : float                   [Hz].
    acceleration, sway, tilt : float    [-]; infinite where the integrated motion does not become periodic.
    """

    frequency: float
    acceleration: float
    sway: float
    tilt: float

    @property
    def largest(self) -> float:
        """Of all figures [-]."""
        return max(self.acceleration, self.sway, self.tilt)


class TimeCheck:
    """Time integration of a system under one level of an excitation.

    Parameters
    ----------
    motion : SmallMotion          About static equilibrium.
    shaking : Shaking             Not about an axis beside the origin.
    level : float
    points : sequence of Point    Whose motion is compared.
    """

    def __init__(self, motion: SmallMotion, shaking: Shaking, level: float, points: tuple[Point, ...]) -> None:
        self._motion, self._shaking, self._level, self._points = motion, shaking, level, points
        self._stable = motion.stable_step()

    def error(self, omega: float, z: FloatArray, hysteresis: FloatArray, found: PeakFigures) -> MeasuredError:
        """The error of a steady motion.

        Parameters
        ----------
        omega : float                      Omega [rad/s].
        z : ndarray, shape (D, N)          Coefficients of the coordinates [m].
        hysteresis : ndarray, shape (M,)   omega of the springs at phase 0.
        found : PeakFigures                Of the motion.
        """
        exact = self.figures(omega, z, hysteresis)
        errors = [math.inf] * 3 if exact is None else [
            _largest_error(getattr(found, name), getattr(exact, name)) for name in ("acceleration", "sway", "tilt")
        ]  # fmt: skip
        return MeasuredError(omega / (2.0 * math.pi), *errors)

    def figures(self, omega: float, z: FloatArray, hysteresis: FloatArray) -> PeakFigures | None:
        """Those of the periodic motion that a steady motion becomes; None if it becomes none. See `error`."""
        harmonics = z.shape[1] // 2
        orders, cosines = np.arange(1, harmonics + 1), z[:, 1 : harmonics + 1]
        pose, momenta = self._motion.state(z[:, 0] + cosines.sum(axis=1), omega * z[:, harmonics + 1 :] @ orders)
        period = 2.0 * math.pi / omega
        steps = max(_STEPS, math.ceil(period / SAMPLES / (_OF_STABLE * self._stable)))
        count = SAMPLES * steps
        channel = self._channel(omega)
        system = self._motion.system
        probed = MountedSystem(system.bodies, system.mounts, self._probes, system.gravity)
        periods = probed.solver.repeated(
            channel_rows([channel], system.bodies), channel.signal.averages(period / count, count)[None],
            period / count, np.array(system.gravity), pose, hysteresis, momenta, steps,
        )  # fmt: skip
        before, last = None, math.inf
        for _, histories in zip(range(MOST_PERIODS), periods, strict=False):
            acceleration = histories.acceleration
            if len(acceleration) <= SAMPLES:
                return None
            if before is not None:
                largest = np.abs(acceleration).max()
                change = float(np.abs(acceleration - before).max())
                # What is left if changes go on to fall by the factor of the last two.
                left = change**2 / (last - change) if change < last else math.inf
                if change <= _NOTHING * largest or (change <= _PERIODIC * largest and left <= _PERIODIC * largest):
                    return self._peaks(histories)
                last = change
            before = acceleration
        return None

    def _channel(self, omega: float) -> LoadChannel:
        shaking = self._shaking
        if shaking.kind is Excitation.FORCE:
            force = _Cosine(self._level, omega)
            return LoadChannel(ChannelKind.FORCE, force, shaking.direction, shaking.body, shaking.place)
        base = float(shaking.kind.base_amplitude(self._level, np.array(omega)))
        if shaking.about is None:
            return LoadChannel(ChannelKind.BASE_ACCELERATION, _Cosine(-(omega**2) * base, omega), shaking.direction)
        # -sin, the rate of a cosine.
        rate = _Cosine(omega * base, omega, 0.5 * math.pi)
        return LoadChannel(ChannelKind.BASE_ANGULAR_VELOCITY, rate, shaking.direction)

    def _peaks(self, histories: Histories) -> PeakFigures:
        """Of the points, whose motion is that of the probes of their bodies, weighted by their coordinates."""
        system, count = self._motion.system, len(self._motion.system.bodies)
        probes = (histories.acceleration.reshape(-1, count, 4, 3), histories.sway.reshape(-1, count, 4, 3))
        at_rest = np.array([[self._motion.place(p.body, p.place) - p.place for p in self._probes]]).reshape(count, 4, 3)
        moved = probes[1] - at_rest
        arms = np.array([np.subtract(p.place, system.bodies[p.body].center) for p in self._points])
        weights = np.hstack([1.0 - arms.sum(axis=1, keepdims=True), arms])
        bodies = [point.body for point in self._points]
        acceleration, sway = (np.einsum("pi,tpik->tpk", weights, of[:, bodies]) for of in (probes[0], moved))
        # The chord of a rotation by an angle is 2*sqrt(2)*sin(angle/2), in the norm of the matrices' difference.
        chord = np.linalg.norm(moved[:, :, 1:] - moved[:, :, :1], axis=(2, 3)) / math.sqrt(8.0)
        return PeakFigures(
            np.abs(acceleration).max(axis=0),
            np.linalg.norm(sway, axis=2).max(axis=0),
            2.0 * np.arcsin(np.minimum(chord, 1.0)).max(axis=0),
        )

    @cached_property
    def _probes(self) -> tuple[Point, ...]:
        """Of each body its centre of gravity and the ends of its three axes of 1 m."""
        return tuple(
            Point("", k, tuple(np.add(body.center, end).tolist()))
            for k, body in enumerate(self._motion.system.bodies)
            for end in (np.zeros(3), *np.eye(3))
        )


def _largest_error(found: FloatArray, exact: FloatArray) -> float:
    sizes = np.maximum(exact, _SMALL * exact.max())
    return float((np.abs(found - exact) / np.where(sizes > 0.0, sizes, 1.0)).max())
