"""Exact averages of signals over time steps: of straight pieces with jumps, and of smooth functions.

A pulse that jumps within a step keeps its velocity change, and halving the step changes no average: the mean of the
averages over both halves is the average over the whole.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ...errors import MountedSystemError
from ...kernel.arrays import FloatArray, floats

LARGEST_SIGNAL = 1e12  # whatever its unit
DURATION_RANGE = (1e-9, 1e7)  # [s]
_INTERVAL_RANGE = (1e-12, 1e6)  # [s]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(6)
# Phase of a panel of Gauss-Legendre quadrature [rad]: its error is within 1e-15 of the amplitude.
_PANEL_PHASE = 1.0
_PANELS_AT_ONCE = 32768  # bounds the memory
_JUMP = 1e-12  # [s] within which a change is a jump


def step_edges(step: float, count: int, first: int = 0) -> FloatArray:
    """Where `count` steps begin and end, shape (count + 1,) [s]."""
    return step * np.arange(first, first + count + 1, dtype=np.float64)


class StraightPieces:
    """A signal of straight pieces between corners; two corners at one time are a jump.

    Parameters
    ----------
    time : array_like, shape (K,)     Never falling [s], K >= 2; the signal is 0 before the first.
    value : array_like, shape (K,)
    after : float                     Its value after the last corner.
    """

    def __init__(self, time: ArrayLike, value: ArrayLike, after: float = 0.0) -> None:
        times, values = floats(time), floats(value)
        width = np.diff(times)
        areas = 0.5 * width * (values[:-1] + values[1:])
        # The piece before the first corner and the one after the last have no end.
        self._ends = times
        self._begin = np.concatenate([times[:1], times])
        self._value = np.concatenate([[0.0], values[:-1], [after]])
        slopes = np.divide(np.diff(values), width, out=np.zeros_like(width), where=width > _JUMP)
        self._slope = np.concatenate([[0.0], slopes, [0.0]])
        # Integral from the first corner up to where each piece begins.
        self._area = np.concatenate([[0.0, 0.0], np.cumsum(areas)])

    @property
    def area(self) -> float:
        """Integral from the first to the last corner."""
        return float(self._area[-1])

    def at(self, time: ArrayLike) -> FloatArray:
        """Its value at each time; after a jump at the jump itself."""
        times = floats(time)
        piece = np.searchsorted(self._ends, times, side="right")
        return floats(self._value[piece] + self._slope[piece] * (times - self._begin[piece]))

    def averages(self, step: float, count: int) -> FloatArray:
        """Its mean over each of `count` steps from time 0 on, shape (count,)."""
        edges = step_edges(step, count)
        piece = np.searchsorted(self._ends, edges, side="right")
        local = edges - self._begin[piece]
        value, slope = self._value[piece], self._slope[piece]
        before, first = piece[:-1], piece[1:]
        # Where both edges are on one piece, its value at the middle; differences of areas are taken only over whole
        # pieces, so that a long record loses no digits.
        means = value[:-1] + 0.5 * slope[:-1] * (local[:-1] + (edges[1:] - self._begin[before]))
        across = np.flatnonzero(before != first)
        if across.size:
            left, right = before[across], first[across]
            end = self._ends[left]
            tail = (end - edges[across]) * (
                value[across] + 0.5 * slope[across] * (local[across] + end - self._begin[left])
            )
            head = local[1:][across] * (value[1:][across] + 0.5 * slope[1:][across] * local[1:][across])
            whole = self._area[right] - self._area[left + 1]
            means[across] = (tail + whole + head) / (edges[across + 1] - edges[across])
        return floats(means)


class StraightSignal(ABC):
    """A signal of straight pieces."""

    @property
    @abstractmethod
    def _pieces(self) -> StraightPieces: ...

    @property
    def velocity_change(self) -> float:
        """Its integral."""
        return self._pieces.area

    def at(self, time: ArrayLike) -> FloatArray:
        """Its value at each time [s]; at a jump the one after it."""
        return self._pieces.at(time)

    def averages(self, step: float, count: int) -> FloatArray:
        """Its mean over each of `count` steps, shape (count,)."""
        return self._pieces.averages(step, count)


def smooth_averages(
    function: Callable[[FloatArray], FloatArray],
    angular_rate: float,
    corners: FloatArray,
    step: float,
    count: int,
) -> FloatArray:
    """Means of a function over each of `count` steps from time 0 on, to rounding, by Gauss-Legendre quadrature.

    Parameters
    ----------
    function : callable              Of times, shape (K,); smooth between its corners.
    angular_rate : float             Its highest angular frequency [rad/s].
    corners : ndarray, shape (C,)    Where it jumps or bends [s].
    step : float                     [s]
    count : int

    Returns
    -------
    ndarray, shape (count,)

    Raises
    ------
    MountedSystemError               If a step takes in thousands of periods.
    """
    panels = max(1, math.ceil(angular_rate * step / _PANEL_PHASE))
    if panels > _PANELS_AT_ONCE:
        raise MountedSystemError(
            f"A step of {step:g} s takes in {angular_rate * step / (2.0 * math.pi):.3g} periods of a sine of up to "
            f"{angular_rate / (2.0 * math.pi):g} Hz; shorten the step."
        )
    at_once = _PANELS_AT_ONCE // panels
    means = np.empty(count)
    for first in range(0, count, at_once):
        steps = min(at_once, count - first)
        grid = step_edges(step / panels, steps * panels, first * panels)
        within = corners[(corners > grid[0]) & (corners < grid[-1])]
        cuts = np.sort(np.concatenate([grid, within]))
        half = 0.5 * np.diff(cuts)
        nodes = (cuts[:-1] + half)[:, None] + half[:, None] * _NODES
        areas = half * (function(nodes.ravel()).reshape(nodes.shape) @ _WEIGHTS)
        begins = np.searchsorted(cuts, grid[:-1:panels])
        means[first : first + steps] = np.add.reduceat(areas, begins) / step
    return means


def check_level(value: float, name: str) -> None:
    """Refuse what no signal reaches."""
    if not abs(value) <= LARGEST_SIGNAL:
        raise MountedSystemError(f"`{name}` must be finite and within +-{LARGEST_SIGNAL:g}, got {value!r}.")


def check_duration(value: float, name: str) -> None:
    """Refuse what is no duration."""
    if not DURATION_RANGE[0] <= value <= DURATION_RANGE[1]:
        raise MountedSystemError(
            f"`{name}` must be within [{DURATION_RANGE[0]:g}, {DURATION_RANGE[1]:g}] s, got {value!r}."
        )


def check_interval(value: float) -> None:
    """Refuse what is no interval between two samples."""
    if not _INTERVAL_RANGE[0] <= value <= _INTERVAL_RANGE[1]:
        raise MountedSystemError(
            f"The interval between two samples must be within [{_INTERVAL_RANGE[0]:g}, {_INTERVAL_RANGE[1]:g}] s, got "
            f"{value!r}."
        )
