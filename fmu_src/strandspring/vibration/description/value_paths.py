"""Paths to single values of a SYSTEM.toml, such as body.box.mass or mount_type.corner.axes.*.damping.

A path goes from table to table by keys. Of a list it takes an entry by its number from 1 on, a table among several by
its name too, and all of them by `*`; components of a vector are numbers 1 to 3. The list `places` of mounts is a value
itself: how many of its places, from the first on, have a mount.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

from ...errors import MountedSystemError
from ...ground.quoting import quoted
from ...ground.tables import StrictTable, suggestion
from .system_tables import SystemTable

Location = tuple[str | int, ...]

ALL = "*"
PLACES = "places"
# Names, what the options of a study give, and what would change which cases there are.
_FIXED = frozenset(("format", "format_version", "units", "name", "description", "source", "draws", "directions"))
_MOST_SUGGESTED = 3000


def locations(path: str, table: SystemTable) -> tuple[Location, ...]:
    """Where the values of a path are.

    Parameters
    ----------
    path : str
    table : SystemTable   The description.

    Raises
    ------
    MountedSystemError    If it leads to no value; the message names the nearest one that does.
    """
    matches = tuple(dict.fromkeys(_matches(path, table, ())))
    if matches:
        return matches
    known = list(islice(_paths(table, ""), _MOST_SUGGESTED))
    raise MountedSystemError(
        f"{quoted(path)} is not the path of a value of this description; {suggestion(path, known)}."
    )


def value_at(node: Any, location: Location) -> Any:
    """The value at a location, of the tables or of the content of a file; KeyError where the file leaves it out."""
    for part in location:
        node = getattr(node, str(part)) if isinstance(node, StrictTable) else node[part]
    return node


def set_value(content: dict[str, Any], table: SystemTable, location: Location, value: Any) -> None:
    """Change a value in the content of a file, which may have left it out.

    Parameters
    ----------
    content : dict           As TOML gives it; valid. Changed.
    table : SystemTable      The same, read.
    location : Location
    value : object           As the file would have it; a number of mounts for `places`.
    """
    node: Any = content
    for depth, part in enumerate(location[:-1], start=1):
        if isinstance(node, dict) and part not in node:
            default = value_at(table, location[:depth])
            node[part] = list(default) if isinstance(default, tuple) else {}
        node = node[part]
    last = location[-1]
    if last == PLACES:
        node[PLACES] = node[PLACES][:value]
        if isinstance(node.get("rotate"), list):
            node["rotate"] = node["rotate"][:value]
    else:
        node[last] = value


def _matches(path: str, node: Any, location: Location) -> Iterator[Location]:
    """Locations below a node that a path leads to."""
    if not path:
        if _is_value(node, location):
            yield location
        return
    for name, part in _children(node):
        if part in _FIXED:
            continue
        for key in (name,) if isinstance(node, StrictTable) else (name, ALL):
            if path == key or path.startswith(f"{key}."):
                yield from _matches(path[len(key) + 1 :], _child(node, part), (*location, part))


def _children(node: Any) -> Iterator[tuple[str, str | int]]:
    """Names of what is in a node, each with its key or index; entries with a name come under that, too."""
    if isinstance(node, StrictTable):
        yield from ((name, name) for name in type(node).model_fields)
    elif isinstance(node, Mapping):
        yield from ((name, name) for name in node)
    elif isinstance(node, list | tuple) and not _is_rate(node):
        for k, entry in enumerate(node):
            yield str(k + 1), k
            if name := getattr(entry, "name", ""):
                yield name, k


def _child(node: Any, part: str | int) -> Any:
    return value_at(node, (part,))


def _is_value(node: Any, location: Location) -> bool:
    if location[-1:] == (PLACES,):
        return bool(node)
    return _is_rate(node) or not isinstance(node, StrictTable | Mapping | list | tuple)


def _is_rate(node: Any) -> bool:
    """Whether it is the rate of a sweep, which is read as a number and its kind."""
    return isinstance(node, tuple) and any(isinstance(entry, bool) for entry in node)


def _paths(node: Any, path: str) -> Iterator[str]:
    """All paths below a node, of named entries by their names only."""
    named = {part: name for name, part in _children(node)}
    for part, name in named.items():
        if part in _FIXED:
            continue
        child, longer = _child(node, part), f"{path}.{name}" if path else name
        if _is_value(child, (part,)):
            yield longer
        yield from _paths(child, longer)
