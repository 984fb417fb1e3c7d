"""The band of frequencies over which a system is studied."""

from __future__ import annotations

import math

import numpy as np

from ...kernel.arrays import FloatArray
from .system import IsolationError, StaticEquilibrium

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


def checked_limits(limits: tuple[float, float]) -> tuple[float, float]:
    """The limits of a band [Hz], if they rise from above 0.

    Raises
    ------
    IsolationError   If they do not.
    """
    low, high = limits
    if not (math.isfinite(low) and math.isfinite(high) and 0.0 < low < high):
        raise IsolationError(f"The band must rise from above 0 [Hz], got {low:.10g} to {high:.10g}.")
    return low, high
