"""Largest responses of oscillators to a base acceleration, compiled; see `shock.c` for the recursion.

It steps the state of each oscillator exactly for an input that is straight between its samples. That is the same as
Smallwood's ramp-invariant digital recursive filter (Shock and Vibration Bulletin 51, 1981), but keeps its digits where
the product of natural frequency and sampling interval is tiny.
"""

from __future__ import annotations

import numpy as np

from .arrays import FloatArray, address, floats
from .library import library


def largest_responses(
    samples: FloatArray,
    phase: FloatArray,
    damping: float,
) -> FloatArray:
    """Largest and smallest absolute accelerations of oscillators that start at rest.

    Parameters
    ----------
    samples : ndarray, shape (K,)     Base acceleration [m/s^2]; it is 0 after the last sample.
    phase : ndarray, shape (F,)       Natural angular frequency times the sampling interval [rad], > 0.
    damping : float                   Share of critical damping, >= 0 and < 1.

    Returns
    -------
    ndarray, shape (F, 4)             Maximum and minimum during the samples, maximum and minimum after them [m/s^2].
    """
    x, theta = floats(samples), floats(phase)
    out = np.empty((theta.size, 4))
    library().shock_spectrum(
        x.size,
        address(x),
        damping,
        theta.size,
        address(theta),
        address(out),
    )
    return out
