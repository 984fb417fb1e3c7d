"""A batch of springs about a nominal one, a file each."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from strandspring import Spring, SpringParameters
from synthetic import AMPLITUDE, MEAN, spring_of

NOMINAL = spring_of(1.0, 1.2)
_SCATTER = 0.05  # of stiffness, kappa_omega, rho, sigma and n from spring to spring
_NOISE = 0.005  # of the force, share of its rms
_SHARES = (0.4, 0.7, 1.0)


def one_of(seed: int, stiffness: float = 1.0) -> SpringParameters:
    """A spring of the batch."""
    share = np.exp(_SCATTER * np.random.default_rng(seed).standard_normal(5)).tolist()
    kE = tuple(stiffness * share[0] * c for c in NOMINAL.kE)
    others = dict(zip(("kappa_omega", "rho", "sigma", "n"), share[1:], strict=True))
    return replace(NOMINAL, kE=kE, **{name: part * getattr(NOMINAL, name) for name, part in others.items()})


def measured(seed: int, rows: int, stiffness: float = 1.0) -> np.ndarray:
    """Time [s], displacement [mm] and force [N] of two cycles at each of three amplitudes, shape (rows, 3)."""
    time = 6.0 * np.arange(rows) / rows
    share = np.take(_SHARES, (time / 2.0).astype(int))
    path = MEAN + AMPLITUDE * share * np.sin(2.0 * np.pi * time)
    force = Spring(one_of(seed, stiffness)).response(path)
    noise = _NOISE * float(np.sqrt(np.mean(force**2))) * np.random.default_rng((seed, 1)).standard_normal(rows)
    return np.column_stack([time, 1e3 * path, force + noise])


def write(path: Path, table: np.ndarray) -> None:
    """A record as a rig writes it."""
    header = "time [s],displacement [mm],force [N]"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt=["%.4f", "%.5f", "%.4f"])


def write_batch(folder: Path, count: int, rows: int) -> None:
    """Files of springs 0 and so on."""
    folder.mkdir(parents=True, exist_ok=True)
    for seed in range(count):
        write(folder / f"spring_{seed:04d}.csv", measured(seed, rows))
