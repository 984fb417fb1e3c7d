"""Values of a description that are possible but hardly meant: sizes in another unit, or unlikely together."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...findings import Finding, Outcome
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
_ALONG = 0.5  # cosine between an axis and gravity from which it carries weight
_DECIMALS, _DIGITS = 6, 3  # of places [m] and directions that are the same


def implausible_values(system: MountedSystem) -> Iterator[Finding]:
    """Values that are hardly meant, with what was read."""
    places = [[*_places(system, number)] for number in range(len(system.bodies))]
    for number, of_body in enumerate(places):
        yield from of_body or _gyration(system, number)  # which wrong places change
        yield from _load(system, number)
    if not any(places):
        yield from _frequencies(system)
    for check in (_pulled, _coincident, _overdamped):
        yield from check(system)


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


def _places(system: MountedSystem, number: int) -> Iterator[Finding]:
    body, reach = system.bodies[number], _reach(system, number)
    if reach > _REACH[1] or 0.0 < reach < _REACH[0]:
        yield Finding(Outcome.MOUNTS_FAR, {"body": body.name, "reach": reach})
        return
    distances = {f"Mount {name}": arm for name, arm in _arms(system, number).items()}
    for point in system.points:
        if point.body == number:
            distances[f"Point {point.name}"] = math.dist(point.place, body.center)
    for name, distance in distances.items():
        if reach > 0.0 and (distance > _FAR * reach or 0.0 < distance < _NEAR * reach):
            numbers = {"distance": distance, "reach": reach}
            yield Finding(Outcome.PLACE_FAR, {"place": name, "body": body.name, **numbers})


def _gyration(system: MountedSystem, number: int) -> Iterator[Finding]:
    body, reach = system.bodies[number], _reach(system, number)
    if body.motion is MotionKind.AXIS or reach == 0.0:
        return
    moment = _largest_moment(body)
    radius = math.sqrt(moment / body.mass)
    if not _GYRATION[0] * reach <= radius <= _GYRATION[1] * reach:
        numbers = {"radius": radius, "reach": reach, "inertia": moment, "mass": body.mass}
        yield Finding(Outcome.GYRATION, {"body": body.name, **numbers, "usual": 0.4 * body.mass * reach**2})


def _largest_moment(body: RigidBody) -> float:
    """The largest moment of inertia about an axis about which the body can turn [kg m^2]."""
    inertia, direction = np.array(body.inertia), np.array(body.direction)
    if body.motion is MotionKind.PLANE:
        return float(direction @ inertia @ direction)
    return float(np.linalg.eigvalsh(inertia)[-1])


def _load(system: MountedSystem, number: int) -> Iterator[Finding]:
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
    numbers = {"mass": mass, "weight": mass * strength, "held": held, "share": share}
    yield Finding(Outcome.STATIC_LOAD, {"body": system.bodies[number].name, **numbers})


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


def _frequencies(system: MountedSystem) -> Iterator[Finding]:
    frequencies, (low, high) = natural_frequencies(system), FREQUENCIES
    for frequency, size in ((min(frequencies, default=low), "large"), (max(frequencies, default=high), "small")):
        if not low <= frequency <= high and (frequency < low) == (size == "large"):
            numbers = {"frequency": frequency, "usual": (FREQUENCIES,), "size": size}
            yield Finding(Outcome.NATURAL_FREQUENCY, numbers)


def _pulled(system: MountedSystem) -> Iterator[Finding]:
    """The weight of a body against the direction of compression of all mounts below it."""
    down = np.array(system.gravity) / (np.linalg.norm(system.gravity) or 1.0)
    named = [
        (mount.body, name, way)
        for axis, mount, name in zip(system.axes, system.axis_mounts, system.axis_names, strict=True)
        if "compress" in f"{axis.name} {axis.model}".lower() and abs(way := np.dot(axis.direction, down)) > _ALONG
    ]
    for number, body in enumerate(system.bodies):
        ways = {name: way for of, name, way in named if of == number}
        if max(ways.values(), default=0.0) < 0.0:
            yield Finding(Outcome.PULLED, {"body": body.name, "axis": next(iter(ways))})


def _coincident(system: MountedSystem) -> Iterator[Finding]:
    """Two mounts at one place with an axis along the same direction."""
    names: dict[tuple[object, ...], str] = {}
    for axis, mount in zip(system.axes, system.axis_mounts, strict=True):
        place, direction = np.round(mount.place, _DECIMALS), np.round(np.abs(axis.direction), _DIGITS)
        other = names.setdefault((mount.body, mount.support, *place.tolist(), *direction.tolist()), mount.name)
        if other != mount.name:
            yield Finding(Outcome.COINCIDENT, {"first": other, "second": mount.name})
            return


def _overdamped(system: MountedSystem) -> Iterator[Finding]:
    """Dampers against mass and stiffness."""
    motion = SmallMotion.about_nominal(system)
    modes = natural_modes(motion)
    ratios = [(0.5 * float(q @ motion.damping @ q) / (motion.mass * rate), rate) for rate, q in modes]
    ratio, rate = max(ratios, default=(0.0, 0.0))
    if ratio > 1.0:
        yield Finding(Outcome.OVERDAMPED, {"frequency": rate / (2.0 * np.pi), "ratio": ratio})
