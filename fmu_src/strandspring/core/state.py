"""Everything one FMU instance remembers, and its serialized form."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any, NamedTuple

from .branches import BRANCHES, MECHANISMS
from .parameters import LARGEST_DISPLACEMENT, LARGEST_START_XI, LARGEST_SUM
from .resolution import Resolver
from .stepper import Memory
from .whole import WholeMemory

_FORMAT = "strandspring-state"
_FORMAT_VERSION = 6


class State(NamedTuple):
    """Immutable, so that a snapshot of an instance is the state itself.

    Attributes
    ----------
    settings : tuple of float   Values of the FMU's parameters, in the order of the variable table.
    displacement : float        As set last [m].
    memory : WholeMemory or None   The committed path; None before initialization ends.
    energy_wanted : bool        Whether absorbed_energy has been read, so that each step integrates it.
    side : int                  Where the path ended: -1 below the identified range, +1 above it, 0 inside.
    """

    settings: tuple[float, ...]
    displacement: float
    memory: WholeMemory | None = None
    energy_wanted: bool = False
    side: int = 0


def to_bytes(state: State, guid: str) -> bytes:
    """The state of an instance of the FMU `guid` as JSON, which keeps every bit of a float."""
    content = {"format": _FORMAT, "format_version": _FORMAT_VERSION, "guid": guid, **state._asdict()}
    return json.dumps(content).encode("utf-8")


def from_bytes(data: bytes, guid: str) -> State:
    """The state that `to_bytes` wrote for the FMU `guid`.

    Raises
    ------
    ValueError   If the bytes are not such a state.
    """
    try:
        content = json.loads(data.decode("utf-8"))
    except (ValueError, RecursionError):
        raise ValueError(
            f"The serialized state of {len(data)} bytes must be JSON, but it is truncated or damaged."
        ) from None
    if not isinstance(content, dict) or content.pop("format", None) != _FORMAT:
        raise ValueError("The serialized state must come from a strandspring FMU.")
    if content.pop("format_version", None) != _FORMAT_VERSION:
        raise ValueError(f"The serialized state must have format version {_FORMAT_VERSION}.")
    if content.pop("guid", None) != guid:
        raise ValueError(f"The serialized state must be of the FMU {guid}, but it is of another one.")
    for field, fits in _FIELDS.items():
        if field not in content or not fits(content[field]):
            raise ValueError(f"The serialized state is damaged in its field `{field}`.")
    if len(content) != len(_FIELDS):
        raise ValueError("The serialized state is damaged: it has unknown fields.")
    memory = content["memory"]
    if memory is not None:
        mechanisms, elongations, work, at = memory
        memories = tuple(Memory(*of_one) for of_one in mechanisms)
        content["memory"] = WholeMemory(memories, tuple(elongations), work, Resolver(*at))
    content["settings"] = tuple(content["settings"])
    return State(**content)


def _is_finite(value: Any) -> bool:
    return type(value) is float and math.isfinite(value)


def _is_whole_memory(value: Any) -> bool:
    if value is None:
        return True
    if not (isinstance(value, list) and [type(part) for part in value] == [list, list, float, list]):
        return False
    mechanisms, elongations, work, at = value
    return (
        1 <= len(mechanisms) <= MECHANISMS
        and len(elongations) <= BRANCHES
        and all(map(_is_memory, mechanisms))
        and all(_is_finite(part) and abs(part) <= LARGEST_SUM for part in (*elongations, work))
        and _is_resolver(at)
        and all(of_one[0] == at[1] for of_one in mechanisms)
    )


def _is_resolver(value: list[Any]) -> bool:
    if [type(part) for part in value] != [float, float, float, float, float, int, bool]:
        return False
    *places, direction, _ = value
    return all(abs(place) <= LARGEST_DISPLACEMENT for place in places) and direction in (-1, 0, 1)


def _is_memory(value: Any) -> bool:
    types = [float, float, int, float, float, float, float]
    if not (isinstance(value, list) and [type(part) for part in value] == types):
        return False
    displacement, omega, direction, start, start_xi, energy_at, energy = value
    return (
        all(abs(place) <= LARGEST_DISPLACEMENT for place in (displacement, start, energy_at))
        and abs(omega) <= 1.0
        and direction in (-1, 0, 1)
        and abs(start_xi) <= LARGEST_START_XI
        and abs(energy) <= LARGEST_SUM
    )


_FIELDS: dict[str, Callable[[Any], bool]] = {
    "settings": lambda value: isinstance(value, list) and all(map(_is_finite, value)),
    "displacement": lambda value: _is_finite(value) and abs(value) <= LARGEST_DISPLACEMENT,
    "memory": _is_whole_memory,
    "energy_wanted": lambda value: type(value) is bool,
    "side": lambda value: type(value) is int and value in (-1, 0, 1),
}
