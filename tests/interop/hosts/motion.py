"""The displacement that every tool of the matrix applies, and the times at which force and energy are compared."""

from __future__ import annotations

import numpy as np

# Exact in binary and a whole number of nanoseconds, so that no tool's clock drifts.
STEP = 2.0**-9  # s
STROKE = 3072 * STEP  # s
# Where the path turns, in the coordinates of the FMU [m]; the inner loops are minor ones.
TURNS = np.array([0.0, 0.012, -0.013, 0.004])
STOP = STROKE * (len(TURNS) - 1)
TIMES = STEP * np.arange(round(STOP / STEP) + 1)


def _stroke(time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the stroke of a time begins [m], its length [m] and the share of its duration that has passed."""
    k = np.clip((time // STROKE).astype(int), 0, len(TURNS) - 2)
    return TURNS[k], TURNS[k + 1] - TURNS[k], time / STROKE - k


def displacement(time: np.ndarray) -> np.ndarray:
    """Half periods of cosines from turn to turn, so that all turns are at communication points [m]."""
    begin, length, share = _stroke(time)
    return begin + 0.5 * length * (1.0 - np.cos(np.pi * share))


def velocity(time: np.ndarray) -> np.ndarray:
    """The rate of that [m/s]."""
    _, length, share = _stroke(time)
    return 0.5 * length * np.pi / STROKE * np.sin(np.pi * share)


# Inputs of FMUs by name; an FMU without states has the first only.
SIGNALS = {"displacement": displacement, "velocity": velocity}
