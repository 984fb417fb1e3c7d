"""What a designer reads off the steady motions of a system: motion of each point in each direction, and resonances.

Motion is that of the first harmonic, in the directions x, y and z of the base's frame. The gain of a point is its
absolute motion over that of the base: the transmissibility [-], or m/rad where the base turns. Where a force excites it
is the point's motion over the force [m/N], and the transmissibility is the force on the base over the exciting one.
Motions between two folds of the curve are unstable; other losses of stability are not looked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray
from ..one_mass.continuation import SteadyMotion, follow, refine_peak
from ..one_mass.response import checked_band, isolation_frequency
from ..one_mass.system import Excitation
from .axis_laws import ComplexArray
from .mounted import BASE, MountedSystem, Point
from .shaking import Shaking
from .six_balance import AxisRanges, SixBalance
from .small_motion import Pose

BoolArray = NDArray[np.bool_]

DIRECTIONS = ("x", "y", "z")
_SLACK = 2e-6  # of half the identified range: motion so little beyond its ends counts as inside
_REFINED = 2e-3  # of ln(frequency): another peak so near is the same
_LARGE_TILT = math.radians(5.0)  # sines of half of it and more are no longer small
_OF_LARGEST = 0.01  # gains of a smaller share of the largest are no resonance


@dataclass(frozen=True)
class PointResonance:
    """The largest gain of one point in one direction.

    Attributes
    ----------
    point : str
    direction : str                 "x", "y" or "z".
    frequency : float               [Hz].
    gain : float                    See `SystemResponse`.
    sway : float                    Largest distance of the point from its place at rest, relative to the base [m].
    isolation_frequency : float     From here on the gain stays below 1 [Hz]; NaN if it does nowhere, or is never above.
    inside : bool                   Whether it lies inside the band, not at one of its ends.
    """

    point: str
    direction: str
    frequency: float
    gain: float
    sway: float
    isolation_frequency: float
    inside: bool


@dataclass(frozen=True, eq=False)
class SystemResponse:
    """Steady motions of a system under one level of an excitation, in the order of the curve.

    F is the number of motions, P that of the points, M that of the mounts' axes, B that of the bodies.

    Attributes
    ----------
    shaking : Shaking
    level : float
    points : tuple of Point
    axes : tuple of str                          Names of the mounts' axes.
    frequency : ndarray, shape (F,)              [Hz]
    gain : ndarray, shape (F, P, 3)              Complex; see the module.
    base_force : ndarray, shape (F, 3)           Complex first harmonic of the mounts' force on the base [N].
    acceleration : ndarray, shape (F, P, 3)      Largest absolute acceleration, all harmonics [m/s^2].
    sway : ndarray, shape (F, P)                 Largest distance from the place at rest, relative to the base [m].
    tilt : ndarray, shape (F, B)                 Largest rotation of a body from rest, relative to the base [rad].
    low, high : ndarray, shape (F, M)            Displacement of one spring [m].
    stable, requested, extrapolating : ndarray, shape (F,)   As in `isolation.curve_points.ResponsePoint`.
    """

    shaking: Shaking
    level: float
    points: tuple[Point, ...]
    axes: tuple[str, ...]
    frequency: FloatArray
    gain: ComplexArray
    base_force: ComplexArray
    acceleration: FloatArray
    sway: FloatArray
    tilt: FloatArray
    low: FloatArray
    high: FloatArray
    stable: BoolArray
    requested: BoolArray
    extrapolating: BoolArray

    @property
    def level_text(self) -> str:
        """The level in the unit that people read."""
        return self.shaking.level_text(self.level)

    @property
    def gain_unit(self) -> str:
        """Unit of the gain."""
        if self.shaking.kind is Excitation.FORCE:
            return "m/N"
        return "1" if self.shaking.about is None else "m/rad"

    @cached_property
    def resonances(self) -> tuple[PointResonance, ...]:
        """The largest gain of each point in each direction in which it moves by 1 % of what it moves most or more."""
        found = []
        for p, point in enumerate(self.points):
            gains = np.abs(self.gain[:, p])
            for k, direction in enumerate(DIRECTIONS):
                peak = int(np.argmax(gains[:, k]))
                if not gains[peak, k] > _OF_LARGEST * gains.max():
                    continue
                isolates = self.gain_unit == "1" and gains[peak, k] > 1.0
                found.append(
                    PointResonance(
                        point=point.name,
                        direction=direction,
                        frequency=float(self.frequency[peak]),
                        gain=float(gains[peak, k]),
                        sway=float(self.sway[peak, p]),
                        isolation_frequency=isolation_frequency(self.frequency, gains[:, k]) if isolates else math.nan,
                        inside=0 < peak < len(gains) - 1,
                    )
                )
        return tuple(found)

    @property
    def cautions(self) -> list[str]:
        """What limits the worth of these motions, one sentence each."""
        sentences = []
        unstable = int(np.sum(~self.stable))
        if unstable:
            sentences.append(
                f"The curve folds: {unstable} motions between folds are unstable, and the motion jumps there."
            )
        largest = float(self.tilt.max())
        if largest > _LARGE_TILT:
            sentences.append(
                f"A body turns by up to {math.degrees(largest):.3g} degrees; rotations are taken as small here, so "
                "simulate this level in time."
            )
        if self.extrapolating.any():
            outside = self.frequency[self.extrapolating]
            sentences.append(
                f"At {outside.size} of {self.frequency.size} frequencies, from {outside.min():.4g} to "
                f"{outside.max():.4g} Hz, springs move outside their identified range; the model is extrapolated there."
            )
        return sentences


def all_points(system: MountedSystem) -> tuple[Point, ...]:
    """The points of a system, after the centres of gravity that are none of them, each by the name of its body."""
    names = {point.name for point in system.points}
    places = {(point.body, point.place) for point in system.points}
    centers = (
        Point(body.name if body.name not in names else f"{body.name}, centre of gravity", k, body.center)
        for k, body in enumerate(system.bodies)
        if (k, body.center) not in places
    )
    return (*centers, *system.points)


def system_response(
    system: MountedSystem,
    pose: Pose,
    shaking: Shaking,
    level: float,
    frequencies: Sequence[float] | FloatArray,
    *,
    omega: FloatArray | None = None,
    extrapolate: bool = False,
    advance: Callable[[float], None] = lambda _: None,
) -> SystemResponse:
    """Steady motions of a system over a band of frequencies, through folds if there are any.

    Parameters
    ----------
    system : MountedSystem
    pose : Pose                  Of static equilibrium.
    shaking : Shaking
    level : float                In its unit, > 0.
    frequencies : array_like     Shape (F,), F >= 2, rising [Hz], > 0.
    omega : ndarray or None      Of the springs at rest, shape (M,) [-]; by default 0.
    extrapolate : bool           Go on where the motion leaves an identified range.
    advance : callable           Is called with the number of frequencies done.

    Raises
    ------
    MountedSystemError           If the excitation moves nothing, or a motion leaves an identified range.
    IsolationError               If frequencies are out of bounds, or no steady motion is found.
    """
    band = checked_band(frequencies)
    if not (math.isfinite(level) and level > 0.0):
        raise MountedSystemError(f"`level` must be finite and > 0 [{shaking.unit}], got {level!r}.")
    balance = SixBalance(system, pose, shaking, level, omega)
    if not np.abs(balance.forcing(2.0 * np.pi * float(band[0]))).max() > 0.0:
        raise MountedSystemError(
            f"A {shaking.name} moves nothing, because no body is free to follow it; give another direction."
        )
    limits = (-math.inf, math.inf) if extrapolate else (-1.0 - _SLACK, 1.0 + _SLACK)
    motions: list[SteadyMotion[AxisRanges]] = []
    for motion in follow(balance, balance.linear_motion, 2.0 * np.pi * band, limits, advance):
        _check_ranges(balance, motion, limits)
        motions.append(motion)
    motions = _with_peaks(balance, motions)
    for motion in motions:
        _check_ranges(balance, motion, limits)
    return _response(balance, motions)


def _with_peaks(balance: SixBalance, motions: list[SteadyMotion[AxisRanges]]) -> list[SteadyMotion[AxisRanges]]:
    """The motions with more of them about the largest gain of each point in each direction."""
    peaks = np.abs(_gains(balance, motions)).max(axis=0)
    refined: list[float] = []
    for p, k in np.argwhere(peaks >= _OF_LARGEST * peaks.max(axis=1, keepdims=True)).tolist():
        measure = partial(_gain, balance, p, k)
        peak = motions[int(np.argmax(measure(motions)))].log
        if all(abs(peak - other) > _REFINED for other in refined):
            motions = refine_peak(balance, motions, measure)
            refined.append(motions[int(np.argmax(measure(motions)))].log)
    return motions


def _check_ranges(balance: SixBalance, motion: SteadyMotion[AxisRanges], limits: tuple[float, float]) -> None:
    """Refuse a motion in which a spring leaves its identified range."""
    beyond = balance.reach(motion.summary)
    if beyond.max() <= limits[1]:
        return
    worst, laws = int(np.argmax(beyond)), balance.laws
    moves = (motion.summary.low, motion.summary.high, laws.low, laws.high)
    from_here, to_here, low, high = (f"{1e3 * of_axes[worst]:.4g}" for of_axes in moves)
    raise MountedSystemError(
        f"At {motion.omega / (2.0 * np.pi):.4g} Hz and a level of {balance.level_text} the springs of "
        f"{laws.names[worst]} move from {from_here} to {to_here} mm, outside their identified range of {low} to {high} "
        "mm; use a lower level, other mounts, or a model identified over a larger range."
    )


def _first_harmonics(balance: SixBalance, motions: Sequence[SteadyMotion[AxisRanges]]) -> ComplexArray:
    """Of the coordinates, shape (F, D) [m]."""
    z = np.array([motion.z for motion in motions]).reshape(len(motions), -1, balance.degrees)
    return np.asarray(z[:, 1] - 1j * z[:, 1 + balance.basis.harmonics])


def _gains(balance: SixBalance, motions: Sequence[SteadyMotion[AxisRanges]]) -> ComplexArray:
    """`SystemResponse.gain`."""
    shaking, points = balance.shaking, all_points(balance.system)
    moved = np.array([balance.motion.point(point.body, point.place) for point in points])
    carried = np.array([shaking.base_motion(balance.motion, point.body, point.place) for point in points])
    relative = np.einsum("pkd,fd->fpk", moved, _first_harmonics(balance, motions))
    if shaking.kind is Excitation.FORCE:
        return np.asarray(relative / balance.level)
    base = shaking.base_amplitude(balance.level, np.exp([motion.log for motion in motions]))
    return np.asarray(relative / base[:, None, None] + carried)


def _gain(balance: SixBalance, point: int, direction: int, motions: list[SteadyMotion[AxisRanges]]) -> FloatArray:
    """The absolute gain of one point in one direction, shape (F,)."""
    return np.abs(_gains(balance, motions)[:, point, direction])


def _base_forces(balance: SixBalance, motions: Sequence[SteadyMotion[AxisRanges]]) -> ComplexArray:
    """`SystemResponse.base_force`, of springs, stops and dampers on the base."""
    axes = list(balance.system.axes())
    directions = np.array([axis.direction if mount.support == BASE else (0.0, 0.0, 0.0) for mount, axis in axes])
    dampers = np.array([axis.damping for _, axis in axes])
    omega = np.exp([motion.log for motion in motions])
    springs = np.array([balance.first_forces(motion.z) for motion in motions])
    rates = 1j * omega[:, None] * _first_harmonics(balance, motions) @ balance.motion.along.T
    return np.asarray((springs + dampers * rates) @ directions)


def _response(balance: SixBalance, motions: Sequence[SteadyMotion[AxisRanges]]) -> SystemResponse:
    points, degrees = all_points(balance.system), balance.degrees
    courses = [balance.course(motion.z, motion.omega) for motion in motions]
    low, high = (np.array([getattr(motion.summary, name) for motion in motions]) for name in ("low", "high"))
    moved = np.array([balance.motion.point(point.body, point.place) for point in points])
    carried = np.array([balance.shaking.base_motion(balance.motion, one.body, one.place) for one in points])
    turned = balance.motion.free.reshape(-1, 6, degrees)[:, 3:]
    acceleration, sway, tilt = [], [], []
    for course in courses:
        absolute = np.einsum("pkd,dt->pkt", moved, course.acceleration) + carried[:, :, None] * course.base_acceleration
        acceleration.append(np.abs(absolute).max(axis=2))
        sway.append(np.linalg.norm(np.einsum("pkd,dt->pkt", moved, course.displacement), axis=1).max(axis=1))
        tilt.append(np.linalg.norm(np.einsum("bkd,dt->bkt", turned, course.displacement), axis=1).max(axis=1))
    return SystemResponse(
        shaking=balance.shaking,
        level=balance.level,
        points=points,
        axes=tuple(balance.laws.names),
        frequency=np.exp([motion.log for motion in motions]) / (2.0 * np.pi),
        gain=_gains(balance, motions),
        base_force=_base_forces(balance, motions),
        acceleration=np.array(acceleration),
        sway=np.array(sway),
        tilt=np.array(tilt),
        low=low,
        high=high,
        stable=np.array([motion.rising for motion in motions]),
        requested=np.array([motion.wanted for motion in motions]),
        extrapolating=np.array([balance.reach(motion.summary).max() > 1.0 + _SLACK for motion in motions]),
    )
