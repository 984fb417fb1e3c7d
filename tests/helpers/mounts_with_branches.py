"""Records of springs with a second mechanism and Maxwell branches, by formulas of their own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

import oracles
from strandspring import Record, Spring, SpringParameters

FloatArray = NDArray[np.float64]

FIRST = SpringParameters((5.0, 3000.0, 2e4, 1e6), (1.0, 5.0), 15.0, 400.0, 1.2, 0.9, 0.0, -0.02, 0.02)
SECOND = SpringParameters((0.0,), (1.0,), 12.0, 3000.0, 0.7, 1.5, 0.0, -0.02, 0.02)


def maxwell(time: FloatArray, path: FloatArray, stiffness: float, time_constant: float) -> FloatArray:
    """Force of a Maxwell branch [N]."""
    return oracles.maxwell(stiffness, time_constant, path, time)


def sines(amplitudes: Sequence[float], frequency: float, cycles: int = 3, samples: int = 250) -> tuple[FloatArray, ...]:
    """Time [s] and displacement [m] of sines of several amplitudes, one after the other."""
    phase = np.arange(cycles * samples) / samples
    path = np.concatenate([amplitude * np.sin(2.0 * np.pi * phase) for amplitude in amplitudes])
    return np.arange(path.size) / (samples * frequency), path


def record(
    time: FloatArray,
    path: FloatArray,
    branches: Sequence[tuple[float, float]] = (),
    second: bool = False,
    noise: float = 0.1,
    seed: int = 0,
    name: str = "mount.csv",
) -> Record:
    """What a mount gives, with white noise [N]; branches are pairs of stiffness [N/m] and time constant [s]."""
    force = sum((Spring(one).response(path) for one in (FIRST, SECOND)[: 1 + second]), np.zeros(path.size))
    force = sum((maxwell(time, path, *branch) for branch in branches), force)
    return Record(path, force + noise * np.random.default_rng(seed).standard_normal(path.size), time=time, path=name)


def two_rates(seed: int = 0, ratio: float = 5.0, **mount: object) -> list[Record]:
    """Records of three amplitudes at two rates."""
    return [
        record(*sines((0.008, 0.014, 0.02), frequency), seed=seed + k, name=f"rate_{k}.csv", **mount)  # type: ignore[arg-type]
        for k, frequency in enumerate((0.5, 0.5 * ratio))
    ]
