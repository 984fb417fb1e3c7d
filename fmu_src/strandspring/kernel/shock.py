"""Largest responses of oscillators to a base acceleration, compiled; see `shock.c` for the recursion.

It steps the state of each oscillator exactly for an input that is a cubic between its samples. Of straight lines that
is the same as Smallwood's ramp-invariant digital recursive filter (Shock and Vibration Bulletin 51, 1981), but keeps
its digits where the product of natural frequency and sampling interval is tiny.
"""

from __future__ import annotations

import numpy as np

from .arrays import FloatArray, address, floats
from .library import library


def largest_responses(pieces: FloatArray, phase: FloatArray, damping: float) -> FloatArray:
    """Largest and smallest absolute accelerations of oscillators that start at rest.

    Parameters
    ----------
    pieces : ndarray, shape (K, 5)    Base acceleration: coefficients of the cubics over the share [0, 1] of each
                                      interval, constant term first, and a bound of their magnitudes [m/s^2]; it is 0
                                      after the last.
    phase : ndarray, shape (F,)       Natural angular frequency times the interval [rad], > 0.
    damping : float                   Share of critical damping, >= 0 and < 1.

    Returns
    -------
    ndarray, shape (F, 4)             Maximum and minimum during the samples, maximum and minimum after them [m/s^2].
    """
    x, theta = floats(pieces), floats(phase)
    out = np.empty((theta.size, 4))
    library().shock_spectrum(len(x), address(x), damping, theta.size, address(theta), address(out))
    return out


def response_bounds(pieces: FloatArray, phase: FloatArray, damping: float) -> FloatArray:
    """What the magnitude of no response exceeds, shape (F,): with its least changes oscillators swing about the input.

    The response is x + e with e'' + 2*zeta*e' + e = -x'' (`shock.c`), to which jumps of x and x' add free swings.
    """
    x0, x1, x2, x3, most = pieces.T
    jumps = np.abs(np.append(x0, 0.0) - np.append(0.0, x0 + x1 + x2 + x3)).sum()
    kinks = np.abs(np.append(x1, 0.0) - np.append(0.0, x1 + 2.0 * x2 + 3.0 * x3)).sum() / phase
    bend = 2.0 * np.maximum(np.abs(x2), np.abs(x2 + 3.0 * x3)).max() / phase**2
    return floats(most.max() + (jumps + kinks + bend / damping) / np.sqrt(1.0 - damping**2))


def straight_pieces(samples: FloatArray) -> FloatArray:
    """Straight lines between samples of shape (K + 1,), shape (K, 5)."""
    rise = np.diff(samples)
    return _pieces(samples[:-1], rise, rise, rise)


def smooth_pieces(before: FloatArray, after: FloatArray) -> FloatArray:
    """Cubics between the values before and after each sample, shape (K + 1,), with slopes of fourth order but at jumps,
    shape (K, 5).
    """
    rise, is_jump = before[1:] - after[:-1], before != after
    beside = np.pad(rise, 2, mode="edge")
    slope = (7.0 * (beside[1:-2] + beside[2:-1]) - beside[:-3] - beside[3:]) / 12.0
    first, last = np.where(is_jump[:-1], rise, slope[:-1]), np.where(is_jump[1:], rise, slope[1:])
    return _pieces(after[:-1], rise, first, last)


def _pieces(start: FloatArray, rise: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
    """From values and slopes at the ends; a cubic lies between the control points of its Bezier form."""
    most = np.abs([start, start + first / 3.0, start + rise - last / 3.0, start + rise]).max(axis=0)
    curve = first + last - 2.0 * rise
    return np.column_stack([start, first, rise - first - curve, curve, most])
