"""The band of frequencies over which a system is studied."""

from __future__ import annotations

import numpy as np

from ...kernel.arrays import FloatArray
from .options import checked_limits
from .system import StaticEquilibrium

# Of the frequency of small motion; the lower end is not at a superharmonic resonance.
DEFAULT_BAND = (0.23, 5.0)


def band_frequencies(limits: tuple[float, float] | None, points: int, equilibrium: StaticEquilibrium) -> FloatArray:
    """Frequencies evenly spaced in the logarithm, shape (points,) [Hz].

    Parameters
    ----------
    limits : tuple or None   Lowest and highest [Hz]; about the frequency of small motion if None.
    points : int
    equilibrium : StaticEquilibrium

    Raises
    ------
    IsolationError           If the limits do not rise from above 0.
    """
    default = (share * equilibrium.frequency for share in DEFAULT_BAND)
    low, high = checked_limits(limits) if limits is not None else default
    return np.geomspace(low, high, points)
