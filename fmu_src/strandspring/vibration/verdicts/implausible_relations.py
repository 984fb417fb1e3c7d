"""Values that are each possible but unlikely together: a table of relations, each with one sentence."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..bodies.loads import LoadCase
from ..bodies.mounted import MountedSystem
from ..bodies.small_motion import SmallMotion
from .implausible_sizes import natural_frequencies, natural_modes

_ALONG = 0.5  # cosine between an axis and gravity from which it carries weight
_PLACES, _DIGITS = 6, 3  # decimals of places [m] and directions that are the same
_PERIODS = 10.0  # of the slowest vibration, below which the rms of random vibration depends on chance


def implausible_relations(system: MountedSystem, case: LoadCase | None = None) -> Iterator[str]:
    """A sentence for each relation within a description, or between it and a load case, that is unlikely."""
    if case is None:
        yield from (sentence for check in (_pulled, _coincident, _overdamped) for sentence in check(system))
    else:
        yield from (sentence for check in (_short, _upward) for sentence in check(system, case))


def _pulled(system: MountedSystem) -> Iterator[str]:
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
            yield (
                f"The weight of {body.name} pulls {next(iter(ways))}, which by its name is compressed as the "
                "displacement grows; reverse its `direction`, if the body stands on its mounts."
            )


def _coincident(system: MountedSystem) -> Iterator[str]:
    """Two mounts at one place with an axis along the same direction."""
    names: dict[tuple[object, ...], str] = {}
    for axis, mount in zip(system.axes, system.axis_mounts, strict=True):
        place, direction = np.round(mount.place, _PLACES), np.round(np.abs(axis.direction), _DIGITS)
        other = names.setdefault((mount.body, mount.support, *place.tolist(), *direction.tolist()), mount.name)
        if other != mount.name:
            yield (
                f"Mounts {other} and {mount.name} act at one place along the same direction; correct the `place` of "
                "one, or use `parallel` if there are two."
            )
            return


def _overdamped(system: MountedSystem) -> Iterator[str]:
    """Dampers against mass and stiffness."""
    motion = SmallMotion.about_nominal(system)
    modes = natural_modes(motion)
    ratios = [(0.5 * float(q @ motion.damping @ q) / (motion.mass * rate), rate) for rate, q in modes]
    ratio, rate = max(ratios, default=(0.0, 0.0))
    if ratio > 1.0:
        yield (
            f"Dampers give a motion of {rate / (2.0 * np.pi):.3g} Hz a damping ratio of {ratio:.3g}, with which it "
            "creeps back and does not vibrate; check the unit of `damping` (N s/m or kN s/m)."
        )


def _short(system: MountedSystem, case: LoadCase) -> Iterator[str]:
    """The duration of random vibration against the slowest natural vibration."""
    taken = case.duration - case.settling
    periods = taken * min(natural_frequencies(system), default=np.inf)
    if case.is_random and periods < _PERIODS:
        yield (
            f"Random vibration is taken over {taken:.3g} s, {periods:.2g} periods of the lowest natural frequency: its "
            f"figures depend on chance; let it last {_PERIODS / periods:.2g} times as long or longer."
        )


def _upward(system: MountedSystem, case: LoadCase) -> Iterator[str]:
    """The direction of a fall against gravity."""
    if np.dot(case.velocity, system.gravity) < 0.0:
        yield (
            "The fall goes against gravity, which then slows the bodies; reverse its `direction`, or leave it out, or "
            "turn `gravity` if the system falls on its top."
        )
