"""Levels of excitation as Python users give them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..isolation.system import Excitation, IsolationError


def given_levels(
    base_displacement: ArrayLike | None, base_acceleration: ArrayLike | None, force: ArrayLike | None
) -> tuple[Excitation, tuple[float, ...]] | None:
    """The excitation for which levels are given, with these [m, m/s^2 or N]; None if there are none.

    Raises
    ------
    IsolationError   If they are given for more than one, or are not positive numbers.
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
    values = np.atleast_1d(np.asarray(levels, dtype=np.float64))
    if values.ndim != 1 or values.size == 0 or not np.all(np.isfinite(values) & (values > 0.0)):
        raise IsolationError(
            f"Every level of {excitation.value} must be finite and > 0 [{excitation.unit}], got {levels}."
        )
    return excitation, tuple(values.tolist())
