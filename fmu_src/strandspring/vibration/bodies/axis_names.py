"""Names of the axes of mounts, for people."""

from __future__ import annotations

from .mounted import Mount, MountAxis, MountedSystem, Vector

_LETTERS = "xyz"
_PARALLEL = 1.0 - 1e-9


def axis_names(system: MountedSystem) -> tuple[str, ...]:
    """The name of each axis: that of its mount, where it has several with the direction or the number of the axis."""
    return tuple(
        mount.name if len(mount.axes) == 1 else f"{mount.name} {direction_name(axis.direction) or f'axis {number}'}"
        for mount in system.mounts
        for number, axis in enumerate(mount.axes, start=1)
    )


def direction_name(direction: Vector) -> str:
    """A direction as "x" or "-z" where it is one of these, else "".

    Examples
    --------
    >>> direction_name((0.0, 0.0, -1.0)), direction_name((0.6, 0.8, 0.0))
    ('-z', '')
    """
    for letter, component in zip(_LETTERS, direction, strict=True):
        if abs(component) > _PARALLEL:
            return letter if component > 0.0 else f"-{letter}"
    return ""


def axes_by_mount(system: MountedSystem) -> list[tuple[Mount, list[tuple[int, MountAxis]]]]:
    """Each mount with the numbers of its axes."""
    numbered, first = [], 0
    for mount in system.mounts:
        numbered.append((mount, list(enumerate(mount.axes, start=first))))
        first += len(mount.axes)
    return numbered
