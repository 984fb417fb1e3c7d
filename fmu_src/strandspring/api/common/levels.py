"""Levels of excitation as Python users give them."""

from __future__ import annotations

import math

from numpy.typing import ArrayLike

from ...ground.arguments import numbers, whole
from ...vibration.one_mass.system import Excitation, IsolationError


def given_levels(
    base_displacement: ArrayLike | None, base_acceleration: ArrayLike | None, force: ArrayLike | None
) -> tuple[Excitation, tuple[float, ...]] | None:
    """The excitation for which levels are given, with these [m, m/s^2 or N]; None if there are none.

    Raises
    ------
    IsolationError   If they are given for more than one, or are not positive.
    TypeError        If they are no numbers.
    """
    by_excitation = {
        Excitation.BASE_DISPLACEMENT: base_displacement,
        Excitation.BASE_ACCELERATION: base_acceleration,
        Excitation.FORCE: force,
    }
    given = {excitation: levels for excitation, levels in by_excitation.items() if levels is not None}
    if not given:
        return None
    if len(given) > 1:
        names = " and ".join(f"`{excitation.value.replace(' ', '_')}`" for excitation in given)
        raise IsolationError(f"{names} exclude each other; give one of them.")
    ((excitation, levels),) = given.items()
    return excitation, positive_levels(excitation.value, levels, excitation.unit)


def positive_levels(name: str, levels: ArrayLike, unit: str) -> tuple[float, ...]:
    """One level or several; raises IsolationError unless they are finite and > 0, TypeError if they are no numbers."""
    values = numbers(name.replace(" ", "_"), levels, unit)
    if not values or not all(math.isfinite(value) and value > 0.0 for value in values):
        raise IsolationError(f"Every level of {name} must be finite and > 0 [{unit}], got {levels!r}.")
    return values


def checked_count(name: str, value: int, least: int = 2) -> int:
    """A whole number; raises IsolationError if it is below the least, TypeError if it is none."""
    if whole(name, value) < least:
        raise IsolationError(f"`{name}` must be >= {least}, got {value!r}.")
    return value
