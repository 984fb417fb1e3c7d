"""Sizes of a system that are possible but hardly meant: of places, masses and moments of inertia in another unit."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...ground.gravity import STANDARD_GRAVITY
from ...kernel.arrays import FloatArray
from ..bodies.mounted import MountedSystem
from ..bodies.parts import BASE, MotionKind, RigidBody
from ..bodies.small_motion import SmallMotion

FREQUENCIES = (0.1, 2000.0)  # [Hz] within which bodies on mounts vibrate
_NEAR, _FAR = 1.0 / 450.0, 20.0  # times the reach of the mounts, outside which a place is hardly meant
_REACH = (2e-3, 20.0)  # [m] of the mounts from the centre of gravity
_GYRATION = (1.0 / 15.0, 3.0)  # radius of gyration, as a share of the reach
_LOAD = (0.005, 1.0)  # static load, as a share of the force that the mounts can hold


def implausible_sizes(system: MountedSystem) -> Iterator[str]:
    """A sentence for each size that is hardly meant, with what was read and what it may have been."""
    places = [[*_places(system, number)] for number in range(len(system.bodies))]
    for number, of_body in enumerate(places):
        yield from of_body or _gyration(system, number)  # which wrong places change
        yield from _load(system, number)
    if not any(places):
        yield from _frequencies(system)


def natural_modes(motion: SmallMotion) -> list[tuple[float, FloatArray]]:
    """Angular frequencies of vanishing motion [rad/s], rising, those of a falling force left out, and coordinates."""
    stiffness = motion.stiffness(motion.system.laws.tangents(motion.springs), np.zeros_like(motion.springs))
    values, shapes = np.linalg.eigh(stiffness / motion.mass)
    return [(math.sqrt(value), shapes[:, k]) for k, value in enumerate(values.tolist()) if value > 0.0]


def natural_frequencies(system: MountedSystem) -> tuple[float, ...]:
    """Of vanishing motion in the nominal pose, rising, those of a falling force left out [Hz]."""
    return tuple(rate / (2.0 * math.pi) for rate, _ in natural_modes(SmallMotion.about_nominal(system)))


def _arms(system: MountedSystem, number: int) -> dict[str, float]:
    """Distance of the mounts on a body or below one from its centre of gravity, by their names [m]."""
    center = system.bodies[number].center
    return {
        mount.name: math.dist(mount.place, center) for mount in system.mounts if number in (mount.body, mount.support)
    }


def _reach(system: MountedSystem, number: int) -> float:
    """Median of the arms, of which one in another unit changes little [m]."""
    return float(np.median([*_arms(system, number).values()] or [0.0]))


def _places(system: MountedSystem, number: int) -> Iterator[str]:
    body, reach = system.bodies[number], _reach(system, number)
    if reach > _REACH[1] or 0.0 < reach < _REACH[0]:
        yield (
            f"The mounts of {body.name} are {_length(reach)} from its centre of gravity; check the unit of `place` and "
            "`center`, in which mm and m may have been exchanged."
        )
        return
    distances = {f"Mount {name}": arm for name, arm in _arms(system, number).items()}
    for point in system.points:
        if point.body == number:
            distances[f"Point {point.name}"] = math.dist(point.place, body.center)
    for name, distance in distances.items():
        if reach > 0.0 and (distance > _FAR * reach or 0.0 < distance < _NEAR * reach):
            yield (
                f"{name} is {_length(distance)} from the centre of gravity of {body.name}, and the mounts are "
                f"{_length(reach)} from it; check the unit of its `place`, in which mm and m may have been exchanged."
            )


def _gyration(system: MountedSystem, number: int) -> Iterator[str]:
    body, reach = system.bodies[number], _reach(system, number)
    if body.motion is MotionKind.AXIS or reach == 0.0:
        return
    moment = _largest_moment(body)
    radius = math.sqrt(moment / body.mass)
    if not _GYRATION[0] * reach <= radius <= _GYRATION[1] * reach:
        likely = 0.4 * body.mass * reach**2
        yield (
            f"With a moment of inertia of {moment:.4g} kg m^2 and {body.mass:.4g} kg {body.name} has a radius of "
            f"gyration of {_length(radius)}, while its mounts are {_length(reach)} from its centre of gravity, where "
            f"some {likely:.2g} kg m^2 are usual; check the unit of `inertia`, which may be kg mm^2, kg cm^2 or lb "
            "in^2, and of `mass`."
        )


def _largest_moment(body: RigidBody) -> float:
    """The largest moment of inertia about an axis about which the body can turn [kg m^2]."""
    inertia, direction = np.array(body.inertia), np.array(body.direction)
    if body.motion is MotionKind.PLANE:
        return float(direction @ inertia @ direction)
    return float(np.linalg.eigvalsh(inertia)[-1])


def _load(system: MountedSystem, number: int) -> Iterator[str]:
    """The weight on the mounts below a body, compared with the force they can hold."""
    gravity = np.array(system.gravity)
    strength = float(np.linalg.norm(gravity))
    if strength < 0.5 * STANDARD_GRAVITY:
        return
    held = _held(system, number, gravity / strength)
    mass = _carried(system, number, {number})
    share = mass * strength / held if held > 0.0 else math.nan
    if math.isnan(share) or _LOAD[0] <= share <= _LOAD[1]:
        return
    name = system.bodies[number].name
    other = "g instead of kg" if share < _LOAD[0] else "kg instead of g, or t instead of kg"
    yield (
        f"{mass:.4g} kg with {name} weigh {mass * strength:.3g} N, and the mounts below can hold {held:.3g} N along "
        f"gravity within the identified range: {100.0 * share:.2g} % of it; check the unit of `mass`, which may have "
        f"been given in {other}."
    )


def _held(system: MountedSystem, number: int, down: FloatArray) -> float:
    """Largest change of the elastic force along gravity that the mounts below a body have within their ranges [N]."""
    laws = system.laws
    zero = np.zeros_like(laws.nominal)
    forces = [laws.forces(springs, zero) for springs in (laws.low, laws.high, laws.nominal)]
    swing = np.maximum(*(np.abs(end - forces[2]) for end in forces[:2]))
    below = [mount.body == number for mount in system.axis_mounts]
    along = [abs(float(np.dot(axis.direction, down))) for axis in system.axes]
    return float(np.sum(swing * below * along))


def _carried(system: MountedSystem, number: int, seen: set[int]) -> float:
    """Mass of a body and of those that stand on it [kg]."""
    mass = system.bodies[number].mass
    for mount in system.mounts:
        if mount.support == number != BASE and mount.body not in seen:
            seen.add(mount.body)
            mass += _carried(system, mount.body, seen)
    return mass


def _frequencies(system: MountedSystem) -> Iterator[str]:
    frequencies, (low, high) = natural_frequencies(system), FREQUENCIES
    for frequency, size in ((min(frequencies, default=low), "large"), (max(frequencies, default=high), "small")):
        if not low <= frequency <= high and (frequency < low) == (size == "large"):
            yield (
                f"A natural frequency of {frequency:.3g} Hz is outside {low:g} to {high:g} Hz, within which bodies "
                f"vibrate on mounts: masses or moments of inertia are far too {size} for these springs; check their "
                "units (kg or g, kg m^2 or kg mm^2) and those of the model files."
            )


def _length(metres: float) -> str:
    return f"{1e3 * metres:.4g} mm" if metres < 1.0 else f"{metres:.4g} m"
