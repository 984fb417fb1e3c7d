"""Values that a study gives to a path of a SYSTEM.toml: LOW:HIGH:COUNT, a list with commas, or numbers and texts.

Numbers without unit are in the one that the file states, and others in the one that stands with them. Percent are
shares of what the file says, which keeps signs and what is different from place to place.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError

from ...errors import MountedSystemError
from ...ground.strict_json import is_finite
from ...ground.tables import refusal
from ...vibration.description.system_tables import SystemTable
from ...vibration.description.value_paths import PLACES, Location, locations, set_value, value_at

MOST_VALUES = 10_000
PERCENT = "%"
_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*(.*?)\s*", re.DOTALL)
_HOW = "give LOW:HIGH:COUNT or a list with commas, such as '15 kg:25 kg:5', '80%:120%:3' or '4,6,8'"

Given = str | float | Iterable[str | float]


@dataclass(frozen=True)
class Varied:
    """One value of the description, or several that are always the same, and what it is in the grid.

    Parameters
    ----------
    path : str
    unit : str                   Of the numbers; empty for that of the file, without unit and for texts.
    values : tuple               Numbers, or texts.
    locations : tuple            Where the path leads to.
    """

    path: str
    unit: str
    values: tuple[float | str, ...]
    locations: tuple[Location, ...]

    @property
    def heading(self) -> str:
        """The path and the unit."""
        return f"{self.path} [{self.unit}]" if self.unit else self.path

    @property
    def counts_places(self) -> bool:
        """Whether it is how many places have a mount."""
        return self.locations[0][-1] == PLACES

    def shown(self, value: float | str) -> str:
        """A value with its unit."""
        return f"{shown_alone(value)} {self.unit}" if self.unit else shown_alone(value)

    def applied(self, content: Mapping[str, Any], table: SystemTable, index: int) -> dict[str, Any]:
        """A copy of the content with one of the values.

        Parameters
        ----------
        content : mapping
        table : SystemTable   The description as it was before anything was varied.
        index : int           Of the value.
        """
        changed = copy.deepcopy(dict(content))
        for location in self.locations:
            set_value(changed, table, location, self._written(self.values[index], content, table, location))
        return changed

    def texts(self) -> Iterator[int]:
        """Indices of the values that are texts, of which some may name files."""
        return (index for index, value in enumerate(self.values) if isinstance(value, str))

    def _written(
        self, value: float | str, content: Mapping[str, Any], table: SystemTable, location: Location
    ) -> float | str:
        """A value as the file would have it."""
        if isinstance(value, str):
            return value
        if self.unit == PERCENT:
            try:
                known = value_at(content, location)
            except LookupError:
                known = value_at(table, location)
            whole, unit = _number(known) or (float("nan"), "")
            value *= 0.01 * whole
        else:
            unit = self.unit
        if unit:
            return f"{value!r} {unit}"
        return int(value) if value.is_integer() else value


def with_texts(content: Mapping[str, Any], table: SystemTable, axes: Iterable[Varied]) -> Iterator[Mapping[str, Any]]:
    """The content of a description as it is, and with each text that is varied: all that may name other files."""
    yield content
    for axis in axes:
        yield from (axis.applied(content, table, index) for index in axis.texts())


def shown_alone(value: float | str) -> str:
    """A value without its unit."""
    return value if isinstance(value, str) else f"{value:.6g}"


def varied(path: str, given: Given, content: Mapping[str, Any], table: SystemTable) -> Varied:
    """What is varied.

    Parameters
    ----------
    path : str
    given : str, float or iterable of them
    content : mapping       Of the description.
    table : SystemTable     The same, read.

    Raises
    ------
    MountedSystemError      If the path leads nowhere, the values cannot be understood, or none of them can be.
    """
    places = locations(path, table)
    try:
        numbers = _numbers(given)
        first = value_at(table, places[0])
        if isinstance(first, str) and (numbers is None or numbers[1]):
            axis = Varied(path, "", tuple(map(str, _listed(given))), places)
        elif numbers is None:
            raise ValueError(f"got {given!r:.60}; {_HOW}")
        else:
            axis = Varied(path, numbers[1], numbers[0], places)
        _check(axis, content, table)
    except ValueError as problem:
        said = refusal(problem) if isinstance(problem, ValidationError) else f"{problem}."
        raise MountedSystemError(f"{path}: {said}") from None
    return axis


def _check(axis: Varied, content: Mapping[str, Any], table: SystemTable) -> None:
    """Refuse too many values, the same one twice, and values none of which the field may have."""
    if not 1 <= len(axis.values) <= MOST_VALUES:
        raise ValueError(f"must have 1 to {MOST_VALUES} values, got {len(axis.values)}")
    if len({*axis.values}) < len(axis.values):
        raise ValueError("has a value twice; leave one out")
    if axis.unit == PERCENT:
        for location in axis.locations:
            if _number(value_at(table, location)) is None:
                raise ValueError("has no number in the file to take percent of; give values with their unit")
    for location in axis.locations:
        if location[-1] == PLACES:
            most = len(value_at(table, location))
            if axis.unit or any(value not in range(1, most + 1) for value in axis.values):
                raise ValueError(f"must be how many of the {most} places have a mount, from 1 to {most}")
    problems = []
    for index in range(len(axis.values)):
        try:
            SystemTable.model_validate(axis.applied(content, table, index))
            return
        except ValidationError as problem:
            problems.append(problem)
    raise problems[0]


def _numbers(given: Given) -> tuple[tuple[float, ...], str] | None:
    """Numbers and their unit; None if there are others than numbers."""
    if isinstance(given, str) and given.count(":") == 2:
        low, high, count = given.split(":")
        ends = _of_one_unit([low, high])
        if ends is None:
            return None
        if not count.strip().isdecimal() or not 2 <= int(count) <= MOST_VALUES:
            raise ValueError(f"COUNT must be a whole number from 2 to {MOST_VALUES}, got {count!r:.60}")
        return tuple(np.linspace(ends[0][0], ends[0][1], int(count)).tolist()), ends[1]
    return _of_one_unit(_listed(given))


def _listed(given: Given) -> list[str | float]:
    if isinstance(given, str):
        return [text.strip() for text in given.split(",")]
    return [given] if isinstance(given, int | float) else [np.asarray(value).item() for value in given]


def _of_one_unit(given: Sequence[str | float]) -> tuple[tuple[float, ...], str] | None:
    pairs = [_number(value) for value in given]
    if not pairs or None in pairs:
        return None
    known = [pair for pair in pairs if pair is not None]
    units = list(dict.fromkeys(unit for _, unit in known))
    if len(units) > 1:
        raise ValueError(f"all values must have one unit, got {' and '.join(map(repr, units))}")
    if units == [PERCENT] and (signed := [value for value in given if str(value).startswith(("+", "-"))]):
        raise ValueError(f"percent are shares of what the file says, got {signed[0]!r:.60}; write 110 % for 10 % more")
    return tuple(number for number, _ in known), units[0]


def _number(value: object) -> tuple[float, str] | None:
    """A number and its unit, "" for none; None if it is something else."""
    if isinstance(value, str):
        match = _NUMBER.fullmatch(value)
        return (float(match[1]), match[2]) if match and ":" not in value and is_finite(float(match[1])) else None
    return (float(value), "") if isinstance(value, int | float) and is_finite(value) else None
