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
from ..one_mass.harmonic_balance import (
    ComplexArray,
    accelerations,
    displacement_limits,
    displacements,
    first_beyond,
    first_harmonics,
    stacked,
)  # fmt: skip
from ..one_mass.response import checked_band, isolation_frequency
from ..one_mass.system import Excitation
from .mounted import BASE, MountedSystem, Point
from .shaken_system import ShakenSystem
from .shaking import Shaking
from .small_motion import Pose

BoolArray = NDArray[np.bool_]

DIRECTIONS = ("x", "y", "z")
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
        peaks = []
        for p, point in enumerate(self.points):
            gains = np.abs(self.gain[:, p])
            for k, direction in enumerate(DIRECTIONS):
                peak = int(np.argmax(gains[:, k]))
                if not gains[peak, k] > _OF_LARGEST * gains.max():
                    continue
                isolates = self.gain_unit == "1" and gains[peak, k] > 1.0
                peaks.append(
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
        return tuple(peaks)

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
    shaken = ShakenSystem(system, pose, shaking, level, extrapolate)
    if not shaken.moves:
        raise MountedSystemError(
            f"A {shaking.name} moves nothing, because no body is free to follow it; give another direction."
        )
    motions = list(follow(shaken.balance, shaken.linear_motion, 2.0 * np.pi * band, advance))
    _check_ranges(shaken, motions)
    motions = _with_peaks(shaken, motions)
    _check_ranges(shaken, motions)
    return _response(shaken, motions)


def _with_peaks(shaken: ShakenSystem, motions: list[SteadyMotion]) -> list[SteadyMotion]:
    """The motions with more of them about the largest gain of each point in each direction."""
    peaks = np.abs(_gains(shaken, motions)).max(axis=0)
    refined: list[float] = []
    for p, k in np.argwhere(peaks >= _OF_LARGEST * peaks.max(axis=1, keepdims=True)).tolist():
        measure = partial(_gain, shaken, p, k)
        peak = motions[int(np.argmax(measure(motions)))].log
        if all(abs(peak - other) > _REFINED for other in refined):
            motions = refine_peak(shaken.balance, motions, measure)
            refined.append(motions[int(np.argmax(measure(motions)))].log)
    return motions


def _check_ranges(shaken: ShakenSystem, motions: Sequence[SteadyMotion]) -> None:
    """Refuse motions in which a spring leaves its identified range."""
    beyond = first_beyond(shaken.balance, motions)
    if beyond is None:
        return
    (motion, axis), laws = beyond, shaken.laws
    moves = (motion.motion.low, motion.motion.high, laws.low, laws.high)
    from_here, to_here, low, high = (f"{1e3 * of_axes[axis]:.4g}" for of_axes in moves)
    raise MountedSystemError(
        f"At {motion.omega / (2.0 * np.pi):.4g} Hz and a level of {shaken.balance.level_text} the springs of "
        f"{laws.names[axis]} move from {from_here} to {to_here} mm, outside their identified range of {low} to {high} "
        "mm; use a lower level, other mounts, or a model identified over a larger range."
    )


def _gains(shaken: ShakenSystem, motions: Sequence[SteadyMotion]) -> ComplexArray:
    """`SystemResponse.gain`."""
    moved, carried = _moved(shaken)
    omega, z = stacked(shaken.balance, motions)
    relative = np.einsum("pkd,fd->fpk", moved, first_harmonics(z))
    if shaken.shaking.kind is Excitation.FORCE:
        return np.asarray(relative / shaken.level)
    base = shaken.shaking.kind.base_amplitude(shaken.level, omega)
    return np.asarray(relative / base[:, None, None] + carried)


def _moved(shaken: ShakenSystem) -> tuple[FloatArray, FloatArray]:
    """Displacement of each point by the coordinates, shape (P, 3, D), and by a unit of the base's motion, (P, 3)."""
    motion, points = shaken.motion, all_points(shaken.system)
    moved = np.array([motion.point(point.body, point.place) for point in points])
    return moved, np.array([shaken.shaking.base_motion(motion, point.body, point.place) for point in points])


def _gain(shaken: ShakenSystem, point: int, direction: int, motions: list[SteadyMotion]) -> FloatArray:
    """The absolute gain of one point in one direction, shape (F,)."""
    return np.abs(_gains(shaken, motions)[:, point, direction])


def _response(shaken: ShakenSystem, motions: Sequence[SteadyMotion]) -> SystemResponse:
    balance, laws, axes = shaken.balance, shaken.laws, list(shaken.system.axes())
    omega, z = stacked(balance, motions)
    figures = np.array([motion.motion.figures for motion in motions])
    low, high = figures[:, :, 0], figures[:, :, 1]
    within_low, within_high = displacement_limits(laws.low, laws.high, extrapolate=False)
    # Of springs, stops and dampers on the base.
    rates = 1j * omega[:, None] * first_harmonics(z) @ shaken.motion.along.T
    forces = figures[:, :, 3] - 1j * figures[:, :, 4] + np.array([axis.damping for _, axis in axes]) * rates
    directions = np.array([axis.direction if mount.support == BASE else (0.0, 0.0, 0.0) for mount, axis in axes])
    base = -(omega**2) * shaken.shaking.kind.base_amplitude(shaken.level, omega)
    moved, carried = _moved(shaken)
    turned = shaken.motion.free.reshape(-1, 6, balance.degrees)[:, 3:]
    acceleration, sway, tilt = [], [], []
    courses = zip(base, accelerations(balance, motions), displacements(balance, motions), strict=True)
    for amplitude, of_acceleration, of_displacement in courses:
        of_base = carried[:, :, None] * amplitude * balance.basis.functions[1]
        acceleration.append(np.abs(np.einsum("pkd,dt->pkt", moved, of_acceleration) + of_base).max(axis=2))
        sway.append(np.linalg.norm(np.einsum("pkd,dt->pkt", moved, of_displacement), axis=1).max(axis=1))
        tilt.append(np.linalg.norm(np.einsum("bkd,dt->bkt", turned, of_displacement), axis=1).max(axis=1))
    return SystemResponse(
        shaking=shaken.shaking,
        level=shaken.level,
        points=all_points(shaken.system),
        axes=tuple(laws.names),
        frequency=omega / (2.0 * np.pi),
        gain=_gains(shaken, motions),
        base_force=np.asarray(forces @ directions),
        acceleration=np.array(acceleration),
        sway=np.array(sway),
        tilt=np.array(tilt),
        low=low,
        high=high,
        stable=np.array([motion.rising for motion in motions]),
        requested=np.array([motion.wanted for motion in motions]),
        extrapolating=np.any((low < within_low) | (high > within_high), axis=1),
    )
