"""Where a spring is under a preload: the root of FE(x) = preload within the identified range."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from ...core.parameters import SpringParameters
from ...core.spline import Elastic
from ...errors import MountedSystemError

_CELLS = 400  # of the range in which a crossing is looked for
_MOST_KEPT = 2000


@lru_cache(maxsize=_MOST_KEPT)
def displacement_at(spring: SpringParameters, preload: float, is_given: bool = True) -> float:
    """Displacement at which the elastic force is the preload, with omega = 0 [m].

    Where there are several, it is the lowest at which the force rises.

    Parameters
    ----------
    spring : SpringParameters
    preload : float            Of one spring [N].
    is_given : bool            Whether somebody asked for it, for the message.

    Raises
    ------
    MountedSystemError         If there is none within the identified range; the message names neither file nor field.
    """
    elastic = Elastic(spring)
    places = np.linspace(spring.displacement_min, spring.displacement_max, _CELLS + 1)
    places[-1] = spring.displacement_max

    def excess(displacement: float) -> float:
        return elastic.force(displacement - spring.displacement_offset) - preload

    forces = np.array([excess(place) for place in places.tolist()])
    rising = np.flatnonzero((forces[:-1] <= 0.0) & (forces[1:] >= 0.0))
    cells = rising if rising.size else np.flatnonzero((forces[:-1] >= 0.0) & (forces[1:] <= 0.0))
    if cells.size:
        low, high = places[cells[0]], places[cells[0] + 1]
        return float(brentq(excess, low, high, xtol=1e-15 * max(1e-3, abs(low), abs(high)), rtol=8.9e-16))
    least, largest = forces.min() + preload, forces.max() + preload
    what = f"a preload of {preload:.6g} N is" if is_given else "without `preload` a spring begins at 0 N, which is"
    raise MountedSystemError(
        f"{what} outside the elastic forces of its identified range, {least:.6g} to {largest:.6g} N; give `preload` "
        "within them (of one spring), or `nominal`, the displacement of one spring."
    )
