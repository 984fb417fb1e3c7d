"""What a designer reads off the steady motions of a system: motion of each point in each direction, and resonances.

Motion is that of the first harmonic, in the directions x, y and z of the base's frame. The gain of a point is its
absolute motion over that of the base: the transmissibility [-], or m/rad where the base turns. Where a force excites it
is the point's motion over the force [m/N], and the transmissibility is the force on the base over the exciting one.
Motions between two folds of the curve are unstable; other losses of stability are not looked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from ...errors import MountedSystemError
from ...findings import Finding, Outcome
from ...ground.result_columns import ResultColumn, figure
from ...kernel.arrays import BoolArray, FloatArray
from ..one_mass.continuation import SteadyMotion, follow, refine_peak
from ..one_mass.harmonic_balance import (
    ComplexArray,
    accelerations,
    displacement_limits,
    displacements,
    first_beyond,
    first_harmonics,
    largest_of_period,
    rates,
    stacked,
)  # fmt: skip
from ..one_mass.options import Excitation
from ..one_mass.response import checked_band, curve_findings, isolation_frequency
from .mounted import MountedSystem
from .parts import BASE, Point
from .shaken_system import ShakenSystem
from .shaking import Shaking
from .small_motion import SmallMotion
from .time_check import MeasuredError, PeakFigures, TimeCheck

DIRECTIONS = ("x", "y", "z")
_CHECKED_TILT = math.radians(0.5)  # from which motions are compared with time integration
_LARGE_ERROR = 0.02  # of that comparison, from which there is a caution
_SLIDING = 1.0  # rho times half the stroke of a spring
_AT_ONCE = 16  # motions of which figures are computed together
_OF_LARGEST = 0.01  # gains of a smaller share of the largest are no resonance
# Of gains by their unit: heading, unit for people, and factor to it.
_GAINS = {"1": ("transmissibility", "", 1.0), "m/rad": ("", "mm/rad", 1e3), "m/N": ("", "mm/N", 1e3)}


@dataclass(frozen=True)
class PointResonance:
    """The largest gain of one point in one direction."""

    point: str = figure("", "point", "point")
    direction: str = figure("", "motion", "motion")  # "x", "y" or "z"
    frequency: float = figure("Hz", "resonance", "resonance", "Hz")
    gain: float = figure("", "")  # see `SystemResponse.gain_column`
    sway: float = figure(
        "m", "sway", "sway", "mm", 1e3
    )  # largest distance from the place at rest, relative to the base
    # From here on the gain stays below 1; NaN if it does nowhere, or is never above.
    isolation_frequency: float = figure("Hz", "isolation begins", "isolates from", "Hz")
    inside: bool = figure("", "inside the band")  # not at one of its ends


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
    errors : tuple of MeasuredError   Against time integration of the exact equations, of the motions with the largest
                                      acceleration and the largest tilt; empty where no body turns by half a degree.
    sliding : str                     A mount of which several axes slide at once; empty if of none.
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
    errors: tuple[MeasuredError, ...] = ()
    sliding: str = ""

    @property
    def level_text(self) -> str:
        """The level in the unit that people read."""
        return self.shaking.level_text(self.level)

    @property
    def excitation(self) -> str:
        """How people name it."""
        return self.shaking.name

    @property
    def where(self) -> str:
        """Which of the curves of a system it is."""
        return f"{self.excitation}, {self.level_text}"

    @property
    def gain_unit(self) -> str:
        """Unit of the gain."""
        if self.shaking.kind is Excitation.FORCE:
            return "m/N"
        return "1" if self.shaking.about is None else "m/rad"

    @property
    def gain_column(self) -> ResultColumn:
        """How the gain is presented."""
        short, shown, factor = _GAINS[self.gain_unit]
        return ResultColumn("gain", self.gain_unit, "motion over excitation", short, shown, factor)

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
    def findings(self) -> tuple[Finding, ...]:
        """What limits the worth of these motions."""
        found = []
        worst = max(self.errors, key=lambda error: error.largest, default=None)
        if worst is not None and worst.largest > _LARGE_ERROR:
            numbers = {"frequency": worst.frequency, "acceleration": worst.acceleration, "sway": worst.sway}
            kind = Outcome.SECOND_ORDER if math.isfinite(worst.largest) else Outcome.NO_EXACT_MOTION
            found.append(Finding(kind, {"tilt": float(self.tilt.max()), **numbers}))
        if self.sliding:
            found.append(Finding(Outcome.SLIDING_ALONE, {"mount": self.sliding}))
        return (*found, *curve_findings(self.frequency, self.stable, self.extrapolating))


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
    motion: SmallMotion,
    shaking: Shaking,
    level: float,
    frequencies: Sequence[float] | FloatArray,
    *,
    extrapolate: bool = False,
) -> SystemResponse:
    """Steady motions of a system over a band of frequencies, through folds if there are any.

    Parameters
    ----------
    motion : SmallMotion         About static equilibrium.
    shaking : Shaking
    level : float                In its unit, > 0.
    frequencies : array_like     Shape (F,), F >= 2, rising [Hz], > 0.
    extrapolate : bool           Go on where the motion leaves an identified range.

    Raises
    ------
    MountedSystemError           If the excitation moves nothing, or a motion leaves an identified range.
    IsolationError               If frequencies are out of bounds, or no steady motion is found.
    """
    band = checked_band(frequencies)
    if not (math.isfinite(level) and level > 0.0):
        raise MountedSystemError(f"`level` must be finite and > 0 [{shaking.unit}], got {level!r}.")
    shaken = ShakenSystem(motion, shaking, level, extrapolate)
    if not shaken.moves:
        raise MountedSystemError(
            f"A {shaking.name} moves nothing, because no body is free to follow it; give another direction."
        )
    motions = list(follow(shaken.balance, shaken.linear_motion, 2.0 * np.pi * band))
    _check_ranges(shaken, motions)
    moved = _MovedPoints(shaken)
    gains = _Gains(shaken, moved)
    motions = _with_peaks(shaken, gains, motions)
    _check_ranges(shaken, motions)
    response = _response(shaken, moved, gains, motions)
    errors = _measured_errors(shaken, response, motions)
    return replace(response, errors=errors, sliding=_sliding(motion.system, response))


def _sliding(system: MountedSystem, response: SystemResponse) -> str:
    """`SystemResponse.sliding`: where the second axis of a mount moves so far that its friction is near saturation."""
    rho = np.array([max(mechanism.rho for mechanism in axis.spring.mechanisms) for axis in system.axes])
    slips = 0.5 * rho * (response.high - response.low)
    across = {
        mount.name: float(np.sort(slips[:, axes], axis=1)[:, -2].max())
        for mount, axes in zip(system.mounts, system.axis_slices, strict=True)
        if len(mount.axes) > 1
    }
    name = max(across, key=lambda mount: across[mount], default="")
    return name if name and across[name] >= _SLIDING else ""


def _measured_errors(
    shaken: ShakenSystem, response: SystemResponse, motions: Sequence[SteadyMotion]
) -> tuple[MeasuredError, ...]:
    """`SystemResponse.errors`."""
    if response.tilt.max(initial=0.0) < _CHECKED_TILT or any(shaken.shaking.about or ()):
        return ()
    check = TimeCheck(shaken.motion, shaken.shaking, shaken.level, response.points)
    stable = response.stable[:, None]
    places = {
        int(np.argmax(np.where(stable, figures.reshape(len(motions), -1), 0.0).max(axis=1)))
        for figures in (response.acceleration, response.tilt)
    }
    return tuple(
        check.error(
            motions[k].omega,
            motions[k].z.reshape(shaken.balance.degrees, -1),
            motions[k].motion.figures[:, 2],
            PeakFigures(response.acceleration[k], response.sway[k], response.tilt[k]),
        )
        for k in sorted(places)
    )


def _with_peaks(shaken: ShakenSystem, gains: _Gains, motions: list[SteadyMotion]) -> list[SteadyMotion]:
    """The motions with more of them about the largest gain of each point in each direction."""
    peaks = np.abs(gains(motions)).max(axis=0)
    for p, k in np.argwhere(peaks >= _OF_LARGEST * peaks.max(axis=1, keepdims=True)).tolist():
        motions = refine_peak(shaken.balance, motions, partial(_gain, gains, p, k))
    return motions


def _gain(gains: _Gains, point: int, direction: int, motions: list[SteadyMotion]) -> FloatArray:
    """The absolute gain of one point in one direction, shape (F,)."""
    return np.abs(gains(motions)[:, point, direction])


def _check_ranges(shaken: ShakenSystem, motions: Sequence[SteadyMotion]) -> None:
    """Refuse motions in which a spring leaves its identified range."""
    beyond = first_beyond(shaken.balance, motions)
    if beyond is None:
        return
    (motion, axis), laws = beyond, shaken.system.laws
    moves = (motion.motion.low, motion.motion.high, laws.low, laws.high)
    from_here, to_here, low, high = (f"{1e3 * of_axes[axis]:.4g}" for of_axes in moves)
    raise MountedSystemError(
        f"At {motion.omega / (2.0 * np.pi):.4g} Hz and a level of {shaken.balance.level_text} the springs of "
        f"{laws.names[axis]} move from {from_here} to {to_here} mm, outside their identified range of {low} to {high} "
        "mm; use a lower level, other mounts, or a model identified over a larger range."
    )


class _Gains:
    """`SystemResponse.gain` of motions, each computed once.

    Parameters
    ----------
    shaken : ShakenSystem
    moved : _MovedPoints
    """

    def __init__(self, shaken: ShakenSystem, moved: _MovedPoints) -> None:
        self._shaken, self._moved = shaken, moved
        self._known: dict[SteadyMotion, ComplexArray] = {}

    def __call__(self, motions: Sequence[SteadyMotion]) -> ComplexArray:
        """Shape (F, P, 3)."""
        unknown = [motion for motion in motions if motion not in self._known]
        if unknown:
            self._known.update(zip(unknown, self._computed(unknown), strict=True))
        return np.array([self._known[motion] for motion in motions])

    def _computed(self, motions: Sequence[SteadyMotion]) -> ComplexArray:
        shaken, moved = self._shaken, self._moved
        omega, z = stacked(shaken.balance, motions)
        q = displacements(shaken.balance, motions)
        wave = shaken.balance.basis.functions[1] - 1j * shaken.balance.basis.functions[1 + z.shape[2] // 2]
        squares = (q * (wave * 2.0 / wave.size)) @ q.swapaxes(1, 2)
        relative = np.einsum("pkd,fd->fpk", moved.along, first_harmonics(z))
        relative = relative + 0.5 * np.tensordot(squares, moved.bend, ([1, 2], [2, 3]))
        if shaken.shaking.kind is Excitation.FORCE:
            return np.asarray(relative / shaken.level)
        base = shaken.shaking.kind.base_amplitude(shaken.level, omega)
        return np.asarray(relative / base[:, None, None] + moved.carried)


class _MovedPoints:
    """Motion of the points by the coordinates, to second order.

    Parameters
    ----------
    shaken : ShakenSystem

    Attributes
    ----------
    points : tuple of Point
    along : ndarray, shape (P, 3, D)     First derivatives of the displacement.
    bend : ndarray, shape (P, 3, D, D)   Second derivatives [1/m].
    carried : ndarray, shape (P, 3)      Displacement by a unit of the base's motion.
    """

    def __init__(self, shaken: ShakenSystem) -> None:
        motion, self.points = shaken.motion, all_points(shaken.system)
        self.along = np.array([motion.point(point.body, point.place) for point in self.points])
        self.bend = np.array([motion.point_bend(point.body, point.place) for point in self.points])
        self.carried = np.array([shaken.shaking.base_motion(motion, point.body, point.place) for point in self.points])

    def course(self, q: FloatArray, rates: FloatArray, accelerations: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Displacement and acceleration relative to the base, shape (P, 3, F, K), of courses of shape (D, F, K)."""
        second = q[:, None] * accelerations + rates[:, None] * rates
        return self._moved(q, 0.5 * q[:, None] * q), self._moved(accelerations, second)

    def _moved(self, first: FloatArray, second: FloatArray) -> FloatArray:
        """The sum of both derivatives times courses of shapes (D, F, K) and (D, D, F, K), shape (P, 3, F, K)."""
        return np.tensordot(self.along, first, 1) + np.tensordot(self.bend, second, 2)


def _response(
    shaken: ShakenSystem, moved: _MovedPoints, gains: _Gains, motions: Sequence[SteadyMotion]
) -> SystemResponse:
    balance, system, laws = shaken.balance, shaken.system, shaken.system.laws
    omega, _ = stacked(balance, motions)
    figures = np.array([motion.motion.figures for motion in motions])
    low, high = figures[:, :, 0], figures[:, :, 1]
    within_low, within_high = displacement_limits(laws.low, laws.high, extrapolate=False)
    on_base = np.array([mount.support == BASE for mount in system.axis_mounts])
    directions = np.where(on_base[:, None], [axis.direction for axis in system.axes], 0.0)
    base = -(omega**2) * shaken.shaking.kind.base_amplitude(shaken.level, omega)
    courses = [series.swapaxes(0, 1) for series in (f(balance, motions) for f in (displacements, rates, accelerations))]
    acceleration, sway = np.empty((len(motions), len(moved.points), 3)), np.empty((len(motions), len(moved.points)))
    for begin in range(0, len(motions), _AT_ONCE):
        part = slice(begin, begin + _AT_ONCE)
        of_displacement, of_acceleration = moved.course(*(course[:, part] for course in courses))
        of_base = np.multiply.outer(moved.carried, np.outer(base[part], balance.basis.functions[1]))
        acceleration[part] = np.moveaxis(largest_of_period(np.abs(of_acceleration + of_base)), 2, 0)
        sway[part] = largest_of_period(np.linalg.norm(of_displacement, axis=1)).T
    turned = shaken.motion.rotations(courses[0])
    return SystemResponse(
        shaking=shaken.shaking,
        level=shaken.level,
        points=moved.points,
        axes=tuple(laws.names),
        frequency=omega / (2.0 * np.pi),
        gain=gains(motions),
        base_force=np.asarray((figures[:, :, 3] - 1j * figures[:, :, 4]) @ directions),
        acceleration=acceleration,
        sway=sway,
        tilt=largest_of_period(np.linalg.norm(turned, axis=1)).T,
        low=low,
        high=high,
        stable=np.array([motion.rising for motion in motions]),
        requested=np.array([motion.wanted for motion in motions]),
        extrapolating=np.any((low < within_low) | (high > within_high), axis=1),
    )
