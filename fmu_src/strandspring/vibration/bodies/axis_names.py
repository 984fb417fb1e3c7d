"""Names of the axes of mounts, for people: the vendor's words, such as compression and shear, or directions."""

from __future__ import annotations

from collections import Counter

from .mounted import Mount, MountAxis, MountedSystem, Vector

_LETTERS = "xyz"
_PARALLEL = 1.0 - 1e-9


def axis_names(system: MountedSystem) -> tuple[str, ...]:
    """The name of each axis: that of its mount, where it has several followed by that of the axis."""
    return tuple(name for mount in system.mounts for name in names_of_axes(mount))


def names_of_axes(mount: Mount) -> list[str]:
    """The names of the axes of one mount.

    Examples
    --------
    >>> from strandspring.vibration.description.system_file import load_system_file
    >>> from strandspring.examples.system_models import SYSTEMS
    >>> names_of_axes(load_system_file(SYSTEMS / "electronics_box.toml").candidates[0][1].mounts[3])
    ['corner 4 compression', 'corner 4 shear', 'corner 4 roll']
    """
    if len(mount.axes) == 1:
        return [mount.name]
    return [f"{mount.name} {label}" for label in axis_labels(mount)]


def axis_labels(mount: Mount) -> list[str]:
    """What tells the axes of one mount apart: the name that each was given, else its direction, or both."""
    directions = [direction_words(axis.direction) for axis in mount.axes]
    labels = [axis.name or words for axis, words in zip(mount.axes, directions, strict=True)]
    counts = Counter(labels)
    return [
        label if counts[label] == 1 else f"{label} {words}" for label, words in zip(labels, directions, strict=True)
    ]


def direction_words(direction: Vector) -> str:
    """A direction as "x" or "-z" where it is one of these, else its components.

    Examples
    --------
    >>> direction_words((0.0, 0.0, -1.0)), direction_words((0.6, 0.8, 0.0))
    ('-z', '(0.6, 0.8, 0)')
    """
    components = ", ".join(f"{component:.3g}" for component in (round(part, 9) + 0.0 for part in direction))
    return direction_name(direction) or f"({components})"


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
